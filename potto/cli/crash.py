"""The report on a bug of ours: a few lines for the person, everything else in a file."""

from __future__ import annotations

import os
import platform
import shlex
import sys
import tempfile
import traceback
from collections.abc import Sequence

from potto import __version__


def report(arguments: Sequence[str], error: BaseException) -> str:
    """Write the details to a file and say in a few lines what happened and where that file is."""
    command = shlex.join(["potto", *arguments])
    place = _write(command, error)
    return "\n".join(
        [
            f"potto: internal error ({type(error).__name__}); this is a bug in Potto, not in your program",
            f"  version: {__version__}",
            f"  command: {command}",
            f"  report:  {place}",
        ]
    )


def _write(command: str, error: BaseException) -> str:
    details = "".join(traceback.format_exception(error, limit=-60))
    text = f"potto {__version__}, Python {sys.version}, {platform.platform()}\n{command}\n{_folder()}\n\n{details}"
    try:
        handle, path = tempfile.mkstemp(prefix="potto-crash-", suffix=".txt", text=True)
        with os.fdopen(handle, "w", encoding="utf-8", errors="backslashreplace") as file:
            file.write(text)
    except OSError as problem:
        return f"(could not be written: {problem})"
    return path


def _folder() -> str:
    try:
        return os.getcwd()
    except OSError as problem:  # it was removed
        return f"({problem})"
