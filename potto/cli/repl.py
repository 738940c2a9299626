"""`potto repl`: the prompt."""

from __future__ import annotations

import argparse
import os
import sys
from typing import TYPE_CHECKING, TextIO

from potto.cli.console import Console, wants_color
from potto.cli.evaluation_options import add_options, settings_of

if TYPE_CHECKING:
    from potto_repl.paint import Screen

SUMMARY = "a prompt: define, evaluate and differentiate; or a script of it from a pipe"
EXAMPLE = "  potto repl examples/paper/renderer.po\n  echo 'integral [0, 1] x d(x)' | potto repl --json"


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", nargs="?", metavar="FILE", help="a program whose names are in scope")
    parser.add_argument("-c", dest="entries", action="append", default=[], metavar="EXPR",
                        help="answer this entry or command and leave; may be given several times")  # fmt: skip
    parser.add_argument("--keep-going", action="store_true", help="in a script, carry on after an error")
    parser.add_argument("--vi", action="store_true", help="vi keys (also `:set keys vi`)")
    parser.add_argument("--theme", choices=("dark", "light", "none"), default="dark", help="colours of the prompt")
    parser.add_argument("--ascii", action="store_true", help="no symbols beyond ASCII")
    add_options(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    settings = settings_of(options, console)
    if settings is None:
        return 2
    terminal = sys.stdin.isatty() and sys.stdout.isatty() and not options.entries and not options.json
    if terminal:
        from potto_repl.start import talk

        return talk(options, settings, color=wants_color(options.color, sys.stdout), unicode=_unicode(options))
    from potto_repl.options import Options
    from potto_repl.session import Conversation
    from potto_repl.without_terminal import entries, run

    session = Conversation(["."])
    session.settings = settings
    session.options = Options(unicode=False)  # symbols that everything behind a pipe reads
    texts = options.entries or entries(sys.stdin)
    return run(
        session, texts, console.out, console.err,
        look=_look(options, console.out), complain=_look(options, console.err),
        as_json=options.json, keep_going=options.keep_going, load=options.file,
    )  # fmt: skip


def _look(options: argparse.Namespace, stream: TextIO) -> Screen:
    from potto_repl.paint import Screen

    return Screen(answers=False, color=wants_color(options.color, stream), unicode=_unicode(options))


def _unicode(options: argparse.Namespace) -> bool:
    """Whether the locale can write symbols."""
    encoding = (getattr(sys.stdout, "encoding", None) or "ascii").lower().replace("-", "")
    return not options.ascii and encoding.startswith("utf") and os.environ.get("TERM") != "linux"
