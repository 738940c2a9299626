"""Members of a batch whose cells are alike, by one product rule for all cells of a shape.

Owns `together`. What `a_priori` does for one member, with orders that are proved, is done here for many at once, with
orders that the Legendre coefficients at the nodes show to be enough. Nodes move with the ends of their cells (Reynolds'
transport theorem), so that the tangents of the sums are the derivatives and no boundary term is left. Rounding is kept
track of, as everywhere outside of integrals, at a few nodes of each cell, spread over it.

Blocks of numbers have values in row 0 and tangents in rows 1 ... k of their first axis. The members are their last
axis, so that whatever is done is done to long rows of numbers; before it come the nodes of each variable, the outermost
one's next to the members.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from msgspec import Struct

from potto.core.terms import Prim, Term, function_of, postorder, tuple_
from potto.integrate.columns import distinct
from potto.integrate.fixed.a_priori import Straight
from potto.integrate.fixed.moving_sums import SUMMED, evaluated, product
from potto.integrate.fixed.topologies import Uniform, topologies
from potto.integrate.pieces import Evaluator, Sums, dense, still
from potto.integrate.rules.gauss import EPS, analytic_truncation, gauss
from potto.kernels.cells import Array, Bools, Cell, Ints, Value, map_arrays
from potto.primitives import PRIMITIVES

# Nodes per variable that are tried, one after the other.
ORDERS = (6, 8, 12, 14, 20, 28)
MOST_NODES = 4096
POINTS = 1 << 15
# A rule is good enough for a cell if what it may be off is this part of the accuracy asked for; for a few members, whom
# more nodes cost next to nothing, this part of the number.
SHARE, TIGHT = 0.01, 1e-13
# At how many nodes rounding is followed at each; and how much more it may be elsewhere where it is at a few.
TRACKED, ELSEWHERE = 1 << 12, 2.0
# How many members tell the order for all, and up to how many it does not pay to ask them.
PILOTS = 16
FEW = 4 * PILOTS
ENOUGH = 0.9
# How near to 0, of what it comes to elsewhere on the cell, the edge of a builtin's domain may be at a node.
EDGE = 0.1
# How many times larger than at all nodes the integrand may be at the ends of stretches: else something narrow is there.
PEAK = 8.0
# What errors may be where what is added up cancels, as a part of that: no other way would mend it.
CANCELS = 1e-13


class Measured(Struct, frozen=True):
    """Integrals over cells (1 + k, M), how far rules and rounding put them off, and what is added up for them."""

    number: Array
    truncated: Array
    rounding: Array
    gross: Array


def together(
    plan: Straight, degrees: Sequence[int | None], machine: Evaluator, env: dict[str, Value], batch: int
) -> tuple[Bools, Sums] | None:
    """Which members were integrated here, and the sums of all (zero for the others); None if none were.

    degrees: of what is integrated over each variable, where it is a polynomial.
    """
    if machine.frozen or machine.side or not all(isinstance(env.get(name), Cell) for name in plan.names):
        return None
    here = {name: env[name] for name in plan.names}
    done, cells = topologies(plan, machine, here, batch)
    if not done.any():
        return None
    total = [np.zeros((1 + machine.directions, batch)) for _ in range(4)]
    for cell in cells:
        fine = _settled(plan, degrees, machine, here, cell, total)
        done[cell.members[~fine]] = False
    number, truncated, rounding, gross = total
    asked = 0.5 * np.maximum(machine.atol, machine.rtol * np.abs(number))
    most = CANCELS * gross.max(axis=0) if batch > 1 else 0.0  # for one there are other ways
    fine = (rounding <= np.maximum(asked, most)) & (truncated <= np.maximum(asked, most))
    done &= fine.all(axis=0)
    if not done.any():
        return None
    error = truncated + rounding
    added = np.stack((gross[0], gross[1:].max(axis=0, initial=0.0)))
    for part in (number, error, added):
        part[:, ~done] = 0.0
    return done, Sums(number[None, 0], error[None, 0], number[None, 1:], error[None, 1:], gross=added)


def _settled(
    plan: Straight, degrees: Sequence[int | None], machine: Evaluator, env: dict[str, Value], cell: Uniform,
    total: Sequence[Array],
) -> Bools:  # fmt: skip
    """Add the integrals over cells of one shape to those of their members; for which of them that could be done."""
    fine = np.zeros(cell.members.size, dtype=bool)
    todo = np.arange(cell.members.size)
    for rule in _tried(plan, degrees, machine, env, cell):
        step = max(1, POINTS // math.prod(rule.orders))
        left = []
        for start in range(0, todo.size, step):
            index = todo[start : start + step]
            found = rule.applied(env, cell.members[index])
            good = rule.good(found)
            fine[index[good]] = True
            for whole, part in zip(total, (found.number, found.truncated, found.rounding, found.gross), strict=True):
                whole[:, cell.members[index[good]]] += part[:, good]
            left.append(index[~good])
        todo = np.concatenate(left)
        if not todo.size:
            break
    return fine


def _tried(
    plan: Straight, degrees: Sequence[int | None], machine: Evaluator, env: dict[str, Value], cell: Uniform
) -> list[Rule]:
    """Rules with ever more nodes: the one that does for a polynomial, or from the one on that does for most members."""
    exact = [None if d is None else d // 2 + 1 for d in degrees] or [None] * len(plan.variables)
    known = tuple(n is not None for n in exact)
    tried = [
        Rule(plan, cell, orders, known, machine)
        for order in ORDERS
        if math.prod(orders := tuple(order if n is None else n for n in exact)) <= MOST_NODES
    ]
    if all(known):
        return tried[:1]
    if cell.members.size <= FEW:
        return tried[2:]
    few = cell.members[:: max(1, cell.members.size // PILOTS)]
    for number, rule in enumerate(tried[:-1]):
        if rule.good(rule.applied(env, few)).mean() >= ENOUGH:
            return tried[number:]
    return tried[-1:]


class Nodes(Struct, frozen=True):
    """Numbers at some nodes of cells. value, off: of the integrand and its rounding, (1 + k, ..., n1, M).

    widths: per variable those of its stretches, and how far they may be off, with its own axis left out.
    plain: (M,) whether no cut comes between, and nothing near by is singular.
    """

    value: Array
    off: Array
    widths: list[tuple[Array, Array]]
    plain: Bools


class Rule(Struct, frozen=True):
    """A product rule for cells of one shape, with so many nodes for each variable."""

    plan: Straight
    cell: Uniform
    orders: tuple[int, ...]
    exact: tuple[bool, ...]
    machine: Evaluator

    def axis(self, i: int) -> tuple[Array, Array]:
        """Nodes of a variable on [0, 1], and how fast they run: they crowd at turning points, where roots are."""
        u = gauss(self.orders[i]).nodes
        low, high = (row in self.plan.turning[i] for row in self.cell.path[i])
        if low and high:
            return np.sin(0.5 * math.pi * u) ** 2, 0.5 * math.pi * np.sin(math.pi * u)
        if low:
            return u * u, 2 * u
        if high:
            return u * (2 - u), 2 * (1 - u)
        return u, np.ones_like(u)

    def applied(self, env: dict[str, Value], members: Ints) -> Measured:
        """The integrals over the cells of some members."""
        here = {n: map_arrays(v, lambda a: a[members] if a.ndim else a) for n, v in env.items()}
        self.machine.count(members.size * math.prod(self.orders))
        whole = [np.arange(n) for n in self.orders]
        tracking = self.machine.tracking()
        if members.size * math.prod(self.orders) <= TRACKED:
            some = every = self.at_nodes(tracking, here, members.size, whole)
            few, beyond = whole, 1.0
        else:
            few, beyond = [distinct([0, n // 2, n - 1]) for n in self.orders], ELSEWHERE
            every = self.at_nodes(self.machine, here, members.size, whole)
            some = self.at_nodes(tracking, here, members.size, few)
        number, truncated = self.added(every)
        off, most = self.rounded(some, few)
        gross = np.maximum(most, np.abs(number))
        rounding = beyond * off + ELSEWHERE * SUMMED * gross
        plain = every.plain & some.plain
        if not all(self.exact):
            corners = self.at_nodes(tracking, here, members.size, few, True)
            plain &= ~(_largest(corners.value[:1]) > PEAK * _largest(every.value[:1]))
        truncated[:, ~plain] = np.inf
        return Measured(number, truncated, rounding, gross)

    def at_nodes(
        self, machine: Evaluator, env: dict[str, Value], count: int, picked: Sequence[Ints], corners: bool = False
    ) -> Nodes:
        """The integrand at those of the nodes that are `picked`, per variable; or at the ends of its stretches."""
        here, shape, k = dict(env), (count,), machine.directions
        plain = np.ones(count, dtype=bool)
        widths = []
        for i, (variable, frame, (low, high)) in enumerate(
            zip(self.plan.variables, self.plan.frames, self.cell.path, strict=True)
        ):
            values = evaluated(frame, machine, {name: here[name] for name in frame.params})
            ends, lost = dense((values[low], values[high]), k, shape)
            lo, width = ends[0], ends[1] - ends[0]
            off = EPS * np.abs(ends).sum(axis=0) + (0.0 if lost is None else lost.sum(axis=0))
            widths.append((width, off))
            if i:
                plain &= _clear(values, low, high, ends[:, 0])
            nodes = np.array([0.0, 1.0]) if corners else self.axis(i)[0][picked[i]]
            at = lo[:, None] + width[:, None] * nodes.reshape(-1, *(1,) * len(shape))
            moves = [values[low].t[d] is not None or values[high].t[d] is not None for d in range(k)]
            errors = off if machine is not self.machine else (None,) * (1 + k)
            here[variable] = Cell(
                at[0], errors[0], tuple(at[d] if m else None for d, m in enumerate(moves, 1)),
                tuple(errors[d] if m else None for d, m in enumerate(moves, 1)),
            )  # fmt: skip
            shape = at.shape[1:]
        function = function_of(self.cell.face)
        value, lost = dense(machine.evaluate(function, {name: here[name] for name in function.params}, None), k, shape)
        if machine is not self.machine and not corners:
            plain &= self.clear_of_edges(machine.with_directions(0), here, shape)
        return Nodes(value[0], np.zeros(value[0].shape) if lost is None else lost[0], widths, plain)

    def clear_of_edges(self, machine: Evaluator, here: dict[str, Value], shape: tuple[int, ...]) -> Bools:
        """The members on whose cells nothing comes to the edge of where it is analytic, as a root of x does at 0: there
        coefficients fall so slowly that they don't tell."""
        fine, found = np.ones(shape[-1], dtype=bool), edges_of(self.cell.face)
        if not found:
            return fine
        edges = function_of(tuple_(found))
        for cell in evaluated(edges, machine, {name: still(here[name]) for name in edges.params}):
            size = np.broadcast_to(np.abs(cell.v), shape).reshape(-1, shape[-1])
            fine &= size.min(axis=0) > EDGE * size.max(axis=0)
        return fine

    def added(self, nodes: Nodes) -> tuple[Array, Array]:
        """What the nodes amount to, and how far off the rules may be: (1 + k, M) each."""
        number, k1, count = nodes.value, len(nodes.value), len(nodes.plain)
        axes = [self.axis(i)[1] for i in range(len(self.orders))]
        volumes = [np.ones((k1, count))]  # of a node of the variables further out, with weights, and of its stretch
        volumes[0][1:] = 0.0
        for i, (width, _) in enumerate(nodes.widths):
            volumes[i] = product(volumes[i], width)
            weights = (gauss(self.orders[i]).weights * axes[i]).reshape(-1, *(1,) * (width.ndim - 1))
            volumes.append(volumes[i][:, None] * weights)
        truncated = np.zeros((k1, count))
        for i in reversed(range(len(self.orders))):
            rule, (width, _), flat = gauss(self.orders[i]), nodes.widths[i], number.reshape(*number.shape[:2], -1)
            if np.ptp(axes[i]) > 0:
                flat = flat * axes[i][:, None]
            if self.exact[i]:
                number = rule.weights @ flat
            else:
                coefficients = rule.transform.T @ flat
                number = coefficients[:, 0]
                truncated += analytic_truncation(_summed(np.abs(coefficients), np.abs(volumes[i])))
            number = product(number.reshape(width.shape), width)
        return number, truncated

    def rounded(self, nodes: Nodes, picked: Sequence[Ints]) -> tuple[Array, Array]:
        """What rounding may put the integrals off, and what is added up for them, from some nodes: (1 + k, M)."""
        most, off = np.abs(nodes.value), nodes.off
        for i in reversed(range(len(self.orders))):
            (width, lost), speeds = nodes.widths[i], self.axis(i)[1][picked[i]]
            speeds = speeds.reshape(-1, *(1,) * (most.ndim - 2))
            most, off = (most * speeds).max(axis=1), (off * speeds).max(axis=1)
            size = np.abs(width)
            off = product(off, size) + product(most, lost)
            most = product(most, size)
        return off, most

    def good(self, found: Measured) -> Bools:
        """For which cells the rule does."""
        few = self.cell.members.size <= FEW
        asked = (TIGHT if few else SHARE * self.machine.rtol) * np.abs(found.number)
        least = (TIGHT if few else CANCELS) * found.gross
        return np.asarray((found.truncated <= np.maximum(asked, least)).all(axis=0))


@lru_cache(maxsize=1024)
def edges_of(term: Term) -> tuple[Term, ...]:
    """What is 0 where a builtin in a term is singular, poles aside, and varies."""
    found = (
        edge
        for node in postorder(term)
        if isinstance(node, Prim) and node.op != "div"
        for edge in PRIMITIVES[node.op].edges(*node.args)
        if edge.free
    )
    return tuple(dict.fromkeys(found))


def _largest(value: Array) -> Array:
    """Of numbers (..., M) the largest without regard to sign, those that are none left out: (M,)."""
    size = np.abs(value)
    return np.asarray(np.where(np.isfinite(size), size, 0.0).reshape(-1, value.shape[-1]).max(axis=0))


def _clear(values: Sequence[Cell], low: int, high: int, ends: Array) -> Bools:
    """The members for which a stretch is one at all nodes: its ends in order, no other cut between them."""
    fine = ends[1] > ends[0]
    for row, cell in enumerate(values):
        if row not in (low, high):
            fine &= ~((cell.v > ends[0]) & (cell.v < ends[1]))
    return np.asarray(np.asarray(fine).reshape(-1, ends.shape[-1]).all(axis=0))


def _summed(block: Array, volume: Array) -> Array:
    """(f g)', with f (1 + k, n, R), summed over all nodes g of the variables further out: (1 + k, M, n)."""
    k1, count = len(volume), volume.shape[-1]
    block, volume = block.reshape(k1, block.shape[1], -1, count), volume.reshape(k1, -1, count)
    total: Array = np.einsum("knrm,rm->kmn", block, volume[0])
    if k1 > 1:
        total[1:] += np.einsum("nrm,krm->kmn", block[0], volume[1:])
    return total
