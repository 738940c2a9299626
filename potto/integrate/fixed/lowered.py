"""Product rules as functions of machine code: for cells of one shape (`alike`), and for boxes (`tensor_product`).

Owns `LoweredCells` and `LoweredBoxes`. A function goes through the members eight at a time. In loops over the nodes of
the variables, from the outermost to the innermost, it works out bounds, cuts, nodes and the integrand, and adds up
Legendre coefficients on the way back: what numpy does to whole arrays, one after the other, is done here to eight
numbers that stay in registers.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct, field

from potto.core.terms import Term
from potto.integrate.fixed.axes import Axis, Raw
from potto.integrate.fixed.box_text import BoxText, numbers
from potto.integrate.fixed.rule_text import NAME, ONE, Place, RuleText
from potto.integrate.fixed.straight import Straight
from potto.integrate.pieces import Evaluator, Sums
from potto.kernels.cells import Array, Bools, Cell, Ints, Value
from potto.kernels.making import counts
from potto.kernels.native.objects import Loaded
from potto.kernels.native.points import address
from potto.kernels.native.promotion import Promotion
from potto.kernels.native.straight import Part
from potto.kernels.native.vectors import LANES


class Lowered(Struct, frozen=True):
    """A function for one integrand, for parameters with these parts."""

    plan: Straight
    face: Term
    places: tuple[Place, ...]
    promotion: Promotion = field(default_factory=lambda: Promotion(NAME))

    def function(self, machine: Evaluator) -> Loaded | None:
        """The function, if it is to be used now."""
        return self.promotion.function(machine.backend, lambda: self.text(machine))

    def text(self, machine: Evaluator) -> str:
        """The function. Raises NotStraight."""
        raise NotImplementedError

    def arrays(self, env: Mapping[str, Value]) -> list[Array]:
        """The parameters that differ from member to member."""
        return [_part(env[place.name], place.part) for place in self.places if place.kind == "array"]

    def _run(
        self, function: Loaded, env: Mapping[str, Value], taken: Sequence[Array], axes: Sequence[Axis], rows: int,
        given: Sequence[float] = (),
    ) -> Array:  # fmt: skip
        """The rows of results, so many for each of the members whose columns these are."""
        count = taken[0].size
        least = max(count, LANES)
        columns = [np.ascontiguousarray(a) if count == least else np.resize(a, least) for a in taken]
        numbers = [_part(env[place.name], place.part) for place in self.places if place.kind == "number"]
        constants = np.array([*given, *numbers], dtype=float)
        out = np.empty((rows, least))
        table = frame_of(out, axes, columns)
        function.call(address(table), address(constants))
        counts.native_points += count * math.prod(len(axis.nodes) for axis in axes)
        return out[:, :count]


def frame_of(out: Array, axes: Sequence[Axis], columns: Sequence[Array]) -> Ints:
    """What a function is told: of how many members, LANES at least, where the rows of results go, the nodes, and where
    the columns are that it takes."""
    told = [out.shape[1], address(out), *(x for axis in axes for x in _told(axis)), *map(address, columns)]
    return np.array(told, dtype=np.int64)


class LoweredCells(Lowered, frozen=True):
    """The rule for cells of one shape, with any number of nodes."""

    def text(self, machine: Evaluator) -> str:
        return RuleText(self.plan, self.face, machine).text(self.places)

    def run(
        self, function: Loaded, env: Mapping[str, Value], members: Ints, rows: Ints, axes: Sequence[Axis],
        directions: int,
    ) -> Raw:  # fmt: skip
        """The sums over cells. members: (M,), whose they are; rows: (variables, 2, M), of the frames, between which."""
        k1 = 1 + directions
        taken = [array[members] for array in self.arrays(env)] + [ends.astype(float) for pair in rows for ends in pair]
        sizes = [3 * k1 + 3, *(axis.transform.shape[1] * k1 for axis in axes)]
        found = self._run(function, env, taken, axes, sum(sizes))
        number, most, off, rest = np.split(found[: sizes[0]], [k1, 2 * k1, 3 * k1])
        parts = np.split(found[sizes[0] :], np.cumsum(sizes[1:])[:-1])
        coefficients = [part.reshape(-1, k1, members.size).transpose(1, 2, 0) for part in parts]
        return Raw(number, coefficients, most, off, rest[0] > 0, rest[1], rest[2])


class LoweredBoxes(Lowered, frozen=True):
    """The rule for boxes that nothing cuts, with so many nodes for each variable; exact: for a polynomial."""

    orders: tuple[int, ...] = ()
    exact: tuple[bool, ...] = ()

    def text(self, machine: Evaluator) -> str:
        return BoxText(self.plan, self.face, machine, self.orders, self.exact).text(self.places)

    def run(
        self, function: Loaded, machine: Evaluator, env: Mapping[str, Value], low: Array, high: Array
    ) -> tuple[Sums, Bools]:
        """The integrals over boxes, (variables, B), and for which of them the rule does."""
        m, k1, count = numbers(self.face), 1 + machine.directions, low.shape[1]
        taken = self.arrays(env) + [ends for pair in zip(low, high, strict=True) for ends in pair]
        axes = [Axis.of(order, False, (False, False), True) for order in self.orders]
        asked = 0.5 * machine.rtol, 0.5 * machine.atol
        found = self._run(function, env, taken, axes, 2 * m * k1 + 3, asked)
        total, bound = found[: 2 * m * k1].reshape(2, m, k1, count)
        return Sums(total[:, 0], bound[:, 0], total[:, 1:], bound[:, 1:], gross=found[-3:-1]), found[-1] > 0


def lowered_cells(plan: Straight, face: Term, directions: int, env: Mapping[str, Value]) -> LoweredCells:
    """The rule for an integrand on cells, in an environment whose numbers have these parts."""
    places = _places(plan.names, env)
    key = (face, directions, places)
    found: LoweredCells | None = plan.lowered.get(key)
    if found is None:
        found = plan.lowered[key] = LoweredCells(plan, face, places)
    return found


def lowered_boxes(
    plan: Straight, face: Term, names: Iterable[str], directions: int, env: Mapping[str, Value],
    orders: tuple[int, ...], exact: tuple[bool, ...],
) -> LoweredBoxes:  # fmt: skip
    """The rule for an integrand of these parameters over boxes, in an environment whose numbers have these parts."""
    places = _places(names, env)
    key = (face, directions, places, orders, exact)
    found: LoweredBoxes | None = plan.lowered.get(key)
    if found is None:
        found = plan.lowered[key] = LoweredBoxes(plan, face, places, orders=orders, exact=exact)
    return found


def _places(names: Iterable[str], env: Mapping[str, Value]) -> tuple[Place, ...]:
    return tuple(Place(name, part, _kind(part, x)) for name in names for part, x in _parts(env[name]))


def _kind(part: Part, x: Any) -> str:
    return "array" if isinstance(x, np.ndarray) else ONE if part.kind == "t" and x == 1.0 else "number"


def _told(axis: Axis) -> list[int]:
    """What the function is told of a variable's nodes."""
    tables = (axis.nodes, axis.speeds, axis.weights, axis.transform, axis.few, axis.few_speeds)
    return [len(axis.nodes), axis.transform.shape[1], len(axis.few), *map(address, tables)]


def _parts(value: Value) -> list[tuple[Part, Any]]:
    assert isinstance(value, Cell)
    found = [(Part((), "v"), value.v), (Part((), "e"), value.e)]
    found += [(Part((), kind, d), x) for kind, row in (("t", value.t), ("et", value.et)) for d, x in enumerate(row)]
    return [(part, x) for part, x in found if x is not None]


def _part(value: Value, part: Part) -> Any:
    found = getattr(value, part.kind)
    return found if part.kind in ("v", "e") else found[part.direction]
