"""The commands of the prompt: one table, filled by `@command`.

Owns `PromptCommand`, `COMMANDS` and how a word finds its command. The docstring of a command is its help: the first
line in the overview, all of it in `:help NAME`.
"""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Literal

from msgspec import Struct

from potto_repl.reply import Part, Refusal

if TYPE_CHECKING:
    from potto_repl.session import Conversation

Result = str | Part | Iterator[Part] | list[Part]
Run = Callable[["Conversation", str], Result]
Completes = Literal["expression", "name", "file", "code", "setting", "method", "command", "nothing"]


class PromptCommand(Struct, frozen=True):
    """A command: `name` and a `short` form, what its argument is called, and how that is completed."""

    name: str
    short: str
    argument: str
    completes: Completes
    help: str
    run: Run

    @property
    def summary(self) -> str:
        return self.help.partition("\n")[0]

    @property
    def usage(self) -> str:
        return f":{self.name} {self.argument}".rstrip()


COMMANDS: dict[str, PromptCommand] = {}


def command(
    name: str, short: str = "", *, argument: str = "", completes: Completes = "nothing"
) -> Callable[[Run], Run]:
    """Declare a command of the prompt."""

    def declare(run: Run) -> Run:
        if name in COMMANDS:
            raise ValueError(f"the command {name} is declared twice")
        COMMANDS[name] = PromptCommand(name, short, argument, completes, inspect.getdoc(run) or "", run)
        return run

    return declare


def find(word: str) -> PromptCommand:
    """The command that a word means: its name, its short form or a prefix that only it has. Raises Refusal."""
    if word in COMMANDS:
        return COMMANDS[word]
    shorts = [entry for entry in COMMANDS.values() if word and entry.short == word]
    found = shorts or [entry for entry in COMMANDS.values() if word and entry.name.startswith(word)]
    if len(found) == 1:
        return found[0]
    if found:
        several = ", ".join(f"`:{entry.name}`" for entry in found)
        raise Refusal(f"`:{word}` could be {several}", "write one more letter")
    near = difflib.get_close_matches(word, COMMANDS, 1)
    raise Refusal(f"there is no command `:{word}`", f"did you mean `:{near[0]}`?" if near else "`:help` lists them")
