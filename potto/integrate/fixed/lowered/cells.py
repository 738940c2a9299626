"""The product rule for cells of one shape (`alike`) as a function of machine code.

Owns `LoweredCells`, and `frame_of` and `places_of`, which tell such functions what they work on. A function goes
through the members eight at a time. In loops over the nodes of the variables, from the outermost to the innermost, it
works out bounds, cuts, nodes and the integrand, and adds up Legendre coefficients on the way back: what numpy does to
whole arrays, one after the other, is done here to eight numbers that stay in registers. What is found is added to the
sums of members where it is good enough.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from potto.core.terms import Term, postorder
from potto.integrate.fixed.axes import Axis
from potto.integrate.fixed.lowered.adding_text import BESIDE, PARTS
from potto.integrate.fixed.lowered.formula_text import ONE, ParameterPlace
from potto.integrate.fixed.lowered.judged_text import QUARTERS
from potto.integrate.fixed.lowered.rule_text import NAME, RuleText
from potto.integrate.fixed.straight import StraightIntegral
from potto.integrate.pieces import Evaluator
from potto.integrate.rules.gauss import quarters
from potto.kernels.cells import Array, Bools, Cell, Ints, Value
from potto.kernels.making import counts
from potto.kernels.native.objects import Loaded
from potto.kernels.native.points import address
from potto.kernels.native.promotion import Promotion
from potto.kernels.native.straight import ArgumentPart
from potto.kernels.native.vectors import LANES

# Lines of a function's text at the least: in all, and for each term and for its tangent along each direction. There
# are up to twice as many.
LINES, LINES_OF_A_TERM = 400, 3
# Cells whose integrals are added up at once: few enough that an interruption is not kept waiting.
AT_ONCE = 1 << 15


class Wanted(Struct, frozen=True):
    """Which cells are good enough: those that are off by no more than a part of what they come to, or of what is added
    up for them. whole: what a cell goes into counts as what it comes to."""

    part: float
    added: float
    whole: bool


class Run(Struct, frozen=True):
    """The cells first ... stop - 1 of some, and the nodes of their rule. beside: how many times more rounding may be
    than at the nodes where it is followed."""

    axes: Sequence[Axis]
    first: int
    stop: int
    beside: float


class Proved(Struct, frozen=True):
    """What is known beforehand to be left out of each cell, (1 + k, M); None: nothing."""

    beyond: Array | None
    looks = 0

    @property
    def told(self) -> bool:
        """Whether that goes into the sums."""
        return self.beyond is not None

    def columns(self, least: int) -> list[Array]:
        return [] if self.beyond is None else [whole(row, least) for row in self.beyond]

    def behind(self, columns: Sequence[Array], at: slice) -> list[int]:
        return [address(row[at]) for row in columns]


class Judged(Struct, frozen=True):
    """What is left out of a cell is told by coefficients, as rules of these orders have them: the least of it counts.

    asked: how many coefficients there are along each variable, which are its last ones; 1 of a polynomial.
    """

    orders: Sequence[tuple[int, ...]]
    nodes: tuple[int, ...]
    asked: tuple[int, ...]
    told = True

    @property
    def looks(self) -> int:
        return len(self.orders)

    def columns(self, least: int) -> list[NDArray[Any]]:
        """The tables of what is looked at."""
        places, powers = np.zeros((2, self.looks, len(self.nodes), 2))
        for own, row, pair in zip(self.orders, places, powers, strict=True):
            for i, (order, most, count) in enumerate(zip(own, self.nodes, self.asked, strict=True)):
                if count > 1:
                    quarter, *exponents = quarters(order)
                    row[i], pair[i] = (quarter, count - most + order - QUARTERS * quarter), exponents
        return [places.astype(np.int64), powers]

    def behind(self, columns: Sequence[NDArray[Any]], at: slice) -> list[int]:
        return [self.looks, *map(address, columns)]


Left = Proved | Judged


class LoweredCells(Struct, frozen=True):
    """The rule for cells of one integrand with any number of nodes, for parameters with these parts.

    kind: what is written: means alone, or what adds to the totals of members what is good enough, as is known
    beforehand or told by coefficients. lanes: how many cells it does at a time.
    """

    plan: StraightIntegral
    face: Term
    places: tuple[ParameterPlace, ...]
    kind: type[RuleText]
    promotion: Promotion
    lanes: int = LANES

    def function(self, machine: Evaluator) -> Loaded | None:
        """The function, if it is to be used now."""
        return self.promotion.function(
            machine.backend, lambda: self.kind(self.plan, self.face, machine, self.lanes).text(self.places)
        )

    def add(
        self, function: Loaded, env: Mapping[str, Value], members: Ints, between: Ints, runs: Sequence[Run],
        wanted: Wanted, left: Left, total: Array, kept: bool = True,
    ) -> Bools:  # fmt: skip
        """Add the sums over those cells that are good enough to those of their members, if they are to be `kept`; which
        these are, and for which of them each look would do by itself, (1 + looks, M).

        runs: one after the other, all cells. total: (4, 1 + k, B), numbers, what rounding puts them off, what is added
        up, and what is left out.
        """
        numbers, arrays = given(self.places, env)
        constants = np.concatenate(((wanted.part, wanted.added, math.nan), numbers))
        least = max(max(run.stop, run.first + self.lanes) for run in runs)
        good, rows = np.empty((1 + left.looks, least)), (PARTS + left.told) * total.shape[1]
        cells = [whole(column, least) for column in (members, between)]
        beyond = left.columns(least)
        told = address(total), total.strides[1] // total.itemsize, int(wanted.whole)
        for run in runs:  # what a short one says of cells behind it, these say themselves later
            constants[BESIDE] = run.beside
            for start, stop in parts(max(run.stop - run.first, self.lanes), AT_ONCE):
                at = slice(run.first + start, run.first + stop)
                frame = frame_of(good[:, at], run.axes, [*(column[at] for column in cells), *arrays])
                there = min(at.stop, run.stop) - at.start if kept else 0
                frame = np.array([*frame, *told, there, rows, *left.behind(beyond, at)], dtype=np.int64)
                function.call(address(frame), address(constants))
            counts.native_points += (run.stop - run.first) * math.prod(len(axis.nodes) for axis in run.axes)
        return np.asarray(good[:, : members.size] > 0)


def lowered_cells(
    plan: StraightIntegral, face: Term, directions: int, env: Mapping[str, Value], kind: type[RuleText],
    lanes: int = LANES,
) -> LoweredCells:  # fmt: skip
    """The rule for an integrand on cells, in an environment whose numbers have these parts."""
    places = places_of(plan.names, env)
    key = (face, directions, places, kind, lanes)
    found: LoweredCells | None = plan.lowered.get(key)
    if found is None:
        lines = LINES + LINES_OF_A_TERM * terms_of(plan, face) * (1 + directions)
        found = plan.lowered[key] = LoweredCells(plan, face, places, kind, Promotion(NAME, lines), lanes)
    return found


def terms_of(plan: StraightIntegral, face: Term) -> int:
    """How many terms such a rule works out."""
    return sum(len(postorder(term)) for term in (face, *(frame.body for frame in plan.frames)))


def frame_of(out: Array, axes: Sequence[Axis], columns: Sequence[NDArray[Any]]) -> Ints:
    """What a function is told: of how many members, LANES at least, where the rows of results go, at how many ends of
    stretches to look (at none where no coefficients tell), the nodes, and where the columns are that it takes."""
    where = out.shape[1], out.strides[0] // out.itemsize, address(out)
    ends = 2 if any(axis.transform.shape[1] > 1 for axis in axes) else 0
    return np.array([*where, ends, *(x for axis in axes for x in _told(axis)), *map(address, columns)], dtype=np.int64)


def whole(column: NDArray[Any], least: int) -> NDArray[Any]:
    """A column as a function reads it, of LANES numbers at least."""
    return np.ascontiguousarray(column) if column.size >= least else np.resize(column, least)


def parts(count: int, most: int) -> list[tuple[int, int]]:
    """First and last of parts of about so many members, none with fewer than LANES."""
    starts = list(range(0, max(count - LANES, 0) + 1, most))
    return list(zip(starts, [*starts[1:], count], strict=True))


def given(places: Iterable[ParameterPlace], env: Mapping[str, Value]) -> tuple[Array, list[Array]]:
    """The parts of parameters that are numbers for all members, and those that differ from member to member."""
    numbers = [_part(env[place.name], place.part) for place in places if place.kind == "number"]
    arrays = [np.ascontiguousarray(_part(env[p.name], p.part)) for p in places if p.kind == "array"]
    return np.array(numbers, dtype=float), arrays


def places_of(names: Iterable[str], env: Mapping[str, Value]) -> tuple[ParameterPlace, ...]:
    """The parts of parameters, and what is there."""
    return tuple(ParameterPlace(name, part, _kind(part, x)) for name in names for part, x in _parts(env[name]))


def _kind(part: ArgumentPart, x: Any) -> str:
    return "array" if isinstance(x, np.ndarray) else ONE if part.kind == "t" and x == 1.0 else "number"


@lru_cache(maxsize=512)
def _told(axis: Axis) -> list[int]:
    """What the function is told of a variable's nodes."""
    tables = (axis.nodes, axis.speeds, axis.weights, axis.transform, axis.few, axis.few_speeds)
    return [len(axis.nodes), axis.transform.shape[1], len(axis.few), *map(address, tables)]


def _parts(value: Value) -> list[tuple[ArgumentPart, Any]]:
    """The parts of a parameter that are something; errors of 0, which seeds of a tape have, are none."""
    assert isinstance(value, Cell)
    found = [(ArgumentPart((), "v"), value.v), (ArgumentPart((), "e"), value.e)]
    found += [
        (ArgumentPart((), kind, d), x) for kind, row in (("t", value.t), ("et", value.et)) for d, x in enumerate(row)
    ]
    return [(p, x) for p, x in found if x is not None and (p.kind in ("v", "t") or isinstance(x, np.ndarray) or x)]


def _part(value: Value, part: ArgumentPart) -> Any:
    found = getattr(value, part.kind)
    return found if part.kind in ("v", "e") else found[part.direction]
