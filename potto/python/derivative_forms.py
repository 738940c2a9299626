"""Derivatives in the form that was asked for: that of the parameters, of the answer, or a matrix.

Owns `by_name`, `as_matrix`, `must_match`, `weighted`, `in_lists` and `form_of`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any, cast

import numpy as np

from potto.kernels.cells import Cell, Number, Rows, Value, all_cells, map_cells
from potto.kernels.errors import wrong_call
from potto.python.arguments import Batch
from potto.runtime.answers.named import alike
from potto.runtime.evaluate import number, told_rows


def form_of(value: Value) -> str:
    if isinstance(value, Rows | list):
        return f"an array of {value.size if isinstance(value, Rows) else len(value)}"
    return f"a tuple of {len(value)}" if isinstance(value, tuple) else "a number"


def in_lists(value: Value) -> Value:
    """A value with its arrays as lists of their elements."""
    if isinstance(value, tuple | list):
        return type(value)([in_lists(item) for item in value])
    return [in_lists(row) for row in value.rows()] if isinstance(value, Rows) else value


def tangents_of(cell: Cell) -> tuple[Number | None, ...]:
    return cell.t


def bounds_of(cell: Cell) -> tuple[Number | None, ...]:
    return cell.et


def by_name(numbers: list[Any], given: dict[str, Value], whole: bool) -> tuple[Any, ...]:
    """The derivatives in the form of the parameters; `whole`: those by all elements of an array are one array."""
    rest = iter(numbers)
    return tuple(_formed(value, rest, whole) for value in given.values())


def _formed(value: Value, rest: Iterator[Any], whole: bool) -> Any:
    """The next derivatives in the form of one parameter. (Within `by_name` it would hold itself, and so the derivatives
    of a batch, until Python looks for such things.)"""
    if isinstance(value, tuple):
        return tuple(_formed(item, rest, whole) for item in value)
    if not isinstance(value, Rows):
        return next(rest)
    if not whole:
        return [_formed(row, rest, whole) for row in value.rows()]
    return _by_elements(value, [next(rest) for _ in all_cells(value)])


def _by_elements(value: Rows, slopes: list[Any]) -> list[Any]:
    """Derivatives by the numbers of all elements, in the form of the answer, as a list of those by each element."""
    first = slopes[0]
    if isinstance(first, tuple | list):
        parts = [_by_elements(value, [slope[place] for slope in slopes]) for place in range(len(first))]
        return cast("list[Any]", _together(value, partial(_like, first), parts))
    rest = iter(slopes)
    return told_rows(cast(Rows, map_cells(value, lambda _: Cell(next(rest)))), lambda cell: cell.v)


def _like(whole: Any, parts: Sequence[Any]) -> Any:
    return alike(whole, parts) if isinstance(whole, tuple) else list(parts)


def _together(value: Value, kind: Callable[[Any], Any], parts: Sequence[Any]) -> Any:
    """What is by parts of the answer and then by elements, the other way round."""
    if isinstance(value, Rows):
        return [_together(value.item, kind, [part[place] for part in parts]) for place in range(value.size)]
    if isinstance(value, tuple):
        return tuple(_together(item, kind, [part[place] for part in parts]) for place, item in enumerate(value))
    return kind(parts)


def as_matrix(rows: Any, count: int, batch: Batch, one_answer: bool, one_parameter: bool) -> Any:
    """Rows of `count` numbers, or of arrays over a batch, as an array whose last axes are those of the rows."""
    whole = np.asarray(rows, dtype=float).reshape((len(rows), count, *(batch.shape or ())))
    whole = np.moveaxis(whole, (0, 1), (-2, -1))
    if one_parameter:
        whole = whole[..., 0]
    if one_answer:
        whole = whole[..., 0] if one_parameter else whole[..., 0, :]
    return whole if whole.ndim else float(whole)


def must_match(value: Value, cotangent: Value) -> None:
    """Raise PottoError if a cotangent has not the form of the answer."""
    if isinstance(value, tuple):
        if not isinstance(cotangent, tuple) or len(cotangent) != len(value):
            wanted, found = form_of(value), form_of(cotangent)
            raise wrong_call(f"the cotangent must have the form of the answer, {wanted}, and is {found}")
        for pair in zip(value, cotangent, strict=True):
            must_match(*pair)
    elif isinstance(value, list):
        if not isinstance(cotangent, list) or len(cotangent) != len(value):
            wanted, found = form_of(value), form_of(cotangent)
            raise wrong_call(f"the cotangent must have the form of the answer, {wanted}, and is {found}")
        for pair in zip(value, cotangent, strict=True):
            must_match(*pair)
    elif not isinstance(cotangent, Cell):
        raise wrong_call(f"the cotangent must have the form of the answer, a number, and is {form_of(cotangent)}")


def weighted(value: Value, weights: Value) -> Value:
    """The sum of the numbers of an answer, each times its weight: its tangents."""
    cells, factors = all_cells(value), [weight.v for weight in all_cells(weights)]

    def total(side: Callable[[Cell], tuple[Number | None, ...]], factors: list[Any]) -> tuple[Number, ...]:
        rows = zip(*map(side, cells), strict=True)
        return tuple(sum((w * number(x) for w, x in zip(factors, row, strict=True)), start=0.0) for row in rows)

    return Cell(0.0, None, total(tangents_of, factors), total(bounds_of, [np.abs(w) for w in factors]))
