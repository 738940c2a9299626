"""The project file `potto.toml`: roots of modules, how lints count, and how numbers are asked for.

    roots = ["src"]          # folders in which modules are looked for, beside the importing file's own

    [lints]
    P0620 = "off"            # or "hint", "info", "warning", "error"

    [settings]
    rtol = 1e-6              # or method, atol, samples, seed, max_evals, backend

The project of a file is told by the nearest such file in its folder and above. Owns finding and reading it, and what
is wrong with it, all at once; the command line, the prompt, Python and the editor all ask here.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from msgspec import Struct
from msgspec.structs import replace

from potto.diagnostics import Diagnostic, Severity, declare
from potto.projects.settings import DEFAULTS, Settings, problem
from potto.projects.toml_places import entry_at, mistake_at
from potto.reports.near import did_you_mean, instead, near_names
from potto.reports.render import Located
from potto.source import Span

NAME = "potto.toml"
LEVELS = ("off", "hint", "info", "warning", "error")
KEYS = ("roots", "lints", "settings")
# The codes whose severity a project may set: of all that are not errors. A test holds them against what is declared.
LINTS = (
    "P0406", "P0501", "P0522", "P0524", "P0610", "P0611", "P0612", "P0613", "P0614", "P0615", "P0616", "P0620", "P0621",
    "P0622", "P0623", "P0624", "P0625",
)  # fmt: skip
BAD_PROJECT = declare("P0231", "a project file that is not understood")

_SEVERITIES: Mapping[str, Severity] = {"error": "error", "warning": "warning", "info": "info", "hint": "hint"}


class Project(Struct, frozen=True):
    """A folder with a project file, or one that is a root by itself. `problems` have places in `text`, the file's."""

    folder: str
    roots: tuple[str, ...]
    lints: Mapping[str, str] = {}
    settings: Settings = DEFAULTS
    problems: tuple[Diagnostic, ...] = ()
    text: str = ""

    @property
    def path(self) -> str:
        return os.path.join(self.folder, NAME)


class Projects:
    """The projects of files; each project file is read once, until `forget`."""

    def __init__(self) -> None:
        self._known: dict[str, Project | None] = {}

    def of(self, path: str) -> Project | None:
        """The project of a file or folder; None if there is no project file in its folder or above."""
        if path in self._known:
            return self._known[path]
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
        return Project(folder, (folder,), problems=(_unreadable(f"cannot be read: {error.strerror}"),))
    return _parsed(folder, data)


def _unreadable(message: str) -> Diagnostic:
    return BAD_PROJECT(Span(0, 0), message)


def _parsed(folder: str, data: bytes) -> Project:
    import tomllib

    try:
        text = data.decode("utf-8")
        table = tomllib.loads(text)
    except UnicodeDecodeError:
        return Project(folder, (folder,), problems=(_unreadable("this is not UTF-8 text"),))
    except tomllib.TOMLDecodeError as error:
        message, place = mistake_at(text, str(error))
        return Project(folder, (folder,), problems=(BAD_PROJECT(place, message),), text=text)
    reader = _Reader(text)
    roots = reader.roots(folder, table.get("roots", []))
    lints = reader.lints(table.get("lints", {}))
    settings = reader.settings(table.get("settings", {}))
    for name in table:
        if name not in KEYS:
            reader.unknown("", name, KEYS, f"there is no `{name}` here: known are {_listed(KEYS)}")
    problems = sorted(reader.problems, key=lambda said: said.span.start)
    return Project(folder, roots, lints, settings, tuple(problems), text)


def _listed(names: Iterable[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)


class _Reader:
    """Takes the tables of a project file apart, and notes what it does not understand."""

    def __init__(self, text: str) -> None:
        self._text = text
        self.problems: list[Diagnostic] = []

    def unknown(self, table: str, key: str, known: Iterable[str], message: str) -> None:
        """A key that means nothing, with those that may have been meant."""
        near, (place, _) = near_names(key, known), entry_at(self._text, table, key)
        said = BAD_PROJECT(place, message, help=did_you_mean(near), suggestions=instead(place, near))
        self.problems.append(said)

    def wrong(self, table: str, key: str, message: str) -> None:
        """A value that cannot be the one of its key."""
        self.problems.append(BAD_PROJECT(entry_at(self._text, table, key)[1], message))

    def roots(self, folder: str, written: Any) -> tuple[str, ...]:
        """Where modules are looked for: absolute, the project's own folder last."""
        if not isinstance(written, list) or not all(isinstance(root, str) for root in written):
            self.wrong("", "roots", '`roots` is a list of folders, such as ["src"]')
            return (folder,)
        found = [os.path.abspath(os.path.join(folder, root)) for root in written]
        for root, path in zip(written, found):
            if not os.path.isdir(path):
                self.wrong("", "roots", f"`roots`: there is no folder `{root}`")
        return tuple(dict.fromkeys([*found, folder]))

    def lints(self, written: Any) -> dict[str, str]:
        """The levels of lints by their codes."""
        if not isinstance(written, Mapping):
            self.wrong("", "lints", '`lints` is a table of codes and levels, such as `P0620 = "off"`')
            return {}
        found: dict[str, str] = {}
        for code, level in written.items():
            if code not in LINTS:
                self._no_lint(code)
            elif level not in LEVELS:
                self.wrong("lints", code, f"`lints`: the level of {code} is one of {_listed(LEVELS)}")
            else:
                found[code] = level
        return found

    def _no_lint(self, code: str) -> None:
        from potto.reports.pages import codes

        if code in codes():
            told = f"`lints`: {code} is not a lint, so its severity cannot be changed; lints are {_listed(LINTS)}"
            self.problems.append(BAD_PROJECT(entry_at(self._text, "lints", code)[0], told))
        else:
            self.unknown("lints", code, LINTS, f"`lints`: there is no diagnostic `{code}`; lints are {_listed(LINTS)}")

    def settings(self, written: Any) -> Settings:
        """How numbers are asked for."""
        if not isinstance(written, Mapping):
            self.wrong("", "settings", "`settings` is a table such as `rtol = 1e-6`")
            return DEFAULTS
        found: dict[str, Any] = {}
        for name, value in written.items():
            if name not in Settings.__struct_fields__:
                known = Settings.__struct_fields__
                self.unknown("settings", name, known, f"`settings`: there is no `{name}`; there are {_listed(known)}")
            elif (complaint := problem(name, value)) is not None:
                self.wrong("settings", name, f"`settings`: {complaint}")
            else:
                found[name] = value
        return replace(DEFAULTS, **found)


def problems_of(project: Project) -> tuple[Located, ...]:
    """What is wrong with a project file, as diagnostics of it."""
    return tuple(Located(project.path, said) for said in project.problems)


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
