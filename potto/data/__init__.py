"""Files of data as values: tables, arrays, nested lists, pictures.

`files.shape_of(path, content)` says what kind of value a file holds, without numpy, for whoever checks programs;
`files.values_of(path, content)` is the value; `files.read(path)` gives the content. Each of them answers with a
`DataMistake` where something is wrong. `display.summary` and `display.thumbnail` show a value. Knows nothing of syntax,
types and terms. What is asked of the package itself is imported when it is: a program without data costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_HOMES = {
    "display": ("summary", "thumbnail"),
    "files": ("SUFFIXES", "digest", "read", "shape_of", "suggest", "values_of"),
    "mistakes": ("TITLES", "DataMistake"),
    "values": (
        "Item",
        "NumberArray",
        "NumberRow",
        "RealNumber",
        "RecordColumns",
        "Shape",
        "Sizes",
        "Table",
        "Value",
        "shape",
    ),
}
_HOME = {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(name)
    return getattr(import_module(f"potto.data.{_HOME[name]}"), name)
