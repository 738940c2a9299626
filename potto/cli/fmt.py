"""`potto fmt`: programs in the one layout."""

from __future__ import annotations

import argparse
import difflib
import os
import tempfile
from typing import TYPE_CHECKING

from potto.cli.console import Console

if TYPE_CHECKING:
    from potto.checking.library import Library
    from potto.reports.render import Located

SUMMARY = "format programs"
EXAMPLE = "  potto fmt --diff examples/"


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("paths", nargs="+", metavar="PATH", help="files, or folders to walk; `-` is standard input")
    parser.add_argument("--check", action="store_true", help="change nothing; exit with 1 if something would change")
    parser.add_argument("--diff", action="store_true", help="change nothing; show what would change")


def run(options: argparse.Namespace, console: Console) -> int:
    from potto.checking.library import Library
    from potto.cli.files import expand
    from potto.cli.opening import opened
    from potto.reports.render import ProgramError, all_to_json

    world = Library()
    files, problems = expand(options.paths)
    changed: list[str] = []
    for path in files:
        try:
            key = opened(world, path)
        except ProgramError as error:
            problems += error.located
            continue
        wrong, differs = _format(world, path, key, options, console)
        problems += wrong
        if differs:
            changed.append(path)
    if options.json:
        console.answer_json({"changed": changed, **all_to_json(problems, world.source)})
    else:
        console.diagnostics(problems, world.source)
    would = options.check or options.diff
    return int(bool(problems) or (would and bool(changed)))


def _format(
    world: Library, path: str, key: str, options: argparse.Namespace, console: Console
) -> tuple[list[Located], bool]:
    """Format one file as the options say; what is wrong with it, and whether it was (or would be) changed."""
    from potto.checking.check import errors_of
    from potto.modules.misread import syntax_diagnostics
    from potto.modules.texts import is_diffeo
    from potto.reports.render import Located, display_name
    from potto.syntax import format_source

    source = world.source(key)
    assert source is not None  # `opened` has read it
    wrong = errors_of(Located(key, d) for d in syntax_diagnostics(world.db, key))
    if wrong:  # what cannot be read cannot be laid out
        return list(wrong), False
    formatted = format_source(source.text, is_diffeo(key))
    differs = formatted != source.text
    if path == "-" and not (options.check or options.diff):
        console.out.write(formatted)
    elif options.diff and differs and not options.json:
        name = display_name(key)
        lines = difflib.unified_diff(_lines(source.text), _lines(formatted), name, f"{name} (formatted)", lineterm="")
        console.answer("\n".join(lines))
    elif options.check and differs and not options.json:
        console.answer(f"would format {display_name(key)}")
    elif differs and not (options.check or options.diff):
        _replace(path, formatted)
        if not options.json:
            console.complain(f"formatted {display_name(key)}")
    return [], differs


def _lines(text: str) -> list[str]:
    return text.splitlines()


def _replace(path: str, text: str) -> None:
    """Write a file in one step, through links, keeping its permissions: a reader sees the old text or the new one."""
    target = os.path.realpath(path)
    handle, temporary = tempfile.mkstemp(dir=os.path.dirname(target), prefix=".potto-")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(text.encode())
        os.chmod(temporary, os.stat(target).st_mode)
        os.replace(temporary, target)
    except BaseException:
        os.unlink(temporary)
        raise
