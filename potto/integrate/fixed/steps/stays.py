"""Whether parameters stay where they are, so that what holds all over a region of them is worth finding out.

Owns `Stay`. Step functions take any parameters, and the same time for all. Where the cells are the same all over a
region, and a rule for them is proved there, nothing is left to be found out at a call; but that takes as long as many.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from msgspec import Struct

# How near parameters are to each other, as a part of their size, or of the range of the variable: as in the parts of a
# region of which is asked first whether cells are the same all over.
NEAR = 2.0**-9
# What settling a region takes for each cut, in calls: 0.4 ms between 5 to 13 of them, where a call takes 0.25, and 0.1
# once that is done.
PRICE = 2


class Stay(Struct):
    """How many calls one after the other have had parameters in a box. Who has stayed there for as long as it takes to
    settle a region is taken to go on: that takes at most twice the least.

    names: of the parameters. price: in calls. reach: of the variable; 0 where it is not the same for all parameters.
    """

    names: tuple[str, ...]
    price: int
    reach: float
    box: tuple[tuple[str, float, float], ...] | None = None
    calls: int = 0

    def due(self, env: Mapping[str, Any]) -> bool:
        """Whether a region about these parameters is to be settled, which this is one call more of."""
        if not self._inside(env):
            self.calls = 0
            self.box = tuple([(name, x - away, x + away) for name in self.names
                              for x in (env[name].v,) for away in (NEAR * max(abs(x), self.reach),)])  # fmt: skip
        self.calls += 1
        return self.calls > self.price

    def paid(self) -> None:
        """Note that this has been tried."""
        self.calls = 0

    def _inside(self, env: Mapping[str, Any]) -> bool:
        if self.box is None:
            return False
        for name, low, high in self.box:  # noqa: SIM110 - runs with every call: no generator
            if not low <= env[name].v <= high:
                return False
        return True
