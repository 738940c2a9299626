"""`potto dump`: what a program becomes on its way, from words to kernels."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from potto.cli.console import Console

if TYPE_CHECKING:
    from potto.evaluating.world import World

SUMMARY = "show what a program becomes: tokens, tree, types, core, deriv or kernel"
EXAMPLE = "  potto dump core examples/paper/renderer.po"
KINDS = ("tokens", "tree", "types", "core", "deriv", "kernel")

Section = tuple[str, str]  # a heading and what stands under it


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("kind", choices=KINDS, metavar="KIND", help=", ".join(KINDS))
    parser.add_argument("file", metavar="FILE", help="the program; `-` reads it from standard input")


def run(options: argparse.Namespace, console: Console) -> int:
    from potto.cli.opening import fail, opened, others_json, report_others
    from potto.evaluating.world import World
    from potto.reports.render import ProgramError

    world = World(["."])
    makers: dict[str, Callable[[World, str], Iterator[Section]]] = {
        "tokens": _tokens,
        "tree": _tree,
        "types": _types,
        "core": _core,
        "deriv": _deriv,
        "kernel": _kernel,
    }
    try:
        file = opened(world, options.file)
        sections = list(makers[options.kind](world, file))
    except ProgramError as error:
        return fail(error, options, console)
    if options.json:
        shown = [{"name": n, "text": t} for n, t in sections]
        console.answer_json({"kind": options.kind, "sections": shown, **others_json(world, file)})
    else:
        for name, text in sections:
            console.answer(f"# {name}\n{text}\n" if name else text)
    return report_others(world, file, options, console)


def _tokens(world: World, file: str) -> Iterator[Section]:
    from potto.modules import is_diffeo
    from potto.syntax import tokenize

    source = world.source(file)
    assert source is not None  # it was opened
    lines = []
    for token in tokenize(source.text, is_diffeo(file)):
        place = source.position(token.start)
        lines.append(f"{place.line + 1}:{place.column + 1}\t{token.kind}\t{token.text!r}")
    yield "", "\n".join(lines)


def _tree(world: World, file: str) -> Iterator[Section]:
    from potto.modules import chunks, is_diffeo, parsed
    from potto.syntax import dump_tree

    for chunk in chunks(world.db, file):
        item = parsed(world.db, chunk.text, is_diffeo(file)).item
        if item is not None:
            yield "", dump_tree(item)


def _types(world: World, file: str) -> Iterator[Section]:
    from potto.modules import names
    from potto.types import format_type, interface

    db = world.db
    yield "", "\n".join(f"{name} : {format_type(interface(db, file, name).type)}" for name in names(db, file))


def _core(world: World, file: str) -> Iterator[Section]:
    from potto.core.printer import format_term
    from potto.elaborate import core
    from potto.modules import names

    for name in names(world.db, file):
        yield name, format_term(core(world.db, file, name).term)


def _deriv(world: World, file: str) -> Iterator[Section]:
    from potto.checking.facts import derivative_facts
    from potto.modules import names

    for name in filter(lambda name: world.is_sound(file, name), names(world.db, file)):
        facts = derivative_facts(world.db, file, name)
        if facts is not None:
            yield name, facts.text


def _kernel(world: World, file: str) -> Iterator[Section]:
    from potto.modules import names
    from potto.runtime.dumping import kernel_text

    for name in filter(lambda name: world.is_sound(file, name), names(world.db, file)):
        text = kernel_text(world.program, file, name)
        if text is not None:
            yield name, text
