"""The product rule for cells of one shape (`alike`) as a function of machine code.

Owns `LoweredCells`, and `frame_of` and `places_of`, which tell such functions what they work on. A function goes
through the members eight at a time. In loops over the nodes of the variables, from the outermost to the innermost, it
works out bounds, cuts, nodes and the integrand, and adds up Legendre coefficients on the way back: what numpy does to
whole arrays, one after the other, is done here to eight numbers that stay in registers. Where nothing is left to be
decided beside it, what is found is added to the sums of members there as well.
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
from potto.integrate.fixed.axes import Axis, Raw
from potto.integrate.fixed.lowered.formula_text import ONE, ParameterPlace
from potto.integrate.fixed.lowered.rule_text import NAME, RuleText
from potto.integrate.fixed.lowered.total_text import BESIDE
from potto.integrate.fixed.straight import StraightIntegral
from potto.integrate.pieces import Evaluator
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


class LoweredCells(Struct, frozen=True):
    """The rule for cells of one integrand with any number of nodes, for parameters with these parts.

    kind: what is written: with coefficients that tell what it leaves out, the means alone, or totals of members. lanes:
    how many cells it does at a time.
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

    def run(
        self, function: Loaded, env: Mapping[str, Value], members: Ints, between: Ints, axes: Sequence[Axis],
        directions: int,
    ) -> Raw:  # fmt: skip
        """The sums over cells. members: (M,), whose they are; between: (M,), which rows they lie, as numbers."""
        k1, count = 1 + directions, members.size
        numbers, arrays = given(self.places, env)
        sizes = [3 * k1 + self.kind.beside, *(axis.transform.shape[1] * k1 for axis in axes)]
        out = np.empty((sum(sizes), max(count, self.lanes)))
        told = [whole(column, out.shape[1]) for column in (members, between)]
        frame = frame_of(out, axes, [*told, *arrays])
        function.call(address(frame), address(numbers))
        counts.native_points += count * math.prod(len(axis.nodes) for axis in axes)
        found = out[:, :count]
        number, most, off, clear = found[:k1], found[k1 : 2 * k1], found[2 * k1 : 3 * k1], found[3 * k1] > 0
        corners, largest = found[3 * k1 + 1 : sizes[0]]
        parts = np.split(found[sizes[0] :], np.cumsum(sizes[1:])[:-1])
        coefficients = [part.reshape(-1, k1, count).transpose(1, 2, 0) for part in parts]
        return Raw(number, coefficients, most, off, clear, corners, largest)

    def add(
        self, function: Loaded, env: Mapping[str, Value], members: Ints, between: Ints, runs: Sequence[Run],
        wanted: Wanted, beyond: Array | None, total: Array,
    ) -> Bools:  # fmt: skip
        """Add the sums over those cells that are good enough to those of their members; which these are (M,).

        runs: one after the other, all cells. beyond: what is left out of each, (1 + k, M). total: (4, 1 + k, B),
        numbers, what rounding puts them off, what is added up, and what is left out.
        """
        numbers, arrays = given(self.places, env)
        constants = np.concatenate(((wanted.part, wanted.added, math.nan), numbers))
        least = max(max(run.stop, run.first + self.lanes) for run in runs)
        good, proved = np.empty((1, least)), beyond is not None
        cells = [whole(column, least) for column in (members, between)]
        left = [whole(row, least) for row in beyond] if beyond is not None else []
        told = address(total), total.strides[1] // total.itemsize, int(wanted.whole), int(proved)
        for run in runs:  # what a short one says of cells behind it, these say themselves later
            constants[BESIDE] = run.beside
            for start, stop in parts(max(run.stop - run.first, self.lanes), AT_ONCE):
                at = slice(run.first + start, run.first + stop)
                frame = frame_of(good[:, at], run.axes, [*(column[at] for column in cells), *arrays])
                where = [address(row[at]) for row in left] or [0] * total.shape[1]
                count = min(at.stop, run.stop) - at.start
                frame = np.array([*frame, *told, count, *where], dtype=np.int64)
                function.call(address(frame), address(constants))
            counts.native_points += (run.stop - run.first) * math.prod(len(axis.nodes) for axis in run.axes)
        return np.asarray(good[0, : members.size] > 0)


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
