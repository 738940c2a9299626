"""From the words of a command line to the command that they name.

Owns the parser of arguments and what all commands share. Only the module of the command that runs is imported.
"""

from __future__ import annotations

import argparse
import gc
import importlib
import os
import sys
from collections.abc import Callable
from typing import Any, NoReturn

from potto import __version__
from potto.cli import COMMANDS, module_of
from potto.cli.console import Console, standard_console

# Of the garbage collector: nearly all that a command loads and makes stays. At 50,000 objects a first look at them
# takes 14 of the 280 ms of a small `eval`; with Python's own thresholds it is 20.
THRESHOLDS = (200_000, 20, 20)


class _Parser(argparse.ArgumentParser):
    """An argument parser that says what is wrong in one line and where to read more."""

    def error(self, message: str) -> NoReturn:
        sys.stderr.write(f"{self.prog}: {message}\ntry `{self.prog} --help`\n")
        raise SystemExit(2)


class _Formatter(argparse.RawDescriptionHelpFormatter):
    """Help as wide as the screen. argparse asks for that whenever an option is added, by way of shutil and all that
    unpacks archives."""

    def __init__(self, prog: str) -> None:
        super().__init__(prog, width=_columns() - 2)


def _columns() -> int:
    try:
        return int(os.environ.get("COLUMNS", "")) or 80
    except ValueError:
        pass
    try:
        return os.get_terminal_size(sys.stdout.fileno()).columns or 80
    except (OSError, ValueError):
        return 80


def dispatch(arguments: list[str]) -> int:
    """Find the command, parse its arguments, run it."""
    if arguments and arguments[0] in COMMANDS:
        gc.set_threshold(*THRESHOLDS)
        module = importlib.import_module(module_of(arguments[0]))
        parser = _command_parser(arguments[0], module)
        prepare: Callable[[list[str]], list[str]] = getattr(module, "prepare", list)
        words = prepare(arguments[1:])
        # Words that options stand between take a second look, for which the usage is written out first.
        parse = parser.parse_intermixed_args if any(word.startswith("-") for word in words) else parser.parse_args
        options = parse(words)
        run: Callable[[argparse.Namespace, Console], int] = module.run
        console = standard_console(options.color)
        status = run(options, console)
        _tell_of_the_store(console)
        return status
    return _without_command(arguments)


def _tell_of_the_store(console: Console) -> None:
    from potto.store import refused

    complaint = refused()
    if complaint is not None:
        console.complain(f"warning: {complaint}")


def _without_command(arguments: list[str]) -> int:
    if not arguments or arguments[0] in ("-h", "--help", "help"):
        (sys.stdout if arguments else sys.stderr).write(_overview())
        return 0 if arguments else 2
    if arguments[0] in ("-V", "--version"):
        sys.stdout.write(f"potto {__version__}\n")
        return 0
    word = arguments[0]
    if word.startswith("-"):
        sys.stderr.write(f"potto: there is no option {word}\ntry `potto --help`\n")
        return 2
    import difflib

    near = difflib.get_close_matches(word, COMMANDS, 1)
    hint = f"; did you mean `{near[0]}`?" if near else ""
    sys.stderr.write(f"potto: there is no command `{word}`{hint}\ntry `potto --help`\n")
    return 2


def _command_parser(name: str, module: Any) -> argparse.ArgumentParser:
    parser = _Parser(
        prog=f"potto {name}",
        description=module.SUMMARY,
        epilog=f"example:\n{module.EXAMPLE}",
        formatter_class=_Formatter,
        allow_abbrev=False,
    )
    module.configure(parser)
    parser.add_argument("--json", action="store_true", help="answer with one JSON object")
    parser.add_argument(
        "--color",
        choices=("auto", "always", "never"),
        default="auto",
        help="colours: auto means on a terminal, unless NO_COLOR is set",
    )
    return parser


def _overview() -> str:
    lines = ["usage: potto COMMAND …", "", "A language whose integrals may jump and still have exact derivatives.", ""]
    lines.append("commands:")
    for name in COMMANDS:
        lines.append(f"  {name:<9} {importlib.import_module(module_of(name)).SUMMARY}")
    lines += ["", "`potto COMMAND --help` says more, with an example. `potto --version` says which Potto this is.", ""]
    return "\n".join(lines)
