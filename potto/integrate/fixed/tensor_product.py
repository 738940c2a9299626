"""Members of a batch that nothing cuts: their boxes are integrated whole, by one product rule.

Owns `Box` and `uncut`. Of a picture's pixels all but a few lie on one side of every surface. Where a surface is affine
in each variable of integration, its extremes over a box are at the corners, so that signs there tell whether it
crosses; of others an enclosure tells. Such a box needs no cuts and has no boundary terms: a small product of Gauss
rules does, exact for a polynomial; else its coefficients tell in each variable whether it was enough. What is not shown
to be smooth and accurate here is left to `adaptive`.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping
from contextlib import nullcontext
from functools import lru_cache
from typing import Any

import numpy as np
from msgspec import Struct

from potto.calculus.algebra.degree import degree, plane
from potto.calculus.solving.enclosable import enclosable
from potto.calculus.surfaces.discontinuities import Finding
from potto.core.kinds import union_of
from potto.core.terms import Integral, Lam, Term, function_of, postorder, tuple_
from potto.integrate.fixed.axes import Axis
from potto.integrate.fixed.lowered import lowered
from potto.integrate.fixed.straight import Straight
from potto.integrate.pieces import Evaluator, Sums, dense, gather, still
from potto.integrate.rules.gauss import EPS, gauss, truncation
from potto.integrate.rules.intervals import Interval
from potto.integrate.rules.lowered_intervals import enclosures
from potto.kernels.cells import Array, Bools, Cell, Ints, Value, map_arrays

MOST_VARIABLES = 3
# Nodes per variable: first few, then more for the boxes that need them.
ORDERS = (4, 8)
POINTS = 1 << 15
# How near to 0, of its size, a surface at a corner may be before it counts as crossing.
NEAR = 1e-9
NODE_ROUNDING = 0.5


class Box(Struct, frozen=True):
    """Bounds and surfaces of an integral over a box, as functions of parameters, and of parameters and variables.

    surfaces: those that are affine in each variable. curved: the others. exact: the nodes per variable that do for what
    is a polynomial between its surfaces. plan: the same as an integral without cuts, for machine code.
    """

    variables: tuple[str, ...]
    bounds: Lam
    surfaces: Lam
    curved: tuple[Term, ...]
    body: Lam
    exact: int | None
    plan: Straight


def box_of(term: Integral, found: Iterable[Finding], body: Lam, inlined: Term) -> Box | None:
    """The box of an integral, or None if its bounds depend on its variables or a surface can't be enclosed over it.

    inlined: the integrand with calls carried out.
    """
    names = frozenset(term.variables)
    bounds = tuple(bound for pair in term.bounds for bound in pair)
    if len(names) > MOST_VARIABLES or any(b.free & names for b in bounds) or any(term.hints):
        return None
    if any(isinstance(node, Integral) for node in postorder(term.body)):
        return None
    surfaces = tuple(dict.fromkeys(f.surface for f in found if f.surface.free & names))
    curved = tuple(surface for surface in surfaces if not all(plane(surface, (name,)) for name in names))
    if not all(map(enclosable, curved)):
        return None
    shown = tuple_(surface for surface in surfaces if surface not in curved)
    degrees = [degree(inlined, variable) for variable in term.variables]
    nodes = max(ORDERS[-1] + 1 if d is None else d // 2 + 1 for d in degrees)
    exact = nodes if nodes <= ORDERS[-1] else None
    functions = function_of(tuple_(bounds)), function_of(shown)
    return Box(term.variables, *functions, curved, body, exact, _plan(term, inlined))


def _plan(term: Integral, inlined: Term) -> Straight:
    frames = tuple(function_of(tuple_(pair)) for pair in term.bounds)
    free = inlined.free.union(*(frame.body.free for frame in frames)) - set(term.variables)
    nothing: tuple[Any, ...] = ((),) * len(frames)
    turning = (frozenset[int](),) * len(frames)
    surfaces = function_of(tuple_(()))
    return Straight(term.variables, frames, nothing, turning, inlined, surfaces, tuple(sorted(free)))


def uncut(box: Box, machine: Evaluator, env: dict[str, Value], batch: int) -> tuple[Bools, Sums] | None:
    """Which members were integrated here, and the sums of all (zero for the others); None if none were."""
    bounds = machine.evaluate(box.bounds, {n: env[n] for n in box.bounds.params}, None)
    assert isinstance(bounds, tuple)
    edges = []
    for cell in bounds:
        assert isinstance(cell, Cell)
        if cell.e is not None or any(t is not None for t in cell.t):
            return None  # a bound that moves has boundary terms of its own
        edges.append(np.broadcast_to(cell.v, (batch,)))
    low, high = np.stack(edges[::2]), np.stack(edges[1::2])
    free = _free_of_surfaces(box, machine, env, low, high)
    if not free.any():
        return None
    done: Bools = np.zeros(batch, dtype=bool)
    sums: Sums | None = None
    for order in ORDERS if box.exact is None else (box.exact,):
        todo = np.nonzero(free & ~done)[0]
        size = max(1, POINTS // order ** len(box.variables))
        for index in (todo[i : i + size] for i in range(0, todo.size, size)):
            found = _product(box, machine, env, index, low[:, index], high[:, index], order)
            if found is None:
                return None
            part, good = found
            if sums is None:
                sums = Sums.zeros(part.v.shape[0], machine.directions, batch)
            taken = index[good]
            done[taken] = True
            sums.put(taken, part.pick(good))
    return (done, sums) if sums is not None and done.any() else None


def _free_of_surfaces(box: Box, machine: Evaluator, env: dict[str, Value], low: Array, high: Array) -> Bools:
    """Members whose box is finite and not empty, with every surface on one side of it."""
    free: Bools = np.asarray(np.isfinite(high - low).all(axis=0) & (high > low).all(axis=0))
    corners = list(itertools.product((0, 1), repeat=len(box.variables)))
    here = {n: still(env[n]) for n in box.surfaces.params if n in env}
    for n, variable in enumerate(box.variables):
        ends = (low[n], high[n])
        here[variable] = Cell(np.stack([ends[corner[n]] for corner in corners]))
    still_machine = machine.with_directions(0)
    values = still_machine.evaluate(box.surfaces, {n: here[n] for n in box.surfaces.params}, None)
    assert isinstance(values, tuple)
    for value in values:
        assert isinstance(value, Cell)
        at = np.broadcast_to(value.v, (len(corners), low.shape[1]))
        near = NEAR * np.abs(at).max(axis=0)
        free = np.asarray(free & ((at > near).all(axis=0) | (at < -near).all(axis=0)))
    index: Ints = np.nonzero(free)[0] if box.curved else np.zeros(0, dtype=np.int64)
    if index.size:
        ranges: dict[str, Interval] = {}
        for name in union_of(box.curved) - set(box.variables):
            cell = map_arrays(env[name], lambda a: a[index])
            assert isinstance(cell, Cell)
            off = 0.0 if cell.e is None else cell.e
            ranges[name] = (cell.v - off, cell.v + off)
        ranges |= {x: (low[n, index], high[n, index]) for n, x in enumerate(box.variables)}
        for least, most in enclosures(box.curved, ranges, index.size, machine.backend):
            free[index] &= (least > 0) | (most < 0)
    return free


@lru_cache(maxsize=16)
def _tensor(order: int, count: int) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """Nodes of each variable over the product grid, (n^d, 1) each; weights of the last j variables, j = 0 ... d."""
    rule = gauss(order)
    grids = np.meshgrid(*(rule.nodes,) * count, indexing="ij")
    weights = [np.ones(1)]
    for _ in range(count):
        weights.append(np.outer(weights[-1], rule.weights).reshape(-1))
    return tuple(g.reshape(-1, 1) for g in grids), tuple(weights)


def _product(
    box: Box, machine: Evaluator, env: dict[str, Value], index: Ints, low: Array, high: Array, order: int
) -> tuple[Sums, Bools] | None:
    """The integrals over some boxes by the product rule, and for which of them it is accurate enough."""
    machine.count(index.size * order ** len(box.variables))
    size, k = high - low, machine.directions
    far, exact = np.maximum(np.abs(low), np.abs(high)) / size, order == box.exact
    volume = size.prod(axis=0)
    way = lowered(box.plan, box.plan.body, k, env) if _exact(env, box.plan) else None
    function = None if way is None else way.function(machine)
    if way is not None and function is not None:
        axis = Axis.of(order, False, (False, False), True)
        whole = np.broadcast_to(np.array([[0], [1]]), (len(box.variables), 2, index.size))
        raw = way.run(function, env, index, whole, [axis] * len(box.variables), k)
        shape = (1, *raw.number.shape)
        means = [sizes / volume[:, None] for sizes in raw.coefficients]
        integral, most = raw.number / volume, raw.most[None] / volume
        floor = 4 * EPS * most[0]
    else:
        here = gather({n: env[n] for n in box.body.params if n in env}, index)
        with nullcontext() if way is None else way.promotion.by_numpy():
            found = _at_nodes(box, machine, here, low, size, order)
        if found is None:
            return None
        integral, means, most, shape = found
        floor = 4 * EPS * most.reshape(integral.shape)
    error = np.zeros(integral.shape)
    for distance, mean in zip(far, means, strict=True):
        error += 0.0 if exact else truncation(mean)
        floor += (mean @ gauss(order).slopes) * np.minimum(NODE_ROUNDING * EPS * distance, 1.0)
    asked = np.maximum(0.5 * machine.rtol * np.abs(integral), 0.5 * machine.atol / volume)
    good: Bools = (error <= np.maximum(asked, 8 * floor)).all(axis=0)
    total, bound = (integral * volume).reshape(shape), ((error + floor) * volume).reshape(shape)
    most = most.max(axis=0) * volume
    gross = np.stack((most[0], most[1:].max(axis=0, initial=0.0)))
    return Sums(total[:, 0], bound[:, 0], total[:, 1:], bound[:, 1:], gross=gross), good


def _at_nodes(
    box: Box, machine: Evaluator, env: dict[str, Value], low: Array, size: Array, order: int
) -> tuple[Array, list[Array], Array, tuple[int, ...]] | None:
    """Mean values of channels over boxes (C, B), mean sizes of coefficients along each variable (C, B, n), what is
    added up (m, 1 + k, B), and the shape of components and channels. None for values with errors of their own."""
    nodes, weights = _tensor(order, len(box.variables))
    here = dict(env)
    for n, variable in enumerate(box.variables):
        here[variable] = Cell(low[n] + size[n] * nodes[n], None, (None,) * machine.directions)
    value = machine.evaluate(box.body, {n: here[n] for n in box.body.params}, None)
    numbers, errors = dense(value, machine.directions, (nodes[0].size, low.shape[1]))
    if errors is not None:
        return None
    most = weights[-1] @ np.abs(numbers)
    h = numbers.reshape(-1, *numbers.shape[2:])
    means = []
    for rest in reversed(weights[:-1]):  # one variable after another, outermost first
        coefficients = gauss(order).transform.T @ h.reshape(h.shape[0], order, -1)
        sizes = np.abs(coefficients).reshape(h.shape[0], order, rest.size, -1)
        mean = sizes[:, :, 0] if rest.size == 1 else np.einsum("r,cnrb->cnb", rest, sizes)
        means.append(np.moveaxis(mean, 1, -1))
        h = coefficients[:, 0].reshape(h.shape[0], rest.size, -1)
    return h[:, 0], means, most, (*numbers.shape[:2], low.shape[1])


def _exact(env: Mapping[str, Value], plan: Straight) -> bool:
    """Whether all parameters are numbers without errors."""
    cells = [env[name] for name in plan.names]
    return all(isinstance(cell, Cell) and cell.e is None and not any(cell.et) for cell in cells)
