"""The project file `potto.toml` in a folder of the workspace: roots of modules and how lints count.

    roots = ["src"]          # folders in which modules are looked for, beside the importing file's own

    [lints]
    P0620 = "off"            # or "hint", "info", "warning", "error"

Owns reading it, and what is wrong with it as sentences.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

NAME = "potto.toml"
LEVELS = ("off", "hint", "info", "warning", "error")


@dataclass(frozen=True, slots=True)
class Project:
    """One folder of the workspace. `problems` are pairs of a line (from 0) and a sentence."""

    folder: str
    roots: tuple[str, ...]
    lints: Mapping[str, str] = field(default_factory=dict)
    problems: tuple[tuple[int, str], ...] = ()


def read_project(folder: str) -> Project:
    """The project of a folder; one without a project file has itself for a root."""
    path = os.path.join(folder, NAME)
    try:
        with open(path, "rb") as file:
            data = file.read()
    except (FileNotFoundError, NotADirectoryError):
        return Project(folder, (folder,))
    except OSError as error:
        return Project(folder, (folder,), problems=((0, f"cannot be read: {error.strerror}"),))
    return _parsed(folder, data)


def _parsed(folder: str, data: bytes) -> Project:
    import tomllib

    try:
        table = tomllib.loads(data.decode("utf-8"))
    except UnicodeDecodeError:
        return Project(folder, (folder,), problems=((0, "this is not a text in UTF-8"),))
    except tomllib.TOMLDecodeError as error:
        return Project(folder, (folder,), problems=((_line(str(error)), str(error)),))
    problems: list[str] = []
    roots = _roots(folder, table.get("roots", []), problems)
    lints = levels(table.get("lints", {}), problems)
    problems += [f"there is no setting `{name}`: known are `roots` and `lints`" for name in _unknown(table)]
    return Project(folder, roots, lints, tuple((0, problem) for problem in problems))


def _unknown(table: Mapping[str, Any]) -> list[str]:
    return [name for name in table if name not in ("roots", "lints")]


def _line(message: str) -> int:
    """The line that the TOML parser names in its message."""
    _, _, after = message.partition("at line ")
    digits = after.split(",")[0].split(")")[0]
    return max(int(digits) - 1, 0) if digits.isdigit() else 0


def _roots(folder: str, written: Any, problems: list[str]) -> tuple[str, ...]:
    if not isinstance(written, list) or not all(isinstance(root, str) for root in written):
        problems.append('`roots` is a list of folders, such as ["src"]')
        return (folder,)
    found = [os.path.abspath(os.path.join(folder, root)) for root in written]
    missing = [root for root, path in zip(written, found) if not os.path.isdir(path)]
    problems += [f"`roots`: there is no folder `{root}`" for root in missing]
    return tuple(dict.fromkeys([*found, folder]))


def levels(written: Any, problems: list[str]) -> dict[str, str]:
    """A table of codes and levels; what is wrong with it goes to `problems`."""
    if not isinstance(written, Mapping):
        problems.append("`lints` is a table of codes and levels")
        return {}
    found = {}
    for code, level in written.items():
        if level in LEVELS:
            found[str(code)] = str(level)
        else:
            problems.append(f"`lints`: the level of {code} is one of {', '.join(LEVELS)}")
    return found
