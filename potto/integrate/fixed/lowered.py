"""The product rule for cells of one shape (`alike`) as one function of machine code, for any number of nodes.

Owns `Lowered`. The function goes through the members eight at a time. In loops over the nodes of the variables, from
the outermost to the innermost, it works out bounds, cuts, nodes and the integrand, and adds up Legendre coefficients
on the way back: what `alike.Rule` does to whole arrays, one after the other, is done here to eight numbers that stay in
registers.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct, field

from potto.core.terms import Term
from potto.integrate.fixed.axes import Axis, Raw
from potto.integrate.fixed.rule_text import NAME, ONE, Place, RuleText
from potto.integrate.fixed.straight import Straight
from potto.integrate.pieces import Evaluator
from potto.kernels.cells import Array, Cell, Ints, Value
from potto.kernels.making import counts
from potto.kernels.native.objects import Loaded
from potto.kernels.native.points import address
from potto.kernels.native.promotion import Promotion
from potto.kernels.native.straight import Part
from potto.kernels.native.vectors import LANES


class Lowered(Struct, frozen=True):
    """The rule for one integrand, for parameters with these parts."""

    plan: Straight
    face: Term
    places: tuple[Place, ...]
    promotion: Promotion = field(default_factory=lambda: Promotion(NAME))

    def function(self, machine: Evaluator) -> Loaded | None:
        """The function, if it is to be used now."""
        return self.promotion.function(machine.backend, lambda: self.text(machine))

    def text(self, machine: Evaluator) -> str:
        """The function. Raises NotStraight."""
        return RuleText(self.plan, self.face, machine).text(self.places)

    def run(
        self, function: Loaded, env: Mapping[str, Value], members: Ints, rows: Ints, axes: Sequence[Axis],
        directions: int,
    ) -> Raw:  # fmt: skip
        """The sums over cells. members: (M,), whose they are; rows: (variables, 2, M), of the frames, between which."""
        k1, count = 1 + directions, members.size
        blocks = -(-count // LANES)
        index = np.minimum(np.arange(blocks * LANES), count - 1)
        whose, between = members[index], rows[:, :, index].astype(float, order="C")
        taken = [_part(env[place.name], place.part)[whose] for place in self.places if place.kind == "array"]
        taken += [ends for pair in between for ends in pair]
        numbers = [_part(env[place.name], place.part) for place in self.places if place.kind == "number"]
        constants = np.array(numbers, dtype=float)
        sizes = [3 * k1 + 3, *(axis.transform.shape[1] * k1 for axis in axes)]
        out = np.empty((blocks, sum(sizes), LANES))
        table = frame_of(out, axes, taken)
        function.call(address(table), address(constants))
        counts.native_points += count * math.prod(len(axis.nodes) for axis in axes)
        whole = out.transpose(1, 0, 2).reshape(sum(sizes), -1)[:, :count]
        number, most, off, rest = np.split(whole[: sizes[0]], [k1, 2 * k1, 3 * k1])
        parts = np.split(whole[sizes[0] :], np.cumsum(sizes[1:])[:-1])
        found = [part.reshape(-1, k1, count).transpose(1, 2, 0) for part in parts]
        return Raw(number, found, most, off, rest[0] > 0, rest[1], rest[2])


def frame_of(out: Array, axes: Sequence[Axis], taken: Sequence[Array]) -> Ints:
    """What the function is told: how many blocks and rows, where they go, the nodes, and where what it takes is."""
    told = [len(out), out.shape[1], address(out), *(x for axis in axes for x in _told(axis)), *map(address, taken)]
    return np.array(told, dtype=np.int64)


def lowered(plan: Straight, face: Term, directions: int, env: Mapping[str, Value]) -> Lowered:
    """The rule for an integrand, in an environment whose numbers have these parts."""
    places = tuple(Place(name, part, _kind(part, x)) for name in plan.names for part, x in _parts(env[name]))
    key = (face, directions, places)
    found: Lowered | None = plan.lowered.get(key)
    if found is None:
        found = plan.lowered[key] = Lowered(plan, face, places)
    return found


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
