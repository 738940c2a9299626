"""`potto eval`: the value of an expression."""

from __future__ import annotations

import argparse
import os
from typing import Any

from potto.cli.calling import add_set
from potto.cli.console import Console
from potto.cli.numbers import accounts, add_options, settings_of, show_stats, totals

SUMMARY = "evaluate an expression, with a file's names in scope"
EXAMPLE = "  potto eval examples/paper/renderer.po 'deriv(renderer)((-0.7, 1), deriv(\\(x, y) . \\c . c))'"


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "file", metavar="FILE", nargs="?", help="the program; `-` reads it from standard input; without one, no names"
    )  # fmt: skip
    parser.add_argument("expression", metavar="EXPR", help="the expression")
    add_set(parser)
    add_options(parser)


def prepare(arguments: list[str]) -> list[str]:
    """Let `-f(1)` be an expression: what starts with one minus and is no option of ours gets a blank in front."""
    return [f" {word}" if len(word) > 1 and word[0] == "-" != word[1] and word != "-h" else word for word in arguments]


def run(options: argparse.Namespace, console: Console) -> int:
    from potto.cli.opening import fail, opened, others_json, report_others

    settings = settings_of(options, console)
    if settings is None:
        return 2
    alone = options.expression.strip() if options.file is None else ""
    if alone.endswith((".po", ".diffeo")) or os.path.exists(alone):
        console.complain(f"potto eval: say what to evaluate: `potto eval {alone} EXPR`")
        return 2
    from potto.evaluating.world import World
    from potto.reports.render import ProgramError, to_json
    from potto.runtime.answers.shown import estimate_json, format_answer, interval

    world = World(["."])
    text = options.expression.strip()
    try:
        file = opened(world, options.file, options.set, after=options.expression)
        with accounts(options), console.waiting():
            answer = world.evaluate(file, text, settings)
    except ProgramError as error:
        return fail(error, options, console)
    estimate = answer.estimate
    if options.json:
        more: dict[str, Any] = {"stats": totals([estimate])} if options.stats else {}
        if answer.remarks:
            sources = world.sources(text)
            more["remarks"] = [to_json(located, sources) for located in answer.remarks]
        console.answer_json({**estimate_json(estimate, answer.type), **more, **others_json(world, file)})
    else:
        console.answer(format_answer(estimate))
        if estimate.text is None and options.stats:
            console.complain(f"with its error: {interval(estimate)}")
        console.diagnostics(answer.remarks, world.sources(text))
    if options.stats:
        show_stats([estimate], console)
    return report_others(world, file, options, console)
