"""What stands above the first prompt.

Owns `greeting` and `say`.
"""

from __future__ import annotations

import shutil
import sys
import textwrap

from potto import __version__


def greeting() -> str:
    """The line above the first prompt."""
    text = f"Potto {__version__}   :help says what can be done, Ctrl-D leaves"
    return textwrap.fill(text, shutil.get_terminal_size().columns)


def say(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()
