"""The text of a product rule of which it is known what it leaves out, as LLVM reads it.

Owns `TotalText`. Where it is known beforehand that nodes are enough, or by how much they are not, nothing is left to be
decided beside a cell but whether that is little enough.
"""

from __future__ import annotations

from collections.abc import Sequence

from potto.integrate.fixed.lowered.adding_text import BEYOND, PARTS, ROWS, AddingText
from potto.integrate.fixed.lowered.formula_text import ParameterPlace
from potto.integrate.fixed.lowered.mean_text import MeanText


class TotalText(AddingText, MeanText):
    """Writes the function. Where as many rows of sums are asked for as what is left out has, it is told that."""

    def text(self, places: Sequence[ParameterPlace]) -> str:
        self.begin()
        here = self.cells(places)
        number, rounding, gross = self.off(self.mean(0, here), here)
        beyond = self.beyond()
        good = self.good(self.known(number), gross, beyond)
        self.flag(0, good)
        self.add([*number, *rounding, *gross, *beyond], good)
        return self.end()

    def beyond(self) -> list[str]:
        """What is left out of the cells of a block, where that is told."""
        at = self.at
        rooms = [at.room(1) for _ in range(self.k1)]
        for room in rooms:
            at.store(self.zero, room)
        rows = self.behind(ROWS)
        at.begin("1", at.once(f"icmp ugt i64 {rows}, {PARTS * self.k1}", rows))
        for c, room in enumerate(rooms):
            at.store(at.load(at.at(self.behind(BEYOND + c, "ptr"), self.first, "double")), room)
        at.end()
        return list(map(at.load, rooms))
