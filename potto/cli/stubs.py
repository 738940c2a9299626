"""`potto stubs`: what programs define, for type checkers of Python."""

from __future__ import annotations

import argparse
import os

from potto.cli.console import Console

SUMMARY = "write what a program defines as a stub for Python's type checkers"
EXAMPLE = "  potto stubs examples/paper/renderer.po -o renderer.pyi"


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", help="the program; `-` reads it from standard input")
    parser.add_argument("-o", "--output", metavar="FILE.pyi", help="where to write it; else it is the answer")


def run(options: argparse.Namespace, console: Console) -> int:
    from potto.cli.opening import fail, opened, others_json, report_others
    from potto.evaluating.world import World
    from potto.python.stubs import stub
    from potto.reports.render import ProgramError

    world = World(["."])
    try:
        file = opened(world, options.file)
    except ProgramError as error:
        return fail(error, options, console)
    text = stub(world, file)
    if options.output is not None:
        try:
            with open(options.output, "w", encoding="utf-8") as target:
                target.write(text)
        except OSError as error:
            reason = (error.strerror or str(error)).lower()
            console.complain(f"potto stubs: {os.fspath(options.output)} cannot be written: {reason}")
            return 2
    if options.json:
        console.answer_json({"stub": text, "output": options.output, **others_json(world, file)})
    elif options.output is None:
        console.answer(text.rstrip("\n"))
    else:
        console.complain(f"written to {options.output}")
    return report_others(world, file, options, console)
