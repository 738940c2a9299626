"""`potto deriv`: a derivative in symbols; with arguments, in numbers, by all parameters at once."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from msgspec import to_builtins
from msgspec.structs import asdict

from potto.cli.calling import add_set, argument_in, arguments_in, assignment, called, function_in
from potto.cli.console import Console
from potto.cli.evaluation_options import accounts, add_options, settings_of, show_stats

if TYPE_CHECKING:
    from potto.checking.recalled import Question
    from potto.evaluating.world import World
    from potto.python.slopes import Gradient

SUMMARY = "show the derivative of a definition in symbols, or its gradient in numbers"
EXAMPLE = """  potto deriv examples/paper/renderer.po renderer
  potto deriv examples/worked/picture.po pixel x=0.7 y=0 r=0.7 --wrt r,x --along r=1"""


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", help="the program; `-` reads it from standard input")
    parser.add_argument("name", metavar="NAME", help="the definition")
    parser.add_argument("given", metavar="NAME=EXPR", nargs="*", type=assignment,
                        help="what its parameters are given: then the derivatives are numbers")  # fmt: skip
    parser.add_argument("--wrt", metavar="A,B", help="the parameters to differentiate by (default: all numbers)")
    parser.add_argument("--along", metavar="NAME=EXPR", action="append", default=[], type=assignment,
                        help="also the Hessian times the vector that has these components")  # fmt: skip
    parser.add_argument("--typeset", action="store_true", help="formulas with the signs of mathematics, as on a screen "
                        "that has them; else they are Potto")  # fmt: skip
    add_set(parser)
    add_options(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    return _numbers(options, console) if options.given or options.along or options.wrt else _symbols(options, console)


def _symbols(options: argparse.Namespace, console: Console) -> int:
    from potto.checking.recalled import Question

    form = "json" if options.json else "typeset" if options.typeset or console.for_a_screen else "text"
    question = Question(("deriv", options.name, form), (options.file,))
    known = None if options.set else question.recalled()
    if known is None:
        return _found_symbols(question, form, options, console)
    _tell_symbols(known, console)
    return 0


def _tell_symbols(found: str | dict[str, Any], console: Console) -> None:
    if isinstance(found, str):
        console.answer(found)
    else:
        console.answer_json(found)


def _found_symbols(question: Question, form: str, options: argparse.Namespace, console: Console) -> int:
    import difflib

    from potto.checking.facts import derivative_facts
    from potto.checking.library import NO_SUCH_DEFINITION, Library
    from potto.cli.opening import fail, others_json, report_others
    from potto.modules import DefinitionTarget, names, resolve
    from potto.reports.render import Located, ProgramError
    from potto.source import NOWHERE
    from potto.syntax import nodes

    world = Library(["."])
    try:
        file, options = called(world, options)
        if options.given:
            return _numbers(options, console)
        world.need(file, nodes.Name(NOWHERE, options.name))
        target = resolve(world.db, file, options.name)
        facts = None
        if isinstance(target, DefinitionTarget):
            facts = derivative_facts(world.db, target.file, target.name)
        if facts is None:
            near = difflib.get_close_matches(options.name, names(world.db, file), 1)
            what = "is not a function" if isinstance(target, DefinitionTarget) else "is not defined here"
            help = f"did you mean `{near[0]}`?" if near and near[0] != options.name else ""
            complaint = NO_SUCH_DEFINITION(NOWHERE, f"`{options.name}` {what}", help=help)
            raise ProgramError([Located(options.file, complaint)], lambda name: None)
    except ProgramError as error:
        return fail(error, options, console)
    told: str | dict[str, Any]
    if form == "json":
        told = {**to_builtins(facts), **others_json(world, file)}
    else:
        told = facts.typeset if form == "typeset" else facts.text
    _tell_symbols(told, console)
    status = report_others(world, file, options, console)
    if not (status or options.set):
        question.keep(told, world.db)
    return status


# In numbers


def _numbers(options: argparse.Namespace, console: Console) -> int:
    from potto.cli.opening import fail, others_json, report_others

    chosen = settings_of(options, console)
    if chosen is None:
        return 2
    from potto.diagnostics import PottoError
    from potto.evaluating.world import World
    from potto.projects.settings import settings

    world = World(["."])
    try:
        file, options = called(world, options, [("", text) for _, text in options.along])
        with settings(**asdict(chosen)), accounts(options):
            once, twice = _taken(world, file, options)
    except PottoError as error:
        return fail(error, options, console)
    _tell(once, twice, options, console, others_json(world, file))
    if options.stats:
        show_stats([once] if twice is None else [once, twice], console)
    return report_others(world, file, options, console)


def _taken(world: World, file: str, options: argparse.Namespace) -> tuple[Gradient, Gradient | None]:
    """The gradient, and the Hessian's product with the vector if one is given. Raises PottoError."""
    from potto.python.functions import Function
    from potto.python.gradients import grad
    from potto.python.hessian import hvp

    function = function_in(world, file, options.name)
    given = arguments_in(world, file, options.given)
    numbers = [name for name in function.parameters if not isinstance(given.get(name), Function)]
    wrt = numbers if options.wrt is None else [name.strip() for name in options.wrt.split(",")]
    once = grad(function, wrt)(**given)
    if not options.along:
        return once, None
    return once, hvp(function, {name: argument_in(world, file, text) for name, text in options.along})(**given)


def _tell(
    once: Gradient, twice: Gradient | None, options: argparse.Namespace, console: Console,
    others: dict[str, Any],
) -> None:  # fmt: skip
    from potto.runtime.answers.shown import answer_text, json_number

    def sides(found: Gradient) -> list[tuple[str, Any, Any]]:
        errors = found.tangent_error if len(found.wrt) > 1 else (found.tangent_error,)
        return [(name, found[name], error) for name, error in zip(found.wrt, errors, strict=True)]

    both = [found for found in (once, twice) if found is not None]
    if options.json:
        answer: dict[str, Any] = {"value": json_number(once.value), "error": json_number(once.error)}
        for key, found in (("gradient", once), ("hessian_product", twice)):
            if found is not None:
                answer[key] = {name: json_number(value) for name, value, _ in sides(found)}
                answer[f"{key}_error"] = {name: json_number(error) for name, _, error in sides(found)}
        answer |= {"converged": all(f.converged for f in both), "evals": sum(f.evals for f in both)}
        if notes := _each(note for found in both for note in found.notes):
            answer["notes"] = notes
        console.answer_json({**answer, **others})
        return
    console.answer(f"{options.name} = {answer_text(once.value, once.error, once.converged)}")
    for name, value, error in sides(once):
        console.answer(f"  by {name}: {answer_text(value, error, once.converged)}")
    if twice is not None:
        console.answer(f"Hessian times ({', '.join(f'{name}={text}' for name, text in options.along)})")
        for name, value, error in sides(twice):
            console.answer(f"  by {name}: {answer_text(value, error, twice.converged)}")
    for reason in _each(reason for found in both for reason in found.reasons):
        console.complain(f"warning: not as accurate as was asked: {reason}")
    for note in _each(note for found in both for note in found.notes):
        console.complain(f"note: {note}")


def _each(said: Iterable[object]) -> list[str]:
    return list(dict.fromkeys(map(str, said)))
