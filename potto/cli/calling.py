"""Functions and arguments on a command line: `NAME name=EXPR …`, with the file's names in scope."""

from __future__ import annotations

import argparse
import os
import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from potto.checking.library import Library
    from potto.evaluating.given import Given
    from potto.evaluating.world import World
    from potto.python.functions import Function

_IN_PROGRAMS = re.compile(r"\w+(\.\w+|\[[^][]*\])*")


def with_values(arguments: list[str], *options: str) -> list[str]:
    """Words of a command line, with the values of some options joined to them, since they may begin with a minus:
    `--box -1,1` as `--box=-1,1`."""
    joined: list[str] = []
    for word in arguments:
        if joined and joined[-1] in options:
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined


def assignment(text: str) -> tuple[str, str]:
    """`name=EXPR` as a pair; for argparse."""
    name, equals, expression = text.partition("=")
    if not equals or not name.strip().isidentifier() or not expression.strip() or expression.startswith("="):
        raise argparse.ArgumentTypeError(f"{text!r} does not say which parameter it is for; write `name=value`")
    return name.strip(), from_file(expression.strip())


def from_file(text: str) -> str:
    """`@heights.csv` or `@people.csv:height` as the program text that loads it; any other text as it is."""
    if not text.startswith("@"):
        return text
    path, colon, column = text[1:].partition(":")
    if os.name == "nt" and len(path) == 1:  # of a drive
        rest, colon, column = column.partition(":")
        path = f"{path}:{rest}"
    whole = f'load("{os.path.abspath(path)}")'
    if colon and not _IN_PROGRAMS.fullmatch(column):  # as the file has it: `height (cm)`
        from potto.data.encodings import identifiers

        column = identifiers([column])[0]
    return f"({whole}).{column}" if colon else _only(whole, path)


def _only(whole: str, path: str) -> str:
    """The one column of a table that has no other, nor one that was left out as it lacks values: that may be meant."""
    from pathlib import Path

    from potto.data.files import read, shape_of
    from potto.data.values import RecordColumns

    content = read(Path(path))
    shape = shape_of(Path(path), content) if isinstance(content, bytes) else None
    if isinstance(shape, RecordColumns) and len(shape.fields) == 1 and not shape.gaps:
        return f"({whole}).{shape.fields[0][0]}"
    return whole


def add_set(parser: argparse.ArgumentParser) -> None:
    """The option that gives names of the program other values."""
    parser.add_argument(
        "--set", dest="set", metavar="NAME=EXPR", action="append", default=[], type=assignment,
        help="what a name of the program stands for instead, or one more name, or what a parameter is given; "
             "`xs=@heights.csv` is what a file holds, `xs=@people.csv:height` a column",
    )  # fmt: skip


def called(world: Library, options: argparse.Namespace, said: Given = ()) -> tuple[str, argparse.Namespace]:
    """The key of the file of a command that calls the function NAME, and its options, as if what `--set` says of
    parameters had been given to the function. said: what else is said of parameters, and other texts under no name.
    Raises ProgramError."""
    from potto.cli.opening import opened

    file = opened(world, options.file, after=options.name)
    if not options.set:
        return file, options
    from potto.evaluating.given import apart, each_once, give, nobody_asks, parameters_of, unknown
    from potto.modules import names

    each_once(options.set)
    said = [*options.given, *said]
    for_names, for_parameters = apart(world, file, options.set, options.name, {name for name, _ in said})
    texts = [options.name, *(text for _, text in [*options.set, *said])]
    for name in nobody_asks(world, file, for_names, texts):
        raise unknown(world, name, names(world.db, file), parameters_of(world, file, options.name))
    give(world, file, for_names)
    return file, argparse.Namespace(**{**vars(options), "set": for_names, "given": [*options.given, *for_parameters]})


def function_in(world: World, file: str, text: str) -> Function:
    """The function that an expression stands for. Raises ProgramError, PottoError."""
    from potto.kernels.errors import wrong_call
    from potto.python.functions import Function
    from potto.types.types import Diffeo
    from potto.types.types import Function as FunctionType

    tree, type = world.typed(file, text)
    if not isinstance(type, FunctionType | Diffeo):
        raise wrong_call(
            f"`{text}` is not a function", "name a function of the program, or write one: `\\(x, y) . x*y`"
        )
    return Function(world, file, tree, type)


def argument_in(world: World, file: str, text: str, name: str = "") -> Any:
    """What a parameter, of this name if it is known, is given: a function, or numbers; records as dicts, so that their
    fields find each other by name. Raises ProgramError."""
    from potto.applications.fitting import by_fields
    from potto.evaluating.answering import EXPRESSION
    from potto.evaluating.given import as_typed
    from potto.python.functions import Function
    from potto.reports.render import ProgramError
    from potto.types.types import Diffeo
    from potto.types.types import Function as FunctionType

    try:
        tree, type = world.typed(file, text)
        if isinstance(type, FunctionType | Diffeo):
            return Function(world, file, tree, type)
        return by_fields(world.evaluate(file, text).estimate.value, type)
    except ProgramError as error:
        if not all(located.file == EXPRESSION for located in error.located):
            raise
        raise as_typed(f"{name}=" if name else "", text, error.located, world) from None


def arguments_in(world: World, file: str, given: Given) -> dict[str, Any]:
    """Parameters with what they are given. Raises ProgramError."""
    from potto.evaluating.given import each_once

    each_once(given)
    return {name: argument_in(world, file, text, name) for name, text in given}
