"""Files of data as values while a program runs. Owns `loaded`."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from potto.core.terms import Data
from potto.data.files import digest, read, values_of
from potto.data.mistakes import DataMistake
from potto.data.values import NumberArray, NumberRow, Table
from potto.diagnostics import PottoError
from potto.kernels import errors
from potto.kernels.cells import Cell, Rows, Value
from potto.types.loading import KINDS


def loaded(term: Data) -> Value:
    """What a file holds, or one of its columns. Raises PottoError if it is no longer what was checked."""
    path = Path(term.path)
    content = read(path)
    if isinstance(content, DataMistake):
        raise _wrong(path, content)
    if digest(content) != term.content:
        raise errors.wrong_call(f"{path.name} has changed while the program ran", "evaluate again")
    found = values_of(path, content)
    if isinstance(found, DataMistake):
        raise _wrong(path, found)
    if isinstance(found, Table) and term.column:
        found = found[term.column]
    if isinstance(found, NumberArray):
        return _rows(found)
    assert isinstance(found, float)
    return Cell(found)


def _wrong(path: Path, mistake: DataMistake) -> PottoError:
    """What only a file's values show: their heads are what is checked."""
    return PottoError([KINDS[mistake.code](errors.NOWHERE, f"{path.name}: {mistake.message}", help=mistake.hint)])


def _rows(array: NumberArray) -> Value:
    numbers = np.asarray(array.values)
    item: Value = Cell(np.ascontiguousarray(numbers))
    if isinstance(array.item, NumberRow):
        item = tuple(Cell(np.ascontiguousarray(numbers[..., place])) for place in range(array.item.length))
    for size in reversed(array.dimensions):
        item = Rows(item, size)
    return item
