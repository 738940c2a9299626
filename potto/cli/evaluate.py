"""`potto eval`: the value of an expression."""

from __future__ import annotations

import argparse
import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from potto.cli.calling import add_set
from potto.cli.console import Console
from potto.cli.evaluation_options import accounts, add_options, settings_of, show_stats, totals

if TYPE_CHECKING:
    from potto.checking.recalled import Question
    from potto.core.terms import Term
    from potto.evaluating.answering import Answer, Checked
    from potto.projects.settings import Settings
    from potto.reports.render import Sources

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
    settings = settings_of(options, console)
    if settings is None:
        return 2
    alone = options.expression.strip() if options.file is None else ""
    if alone.endswith((".po", ".diffeo")) or os.path.exists(alone):
        console.complain(f"potto eval: say what to evaluate: `potto eval {alone} EXPR`")
        return 2
    from potto.checking.recalled import Question

    text = options.expression.strip()
    question = Question(("eval", text), () if options.file is None else (options.file,))
    known = None if options.set else question.recalled()
    if known is not None and _again(known, text, settings, options, console):
        return 0
    return _anew(question, text, settings, options, console)


def _again(known: Checked, text: str, settings: Settings, options: argparse.Namespace, console: Console) -> bool:
    """Evaluate what was evaluated before; False where an error has to be told, which takes the text."""
    from potto.diagnostics import PottoError
    from potto.evaluating.answering import only

    def with_fields(term: Term, definitions: Mapping[tuple[str, str], Term]) -> Term:
        from potto.cli.opening import opened
        from potto.evaluating.world import World

        world = World(["."])
        opened(world, options.file, after=options.expression)
        return world.with_fields(term, definitions)

    try:
        with accounts(options), console.waiting():
            answer = known.evaluate(settings, with_fields)
    except PottoError:
        return False
    _tell(answer, only(text), {}, options, console)
    return True


def _anew(question: Question, text: str, settings: Settings, options: argparse.Namespace, console: Console) -> int:
    from potto.cli.opening import fail, opened, others_json, report_others
    from potto.evaluating.world import World
    from potto.reports.render import ProgramError

    world = World(["."])
    try:
        file = opened(world, options.file, options.set, after=options.expression)
        with accounts(options), console.waiting():
            answer = world.evaluate(file, text, settings)
    except ProgramError as error:
        return fail(error, options, console)
    _tell(answer, world.sources(text), others_json(world, file) if options.json else {}, options, console)
    status = report_others(world, file, options, console)
    if not (status or options.set) and (checked := world.checked(file, text)) is not None:
        question.keep(checked, world.db)
    return status


def _tell(
    answer: Answer, sources: Sources, others: Mapping[str, Any], options: argparse.Namespace, console: Console
) -> None:
    from potto.reports.render import to_json
    from potto.runtime.answers.shown import estimate_json, format_answer, interval

    estimate = answer.estimate
    if options.json:
        more: dict[str, Any] = {"stats": totals([estimate])} if options.stats else {}
        if answer.remarks:
            more["remarks"] = [to_json(located, sources) for located in answer.remarks]
        console.answer_json({**estimate_json(estimate, answer.type), **more, **others})
    else:
        console.answer(format_answer(estimate))
        if estimate.text is None and options.stats:
            console.complain(f"with its error: {interval(estimate)}")
        console.diagnostics(answer.remarks, sources)
    if options.stats:
        show_stats([estimate], console)
