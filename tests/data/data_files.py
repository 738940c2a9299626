"""Files for the tests: their values and mistakes by name and content, as nested plain Python."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from potto.data import DataMistake, NumberArray, Table, shape, shape_of, values_of
from potto.data.mistakes import NO_PACKAGE
from potto.data.values import Value


def plain(name: str, content: bytes | str) -> Any:
    """The value of a file as numbers, nested lists and dictionaries; its shape is held against what is said first."""
    content = content.encode() if isinstance(content, str) else content
    told = shape_of(Path(name), content)
    value = values_of(Path(name), content)
    assert not isinstance(value, DataMistake), value
    assert shape(value) == told
    return _plain(value)


def _plain(value: Value) -> Any:
    if isinstance(value, Table):
        return {key: _plain(field) for key, field in value.fields}
    if isinstance(value, NumberArray):
        assert value.values.dtype == "float64" and not value.values.flags.writeable and value.values.shape == value.full
    return value.values.tolist() if isinstance(value, NumberArray) else value


def mistake(name: str, content: bytes | str) -> DataMistake:
    """What is wrong with the values of a file, which is told with its shape."""
    content = content.encode() if isinstance(content, str) else content
    found = values_of(Path(name), content)
    assert isinstance(found, DataMistake), found
    assert found.code == NO_PACKAGE or shape_of(Path(name), content) == found
    return found
