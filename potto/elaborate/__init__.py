"""From the tree to core terms: the only bridge.

Owns `core`, `elaborate_expression`, `diffeo_core` and `signature`. Needs no types: scopes say what a name means, and
what a condition elaborates to says which conditional it makes. Where the program is wrong there is a `Hole`; the
checker has said why.
"""

from potto.elaborate.definitions import (
    DiffeoCore,
    Elaborated,
    core,
    diffeo_core,
    elaborate_expression,
)
from potto.elaborate.signatures import Signature, signature

__all__ = ["DiffeoCore", "Elaborated", "Signature", "core", "diffeo_core", "elaborate_expression", "signature"]
