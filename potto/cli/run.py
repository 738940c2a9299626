"""`potto run`: a script."""

from __future__ import annotations

import argparse
from typing import Any

from potto.cli.calling import add_set
from potto.cli.console import Console
from potto.cli.evaluation_options import accounts, add_options, settings_of, show_stats

SUMMARY = "run a script"
EXAMPLE = "  potto run examples/paper/main.po"


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", help="the script; `-` reads it from standard input")
    add_set(parser)
    add_options(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    from potto.cli.opening import fail, opened

    settings = settings_of(options, console)
    if settings is None:
        return 2
    from potto.evaluating.world import World
    from potto.reports.render import Located, ProgramError, to_json
    from potto.runtime.answers.estimate import Estimate
    from potto.runtime.answers.shown import estimate_json

    world = World(["."])
    status = 0
    outputs: list[dict[str, Any]] = []
    said: list[Located] = []
    estimates: list[Estimate] = []
    try:
        file = opened(world, options.file, options.set)
        with accounts(options):
            for event in world.run(file, settings):
                if isinstance(event, Located):
                    said.append(event)
                    status = max(status, int(event.diagnostic.severity == "error"))
                    if not options.json:
                        console.diagnostics([event], world.source)
                    continue
                estimates += event.estimates
                outputs.append({"text": event.text, "values": [estimate_json(e) for e in event.estimates]})
                if not options.json:
                    console.answer(event.text)
                    console.out.flush()
    except ProgramError as error:
        return fail(error, options, console)
    if options.json:
        console.answer_json({"output": outputs, "diagnostics": [to_json(d, world.source) for d in said]})
    if options.stats:
        show_stats(estimates, console)
    return status
