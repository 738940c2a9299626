r"""Potto inside of a Python notebook: `%load_ext potto`, then `%potto f(0.3)` and `%%potto` for cells of definitions.

Owns `load_ipython_extension`. What a cell defines is in scope in later cells, and in Python under the same name, as
functions that are called with numbers, arrays and each other. Needs IPython, which the extra `jupyter` brings.
"""

from __future__ import annotations

import re
from typing import Any

from msgspec.structs import replace

from potto.evaluating.session import Defined, Said, Session, Valued
from potto.kernels.errors import wrong_call
from potto.python.api import Module
from potto.reports.render import Located, ProgramError
from potto_repl.answers import NOT_DEFINED
from potto_repl.backslash_symbols import readable


class CellError(ProgramError):
    """What is wrong in a cell. Notebooks show the message in place of a traceback."""

    def _render_traceback_(self) -> list[str]:
        return [str(self)]


class Cells:
    """The session of one notebook, and the names of Python that it fills."""

    def __init__(self, shell: Any) -> None:
        self.shell = shell
        self.session = Session(["."])

    def line(self, line: str) -> Any:
        r"""`%potto f(0.3)` is an answer, `%potto \t . f(t)^2` a function; `{t}` is the value of Python's `t`."""
        return self._run(line)

    def cell(self, line: str, cell: str) -> Any:
        """`%%potto` above definitions. The value is that of the last line if it is an expression; without one, the
        function that was defined last."""
        return self._run(line + "\n" + cell)  # the line of `%%potto` counts: messages name the lines of the cell

    def _run(self, text: str) -> Any:
        session = self.session
        session.world.refresh()
        command = re.match(r"\s*(:\w+)", text)
        if command is not None:
            help = "commands are for the prompt and for notebooks of Potto's kernel"
            raise wrong_call(f"`{command[1]}` is a command, and `%potto` takes expressions and definitions", help)
        session.cell = self.shell.displayhook.prompt_count  # as in `Out[3]`
        found: Any = None
        wrong: list[Located] = []
        for outcome in session.steps(readable(text)):
            match outcome:
                case Said(located=located):
                    wrong += [self._with_braces(located)] if outcome.is_error else []
                case Defined(name=name, file=file):
                    found = getattr(Module(session.world, file), name)
                    self.shell.user_ns[name] = found
                case Valued(type=None, text=shown):
                    print(shown)
                case Valued():
                    found = self._value(outcome)
        if wrong:
            raise CellError(wrong, session.source)
        return found

    def _with_braces(self, located: Located) -> Located:
        """How to pass on a name that means something in Python alone."""
        found, source = located.diagnostic, self.session.source(located.file) if located.file is not None else None
        name = "" if source is None else source.text[found.span.start : found.span.end]
        if found.code != NOT_DEFINED or name not in self.shell.user_ns:
            return located
        return replace(
            located, diagnostic=replace(found, help=f"`{name}` is a name of Python: `{{{name}}}` is its value")
        )

    def _value(self, outcome: Valued) -> Any:
        if outcome.estimates:
            return outcome.estimates[0]
        return getattr(Module(self.session.world, self.session.file), outcome.names[-1])


def load_ipython_extension(shell: Any) -> None:
    """Register `%potto` and `%%potto` in an IPython shell."""
    cells = Cells(shell)

    def potto(line: str, cell: str | None = None) -> Any:
        return cells.line(line) if cell is None else cells.cell(line, cell)

    potto.__doc__ = f"{Cells.line.__doc__}\n\n{Cells.cell.__doc__}"
    shell.register_magic_function(potto, magic_kind="line_cell")
