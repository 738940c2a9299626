"""From the paths of a command line to files, and to diagnostics for those that are none; waiting for them to change."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence

from potto.checking.library import NO_PROGRAMS
from potto.modules.folders import HEAVY, is_translation
from potto.modules.kinds import UNREADABLE
from potto.modules.lookup import SUFFIXES
from potto.reports.render import Located, ProgramError
from potto.source import Span

STDIN = "<stdin>"
MAIN = "main.po"
PAUSE, SETTLED = 0.2, 0.05  # seconds between two looks at files; for how long nothing changes once one is written


def wait(changed: Callable[[], bool]) -> None:
    """Return when something has changed and been written: while it is saved, a file may be empty for a moment."""
    while not changed():
        time.sleep(PAUSE)
    time.sleep(SETTLED)
    while changed():
        time.sleep(SETTLED)


def expand(paths: Sequence[str]) -> tuple[list[str], list[Located]]:
    """The files that paths name, folders walked, each file once; and what is wrong with the paths that name none."""
    files: dict[str, None] = {}
    problems: list[Located] = []
    for path in paths:
        if path == "-" or os.path.isfile(path):
            files[path] = None
        elif os.path.isdir(path):
            inside = list(walk(path))
            files.update(dict.fromkeys(inside))
            if not inside:
                message = f"no {' or '.join(SUFFIXES)} file in this folder"
                problems.append(Located(path, NO_PROGRAMS(Span(0, 0), message)))
        else:
            problems.append(missing(path))
    return list(files), problems


def walk(folder: str) -> Iterator[str]:
    """The programs in a folder and below, in order; hidden folders, those that tools fill, and gettext's translations,
    which are called `.po` as well, are left out."""
    for where, folders, names in os.walk(folder):
        folders[:] = sorted(f for f in folders if not f.startswith(".") and f not in HEAVY)
        for name in sorted(names):
            path = os.path.join(where, name)
            if name.endswith(SUFFIXES) and not (name.endswith(".po") and is_translation(path)):
                yield path


def main_of(folder: str) -> str:
    """The program that a folder stands for where one file is asked for. Raises ProgramError if it has none."""
    main = os.path.join(folder, MAIN)
    if os.path.isfile(main):
        return main
    first = next(walk(folder), None)
    help = f"name a program in it, such as `{first}`" if first else "name a program"
    message = f"`{folder}` is a folder without a `{MAIN}`"
    raise ProgramError([Located(folder, UNREADABLE(Span(0, 0), message, help=help))], lambda file: None)


def missing(path: str, after: str | None = None) -> Located:
    """The diagnostic for a path that names nothing: `after`, what the command has behind it, may be the file that was
    meant; else a near one, if there is one."""
    import difflib
    import shlex

    if after is not None and after.endswith(SUFFIXES) and os.path.isfile(after):
        return _no_file(path, f"the file comes first: `{after} {shlex.quote(path)}`")
    folder = os.path.dirname(path) or "."
    there = sorted(os.listdir(folder)) if os.path.isdir(folder) else []
    near = difflib.get_close_matches(os.path.basename(path), [n for n in there if n.endswith(SUFFIXES)], 1)
    help = f"did you mean `{os.path.join(os.path.dirname(path), near[0])}`?" if near else ""
    return _no_file(path, help)


def _no_file(path: str, help: str) -> Located:
    return Located(path, UNREADABLE(Span(0, 0), f"there is no file `{path}`", help=help))


def read_stdin() -> bytes:
    """Standard input as it is."""
    return sys.stdin.buffer.read() if hasattr(sys.stdin, "buffer") else sys.stdin.read().encode()
