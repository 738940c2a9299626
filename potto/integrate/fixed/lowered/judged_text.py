"""The text of a product rule whose Legendre coefficients tell what it leaves out, as LLVM reads it.

Owns `JudgedText`. What `gauss.analytic_truncation` makes of coefficients by numpy is worked out beside the nodes, for
as many orders as are asked for: a rule leaves out no more than one with fewer nodes would.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from potto.integrate.fixed.lowered.adding_text import BEYOND, AddingText
from potto.integrate.fixed.lowered.formula_text import ParameterPlace, still
from potto.integrate.rules.gauss import PEAK

# Behind the number of rows the frame tells how many orders are looked at, and where tables of them are: for each, and
# each variable, how many coefficients are compared with as many before them, 0 of a polynomial, and from where on; and
# two powers of what they fall by.
LOOKS, PLACES, POWERS = range(BEYOND, BEYOND + 3)
QUARTERS = 3


class JudgedText(AddingText):
    """Writes the function. Behind the first one, rows of results say for which cells each order would do by itself."""

    def text(self, places: Sequence[ParameterPlace]) -> str:
        at, k1 = self.at, self.k1
        self.begin()
        self.added = [at.room(at.whole("mul", table[1], k1)) for table in self.tables]
        corners, largest = at.room(1), at.room(1)
        here = self.cells(places)
        at.store(self.zero, corners)
        at.store(self.zero, largest)
        for memory, table in zip(self.added, self.tables, strict=True):
            self.fill(memory, table[1], k1)
        found = self.every(0, here, [self.one, *[None] * (k1 - 1)], largest)
        number, rounding, gross = self.off(found, here)
        self.ends(0, {name: still(symbol) for name, symbol in here.items()}, corners)
        peak = at.apply("gt", at.load(corners), at.apply("mul", at.number(PEAK), at.load(largest)))
        self.only(at.apply("not", peak))
        sizes = self.known(number)
        beyond = self.least(sizes, gross)
        good = self.good(sizes, gross, beyond)
        self.flag(0, good)
        self.add([*number, *rounding, *gross, *beyond], good)
        return self.end()

    def least(self, sizes: Sequence[str], gross: Sequence[str]) -> list[str]:
        """The least that is left out by any order. For which cells each does is noted."""
        at = self.at
        rooms, sums = [at.room(1) for _ in gross], [at.room(1) for _ in gross]
        for room in rooms:
            at.store(at.number(np.inf), room)
        look = at.begin(self.behind(LOOKS))
        for room in sums:
            at.store(self.zero, room)
        for i in range(len(self.tables)):
            self.left_out(i, at.whole("add", at.whole("mul", look, len(self.tables)), i), sums)
        beyond = list(map(at.load, sums))
        self.flag(at.whole("add", look, 1), self.good(sizes, gross, beyond))
        for room, x in zip(rooms, beyond, strict=True):
            at.store(at.apply("min", at.load(room), x), room)
        at.end()
        return list(map(at.load, rooms))

    def left_out(self, i: int, look: str, sums: Sequence[str]) -> None:
        """Add what a rule leaves out along variable i, if that is not a polynomial, by this one of the looks."""
        at = self.at
        width, start = self.told(PLACES, look, "i64")
        ahead, squared = map(at.spread, self.told(POWERS, look, "double"))
        at.begin("1", at.let(f"icmp ne i64 {width}, 0"))
        first, before, last = (
            self.added_up(i, at.whole("add", start, at.whole("mul", width, quarter)), width)
            for quarter in range(QUARTERS)
        )
        for room, *falling in zip(sums, first, before, last, strict=True):
            at.store(at.apply("add", at.load(room), self.truncation(falling, ahead, squared)), room)
        at.end()

    def told(self, slot: int, look: str, kind: str) -> list[str]:
        """The two numbers of a look in a table."""
        at, table = self.at, self.behind(slot, "ptr")
        places = (at.at(table, at.whole("add", at.whole("mul", look, 2), own), kind) for own in range(2))
        return [at.let(f"load {kind}, ptr {place}") for place in places]

    def added_up(self, i: int, start: str, count: str) -> list[str]:
        """The sums of some sizes of coefficients along variable i, one after the other."""
        at, k1 = self.at, self.k1
        j, before = at.adding(count, k1)
        base = at.whole("mul", at.whole("add", start, j), k1)
        after = [at.apply("add", x, at.load(at.at(self.added[i], at.whole("add", base, c))))
                 for c, x in enumerate(before)]  # fmt: skip
        at.end(*after)
        return after

    def truncation(self, falling: Sequence[str], ahead: str, squared: str) -> str:
        """`gauss.analytic_truncation`, by the sums over quarters of coefficients."""
        at, half, (first, before, last) = self.at, self.at.number(0.5), falling
        falls = self.greater(at.apply("div", last, before), at.apply("sqrt", at.apply("div", last, first)))
        logarithm = at.apply("log", at.apply("min", self.greater(falls, self.zero), self.one))
        power, square = (at.apply("exp", at.apply("mul", exponent, logarithm)) for exponent in (ahead, squared))
        slow = at.apply("min", self.one, at.apply("div", at.apply("sub", square, half), half))
        return at.apply("mul", at.apply("mul", at.number(8.0), last), at.apply("max", power, slow))
