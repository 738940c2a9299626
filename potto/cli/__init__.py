"""The command line: `potto COMMAND …`.

Owns nothing but the list of commands. Each command is one module with `SUMMARY`, `EXAMPLE`, `configure(parser)` and
`run(args, console) -> int`; a module imports what it needs inside `run`, so that no command pays for another.
"""

from __future__ import annotations

COMMANDS = (
    "run", "eval", "check", "deriv", "fmt", "test", "render", "view", "fit", "bench", "explain", "dump", "stubs",
    "cache", "repl", "replay", "kernel", "lsp",
)  # fmt: skip


def module_of(command: str) -> str:
    """The module of a command."""
    name = {"eval": "evaluate", "test": "doctest"}.get(command, command)
    return f"potto.cli.{name}"
