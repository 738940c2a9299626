"""Arrays of Python as arrays of Potto: what a parameter's type says which axes of numpy's are.

Owns `with_arrays`, `axes_of`, `over_batch`, `batch_shapes`, `shape_together` and `evenly`; `is_one`, `without_axes` and
`with_axes`: arrays of one member as numbers. A parameter `[n] Real` takes a numpy array, a column of a table or a list
as one array, and the axes before those of the array are a batch; a parameter `Real` takes a numpy array as a batch.
Until all batches are known, the parts of such an array have its axes first and then those of its own batch.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from potto.kernels.cells import Cell, Rows, Value, all_cells, listed, map_cells, parts_of
from potto.kernels.errors import wrong_call
from potto.reports.near import near_names
from potto.runtime.answers.estimate import Estimate
from potto.runtime.answers.shown import holds_functions
from potto.types import format_type
from potto.types.types import ArrayOf, Count, Dist, Real, RecordName, Shifted, SizeVar, TupleOf, Type, resolve

Sizes = dict[str, tuple[str, int]]  # of names of sizes: the parameter that says how many, and the number


def is_batch(argument: Any) -> bool:
    """Whether an argument is an array of numpy with axes."""
    return argument.__class__ is np.ndarray and argument.ndim > 0


def shape_together(arguments: Sequence[Any]) -> tuple[int, ...] | None:
    """The shape that the arrays among arguments broadcast to; None where there are none, or they do not."""
    shapes = [argument.shape for argument in arguments if is_batch(argument)]
    with contextlib.suppress(ValueError):
        return np.broadcast_shapes(*shapes) if shapes else None
    return None


def is_one(argument: Any) -> bool:
    """Whether an argument is an array of one real number."""
    return argument.__class__ is np.ndarray and argument.size == 1 and argument.dtype.kind in "fiu"


def without_axes(args: tuple[Any, ...]) -> tuple[tuple[Any, ...], int]:
    """Arguments with numbers for arrays of one member, and how many axes these have: the most, 0 if there are none."""
    axes, numbers = 0, []
    for arg in args:
        own = 0
        if is_one(arg):
            own, arg = arg.ndim, float(arg.item())
        elif arg.__class__ is tuple:
            arg, own = without_axes(arg)
        axes = max(axes, own)
        numbers.append(arg)
    return tuple(numbers), axes


def with_axes(numbers: Sequence[float], axes: int) -> list[Any]:
    """Numbers as arrays of one member with so many axes."""
    return [*np.array(numbers).reshape(-1, *(1,) * axes)]  # in a third of the time that an array for each takes


def with_arrays(name: str, argument: Any, type: Type, sizes: Sizes) -> Any:
    """An argument in which what its type calls an array is one. Raises PottoError where sizes do not agree."""
    found = resolve(type)
    if isinstance(found, ArrayOf):
        return _array(name, argument, found, sizes)
    if isinstance(found, TupleOf) and found.dual and not isinstance(argument, tuple):
        return with_arrays(name, argument, found.items[0], sizes)  # without tangents
    if isinstance(argument, Estimate) and isinstance(argument.value, tuple):
        parts = answers_in(argument)
        argument = argument if parts is None else parts
    if isinstance(found, TupleOf) and found.record is not None and not isinstance(argument, tuple):
        argument = _fields(name, argument, found.record)
    if isinstance(found, TupleOf) and isinstance(argument, tuple) and len(argument) == len(found.items):
        fields = range(len(argument)) if found.record is None else found.record.fields
        each = zip(fields, argument, found.items, strict=True)
        return tuple(with_arrays(f"{name}.{own}", part, item, sizes) for own, part, item in each)
    return argument


def _fields(name: str, argument: Any, record: RecordName) -> Any:
    """A record that is given as a dict, or as an object with attributes, as the tuple of its fields."""
    given = argument if isinstance(argument, Mapping) else getattr(argument, "__dict__", None)
    if given is None:
        return argument
    _must_have(name, argument, given, record)
    return tuple(given[field] for field in record.fields)


def _must_have(name: str, argument: Any, given: Mapping[str, Any], record: RecordName, columns: bool = False) -> None:
    """Raise PottoError where a record, or an array of them by `columns`, is given too few fields, or others."""
    missing = [field for field in record.fields if field not in given]
    unknown = [str(field) for field in given if field not in record.fields] if isinstance(argument, Mapping) else []
    if not missing and not unknown:
        return
    told = [f"has no {', '.join(f'`{field}`' for field in missing)}"] if missing else []
    if unknown:
        told.append(f"has {', '.join(f'`{field}`' for field in unknown)}, which it does not know")
    near = next((close for field in unknown for close in near_names(field, missing)), None)
    hint = f"did you mean `{near}`?" if near else f"its fields are {', '.join(f'`{f}`' for f in record.fields)}"
    kind = f"[n] {record.shown}" if columns else record.shown
    raise wrong_call(f"`{name}` is {kind}, but what is given {' and '.join(told)}", hint)


def has_arrays(type: Type) -> bool:
    """Whether a parameter takes an array or a record."""
    found = resolve(type)
    if isinstance(found, TupleOf):
        return found.record is not None or any(map(has_arrays, found.items))
    return isinstance(found, ArrayOf)


def _array(name: str, argument: Any, type: ArrayOf, sizes: Sizes) -> Any:
    if isinstance(argument, Estimate) and argument.tangent is None:
        return _answer(name, argument, type, sizes)
    if hasattr(argument, "to_numpy"):
        argument = _of_table(name, argument)
    item = resolve(type.item)
    if isinstance(argument, Mapping) and isinstance(item, TupleOf) and item.record is not None:
        return _columns(name, argument, type.size, item, item.record, sizes)
    if isinstance(argument, list) and _of_numbers(type) and not _holds_answers(argument):
        with contextlib.suppress(TypeError, ValueError):  # not of one shape
            axes = axes_of(type) or 0
            numbers = np.array(argument, dtype=float) if argument else np.zeros(_without_elements(type))
            _must_be_there(name, argument, numbers)
            argument = numbers if numbers.ndim <= axes else argument  # else of elements that are batches
    if isinstance(argument, np.ndarray):
        return _numpy(name, argument, type, sizes)
    if isinstance(argument, list):
        _agree(name, len(argument), type.size, sizes)
        items = [with_arrays(f"{name}[{n}]", item, type.item, sizes) for n, item in enumerate(argument)]
        return listed(items) if items and all(isinstance(item, Rows) for item in items) else items
    return argument


def _holds_answers(items: Sequence[Any]) -> bool:
    """Whether there are answers in lists and tuples of any depth, of which numpy would take the numbers alone."""
    while items:
        kinds = set(map(type, items))
        if any(issubclass(kind, Estimate) for kind in kinds):
            return True
        nested = any(issubclass(kind, list | tuple) for kind in kinds)
        items = [part for item in items if isinstance(item, list | tuple) for part in item] if nested else []
    return False


def _of_table(name: str, table: Any) -> Any:
    """The numbers of a table or a column of pandas; of a gap, which would be nan in all that follows, where it is."""
    numbers = table.to_numpy()
    gaps = [place for place, value in np.ndenumerate(numbers) if _is_gap(value)] if _may_have_gaps(numbers) else []
    if not gaps:
        return numbers
    row, *column = gaps[0]
    labels: Any = getattr(table, "index", None)
    names = getattr(table, "columns", ())
    where = f"row {labels[row] if hasattr(labels, '__getitem__') else row}"
    if column:
        where += f" of column `{names[column[0]]}`"
    more = f", and {len(gaps) - 1} more are missing" if len(gaps) > 1 else ""
    help = "leave such rows out, `table.dropna()`, or fill them in, `table.fillna(…)`"
    raise wrong_call(f"`{name}` has no value in {where}{more}", help)


def must_not_be_masked(name: str, argument: Any) -> None:
    """Raise PottoError for an array of numpy that hides some of its numbers: they would count like all others."""
    if isinstance(argument, tuple):
        for number, part in enumerate(argument):
            must_not_be_masked(f"{name}.{number}", part)
    if argument.__class__ is np.ndarray or not isinstance(argument, np.ndarray):
        return  # without the import of what knows masks
    if isinstance(argument, np.ma.MaskedArray) and np.ma.is_masked(argument):
        where = ", ".join(map(str, np.argwhere(np.ma.getmaskarray(argument))[0]))
        place = f"`{name}[{where}]`" if where else f"`{name}`"
        raise wrong_call(f"{place} has no value: it is masked", "leave it out, or fill it in, `.filled(…)`")


def _must_be_there(name: str, argument: list[Any], numbers: np.ndarray[Any, Any]) -> None:
    """Raise PottoError for None in a list: numpy makes nan of it, as of a number that is none."""
    if not np.isnan(numbers).any():
        return
    items = np.array(argument, dtype=object)
    gap = next((place for place, item in np.ndenumerate(items) if item is None), None)
    if gap is not None:
        where = ", ".join(map(str, gap))
        raise wrong_call(f"`{name}[{where}]` has no value: it is None", "leave it out, or fill it in")


def _may_have_gaps(numbers: Any) -> bool:
    return numbers.dtype.kind == "O" or (numbers.dtype.kind == "f" and bool(np.isnan(numbers).any()))


def _is_gap(value: Any) -> bool:
    try:
        return value is None or bool(value != value)
    except TypeError:  # of pandas' NA, which is neither
        return True


def _columns(
    name: str, argument: Mapping[str, Any], size: Type, item: TupleOf, record: RecordName, sizes: Sizes
) -> Rows:
    """An array of records that is given as a dict of columns, one for each field."""
    _must_have(name, argument, argument, record, columns=True)
    found: list[Rows] = []
    for field, type in zip(record.fields, item.items, strict=True):
        column = _array(f"{name}.{field}", argument[field], ArrayOf(size, type), sizes)
        if not isinstance(column, Rows):
            raise wrong_call(f"`{name}.{field}` is a column of `[n] {record.shown}`: an array of numbers is needed")
        if found and column.size != found[0].size:
            raise wrong_call(f"`{name}.{record.fields[0]}` has {found[0].size} elements, and `{field}` {column.size}")
        found.append(column)
    return Rows(tuple([column.item for column in found]), found[0].size)


def _answer(name: str, answer: Estimate, type: ArrayOf, sizes: Sizes) -> Any:
    """An array that was an answer, with the errors that it has."""
    parts = answers_in(answer)
    if parts is not None:
        return _array(name, parts, type, sizes)
    value = _array(name, answer.value, type, sizes)
    off = np.asarray(answer.error, dtype=float) if isinstance(answer.error, np.ndarray | list | float) else None
    if not isinstance(value, Rows) or off is None or not off.any():
        return value
    error = _array(name, np.broadcast_to(off, np.shape(answer.value)), type, sizes)
    errors = iter(all_cells(error))
    return map_cells(value, lambda cell: Cell(cell.v, np.broadcast_to(next(errors).v, np.shape(cell.v))))


def answers_in(answer: Estimate) -> tuple[Estimate, ...] | list[Estimate] | None:
    """The parts of an answer that is a tuple or a list, each with its own error; None for any other one, for a dual,
    and where there are functions in it."""
    if answer.tangent is not None or not isinstance(answer.value, tuple | list) or holds_functions(answer.value):
        return None
    return tuple(answer) if isinstance(answer.value, tuple) else list(answer)


def halves(dual: Estimate) -> tuple[Estimate, Estimate]:
    """The value and the tangent of an answer that is a dual, each with its own error."""
    return Estimate(dual.value, dual.error), Estimate(dual.tangent, dual.tangent_error)


def _of_numbers(type: Type) -> bool:
    found = resolve(type)
    if isinstance(found, ArrayOf):
        return _of_numbers(found.item)
    if isinstance(found, TupleOf):
        return all(map(_of_numbers, found.items))
    return isinstance(found, Real | Dist)


def _numpy(name: str, argument: np.ndarray[Any, Any], type: ArrayOf, sizes: Sizes) -> Value:
    if argument.dtype.kind not in "fiu":
        help = "truths are made 0 and 1 by `.astype(float)`" if argument.dtype.kind == "b" else ""
        raise wrong_call(
            f"`{name}` is {format_type(type)}: an array must hold real numbers, not {argument.dtype}", help
        )
    axes = axes_of(type)
    if axes is None:
        raise wrong_call(f"`{name}` is {format_type(type)}: give it as a list")
    if argument.ndim < axes:
        plural = "axis" if axes == 1 else "axes"
        wanted = f"a numpy array of {axes} {plural} or more is needed, not one of shape {argument.shape}"
        raise wrong_call(f"`{name}` is {format_type(type)}: {wanted}")
    batch = argument.ndim - axes
    numbers = np.moveaxis(argument.astype(np.float64), range(batch), range(axes, argument.ndim))
    return _made(name, numbers, type, sizes)


def _without_elements(type: Type) -> tuple[int, ...]:
    """The shape of an array of this type that has no elements."""
    found = resolve(type)
    if isinstance(found, ArrayOf):
        return (0, *_without_elements(found.item))
    return (len(found.items), *_without_elements(found.items[0])) if isinstance(found, TupleOf) and found.items else ()


def axes_of(type: Type) -> int | None:
    """How many axes of numpy a type has; None for a tuple whose items differ in that."""
    found = resolve(type)
    if isinstance(found, ArrayOf):
        inner = axes_of(found.item)
        return None if inner is None else 1 + inner
    if not isinstance(found, TupleOf):
        return 0
    each = {axes_of(item) for item in found.items}
    only = each.pop() if len(each) == 1 else None
    return None if only is None else 1 + only


def _made(name: str, numbers: np.ndarray[Any, Any], type: Type, sizes: Sizes, axis: int = 0) -> Value:
    """The value of a type: the places of its arrays are the first axes of all numbers, tuples are taken apart."""
    found = resolve(type)
    if isinstance(found, ArrayOf):
        count = numbers.shape[axis]
        _agree(name, count, found.size, sizes)
        return Rows(_made(name, numbers, found.item, sizes, axis + 1), count)
    if not isinstance(found, TupleOf):
        return Cell(np.ascontiguousarray(numbers))
    if numbers.shape[axis] != len(found.items):
        raise wrong_call(f"`{name}` holds tuples of {len(found.items)}, and is given rows of {numbers.shape[axis]}")
    parts = (np.take(numbers, place, axis=axis) for place in range(len(found.items)))
    return tuple(_made(name, part, item, sizes, axis) for part, item in zip(parts, found.items, strict=True))


# Batches


def batch_shapes(rows: Rows) -> list[tuple[int, ...]]:
    """The shapes of the batches that an array is given in."""
    return [np.shape(part) for part in rows.batches()]


def over_batch(rows: Rows, change: Callable[[Any, tuple[int, ...]], Any]) -> Rows:
    """The array with `change` done to every part that differs over a batch: it is told the axes of places in front."""

    def changed(value: Value, inner: tuple[int, ...]) -> Value:
        if isinstance(value, tuple):
            return tuple([changed(item, inner) for item in value])
        if isinstance(value, Rows):
            return Rows(changed(value.item, (*inner, value.size)), value.size)
        return parts_of(value, lambda part: change(part, inner) if np.ndim(part) > len(inner) else part)

    found = changed(rows, ())
    assert isinstance(found, Rows)
    return found


def _agree(name: str, count: int, size: Type, sizes: Sizes) -> None:
    """Raise PottoError if a size that is known, or that another argument has fixed, is another."""
    found, offset = resolve(size), 0
    if isinstance(found, Shifted):
        offset, found = found.offset, resolve(found.base)
    if isinstance(found, Count) and found.number != count:
        raise wrong_call(f"`{name}` has {found.number} elements, and is given {count}")
    if isinstance(found, SizeVar):
        other, known = sizes.setdefault(found.name, (name, count - offset))
        if known != count - offset and other == name:
            raise wrong_call(f"`{name}` has parts of one size, but is given {known + offset} and {count} elements")
        if known != count - offset:
            raise wrong_call(f"`{name}` has {known + offset} elements, as `{other}` says, and is given {count}")


def evenly(lo: float, hi: float, count: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    """So many numbers at equal distances, both ends included."""
    return np.linspace(lo, hi, count)
