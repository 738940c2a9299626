"""Python values as values of Potto, and answers over arrays in the shape that was asked for.

Owns the conversion of arguments and its complaints. Numbers are doubles; arrays broadcast against each other and
become one flat batch; tuples are tuples, lists are lists, functions of Potto are functions. Nothing else comes here
(`accepting` makes these of what Python has).
"""

from __future__ import annotations

import math
import numbers
from collections.abc import Callable, Iterable, Iterator, Mapping, Set
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from potto.diagnostics import PottoError, declare
from potto.kernels.cells import Cell, Rows, Value, listed
from potto.kernels.errors import wrong_call
from potto.kernels.memory import apart, copied
from potto.python.arrays import answers_in, batch_shapes, halves, over_batch
from potto.runtime.answers.estimate import Estimate
from potto.runtime.answers.named import alike
from potto.runtime.answers.printing import format_digits
from potto.runtime.answers.shown import holds_functions
from potto.source import Span
from potto.types import format_type
from potto.types.types import ArrayOf, Diffeo, Dist, Function, Real, TupleOf, Type, resolve, result_of

NO_KIND = declare("P0523", "a Python value that is not a value of Potto")

ToFunction = Callable[[Any], Value | None]


LEAST = 2048  # members, from which on a batch has blocks: below, the calls for some would cost as much as all
PATIENCE = 2.0  # seconds of the processor after which a smaller one has blocks as well: what is done can be kept


class Batch(Struct, frozen=True):
    """What arrays a call was given: the shape that they broadcast to; None when there are only numbers."""

    shape: tuple[int, ...] | None

    @property
    def size(self) -> int:
        """How many members it has."""
        return 1 if self.shape is None else math.prod(self.shape)

    def flat(self, array: np.ndarray[Any, np.dtype[np.float64]]) -> Any:
        """An array as a part of the batch, as a number where that has one member. An empty batch is run with one point,
        whose answer is dropped."""
        assert self.shape is not None
        if 0 in self.shape:
            return np.ones(1)
        if array.size == 1 and math.prod(self.shape) == 1:
            return float(array.item())
        if array.shape == self.shape and array.flags.c_contiguous:
            return array.reshape(-1)
        return np.ascontiguousarray(np.broadcast_to(array, self.shape)).reshape(-1)

    def row(self, array: np.ndarray[Any, Any]) -> Any:
        """The same of an array of any real numbers: it is read by machine code, and written by nobody."""
        return self.flat(np.require(array, np.float64, ("A", "E")))

    def rows(self, part: Any, inner: tuple[int, ...]) -> Any:
        """A part of an array, with axes of places in front, as a part of the batch."""
        assert self.shape is not None
        if 0 in self.shape:
            return np.ones((*inner, 1))
        own = part.shape[len(inner) :]
        wide = part.reshape(*inner, *(1,) * (len(self.shape) - len(own)), *own)
        flat = np.broadcast_to(wide, (*inner, *self.shape)).reshape(*inner, self.size)
        return np.ascontiguousarray(flat[..., 0] if self.size == 1 else flat)

    def shaped(self, estimate: Estimate, own: bool = False) -> Estimate:
        """The estimate with every number as an array of the batch's shape; as a float if there were no arrays.

        own: its arrays are in nobody else's hands.
        """
        parts = (estimate.value, estimate.error, estimate.tangent, estimate.tangent_error)
        if self.shape is None and all(part is None or part.__class__ is float for part in parts):
            return estimate
        own = own and apart(parts)
        value, error, tangent, tangent_error = (self.restored(part, own) for part in parts)
        shaped = replace(estimate, value=value, error=error, tangent=tangent, tangent_error=tangent_error)
        if self.shape is None:
            return replace(shaped, member_converged=None, shortfalls=dict.fromkeys(estimate.shortfalls, True))
        missed = {why: self._mask(where) for why, where in estimate.shortfalls.items()}
        converged = ~np.logical_or.reduce([np.zeros(self.shape, dtype=bool), *missed.values()])
        return replace(shaped, member_converged=converged, shortfalls=missed)

    def _array(self, items: list[Any]) -> Any:
        """An array of Potto as one of numpy: behind the axes of the batch those of the array, then of tuples in it.
        What is ragged, or holds functions, stays a list."""
        if not items:
            return np.zeros((*(self.shape or ()), 0))
        try:
            return self._columns(items)
        except (TypeError, ValueError):
            return [self.restored(item) for item in items]

    def _columns(self, items: list[Any]) -> Any:
        """Items of one form, part by part: arrays have hundreds of thousands of them. Raises TypeError, ValueError."""
        first, axis = items[0], 0 if self.shape is None else len(self.shape)
        if isinstance(first, tuple | list):
            columns = zip(*items, strict=True)
            return np.stack([self._columns(list(column)) for column in columns], axis=axis + 1)
        if self.shape is None:
            return np.array(list(map(float, items)))
        return np.stack([self.restored(item) for item in items], axis=axis)

    def _mask(self, mask: Any) -> Any:
        """A mask of the batch's members in its shape."""
        assert self.shape is not None
        count = int(np.prod(self.shape))
        return np.broadcast_to(np.asarray(mask).reshape(-1)[:count], (count,)).reshape(self.shape)

    @property
    def everybody(self) -> Any:
        """A mask of all members."""
        return np.ones(self.shape or (), dtype=bool)

    def restored(self, part: Any, own: bool = False) -> Any:
        """A part of an answer as an array of the batch's shape; own: a copy would be one too many."""
        if part is None:
            return None
        if isinstance(part, list):
            return self._array(part)
        if isinstance(part, tuple):
            return alike(part, [self.restored(item, own) for item in part])
        if self.shape is None:
            return float(part)
        if 0 in self.shape:
            return np.empty(self.shape)
        count, array = math.prod(self.shape), np.asarray(part, dtype=float)
        if array.ndim > 1 and len(array) == count:  # arrays of members, put together from tiles
            return array.reshape(*self.shape, *array.shape[1:])
        if array.size == count:
            return array.reshape(self.shape) if own and array.flags.carray else copied(array.reshape(self.shape))
        return copied(np.broadcast_to(array.reshape(-1), (count,)).reshape(self.shape))


def batch_of(arguments: Iterable[tuple[str, Any]]) -> Batch:
    """The batch that named arguments make together. Raises PottoError if their shapes do not go together."""
    shapes = [(name, shape) for name, argument in arguments for shape in _shapes(argument)]
    if not shapes:
        return Batch(None)
    try:
        return Batch(np.broadcast_shapes(*(shape for _, shape in shapes)))
    except ValueError:
        told = ", ".join(f"`{name}` has shape {shape}" for name, shape in shapes)
        raise wrong_call(f"these arrays do not broadcast against each other: {told}") from None


def flattened(given: Any, batch: Batch) -> Any:
    """What calls were given, with every array in it as one row over the batch."""
    return _mapped(given, lambda array: batch.flat(copied(array)), batch.rows)


def cut(given: Any, members: slice) -> Any:
    """Some members of what calls were given, which is `flattened`."""
    return _mapped(given, lambda array: array[members], lambda part, _: part[..., members])


def _mapped(given: Any, change: Callable[[Any], Any], rows: Callable[[Any, tuple[int, ...]], Any]) -> Any:
    """What calls were given with `change` done to every array, also to the errors of answers."""
    if isinstance(given, np.ndarray):
        return change(given) if given.ndim else given
    if isinstance(given, tuple | list):
        return type(given)(_mapped(item, change, rows) for item in given)
    if isinstance(given, dict):
        return {name: _mapped(item, change, rows) for name, item in given.items()}
    if isinstance(given, Estimate) and given.tangent is None and isinstance(given.value, np.ndarray):
        error = np.broadcast_to(given.error, given.value.shape)
        return Estimate(_mapped(given.value, change, rows), _mapped(error, change, rows))
    if isinstance(given, Estimate):
        parts = answers_in(given) if given.tangent is None else halves(given)
        return given if parts is None else _mapped(parts, change, rows)
    if isinstance(given, Rows):
        return over_batch(given, rows)
    return given


def _shapes(argument: Any) -> Iterable[tuple[int, ...]]:
    if isinstance(argument, Estimate):
        argument = (argument.value, argument.tangent)
    if isinstance(argument, np.ndarray) and argument.ndim:
        yield argument.shape
    elif isinstance(argument, Rows):
        yield from batch_shapes(argument)
    elif isinstance(argument, tuple | list):
        for item in argument:
            yield from _shapes(item)


LARGEST = 2**53  # up to here every whole number is a float


def value_of(name: str, argument: Any, batch: Batch, to_function: ToFunction) -> Value:
    """A Python value as a value of Potto. Raises PottoError for one that is none."""
    function = to_function(argument)
    if function is not None:
        return function
    if isinstance(argument, float):
        return Cell(float(argument))
    if isinstance(argument, bool | np.bool_):
        raise no_kind(name, argument, "write 1.0 or 0.0")
    if isinstance(argument, numbers.Real):
        return Cell(_double(name, argument))
    if isinstance(argument, Estimate):
        return _estimate(name, argument, batch, to_function)
    if isinstance(argument, np.ndarray):
        return _array(name, argument, batch)
    if isinstance(argument, tuple):
        return tuple(value_of(name, item, batch, to_function) for item in argument)
    if isinstance(argument, list):
        return listed([value_of(name, item, batch, to_function) for item in argument])
    if isinstance(argument, Rows):
        return over_batch(argument, batch.rows)
    raise no_kind(name, argument, _instead(argument))


NUMBERS = Batch(None)
# Of arguments that are plain numbers or tuples of them: for each 0, or how many.
Kinds = tuple[int, ...]


def kinds_of(args: tuple[Any, ...]) -> Kinds:
    """The kinds of arguments; none if they are not all plain. Whether they fit depends on nothing else."""
    kinds = []
    for arg in args:
        if arg.__class__ is float or (arg.__class__ is int and abs(arg) <= LARGEST):
            kinds.append(0)
        elif arg.__class__ is tuple and arg and not any(kinds_of(arg)) and len(kinds_of(arg)) == len(arg):
            kinds.append(len(arg))
        else:
            return ()
    return tuple(kinds)


def numbers_of(args: tuple[Any, ...]) -> list[Value]:
    """Plain arguments as values."""
    return [tuple(numbers_of(arg)) if arg.__class__ is tuple else Cell(float(arg)) for arg in args]


def _double(name: str, argument: Any) -> float:
    try:
        return float(argument)
    except (OverflowError, ValueError):
        raise no_kind(name, argument, "this number does not fit into a double") from None


def _array(name: str, argument: np.ndarray[Any, Any], batch: Batch) -> Value:
    if argument.dtype.kind not in "fiu":
        raise no_kind(name, argument, "an array must hold real numbers")
    if argument.ndim == 0:
        return Cell(float(argument))
    return Cell(batch.row(argument))


def _estimate(name: str, argument: Estimate, batch: Batch, to_function: ToFunction) -> Value:
    """An answer as an argument, with the error that it has."""
    if argument.tangent is not None:
        return value_of(name, halves(argument), batch, to_function)
    if isinstance(argument.value, float):
        return Cell(argument.value, argument.error or None)
    if isinstance(argument.value, np.ndarray) and np.any(argument.error):
        return Cell(batch.flat(argument.value), batch.flat(np.broadcast_to(argument.error, argument.value.shape)))
    plain = argument.value
    if plain is None:
        raise no_kind(name, argument, "this answer is a function and not a number")
    if holds_functions(plain):
        message = f"`{name}` holds functions, of which an answer has no more than their places"
        raise wrong_call(message, "give its parts: `(2.0, f)`, or a dictionary by the names of its fields")
    return value_of(name, plain if (parts := answers_in(argument)) is None else parts, batch, to_function)


def _instead(argument: Any) -> str:
    """What to do with an argument that is none: of a library that differentiates, what makes a function one of its."""
    bridges = {"jax": ("JAX", "to_jax"), "jaxlib": ("JAX", "to_jax"), "torch": ("PyTorch", "to_torch")}
    library, bridge = bridges.get(type(argument).__module__.partition(".")[0], ("", ""))
    if bridge:
        return f"{library} differentiates functions of its own: `potto.{bridge}(f)` makes `f` one, derivatives included"
    return "numbers, numpy arrays, tuples, lists and functions of Potto are accepted"


def no_kind(name: str, argument: Any, help: str) -> PottoError:
    kind = type(argument).__name__
    if isinstance(argument, np.ndarray):
        kind = f"array of {argument.dtype}"
    return PottoError([NO_KIND(Span(0, 0), f"the argument `{name}` cannot be given a Python {kind}", help=help)])


def misfit(name: str, argument: Any, type: Type, own: Type | None) -> str | None:
    """Why an argument cannot have a parameter's type, or None; only kinds are compared, not what varies.

    `own` is the type of an argument that is a function.
    """
    type = resolve(type)
    if isinstance(type, Real) and own is None and isinstance(argument, float | int):
        return None
    complaint = _complaint(argument, type, own)
    if complaint is None:
        return _misfit_inside(name, argument, type)
    return f"`{name}` is {format_type(type)}: {complaint}"


def _misfit_inside(name: str, argument: Any, type: Type) -> str | None:
    """Why a part of a tuple, or of a record, cannot have its type; of an array, one of its elements."""
    parts: Iterable[tuple[str, Any, Type]] = ()
    if isinstance(type, TupleOf) and not type.dual and isinstance(argument, tuple):
        names = map(str, range(len(type.items))) if type.record is None else type.record.fields
        parts = ((f"{name}.{own}", part, item) for own, part, item in zip(names, argument, type.items, strict=True))
    elif isinstance(type, ArrayOf) and isinstance(argument, list):
        parts = (
            (f"{name}[{place}]", part, type.item) for place, part in enumerate(argument) if part.__class__ is not float
        )
    values = (tuple, list, float, np.ndarray, Mapping)
    found = (
        misfit(own, part, t, None)
        for own, part, t in parts
        if isinstance(part, values) or not isinstance(resolve(t), Function | Diffeo)
    )
    return next((why for why in found if why is not None), None)


def _complaint(argument: Any, type: Type, own: Type | None) -> str | None:
    match type:
        case Function() | Diffeo():
            if own is None:
                return f"a function is needed, not {_kind(argument)}"
            if is_dual(result_of(type)) and not is_dual(result_of(own)):
                return "the derivative of a function is needed, `potto.deriv(…)` of the one that is given"
            return None
        case _ if own is not None:
            return "not a function" if isinstance(type, Real | Dist | TupleOf | ArrayOf) else None
        case TupleOf(items, dual):
            return _tuple_misfit(argument, items, dual)
        case ArrayOf():
            fits = isinstance(argument, list | np.ndarray | Estimate | Rows)
            more = ": `list(…)` makes one of it" if isinstance(argument, tuple | range | Set | Iterator) else ""
            return None if fits else f"an array is needed, not {_kind(argument)}{more}"
        case Real() | Dist():
            fits = not isinstance(argument, tuple | list)
            return None if fits else f"a number is needed, not {_kind(argument)}"
        case _:
            return None


def is_dual(type: Type) -> bool:
    """A dual, or a tuple of them."""
    return isinstance(type, TupleOf) and (type.dual or all(is_dual(resolve(item)) for item in type.items))


def _tuple_misfit(argument: Any, items: tuple[Type, ...], dual: bool) -> str | None:
    if dual and isinstance(items[0], ArrayOf) and isinstance(argument, list | np.ndarray | Rows):
        return None  # an array without tangents
    if dual and not isinstance(argument, tuple | list | Mapping):
        return None  # a number given for a dual has tangent 0
    if isinstance(argument, Estimate):
        return None
    if not isinstance(argument, tuple) or len(argument) != len(items):
        what = "a dual `(value, tangent)`" if dual else f"a tuple of {len(items)}"
        return f"{what} is needed, not {_kind(argument)}"
    return None


def _kind(argument: Any) -> str:
    if isinstance(argument, tuple | list):
        return f"a {type(argument).__name__} of {len(argument)}"
    return f"a Python {type(argument).__name__}"


def moving(head: str, given: Iterable[tuple[tuple[Any, ...], dict[str, Any]]]) -> str:
    """The call of a derivative with a tangent for its first number, as it is written; nothing for one of arrays."""
    text = head
    for args, kwargs in given:
        words: list[str] = []
        for name, argument in (*(("", argument) for argument in args), *kwargs.items()):
            if not isinstance(argument, int | float):
                return ""
            number = format_digits(float(argument), 12)
            number = f"({number}, 1)" if text == head and not words else number
            words.append(f"{name}={number}" if name else number)
        text += f"({', '.join(words)})"
    return text
