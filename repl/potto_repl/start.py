"""The way to the first prompt: the one for terminals, or the one for those that can do nothing.

Owns `talk`.
"""

from __future__ import annotations

import argparse
import os

from potto.projects.settings import Settings
from potto_repl.session_loading import Loader


def talk(options: argparse.Namespace, settings: Settings, *, color: bool, unicode: bool) -> int:
    """Run the prompt on a terminal; the exit status."""
    loader = Loader(settings, unicode)
    if os.environ.get("TERM") in ("dumb", "unknown"):
        from potto_repl.simple import Simple

        return Simple(loader, unicode=unicode).run(options.file)
    from potto_repl.terminal import Terminal

    theme = options.theme if color else "none"
    terminal = Terminal(loader, theme=theme, color=color, unicode=unicode, vi=options.vi)
    return terminal.run(options.file)
