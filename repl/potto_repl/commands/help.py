"""`:help`: the commands, one by one or all of them."""

from __future__ import annotations

from potto.reports.render import broken
from potto_repl.registry import COMMANDS, PromptCommand, command, find
from potto_repl.reply import Part
from potto_repl.session import Conversation

USAGE, NARROW = 28, 60  # columns for how a command is written, on screens that are not narrow
INTRODUCTION = """Write a definition or an expression; a derivative is an expression as well:

  def f(t) integral [0, 1] [x < t] d(x)
  f(0.3)
  deriv(f)((0.3, 1))

`_` is the last answer, `_3` or `Out[3]` the third; `name?` asks about a name. Commands may be shortened: `:ty`, `:t`.
"""


@command("help", "h", argument="[COMMAND]", completes="command")
def show_help(session: Conversation, text: str) -> Part:
    """Say what the commands do; `:help COMMAND` says more about one."""
    if text:
        entry = find(text.lstrip(":"))
        short = f" (or `:{entry.short}`)" if entry.short else ""
        said = f"{entry.usage}{short}\n\n{entry.help}"
        return Part("answer", said, {"command": entry.name, "help": entry.help}, prose=True)
    columns = session.width()
    rows = [row for entry in sorted(COMMANDS.values(), key=lambda e: e.name) for row in _row(entry, columns)]
    listed = {entry.name: entry.summary for entry in COMMANDS.values()}
    return Part("answer", INTRODUCTION + "\n" + "\n".join(rows), {"commands": listed}, prose=True)


def _row(entry: PromptCommand, columns: int) -> list[str]:
    """A command and what it does, side by side where there is room for that."""
    beside = min(USAGE, columns // 3) if columns >= NARROW else 6
    summary = broken(entry.summary, max(columns - beside, 12), 0).split("\n")
    if len(entry.usage) + 4 <= beside:
        first, *rest = summary
        return [f"  {entry.usage:<{beside - 2}}{first}", *(" " * beside + line for line in rest)]
    return [f"  {entry.usage}", *(" " * beside + line for line in summary)]
