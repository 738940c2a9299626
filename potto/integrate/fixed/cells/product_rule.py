"""One product rule for cells of one shape, whoever's they are, and how far off it is.

Owns `ProductRule`, `way_of`, `added_together` and `Measured`. What the nodes amount to is worked out by numpy, or by
machine code once that pays; what follows from it is said here.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from potto.integrate.fixed.axes import MEAN, Axis, Raw, axis
from potto.integrate.fixed.cells.nodes import at_once
from potto.integrate.fixed.cells.topologies import Alike
from potto.integrate.fixed.lowered.adding_text import ELSEWHERE, PARTS, TRACKED
from potto.integrate.fixed.lowered.cells import Judged, Left, LoweredCells, Proved, Run, Wanted, lowered_cells
from potto.integrate.fixed.lowered.judged_text import JudgedText
from potto.integrate.fixed.lowered.total_text import TotalText
from potto.integrate.fixed.moving_sums import SUMMED
from potto.integrate.fixed.straight import StraightIntegral
from potto.integrate.pieces import Evaluator
from potto.integrate.rules.gauss import PEAK, analytic_truncation, telling
from potto.kernels.cells import Array, Bools, Ints, Value

STRAIGHT = (False, False)  # no end of a stretch is like a square root
# A rule is good enough for a cell if what it may be off is this part of the accuracy asked for; for a few members, whom
# more nodes cost next to nothing, this part of the number.
SHARE, TIGHT = 0.01, 1e-13
# Up to how many members are few.
FEW = 64
# A rule more takes as long as so many nodes: 10 us by machine code, 0.3 ms by numpy.
CALL = 1 << 14
# What errors may be where what is added up cancels, as a part of that: no other way would mend it.
CANCELS = 1e-13


class Measured(Struct, frozen=True):
    """Integrals over cells (1 + k, M), how far rounding puts them off, what is added up for them, and how far off the
    rule is."""

    number: Array
    rounding: Array
    gross: Array
    truncated: Array


class ProductRule(Struct, frozen=True):
    """A product rule for cells of one shape, with so many nodes for each variable.

    exact: the variables whose coefficients need not tell what it leaves out, as of polynomials. way: how machine code
    does it (`way_of`). beyond: what is proved that it leaves out of each cell, (1 + k, cells). tight: whether all
    digits are wanted. skipped: the orders of rules with fewer nodes that were not tried before this one: it leaves out
    no more than they would, and their coefficients may tell more, as its own last ones may be made of rounding.
    """

    plan: StraightIntegral
    cell: Alike
    orders: tuple[int, ...]
    exact: tuple[bool, ...]
    machine: Evaluator
    way: LoweredCells
    tight: bool
    beyond: Array | None = None
    skipped: tuple[tuple[int, ...], ...] = ()

    @property
    def nodes(self) -> int:
        return math.prod(self.orders)

    @property
    def asked(self) -> list[tuple[int, ...]]:
        """Which coefficients are asked for along each variable."""
        those = (lambda order: tuple(range(order))) if self.skipped else telling
        return [MEAN if exact else those(order) for order, exact in zip(self.orders, self.exact, strict=True)]

    def applied(self, env: dict[str, Value], index: Ints) -> Measured:
        """The integrals over some of the cells."""
        return self._measured(self._raw(env, index), index, *self.skipped, self.orders)

    def foreseen(self, env: dict[str, Value], index: Ints, others: Sequence[ProductRule]) -> Iterator[Bools]:
        """For which cells rules with no more nodes than this one would do, by its coefficients."""
        whole = replace(self, skipped=tuple(other.orders for other in others))
        function = self.way.function(self.machine)
        if function is None:
            raw = whole._raw(env, index)
            return (other.good(self._measured(raw, index, other.orders)) for other in others)
        self.machine.count(index.size * self.nodes)
        cells = self.cell.members.take(index), self.cell.between.take(index)
        run = Run(whole.axes(index), 0, index.size, self._beside(index))
        nowhere = np.zeros((PARTS + 1, 1 + self.machine.directions, int(cells[0].max()) + 1))
        asked = Wanted(*self._parts, False), whole.judged(*whole.skipped)
        return iter(self.way.add(function, env, *cells, [run], *asked, nowhere, False)[1:])

    def left(self, index: Ints) -> Left:
        """How it is known what this rule leaves out of some cells."""
        if all(self.exact):
            return Proved(None if self.beyond is None else self.beyond.take(index, 1))
        return self.judged(*self.skipped, self.orders)

    def judged(self, *orders: tuple[int, ...]) -> Judged:
        """What these orders have of its coefficients."""
        return Judged(orders, self.orders, tuple(map(len, self.asked)))

    def axes(self, index: Ints) -> list[Axis]:
        """The nodes along each variable, for some cells."""
        turning = [STRAIGHT if exact else ends for exact, ends in zip(self.exact, self.cell.turning, strict=True)]
        several = self._several(index)
        return [axis(*own, several) for own in zip(self.orders, self.asked, turning, strict=True)]

    def _raw(self, env: dict[str, Value], index: Ints) -> Raw:
        self.machine.count(index.size * self.nodes)
        members, between = self.cell.members.take(index), self.cell.between.take(index)
        with self.way.promotion.by_numpy():
            return at_once(self.plan, self.cell.face, self.machine, env, members, between, self.axes(index))

    def _several(self, index: Ints) -> bool:
        """Whether there are so many nodes that rounding is followed at few of them."""
        return index.size * self.nodes > TRACKED

    def _beside(self, index: Ints) -> float:
        """How many times more rounding may be than at the nodes where it is followed."""
        return ELSEWHERE if self._several(index) else 1.0

    def _measured(self, raw: Raw, index: Ints, *orders: tuple[int, ...]) -> Measured:
        """What the first coefficients tell, as many as any of these orders have."""
        truncated = np.zeros(raw.number.shape) if self.beyond is None else self.beyond.take(index, 1)
        clear = raw.clear
        if raw.corners is not None and raw.largest is not None:
            truncated = np.minimum.reduce([self._truncated(raw, own) for own in orders])
            clear = clear & ~(raw.corners > PEAK * raw.largest)
        truncated[:, ~clear] = np.inf
        gross = np.maximum(raw.most, np.abs(raw.number))
        rounding = self._beside(index) * raw.off + ELSEWHERE * SUMMED * gross
        return Measured(raw.number, rounding, gross, truncated)

    def _truncated(self, raw: Raw, orders: tuple[int, ...]) -> Array:
        """What a rule with so many nodes leaves out, by its coefficients."""
        truncated = np.zeros(raw.number.shape)
        for most, order, exact, sizes in zip(self.orders, orders, self.exact, raw.coefficients, strict=True):
            if not exact:
                truncated += analytic_truncation(sizes[..., : sizes.shape[-1] - most + order], order)
        return truncated

    def good(self, found: Measured, known: Array | None = None) -> Bools:
        """For which cells the rule does. known: what is known already of the whole that each goes into."""
        size = np.abs(found.number) if known is None else np.maximum(np.abs(found.number), np.abs(known))
        part, added = self._parts
        return np.asarray((found.truncated <= np.maximum(part * size, added * found.gross)).all(axis=0))

    @property
    def _parts(self) -> tuple[float, float]:
        """What may be left out, as parts of the number and of what is added up."""
        return (TIGHT, TIGHT) if self.tight else (SHARE * self.machine.rtol, CANCELS)


def way_of(
    plan: StraightIntegral, cell: Alike, exact: Sequence[bool], machine: Evaluator, env: dict[str, Value]
) -> LoweredCells:  # fmt: skip
    """How machine code does rules for these cells."""
    return lowered_cells(plan, cell.face, machine.directions, env, TotalText if all(exact) else JudgedText)


def added_together(
    rules: Sequence[tuple[ProductRule, Ints]], env: dict[str, Value], total: Array
) -> tuple[Ints, Bools] | None:  # fmt: skip
    """Add the integrals over some cells to those of their members, by machine code: which cells, and which of them were
    good enough. None where that is left to numpy.

    rules: of cells of one shape, each with those that it is for; several only where it is proved what they leave out.
    total: (4, 1 + k, B), as of what is `Measured`.
    """
    first, index = rules[0][0], rules[0][1] if len(rules) == 1 else np.concatenate([own for _, own in rules])
    function = first.way.function(first.machine)
    if function is None:
        return None
    first.machine.count(sum(rule.nodes * own.size for rule, own in rules))
    runs, start = [], 0
    for rule, own in rules:
        runs.append(Run(rule.axes(own), start, start + own.size, rule._beside(own)))
        start += own.size
    wanted = Wanted(*first._parts, index.size <= FEW)
    members, between = first.cell.members.take(index), first.cell.between.take(index)
    left = first.left(index)
    return index, first.way.add(function, env, members, between, runs, wanted, left, total)[0]
