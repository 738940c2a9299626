"""`sum i in lo..hi (e)`: the terms as one more axis of the batch.

Owns `total`. Where no side is forced in the terms, all of them are evaluated in one go, in chunks.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from potto.core.terms import Sum, lam
from potto.diagnostics import PottoError
from potto.kernels import errors
from potto.kernels.cells import Array, Cell, Number, Trace, Value, all_arrays, map_arrays
from potto.kernels.whole import UNIT_ROUNDOFF
from potto.runtime.evaluation.machine import Machine

MOST_TERMS = 10_000_000
CHUNK = 1 << 18


def total(machine: Machine, term: Sum, lo: Value, hi: Value, env: dict[str, Value], trace: Trace | None) -> Value:
    first, last = bounds(lo, "lower"), bounds(hi, "upper")
    if isinstance(first, np.ndarray) or isinstance(last, np.ndarray):
        return _grouped(machine, term, first, last, env)
    if last < first:
        return Cell(0.0)
    if last - first >= MOST_TERMS:
        raise PottoError([errors.BAD_SUM(errors.NOWHERE, f"a sum of {last - first + 1:.0f} terms is too long")])
    params = tuple(sorted(term.body.free | {term.variable}))
    body = lam(params, term.body)
    if trace:
        return _one_by_one(machine, term, body, int(first), int(last), env, trace)
    shape = np.broadcast_shapes(*(a.shape for v in env.values() for a in all_arrays(v)))
    wide = {n: map_arrays(v, lambda a: a[..., None]) for n, v in env.items()}
    step = max(1, CHUNK // max(1, int(np.prod(shape))))
    result: Value | None = None
    for start in range(int(first), int(last) + 1, step):
        index = np.arange(start, min(start + step, int(last) + 1), dtype=float)
        wide[term.variable] = Cell(index, None, (None,) * machine.directions)
        value = machine.run(body, [wide[p] for p in params], None)
        part = _reduce(value, shape, index.size)
        result = part if result is None else _plus(result, part)
    assert result is not None
    return result


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


def _one_by_one(
    machine: Machine, term: Sum, body: Any, first: int, last: int, env: dict[str, Value], trace: Trace
) -> Value:
    result: Value = Cell(0.0)
    for number, index in enumerate(range(first, last + 1)):
        here = {**env, term.variable: Cell(float(index), None, (None,) * machine.directions)}
        value = machine.run(body, [here[p] for p in body.params], trace.get(number))
        result = value if number == 0 else _plus(result, value)
    return result


def _grouped(machine: Machine, term: Sum, first: Number, last: Number, env: dict[str, Value]) -> Value:
    """Bounds that differ over the batch: the members with equal bounds together."""
    from potto.runtime.evaluation.selection import merge

    arrays = [a for v in env.values() for a in all_arrays(v)]
    shape = np.broadcast_shapes(np.shape(first), np.shape(last), *(a.shape for a in arrays))
    lo, hi = np.broadcast_to(first, shape), np.broadcast_to(last, shape)
    pairs = np.unique(np.stack([lo.ravel(), hi.ravel()]), axis=1).T
    result: Value | None = None
    done = np.zeros(shape, dtype=bool)
    for a, b in pairs:
        mask = (lo == a) & (hi == b)

        def pick(x: Array, mask: Any = mask) -> Array:
            chosen: Array = np.broadcast_to(x, shape)[mask]
            return chosen

        here = {n: map_arrays(v, pick) for n, v in env.items()}
        value = _full(total(machine, term, Cell(float(a)), Cell(float(b)), here, None), int(mask.sum()))
        if result is None:
            result = value
        else:
            either = mask | done
            inner = mask[either]
            result = map_arrays(merge(inner, value, result), lambda x: x)
        done |= mask
    assert result is not None
    return map_arrays(result, lambda a: a.reshape(shape))


def _full(value: Value, size: int) -> Value:
    if isinstance(value, Cell):

        def part(x: Number | None) -> Number | None:
            return None if x is None else np.broadcast_to(x, (size,))

        v = part(value.v)
        assert v is not None
        return Cell(v, part(value.e), tuple(map(part, value.t)), tuple(map(part, value.et)))
    assert isinstance(value, tuple)
    return tuple(_full(v, size) for v in value)


def _reduce(value: Value, shape: tuple[int, ...], count: int) -> Value:
    if isinstance(value, tuple):
        return tuple(_reduce(v, shape, count) for v in value)
    if not isinstance(value, Cell):
        raise errors.not_a_number(value)

    def part(x: Number | None) -> Number | None:
        if x is None:
            return None
        full = np.broadcast_to(x, (*shape, count)) if np.ndim(x) == 0 or np.shape(x)[-1] != count else np.asarray(x)
        summed = np.add.reduce(full, axis=-1)
        return float(summed) if summed.ndim == 0 else summed

    v, e = part(value.v), part(value.e)
    assert v is not None
    size = part(np.abs(value.v))
    assert size is not None
    rounding = 8 * UNIT_ROUNDOFF * size
    return Cell(v, rounding if e is None else e + rounding, tuple(map(part, value.t)), tuple(map(part, value.et)))


def _plus(a: Value, b: Value) -> Value:
    if isinstance(a, Cell) and isinstance(b, Cell):

        def plus(x: Number | None, y: Number | None) -> Number | None:
            return x if y is None else y if x is None else x + y

        k = max(len(a.t), len(b.t))
        at, bt = a.t or (None,) * k, b.t or (None,) * k
        aet, bet = a.et or (None,) * k, b.et or (None,) * k
        v = plus(a.v, b.v)
        assert v is not None
        return Cell(v, plus(a.e, b.e), tuple(map(plus, at, bt)), tuple(map(plus, aet, bet)))
    if isinstance(a, tuple) and isinstance(b, tuple):
        return tuple(_plus(x, y) for x, y in zip(a, b, strict=True))
    raise errors.wrong_call("the terms of a sum are not of the same kind")
