"""`:help`: the commands, one by one or all of them."""

from __future__ import annotations

from potto_repl.registry import COMMANDS, command, find
from potto_repl.reply import Part
from potto_repl.session import Conversation

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
        return Part("answer", f"{entry.usage}{short}\n\n{entry.help}", {"command": entry.name, "help": entry.help})
    width = max(len(entry.usage) for entry in COMMANDS.values())
    rows = [f"  {entry.usage:<{width}}  {entry.summary}" for entry in sorted(COMMANDS.values(), key=lambda e: e.name)]
    listed = {entry.name: entry.summary for entry in COMMANDS.values()}
    return Part("answer", INTRODUCTION + "\n" + "\n".join(rows), {"commands": listed})
