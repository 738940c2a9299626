"""Opening the files of a command in a world, and what a command says when its program is wrong."""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from potto.cli.console import Console
from potto.cli.files import STDIN, main_of, missing, read_stdin
from potto.diagnostics import PottoError
from potto.reports.render import Located, ProgramError, all_to_json
from potto.source import SourceText

if TYPE_CHECKING:
    from potto.checking.library import Library

NO_FILE = "<no file>"


def opened(world: Library, path: str | None, given: Sequence[tuple[str, str]] = (), *, after: str | None = None) -> str:
    """The key of a file that a command works on, of a folder its `main.po`, of None a file with nothing in it. given:
    names, and what they stand for instead. after: the argument behind the file, with which it may be swapped. Raises
    ProgramError if there is no program there, or something wrong with what is given."""
    key = _found(world, path, after)
    if given:
        from potto.evaluating.given import each_once, give, nobody_asks, unknown
        from potto.modules import names

        each_once(given)
        for name in nobody_asks(world, key, given, [*filter(None, [after]), *(text for _, text in given)]):
            raise unknown(world, name, names(world.db, key))
        give(world, key, given)
    return key


def _found(world: Library, path: str | None, after: str | None) -> str:
    if path is None:
        return _nothing(world)
    if path == "-":
        return open_stdin(world)
    if not os.path.exists(path):
        raise ProgramError([missing(path, after)], no_sources)
    if os.path.isdir(path):
        path = main_of(path)
    key = world.key(path)
    world.must_exist(key)
    return key


def open_stdin(world: Library) -> str:
    """Standard input as a file of the working folder, so that its imports are found there."""
    key = os.path.join(os.getcwd(), STDIN)
    problem = world.put_bytes(key, read_stdin())
    if problem is not None:
        raise ProgramError([problem], no_sources)
    return key


def _nothing(world: Library) -> str:
    """A file of the working folder with nothing in it: for expressions that need none."""
    return world.put(os.path.join(os.getcwd(), NO_FILE), "")


def no_sources(file: str) -> SourceText | None:
    """For diagnostics about files that have no text."""
    return None


def fail(error: PottoError, options: argparse.Namespace, console: Console) -> int:
    """Show what is wrong with the program, or with how it is used; the exit status."""
    if not isinstance(error, ProgramError):
        error = ProgramError([Located(None, diagnostic) for diagnostic in error.diagnostics], no_sources)
    if options.json:
        console.answer_json(all_to_json(error.located, error.sources))
    else:
        console.diagnostics(error.located, error.sources)
    return 1


def others_json(world: Library, file: str) -> dict[str, Any]:
    """The errors of a file that an answer did not need, to stand beside it; nothing for none."""
    errors = world.errors(file)
    return all_to_json(errors, world.source) if errors else {}


def report_others(world: Library, file: str, options: argparse.Namespace, console: Console) -> int:
    """After an answer, show the errors of the file that it did not need; the exit status."""
    errors = world.errors(file)
    if not options.json:
        console.diagnostics(errors, world.source)
    return int(bool(errors))
