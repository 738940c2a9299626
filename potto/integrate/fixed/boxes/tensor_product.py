"""A product of Gauss rules over boxes that nothing cuts, by numpy.

Owns `BoxIntegrand` and `integrated`. Of a polynomial the rule takes as many nodes per variable as its degree asks for;
of anything else few, then more where the Legendre coefficients say that these were not enough; at the corners nothing
may be that no node has seen. All nodes of so many boxes are evaluated at once. (`lowered.boxes` does the same by
machine code.)
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cached_property, lru_cache

import numpy as np
from msgspec import Struct

from potto.core.terms import Lam, Term
from potto.integrate.columns import run_of
from potto.integrate.fixed.straight import StraightIntegral
from potto.integrate.panels.roundoff import LOOKED_AT, NODE_ROUNDING, WITHIN, part_of
from potto.integrate.pieces import Evaluator, Sums, components, dense, gather, still
from potto.integrate.rules.gauss import EPS, PEAK, gauss, truncation
from potto.integrate.rules.intervals import Interval
from potto.integrate.rules.steepness import STEEPEST, change, exponents_in
from potto.kernels.cells import Array, Bools, Cell, Ints, Value, map_arrays

# Nodes per variable: first few, then more for the boxes that need them.
ORDERS = (4, 8)
# Nodes that are evaluated at once.
POINTS = 1 << 16
# Up to which part of an integrand its rounding is what is counted for any.
CLEAR = 4 * EPS


class BoxIntegrand(Struct, frozen=True, dict=True, eq=False):
    """What is integrated over a box: a term over variables and parameters, and a function that gives its values.

    plan: of what it is a side. degrees: of the term in each variable, where it is a polynomial in it.
    """

    plan: StraightIntegral
    term: Term
    function: Lam
    degrees: tuple[int | None, ...]

    @cached_property
    def exact(self) -> tuple[int | None, ...]:
        """The nodes per variable that do for a polynomial."""
        nodes = (None if d is None else d // 2 + 1 for d in self.degrees)
        return tuple(n if n is not None and n <= ORDERS[-1] else None for n in nodes)


class Bounds(Struct, frozen=True):
    """Of boxes the bounds, (variables, B) each; off: how far both may be off together, None for not at all."""

    low: Array
    high: Array
    off: Array | None = None

    def of(self, where: Ints | slice) -> Bounds:
        """Those of some of the boxes."""
        if isinstance(where, slice):
            return Bounds(self.low[:, where], self.high[:, where], None if self.off is None else self.off[:, where])
        return Bounds(self.low.take(where, 1), self.high.take(where, 1),
                      None if self.off is None else self.off.take(where, 1))  # fmt: skip


class Means(Struct, frozen=True):
    """Mean values over boxes, (m, 1 + k, B), of the integrand, of its size and of its own error, and per variable the
    sizes of the Legendre coefficients along it, (m, 1 + k, n, B). largest, peaks:
    (m, B), the largest value at nodes and at corners."""

    number: Array
    most: Array
    own: Array
    along: list[Array]
    largest: Array
    peaks: Array


def integrated(
    face: BoxIntegrand, machine: Evaluator, env: dict[str, Value], index: Ints, bounds: Bounds
) -> Iterator[tuple[Ints, Sums]]:
    """The integrals over those boxes that a rule does for, some at a time: which, and their sums.

    index: of the boxes, among the members of `env`; bounds: of all members.
    """
    given = {name: env[name] for name in face.function.params if name in env}
    for orders in dict.fromkeys(tuple(order if n is None else n for n in face.exact) for order in ORDERS):
        step, left = max(1, POINTS // math.prod(orders)), []
        for start in range(0, index.size, step):
            some = index[start : start + step]
            machine.count(some.size * math.prod(orders))
            span = run_of(some)
            where = some if span is None else span
            sums, good = _at_nodes(face, machine, gather(given, where), bounds.of(where), orders)
            if good.all():
                yield some, sums
            else:
                left.append(some[~good])
                yield some[good], sums.pick(good)
        if not left:
            return
        index = np.concatenate(left)


@lru_cache(maxsize=64)
def _tensor(orders: tuple[int, ...]) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """Nodes of each variable over the product grid, (N, 1) each; weights of the variables from the j-th on."""
    grids = np.meshgrid(*(gauss(n).nodes for n in orders), indexing="ij")
    weights = [np.ones(1)]
    for n in reversed(orders):
        weights.append(np.outer(gauss(n).weights, weights[-1]).reshape(-1))
    return tuple(g.reshape(-1, 1) for g in grids), tuple(reversed(weights))


@lru_cache(maxsize=64)
def _places(orders: tuple[int, ...], corners: bool) -> tuple[Array, ...]:
    """The nodes of each variable and, if asked for, the corners of the unit cube behind them, (N, 1) each."""
    nodes, _ = _tensor(orders)
    if not corners:
        return nodes
    ends = np.meshgrid(*[np.array([0.0, 1.0])] * len(orders), indexing="ij")
    return tuple(np.append(x, end).reshape(-1, 1) for x, end in zip(nodes, ends, strict=True))


def _at_nodes(
    face: BoxIntegrand, machine: Evaluator, env: dict[str, Value], bounds: Bounds, orders: tuple[int, ...]
) -> tuple[Sums, Bools]:
    """A rule at all of its nodes at once, and for which boxes it does."""
    low, size = bounds.low, bounds.high - bounds.low
    volume = size.prod(axis=0)
    found = _means(face, machine, env, low, size, orders)
    number, most = found.number, found.most
    part = _share(face, machine, env, low, size)
    error, floor = np.zeros(number.shape), (CLEAR + np.where(part > CLEAR, part, 0.0)[:, None]) * most + found.own
    for variable, (n, mean) in enumerate(zip(face.exact, found.along, strict=True)):
        slopes = gauss(mean.shape[2]).slopes
        if n is None:
            error += truncation(mean.swapaxes(2, 3))
        if slopes.any():
            far = np.maximum(np.abs(low[variable]), np.abs(bounds.high[variable])) / size[variable]
            floor += (slopes @ mean) * np.minimum(NODE_ROUNDING * EPS * far, 1.0)
        if bounds.off is not None:  # at a bound the integrand is at most what its coefficients add up to
            floor += mean.sum(axis=2) * (bounds.off[variable] / size[variable])
    asked = np.maximum(0.5 * machine.rtol * np.abs(number), 0.5 * machine.atol / volume)
    good: Bools = (error <= np.maximum(asked, 8 * floor)).all(axis=(0, 1))
    good &= ((part < 1) & (found.peaks <= PEAK * found.largest)).all(axis=0)
    if None in face.exact:
        good &= _even(face, env, bounds)
    error += floor
    total, bound, most = number * volume, error * volume, most.max(axis=0) * volume
    gross = np.stack((most[0], most[1:].max(axis=0, initial=0.0)))
    return Sums(total[:, 0], bound[:, 0], total[:, 1:], bound[:, 1:], gross=gross), good


def _even(face: BoxIntegrand, env: dict[str, Value], bounds: Bounds) -> Bools:
    """On which boxes no exponent is so steep that there may be layers which no node sees."""
    exponents = exponents_in(face.term)
    if not exponents:
        return np.ones(bounds.low.shape[1], dtype=bool)
    box: dict[str, Interval] = {name: (cell.v, cell.v) for name, cell in env.items() if isinstance(cell, Cell)}
    box |= {name: (bounds.low[n], bounds.high[n]) for n, name in enumerate(face.plan.variables)}
    even: Bools = np.broadcast_to(~(change(exponents, box) > STEEPEST), bounds.low.shape[1:])
    return even


def _share(face: BoxIntegrand, machine: Evaluator, env: dict[str, Value], low: Array, size: Array) -> Array:
    """Which part of the integrand its own rounding is, by places within: (m, B), or (m, 1) where it is next to nothing
    of all boxes by which the others are judged."""
    index = _telling(env, low, size)
    if index.size < low.shape[1]:
        part = _shares(face, machine, gather(env, index), low[:, index], size[:, index])
        if (part <= CLEAR).all():
            return np.zeros((part.shape[0], 1))
    return _shares(face, machine, env, low, size)


def _telling(env: dict[str, Value], low: Array, size: Array) -> Ints:
    """Some boxes, evenly spaced, and those with the least and the largest of each number that tells them apart."""
    count = low.shape[1]
    rows = [*low, *size]

    def note(array: Array) -> Array:
        rows.append(array)
        return array

    for value in env.values():
        map_arrays(value, note)
    ends = [int(end) for row in rows if row.shape == (count,) for end in (row.argmin(), row.argmax())]
    return np.union1d(np.linspace(0, count - 1, min(count, LOOKED_AT)).astype(np.int64), ends)


def _shares(face: BoxIntegrand, machine: Evaluator, env: dict[str, Value], low: Array, size: Array) -> Array:
    there = {name: still(value) for name, value in env.items()}
    tracking = machine.with_directions(0).tracking()
    cells = _values(face, tracking, there, low, size, [WITHIN[:, None]] * len(low))
    numbers, errors = dense(tuple(cells), 0, (WITHIN.size, low.shape[1]))
    sums = (np.abs(row[:, 0]).sum(axis=1) for row in (numbers, np.zeros(numbers.shape) if errors is None else errors))
    return part_of(*sums)


def _means(
    face: BoxIntegrand, machine: Evaluator, env: dict[str, Value], low: Array, size: Array, orders: tuple[int, ...]
) -> Means:
    """What the nodes of a rule amount to."""
    nodes, weights = _tensor(orders)
    count, inside = low.shape[1], slice(nodes[0].size)
    places = _places(orders, None in face.exact)
    cells = _values(face, machine, env, low, size, places)
    shape = (len(cells), 1 + machine.directions)
    number, most, own = np.zeros((3, *shape, count))
    largest, peaks = np.zeros((2, len(cells), count))
    along = [np.zeros((*shape, n, count)) for n in orders]
    for i, cell in enumerate(cells):
        for c, (values, off) in enumerate(zip((cell.v, *cell.t), (cell.e, *cell.et), strict=True)):
            if values is None:
                continue
            everywhere: Array = np.broadcast_to(values, (places[0].size, count))
            h, sizes = everywhere[inside], np.abs(everywhere)
            most[i, c] = weights[0] @ sizes[inside]
            if c == 0:
                largest[i] = sizes[inside].max(axis=0)
                corners = sizes[nodes[0].size :]
                peaks[i] = np.where(np.isfinite(corners), corners, 0.0).max(axis=0, initial=0.0)
            if off is not None:
                own[i, c] = weights[0] @ np.broadcast_to(off, everywhere.shape)[inside]
            for n, rest, mean in zip(orders, weights[1:], along, strict=True):  # one after another, outermost first
                coefficients = gauss(n).transform.T @ h.reshape(n, -1)
                sizes = np.abs(coefficients).reshape(n, rest.size, count)
                mean[i, c] = sizes[:, 0] if rest.size == 1 else rest @ sizes
                h = coefficients[0].reshape(rest.size, count)
            number[i, c] = h[0]
    return Means(number, most, own, along, largest, peaks)


def _values(
    face: BoxIntegrand, machine: Evaluator, env: dict[str, Value], low: Array, size: Array, places: Sequence[Array]
) -> list[Cell]:
    """The integrand's numbers at places of the unit cube, (N, 1) for each variable, of all boxes."""
    here = dict(env)
    for variable, x, a, b in zip(face.plan.variables, places, low, size, strict=True):
        here[variable] = Cell(a + b * x, None, (None,) * machine.directions)
    return components(machine.evaluate(face.function, {name: here[name] for name in face.function.params}, None))
