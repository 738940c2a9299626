"""`potto test`: live expressions as tests."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from msgspec.structs import asdict

from potto.cli.calling import add_set
from potto.cli.console import Console

if TYPE_CHECKING:
    from potto.evaluating.live import Outcome

SUMMARY = "run the live expressions of programs (`#> e`, `#= v`) as tests"
EXAMPLE = "  potto test examples/"


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("paths", nargs="+", metavar="PATH", help="files, or folders to walk; `-` is standard input")
    add_set(parser)
    parser.add_argument("-v", "--verbose", action="store_true", help="also show what passes")


def run(options: argparse.Namespace, console: Console) -> int:
    from potto.cli.files import expand
    from potto.cli.opening import opened
    from potto.evaluating.given import each_once, give, nobody_asks, unknown
    from potto.evaluating.live import outcomes_of
    from potto.evaluating.world import World
    from potto.reports.render import ProgramError, all_to_json

    world = World(["."])
    files, problems = expand(options.paths)
    outcomes: list[Outcome] = []
    unasked = dict(options.set)  # what no file has shown so far
    for path in files:
        try:
            file = opened(world, path)
            each_once(options.set)
            here = nobody_asks(world, file, options.set, [text for _, text in options.set])
            unasked = {name: text for name, text in unasked.items() if name in here}
            give(world, file, options.set)
            problems += world.errors(file)
            outcomes += outcomes_of(world, file)
        except ProgramError as error:
            problems += error.located
    problems += [located for name in unasked for located in unknown(world, name).located]
    if options.json:
        console.answer_json({"tests": [asdict(o) for o in outcomes], **all_to_json(problems, world.source)})
    else:
        console.diagnostics(problems, world.source)
        _show(outcomes, len(files), bool(problems), options.verbose, console)
    return int(bool(problems) or not all(outcome.passed for outcome in outcomes))


def _show(outcomes: list[Outcome], files: int, broken: bool, verbose: bool, console: Console) -> None:
    from potto.reports.render import display_name

    for outcome in outcomes:
        head = f"{display_name(outcome.file)}:{outcome.line}: {outcome.expression}"
        if not outcome.passed:
            console.complain(f"{head}\n    {outcome.message}")
        elif verbose:
            console.answer(f"{head}\n    {outcome.value}")
    failed = sum(not outcome.passed for outcome in outcomes)
    count = f"{_count(len(outcomes), 'live expression')} in {_count(files, 'file')}"
    verdict = f"{failed} failed" if failed else "all hold" if outcomes or not broken else "none was asked"
    console.answer(f"{count}: {verdict}{', and there are errors' if broken else ''}")


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
