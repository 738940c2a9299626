"""Summands that integrate: those alike but for their numbers share one plan and are evaluated as one batch.

Owns `added`. A member of a batch carries only the directions in which it moves, whichever these are, so that n summands
with parameters of their own cost n times one of them, gradient and all. Members that have something to say (why they
are not accurate, that they have two derivatives) are evaluated as they are written, so that they say it of that.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from typing import Any

import numpy as np
from msgspec import Struct

from potto.calculus.inlining.alike import Leaf, SameShape, alike
from potto.core.terms import Const, Integral, Lam, Term, Var
from potto.diagnostics import PottoError
from potto.integrate.columns import distinct
from potto.kernels import errors
from potto.kernels.cells import Array, Bools, Cell, Number, Value, batch_shape, combined, map_arrays, pad
from potto.kernels.tape import Node
from potto.kernels.whole import PAIRWISE, ROUNDING
from potto.projects.settings import SAMPLERS
from potto.runtime.answers.allowances import NOTHING
from potto.runtime.evaluation.functions import Closure, Derivative
from potto.runtime.evaluation.machine import Machine
from potto.runtime.evaluation.sums import CHUNK
from potto.runtime.integration.problem import linked

Slots = tuple[int, ...]  # the directions in which a member moves
MOST_KNOWN = 256  # sums of which it is kept what is alike in them

FUNCTION = "function"
PLAIN = (Closure, Derivative)  # functions that are what their terms say


class SummandBatch(Struct, frozen=True):
    """Summands of one shape, as `SameShape` has them, with columns of nothing but numbers as arrays."""

    function: Lam
    columns: tuple[Array | tuple[Leaf, ...] | str, ...]
    places: tuple[int, ...]

    def part(self, index: slice) -> SummandBatch:
        columns = tuple(c if isinstance(c, str) else c[index] for c in self.columns)
        return SummandBatch(self.function, columns, self.places[index])


class Grouped(Struct, frozen=True):
    """Summands that are alike, with the names that each group needs, and the places of those that are not."""

    batches: tuple[tuple[SummandBatch, frozenset[str]], ...]
    alone: tuple[int, ...]


def added(machine: Machine, terms: tuple[Term, ...], env: dict[str, Value]) -> Value:
    """The sum of terms that are made of integrals and arithmetic."""
    parts: list[Value] = []
    alone: Sequence[int] = range(len(terms))
    if machine.root and machine.costs is None:  # costs are told of each condition as it is written
        grouped = _grouped(machine, terms, env)
        left = list(grouped.alone)
        for batch, names in grouped.batches:
            _together(machine, batch, {name: env[name] for name in names}, parts, left)
        alone = sorted(left)
    return _sum([*parts, *(_single(machine, terms[place], env) for place in alone)], machine.directions)


def _single(machine: Machine, term: Term, env: dict[str, Value]) -> Value:
    """A summand as it is written; a whole answer's with a budget of its own, as those have that run as one batch."""
    here, record = {name: env[name] for name in term.free}, machine.record
    with record.among(record.members) if machine.root else nullcontext():
        return machine.integral(term, here) if isinstance(term, Integral) else machine.term(term, here)


def _grouped(machine: Machine, terms: tuple[Term, ...], env: dict[str, Value]) -> Grouped:
    """The summands by what is alike of them, for values built as these are, and functions that are the same; found
    once."""
    kinds = tuple((name, _shape(value)) for name, value in env.items())
    called, _ = linked({name: value for name, value in env.items() if type(value) in PLAIN})
    key = terms, kinds, tuple((name, term.digest) for name, term in called.items())
    known = machine.linker.alike.get(key)
    if known is None:
        numbers = {name: shape for name, shape in kinds if FUNCTION not in _flat(shape)}
        groups, alone = alike(
            terms, numbers, lambda f: called.get(f.name) if isinstance(f, Var) else machine.linker.function(f)
        )
        batches = tuple((_batch(group), frozenset().union(*(terms[p].free for p in group.places))) for group in groups)
        known = machine.linker.alike[key] = Grouped(batches, tuple(alone))
        if len(machine.linker.alike) > MOST_KNOWN:
            machine.linker.alike.pop(next(iter(machine.linker.alike)), None)
    return known


def _shape(value: Value) -> object:
    """How a value is built: None is a number, FUNCTION a function, a tuple has the shapes of its items."""
    if isinstance(value, tuple):
        return tuple(map(_shape, value))
    return None if isinstance(value, Cell) else FUNCTION


def _flat(shape: object) -> tuple[object, ...]:
    return tuple(part for item in shape for part in _flat(item)) if isinstance(shape, tuple) else (shape,)


def _batch(group: SameShape) -> SummandBatch:
    def column(leaves: tuple[Leaf, ...] | str) -> Array | tuple[Leaf, ...] | str:
        if isinstance(leaves, str) or any(isinstance(leaf, Var) for leaf in leaves):
            return leaves
        return np.array([leaf.value for leaf in leaves if isinstance(leaf, Const)])

    return SummandBatch(group.function, tuple(map(column, group.columns)), group.places)


def _together(
    machine: Machine, batch: SummandBatch, env: dict[str, Value], parts: list[Value], left: list[int]
) -> None:
    """Put sums over the members, so many at a time, and the places of those that are to be evaluated as written."""
    shape = batch_shape(env.values())
    step = max(1, CHUNK // max(1, int(np.prod(shape))))
    for start in range(0, len(batch.places), step):
        chunk = batch.part(slice(start, start + step))
        found, bad = _evaluated(machine, chunk, env, shape)
        left += [chunk.places[i] for i in np.nonzero(bad)[0]]
        if found is not None:
            parts.append(found)


def _evaluated(
    machine: Machine, batch: SummandBatch, env: dict[str, Value], shape: tuple[int, ...]
) -> tuple[Cell | None, Bools]:
    """The sum over the members that have nothing to say, and which have."""
    size, record = len(batch.places), machine.record
    bad = np.zeros(size, dtype=bool)
    slots = _slots(batch, env, machine.directions)
    width = max(map(len, slots))
    args = [_column(column, env, slots, width) for column in batch.columns]
    kept = record.shortfalls, record.edges, record.allowed
    record.shortfalls, record.edges, record.allowed = {}, [], NOTHING
    try:
        with machine.among(np.arange(size)) as together:
            together = together.changed(summed=not shape)
            own = together if machine.taping and width else together.with_directions(width)
            value = pad(own.run(batch.function, args, None), width)
        allowed = record.allowed.over((*shape, size))
        told = [*record.shortfalls.values(), *(np.isfinite(e.backward) for e in record.edges)]
    except PottoError:  # as it is written, it says what is wrong, and where
        return None, ~bad
    finally:
        record.shortfalls, record.edges, record.allowed = kept
    if not isinstance(value, Cell):
        raise errors.not_a_number(value)
    told += [np.isnan(value.v), np.isinf(value.v), *([] if value.e is None else [~np.isfinite(value.e)])]
    for where in (*told, bool(together.events)):
        bad |= np.broadcast_to(where, (*np.shape(where)[:-1], size)).reshape(-1, size).any(axis=0)
    if bad.all():
        return None, bad
    parts = _Parts(value, (*shape, size), slots, machine)
    whole = parts.total(~bad)
    lacking = parts.lacking(whole, machine.rtol, allowed.most) & ~bad
    if record.methods.isdisjoint(SAMPLERS) and lacking.any():
        bad |= lacking
        if bad.all():
            return None, bad
        whole = parts.total(~bad)
    record.allowed = record.allowed.and_of(allowed.added(shape, size, ~bad))
    return whole, bad


# Members with directions of their own


def _slots(batch: SummandBatch, env: dict[str, Value], directions: int) -> list[Slots]:
    """Per member, in which directions it moves."""
    moving = {name: frozenset(_moving(value, directions)) for name, value in env.items()}
    shared = frozenset[int]().union(*(moving[c] for c in batch.columns if isinstance(c, str)))
    own = [c for c in batch.columns if isinstance(c, tuple)]
    if not own or len(shared) == directions:
        return [tuple(sorted(shared))] * len(batch.places)
    return [
        tuple(sorted(shared.union(*(moving[leaf.name] for leaf in leaves if isinstance(leaf, Var)))))
        for leaves in zip(*own, strict=True)
    ]


def _moving(value: Value, directions: int) -> list[int]:
    """The directions in which a value moves; a function with values of its own may move in any."""
    if isinstance(value, Cell):
        return [d for d, t in enumerate(value.t) if t is not None]
    if isinstance(value, tuple):
        return [d for item in value for d in _moving(item, directions)]
    still = isinstance(value, Closure) and type(value) in PLAIN and not value.captured
    return [] if still else list(range(directions))


def _column(column: Array | tuple[Leaf, ...] | str, env: dict[str, Value], slots: Sequence[Slots], width: int) -> Value:
    """What stands in the place of one parameter: members along the last axis."""
    if isinstance(column, np.ndarray):
        return Cell(column, None, (None,) * width)
    if isinstance(column, str) and slots.count(slots[0]) == len(slots):
        return map_arrays(_narrowed(env[column], slots[0], width), lambda a: a[..., None])
    leaves = (column,) * len(slots) if isinstance(column, str) else column
    values = [Cell(x.value) if isinstance(x, Const) else env[x if isinstance(x, str) else x.name] for x in leaves]
    return combined(_stacked, *(_narrowed(value, own, width) for value, own in zip(values, slots, strict=True)))


def _narrowed(value: Value, slots: Slots, width: int) -> Value:
    """A value with its tangents in some directions alone; a function keeps all."""
    if isinstance(value, tuple):
        return tuple(_narrowed(item, slots, width) for item in value)
    if not isinstance(value, Cell):
        return value
    more = (None,) * (width - len(slots))
    t, et = ((tuple([x[d] for d in slots]) if x else (None,) * len(slots)) + more for x in (value.t, value.et))
    return Cell(value.v, value.e, t, et)


def _stacked(*parts: Number) -> Number:
    """Numbers along one more axis."""
    return np.stack(np.broadcast_arrays(*parts), axis=-1)


# Sums


class _Parts:
    """The numbers of members and how far off they are, (..., m) each, by what they are added up to: in `into` 0 for the
    value, 1 and on for the tangents, and a number beyond those for nothing."""

    def __init__(self, value: Cell, shape: tuple[int, ...], slots: Sequence[Slots], machine: Machine) -> None:
        directions = machine.directions
        self.taped: tuple[Any, ...] = value.t if machine.taping else ()
        if machine.taping:
            value, slots, directions = Cell(value.v, value.e), [()] * len(slots), 0
        numbers, off = (value.v, *value.t), (value.e, *value.et)
        self.numbers, self.off = (
            np.stack([np.broadcast_to(0.0 if x is None else x, shape) for x in parts], axis=-2)
            for parts in (numbers, off)
        )
        self.batch, self.directions = shape[:-1], directions
        width = len(value.t)
        members = slots[:1] if slots.count(slots[0]) == len(slots) else slots
        into = np.array([(0, *(d + 1 for d in own), *(directions + 1,) * (width - len(own))) for own in members]).T
        self.into = np.broadcast_to(into, (1 + width, len(slots)))

    def total(self, keep: Bools) -> Cell:
        """The sums over some members, and what adding them up rounds off."""
        into = self.into[:, keep].reshape(-1)
        order = np.argsort(into, kind="stable")
        ends = np.searchsorted(into[order], np.arange(self.directions + 2))
        # `take` leaves the numbers of a sum side by side in memory, so that numpy adds them up in pairs
        numbers, off = (x[..., keep].reshape(*self.batch, -1).take(order, -1) for x in (self.numbers, self.off))
        found: list[tuple[Number | None, Number | None]] = [(None, None)] * (self.directions + 1)
        for place in distinct(into[into <= self.directions]).tolist():
            here = slice(ends[place], ends[place + 1])
            size = np.abs(numbers[..., here])
            sums = numbers[..., here].sum(axis=-1), (off[..., here] + PAIRWISE * size).sum(axis=-1)
            found[place] = sums if self.batch else (float(sums[0]), float(sums[1]))
        (v, e), *tangents = found
        assert v is not None
        if self.taped:
            node = np.broadcast_to(self.taped[0], self.numbers.shape[:-2] + self.numbers.shape[-1:])[..., keep]
            return Cell(v, e, (np.add.reduce(node, axis=-1),))
        return Cell(v, e, tuple(t for t, _ in tangents), tuple(et for _, et in tangents))

    def lacking(self, whole: Cell, rtol: float, within: Any) -> Bools:
        """The members that are not accurate enough for a sum that is less than they are, where it is."""
        share = np.zeros((*self.batch, self.directions + 2))
        share[..., -1] = np.inf
        for place, (x, off) in enumerate(zip((whole.v, *whole.t), (whole.e, *whole.et), strict=True)):
            if x is not None and off is not None:
                asked = rtol * np.abs(x)
                share[..., place] = np.where(off > asked, asked / self.numbers.shape[-1], np.inf)
        enough = np.maximum(share[..., self.into], np.expand_dims(within, -2) if np.ndim(within) else within)
        return (self.off > enough).reshape(-1, self.numbers.shape[-1]).any(axis=0)  # type: ignore[no-any-return]


def _sum(parts: Sequence[Value], directions: int) -> Value:
    """The sum of a few numbers, and what it rounds off."""
    cells = [cell for part in parts if isinstance(cell := pad(part, directions), Cell)]
    if len(cells) != len(parts):
        raise errors.not_a_number(next(part for part in parts if not isinstance(part, Cell)))

    def total(numbers: Sequence[Number | None], off: Sequence[Number | None]) -> tuple[Number | None, Number | None]:
        given = [x for x in numbers if x is not None]
        whole = sum(given) if given else None
        if isinstance(whole, Node):  # the tape keeps account of what is rounded off
            return whole, None
        return whole, None if whole is None else ROUNDING["add"](whole, *given) + sum(x for x in off if x is not None)

    v, e = total([cell.v for cell in cells], [cell.e for cell in cells])
    assert v is not None
    tangents = [total([cell.t[d] for cell in cells], [cell.et[d] for cell in cells]) for d in range(directions)]
    return Cell(v, e, tuple(t for t, _ in tangents), tuple(et for _, et in tangents))
