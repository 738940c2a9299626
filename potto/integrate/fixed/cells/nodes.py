"""A product rule for cells of one shape, by numpy: all nodes of all members at once.

Owns `at_once`. Blocks of numbers have values in row 0 and tangents in rows 1 ... k of their first axis. The members are
their last axis, so that whatever is done is done to long rows of numbers; before it come the nodes of each variable,
the outermost one's next to the members.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from msgspec import Struct

from potto.calculus.solving.enclosable import enclosable
from potto.core.terms import Term, function_of, tuple_
from potto.integrate.fixed.axes import ENDS, Axis, Raw
from potto.integrate.fixed.edges import EDGE, edges_of
from potto.integrate.fixed.moving_sums import product
from potto.integrate.fixed.straight import RowNumbers, StraightIntegral, rows_between
from potto.integrate.pieces import Evaluator, dense, numbers_at, still
from potto.integrate.rules.intervals import Interval, enclosure
from potto.integrate.rules.steepness import STEEPEST, change, exponents_in
from potto.kernels.cells import Array, Bools, Cell, Ints, Value, map_arrays
from potto.kernels.whole import UNIT_ROUNDOFF


class Nodes(Struct, frozen=True):
    """Numbers at some nodes of cells. value, off: of the integrand and its rounding, (1 + k, ..., n1, M).

    widths: per variable those of its stretches, and how far both ends may be off, (2, ...), with its own axis left out.
    clear: (M,) whether no cut comes between, and nothing near by is singular.
    """

    value: Array
    off: Array
    widths: list[tuple[Array, Array]]
    clear: Bools

    def without_ends(self) -> Nodes:
        """Those between the ends of stretches, where rounding is followed at these as well."""
        outer = len(self.widths) - 1
        value, off = (block[:, :, *_between(outer)] for block in (self.value, self.off))
        widths = [(width[:, *_between(i)], lost[:, :, *_between(i)]) for i, (width, lost) in enumerate(self.widths)]
        return Nodes(value, off, widths, self.clear)


def at_once(
    plan: StraightIntegral, face: Term, machine: Evaluator, env: Mapping[str, Value], members: Ints, between: Ints,
    axes: Sequence[Axis],
) -> Raw:  # fmt: skip
    """The sums over cells. members: (M,), whose they are; between: (M,), which rows they lie, as numbers."""
    here = {n: map_arrays(v, lambda a: a.take(members) if a.ndim else a) for n, v in env.items()}
    cells = _Cells(plan, face, here, rows_between(between, len(axes)), axes)
    tracking = machine.tracking()
    few = [axis.few for axis in axes]
    some = cells.at_nodes(tracking, [*few[:-1], few[-1][:-ENDS]], True)
    every = some.without_ends()
    if any(len(axis.few) < len(axis.nodes) + ENDS for axis in axes):
        every = cells.at_nodes(machine, [axis.nodes for axis in axes], False)
    number, coefficients = cells.added(every)
    off, most = cells.rounded(some)
    clear = every.clear & some.clear
    if all(axis.transform.shape[1] == 1 for axis in axes):
        return Raw(number, [], most, off, clear)
    corners = cells.at_nodes(tracking, [np.array([0.0, 1.0])] * len(axes), False)
    largest = [_largest(nodes.value[:1]) for nodes in (corners, every)]
    return Raw(number, coefficients, most, off, clear, *largest)


class _Cells(Struct, frozen=True):
    plan: StraightIntegral
    face: Term
    env: dict[str, Value]
    rows: RowNumbers
    axes: Sequence[Axis]

    @property
    def count(self) -> int:
        return int(self.rows.shape[-1])

    def at_nodes(self, machine: Evaluator, places: Sequence[Array], tracked: bool) -> Nodes:
        """The integrand at nodes, per variable; `tracked` where the rounding of nodes counts: of all variables but the
        innermost the last two are then the ends of stretches, which are off by more."""
        last = len(places) - 1
        here, shape, k = dict(self.env), (self.count,), machine.directions
        clear = np.ones(self.count, dtype=bool)
        widths = []
        for i, (variable, frame) in enumerate(zip(self.plan.variables, self.plan.frames, strict=True)):
            values = numbers_at(frame, machine, here)
            numbers, lost = dense(values, k, shape)
            ends = self.picked(numbers, i)
            lo, width = ends[0], ends[1] - ends[0]
            own, off = misplaced(ends, width)
            if lost is not None:
                off += self.picked(lost, i)
            widths.append((width, off))
            if i:
                inside = (slice(None), *_between(i if tracked else 0))
                clear &= _clear(numbers[:, 0][inside], ends[:, 0][inside])
            at = lo[:, None] + width[:, None] * places[i].reshape(-1, *(1,) * len(shape))
            moves = [any(cell.t[d] is not None for cell in values) for d in range(k)]
            errors: Sequence[Array | None] = (None,) * (1 + k)
            if tracked:
                each = [own] * len(places[i]) if i == last else [*[own] * (len(places[i]) - ENDS), *off]
                errors = list(np.stack(each, axis=1))
            here[variable] = Cell(
                at[0], errors[0], tuple(at[d] if m else None for d, m in enumerate(moves, 1)),
                tuple(errors[d] if m else None for d, m in enumerate(moves, 1)),
            )  # fmt: skip
            shape = at.shape[1:]
        function = function_of(self.face)
        value, lost = dense(machine.evaluate(function, here, None), k, shape)
        if tracked:
            clear &= self.clear_of_edges(machine.with_directions(0), here, shape)
        return Nodes(value[0], np.zeros(value[0].shape) if lost is None else lost[0], widths, clear)

    def picked(self, block: Array, i: int) -> Array:
        """Of the rows of variable i's frame, (R, 1 + k, ..., M), those at the ends of the cells, (2, 1 + k, ..., M)."""
        if not np.ptp(self.rows[i], axis=-1).any():  # as of most members, who come in the order of their rows
            same: Array = block[self.rows[i][:, 0]]
            return same
        index = self.rows[i].reshape(2, *(1,) * (block.ndim - 2), -1)
        found: Array = np.take_along_axis(block, index, 0)
        return found

    def clear_of_edges(self, machine: Evaluator, here: dict[str, Value], shape: tuple[int, ...]) -> Bools:
        """The members on whose cells nothing comes to the edge of where it is analytic, as a root of x does at 0: there
        coefficients fall so slowly that they don't tell; nor do they where an exponent is steep."""
        found, exponents = edges_of(self.face), exponents_in(self.face)
        box = _box(here) if found or exponents else {}
        steep = change(exponents, box) > STEEPEST if exponents else False
        fine = np.array(np.broadcast_to(~np.asarray(steep), shape[-1:]))
        near = tuple(edge for edge in found if not _away(edge, box))
        if near:
            edges = function_of(tuple_(near))
            for cell in numbers_at(edges, machine, {name: still(here[name]) for name in edges.params}):
                size = np.broadcast_to(np.abs(cell.v), shape)[:, *_between(len(shape) - 2)].reshape(-1, shape[-1])
                fine &= size.min(axis=0) > EDGE * size.max(axis=0)
        return fine

    def added(self, nodes: Nodes) -> tuple[Array, list[Array]]:
        """What the nodes amount to, (1 + k, M), and the sizes of coefficients along each variable."""
        number, k1, count = nodes.value, len(nodes.value), self.count
        volumes = [np.ones((k1, count))]  # of a node of the variables further out, with weights, and of its stretch
        volumes[0][1:] = 0.0
        for i, (width, _) in enumerate(nodes.widths):
            volumes[i] = product(volumes[i], width)
            weights = (self.axes[i].weights * self.axes[i].speeds).reshape(-1, *(1,) * (width.ndim - 1))
            volumes.append(volumes[i][:, None] * weights)
        sizes = []
        for i in reversed(range(len(self.axes))):
            axis, (width, _), flat = self.axes[i], nodes.widths[i], number.reshape(*number.shape[:2], -1)
            if np.ptp(axis.speeds) > 0:
                flat = flat * axis.speeds[:, None]
            if axis.transform.shape[1] == 1:
                number = axis.transform[:, 0] @ flat
                sizes.append(np.abs(number)[..., None])
            else:
                coefficients = axis.transform.T @ flat
                number = coefficients[:, 0]
                sizes.append(_summed(np.abs(coefficients), np.abs(volumes[i])))
            number = product(number.reshape(width.shape), width)
        return number, sizes[::-1]

    def rounded(self, nodes: Nodes) -> tuple[Array, Array]:
        """What rounding may put the integrals off, and what is added up for them, from some nodes: (1 + k, M).

        Where the end of a stretch is off, the integral is by as much as is integrated further in at that end: next to
        nothing at the tip of a slim triangle, however far off that is. Nodes are off by their own rounding alone, as
        they lie between the ends that there are."""
        most, off = np.abs(nodes.value), nodes.off
        for i in reversed(range(len(self.axes))):
            (width, lost), speeds, reach = nodes.widths[i], self.axes[i].few_speeds, None
            if i + 1 < len(self.axes):
                reach, fine = (most + off)[:, -ENDS:], speeds[-ENDS:].reshape(-1, *(1,) * (most.ndim - 2)) > 0
                most, off = most[:, :-ENDS], off[:, :-ENDS]
            speeds = speeds[:-ENDS].reshape(-1, *(1,) * (most.ndim - 2))
            most, off = (most * speeds).max(axis=1), (off * speeds).max(axis=1)
            size = np.abs(width)
            if reach is None:
                slack = product(most, lost[0] + lost[1])
            else:
                low, high = np.where(fine & np.isfinite(reach), reach, most[:, None]).swapaxes(0, 1)
                slack = product(low, lost[0]) + product(high, lost[1])
            off = product(off, size) + slack
            most = product(most, size)
        return off, most


def misplaced(ends: Array, width: Array) -> tuple[Array, Array]:
    """How far rounding puts the nodes of stretches off, and both ends, (2, ...), which may be off themselves.

    The nodes are those of a stretch that begins at its lower end and is as long as the width that was worked out, so
    that its upper end is off by the rounding of that: u |width| with u = UNIT_ROUNDOFF. A node lo + width t rounds the
    sum, the product and t, which is off by 2 u at the most (`axes`): to first order by
    u (|lo + width t| + |width| t + 2 |width|) in all.
    """
    short = UNIT_ROUNDOFF * np.abs(width)
    off = np.zeros_like(ends)
    off[1] = short
    return UNIT_ROUNDOFF * np.abs(ends).max(axis=0) + 3.0 * short, off


def _between(count: int) -> tuple[slice, ...]:
    """Of so many axes of nodes those that are not the ends of stretches."""
    return (slice(None, -ENDS),) * count


def _largest(value: Array) -> Array:
    """Of numbers (..., M) the largest without regard to sign, those that are none left out: (M,)."""
    size = np.abs(value)
    return np.asarray(np.where(np.isfinite(size), size, 0.0).reshape(-1, value.shape[-1]).max(axis=0))


def _clear(rows: Array, ends: Array) -> Bools:
    """The members for which a stretch is one at all nodes: its ends in order, no other cut between them."""
    fine = (ends[1] > ends[0]) & ~((rows > ends[0]) & (rows < ends[1])).any(axis=0)
    return np.asarray(fine.reshape(-1, ends.shape[-1]).all(axis=0))


def _summed(block: Array, volume: Array) -> Array:
    """(f g)', with f (1 + k, n, R), summed over all nodes g of the variables further out: (1 + k, M, n)."""
    k1, count = len(volume), volume.shape[-1]
    block, volume = block.reshape(k1, block.shape[1], -1, count), volume.reshape(k1, -1, count)
    total: Array = np.einsum("knrm,rm->kmn", block, volume[0])
    if k1 > 1:
        total[1:] += np.einsum("nrm,krm->kmn", block[0], volume[1:])
    return total


def _box(here: Mapping[str, Value]) -> dict[str, Interval]:
    """Where numbers are on the cells of members."""
    box: dict[str, Interval] = {}
    for name, cell in here.items():
        if isinstance(cell, Cell):
            rows = np.atleast_1d(cell.v)
            rows = rows.reshape(-1, rows.shape[-1])
            box[name] = rows.min(axis=0), rows.max(axis=0)
    return box


def _away(edge: Term, box: Mapping[str, Interval]) -> bool:
    """Whether it is known without a look at nodes that no cell comes near to where this is 0."""
    if not (enclosable(edge) and edge.free <= box.keys()):
        return False
    least, most = enclosure((edge,), box)[0]
    near, far = np.minimum(np.abs(least), np.abs(most)), np.maximum(np.abs(least), np.abs(most))
    return bool(np.all((np.sign(least) == np.sign(most)) & (near > EDGE * far)))
