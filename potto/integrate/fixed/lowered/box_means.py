"""The mean values of an integrand over boxes, and what nodes tell of them, as LLVM reads it.

Owns `BoxMeans`, on which `box_text` is built. In loops over the nodes of the variables, from the outermost to the
innermost, means and the sizes of their Legendre coefficients are added up, sizes of the integrand in registers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from potto.integrate.fixed.axes import ENDS
from potto.integrate.fixed.lowered.formula_text import Symbol
from potto.integrate.fixed.lowered.rule_text import RuleText
from potto.integrate.panels.roundoff import WITHIN
from potto.integrate.rules.gauss import gauss
from potto.kernels.native.operations import NotStraight

# Up to how many nodes of a variable their coefficients are written out.
UNROLLED = 4


class BoxMeans(RuleText):
    """Writes the part that goes through nodes.

    orders: the nodes of each variable. low, sizes: where boxes begin along each, and how long they are. Memory: per
    variable of the sizes of coefficients along it, `added`; of each number, tangents among them, the sizes and errors
    that are added up, `most` and `own`; of each number the largest size at nodes and at corners, `largest` and `peaks`.
    """

    orders: Sequence[int]
    low: list[str]
    sizes: list[str]
    added: list[str]
    most: list[str]
    own: list[str]
    largest: list[str]
    peaks: list[str]

    def mean(self, i: int, env: dict[str, Symbol], outer: str) -> list[str | None]:
        """The mean values over variable i and those further in. outer: the weight of the node of those further out."""
        at, last = self.at, i + 1 == len(self.sizes)
        n, _, _, nodes, _, weights, *_ = self.tables[i]
        j, before = at.adding(n, 2 * self.channels + len(self.largest) if last else 0)
        weight = at.apply("mul", outer, at.constant(weights, j))
        node = self.between(i, at.constant(nodes, j))
        inner = {**env, self.plan.variables[i]: Symbol(node, None, (None,) * (self.k1 - 1), ())}
        after: list[str | None] = []
        if last:
            values, after = self.values(inner, weight, before)
        else:
            values = self.mean(i + 1, inner, weight)
        means = self.along(i, j, values, after, outer)
        for room, x in zip((*self.most, *self.own), after, strict=False):
            if x is not None:
                at.store(at.apply("add", at.load(room), x), room)
        for room, x in zip(self.largest, after[2 * self.channels :], strict=False):
            self.raise_to(room, x or self.zero)
        return means

    def along(
        self, i: int, j: str, values: Sequence[str | None], after: Sequence[str | None], outer: str
    ) -> list[str | None]:  # fmt: skip
        """End the loop over the nodes j of variable i: the mean values. The sizes of coefficients are added up."""
        if self.orders[i] <= UNROLLED:
            return self.written_out(i, j, values, after, outer)
        at, each, sums = self.at, self.channels, self.sums[i]
        moving = self.transformed(i, j, values, after)
        row = at.begin(self.tables[i][1])
        base = at.whole("mul", row, each)
        for c in moving:
            where = at.whole("add", base, c)
            size, place = at.apply("abs", at.load(at.at(sums, where))), at.at(self.added[i], where)
            at.store(at.apply("add", at.load(place), at.apply("mul", outer, size)), place)
        at.end()
        return [at.load(at.at(sums, c)) if c in moving else None for c in range(each)]

    def written_out(
        self, i: int, j: str, values: Sequence[str | None], after: Sequence[str | None], outer: str
    ) -> list[str | None]:  # fmt: skip
        """The same without a loop over coefficients, nor one over nodes for each: a few take less than going round."""
        at, order, means = self.at, self.orders[i], list[str | None]([None] * self.channels)
        moving, transform = self.put_by(i, j, values, after), gauss(order).transform.tolist()
        for slot, c in enumerate(moving):
            kept = [at.load(at.at(self.kept[i], node * len(moving) + slot)) for node in range(order)]
            for row in range(order):
                found = at.apply("mul", at.number(transform[0][row]), kept[0])
                for factors, value in zip(transform[1:], kept[1:], strict=True):
                    found = at.apply("muladd", at.number(factors[row]), value, found)
                place = at.at(self.added[i], row * self.channels + c)
                at.store(at.apply("muladd", outer, at.apply("abs", found), at.load(place)), place)
                if not row:
                    means[c] = found
        return means

    def values(
        self, env: dict[str, Symbol], weight: str, before: Sequence[str]
    ) -> tuple[list[str | None], list[str | None]]:  # fmt: skip
        """The integrand's numbers at a node, each with its tangents; then their sizes, and how far off they are where
        parameters are, added to those of the nodes before, and the largest values so far."""
        at = self.at
        cells = self.evaluated(self.face, env, self.machine)
        found = [self.plain(x) for cell in cells for x in (cell.v, *(cell.t or (None,) * (self.k1 - 1)))]
        if len(found) != self.channels:
            raise NotStraight("a tuple of another size")
        errors = [x for cell in cells for x in (cell.e, *(cell.et or (None,) * (self.k1 - 1)))]
        sizes = [None if value is None else at.apply("abs", value) for value in found]
        after = [x and at.apply("muladd", weight, x, own) for x, own in zip((*sizes, *errors), before, strict=False)]
        largest = zip(before[2 * self.channels :], sizes[:: self.k1], strict=True)
        return found, [*after, *(x and at.apply("max", own, x) for own, x in largest)]

    def at_corners(self, i: int, env: dict[str, Symbol]) -> None:
        """Note the largest sizes at the corners, by loops over the ends of variable i and those further in."""
        at = self.at
        end = self.spread(at.begin(str(ENDS)))
        inner = {**env, self.plan.variables[i]: Symbol(self.between(i, end), None, (), ())}
        if i + 1 < len(self.sizes):
            self.at_corners(i + 1, inner)
        else:
            for room, cell in zip(
                self.peaks, self.evaluated(self.face, inner, self.machine.with_directions(0)), strict=True
            ):
                self.raise_to(room, self.finite(at.apply("abs", cell.v)))
        at.end()

    def between(self, i: int, u: str) -> str:
        """Where variable i is, at a place of [0, 1]."""
        return self.at.apply("add", self.low[i], self.at.apply("mul", self.sizes[i], u))

    def shares(self, env: Mapping[str, Symbol]) -> list[str | None]:
        """Which part of each number its own rounding is, by places within, None for 0: see `roundoff.part_of`."""
        at, machine = self.at, self.machine.with_directions(0).tracking()
        met = []
        for part in map(at.number, WITHIN.tolist()):
            inside = {x: Symbol(self.between(i, part), None, (), ()) for i, x in enumerate(self.plan.variables)}
            met.append(self.evaluated(self.face, {**env, **inside}, machine))
        return [self.share(cells) for cells in zip(*met, strict=True)]

    def share(self, cells: Sequence[Symbol]) -> str | None:
        """The same of one number at these places."""
        at, off = self.at, self.total(*(cell.e for cell in cells))
        size = self.total(*(at.apply("abs", cell.v) for cell in cells))
        if off is None or size is None:
            return None
        return at.apply("select", at.apply("gt", off, self.zero), at.apply("div", off, size), self.zero)
