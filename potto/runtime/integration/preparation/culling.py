"""A sum of integrals in which most summands are nothing for most members: those that may be something are evaluated.

Owns `culled`. What is left is one batch of pairs, a member and a summand each; its answers are added up by members.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from msgspec import Struct

from potto.calculus.inlining.arrays import inlined, loops, summands
from potto.calculus.inlining.expand import expanded
from potto.calculus.inlining.reads import Access, hoisted
from potto.core.terms import Index, Integral, Prim, Sum, Term, Var, function_of, lam, outside, substitute
from potto.diagnostics import PottoError
from potto.integrate.decomposition.culling import Pairs, culls, remaining
from potto.integrate.pieces import still
from potto.kernels.cells import Array, Cell, Env, Ints, Rows, Value, all_arrays, batch_shape, map_arrays, map_cells
from potto.kernels.making import making
from potto.kernels.tape import Edge, Node
from potto.kernels.whole import PAIRWISE
from potto.runtime.answers.allowances import NOTHING
from potto.runtime.answers.convergence import merged
from potto.runtime.evaluation.functions import Closure
from potto.runtime.evaluation.machine import Machine
from potto.runtime.evaluation.reach import Reach, kept
from potto.runtime.evaluation.sums import plus
from potto.runtime.integration.preparation.arrays import holds, in_names
from potto.runtime.integration.preparation.prepared import filled

FEW = 512  # pairs, up to which all are evaluated
PAIRS = 1 << 17  # evaluated together


def culled(machine: Machine, term: Sum, first: int, last: int, env: Env) -> Value | None:
    """The sum over the pairs that may be something; None where that cannot be told, or is most of them."""
    shape = batch_shape(env.values())
    members, count = int(np.prod(shape)), last - first + 1
    if not machine.root or members * count < FEW:
        return None
    integral = _integral(term.body, machine.linker.reach)
    if integral is None:
        return None
    try:
        pairs = _pairs(machine, term, integral, np.arange(first, last + 1, dtype=float), env, shape)
    except PottoError:  # as it is evaluated, it says what is wrong, and where
        return None
    if pairs is None or pairs.members.size > members * count // 2:
        return None
    machine.record.culled += members * count - pairs.members.size
    return _added(machine, term, pairs, first, env, shape)


@kept
def _integral(body: Term, reach: Reach) -> Integral | None:
    """The integral that a summand is in proportion to."""
    if not isinstance(body, Integral) and Integral in reach.kinds(body):
        body = expanded(body, reach.resolve)
    while isinstance(body, Prim) and body.op in ("mul", "neg", "div"):
        inner = [arg for arg in body.args if any(isinstance(n, Integral) for n in outside(arg, (Integral,)))]
        if len(inner) != 1 or (body.op == "div" and inner[0] is not body.args[0]):
            return None
        (body,) = inner
    return body if isinstance(body, Integral) else None


@kept
def _plain(body: Term, reach: Reach) -> bool:
    """Whether a summand is an integral without a factor, so that what is added up is what it comes to."""
    if not isinstance(body, Integral) and Integral in reach.kinds(body):
        body = expanded(body, reach.resolve)
    return isinstance(body, Integral)


class _Open(Struct, frozen=True):
    """An integral of numbers, and what these are beside it."""

    term: Integral
    accesses: tuple[Access, ...]


@kept
def _opened(term: Integral, arrays: frozenset[str], reach: Reach) -> _Open | None:
    found = summands(inlined(term, lambda name: Index in reach.kinds(name), reach.resolve, arrays))
    if not isinstance(found, Integral) or loops(found):
        return None
    found, accesses = hoisted(found)
    whole = expanded(found, reach.resolve)
    assert isinstance(whole, Integral)
    return _Open(whole, accesses) if culls(whole) else None


def _pairs(
    machine: Machine, term: Sum, integral: Integral, places: Array, env: Env, shape: tuple[int, ...]
) -> Pairs | None:
    variable = term.variable
    here = {name: still(env[name]) for name in integral.free if name != variable}
    integral, here = filled(integral, {**here, variable: Cell(0.0)}, machine.linker.reach)
    arrays = frozenset(name for name, value in here.items() if holds(value))
    with making:
        opened = _opened(integral, arrays, machine.linker.reach)
    if opened is None:
        return None
    here[variable] = Cell(places)
    members: dict[str, Any] = {}
    others: dict[str, Any] = {}
    shared: dict[str, Any] = {}
    parts: dict[str, Term] = {}
    quiet = machine.with_directions(0).apart()
    for name in sorted(opened.term.free):
        access = next((a.term for a in opened.accesses if a.name == name), None)
        needs = frozenset((name,)) if access is None else access.free
        given = {n: here[n] for n in needs}
        wide = any(all_arrays(given[n]) for n in needs if n != variable)
        if wide and variable in needs:
            return None
        value = here[name] if access is None else quiet.evaluate(function_of(access), given, None)
        if isinstance(value, Closure | Rows | list):
            return None
        found: Env = {}
        parts[name] = in_names(name, value, found)
        into = others if variable in needs else members if wide else shared
        for own, cell in found.items():
            if not isinstance(cell, Cell):
                return None
            size = (places.size,) if into is others else shape
            wanted = np.asarray(cell.v, dtype=float)
            into[own] = float(wanted) if into is shared else np.broadcast_to(wanted, size).reshape(-1)
    found_term = substitute(opened.term, {name: part for name, part in parts.items() if not isinstance(part, Var)})
    assert isinstance(found_term, Integral)
    sizes = int(np.prod(shape)), places.size
    return remaining(found_term, members, others, shared, sizes, machine.backend)


def _added(machine: Machine, term: Sum, pairs: Pairs, first: int, env: Env, shape: tuple[int, ...]) -> Value | None:
    """The answers for pairs, added up by members."""
    params, size = tuple(sorted(term.body.free | {term.variable})), int(np.prod(shape))
    order = np.argsort(pairs.members, kind="stable")
    whole: Value | None = None
    for start in range(0, max(1, order.size), PAIRS):
        chosen = order[start : start + PAIRS]
        at, those = pairs.members[chosen], pairs.summands[chosen]
        if not chosen.size:
            at, those = np.zeros(1, dtype=np.int64), np.zeros(1, dtype=np.int64)

        def picked(a: Any, at: Ints = at) -> Any:
            return np.broadcast_to(a, shape).reshape(-1)[at] if not isinstance(a, Node) else _rows(a, shape, at)

        here = {name: map_arrays(env[name], picked) for name in params if name != term.variable}
        here[term.variable] = Cell(first + those.astype(float), None, (None,) * machine.directions)
        value = _evaluated(machine, term, here, (at, those), size, shape)
        part = map_cells(value, lambda cell, at=at: _summed(cell, at, size, shape))  # type: ignore[misc]
        whole = part if whole is None else plus(whole, part)
    return whole


def _rows(node: Node, shape: tuple[int, ...], at: Ints) -> Any:
    flat = np.reshape(np.broadcast_to(node, shape), (-1,))
    return flat[at]


def _evaluated(
    machine: Machine, term: Sum, here: Env, pairs: tuple[Ints, Ints], size: int, shape: tuple[int, ...]
) -> Value:
    """The answers for pairs, of members and summands; what there is to be said of one is said of its member."""
    at, those = pairs
    record, body = machine.record, lam(tuple(sorted(here)), term.body)
    kept = record.shortfalls, record.allowed
    record.shortfalls, record.allowed = {}, NOTHING
    try:
        plain = _plain(term.body, machine.linker.reach)
        alone = machine.changed(into=at, of=those if machine.taping else None) if plain else machine
        value = alone.run(body, [here[name] for name in body.params], None)
        told, allowed = record.shortfalls, record.allowed
    finally:
        record.shortfalls, record.allowed = kept
    for why, where in told.items():
        mask = np.zeros(size, dtype=bool)
        mask[at[np.broadcast_to(where, at.shape)]] = True
        merged(record.shortfalls, {why: mask.reshape(shape) if shape else bool(mask.any())})
    record.allowed = record.allowed.and_of(allowed.put(at, size, shape))
    return value


def _summed(cell: Cell, at: Ints, size: int, shape: tuple[int, ...]) -> Cell:
    """The answers for pairs, of which those of a member stand together, added up by members."""
    starts = np.flatnonzero(np.diff(at, prepend=-1))

    def total(part: Any) -> Any:
        if part is None:
            return None
        if isinstance(part, Node):
            return _total(part, at, shape)
        found = np.zeros(size)
        found[at[starts]] = np.add.reduceat(np.broadcast_to(part, at.shape), starts)  # pairwise, as `bincount` is not
        return found.reshape(shape) if shape else float(found[0])

    def lost(part: Any, off: Any) -> Any:
        if part is None or isinstance(part, Node):
            return total(off)
        return total(PAIRWISE * np.abs(part) + (0.0 if off is None else off))

    t, et = tuple(map(total, cell.t)), tuple(map(lost, cell.t, cell.et))
    return Cell(total(cell.v), lost(cell.v, cell.e), t, et)


def _total(node: Node, at: Ints, shape: tuple[int, ...]) -> Node:
    """Members of a node added up at places; going back, each gets what its place has."""
    node = np.broadcast_to(node, at.shape)  # type: ignore[assignment]

    def pull(adjoint: Any) -> Any:
        return np.broadcast_to(adjoint, shape).reshape(-1)[at] if shape else np.broadcast_to(adjoint, at.shape)

    return Node((Edge(node, pull=pull),), shape)
