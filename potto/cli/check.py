"""`potto check`: what is wrong with programs."""

from __future__ import annotations

import argparse
import gc
import time
from typing import TYPE_CHECKING

from potto.cli.console import Console

if TYPE_CHECKING:
    from potto.checking.library import Library
    from potto.checking.recalled import Question
    from potto.reports.render import Located, Sources

SUMMARY = "say what is wrong with programs, where, and what to do"
EXAMPLE = "  potto check examples/ --watch"


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("paths", nargs="+", metavar="PATH", help="files, or folders to walk; `-` is standard input")
    parser.add_argument("--watch", action="store_true", help="check again whenever a file changes, until interrupted")


def run(options: argparse.Namespace, console: Console) -> int:
    from potto.checking.recalled import Question

    question = Question(("check",), tuple(options.paths))
    sound = None if options.watch else question.recalled()
    if sound is not None:
        _tell([], sound, lambda file: None, options, console)
        return 0
    return _check(question, options, console)


def _check(question: Question, options: argparse.Namespace, console: Console) -> int:
    from potto.checking.library import Library

    gc.disable()  # nearly all that a check makes stays, and collections would be a fifth of its time and more
    try:
        world = Library(["."])
        status = _look(world, options, console, question)
    finally:
        gc.freeze()
        gc.enable()
    while options.watch:
        console.out.flush()
        _wait(world, options.paths)
        console.complain(f"-- {time.strftime('%H:%M:%S')}")
        status = _look(world, options, console)
    return status


def _look(world: Library, options: argparse.Namespace, console: Console, question: Question | None = None) -> int:
    """Check all files once and say what was found; where that is nothing, keep it as the answer to the question."""
    found, files = gather(world, options.paths)
    _tell(found, files, world.source, options, console)
    if not found and question is not None:
        question.keep(files, world.db)
    return int(any(located.diagnostic.severity == "error" for located in found))


def _tell(found: list[Located], files: int, sources: Sources, options: argparse.Namespace, console: Console) -> None:
    from potto.reports.render import all_to_json, summary

    if options.json:
        console.answer_json(all_to_json(found, sources))
    else:
        console.diagnostics(found, sources, to_answer=True, inline_header=True)
        count = f"{files} file{'' if files == 1 else 's'}"
        console.complain(f"{count}: {summary(found) or 'no problems'}")


def gather(world: Library, paths: list[str]) -> tuple[list[Located], int]:
    """The diagnostics of all files that the paths name, and how many files there are."""
    from potto.cli.files import expand
    from potto.cli.opening import opened
    from potto.reports.render import ProgramError

    files, found = expand(paths)
    parts: dict[str, list[Located]] = {}
    keys = dict[str, str]()
    for path in files:
        try:
            keys[path] = opened(world, path)
        except ProgramError as error:
            parts[path] = list(error.located)
    for path, said in zip(keys, world.all_diagnostics(list(keys.values()))):
        parts[path] = list(said)
    found += (located for path in files for located in parts[path])
    return list(dict.fromkeys(found)), len(files)


def _wait(world: Library, paths: list[str]) -> None:
    """Come back when a file has changed, appeared or gone."""
    from potto.cli.files import expand, wait

    files = expand(paths)[0]

    def changed() -> bool:
        nonlocal files
        before, files = files, expand(paths)[0]
        return world.refresh() or files != before

    wait(changed)
