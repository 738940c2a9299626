"""The commands of the prompt, a module for each group. Importing this fills the table of `registry`."""

from potto_repl.commands import (
    checking,
    drawing,
    evaluating,
    explaining,
    files,
    fitting,
    help,
    keeping,
    settings,
    system,
)

__all__ = [
    "checking", "drawing", "evaluating", "explaining", "files", "fitting", "help", "keeping", "settings", "system",
]  # fmt: skip
