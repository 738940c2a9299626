"""Conditionals whose sides are evaluated only where they are taken.

Owns `lazy`, `apart`, `by_numbers` and `by_bounds`. With one outcome for the whole batch one side is evaluated;
otherwise the batch is split, each side evaluated on its own members, and the results put together again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from potto.core.terms import Branch, If, function_of
from potto.kernels.cells import (
    Array,
    Bools,
    Cell,
    Number,
    Trace,
    Value,
    batch_shape,
    combined,
    map_arrays,
    map_cells,
    map_trace,
)
from potto.kernels.tape import Node, scattered
from potto.runtime.evaluation.functions import Chosen, Closure
from potto.runtime.evaluation.machine import Machine

Pick = Callable[[Array], Array]


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
    full = np.broadcast_to(mask, batch_shape(env.values(), mask.shape))

    def evaluated(which: int, here: dict[str, Value], pick: Pick) -> Value:
        return side(machine, term, here, which, map_trace(traces[which], pick))

    return apart((full, ~full), env, evaluated)


def apart(
    masks: Sequence[Bools], env: dict[str, Value], evaluated: Callable[[int, dict[str, Value], Pick], Value]
) -> Value:
    """The values of a batch, the members of each mask evaluated together and apart from the others.

    evaluated: from the number of a mask, the environment of its members and what picks these from an array.
    """
    shape = masks[0].shape
    parts = []
    for number, mask in enumerate(masks):

        def pick(a: Array, mask: Bools = mask) -> Array:
            chosen: Array = np.broadcast_to(a, shape)[mask]
            return chosen

        parts.append(evaluated(number, {n: map_arrays(v, pick) for n, v in env.items()}, pick))

    def whole(*rows: Number) -> Array:
        if any(isinstance(row, Node) for row in rows):
            return scattered(masks, rows, shape)  # type: ignore[no-any-return]
        out = np.empty(shape)
        for mask, row in zip(masks, rows, strict=True):
            out[mask] = row
        return out

    return _together(parts, masks, whole)


def by_numbers(
    numbers: Number, env: dict[str, Value], evaluated: Callable[[float, dict[str, Value], Pick], Value]
) -> Value:
    """The values of a batch, the members that have the same number together."""
    full, each = np.broadcast_to(numbers, batch_shape(env.values(), np.shape(numbers))), np.unique(numbers)
    return apart([full == one for one in each], env, lambda place, here, pick: evaluated(each[place], here, pick))


def by_bounds(
    first: Number, last: Number, env: dict[str, Value], evaluated: Callable[[Cell, Cell, dict[str, Value]], Value]
) -> Value:
    """The values of a batch over which bounds differ, the members with equal ones together."""
    shape = batch_shape(env.values(), np.shape(first), np.shape(last))
    lo, hi = np.broadcast_to(first, shape), np.broadcast_to(last, shape)
    pairs = np.unique(np.stack([lo.ravel(), hi.ravel()]), axis=1).T

    def of(number: int, here: dict[str, Value], _: Pick) -> Value:
        a, b = pairs[number]
        return evaluated(Cell(float(a)), Cell(float(b)), here)

    return apart([(lo == a) & (hi == b) for a, b in pairs], env, of)


def _together(parts: Sequence[Value], masks: Sequence[Bools], whole: Callable[..., Array]) -> Value:
    """The values of the members of each mask as those of all; functions as one of which each member has chosen its
    own. whole: puts the numbers of all masks together."""
    first = parts[0]
    if isinstance(first, tuple | list) and all(type(part) is type(first) and len(part) == len(first) for part in parts):
        return type(first)([_together(items, masks, whole) for items in zip(*parts, strict=True)])
    functions = [part for part in parts if isinstance(part, Closure)]
    if len(functions) < len(parts) or all(function is parts[0] for function in functions):
        return combined(whole, *parts)

    def spread(row: Number, own: int) -> Number:
        return whole(*(row if n == own else np.zeros(int(mask.sum())) for n, mask in enumerate(masks)))

    options = [f.change(lambda v, n=n: map_arrays(v, lambda row: spread(row, n))) for n, f in enumerate(functions)]  # type: ignore[misc]
    return Chosen(options, Cell(np.select(masks, range(len(masks))).astype(float)))


def _spoil(value: Value, nan: Number) -> Value:
    return map_cells(value, lambda cell: Cell(cell.v + nan, cell.e, cell.t, cell.et))


def chosen(machine: Machine, function: Chosen, groups: tuple[tuple[Value, ...], ...]) -> Value:
    """Several functions called, each for the members that have chosen it."""
    given: dict[str, Value] = {f"{i}.{j}": arg for i, group in enumerate(groups) for j, arg in enumerate(group)}

    def evaluated(place: float, here: dict[str, Value], pick: Pick) -> Value:
        option = function.options[int(place)].change(lambda value: map_arrays(value, pick))
        called = tuple(tuple(here[f"{i}.{j}"] for j in range(len(group))) for i, group in enumerate(groups))
        return machine.call(option, called, None)

    return by_numbers(function.places.v, given, evaluated)
