"""What product rules share that add what they find to the sums of members, as LLVM reads it.

Owns `AddingText`. The integral over a cell, and how far off it is, go to the member whose it is on the spot, if it is
good enough. Several cells of a member may be done at a time, so that they are added one after the other.
"""

from __future__ import annotations

from collections.abc import Sequence

from potto.integrate.fixed.lowered.formula_text import Dual, Env
from potto.integrate.fixed.lowered.rule_text import RuleText
from potto.integrate.fixed.moving_sums import SUMMED

# Of the constants, the first ones: what is good enough, as parts of the number and of what is added up; and how many
# times more rounding may be than at the nodes where it is followed.
PART, ADDED, BESIDE = range(3)
# At how many nodes rounding is followed at each; at a few of them, where there are more.
TRACKED = 1 << 14
# How many times more rounding may be elsewhere than at the nodes where it is followed.
ELSEWHERE = 2.0
# Behind the columns the frame tells where the sums are, and how long their rows; whether what is known of the whole
# counts; how many cells there are, those behind them being done for nobody; how many rows of sums there are; then what
# tells how much is left out.
TOTAL, LENGTH, WHOLE, THERE, ROWS, BEYOND = range(6)
PARTS = 3  # of a sum, before what is left out of it: a number, its rounding, and what is added up


class AddingText(RuleText):
    """Writes the part behind the nodes. The first row of results says which cells were good enough."""

    reserved = 3

    def off(self, number: Dual, here: Env) -> tuple[list[str], list[str], list[str]]:
        """The integrals over the cells of a block, what rounding puts them off, and what is added up for them."""
        at, values = self.at, [x or self.zero for x in number]
        sizes, off = self.rounded(here)
        beside, share = at.constant("%constants", BESIDE), at.number(ELSEWHERE * SUMMED)
        gross = [at.apply("max", x or self.zero, at.apply("abs", v)) for x, v in zip(sizes, values, strict=True)]
        rounding = [at.apply("add", at.apply("mul", beside, x or self.zero), at.apply("mul", share, most))
                    for x, most in zip(off, gross, strict=True)]  # fmt: skip
        return values, rounding, gross

    def flag(self, row: int | str, good: str) -> None:
        """Say of which cells something is true. Of those that are done twice it is said the first time: after that they
        may be in what is known of the whole."""
        at, place = self.at, self.place(row)
        before = at.apply("select", self.fresh, self.zero, at.load(place))
        at.store(at.apply("select", at.apply("and", good, self.fresh), self.one, before), place)

    @property
    def fresh(self) -> str:
        """A mask of the cells of a block that were not in the one before."""
        return self.at.apply("ge", self.owners(), self.spread(self.number))

    def behind(self, slot: int, kind: str = "i64") -> str:
        """What the frame tells behind the columns."""
        return self.at.address("%frame", self.tail + slot, kind)

    def known(self, number: Sequence[str]) -> list[str]:
        """How large numbers are, or what they go into is known to be."""
        at, rooms = self.at, [self.at.room(1) for _ in number]
        for x, room in zip(number, rooms, strict=True):
            at.store(at.apply("abs", x), room)
        at.begin("1", self.holds(WHOLE))
        for c, room in enumerate(rooms):
            row = at.at(self.behind(TOTAL, "ptr"), at.whole("mul", c, self.behind(LENGTH)), "double")
            self.raise_to(room, at.apply("abs", at.gather(row, self.members)))
        at.end()
        return list(map(at.load, rooms))

    def good(self, sizes: Sequence[str], gross: Sequence[str], beyond: Sequence[str]) -> str:
        """A mask of the cells of which no more is left out than may be."""
        at = self.at
        part, added = (at.constant("%constants", slot) for slot in (PART, ADDED))
        good = at.apply("gt", at.load(self.clear), self.zero)
        for size, most, left in zip(sizes, gross, beyond, strict=True):
            enough = at.apply("max", at.apply("mul", part, size), at.apply("mul", added, most))
            good = at.apply("and", good, at.apply("le", left, enough))
        return good

    def holds(self, slot: int) -> str:
        return self.at.once(f"icmp ne i64 {self.behind(slot)}, 0", self.behind(slot))

    def add(self, values: Sequence[str], good: str) -> None:
        """Add these rows to those of the members, for the cells of a mask that are not done twice."""
        at, room = self.at, self.at.room(len(values))
        there = at.apply("lt", self.owners(), self.spread(self.behind(THERE)))
        mask = at.apply("and", good, at.apply("and", self.fresh, there))
        for slot, value in enumerate(values):
            at.store(at.apply("select", mask, value, self.zero), at.at(room, slot))
        owners = [at.once(f"extractelement {at.whole_numbers} {self.members}, i32 {lane}", self.members)
                  for lane in range(at.lanes)]  # fmt: skip
        row = at.begin(self.behind(ROWS))
        start, found = at.whole("mul", row, self.behind(LENGTH)), at.load(at.at(room, row))
        for lane, owner in enumerate(owners):
            place = at.at(self.behind(TOTAL, "ptr"), at.whole("add", start, owner), "double")
            before = at.let(f"load double, ptr {place}")
            own = at.let(f"extractelement {at.doubles} {found}, i32 {lane}")
            at.line(f"store double {at.let(f'fadd double {before}, {own}')}, ptr {place}")
        at.end()
