"""What an installation leaves behind, so that processes are timed as users have them.

Owns `as_installed`. pip compiles what it installs, but not a working copy that is used where it stands.
"""

from __future__ import annotations

import compileall
from pathlib import Path

PACKAGES = ("potto", "lsp/potto_lsp", "repl/potto_repl")


def as_installed() -> None:
    """Compile the packages, as far as they are not."""
    for package in PACKAGES:
        compileall.compile_dir(Path(__file__).parent.parent / package, quiet=1)
