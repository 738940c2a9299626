"""The names that mean something where nothing else is in scope."""

from __future__ import annotations

from potto.primitives import PRIMITIVES

CONSTANTS = ("pi", "inf")
DERIVATIVES = ("D", "grad")
SPECIALS = ("deriv", "delta", "load", *DERIVATIVES)
PROJECTIONS = ("fst", "snd")
LOOK_UPS = ("interp", "image")
VECTORS = ("len", "dot", "norm", "cross", *LOOK_UPS)


def is_builtin(name: str) -> bool:
    """Whether a program may write a name without defining or importing it."""
    if name in CONSTANTS or name in SPECIALS or name in PROJECTIONS or name in VECTORS:
        return True
    primitive = PRIMITIVES.get(name)
    return primitive is not None and primitive.surface
