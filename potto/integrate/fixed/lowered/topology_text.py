"""The text of a function that finds the cells of many members (`topologies`), as LLVM reads it.

Owns `TopologyText`. In loops over the stretches of the variables, from the outermost to the innermost, bounds and cuts
are worked out and put in order, then the sides of surfaces in the middle of each cell. What numpy does for all members
one step after the other (`topologies`) is done for eight of them from end to end.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from functools import reduce

import numpy as np
from msgspec import Struct

from potto.calculus.differentiation.loops import vanishes
from potto.core.terms import children, postorder
from potto.integrate.fixed.lowered.formula_text import Env, FormulaText, ParameterPlace, Symbol
from potto.integrate.fixed.straight import CLEAR, ROW_BITS, StraightIntegral
from potto.integrate.pieces import Evaluator
from potto.kernels.native.elementary import module
from potto.kernels.native.operations import NotStraight

NAME = "topology"
# Numbers of the frame: how many members are worked out, how many there are, how many cells were found; then where it is
# put down who is plain, and whose the cells are, between which rows they lie, and on which sides; then the columns.
COUNT, THERE, FOUND, PLAIN, OWNERS, BETWEEN, SIDES, HEAD = range(8)
# Where a row is put that may lie anywhere, being at infinity and as far off: before the upper bound, so that it is seen
# that the order is not sure.
FARTHEST = np.finfo(float).max / 2
MOST_SIDES = 50  # of which a number can tell each
# Up to how many sides, and terms that are looked at for them, it is told what is integrated there.
TOLD, LOOKED_AT = 5, 1 << 12


def lit_sides(plan: StraightIntegral) -> int | None:
    """A bit for each combination of sides, which is a number with a bit for each surface, in which something is to be
    integrated; None where there are too many."""
    count = len(children(plan.surfaces.body))
    if count > TOLD or len(postorder(plan.body)) << count > LOOKED_AT:
        return None
    faces = (plan.face(tuple(bool(code >> bit & 1) for bit in range(count))) for code in range(1 << count))
    return sum(1 << code for code, face in enumerate(faces) if not vanishes(face))


class Ordered(Struct, frozen=True):
    """Rows in order: their numbers, places and what is near. counted: how many lie between the bounds, these included.
    fine: for whom that is sure."""

    rows: list[tuple[str, str, str]]
    counted: str
    fine: str


class TopologyText(FormulaText):
    """Writes the function. Of the cells of eight members those are put down, one after the other, in which something is
    to be integrated, as far as it is told by which sides that is."""

    def __init__(self, plan: StraightIntegral, machine: Evaluator, merging: bool = False) -> None:
        super().__init__(machine)
        self.resting, self.merging = machine.with_directions(0).tracking(), merging
        self.plan, self.lit = plan, lit_sides(plan)
        if len(children(plan.surfaces.body)) > MOST_SIDES:
            raise NotStraight("more surfaces than a number has bits")

    def text(self, places: Sequence[ParameterPlace]) -> str:
        at = self.at
        self.block()
        self.sure = at.at(at.address("%frame", PLAIN, "ptr"), self.first, "double")
        here, _ = self.parameters(places, HEAD)
        self.own = self.owners()
        fresh = at.apply("ge", self.own, self.spread(self.number))
        self.fresh = at.apply("and", fresh, at.apply("lt", self.own, self.spread(at.address("%frame", THERE))))
        at.store(self.one, self.sure)
        self.over(0, here, "splat (i1 true)", self.zero)
        at.end()
        return module(at, NAME, "ptr %frame, ptr %constants")

    def over(self, i: int, env: Env, there: str, between: str) -> None:
        """The cells over variable i and those further in. there: whose they are. between: rows, as a number."""
        at = self.at
        if i == len(self.plan.variables):
            self.tell(env, there, between)
            return
        merging = self.merging and not i
        cells = self.evaluated(self.plan.frames[i], env, self.machine if merging else self.resting)
        places = self.placed(cells)
        if merging:
            places = self.merged(cells, places)
            env = {name: Symbol(symbol.v, symbol.e, (), ()) for name, symbol in env.items()}
        ordered = self.ordered(places, list(map(self.near, cells)))
        self.only(there, ordered.fine)
        rows, ends = at.room(len(cells)), at.room(len(cells))
        for rank, (row, place, _) in enumerate(ordered.rows):
            at.store(row, at.at(rows, rank))
            at.store(place, at.at(ends, rank))
        j = at.begin(str(len(cells) - 1))
        after = at.whole("add", j, 1)
        own = at.apply("and", at.apply("and", there, ordered.fine), at.apply("gt", ordered.counted, self.spread(after)))
        at.begin("1", at.any(own))
        low, high = (at.load(at.at(ends, which)) for which in (j, after))
        for which in (j, after):
            shifted = at.apply("mul", between, at.number(float(1 << ROW_BITS)))
            between = at.apply("add", shifted, at.load(at.at(rows, which)))
        middle = at.apply("mul", at.number(0.5), at.apply("add", low, high))
        self.over(i + 1, {**env, self.plan.variables[i]: Symbol(middle, None, (), ())}, own, between)
        at.end()
        at.end()

    def placed(self, cells: Sequence[Symbol]) -> list[str]:
        """Where rows are; nowhere, if they were divided by 0 and that tells that they are not roots (`topologies`)."""
        at, ends = self.at, [cell.v for cell in cells[:2]]
        above, below = (at.apply("and", *(at.apply(way, end, self.zero) for end in ends)) for way in ("ge", "le"))
        one_sided, places = at.apply("or", above, below), ends
        for cell in cells[2:]:
            place = cell.v
            if cell.e is not None:
                infinite = at.apply("eq", at.apply("abs", place), at.number(np.inf))
                unknown = at.apply("not", at.apply("eq", cell.e, cell.e))
                nowhere = at.apply("and", one_sided, at.apply("and", infinite, unknown))
                place = at.apply("select", nowhere, at.number(np.nan), place)
            places.append(place)
        return places

    def merged(self, cells: Sequence[Symbol], places: Sequence[str]) -> list[str]:
        """The same for the outermost variable, where a cut that is another one once more is nowhere."""
        at, found = self.at, list(places)
        nothing = (None,) * (self.k1 - 1)
        moving = [[place, *(self.plain(x) or self.zero for x in cell.t or nothing)]
                  for place, cell in zip(places, cells, strict=True)]  # fmt: skip
        rows = self.plan.going_on(0)
        for n, row in enumerate(rows):
            for other in rows[:n]:
                same = (at.apply("eq", x, y) for x, y in zip(moving[row], moving[other], strict=True))
                again = reduce(lambda a, b: at.apply("and", a, b), same)
                found[row] = at.apply("select", again, at.number(np.nan), found[row])
        return found

    def near(self, cell: Symbol) -> str:
        """From where on a place is as good as another: where roots merge just here that is not known."""
        if cell.e is None:
            return self.zero
        at = self.at
        known = at.apply("select", at.apply("eq", cell.e, cell.e), cell.e, at.number(np.inf))
        return at.apply("mul", at.number(CLEAR), known)

    def ordered(self, places: Sequence[str], near: Sequence[str]) -> Ordered:
        """Each row's rank is how many come before it: there are at most a dozen, so that comparing each with each takes
        less than sorting."""
        at, keys = self.at, self.keys(places, near)
        counted, infinite = at.number(2.0), at.number(np.inf)
        for key in keys[2:]:
            counted = at.apply("add", counted, at.apply("select", at.apply("lt", key, infinite), self.one, self.zero))
        ranks = [self.zero] * len(keys)
        for i in range(len(keys)):
            for j in range(i):
                behind = at.apply("le", keys[j], keys[i])
                ranks[i] = at.apply("add", ranks[i], at.apply("select", behind, self.one, self.zero))
                ranks[j] = at.apply("add", ranks[j], at.apply("select", behind, self.zero, self.one))
        rows = [self.ranked(ranks, float(rank), places, near) for rank in range(len(keys))]
        fine = at.apply("lt", at.apply("abs", at.apply("sub", places[1], places[0])), infinite)
        for most, ((_, a, off), (_, b, other)) in enumerate(itertools.pairwise(rows), 1):
            apart = at.apply("gt", at.apply("sub", b, a), at.apply("add", off, other))
            beyond = at.apply("le", counted, at.number(float(most)))
            fine = at.apply("and", fine, at.apply("or", apart, beyond))
        return Ordered(rows, counted, fine)

    def keys(self, places: Sequence[str], near: Sequence[str]) -> list[str]:
        """What rows are put in order by: the bounds at both ends, what does not lie between them behind."""
        at = self.at
        infinite, farthest = at.number(np.inf), at.number(FARTHEST)
        lowest = at.apply("sub", places[0], near[0])
        highest = at.apply("add", places[1], near[1])
        keys = [at.number(-np.inf), at.number(np.finfo(float).max)]
        for place, room in zip(places[2:], near[2:], strict=True):
            lying = at.apply("and", at.apply("ge", place, at.apply("sub", lowest, room)),
                             at.apply("le", place, at.apply("add", highest, room)))  # fmt: skip
            near_enough = at.apply("select", at.apply("lt", place, farthest), place, farthest)
            keys.append(at.apply("select", lying, near_enough, infinite))
        return keys

    def ranked(
        self, ranks: Sequence[str], rank: float, places: Sequence[str], near: Sequence[str]
    ) -> tuple[str, str, str]:
        """The row of this rank: its number, its place, and what is near."""
        at = self.at
        found = (self.zero, places[0], near[0])
        for row in range(1, len(ranks)):
            here = at.apply("eq", ranks[row], at.number(rank))
            own = (at.number(float(row)), places[row], near[row])
            found = tuple(at.apply("select", here, x, y) for x, y in zip(own, found, strict=True))  # type: ignore[assignment]
        return found

    def tell(self, env: Env, there: str, between: str) -> None:
        """Put down the cells of the members of a mask."""
        at, sides = self.at, self.zero
        for bit, cell in enumerate(self.surfaces(env)):
            self.only(there, at.apply("gt", at.apply("abs", cell.v), self.near(cell)))
            above = at.apply("select", at.apply("gt", cell.v, self.zero), at.number(float(1 << bit)), self.zero)
            sides = at.apply("add", sides, above)
        self.put(at.apply("and", there, self.fresh), (self.own, between, sides))

    def put(self, there: str, values: Sequence[str]) -> None:
        """Put down whose a cell is, between which rows, and on which sides, for a mask of members."""
        at = self.at
        if self.lit is not None:
            sides = at.once(f"fptosi {at.doubles} {values[-1]} to {at.whole_numbers}", values[-1])
            shifted = at.once(f"lshr {at.whole_numbers} splat (i64 {self.lit}), {sides}", sides)
            there = at.apply("and", there, at.once(f"trunc {at.whole_numbers} {shifted} to {at.masks}", shifted))
        places = [at.address("%frame", slot, "ptr") for slot in (OWNERS, BETWEEN, SIDES)]
        self.append(there, values, places, at.at("%frame", FOUND, "i64"))

    def surfaces(self, env: Env) -> list[Symbol]:
        surfaces = self.plan.surfaces
        return self.evaluated(surfaces, env, self.resting) if children(surfaces.body) else []

    def only(self, there: str, mask: str) -> None:
        """Members of `there` for whom the mask does not hold are not plain."""
        at = self.at
        fine = at.apply("or", mask, at.apply("not", there))
        at.store(at.apply("select", fine, at.load(self.sure), self.zero), self.sure)
