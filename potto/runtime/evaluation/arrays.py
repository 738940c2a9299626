"""Arrays while a program runs: all elements at once, along an axis in front of the batch; elements at places.

Owns `array`, `element` and `length`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from potto.core.terms import Array as ArrayTerm
from potto.core.terms import Length, lam
from potto.diagnostics import PottoError, declare
from potto.kernels import errors
from potto.kernels.cells import Cell, Env, Number, Rows, Value, batch_shape, listed
from potto.kernels.rows import gathered
from potto.kernels.whole import SHORT, looked_through
from potto.runtime.evaluation.functions import Closure, chosen, holds_functions
from potto.runtime.evaluation.machine import Machine

OUT_OF_RANGE = declare("P0511", "an index that is out of range")
NO_PLACE = declare("P0512", "an index or a size that is not a whole number")
RAGGED = declare("P0513", "sizes that do not agree")
NO_RISE = declare("P0514", "places of a look-up that do not increase")

MOST_ELEMENTS = 100_000_000


def array(machine: Machine, term: ArrayTerm, size: Value, env: Env) -> Value:
    """The array of a body for all places."""
    count = _size(size)
    params = tuple(sorted(term.body.free | {term.variable}))
    body = lam(params, term.body)
    shape = batch_shape(env.values())
    if count == 0:
        return Rows(Cell(np.zeros(0), None, (None,) * machine.directions), 0)
    places = np.arange(count, dtype=float).reshape(count, *(1,) * len(shape))
    here = {**env, term.variable: Cell(places, None, (None,) * machine.directions)}
    met = machine.record.met
    with looked_through(SHORT):
        value = machine.run(body, [here[name] for name in params], None)
    machine.record.spread(met)
    if holds_functions(value):
        return _one_by_one(machine, body, count, env, term.variable)
    return Rows(_in_front(value, count, shape, 0), count)


def _one_by_one(machine: Machine, body: Any, count: int, env: Env, variable: str) -> Value:
    """An array with functions in it: each has captured a place of its own."""
    found = []
    for place in range(count):
        here = {**env, variable: Cell(float(place), None, (None,) * machine.directions)}
        found.append(machine.run(body, [here[name] for name in body.params], None))
    return listed(found)


def _size(size: Value) -> int:
    """How many elements there are to be, which is the same for all members of a batch."""
    if not isinstance(size, Cell):
        raise errors.not_a_number(size)
    flat = np.unique(np.asarray(size.v))
    if flat.size != 1:
        message = f"the arrays of a batch are of different sizes, from {flat[0]:.0f} to {flat[-1]:.0f}"
        raise PottoError([RAGGED(errors.NOWHERE, message, help="evaluate them one by one")])
    count = float(flat[0])
    if count != np.rint(count) or not np.isfinite(count):
        message = f"an array cannot have {count!r} elements: that is not a whole number"
        raise PottoError([NO_PLACE(errors.NOWHERE, message, help="use `floor` or `ceil` to make it one")])
    if count > MOST_ELEMENTS:
        raise PottoError([NO_PLACE(errors.NOWHERE, f"an array of {count:.16g} elements is too large")])
    return max(0, int(count))


def _in_front(value: Value, count: int, shape: tuple[int, ...], inner: int) -> Value:
    """A value over (places, *batch) with an axis for the places in front of all of its parts."""
    if isinstance(value, tuple):
        return tuple([_in_front(item, count, shape, inner) for item in value])
    if isinstance(value, Rows):
        return Rows(_in_front(value.item, count, shape, inner + 1), value.size)
    if isinstance(value, list):
        message = "the rows of this array are of different lengths, or functions"
        raise PottoError([RAGGED(errors.NOWHERE, message, help="let the inner size not depend on the outer index")])
    if not isinstance(value, Cell):
        raise errors.not_a_number(value)

    def part(x: Any) -> Any:
        if not np.ndim(x):
            return x
        own, batch = x.shape[:inner], x.shape[inner:]
        if len(batch) == len(shape) + 1 and batch[0] == count:
            x = np.moveaxis(x, inner, 0)
            if all(n == 1 for n in batch[1:]):
                return np.reshape(x, (count, *own))
            return np.broadcast_to(x, (count, *own, *shape)) if batch[1:] != shape else x
        if len(batch) == len(shape) + 1:  # the same at all places
            x = np.reshape(x, (*own, *batch[1:]))
        return np.broadcast_to(x, (count, *x.shape))

    t, et = ([None if x is None else part(x) for x in side] for side in (value.t, value.et))
    return Cell(part(value.v), None if value.e is None else part(value.e), tuple(t), tuple(et))


# Elements


def element(whole: Value, place: Value) -> Value:
    """The element of an array at a place, or for a batch of places those."""
    if not isinstance(place, Cell):
        raise errors.not_a_number(place)
    if isinstance(whole, Rows):
        places = _places(place.v, whole.size)
        return whole.at(int(places)) if not places.ndim else gathered(whole, places)
    if isinstance(whole, list):
        places = _places(place.v, len(whole))
        if np.ptp(places) == 0:
            return whole[int(places.flat[0])]
        return _among(whole, places)
    raise errors.wrong_call("only an array has elements", "to call a function, write parentheses")


def _among(options: list[Any], places: Any) -> Value:
    """For each of a batch the option at its place: functions, or records and arrays with some in them, by parts."""
    if all(isinstance(option, Closure) for option in options):
        return chosen(options, places, _among)
    first = options[0]
    if isinstance(first, tuple | list) and all(type(o) is type(first) and len(o) == len(first) for o in options):
        return type(first)([_among(list(parts), places) for parts in zip(*options, strict=True)])
    rows = listed(options)
    if isinstance(rows, Rows):
        return gathered(rows, places)
    raise errors.wrong_call("where rows are of different lengths, all members of a batch have one index")


def _places(place: Number, size: int) -> Any:
    at = np.asarray(place)
    with np.errstate(invalid="ignore"):
        bad = ~(np.isfinite(at) & (at == np.rint(at)))
        if np.any(bad):
            message = f"the index {float(at[bad].ravel()[0])!r} is not a whole number"
            raise PottoError([NO_PLACE(errors.NOWHERE, message, help="use `floor` or `ceil` to make it one")])
        out = (at < 0) | (at >= size)
    if np.any(out):
        first = f"{at[out].ravel()[0]:.16g}"
        last = f"indices go from 0 to {size - 1}"
        message = f"the index {first} is out of range: the array has {size} element{'s' if size > 1 else ''}"
        if not size:
            message = f"this array or range is empty: it has no element {first}"
            last = "neither an index nor `min x in xs (x)` or `max` has anything to take there"
        raise PottoError([OUT_OF_RANGE(errors.NOWHERE, message, notes=(last,))])
    return at.astype(np.int64)


def length(machine: Machine, term: Length, whole: Value, like: Value | None) -> Value:
    """How many elements an array has, of which all holds that the term asks."""
    count = _count(whole)
    if like is not None and _count(like) != count:
        message = f"two arrays that go together have {count} and {_count(like)} elements"
        help = "take as many of both: `+`, `-`, `*`, `/`, `dot` and `interp` go element by element"
        raise PottoError([RAGGED(errors.NOWHERE, message, help=help)])
    if term.filled and not count:
        _places(0.0, count)
    if term.rising:
        _see_that_it_rises(whole)
    return Cell(float(count), None, (None,) * machine.directions)


def _count(whole: Value) -> int:
    if isinstance(whole, Rows):
        return whole.size
    if isinstance(whole, tuple | list):
        return len(whole)
    raise errors.wrong_call("only an array has a length")


def _see_that_it_rises(whole: Value) -> None:
    if not isinstance(whole, Rows) or not isinstance(whole.item, Cell):
        raise errors.wrong_call("the places of `interp` must be numbers")
    numbers = np.asarray(whole.item.v)
    if not numbers.ndim:
        numbers = np.full(whole.size, numbers)
    with np.errstate(invalid="ignore"):
        bad = np.argwhere(~(np.diff(numbers, axis=0) > 0))
    if bad.size:
        place, *member = map(int, bad[0])
        first, second = (float(numbers[at, *member]) for at in (place, place + 1))
        message = f"`interp` needs increasing places, but {second!r} follows {first!r}"
        note = f"they are the elements {place} and {place + 1} of its first argument"
        help = "sort them, with the values beside them"
        raise PottoError([NO_RISE(errors.NOWHERE, message, notes=(note,), help=help)])
