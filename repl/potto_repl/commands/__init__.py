"""The commands of the prompt, a module for each group. Importing this fills the table of `registry`."""

from potto_repl.commands import asking, checking, drawing, evaluating, files, fitting, help, keeping, settings, system

__all__ = ["asking", "checking", "drawing", "evaluating", "files", "fitting", "help", "keeping", "settings", "system"]
