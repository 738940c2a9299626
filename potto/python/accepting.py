"""What Python has for numbers, arrays and tuples, as the few kinds that arguments are made of.

Owns `accepted`, `with_tangents` for derivatives, and `as_given`, the way back. Decimals and tensors become floats and
arrays; a list where a number is wanted is a batch of numbers; a list, or an array whose last axis has its length, where
a tuple is wanted, is that tuple. What it cannot place it hands on unchanged: the check of arguments says what is wrong
with it.
"""

from __future__ import annotations

import contextlib
import numbers
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from potto.kernels.cells import Rows
from potto.python.arrays import answers_in, axes_of, halves
from potto.runtime.answers.estimate import Estimate
from potto.runtime.answers.named import alike
from potto.types.still import values_of
from potto.types.types import ArrayOf, Dist, Function, Real, RecordName, TupleOf, Type, resolve

PLAIN = (numbers.Real, np.ndarray, np.bool_, Estimate, Rows, str, bytes, tuple, list, Mapping)


def accepted(argument: Any, type: Type | None) -> Any:
    """An argument for a parameter of this type, if that is known, without what only Python knows about it."""
    if argument.__class__ is float or argument.__class__ is int:
        return argument
    found = None if type is None else resolve(type)
    if isinstance(argument, Estimate) and (found is None or isinstance(found, TupleOf)):
        argument = _parts_in(argument)
    if isinstance(found, TupleOf) and found.dual and not isinstance(argument, tuple):  # without tangents
        values = resolve(found.items[0])
        found = values if isinstance(values, ArrayOf) else found
    if found is None and isinstance(argument, tuple):  # of a whole group
        return tuple(accepted(item, None) for item in argument)
    record = found.record if isinstance(found, TupleOf) else record_in(found)
    columns = None if record is None else _columns_of(argument)
    if columns is not None and record is not None:  # of which a table may have more
        known = {name: columns[name] for name in record.fields if name in columns}
        argument = known if len(known) == len(record.fields) else columns
        if not isinstance(found, TupleOf):
            return argument
    if isinstance(found, ArrayOf) and hasattr(argument, "to_numpy"):
        return argument  # with its labels, by which a gap is told
    if not isinstance(argument, PLAIN):
        argument = _standard(argument)
    if isinstance(found, Real | Dist) and isinstance(argument, list):
        return _batch(argument)
    if isinstance(found, TupleOf):
        return _tuple(argument, found)
    return argument


def _parts_in(answer: Estimate) -> Any:
    """What a tuple, or a dual, that was an answer is made of, each part with its own error; any other one as it is."""
    if answer.tangent is not None:
        return halves(answer)
    parts = answers_in(answer)
    return answer if parts is None else parts


def _columns_of(argument: Any) -> dict[str, Any] | None:
    """A table of pandas, or an array of numpy whose elements have named parts, as its columns; None for others."""
    if hasattr(argument, "columns") and hasattr(argument, "to_numpy"):
        return {str(name): argument[name] for name in argument.columns}
    names = argument.dtype.names if isinstance(argument, np.ndarray) else None
    return None if names is None else {name: np.asarray(argument[name]) for name in names}


def record_in(type: Type | None) -> RecordName | None:
    """Which records an array has as elements, if it has any."""
    item = resolve(type.item) if isinstance(type, ArrayOf) else None
    return item.record if isinstance(item, TupleOf) else None


def with_tangents(argument: Any, type: Type | None, derived: Callable[[Any], Any]) -> Any:
    """An argument of a derivative; a tuple or a record that is given alone together with its tangents, which are 0, and
    functions in it, or in an array, together with theirs, by `derived`."""
    values = None if type is None else values_of(type)
    if values is not None and _is_like(argument, values):
        return argument, _zeros(argument, values)
    found = None if type is None else resolve(type)
    if isinstance(found, TupleOf) and not found.dual:
        parts = _parts(argument, found)
        return argument if parts is None else tuple(_moving(*pair, derived) for pair in zip(parts, found.items))
    if isinstance(found, ArrayOf) and isinstance(argument, list):
        return [_moving(item, found.item, derived) for item in argument]
    return argument


def _moving(argument: Any, type: Type, derived: Callable[[Any], Any]) -> Any:
    """A part of an argument of a derivative."""
    if isinstance(resolve(type), Function):
        return derived(argument)
    return with_tangents(argument, type, derived) if isinstance(argument, tuple | Mapping | list) else argument


def _is_like(argument: Any, type: Type) -> bool:
    """Whether an argument is made as a type of numbers is."""
    found = resolve(type)
    if not isinstance(found, TupleOf):
        return not isinstance(argument, tuple | Mapping)
    parts = _parts(argument, found)
    return parts is not None and all(map(_is_like, parts, found.items))


def _parts(argument: Any, type: TupleOf) -> tuple[Any, ...] | None:
    if isinstance(argument, Mapping) and type.record is not None and argument.keys() == set(type.record.fields):
        return tuple(argument[name] for name in type.record.fields)
    return argument if isinstance(argument, tuple) and len(argument) == len(type.items) else None


def _zeros(argument: Any, type: Type) -> Any:
    found = resolve(type)
    if isinstance(found, TupleOf):
        return tuple(map(_zeros, _parts(argument, found) or (), found.items))
    return np.zeros(np.shape(argument)) if isinstance(found, ArrayOf) else 0.0


def _standard(argument: Any) -> Any:
    if isinstance(argument, type):
        return argument
    with contextlib.suppress(TypeError, ValueError, RuntimeError):  # which tensors raise that are elsewhere
        if hasattr(argument, "__array__"):
            return np.asarray(argument)
        if hasattr(argument, "__float__"):
            return float(argument)
    return argument


def _batch(items: list[Any]) -> Any:
    """Numbers, or rows of them, as an array; with their errors where they are answers."""
    with contextlib.suppress(TypeError, ValueError):
        values = np.array(items)
        if values.dtype.kind not in "fiuO":
            return items
        values = values.astype(float)
        errors = np.array([item.error for item in items if isinstance(item, Estimate)])
        return Estimate(values, errors) if errors.shape == values.shape else values
    return items


def _tuple(argument: Any, type: TupleOf) -> Any:
    if isinstance(argument, list) and len(argument) == len(type.items) and not type.dual:
        argument = tuple(argument)
    if isinstance(argument, np.ndarray) and argument.ndim and argument.shape[-1] == len(type.items):
        plain = not type.dual and type.record is None and all(isinstance(resolve(t), Real | Dist) for t in type.items)
        if plain:
            parts = np.moveaxis(argument, -1, 0)
            return tuple(float(part) if argument.ndim == 1 else part for part in parts)
    if isinstance(argument, tuple) and len(argument) == len(type.items):
        return tuple(accepted(part, item) for part, item in zip(argument, type.items, strict=True))
    if isinstance(argument, Mapping) and type.record is not None and argument.keys() == set(type.record.fields):
        return {name: accepted(argument[name], item) for name, item in _fields(type, type.record)}
    return argument


def _fields(type: TupleOf, record: RecordName) -> list[tuple[str, Type]]:
    return list(zip(record.fields, type.items, strict=True))


def as_given(argument: Any, part: Any, type: Type | None) -> Any:
    """A derivative in the form of the argument: a dict by a record that was given as a dict, an array by a tuple
    that was given as an array."""
    found = None if type is None else resolve(type)
    if isinstance(found, ArrayOf):
        return _elements(argument, part, found)
    if isinstance(part, np.ndarray) and isinstance(found, TupleOf) and isinstance(argument, Mapping | tuple):
        part = tuple(part)  # of an array of records that has one axis more for their fields
    if not isinstance(found, TupleOf) or not isinstance(part, tuple):
        return float(part) if isinstance(part, np.generic) else part
    if isinstance(argument, np.ndarray):
        return np.stack(part, axis=-1)
    if isinstance(argument, Mapping) and found.record is not None:
        fields = zip(_fields(found, found.record), part, strict=True)
        return {name: as_given(argument[name], item, its) for (name, its), item in fields}
    if isinstance(argument, tuple | list) and len(argument) == len(part):
        return alike(part, [as_given(*three) for three in zip(argument, part, found.items, strict=True)])
    return part


def _elements(argument: Any, part: Any, type: ArrayOf) -> Any:
    """Derivatives by an array of records in the form of dicts, or of the columns that it was given as."""
    record, axes = record_in(type), axes_of(type)
    if isinstance(argument, list) and isinstance(resolve(type.item), ArrayOf) and isinstance(part, list):
        return [as_given(*both, type.item) for both in zip(argument, part, strict=True)]
    if record is None or not isinstance(argument, Mapping | list):
        return part
    if isinstance(part, np.ndarray) and axes is not None:  # the axes of a batch are in front
        part = np.moveaxis(part, range(part.ndim - axes), range(axes - part.ndim, 0))
    if isinstance(argument, Mapping):
        columns = zip(*part, strict=True) if isinstance(part, list) else np.moveaxis(part, 1, 0)
        return {name: _column(list(column)) for name, column in zip(record.fields, columns, strict=True)}
    if not any(isinstance(item, Mapping) for item in argument):
        return part
    return [as_given(*both, type.item) for both in zip(argument, part, strict=True)]


def _column(items: list[Any]) -> Any:
    return items if any(isinstance(item, tuple) for item in items) else np.stack(items, axis=-1)
