"""Where two surfaces meet that have no roots in closed form along a variable.

Owns `Crossing`. What is integrated over that variable has a kink there; numbers find it (`integrate/crossings`).
"""

from __future__ import annotations

from dataclasses import dataclass

from potto.core.terms import Term


@dataclass(frozen=True, slots=True)
class Crossing:
    """first = second = 0 somewhere along `variable` between `lo` and `hi`.

    turning: the second is the slope of the first: its roots appear or merge there, like a square root.
    """

    first: Term
    second: Term
    variable: str
    lo: Term
    hi: Term
    turning: bool = False

    @property
    def free(self) -> frozenset[str]:
        """What the place depends on."""
        return (self.first.free | self.second.free) - {self.variable}
