"""The registry of families of diffeomorphisms; see `family`."""

from potto.diffeos.family import FAMILIES, DiffeoFamily, Recognition

__all__ = ["FAMILIES", "DiffeoFamily", "Recognition"]
