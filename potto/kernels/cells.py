"""What kernels compute with: batches of numbers that carry errors and tangents.

Owns `Cell`. A cell is a number for every point of a batch, with an absolute error bound and one tangent per direction
of differentiation, each again with an error bound. A missing part (None) is exactly zero. Values of a program are
cells, tuples, arrays (`rows`) and lists of values, and functions (anything with the methods of `FunctionLike`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, Protocol, Union

import numpy as np

from potto.kernels.errors import not_a_number, wrong_call
from potto.kernels.tape import Node

if TYPE_CHECKING:
    from potto.core.terms import Lam

if TYPE_CHECKING:
    import numpy.typing as npt

    Array = npt.NDArray[np.float64]
    Ints = npt.NDArray[np.int64]
    Bools = npt.NDArray[np.bool_]
else:  # numpy's typing module takes longer to import than any of ours
    Array = Ints = Bools = np.ndarray

Number = float | Array
WIDE = frozenset((np.ndarray, Node))  # what has a shape: tangents that are written on a tape stand for arrays
Mask = bool | Bools
# A trace: for a branching site of a kernel a mask (forced) or the trace of a callee; sites not named go as they fall.
Trace = dict[int, Any]
Pattern = Any
Part = Any  # of a cell: a number, an array, or a node of a tape


class Cell:
    """A number per point: `v` value, `e` absolute error, `t` tangents, `et` their absolute errors.

    `v` is a float (the same at every point) or an array; the parts broadcast against each other.
    """

    __slots__ = ("e", "et", "t", "v")

    def __init__(
        self,
        v: Number,
        e: Number | None = None,
        t: tuple[Number | None, ...] = (),
        et: tuple[Number | None, ...] = (),
    ) -> None:
        self.v = v
        self.e = e
        self.t = t
        self.et = et if et else (None,) * len(t)

    def __repr__(self) -> str:
        return f"Cell(v={self.v!r}, e={self.e!r}, t={self.t!r}, et={self.et!r})"

    def map(self, change: Callable[[Array], Number]) -> Cell:
        """The cell with `change` done to every part that is an array."""
        v = change(self.v) if isinstance(self.v, np.ndarray) else self.v
        e = change(self.e) if isinstance(self.e, np.ndarray) else self.e
        return Cell(v, e, _mapped(self.t, change), _mapped(self.et, change)) if self.t else Cell(v, e)

    def arrays(self) -> list[Array]:
        parts = (self.v, self.e, *self.t, *self.et)
        return [x for x in parts if x is not None and type(x) in WIDE]  # type: ignore[misc]


def _mapped(side: Sequence[Number | None], change: Callable[[Array], Number]) -> tuple[Number | None, ...]:
    """Of many tangents most are missing, or plain numbers: with none else they are not gone through one by one."""
    if WIDE.isdisjoint(map(type, side)):
        return tuple(side)
    return tuple([change(x) if type(x) in WIDE else x for x in side])  # type: ignore[arg-type]


class Rows:
    """An array of `size` elements; `item` has their numbers, the places of the elements along the first axis."""

    __slots__ = ("item", "size")

    def __init__(self, item: Value, size: int) -> None:
        self.item, self.size = item, size

    def __repr__(self) -> str:
        return f"Rows({self.item!r}, {self.size})"

    def at(self, place: int) -> Value:
        """One element."""
        return parts_of(self.item, lambda part: part[place] if np.ndim(part) else part)

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


def parts_of(value: Value, change: Callable[[Part], Part]) -> Value:
    """The value with `change` done to every part of its cells."""
    if isinstance(value, Cell):
        t = tuple([None if x is None else change(x) for x in value.t])
        et = tuple([None if x is None else change(x) for x in value.et])
        return Cell(change(value.v), None if value.e is None else change(value.e), t, et)
    if isinstance(value, tuple):
        return tuple([parts_of(item, change) for item in value])
    assert isinstance(value, Rows)
    return Rows(parts_of(value.item, change), value.size)


def _with_depth(value: Value, depth: int) -> list[tuple[Part, int]]:
    """Every part of a value's cells, with how many of its axes are places."""
    if isinstance(value, tuple):
        return [found for item in value for found in _with_depth(item, depth)]
    if isinstance(value, Rows):
        return _with_depth(value.item, depth + 1)
    cell: Any = value
    return [(part, depth) for part in (cell.v, cell.e, *cell.t, *cell.et) if part is not None]


class FunctionLike(Protocol):
    """A function as a value: the term it came from and the values of the term's free variables."""

    lam: Lam
    captured: dict[str, Value]

    def held(self) -> Iterable[Value]: ...

    def pattern(self, directions: int) -> Pattern: ...
    def change(self, how: Callable[[Value], Value]) -> FunctionLike: ...

    def or_other(self, other: Any, mask: Bools) -> FunctionLike:
        """This one for the members of a mask, another for the rest."""
        ...


Value = Union[Cell, "tuple[Value, ...]", "list[Value]", Rows, FunctionLike]
Env = dict[str, Value]  # what the free names of a term stand for


def listed(items: Sequence[Value]) -> Value:
    """An array of elements that were found one by one; a list where they are not of one kind."""
    kinds = {_kind(item) for item in items}
    if len(kinds) != 1 or None in kinds:
        return list(items)
    return Rows(_stacked(items), len(items))


def _kind(value: Value) -> object:
    """What elements must have in common to be one array; None for what is not a number."""
    if isinstance(value, Cell):
        return 0
    if isinstance(value, tuple):
        inner = tuple(map(_kind, value))
        return None if None in inner else inner
    if isinstance(value, Rows):
        return value.size, _kind(value.item)
    return None


def _stacked(items: Sequence[Value], depth: int = 0) -> Value:
    """Elements as one, each part with the places along a new first axis. depth: how many axes are places already."""
    first = items[0]
    if isinstance(first, tuple):
        return tuple([_stacked([item[place] for item in items], depth) for place in range(len(first))])  # type: ignore[index]
    if isinstance(first, Rows):
        return Rows(_stacked([item.item for item in items], depth + 1), first.size)  # type: ignore[union-attr]
    cells: list[Cell] = list(items)  # type: ignore[arg-type]
    k = max(len(cell.t) for cell in cells)
    columns = [(c.v, c.e, *(c.t or (None,) * k), *(c.et or (None,) * k)) for c in cells]
    v, e, *rest = [_column(parts, depth) for parts in zip(*columns, strict=True)]
    assert v is not None
    return Cell(v, e, tuple(rest[:k]), tuple(rest[k:]))


def _column(parts: Sequence[Part | None], depth: int) -> Part | None:
    """What is the same all over a batch has axes of places alone, which must not be taken for those of the batch."""
    if all(part is None for part in parts):
        return None
    full: list[Part] = [0.0 if part is None else part for part in parts]
    if depth:
        most = max(map(np.ndim, full))
        full = [
            x if not 0 < np.ndim(x) < most else np.reshape(x, np.shape(x) + (1,) * (most - np.ndim(x))) for x in full
        ]
    return np.stack(np.broadcast_arrays(*full), axis=0)


def pattern(value: Value, directions: int) -> Pattern:
    """What a kernel is specialized for: which parts of a value are there at all.

    A cell gives (has an error, per direction 0 none, 1 one, 2 any other tangent); structure is mirrored.
    """
    if isinstance(value, Cell):
        if not value.t:  # as most do not move
            return (value.e is not None, (0,) * directions)
        tangents = [0 if x is None else 1 if x.__class__ is float and x == 1.0 else 2 for x in value.t]
        inexact = value.e is not None or bool([True for x in value.et if x is not None])
        return (inexact, tuple(tangents))
    if isinstance(value, tuple):
        return ("tuple", *(pattern(item, directions) for item in value))
    if isinstance(value, Rows):
        cells = all_cells(value)
        inexact = any(c.e is not None or any(x is not None for x in c.et) for c in cells)
        return ("rows", inexact, *(any(c.t and c.t[d] is not None for c in cells) for d in range(directions)))
    if isinstance(value, list):
        return ("list",)
    return ("function", *value.pattern(directions))


def scalar_parts(value: Value, directions: int) -> tuple[Number, ...]:
    """(v, e, t..., et...) of a cell with zeros for what is missing: what generated code unpacks."""
    if not isinstance(value, Cell):
        raise not_a_number(value)
    zero = (0.0,) * directions
    t = tuple(0.0 if x is None else x for x in value.t) or zero
    et = tuple(0.0 if x is None else x for x in value.et) or zero
    return (value.v, 0.0 if value.e is None else value.e, *t, *et)


def map_cells(value: Value, change: Callable[[Cell], Cell]) -> Value:
    """The value with `change` done to every number in it, those that functions have captured as well."""
    if isinstance(value, Cell):
        return change(value)
    if isinstance(value, tuple):
        return tuple([map_cells(item, change) for item in value])
    if isinstance(value, list):
        return [map_cells(item, change) for item in value]
    if isinstance(value, Rows):
        return Rows(map_cells(value.item, change), value.size)
    return value.change(lambda inner: map_cells(inner, change))


def all_cells(value: Value) -> list[Cell]:
    """Every number in a value."""
    if isinstance(value, Cell):
        return [value]
    if isinstance(value, Rows):
        return all_cells(value.item)
    items = value if isinstance(value, tuple | list) else value.held()
    return [cell for item in items for cell in all_cells(item)]


def pad(value: Value, directions: int) -> Value:
    """The value seen with more directions, in which it does not move."""

    def padded(cell: Cell) -> Cell:
        more = (None,) * (directions - len(cell.t))
        return Cell(cell.v, cell.e, cell.t + more, cell.et + more) if more else cell

    return map_cells(value, padded)


def map_arrays(value: Value, change: Callable[[Array], Number]) -> Value:
    """The value with `change` done to every batch in it (a gather, a reshape); an array of Potto is one for each of its
    elements."""
    if isinstance(value, Cell):
        return value.map(change)
    if isinstance(value, tuple):
        return tuple([map_arrays(item, change) for item in value])
    if isinstance(value, list):
        return [map_arrays(item, change) for item in value]
    if isinstance(value, Rows):
        return listed([map_arrays(row, change) for row in value.rows()]) if value.batched else value
    return value.change(lambda inner: map_arrays(inner, change))


def all_arrays(value: Value) -> list[Array]:
    """Every batch in a value."""
    if isinstance(value, Cell):
        return value.arrays()
    if isinstance(value, Rows):
        return value.batches()
    items = value if isinstance(value, tuple | list) else value.held()
    return [a for item in items for a in all_arrays(item)]


def batch_shape(values: Iterable[Value], *others: tuple[int, ...]) -> tuple[int, ...]:
    """The shape of all that is evaluated at once: of every batch in some values, and other shapes."""
    shapes = [*others, *(array.shape for value in values for array in all_arrays(value))]
    return np.broadcast_shapes(*shapes) if shapes else ()


def combined(change: Callable[..., Number], *values: Value) -> Value:
    """Values of one kind as one, part by part: the numbers, their errors, the tangents and theirs.

    A part that only some of them have is 0 for the others, one that none has is not there. Raises PottoError.
    """
    first = values[0]
    cells = [value for value in values if isinstance(value, Cell)]
    if len(cells) == len(values):
        k = max(len(cell.t) for cell in cells)
        none = (None,) * k
        rows = zip(*[(c.v, c.e, *(c.t or none), *(c.et or none)) for c in cells], strict=True)
        v, e, *rest = [
            None if all(x is None for x in row) else change(*[0.0 if x is None else x for x in row]) for row in rows
        ]
        assert v is not None
        return Cell(v, e, tuple(rest[:k]), tuple(rest[k:]))
    if isinstance(first, tuple | list) and all(type(x) is type(first) and len(x) == len(first) for x in values):
        return type(first)([combined(change, *items) for items in zip(*values)])
    arrays = [value for value in values if isinstance(value, Rows)]
    if len(arrays) == len(values) and len({value.size for value in arrays}) == 1:
        return listed([combined(change, *items) for items in zip(*(value.rows() for value in arrays), strict=True)])
    if all(value is first for value in values):
        return first
    raise wrong_call("the members of a batch of points have values of different kinds")


def map_trace(trace: Trace | None, change: Callable[[Array], Any]) -> Trace | None:
    """The trace with `change` done to every mask that is an array."""
    if trace is None:
        return None
    out: Trace = {}
    for at, entry in trace.items():
        if isinstance(entry, dict):
            out[at] = map_trace(entry, change)
        else:
            out[at] = change(entry) if isinstance(entry, np.ndarray) else entry
    return out
