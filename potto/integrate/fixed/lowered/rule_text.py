"""What the texts of product rules (`cells`) are made of, as LLVM reads them.

Owns `RuleText`. In loops over the nodes of the variables, from the outermost to the innermost, bounds, cuts, nodes and
the integrand are worked out, and Legendre coefficients added up on the way back. A formula is worked out in the
outermost loop in which all that it needs is known.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import zip_longest

import numpy as np

from potto.core.terms import Term, function_of
from potto.integrate.fixed.axes import ENDS
from potto.integrate.fixed.edges import EDGE, edges_of
from potto.integrate.fixed.lowered.formula_text import Dual, Env, ParameterPlace, Symbol, still
from potto.integrate.fixed.lowered.row_text import RowText
from potto.integrate.fixed.straight import ROW_BITS, StraightIntegral, row_shift
from potto.integrate.pieces import Evaluator
from potto.integrate.rules.steepness import exponents_in
from potto.integrate.rules.written_intervals import Names
from potto.kernels.native.elementary import module
from potto.kernels.native.vectors import LANES
from potto.kernels.whole import UNIT_ROUNDOFF

NAME = "rule"
# Numbers of the frame: how many members, how long the rows of results are, and where, how many ends of each stretch are
# looked at; for each variable how many nodes, coefficients and nodes with rounding, then where tables are.
HEAD, PER_AXIS = 4, 9
CELL = 2  # columns that tell of a cell: whose it is, and between which rows it lies


class RuleText(RowText):
    """Writes parts of functions. Lists of 1 + k names have a value first, then its tangents.

    Behind the tables the frame tells where the columns are: whose cells they are, between which rows they lie (a whole
    number each, as of `rows_between`), and those of parameters, a number for every member.

    added: memory for the sizes of coefficients along each variable.
    """

    added: list[str]

    def __init__(self, plan: StraightIntegral, face: Term, machine: Evaluator, lanes: int = LANES) -> None:
        super().__init__(plan, machine, lanes)
        self.face, self.edges = function_of(face), [function_of(edge) for edge in edges_of(face)]
        self.exponents = exponents_in(face)
        self.channels = self.k1

    def text(self, places: Sequence[ParameterPlace]) -> str:
        """The function, for parameters with these parts."""
        raise NotImplementedError

    def cells(self, places: Sequence[ParameterPlace]) -> Env:
        """The parameters of the cells of a block, which are clear so far; between which rows they lie is noted."""
        at, start, count = self.at, self.columns, len(self.plan.variables)
        self.clear = at.room(1)
        self.members, between = (
            at.wholes(at.at(at.address("%frame", start + column, "ptr"), self.first, "i64")) for column in range(CELL)
        )
        self.tail = start + CELL + sum(place.kind == "array" for place in places)
        here, _ = self.parameters(places, start + CELL, 0, self.members)
        rows = [at.digit(between, row_shift(place, count), ROW_BITS) for place in range(2 * count)]
        self.rows = list(zip(rows[::2], rows[1::2], strict=True))
        at.store(self.one, self.clear)
        return here

    def rounded(self, here: Env) -> tuple[Dual, Dual]:
        """The most that is added up over the cells, and what rounding puts it off; that none comes to the edge of where
        a builtin is analytic, nor changes more than nodes see, is noted."""
        at = self.at
        bounds = [(at.room(1), at.room(1)) for _ in self.edges]
        for least, most in bounds:
            at.store(at.number(np.inf), least)
            at.store(self.zero, most)
        self.spans = [(at.room(1), at.room(1)) for _ in self.plan.variables if self.exponents]
        for least, most in self.spans:
            at.store(at.number(np.inf), least)
            at.store(at.number(-np.inf), most)
        found = self.few(0, here, bounds)
        for least, most in bounds:
            self.only(at.apply("gt", at.load(least), at.apply("mul", at.number(EDGE), at.load(most))))
        spans = (Names(at.load(least), at.load(most)) for least, most in self.spans)
        for mask in self.even(self.face.body, here, dict(zip(self.plan.variables, spans, strict=False))):
            self.only(mask)
        return found

    # Columns of numbers

    @property
    def columns(self) -> int:
        """Where the frame tells the columns."""
        return HEAD + PER_AXIS * len(self.plan.variables)

    def begin(self) -> None:
        """Begin the loop over cells, with what the frame tells."""
        at, count = self.at, len(self.plan.variables)
        self.length, self.out = at.address("%frame", 1), at.address("%frame", 2, "ptr")
        self.tables = [[at.address("%frame", HEAD + PER_AXIS * i + j, "i64" if j < 3 else "ptr")
                        for j in range(PER_AXIS)] for i in range(count)]  # fmt: skip
        self.sums = [at.room(at.whole("mul", table[1], self.channels)) for table in self.tables]
        self.kept = [at.room(at.whole("mul", table[0], self.channels)) for table in self.tables]
        self.block()

    def place(self, row: int | str) -> str:
        """Where the results of a block are in a row."""
        at = self.at
        return at.at(self.out, at.whole("add", at.whole("mul", row, self.length), self.first), "double")

    def end(self) -> str:
        """The text, where the loop over cells ends."""
        self.at.end()
        return module(self.at, NAME, "ptr %frame, ptr %constants")

    # The three ways through the nodes

    def every(self, i: int, env: Env, volume: Dual, largest: str) -> Dual:
        """The integral over variable i and those further in. volume: of a node of those further out, with weights."""
        at, k1 = self.at, self.k1
        n, _, _, nodes, speeds, weights, *_ = self.tables[i]
        low, width, *_ = self.stretch(i, env, self.machine)
        volume = self.product(volume, width)
        j = at.begin(n)
        speed, weight = at.constant(speeds, j), at.constant(weights, j)
        inner = {**env, self.plan.variables[i]: self.node(low, width, at.constant(nodes, j))}
        if i + 1 == len(self.plan.variables):
            (cell,) = self.evaluated(self.face, inner, self.machine)
            value: Dual = [cell.v, *map(self.plain, cell.t)]
            self.raise_to(largest, self.finite(at.apply("abs", cell.v)))
        else:
            share = at.apply("mul", weight, speed)
            value = self.every(i + 1, inner, [self.times(x, share) for x in volume], largest)
        value = [self.times(x, speed) for x in value]
        moving = self.transformed(i, j, value)
        self.coefficients(i, volume, moving)
        number = [at.load(at.at(self.sums[i], c)) if c in moving else None for c in range(k1)]
        return self.product(number, width)

    def transformed(self, i: int, j: str, values: Sequence[str | None], after: Sequence[str | None] = ()) -> list[int]:
        """End the loop over the nodes j of variable i, where these are the values, with the coefficients along it, put
        where sums are, of those that are not None; which these are. after: as of `Vectors.end`."""
        at = self.at
        n, rows, _, _, _, _, transform, _, _ = self.tables[i]
        moving = self.put_by(i, j, values, after)

        def kept(j: str, slot: int) -> str:
            return at.at(self.kept[i], at.whole("add", at.whole("mul", j, len(moving)), slot))

        row = at.begin(rows)
        j, sums = at.adding(n, len(moving))
        factor = at.constant(transform, at.whole("add", at.whole("mul", j, rows), row))
        sums = [at.apply("muladd", factor, at.load(kept(j, slot)), x) for slot, x in enumerate(sums)]
        at.end(*sums)
        for c, x in zip(moving, sums, strict=True):
            at.store(x, at.at(self.sums[i], at.whole("add", at.whole("mul", row, self.channels), c)))
        at.end()
        return moving

    def put_by(self, i: int, j: str, values: Sequence[str | None], after: Sequence[str | None]) -> list[int]:
        """End the loop over the nodes j of variable i, with the values that are not None kept; which these are."""
        at, moving = self.at, [c for c, x in enumerate(values) if x is not None]
        first = at.whole("mul", j, len(moving))
        for slot, c in enumerate(moving):
            at.store(values[c] or self.zero, at.at(self.kept[i], at.whole("add", first, slot)))
        at.end(*after)
        return moving

    def coefficients(self, i: int, volume: Dual, moving: Sequence[int]) -> None:
        """Add the sizes of the coefficients along variable i, times the volume of the node further out."""
        at, k1 = self.at, self.k1
        sizes = [None if x is None else at.apply("abs", x) for x in volume]
        row = at.begin(self.tables[i][1])
        base = at.whole("mul", row, k1)
        found = {c: at.apply("abs", at.load(at.at(self.sums[i], at.whole("add", base, c)))) for c in moving}
        for c in range(k1):
            terms = [self.times(found.get(c), sizes[0])]
            if c:
                terms.append(self.times(found.get(0), sizes[c]))
            total = self.total(*terms)
            if total is not None:
                place = at.at(self.added[i], at.whole("add", base, c))
                at.store(at.apply("add", at.load(place), total), place)
        at.end()

    def few(
        self, i: int, env: Env, bounds: Sequence[tuple[str, str]], outside: Sequence[str] = ()
    ) -> tuple[Dual, Dual]:
        """The most that is added up from variable i on, and what rounding puts it off, by nodes at which that is
        followed. bounds: of the edges of builtins; outside: masks that say that a variable further out is at an end of
        its stretch.

        (What an end that is off costs is said in `nodes`. All that is done at a node, and at an end, is written once.)
        """
        at, k1 = self.at, self.k1
        _, _, n, _, _, _, _, nodes, speeds = self.tables[i]
        last, between = i + 1 == len(self.plan.variables), at.whole("sub", n, ENDS)
        low, width, own, lost = self.stretch(i, env, self.machine.tracking(), False)
        each = 2 if last else 2 + ENDS  # what is kept: a size, an error, and what there is at both ends
        j, before = at.adding(between if last else n, k1 * each)
        ends = [] if last else [self.same(j, at.whole("add", between, side)) for side in range(ENDS)]
        errors = own
        for mask, side in zip(ends, lost, strict=not last):
            errors = [self.either(mask, x, y) for x, y in zip(side, errors, strict=True)]
        here = {**env, self.plan.variables[i]: self.node(low, width, at.constant(nodes, j), errors)}
        if self.spans:
            self.reach(self.spans[i], here[self.plan.variables[i]].v)
        most, off = self.at_node(here, bounds, outside) if last else self.few(i + 1, here, bounds, [*outside, *ends])
        speed, after = at.constant(speeds, j), list[str | None]()
        for c, (x, y) in enumerate(zip(most, off, strict=True)):
            kept, reach = before[c * each :][:2], before[c * each + 2 : (c + 1) * each]
            for value, part in zip(kept, (x, y), strict=True):
                own_size = None if part is None else self.unless(ends, at.apply("mul", part, speed))
                after.append(None if own_size is None else at.apply("max", value, own_size))
            whole = self.total(x, y)
            after += [
                self.either(mask, whole, value) if whole else None for mask, value in zip(ends, reach, strict=True)
            ]
        at.end(*after)
        largest, worst = after[::each], after[1::each]
        sizes, slack = [self.size(x) for x in width], []
        for number, side in enumerate(lost):
            there = largest
            if not last:
                plain = at.apply("gt", at.constant(speeds, at.whole("add", between, number)), self.zero)
                reached = (x or self.zero for x in after[2 + number :: each])
                there = [self.finite_or(x, plain, other) for x, other in zip(reached, largest, strict=True)]
            slack.append(self.product(there, side))
        return self.product(largest, sizes), list(map(self.total, self.product(worst, sizes), *slack))

    def reach(self, span: tuple[str, str], value: str) -> None:
        """Note where a variable has been."""
        for code, place in zip(("min", "max"), span, strict=True):
            self.at.store(self.at.apply(code, self.at.load(place), value), place)

    def at_node(self, env: Env, bounds: Sequence[tuple[str, str]], outside: Sequence[str]) -> tuple[Dual, Dual]:
        """The size of the integrand, and its rounding."""
        (cell,) = self.evaluated(self.face, env, self.machine.tracking())
        self.at_edges(env, bounds, outside)
        most = [self.size(cell.v), *(self.size(self.plain(x)) for x in cell.t)]
        return most, [cell.e, *(cell.et or [None] * (self.k1 - 1))]

    def at_edges(self, env: Env, bounds: Sequence[tuple[str, str]], outside: Sequence[str]) -> None:
        here = {name: still(symbol) for name, symbol in env.items()}
        for edge, (least, most) in zip(self.edges, bounds, strict=True):
            (cell,) = self.evaluated(edge, here, self.machine.with_directions(0))
            size = self.at.apply("abs", cell.v)
            self.at.store(self.at.apply("min", self.at.load(least), self.unless(outside, size, np.inf)), least)
            self.raise_to(most, self.unless(outside, size))

    def ends(self, i: int, env: Env, largest: str) -> None:
        """The largest value at the corners of cells, where these are looked at."""
        at, machine = self.at, self.machine.with_directions(0)
        asked = at.address("%frame", HEAD - 1)
        low, width, *_ = self.stretch(i, env, machine, False)
        j = at.begin(asked)
        node = at.spread(at.once(f"uitofp i64 {j} to double", j))
        here = {**env, self.plan.variables[i]: self.node(low, width, node)}
        if i + 1 == len(self.plan.variables):
            (cell,) = self.evaluated(self.face, here, machine)
            self.raise_to(largest, self.finite(at.apply("abs", cell.v)))
        else:
            self.ends(i + 1, here, largest)
        at.end()

    # Stretches and nodes

    def stretch(
        self, i: int, env: Env, machine: Evaluator, checked: bool = True
    ) -> tuple[Dual, Dual, Dual, list[Dual]]:
        """The lower end, the length, how far rounding puts nodes off, and how far off both ends are; where another cut
        comes between, that is noted."""
        at, checked = self.at, checked and i > 0
        cells = self.evaluated(self.plan.frames[i], env, machine) if checked else []
        numbers = range(len(cells))
        low, high = (
            [self.chosen(cells, row, numbers) for row in self.rows[i]] if checked else self.asked_for(i, env, machine)
        )
        lower, upper = [low.v, *low.t], [high.v, *high.t]
        width = [self.total(x, None if y is None else at.apply("neg", y)) for x, y in zip(upper, lower, strict=True)]
        if checked:
            fine = at.apply("gt", high.v, low.v)
            for cell in cells:
                between = at.apply("and", at.apply("gt", cell.v, low.v), at.apply("lt", cell.v, high.v))
                fine = at.apply("and", fine, at.apply("not", between))
            self.only(fine)
        own, short = self.misplaced(lower, upper, width)
        nothing: Dual = [None] * self.k1
        lost = [[self.total(x, error) for x, error in zip_longest(row, (end.e, *end.et))]
                for row, end in ((nothing, low), (short, high))]  # fmt: skip
        return lower, width, own, lost

    def misplaced(self, lower: Dual, upper: Dual, width: Dual) -> tuple[Dual, Dual]:
        """How far rounding puts nodes off, and an upper end, by the formulas that `cells.nodes` has for that."""
        at, own, unit = self.at, Dual(), self.at.number(UNIT_ROUNDOFF)
        short = [self.times(self.size(long), unit) for long in width]
        for low, high, off in zip(map(self.size, lower), map(self.size, upper), short, strict=True):
            far = at.apply("max", low, high) if low and high else low or high
            own.append(self.total(self.times(unit, far), self.times(at.number(3.0), off)))
        return own, short

    def node(self, low: Dual, width: Dual, u: str, lost: Dual | None = None) -> Symbol:
        """A node, which moves with the ends of its stretch."""
        at = [self.total(x, self.times(w, u)) for x, w in zip(low, width, strict=True)]
        errors = tuple((lost or [None] * len(at))[1:])
        assert at[0] is not None
        return Symbol(at[0], lost[0] if lost else None, tuple(at[1:]), tuple(
            None if moves is None else error for moves, error in zip(at[1:], errors, strict=True)
        ))  # fmt: skip

    def same(self, j: str, other: str) -> str:
        """Whether two whole numbers are the same, as a mask."""
        one, two = (self.at.spread(self.at.once(f"uitofp i64 {x} to double", x)) for x in (j, other))
        return self.at.apply("eq", one, two)

    def either(self, mask: str, x: str | None, y: str | None) -> str | None:
        """The first where the mask holds, else the second."""
        return None if x is y is None else self.at.apply("select", mask, x or self.zero, y or self.zero)

    def unless(self, masks: Sequence[str], x: str, other: float = 0.0) -> str:
        """A number where none of the masks holds."""
        for mask in masks:
            x = self.at.apply("select", mask, self.at.number(other), x)
        return x

    def finite_or(self, x: str, mask: str, other: str | None) -> str | None:
        """A number where it is finite and the mask holds, else another."""
        return self.either(self.at.apply("and", mask, self.at.apply("lt", x, self.at.number(np.inf))), x, other)

    def finite(self, size: str) -> str:
        return self.at.apply("select", self.at.apply("lt", size, self.at.number(np.inf)), size, self.zero)

    def only(self, mask: str) -> None:
        """Members for which the mask doesn't hold are not clear."""
        self.at.store(self.at.apply("select", mask, self.at.load(self.clear), self.zero), self.clear)
