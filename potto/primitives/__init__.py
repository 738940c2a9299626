"""The builtins of Potto.

Owns nothing itself: importing it registers every entry, file by file, in `PRIMITIVES`. See `registry` for what an
entry says.
"""

from potto.primitives import (  # noqa: F401  (imported for their entries)
    arithmetic,
    elementary,
    hyperbolic,
    logic,
    piecewise,
    special,
    trigonometric,
)
from potto.primitives.registry import EXACT, PRIMITIVES, UNDOES, Primitive, register

__all__ = ["EXACT", "PRIMITIVES", "UNDOES", "Primitive", "register"]
