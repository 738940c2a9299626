"""`sum i in lo..hi (e)`: the terms as one more axis of the batch.

Owns `total` and `plus`. Where no side is forced in the terms, all of them are evaluated in one go, in
chunks; of those that are in proportion to a tent only the few that are not 0.
"""

from __future__ import annotations

import operator

import numpy as np

from potto.calculus.inlining.lattices import REACH, middle
from potto.core.terms import Lam, Sum, Tuple, lam
from potto.diagnostics import PottoError
from potto.kernels import errors
from potto.kernels.cells import Cell, Number, Rows, Trace, Value, batch_shape, combined, listed, map_arrays, map_cells
from potto.kernels.tape import Node
from potto.kernels.whole import LARGEST, PAIRWISE, ROUNDING, SHORT, looked_through
from potto.runtime.answers.allowances import NOTHING, Allowance
from potto.runtime.evaluation.endless import Extent
from potto.runtime.evaluation.machine import Machine
from potto.runtime.evaluation.selection import by_bounds

MOST_TERMS = 10_000_000  # of one sum
CHUNK = 1 << 18  # terms times members that are evaluated at once


def total(machine: Machine, term: Sum, lo: Value, hi: Value, env: dict[str, Value], trace: Trace | None) -> Value:
    first, last = bounds(lo, "lower"), bounds(hi, "upper")
    if isinstance(first, np.ndarray) or isinstance(last, np.ndarray):
        return by_bounds(first, last, env, lambda lo, hi, here: total(machine, term, lo, hi, here, None))
    if last < first and not term.endless:
        return tuple(Cell(0.0) for _ in term.body.items) if isinstance(term.body, Tuple) else Cell(0.0)
    if last - first >= MOST_TERMS:
        raise PottoError([errors.BAD_SUM(errors.NOWHERE, f"a sum of {last - first + 1:.16g} terms is too long")])
    if trace:
        return _one_by_one(machine, term, int(first), int(last), env, trace)
    if last - first >= REACH and (place := middle(term)) is not None:
        body, wide = _body(term), _with_axis(env)
        here = {n: map_cells(wide[n], lambda cell: Cell(cell.v)) for n in place.free}
        wide[term.variable] = _around(machine, machine.with_directions(0).term(place, here), int(first), int(last))
        return _reduce(machine.run(body, [wide[p] for p in body.params], None), batch_shape(env.values()), REACH)
    return _batched(machine, term, int(first), int(last), env)


def _batched(machine: Machine, term: Sum, first: int, last: int, env: dict[str, Value]) -> Value:
    """All terms in one go, in chunks."""
    integrates, shape = machine.linker.inexact(term.body), batch_shape(env.values())
    if integrates and not term.endless:
        found = machine.semantics.culled(machine, term, first, last, env)
        if found is not None:
            return found
    body, wide = _body(term), _with_axis(env)
    step = max(1, CHUNK // max(1, int(np.prod(shape))))
    machine = machine if shape else machine.changed(summed=True)
    record, result = machine.record, None
    met, allowed = record.met, record.allowed
    extent = Extent(first, last, step, term.endless)
    for index in extent:
        wide[term.variable] = Cell(index, None, (None,) * machine.directions)
        record.allowed = NOTHING
        with looked_through(0 if integrates else SHORT):
            value = machine.run(body, [wide[p] for p in body.params], None)
        allowed = allowed.and_of(record.allowed.added(shape, index.size))
        extent.saw(value, index.size)
        part = _reduce(value, shape, index.size)
        result = part if result is None else plus(result, part)
    record.allowed = allowed
    record.spread(met)
    assert result is not None
    if term.endless and not np.all(finite := extent.finite):
        record.methods.add("sum")  # it says why there is no number, as an integral does
        record.allowed = allowed.and_of(Allowance(np.zeros_like(finite, dtype=float), finite, finite))
    return extent.with_rest(result)


def _body(term: Sum) -> Lam:
    return lam(tuple(sorted(term.body.free | {term.variable})), term.body)


def _with_axis(env: dict[str, Value]) -> dict[str, Value]:
    """The same with a last axis, for the terms."""
    return {n: map_arrays(v, lambda a: a[..., None]) for n, v in env.items()}


def _around(machine: Machine, place: Value, first: int, last: int) -> Cell:
    """The places from `first` to `last` nearest to one, along a new last axis."""
    if not isinstance(place, Cell):
        raise errors.not_a_number(place)
    lowest = np.clip(np.floor(np.nan_to_num(place.v)) - 1, first, last - REACH + 1)
    return Cell(lowest + np.arange(REACH, dtype=float), None, (None,) * machine.directions)


def bounds(value: Value, which: str) -> Number:
    """The bound of a sum, checked to be a whole number everywhere."""
    if not isinstance(value, Cell):
        raise errors.not_a_number(value)
    flat = np.asarray(value.v)
    with np.errstate(invalid="ignore"):
        bad = flat[~(np.isfinite(flat) & (flat == np.rint(flat)))]
    if bad.size:
        raise PottoError([errors.BAD_SUM(
            errors.NOWHERE, f"the {which} bound of a sum is {float(bad.ravel()[0])!r}, which is not a whole number",
            help="use `floor` or `ceil` to make it one",
        )])  # fmt: skip
    return value.v


def _one_by_one(machine: Machine, term: Sum, first: int, last: int, env: dict[str, Value], trace: Trace) -> Value:
    body = _body(term)
    result: Value = Cell(0.0)
    for number, index in enumerate(range(first, last + 1)):
        here = {**env, term.variable: Cell(float(index), None, (None,) * machine.directions)}
        value = machine.run(body, [here[p] for p in body.params], trace.get(number))
        result = value if number == 0 else plus(result, value)
    return plus(result, _batched(machine, term, last + 1, last, env)) if term.endless else result


def _reduce(value: Value, shape: tuple[int, ...], count: int) -> Value:
    if isinstance(value, tuple):
        return tuple(_reduce(v, shape, count) for v in value)
    if isinstance(value, Rows):
        return listed([_reduce(row, shape, count) for row in value.rows()])
    if not isinstance(value, Cell):
        raise errors.not_a_number(value)

    def part(x: Number) -> Number:
        full = np.broadcast_to(x, (*shape, count)) if np.ndim(x) == 0 or np.shape(x)[-1] != count else x
        summed: Number = np.add.reduce(full, axis=-1)
        return float(summed) if isinstance(summed, np.floating) else summed

    found = combined(part, value)
    assert isinstance(found, Cell)
    e, *et = [
        off if x is None or isinstance(x, Node) else _lost(x, part(np.abs(x))) + (0.0 if off is None else off)
        for x, off in zip((value.v, *value.t), (found.e, *found.et), strict=True)
    ]
    return Cell(found.v, e, found.t, tuple(et))


def _lost(numbers: Number, size: Number) -> Number:
    """What sums of these numbers round off. size: what is added up, without regard to sign."""
    if np.size(numbers) <= SHORT and np.all(size <= LARGEST) and np.all(np.rint(numbers) == numbers):
        return 0.0  # whole numbers
    return PAIRWISE * size


def plus(a: Value, b: Value) -> Value:
    """The sum of two values, and what it rounds off."""
    if isinstance(a, tuple) and isinstance(b, tuple):
        return tuple([plus(*items) for items in zip(a, b, strict=True)])
    if isinstance(a, Rows) and isinstance(b, Rows):
        return listed([plus(*items) for items in zip(a.rows(), b.rows(), strict=True)])
    found = combined(operator.add, a, b)
    if not (isinstance(found, Cell) and isinstance(a, Cell) and isinstance(b, Cell)):
        raise errors.not_a_number(found)
    every = [((cell.v, *(cell.t or (None,) * len(found.t))), (cell.e, *cell.et)) for cell in (found, a, b)]
    (whole, off), (first, _), (second, _) = every
    e, *et = [
        error if x is None or isinstance(x, Node)
        else ROUNDING["add"](x, 0.0 if y is None else y, 0.0 if z is None else z) + (0.0 if error is None else error)
        for x, error, y, z in zip(whole, off, first, second, strict=True)
    ]  # fmt: skip
    return Cell(found.v, e, found.t, tuple(et))
