"""The rule of a region (`a_priori`) by machine code, for one set of parameters.

Owns `summed_alone`. What is a batch of members to the function (`lowered.cells`) are here the cells of one integral,
which differ in nothing but the rows of the frames between which they lie. All that is the same at every call is laid
out once: tables of nodes, rows, room for what comes out.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from potto.core.terms import Term
from potto.integrate.fixed.axes import MEAN, Axis, axis
from potto.integrate.fixed.lowered.adding_text import ELSEWHERE, TRACKED
from potto.integrate.fixed.lowered.cells import LoweredCells, frame_of, lowered_cells
from potto.integrate.fixed.lowered.mean_text import MeanText
from potto.integrate.fixed.moving_sums import SUMMED, MovingTotals, summed
from potto.integrate.fixed.straight import StraightIntegral, between_rows
from potto.integrate.pieces import Evaluator
from potto.integrate.rules.proved_orders import FrameCell as Stretch
from potto.integrate.rules.proved_orders import Region
from potto.kernels.cells import Array, Cell, Ints, Value
from potto.kernels.making import counts
from potto.kernels.native.objects import Loaded, available
from potto.kernels.native.points import address
from potto.kernels.native.promotion import Promotion
from potto.kernels.native.vectors import LANES

MOST_REGIONS = 512
NARROW = 2, 4  # lanes for few cells: at two of them eq. (1) takes 1.5 us less than at eight
LEFT = ELSEWHERE * SUMMED
# Of a parameter: its name, and the direction of a tangent; -1 for the value.
Read = tuple[str, int]


class _Layout(Struct):
    """What one call of the function for some cells reads and writes.

    frame, constants: what it takes, which lies at `where`; `pack` puts numbers in place of the constants. tables: what
    the frame points to. out: the part that counts of what it gives, (rows, cells).
    """

    reads: tuple[Read, ...]
    pack: Callable[..., None]
    constants: Array
    out: Array
    frame: Ints
    tables: Sequence[NDArray[Any]]
    where: tuple[int, int]

    def run(self, function: Loaded, env: Mapping[str, Cell]) -> list[list[float]]:
        """Row by row what the function gives for each of the cells."""
        self.pack(self.constants, 0, *[env[name].v if d < 0 else env[name].t[d] for name, d in self.reads])
        function.call(*self.where)
        return self.out.tolist()  # type: ignore[no-any-return]


class RegionPart(Struct, frozen=True):
    """The cells of a region that have one integrand. idle: layouts that no thread uses right now."""

    way: LoweredCells
    cells: tuple[Stretch, ...]
    axes: tuple[Axis, ...]
    k1: int
    nodes: int
    idle: list[_Layout] = []

    @property
    def reads(self) -> tuple[Read, ...]:
        """The numbers that its function is told, one after the other."""
        places = [place for place in self.way.places if place.kind == "number"]
        return tuple((place.name, -1 if place.part.kind == "v" else place.part.direction) for place in places)

    @property
    def share(self) -> float:
        """How many times more rounding may be than at the nodes where it is followed."""
        return ELSEWHERE if self.nodes > TRACKED else 1.0

    def layout(self) -> _Layout:
        count = len(self.cells)
        lanes = np.minimum(np.arange(max(count, self.way.lanes)), count - 1)
        between = np.array([between_rows(cell.rows) for cell in self.cells])[lanes]
        nobody = np.zeros(lanes.size, dtype=np.int64)  # no parameter differs from cell to cell
        out = np.empty((3 * self.k1 + MeanText.beside, lanes.size))
        frame = frame_of(out, self.axes, [nobody, between])
        constants = np.empty(len(self.reads))
        where = address(frame), address(constants)
        pack = struct.Struct(f"{len(self.reads)}d").pack_into
        return _Layout(self.reads, pack, constants, out[:, :count], frame, [nobody, between], where)

    def summed(self, function: Loaded, env: Mapping[str, Cell]) -> MovingTotals | None:
        """The sums over all nodes of the cells; None where cuts cross."""
        try:
            layout = self.idle.pop()
        except IndexError:
            layout = self.layout()
        rows = layout.run(function, env)
        self.idle.append(layout)
        if not min(rows[3 * self.k1]) > 0:
            return None
        k1, share = self.k1, self.share
        number, error, gross = [], [], []
        for d in range(k1):
            own = rows[d]
            most = max(sum(rows[k1 + d]), sum(map(abs, own)))
            number.append(sum(own))
            error.append(share * sum(rows[2 * k1 + d]) + LEFT * most)
            gross.append(most)
        return MovingTotals(number, error, gross, self.nodes)


def summed_alone(
    plan: StraightIntegral, region: Region, machine: Evaluator, env: dict[str, Value], frame: tuple[Cell, ...]
) -> MovingTotals | None:
    """Weighted sums over the nodes of all cells, by machine code once that pays, else by numpy; None where cuts cross.

    frame: the bounds and cuts of the outermost variable.
    """
    faces = machine_code(plan, region, machine, env)
    if faces is None:
        with promotion(plan, region, machine, env).by_numpy():
            return summed(plan.variables, plan.frames, region, machine, env, frame)
    return summed_by(faces, env) if faces else summed(plan.variables, plan.frames, region, machine, env, frame)


def machine_code(
    plan: StraightIntegral, region: Region, machine: Evaluator, env: Mapping[str, Any]
) -> list[tuple[RegionPart, Loaded]] | None:
    """The integrands of a region with their functions; none of them where numpy is to be used, None while it is.

    For one integral nobody waits for the compiler, whatever the backend: of a swapped shader it is all of the time.
    """
    uncertain = any(env[name].e is not None or any(env[name].et) for name in plan.names)
    if machine.backend == "numpy" or uncertain or not available():
        return []
    faces, of_first = _faces(plan, region, machine, env), promotion(plan, region, machine, env)
    functions = [face.way.function(machine) for face in faces] if of_first.spent else [None]
    found = [(face, function) for face, function in zip(faces, functions, strict=False) if function is not None]
    return found if len(found) == len(faces) else [] if of_first.impossible else None


def promotion(plan: StraightIntegral, region: Region, machine: Evaluator, env: Mapping[str, Any]) -> Promotion:
    """How far the functions of a region are, all of them as the first."""
    return _faces(plan, region, machine, env)[0].way.promotion


def summed_by(faces: Sequence[tuple[RegionPart, Loaded]], env: Mapping[str, Any]) -> MovingTotals | None:
    """The sums by machine code; None where cuts cross."""
    total: MovingTotals | None = None
    for face, function in faces:
        found = face.summed(function, env)
        if found is None:
            return None
        counts.native_points += face.nodes
        total = found if total is None else total.plus(found)
    return total


def _faces(plan: StraightIntegral, region: Region, machine: Evaluator, env: Mapping[str, Any]) -> list[RegionPart]:
    """The integrands of a region, for parameters that move as these do."""
    kinds = tuple([tuple([None if t is None else t == 1.0 for t in env[name].t]) for name in plan.names])
    key = region, machine.directions, kinds
    found: list[RegionPart] | None = plan.alone.get(key)
    if found is None:
        if len(plan.alone) >= MOST_REGIONS:
            plan.alone.clear()
        found = plan.alone[key] = [_face(plan, region, machine, env, body) for body in _bodies(region)]
    return found


def _bodies(region: Region) -> list[Term]:
    return list(dict.fromkeys(cell.body for cell in region.cells))


def _face(plan: StraightIntegral, region: Region, machine: Evaluator, env: Mapping[str, Any], body: Term) -> RegionPart:
    """The cells with one integrand, all by the largest of their orders: what is proved holds for more nodes as well."""
    own = [(cell, order) for cell, order in zip(region.cells, region.outer, strict=True) if cell.body is body]
    cells, orders = zip(*own, strict=True)
    every = max(orders), *region.inner
    nodes = len(cells) * math.prod(every)
    axes = tuple(axis(order, MEAN, (False, False), nodes > TRACKED) for order in every)
    return RegionPart(
        lowered_cells(plan, body, machine.directions, env, MeanText, _lanes(len(cells))),
        cells, axes, 1 + machine.directions, nodes,
    )  # fmt: skip


def _lanes(count: int) -> int:
    """How many cells are done at a time, where there are so many in all."""
    return next((lanes for lanes in NARROW if count <= lanes), LANES)
