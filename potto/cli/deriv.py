"""`potto deriv`: a derivative in symbols."""

from __future__ import annotations

import argparse
import difflib
from dataclasses import asdict

from potto.cli.console import Console

SUMMARY = "show the derivative of a definition: type, interior, boundary, surfaces"
EXAMPLE = "  potto deriv examples/paper/renderer.po renderer"


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", help="the program; `-` reads it from standard input")
    parser.add_argument("name", metavar="NAME", help="the definition")


def run(options: argparse.Namespace, console: Console) -> int:
    from potto.cli.opening import fail, opened
    from potto.facts import derivative_facts
    from potto.library import NO_SUCH_DEFINITION, NOWHERE, Library
    from potto.modules import DefinitionTarget, names, resolve
    from potto.render import Located, ProgramError

    world = Library(["."])
    try:
        file = opened(world, options.file)
        world.require(file)
        target = resolve(world.db, file, options.name)
        facts = None
        if isinstance(target, DefinitionTarget):
            facts = derivative_facts(world.db, target.file, target.name)
        if facts is None:
            near = difflib.get_close_matches(options.name, names(world.db, file), 1)
            what = "is no function" if isinstance(target, DefinitionTarget) else "is not defined here"
            help = f"did you mean `{near[0]}`?" if near and near[0] != options.name else ""
            complaint = NO_SUCH_DEFINITION(NOWHERE, f"`{options.name}` {what}", help=help)
            raise ProgramError([Located(options.file, complaint)], lambda name: None)
    except ProgramError as error:
        return fail(error, options, console)
    if options.json:
        console.answer_json(asdict(facts))
    else:
        console.answer(facts.text)
    return 0
