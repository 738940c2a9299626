"""Conditionals whose sides are evaluated only where they are taken.

Owns `lazy`. With one outcome for the whole batch one side is evaluated; otherwise the batch is split, each side
evaluated on its own members, and the results put together again.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from potto.core.terms import Branch, If, function_of
from potto.kernels.cells import Array, Cell, Number, Trace, Value, all_arrays, map_arrays, map_trace
from potto.kernels.errors import wrong_call
from potto.runtime.evaluation.machine import Machine


def lazy(machine: Machine, mask: Any, term: If | Branch, env: dict[str, Value], traces: tuple[Any, Any]) -> Value:
    spoiled = None
    if isinstance(mask, tuple):
        mask, spoiled = mask
    if not isinstance(mask, np.ndarray) or mask.all() or not mask.any():
        taken = bool(mask if not isinstance(mask, np.ndarray) else mask.all())
        value = side(machine, term, env, 0 if taken else 1, traces[0 if taken else 1])
    else:
        value = split(machine, mask, term, env, traces)
    if spoiled is not None:
        value = _spoil(value, spoiled)
    return value


def side(machine: Machine, term: If | Branch, env: dict[str, Value], which: int, trace: Trace | None) -> Value:
    body = function_of(term.orelse if which else term.then)
    return machine.run(body, [env[p] for p in body.params], trace)


def split(machine: Machine, mask: Any, term: If | Branch, env: dict[str, Value], traces: tuple[Any, Any]) -> Value:
    arrays = [a for value in env.values() for a in all_arrays(value)]
    shape = np.broadcast_shapes(mask.shape, *(a.shape for a in arrays))
    full = np.broadcast_to(mask, shape)
    results = []
    for which, where in ((0, full), (1, ~full)):

        def pick(a: Array, where: Any = where) -> Array:
            chosen: Array = np.broadcast_to(a, shape)[where]
            return chosen

        here = {n: map_arrays(v, pick) for n, v in env.items()}
        results.append(side(machine, term, here, which, map_trace(traces[which], pick)))
    return merge(full, results[0], results[1])


def merge(mask: Any, a: Value, b: Value) -> Value:
    """Values for the members where the mask holds and for the others, put together."""
    if isinstance(a, Cell) and isinstance(b, Cell):
        k = max(len(a.t), len(b.t))

        def parts(x: tuple[Any, ...], y: tuple[Any, ...]) -> tuple[Any, ...]:
            return tuple(_merge(mask, p, q) for p, q in zip(x or (None,) * k, y or (None,) * k, strict=True))

        v = _merge(mask, a.v, b.v)
        assert v is not None
        return Cell(v, _merge(mask, a.e, b.e), parts(a.t, b.t), parts(a.et, b.et))
    if isinstance(a, tuple) and isinstance(b, tuple) and len(a) == len(b):
        return tuple(merge(mask, x, y) for x, y in zip(a, b, strict=True))
    raise wrong_call("the two sides of a conditional over a batch of points are not of the same kind")


def _merge(mask: Any, a: Number | None, b: Number | None) -> Number | None:
    if a is None and b is None:
        return None
    out = np.empty(mask.shape)
    out[mask] = 0.0 if a is None else a
    out[~mask] = 0.0 if b is None else b
    return out


def _spoil(value: Value, nan: Number) -> Value:
    if isinstance(value, Cell):
        return Cell(value.v + nan, value.e, value.t, value.et)
    if isinstance(value, tuple):
        return tuple(_spoil(v, nan) for v in value)
    return value
