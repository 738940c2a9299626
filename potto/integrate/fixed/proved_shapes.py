"""Cells of one shape, whoever's they are, by rules that were proved beforehand to be enough.

Owns `proved_rules`. The parameters of the members are gathered in regions, of which there are few where parameters
are; a proof for each (`proved_orders`) says how many nodes do for all cells that lie between the same rows there, and
what these leave out. Then no coefficients are asked for, and most cells get far fewer nodes than their coefficients,
which tell less, would have them take. Where nothing can be proved, coefficients tell (`alike`).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
from msgspec import Struct

from potto.integrate.columns import distinct
from potto.integrate.fixed.product_rule import Rule
from potto.integrate.fixed.regions import LOOSEST, MARGIN, MOST_REGIONS
from potto.integrate.fixed.straight import Straight
from potto.integrate.fixed.topologies import Alike
from potto.integrate.pieces import Evaluator
from potto.integrate.rules.proved_orders import Cell as Stretch
from potto.integrate.rules.proved_orders import proved_of_each
from potto.kernels.cells import Array, Bools, Cell, Ints, Number, Value
from potto.kernels.making import making

# How many cells in a region pay for its proof, which takes 0.1 ms where many are proved at once, and into how many
# parts, as a power of two, the range of parameters is cut at the most.
LEAST, FINEST = 32, 5
# The least radius of a region, as a part of the size of a parameter: the bound of a derivative is that of the error by
# the radius.
NARROWEST = 2.0**-6
# Nodes per variable are multiples of this: rules that differ in a node take longer to be called than they save.
EVEN = 2
# A call of a rule takes as long as so many nodes.
CALL = 1 << 16


class _Grid(Struct, frozen=True):
    """Regions of parameters: the width of each along a parameter, and the radii of the discs of the proofs."""

    names: tuple[str, ...]
    width: tuple[float, ...]
    radius: tuple[float, ...]
    narrowest: float


class _Proved(Struct, frozen=True):
    """Per cell (M,): the nodes of each variable, (D, M), 0 where nothing was proved; bounds of what a rule leaves out
    of the values and tangents (1 + k, M)."""

    nodes: Ints
    beyond: Array


def proved_rules(
    plan: Straight, exact: Sequence[int | None], machine: Evaluator, env: dict[str, Value], cell: Alike
) -> tuple[list[tuple[Rule, Ints]], Ints]:
    """Rules with the cells that they are for, and the cells for which there are none.

    exact: the nodes of variables in which the integrand is a polynomial.
    """
    index = np.argsort(cell.between, kind="stable")
    if index.size < 2 * LEAST or any(map(any, cell.turning)):
        return [], index
    edges = np.flatnonzero(np.diff(cell.between.take(index))) + 1
    nodes = np.zeros((len(plan.variables), index.size), dtype=np.int64)
    beyond = np.zeros((1 + machine.directions, cell.members.size))
    for start, stop in itertools.pairwise((0, *edges.tolist(), index.size)):
        those = index[start:stop]
        found = _proved(plan, exact, machine, env, cell, those) if those.size >= 2 * LEAST else None
        if found is not None:
            nodes[:, start:stop] = found.nodes
            beyond[:, those] = found.beyond
    exactly = (True,) * len(plan.variables)
    parts = _shared(nodes)
    rules = [(Rule(plan, cell, orders, exactly, machine, beyond), index[own]) for orders, own in parts.items()]
    return rules, index[nodes[0] == 0]


def _shared(nodes: Ints) -> dict[tuple[int, ...], Bools]:
    """By orders, of which there are few, the cells that get as many nodes: at least those that are asked for (D, M)."""
    base = int(nodes.max(initial=0)) + 1
    kind = np.zeros(nodes.shape[1], dtype=np.int64)
    for row in nodes:
        kind = kind * base + row
    counts = {
        tuple(number // base**i % base for i in reversed(range(len(nodes)))): int(count)
        for number, count in enumerate(np.bincount(kind))
        if number and count
    }
    parts = {orders: [orders] for orders in counts}
    for orders in sorted(counts, key=counts.__getitem__):
        if orders not in parts:  # others have joined these
            continue
        count, own = counts.pop(orders), parts.pop(orders)
        into, least = orders, CALL
        for other, those in counts.items():
            both = math.prod(map(max, orders, other))
            more = (both - math.prod(orders)) * count + (both - math.prod(other)) * those
            if more < least:
                into, least = other, more
        joint = tuple(map(max, orders, into))
        for key in {into, joint} & parts.keys():
            count, own = count + counts.pop(key), own + parts.pop(key)
        counts[joint], parts[joint] = count, own
    place = base ** np.arange(len(nodes))[::-1]
    return {orders: np.isin(kind, np.array(own) @ place) for orders, own in parts.items()}


def _proved(
    plan: Straight, exact: Sequence[int | None], machine: Evaluator, env: dict[str, Value], cell: Alike, those: Ints
) -> _Proved | None:
    """What is known of cells between the same rows; None if there is no telling regions."""
    rows = cell.rows[:, :, those[0]]
    stretch = Stretch(tuple((int(low), int(high)) for low, high in rows), cell.face)
    ends = (plan.items[i][row] for i, pair in enumerate(stretch.rows) for row in pair)
    names = sorted(cell.face.free.union(*(end.free for end in ends)).difference(plan.variables))
    members = cell.members.take(those)
    values = {name: _of(env[name].v, members) for name in names}  # type: ignore[union-attr]
    grid = _grid(values, those.size)
    if grid is None:
        return None
    code, places = _regions(values, grid)
    tolerance = MARGIN * min(machine.rtol, LOOSEST) * (grid.narrowest if machine.directions else 1.0)
    nodes, error = _orders(plan, stretch, exact, grid, places, tolerance)
    beyond = np.empty((1 + machine.directions, those.size))
    beyond[0] = error.take(code)
    for d in range(machine.directions):
        speed: Number = 0.0
        for name, radius in zip(grid.names, grid.radius, strict=True):
            given = env[name]
            assert isinstance(given, Cell)
            t = given.t[d] if d < len(given.t) else None
            if t is not None:
                speed = np.maximum(speed, np.abs(_of(t, members)) / radius)
        beyond[1 + d] = beyond[0] * speed
    return _Proved(nodes.take(code, 1), beyond)


def _of(number: Number, members: Ints) -> Number:
    return number.take(members) if isinstance(number, np.ndarray) and number.ndim else number


def _grid(values: dict[str, Number], count: int) -> _Grid | None:
    """Regions of so many cells' parameters: as many as these pay for. Their widths are powers of two, so that those of
    other batches are the same."""
    ends = {name: (float(np.min(x)), float(np.max(x))) for name, x in values.items()}
    moving = sum(high > low for low, high in ends.values())
    fine = min(FINEST, int(math.log2(count / LEAST))) // max(moving, 1)
    widths, radii, narrowest = [], [], 1.0
    for low, high in ends.values():
        size = max(abs(low), abs(high))
        if not math.isfinite(size):
            return None
        narrow = math.ldexp(NARROWEST, math.frexp(size or 1.0)[1])
        width = math.ldexp(0.5**fine, math.frexp(high - low)[1]) if high > low else narrow
        widths.append(width)
        radii.append(max(0.5 * width, narrow))
        narrowest = min(narrowest, radii[-1] / (size or 1.0))
    return _Grid(tuple(ends), tuple(widths), tuple(radii), narrowest)


def _regions(values: dict[str, Number], grid: _Grid) -> tuple[Ints, Ints]:
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
    number = np.searchsorted(known, code)
    return number, np.array(places[::-1], dtype=np.int64).reshape(len(sizes), known.size)


def _orders(
    plan: Straight, stretch: Stretch, exact: Sequence[int | None], grid: _Grid, places: Ints, tolerance: float
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
