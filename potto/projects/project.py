"""The project file `potto.toml`: roots of modules, how lints count, and how numbers are asked for.

    roots = ["src"]          # folders in which modules are looked for, beside the importing file's own

    [lints]
    P0620 = "off"            # or "hint", "info", "warning", "error"

    [settings]
    rtol = 1e-6              # or method, atol, samples, seed, max_evals, backend

The project of a file is told by the nearest such file in its folder and above. Owns finding and reading it, and what
is wrong with it as sentences; the command line, the prompt, Python and the editor all ask here.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from msgspec import Struct
from msgspec.structs import replace

from potto.diagnostics import Severity, declare
from potto.projects.settings import DEFAULTS, Settings, problem
from potto.reports.render import Located
from potto.source import Span

NAME = "potto.toml"
LEVELS = ("off", "hint", "info", "warning", "error")
KEYS = ("roots", "lints", "settings")
BAD_PROJECT = declare("P0231", "a project file that says what is not understood")

_SEVERITIES: Mapping[str, Severity] = {"error": "error", "warning": "warning", "info": "info", "hint": "hint"}


class Project(Struct, frozen=True):
    """A folder with a project file, or one that is a root by itself. `problems` are pairs of a line (from 0) and a
    sentence."""

    folder: str
    roots: tuple[str, ...]
    lints: Mapping[str, str] = {}
    settings: Settings = DEFAULTS
    problems: tuple[tuple[int, str], ...] = ()

    @property
    def path(self) -> str:
        return os.path.join(self.folder, NAME)


class Projects:
    """The projects of files; each project file is read once, until `forget`."""

    def __init__(self) -> None:
        self._known: dict[str, Project | None] = {}

    def of(self, path: str) -> Project | None:
        """The project of a file or folder; None if there is no project file in its folder or above."""
        if not os.path.isabs(path):
            return None
        above: list[str] = []
        at, found = path, None
        while at not in self._known:
            above.append(at)
            if os.path.isfile(os.path.join(at, NAME)):
                found = read_project(at)
                break
            parent = os.path.dirname(at)
            if parent == at:
                break
            at = parent
        else:
            found = self._known[at]
        self._known.update(dict.fromkeys(above, found))
        return found

    def forget(self) -> None:
        """Look at the disk again from now on."""
        self._known.clear()


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
        text = data.decode("utf-8")
        table = tomllib.loads(text)
    except UnicodeDecodeError:
        return Project(folder, (folder,), problems=((0, "this is not a text in UTF-8"),))
    except tomllib.TOMLDecodeError as error:
        return Project(folder, (folder,), problems=((_line(str(error)), str(error)),))
    problems: list[tuple[str, str]] = []
    roots = _roots(folder, table.get("roots", []), problems)
    lints = _lints(table.get("lints", {}), problems)
    settings = _settings(table.get("settings", {}), problems)
    problems += [(name, f"there is no `{name}` here: known are {_listed(KEYS)}") for name in table if name not in KEYS]
    return Project(folder, roots, lints, settings, tuple((_line_of(text, word), said) for word, said in problems))


def _listed(names: Iterable[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def _line(message: str) -> int:
    """The line that the TOML parser names in its message."""
    _, _, after = message.partition("at line ")
    digits = after.split(",")[0].split(")")[0]
    return max(int(digits) - 1, 0) if digits.isdigit() else 0


def _line_of(text: str, word: str) -> int:
    """The first line that starts with a word, or has it at all; for a message to stand at."""
    lines = text.split("\n")
    starting = (number for number, line in enumerate(lines) if line.lstrip(' \t["').startswith(word))
    having = (number for number, line in enumerate(lines) if word in line)
    return next(starting, next(having, 0))


def _roots(folder: str, written: Any, problems: list[tuple[str, str]]) -> tuple[str, ...]:
    if not isinstance(written, list) or not all(isinstance(root, str) for root in written):
        problems.append(("roots", '`roots` is a list of folders, such as ["src"]'))
        return (folder,)
    found = [os.path.abspath(os.path.join(folder, root)) for root in written]
    missing = [root for root, path in zip(written, found) if not os.path.isdir(path)]
    problems += [("roots", f"`roots`: there is no folder `{root}`") for root in missing]
    return tuple(dict.fromkeys([*found, folder]))


def _lints(written: Any, problems: list[tuple[str, str]]) -> dict[str, str]:
    if not isinstance(written, Mapping):
        problems.append(("lints", "`lints` is a table of codes and levels"))
        return {}
    for code, level in written.items():
        if level not in LEVELS:
            problems.append((code, f"`lints`: the level of {code} is one of {', '.join(LEVELS)}"))
    return {str(code): str(level) for code, level in written.items() if level in LEVELS}


def _settings(written: Any, problems: list[tuple[str, str]]) -> Settings:
    if not isinstance(written, Mapping):
        problems.append(("settings", "`settings` is a table such as `rtol = 1e-6`"))
        return DEFAULTS
    complaints = {name: problem(name, value) for name, value in written.items()}
    problems += [(name, f"`settings`: {said}") for name, said in complaints.items() if said is not None]
    return replace(DEFAULTS, **{name: value for name, value in written.items() if complaints[name] is None})


def problems_of(project: Project) -> tuple[Located, ...]:
    """What is wrong with a project file, as diagnostics."""
    if not project.problems:
        return ()
    try:
        with open(project.path, encoding="utf-8", errors="replace", newline="") as file:
            lines = file.read().split("\n")
    except OSError:
        lines = []
    found = []
    for line, message in project.problems:
        start = sum(len(text) + 1 for text in lines[:line])
        end = start + len(lines[line].rstrip()) if line < len(lines) else start
        found.append(Located(project.path, BAD_PROJECT(Span(start, end), message)))
    return tuple(found)


def levelled(found: Iterable[Located], levels: Mapping[str, str]) -> Iterator[Located]:
    """Diagnostics with the severity that a project or a client gives them. An error of the language stays one."""
    for located in found:
        said = located.diagnostic
        level = levels.get(said.code)
        if level is None or said.severity == "error":
            yield located
        elif (severity := _SEVERITIES.get(level)) is not None:
            yield replace(located, diagnostic=replace(said, severity=severity))
        elif level != "off":
            yield located
