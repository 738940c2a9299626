"""Cells of one shape, whoever's they are, by rules that were proved beforehand to be enough.

Owns `proved_rules`. The parameters of the members are gathered in regions, of which there are few where parameters
are; a proof for each (`proved_orders`) says how many nodes do for all cells that lie between the same rows there, and
what these leave out. Then no coefficients are asked for, and most cells get far fewer nodes than their coefficients,
which tell less, would have them take. Where nothing can be proved, coefficients tell (`alike`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from msgspec import Struct

from potto.integrate.columns import distinct, places_of
from potto.integrate.fixed.cells.product_rule import CALL, ProductRule, way_of
from potto.integrate.fixed.cells.topologies import Alike
from potto.integrate.fixed.regions import LOOSEST, MARGIN, MOST_REGIONS
from potto.integrate.fixed.straight import RowNumbers, StraightIntegral, rows_between
from potto.integrate.pieces import Evaluator
from potto.integrate.rules.proved_orders import FrameCell as Stretch
from potto.integrate.rules.proved_orders import proved_of_each
from potto.kernels.cells import Array, Cell, Ints, Number, Value
from potto.kernels.making import making

# How many cells in a region pay for its proof, which takes 0.1 ms where many are proved at once, and into how many
# parts, as a power of two, the range of parameters is cut at the most. Where one parameter differs there are no more
# regions than these, whatever batches come, so that they are proved for FEW cells between the same rows.
LEAST, FEW, FINEST = 32, 8, 5
# The least radius of a region, as a part of the size of a parameter: the bound of a derivative is that of the error by
# the radius.
NARROWEST = 2.0**-6
# Nodes per variable are multiples of this: rules that differ in a node take longer to be called than they save.
EVEN = 2


class _Grid(Struct, frozen=True):
    """Regions of parameters: the width of each along a parameter, and the radii of the discs of the proofs. least: how
    many cells between the same rows are worth their proofs."""

    least: int
    names: tuple[str, ...]
    width: tuple[float, ...]
    radius: tuple[float, ...]
    narrowest: float


def proved_rules(
    plan: StraightIntegral,
    exact: Sequence[int | None],
    machine: Evaluator,
    env: dict[str, Value],
    cell: Alike,
    tight: bool,
) -> tuple[list[tuple[ProductRule, Ints]], Ints]:
    """Rules with the cells that they are for, and the cells for which there are none.

    exact: the nodes of variables in which the integrand is a polynomial. Where nothing was proved of cells between the
    same rows, nothing is tried for others with parameters in the same regions.
    """
    count, everybody = cell.members.size, np.arange(cell.members.size)
    if count < FEW or any(map(any, cell.turning)):
        return [], everybody
    shapes = distinct(cell.between)
    shape, rows = places_of(shapes, cell.between), rows_between(shapes, len(cell.turning))
    stretches = [_stretch(cell, rows[:, :, number]) for number in range(shapes.size)]
    values = {name: _of(env[name].v, cell.members) for name in _names(plan, stretches)}  # type: ignore[union-attr]
    grid = _grid(values, count)
    if grid is None:
        return [], everybody
    many = shapes[np.bincount(shape) >= grid.least]
    key = (cell.face, many.tobytes(), grid, _box(values, grid), machine.rtol, machine.directions > 0)
    if not many.size or key in plan.regions:
        return [], everybody
    region, places = _regions(values, grid, count)
    kind = shape * places.shape[1] + region
    counts = np.bincount(kind, minlength=shapes.size * places.shape[1])
    nodes, error = _proofs(plan, stretches, exact, grid, places, counts, machine)
    if not nodes.any():
        if len(plan.regions) >= MOST_REGIONS:
            plan.regions.clear()
        plan.regions[key] = None
        return [], everybody
    beyond = np.empty((1 + machine.directions, count))
    beyond[0] = error.take(kind)
    for d in range(machine.directions):
        beyond[1 + d] = beyond[0] * _speed(grid, env, cell.members, d)
    exactly = (True,) * len(plan.variables)
    orders, which = _shared(nodes, counts)
    way = way_of(plan, cell, exactly, machine, env)
    rules = [ProductRule(plan, cell, own, exactly, machine, way, tight, beyond) for own in orders]
    if len(rules) == 1 and (which >= 0).all():
        return [(rules[0], everybody)], everybody[:0]
    each = which.take(kind)
    ends = np.cumsum(np.bincount(each + 1, minlength=len(rules) + 1))
    left, *those = np.split(np.argsort(each, kind="stable"), ends[:-1])
    return list(zip(rules, those, strict=True)), left


def _proofs(
    plan: StraightIntegral, stretches: Sequence[Stretch], exact: Sequence[int | None], grid: _Grid, places: Ints,
    counts: Ints, machine: Evaluator,
) -> tuple[Ints, Array]:  # fmt: skip
    """Nodes per variable (D, K) and bounds of the error (K,) for cells of each shape in each region, by how many of
    them there are (K,); no nodes where nothing is proved, or it would not pay."""
    nodes, error = np.zeros((len(plan.variables), counts.size), dtype=np.int64), np.zeros(counts.size)
    tolerance = MARGIN * min(machine.rtol, LOOSEST) * (grid.narrowest if machine.directions else 1.0)
    each = counts.reshape(len(stretches), -1)
    for number, (stretch, own) in enumerate(zip(stretches, each, strict=True)):
        if own.sum() >= grid.least:
            there = np.flatnonzero(own)
            orders, errors = _orders(plan, stretch, exact, grid, places.take(there, 1), tolerance)
            there += number * own.size
            nodes[:, there], error[there] = orders, errors
    return nodes, error


def _stretch(cell: Alike, rows: RowNumbers) -> Stretch:
    """What cells between these rows are to a proof."""
    return Stretch(tuple((low, high) for low, high in rows.tolist()), cell.face)


def _names(plan: StraightIntegral, stretches: Sequence[Stretch]) -> list[str]:
    """The parameters of some cells."""
    ends = {plan.items[i][row] for stretch in stretches for i, pair in enumerate(stretch.rows) for row in pair}
    terms = {*ends, *(stretch.body for stretch in stretches)}
    return sorted({name for term in terms for name in term.free}.difference(plan.variables))


def _speed(grid: _Grid, env: dict[str, Value], members: Ints, direction: int) -> Number:
    """By how much the bound of a derivative along a direction is larger than that of the value."""
    speed: Number = 0.0
    for name, radius in zip(grid.names, grid.radius, strict=True):
        given = env[name]
        assert isinstance(given, Cell)
        t = given.t[direction] if direction < len(given.t) else None
        if t is not None:
            speed = np.maximum(speed, np.abs(_of(t, members)) / radius)
    return speed


def _shared(nodes: Ints, cells: Ints) -> tuple[list[tuple[int, ...]], Ints]:
    """Orders, of which there are few, and which of them each kind of cells gets (K,): at least as many nodes as are
    asked for (D, K); -1 where none are. cells: how many there are of each kind."""
    most: tuple[int, ...] = tuple(nodes.max(axis=1).tolist())
    here = cells > 0
    if nodes[0, here].all() and math.prod(most) * int(cells.sum()) - int(nodes.prod(axis=0) @ cells) < CALL:
        return [most], np.zeros(cells.size, dtype=np.int8)
    counts: dict[tuple[int, ...], int] = {}
    asked: list[tuple[int, ...]] = list(map(tuple, nodes.T.tolist()))
    for own, count in zip(asked, cells.tolist(), strict=True):
        if count and own[0]:
            counts[own] = counts.get(own, 0) + count
    parts = {orders: [orders] for orders in counts}
    settled: dict[tuple[int, ...], list[tuple[int, ...]]] = {}
    while counts:
        orders = min(counts, key=counts.__getitem__)
        count, alike = counts.pop(orders), parts.pop(orders)
        joint, least = None, CALL
        for other, those in counts.items():
            both = tuple(map(max, orders, other))
            more = (math.prod(both) - math.prod(orders)) * count + (math.prod(both) - math.prod(other)) * those
            if more < least:
                joint, into, least = both, other, more
        if joint is None:
            settled[orders] = alike
            continue
        for key in {into, joint} & parts.keys():
            count += counts.pop(key)
            alike += parts.pop(key)
        counts[joint], parts[joint] = count, alike
    rule = {orders: number for number, those in enumerate(settled.values()) for orders in those}
    return list(settled), np.array([rule.get(orders, -1) for orders in asked], dtype=np.int8)


def _of(number: Number, members: Ints) -> Number:
    return number.take(members) if isinstance(number, np.ndarray) and number.ndim else number


def _grid(values: dict[str, Number], count: int) -> _Grid | None:
    """Regions of so many cells' parameters: as many as these pay for. Their widths are powers of two, so that those of
    other batches are the same."""
    ends = {name: (float(np.min(x)), float(np.max(x))) for name, x in values.items()}
    moving = sum(high > low for low, high in ends.values())
    fine = FINEST if moving < 2 else min(FINEST, int(math.log2(max(count / LEAST, 1)))) // moving
    widths, radii, narrowest = [], [], 1.0
    for low, high in ends.values():
        size = max(abs(low), abs(high))
        if not math.isfinite(size):
            return None
        narrow = math.ldexp(NARROWEST, math.frexp(size or 1.0)[1])
        width = math.ldexp(0.5**fine, math.frexp(high - low)[1]) if high > low else narrow
        widths.append(width)
        radii.append(max(0.5 * width, narrow))
        narrowest = min(narrowest, radii[-1] / narrow * NARROWEST)  # of the power of two above the size
    return _Grid(FEW if moving < 2 else 2 * LEAST, tuple(ends), tuple(widths), tuple(radii), narrowest)


def _box(values: dict[str, Number], grid: _Grid) -> tuple[tuple[int, int], ...]:
    """The first and the last place in the grid along each parameter of some cells."""
    widths = zip(values.values(), grid.width, strict=True)
    return tuple([(math.floor(np.min(x) / width), math.floor(np.max(x) / width)) for x, width in widths])


def _regions(values: dict[str, Number], grid: _Grid, cells: int) -> tuple[Ints, Ints]:
    """In which of some regions each cell's parameters lie (M,), and the places of these in the grid (P, R)."""
    code, sizes = np.zeros(1, dtype=np.int64), []
    for x, width in zip(values.values(), grid.width, strict=True):
        at = np.floor(np.atleast_1d(x) / width).astype(np.int64)
        least = int(at.min())
        count = int(at.max()) - least + 1
        code = code * count + (at - least)
        sizes.append((least, count))
    known = distinct(code)
    places = []
    rest = known
    for least, count in reversed(sizes):
        places.append(rest % count + least)
        rest = rest // count
    number = np.broadcast_to(places_of(known, code), cells)
    return number, np.array(places[::-1], dtype=np.int64).reshape(len(sizes), known.size)


def _orders(
    plan: StraightIntegral, stretch: Stretch, exact: Sequence[int | None], grid: _Grid, places: Ints, tolerance: float
) -> tuple[Ints, Array]:
    """Nodes per variable and region (D, R), and bounds of the error (R,): proved once."""
    known: dict[tuple[int, ...], tuple[tuple[int, ...], float]]
    known = plan.regions.setdefault((stretch, grid, tolerance), {})  # type: ignore[assignment]
    keys = list(map(tuple, places.T.tolist()))
    found = {key: known.get(key) for key in keys}
    new = [number for number, key in enumerate(keys) if found[key] is None]
    if new:
        middle = {
            name: (row[new] + 0.5) * width for name, row, width in zip(grid.names, places, grid.width, strict=True)
        }
        radius = dict(zip(grid.names, grid.radius, strict=True))
        with making:
            proofs = proved_of_each(plan.variables, plan.items, stretch, middle, radius, exact, tolerance)
        nodes = -(-proofs.nodes // EVEN) * EVEN
        fresh = {keys[n]: (tuple(o), e) for n, o, e in zip(new, nodes.tolist(), proofs.error.tolist(), strict=True)}
        found.update(fresh)
        if len(known) + len(fresh) > MOST_REGIONS:
            known.clear()
        known.update(fresh)
    orders, errors = zip(*(each for each in found.values() if each is not None), strict=True)
    return np.array(orders, dtype=np.int64).T, np.array(errors)
