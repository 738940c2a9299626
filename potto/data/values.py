"""What files of data hold: shapes, which checking asks for, and values, which evaluation asks for.

Owns both and the way from a value to its shape. The numbers of an array lie in a row, the last index running fastest,
in an `array` of the standard library or in one of numpy: only who asks for `NumberArray.values` loads numpy.
"""

from __future__ import annotations

from functools import cached_property
from math import prod
from typing import TYPE_CHECKING, Any

from msgspec import Struct

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

DEEPEST = 32  # dimensions, as every version of numpy takes them


class RealNumber(Struct, frozen=True):
    """A real number."""


class NumberRow(Struct, frozen=True):
    """So many real numbers, such as the red, green and blue of a colour."""

    length: int


Item = RealNumber | NumberRow


class Sizes(Struct, frozen=True):
    """An array: how long it is in each direction, and what it is of."""

    dimensions: tuple[int, ...]
    item: Item = RealNumber()


class RecordColumns(Struct, frozen=True):
    """A record: names, which are identifiers and differ, and what stands under them. texts: the names of columns that
    were left out, since no value in them is a number; gaps: of those that were since they lack values, each with the
    first line of the file that has none."""

    fields: tuple[tuple[str, Shape], ...]
    texts: tuple[str, ...] = ()
    gaps: tuple[tuple[str, int], ...] = ()


Shape = RealNumber | Sizes | RecordColumns
SEPARATOR = "."  # between the names of records within records


class NumberArray(Struct, frozen=True, eq=False, dict=True):
    """Numbers, or rows of numbers, in the order in which the last index runs fastest."""

    dimensions: tuple[int, ...]
    item: Item
    numbers: Any  # whatever shows its bytes as doubles

    @cached_property
    def values(self) -> npt.NDArray[np.float64]:
        """The numbers as an array of numpy that nobody can write to; rows are along one axis more, the last one."""
        import numpy as np

        found = np.frombuffer(self.numbers, dtype=np.float64).reshape(self.full)
        found.flags.writeable = False
        return found

    @property
    def full(self) -> tuple[int, ...]:
        """The shape of `values`."""
        return self.dimensions if isinstance(self.item, RealNumber) else (*self.dimensions, self.item.length)

    @property
    def size(self) -> int:
        """How many numbers there are."""
        return prod(self.full)


class Table(Struct, frozen=True, eq=False):
    """A record of arrays, numbers and records, in the order of the file. texts, gaps: as in `RecordColumns`."""

    fields: tuple[tuple[str, Value], ...]
    texts: tuple[str, ...] = ()
    gaps: tuple[tuple[str, int], ...] = ()

    def __getitem__(self, path: str) -> Value:
        """What stands under a name; under `camera.focal`, in the record that stands under `camera`."""
        name, _, rest = path.partition(SEPARATOR)
        found = dict(self.fields)[name]
        return found[rest] if rest and isinstance(found, Table) else found


Value = float | NumberArray | Table


def shape(value: Value) -> Shape:
    """The shape of a value."""
    if isinstance(value, Table):
        return RecordColumns(tuple((name, shape(field)) for name, field in value.fields), value.texts, value.gaps)
    return Sizes(value.dimensions, value.item) if isinstance(value, NumberArray) else RealNumber()


def size(value: Value) -> int:
    """How many numbers a value is made of."""
    if isinstance(value, Table):
        return sum(size(field) for _, field in value.fields)
    return value.size if isinstance(value, NumberArray) else 1
