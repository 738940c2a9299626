"""Files for the tests: their values and mistakes by name and content, as nested plain Python."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from potto.data import Array, DataMistake, Table, shape, shape_of, values_of


def plain(name: str, content: bytes | str) -> Any:
    """The value of a file as numbers, nested lists and dictionaries; its shape is held against what is said first."""
    content = content.encode() if isinstance(content, str) else content
    told = shape_of(Path(name), content)
    value = values_of(Path(name), content)
    assert not isinstance(value, DataMistake), value
    assert shape(value) == told
    if isinstance(value, Table):
        return {key: field.values.tolist() if isinstance(field, Array) else field for key, field in value.fields}
    if isinstance(value, Array):
        assert value.values.dtype == "float64" and not value.values.flags.writeable and value.values.shape == value.full
    return value.values.tolist() if isinstance(value, Array) else value


def mistake(name: str, content: bytes | str) -> DataMistake:
    """What is wrong with the values of a file."""
    found = values_of(Path(name), content.encode() if isinstance(content, str) else content)
    assert isinstance(found, DataMistake), found
    return found
