"""Fitting: the parameters that make a function of Potto least, or bring it to a target, found along its derivatives.

Owns `fit`. How a minimum is walked to is the business of `minimizing` and `descending`, which know no Potto; how far a
fit has come is kept on disk by `checkpoints`.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from msgspec.structs import replace

from potto.applications.checkpoints import keeping, kept
from potto.applications.minimization import Iterate, Seen
from potto.applications.minimizing import METHODS, MOST_STEPS, Fit, minimized
from potto.kernels.cells import Array
from potto.kernels.errors import wrong_call
from potto.python.functions import Function
from potto.python.gradients import grad
from potto.runtime.answers.estimate import Estimate
from potto.runtime.answers.records import has_records
from potto.types.types import ArrayOf, TupleOf, Type

Path = tuple[str | int, ...]
"""The name of a parameter and, where that is a record, those of fields; of an array of records, which one."""


def fit(
    function: Function,
    start: Mapping[str, Any],
    *,
    given: Mapping[str, Any] | None = None,
    bounds: Mapping[str, tuple[float | None, float | None]] | None = None,
    target: Any = None,
    steps: int = MOST_STEPS,
    progress: Callable[[Iterate], None] | None = None,
    watch: Callable[[Estimate], object] | None = None,
    method: str = METHODS[0],
    checkpoint: str | None = None,
) -> Fit:
    """Make a function least over the parameters named in `start`, from there on: numbers, arrays, or records as
    dicts, arrays of records as lists of these.

    given: the other parameters; arrays among them make the function an array. bounds: the least and the most that a
    parameter, or each element of one, may be; None where there is no limit. A start beyond them is moved there.
    target: where the function should come to instead of being least: then what is made least is the mean of the squared
    distances; numbers, tuples and arrays as the function's answer has them. progress: is told every step;
    watch: is given every answer of the function. method: "lbfgs", "gauss-newton" (Levenberg-Marquardt; for a target) or
    "adam". checkpoint: a file that is written after every step; where it exists, the fit goes on from what it holds.

    Raises PottoError if the arguments do not fit the function or it has no value at the start.
    """
    given, names = dict(given or {}), tuple(start)
    _must_be_known(names, bounds or {}, method, target)
    gradient = grad(function, names)
    begun = _starts(start)

    def objective(x: Array) -> Seen:
        answer = gradient(**_named(begun, x), **given)
        if watch is not None:
            watch(answer)
        return _seen(answer, names, {path: np.ndim(value) for path, value in begun.items()}, target)

    sides: dict[str | int, tuple[float, float]] = {name: _sides(name, (bounds or {}).get(name)) for name in names}
    limits = [sides[path[0]] for path, value in begun.items() for _ in _labels(value)]
    numbers = numbers_of(start)
    if not numbers:
        raise wrong_call("the arrays to fit have no elements")
    if checkpoint is not None:
        numbers, progress = kept(checkpoint, numbers), keeping(checkpoint, tuple(numbers), progress)
    found = minimized(objective, numbers, limits, steps, progress, method)
    return replace(found, parameters=_named(begun, np.array(list(found.numbers.values()))))


def _must_be_known(names: tuple[str, ...], bounds: Mapping[str, Any], method: str, target: Any) -> None:
    """Raise PottoError where a fit is asked for that there is not."""
    if method not in METHODS:
        raise wrong_call(f"there is no method `{method}` to fit by", "the methods are " + ", ".join(METHODS))
    if method == "gauss-newton" and target is None:
        raise wrong_call("Gauss-Newton makes squared distances small, and no target is given", "give a target")
    if not names:
        raise wrong_call("no parameter is named to fit")
    for name in bounds:
        if name not in names:
            near = difflib.get_close_matches(name, names, 1)
            hint = f"did you mean `{near[0]}`?" if near else ""
            raise wrong_call(f"a bound is given for `{name}`, which is not fitted", hint)


def numbers_of(start: Mapping[str, Any]) -> dict[str, float]:
    """The numbers that parameters are made of, by name, such as `ws[0]` and `camera.focal`."""
    return {
        f"{_written(path)}{label}": float(number)
        for path, value in _starts(start).items()
        for label, number in zip(_labels(value), np.ravel(value), strict=True)
    }


def by_fields(value: Any, type: Type) -> Any:
    """Records, which are tuples as values, as dicts of their fields, also those in arrays and in tuples."""
    if not has_records(type):
        return value
    if isinstance(type, ArrayOf):
        return [by_fields(item, type.item) for item in value]
    if not isinstance(type, TupleOf) or type.record is None:
        return tuple(map(by_fields, value, type.items)) if isinstance(type, TupleOf) else value
    return {name: by_fields(v, t) for name, v, t in zip(type.record.fields, value, type.items, strict=True)}


def _starts(start: Mapping[str, Any]) -> dict[Path, Any]:
    return {path: _begun(_written(path), value) for path, value in _leaves(start)}


def _written(path: Path) -> str:
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path).removeprefix(".")


def _leaves(start: Any, path: Path = ()) -> Iterator[tuple[Path, Any]]:
    """What parameters start at, with the way there: of a record field by field, of an array of these one by one."""
    parts: Iterable[tuple[str | int, Any]] = ()
    if isinstance(start, Mapping):
        parts = start.items()
    elif isinstance(start, list) and any(isinstance(item, Mapping) for item in start):
        parts = enumerate(start)
    else:
        yield path, start
    for part, value in parts:
        yield from _leaves(value, (*path, part))


def _begun(name: str, value: Any) -> Any:
    try:
        found = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise wrong_call(f"`{name}` starts at a Python {type(value).__name__}, not at numbers") from None
    return found if found.ndim else float(found)


def _sides(name: str, bound: Any) -> tuple[float, float]:
    """The limits of a parameter; infinite where there are none."""
    try:
        low, high = (None, None) if bound is None else bound
        found = -math.inf if low is None else float(low), math.inf if high is None else float(high)
    except (TypeError, ValueError):
        found = (math.nan, math.nan)
    if not found[0] <= found[1]:
        help = "give the least and the most that it may be, such as (0, 1); None where there is no limit"
        raise wrong_call(f"the bounds of `{name}` are {bound!r}, and no number lies between these", help)
    return found


def _labels(value: Any) -> list[str]:
    """What is behind a parameter's name for each of its numbers."""
    return [f"[{', '.join(map(str, place))}]" if place else "" for place in np.ndindex(np.shape(value))]


def _named(begun: Mapping[Path, Any], x: Array) -> dict[str, Any]:
    """Numbers in a row as parameters, in the form in which they began."""
    found: dict[Any, Any] = {}
    at = 0
    for path, value in begun.items():
        size, inner = np.size(value), found
        for part in path[:-1]:
            inner = inner.setdefault(part, {})
        inner[path[-1]] = x[at : at + size].reshape(np.shape(value)) if np.ndim(value) else float(x[at])
        at += size
    return {name: _in_lists(value) for name, value in found.items()}


def _in_lists(value: Any) -> Any:
    """What is known by places as a list."""
    if not isinstance(value, dict):
        return value
    parts = {part: _in_lists(inner) for part, inner in value.items()}
    return [parts[place] for place in range(len(parts))] if 0 in parts else parts


def _seen(found: Any, names: Sequence[str], axes: Mapping[Path, int], target: Any) -> Seen:
    """What is to be least: the function itself, or the mean of its squared distances to the target.

    axes: how many each part of the parameters has.
    """

    def rows(side: Any) -> list[Array]:
        whole = dict(zip(names, side if len(names) > 1 else (side,), strict=True))
        return [_by_numbers(_at(whole, path), found, count) for path, count in axes.items()]

    sides = (rows(side) for side in (found.tangent, found.tangent_error))
    value, bound = _flat(found.value), _flat(found.error)
    joined = (np.concatenate(parts) for parts in sides)
    tangents, errors = (np.broadcast_to(side, (len(side), value.size)) for side in joined)
    if target is None:
        if value.size != 1:
            raise wrong_call(
                f"the function gives {value.size} numbers, and only one number can be least",
                "say which numbers they should be: give a target",
            )
        return Seen(float(value[0]), tangents[:, 0], float(np.max(errors, initial=0.0)), float(bound[0]))
    wanted = _flat(target)
    if wanted.size not in (1, value.size):
        raise wrong_call(f"the target has {wanted.size} numbers, the function's answer {value.size}")
    off = value - wanted
    value_error = float(np.mean((2 * np.abs(off) + bound) * bound))
    slopes = 2 * np.mean(off * tangents, axis=1)
    slope_errors = 2 * np.mean(np.abs(off) * errors, axis=1)
    return Seen(float(np.mean(off**2)), slopes, float(np.max(slope_errors, initial=0.0)), value_error, off, tangents.T)


def _at(whole: Any, path: Path) -> Any:
    """What stands at the end of a way."""
    for part in path:
        whole = whole[part]
    return whole


def _by_numbers(slopes: Any, found: Any, axes: int) -> Array:
    """Derivatives by a parameter as rows, one for each of its numbers.

    Those by an array have the axes of the batch, of the array, and of the answer; parts of a tuple are the last one.
    """
    if not axes:
        return _flat(slopes)[None]
    batch = np.ndim(found.member_converged) if found.member_converged is not None else 0
    whole = np.moveaxis(np.asarray(slopes), range(batch, batch + axes), range(axes))
    if isinstance(found.value, tuple):
        whole = np.moveaxis(whole, -1, axes)
    return whole.reshape(int(np.prod(whole.shape[:axes])), -1)


def _flat(value: Any) -> Array:
    """The numbers of an answer, one after the other."""
    if isinstance(value, tuple | list):
        parts = [_flat(item) for item in value]
        width = max((part.size for part in parts), default=0)
        return np.concatenate([np.broadcast_to(part, (width,)) if part.size == 1 else part for part in parts])
    if value is None:
        raise wrong_call("the function gives a function, and only numbers can be least")
    return np.asarray(value, dtype=float).reshape(-1)


def column(numbers: Sequence[float]) -> Array:
    """Numbers as an array, as `fit` takes those of a table."""
    return np.array(numbers, dtype=float)
