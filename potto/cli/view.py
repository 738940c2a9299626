"""`potto view`: an integral with its domain, surfaces and boundary term, as a picture or as a page."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from potto.cli.calling import add_set, assignment, called
from potto.cli.console import Console
from potto.cli.evaluation_options import add_options, settings_of

if TYPE_CHECKING:
    from potto.evaluating.world import World

SUMMARY = "look at an integral: its domain, what jumps where, and what moves"
EXAMPLE = """  potto view examples/worked/picture.po pixel x=0.7 y=0 r=0.7 --wrt r -o pixel.svg
  potto view examples/worked/picture.po pixel --step 0.01 --nodes -o pixel.svg
  potto view examples/worked/picture.po"""


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", help="the program")
    parser.add_argument("name", metavar="NAME", nargs="?", help="the function whose integral is seen")
    parser.add_argument("given", metavar="NAME=EXPR", nargs="*", type=assignment, help="what parameters are given; "
                        "others start as a live expression of the file gives them, or as 0.5; also where a variable "
                        "that is not seen stands, else in the middle of its range")  # fmt: skip
    parser.add_argument("--wrt", metavar="NAME", help="the parameter that moves (default: the first on which the "
                        "derivative depends)")  # fmt: skip
    parser.add_argument("--integral", metavar="N", type=_count, default=1, help="which one of several (default 1)")
    parser.add_argument("-o", "--output", metavar="FILE", help="write a picture, .svg (else: a page in the browser)")
    parser.add_argument("--step", metavar="H", type=_step, help="also draw surfaces and bounds a step before and a "
                        "step after, and take the difference over it")  # fmt: skip
    parser.add_argument("--nodes", action="store_true", help="draw where the integrand is evaluated")
    parser.add_argument("--no-open", action="store_true", help="print the address of the page, and open no browser")
    add_set(parser)
    add_options(parser)


def _count(text: str) -> int:
    if not text.isdecimal() or not int(text):
        raise argparse.ArgumentTypeError(f"{text!r} is not the number of an integral; they count from 1")
    return int(text)


def _step(text: str) -> float:
    try:
        step = float(text)
    except ValueError:
        step = 0.0
    if not 0 < step < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r} is not a step; it is a number greater than 0")
    return step


def run(options: argparse.Namespace, console: Console) -> int:
    from msgspec import to_builtins
    from msgspec.structs import asdict

    from potto.applications.integral_scenes import IntegralScene
    from potto.cli.opening import fail, opened
    from potto.diagnostics import PottoError
    from potto.evaluating.given import each_once
    from potto.evaluating.world import World
    from potto.projects.settings import settings

    chosen = settings_of(options, console)
    if chosen is None:
        return 2
    path = options.output
    if path is not None and not path.endswith(".svg"):
        console.complain(f"potto view: {path} does not end with .svg")
        return 2
    world = World(["."])
    try:
        if options.name is None:
            file = opened(world, options.file, options.set)
        else:
            file, options = called(world, options)
            each_once(options.given)
        if options.name is None and (path is not None or options.json):
            console.complain(f"potto view: say whose integral: `potto view FILE NAME`{_whose(world, file)}")
            return 2
        if path is None and not options.json:
            with settings(**asdict(chosen)):
                return _page(world, file, options, console)
        with settings(**asdict(chosen)):
            found = IntegralScene(world, file, options.name, dict(options.given))
            wrt = options.wrt or found.moving
            shot = found.look(
                found.values, wrt, options.integral - 1, options.step, options.nodes, sections=found.sections
            )
    except PottoError as error:
        return fail(error, options, console)
    if path is not None and not _written(path, shot.svg, console):
        return 1
    if options.json:
        console.answer_json({"file": path, "wrt": wrt, "values": found.values, "numbers": to_builtins(shot.numbers),
                             "view": to_builtins(shot.view)})  # fmt: skip
    else:
        count = len(shot.view.surfaces)
        console.answer(f"{path}: {options.name} by {wrt}, {count} surface{'' if count == 1 else 's'}")
    return 0


def _whose(world: World, file: str) -> str:
    """The functions of a file with an integral to look at, as the end of a sentence."""
    from potto.core.terms import Integral, postorder
    from potto.elaborate import core
    from potto.ide.display.scenes import scenes

    terms = {found.name: core(world.db, file, found.name).term for found in scenes(world.db, file, drawable=False)}
    seen = [name for name, term in terms.items() if any(isinstance(part, Integral) for part in postorder(term))]
    return f", of {', '.join(seen)}" if seen else ""


def _written(path: str, text: str, console: Console) -> bool:
    try:
        with open(path, "w", encoding="utf-8") as out:
            out.write(text)
    except OSError as error:
        console.complain(f"potto view: {path} cannot be written: {error.strerror}")
        return False
    return True


def _page(world: World, file: str, options: argparse.Namespace, console: Console) -> int:
    """Answer the page until Ctrl+C."""
    import webbrowser
    from contextlib import suppress

    from potto.applications.integral_answers import Answers
    from potto.cli.view_page import Answering, serve

    answers = Answering(Answers(world, file, options.name, dict(options.given), options.wrt))
    server, address = serve(answers)
    with server:
        console.answer(f"{address}\nCtrl+C ends it")
        if not options.no_open:
            webbrowser.open(address)
        with suppress(KeyboardInterrupt):
            server.serve_forever()
    answers.close()
    return 0
