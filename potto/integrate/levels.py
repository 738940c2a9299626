"""The variables of an integral before any number: for each its frame, and the surfaces that cut it.

Owns `LevelPlan` and `Group`.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

from msgspec import Struct

from potto.calculus.decomposition.surface_cuts import Cut
from potto.calculus.decomposition.sweep import Level
from potto.core.terms import Lam, function_of, tuple_

# What the places are that are no cuts, of which none has a number below 0: hints, and such with which no nodes move.
HINT, RESTING = -1, -2


class LevelPlan(Struct, frozen=True, dict=True):
    """One variable: its frame (bounds, then candidate cuts, as one tuple term) and what the cuts are."""

    level: Level
    frame: Lam
    rows: tuple[tuple[int, bool], ...]
    searched: tuple[Cut, ...]
    families: tuple[tuple[int, Any], ...]
    decided: tuple[int, ...]
    surfaces: Lam
    turned: tuple[tuple[int, ...], ...]

    @property
    def variable(self) -> str:
        return self.level.variable

    @cached_property
    def peaks(self) -> bool:
        """Whether it is known of places at which the integrand may be concentrated."""
        return bool(self.level.hints) or any(cut.center for cut in self.level.cuts)

    @cached_property
    def found(self) -> bool:
        """Whether numbers have to find what decides, or bends, along the variable."""
        families = any(not self.level.cuts[number].center for number, _ in self.families)
        return families or any(not cut.center for cut in self.searched)

    @cached_property
    def bounds(self) -> Lam:
        """The bounds alone, as a pair."""
        return function_of(tuple_((self.level.lo, self.level.hi)))


class Group(Struct, frozen=True):
    """A surface with jumps: which branches it decides, and along which traces."""

    number: int
    cut: Cut

    @property
    def up_at_zero(self) -> bool:
        """On which side a stretch lies along which the canonical surface is 0: that of max(x, 0) > 0 where x < 0."""
        if not self.cut.jumps:
            return True
        jump = self.cut.jumps[0]
        return jump.strict != (jump.orientation > 0)
