"""The product rule for cells of one shape (`alike`) as a function of machine code.

Owns `LoweredCells`, and `frame_of` and `places_of`, which tell such functions what they work on. A function goes
through the members eight at a time. In loops over the nodes of the variables, from the outermost to the innermost, it
works out bounds, cuts, nodes and the integrand, and adds up Legendre coefficients on the way back: what numpy does to
whole arrays, one after the other, is done here to eight numbers that stay in registers.
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
from potto.integrate.fixed.formula_text import ONE, ParameterPlace
from potto.integrate.fixed.mean_text import MeanText
from potto.integrate.fixed.rule_text import NAME, RuleText
from potto.integrate.fixed.straight import RowNumbers, StraightIntegral
from potto.integrate.pieces import Evaluator
from potto.kernels.cells import Array, Cell, Ints, Value
from potto.kernels.making import counts
from potto.kernels.native.objects import Loaded
from potto.kernels.native.points import address
from potto.kernels.native.promotion import Promotion
from potto.kernels.native.straight import ArgumentPart
from potto.kernels.native.vectors import LANES

# Lines of a function's text at the least: in all, and for each term and for its tangent along each direction. There
# are up to twice as many.
LINES, LINES_OF_A_TERM = 400, 3


class LoweredCells(Struct, frozen=True):
    """The rule for cells of one integrand with any number of nodes, for parameters with these parts.

    told: whether coefficients tell what it leaves out; else that is known. lanes: how many cells it does at a time.
    """

    plan: StraightIntegral
    face: Term
    places: tuple[ParameterPlace, ...]
    told: bool
    promotion: Promotion
    lanes: int = LANES

    def function(self, machine: Evaluator) -> Loaded | None:
        """The function, if it is to be used now."""
        kind = RuleText if self.told else MeanText
        return self.promotion.function(
            machine.backend, lambda: kind(self.plan, self.face, machine, self.lanes).text(self.places)
        )

    def run(
        self, function: Loaded, env: Mapping[str, Value], members: Ints, rows: RowNumbers, axes: Sequence[Axis],
        directions: int,
    ) -> Raw:  # fmt: skip
        """The sums over cells. members: (M,), whose they are; rows: (variables, 2, M), of the frames, between which."""
        k1, count = 1 + directions, members.size
        numbers, arrays = given(self.places, env)
        ends = [row.astype(float) for pair in rows for row in pair]
        sizes = [self.rows(k1), *(axis.transform.shape[1] * k1 for axis in axes if self.told)]
        out = np.empty((sum(sizes), max(count, self.lanes)))
        columns = [whole(column, out.shape[1]) for column in (members, *ends)]
        columns[1:1] = map(np.ascontiguousarray, arrays)
        frame = frame_of(out, axes, columns)
        function.call(address(frame), address(numbers))
        counts.native_points += count * math.prod(len(axis.nodes) for axis in axes)
        found = out[:, :count]
        number, most, off, clear = found[:k1], found[k1 : 2 * k1], found[2 * k1 : 3 * k1], found[3 * k1] > 0
        if not self.told:
            return Raw(number, [], most, off, clear)
        corners, largest = found[3 * k1 + 1 : sizes[0]]
        parts = np.split(found[sizes[0] :], np.cumsum(sizes[1:])[:-1])
        coefficients = [part.reshape(-1, k1, count).transpose(1, 2, 0) for part in parts]
        return Raw(number, coefficients, most, off, clear, corners, largest)

    def rows(self, k1: int) -> int:
        """How many rows of results there are before those of coefficients."""
        return 3 * k1 + (3 if self.told else 1)


def lowered_cells(
    plan: StraightIntegral, face: Term, directions: int, env: Mapping[str, Value], told: bool,
    lanes: int = LANES,
) -> LoweredCells:  # fmt: skip
    """The rule for an integrand on cells, in an environment whose numbers have these parts."""
    places = places_of(plan.names, env)
    key = (face, directions, places, told, lanes)
    found: LoweredCells | None = plan.lowered.get(key)
    if found is None:
        lines = LINES + LINES_OF_A_TERM * terms_of(plan, face) * (1 + directions)
        found = plan.lowered[key] = LoweredCells(plan, face, places, told, Promotion(NAME, lines), lanes)
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


def whole(column: Array, least: int) -> Array:
    """A column as a function reads it, of LANES numbers at least."""
    return np.ascontiguousarray(column) if column.size >= least else np.resize(column, least)


def parts(count: int, most: int) -> list[tuple[int, int]]:
    """First and last of parts of about so many members, none with fewer than LANES."""
    starts = list(range(0, max(count - LANES, 0) + 1, most))
    return list(zip(starts, [*starts[1:], count], strict=True))


def given(places: Iterable[ParameterPlace], env: Mapping[str, Value]) -> tuple[Array, list[Array]]:
    """The parts of parameters that are numbers for all members, and those that differ from member to member."""
    numbers = [_part(env[place.name], place.part) for place in places if place.kind == "number"]
    return np.array(numbers, dtype=float), [_part(env[p.name], p.part) for p in places if p.kind == "array"]


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
