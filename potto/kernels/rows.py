"""Arrays as values: the numbers of all elements together, the places of the elements along the first axis.

Owns `Rows`, `listed` and `gathered`. A part of a cell in an array of n is a number (the same for all elements), or of
shape (n,) where it is the same for all members of a batch, else (n, *batch); in an array of arrays (n, m, *batch).
Arrays of functions, or of arrays of different lengths, are Python lists.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from potto.kernels.tape import Node, Untaped

if TYPE_CHECKING:
    from potto.kernels.cells import Cell, Ints, Value

Part = Any  # a number, an array, or a node of a tape


class Rows:
    """An array of `size` elements; `item` has their numbers, the places of the elements along the first axis."""

    __slots__ = ("item", "size")

    def __init__(self, item: Value, size: int) -> None:
        self.item, self.size = item, size

    def __repr__(self) -> str:
        return f"Rows({self.item!r}, {self.size})"

    def at(self, place: int) -> Value:
        """One element."""
        return _parts(self.item, lambda part: part[place] if np.ndim(part) else part)

    def rows(self) -> list[Value]:
        return [self.at(place) for place in range(self.size)]

    @property
    def batched(self) -> bool:
        """Whether elements differ over a batch."""
        return any(np.ndim(part) > depth for part, depth in _with_depth(self.item, 1))

    def batches(self) -> list[Part]:
        """For each part that differs over a batch, its first element."""
        found = []
        for part, depth in _with_depth(self.item, 1):
            if np.ndim(part) > depth:
                for _ in range(depth):
                    part = part[0] if part.shape[0] else np.zeros(part.shape[1:])
                found.append(part)
        return found


def _parts(value: Value, change: Callable[[Part], Part]) -> Value:
    """The value with `change` done to every part of its cells."""
    from potto.kernels.cells import Cell

    if isinstance(value, Cell):
        t = tuple([None if x is None else change(x) for x in value.t])
        et = tuple([None if x is None else change(x) for x in value.et])
        return Cell(change(value.v), None if value.e is None else change(value.e), t, et)
    if isinstance(value, tuple):
        return tuple([_parts(item, change) for item in value])
    assert isinstance(value, Rows)
    return Rows(_parts(value.item, change), value.size)


def _with_depth(value: Value, depth: int) -> list[tuple[Part, int]]:
    """Every part of a value's cells, with how many of its axes are places."""
    if isinstance(value, tuple):
        return [found for item in value for found in _with_depth(item, depth)]
    if isinstance(value, Rows):
        return _with_depth(value.item, depth + 1)
    cell: Any = value
    return [(part, depth) for part in (cell.v, cell.e, *cell.t, *cell.et) if part is not None]


def changed(rows: Rows, change: Callable[[Part, int], Part]) -> Rows:
    """The array with `change` done to every part, which is told how many of its axes are places."""
    return Rows(_deep(rows.item, 1, change), rows.size)


def _deep(value: Value, depth: int, change: Callable[[Part, int], Part]) -> Value:
    if isinstance(value, Rows):
        return Rows(_deep(value.item, depth + 1, change), value.size)
    if isinstance(value, tuple):
        return tuple([_deep(item, depth, change) for item in value])
    return _parts(value, lambda part: change(part, depth))


def listed(items: Sequence[Value]) -> Value:
    """An array of elements that were found one by one; a list where they are not of one kind."""
    kinds = {_kind(item) for item in items}
    if len(kinds) != 1 or None in kinds:
        return list(items)
    return Rows(_stacked(items), len(items))


def _kind(value: Value) -> object:
    """What elements must have in common to be one array; None for what is no number."""
    from potto.kernels.cells import Cell

    if isinstance(value, Cell):
        return 0
    if isinstance(value, tuple):
        inner = tuple(map(_kind, value))
        return None if None in inner else inner
    if isinstance(value, Rows):
        return value.size, _kind(value.item)
    return None


def _stacked(items: Sequence[Value]) -> Value:
    from potto.kernels.cells import Cell

    first = items[0]
    if isinstance(first, tuple):
        return tuple([_stacked([item[place] for item in items]) for place in range(len(first))])  # type: ignore[index]
    if isinstance(first, Rows):
        return Rows(_stacked([item.item for item in items]), first.size)  # type: ignore[union-attr]
    cells: list[Cell] = list(items)  # type: ignore[arg-type]
    k = max(len(cell.t) for cell in cells)
    columns = [(c.v, c.e, *(c.t or (None,) * k), *(c.et or (None,) * k)) for c in cells]
    v, e, *rest = [_column(parts) for parts in zip(*columns, strict=True)]
    assert v is not None
    return Cell(v, e, tuple(rest[:k]), tuple(rest[k:]))


def _column(parts: Sequence[Part | None]) -> Part | None:
    if all(part is None for part in parts):
        return None
    return np.stack(np.broadcast_arrays(*[0.0 if part is None else part for part in parts]), axis=0)


# Elements at places


def gathered(rows: Rows, places: Ints) -> Value:
    """The elements at places (whole numbers within the array, of any shape, along batches)."""
    return _gathered(rows.item, places, 0)


def _gathered(value: Value, places: Ints, inner: int) -> Value:
    if isinstance(value, tuple):
        return tuple([_gathered(item, places, inner) for item in value])
    if isinstance(value, Rows):
        return Rows(_gathered(value.item, places, inner + 1), value.size)
    return _parts(value, lambda part: _taken(part, places, inner))


def _taken(part: Part, places: Ints, inner: int) -> Part:
    """The rows of a part at places; `inner` axes of places of inner arrays stay in front."""
    if not np.ndim(part):
        return part
    if part.ndim == inner + 1:
        found = part[places]
        if not inner or not places.ndim:
            return float(found) if not np.ndim(found) and not isinstance(found, Node) else found
        return np.moveaxis(found, range(places.ndim, places.ndim + inner), range(inner))
    batch = part.shape[inner + 1 :]
    shape = np.broadcast_shapes(places.shape, batch)
    if not isinstance(part, Node):
        part = np.moveaxis(part, 0, inner)
        own = part.shape[:inner]
        pad = (1,) * (len(shape) - len(batch))
        wide = np.broadcast_to(part.reshape(*own, part.shape[inner], *pad, *batch), (*own, part.shape[inner], *shape))
        at = np.broadcast_to(places, shape).reshape((1,) * inner + (1, *shape))
        return np.take_along_axis(wide, np.broadcast_to(at, (*own, 1, *shape)), axis=inner).reshape(*own, *shape)
    if inner:
        raise Untaped
    return part[(places, *np.indices(batch, sparse=True))]
