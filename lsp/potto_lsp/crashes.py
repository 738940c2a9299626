"""Surviving bugs of ours: they are logged and reported, and a feature that keeps failing on a text is turned off for
it.

Owns `Crashes`.
"""

from __future__ import annotations

import logging
import sys
from collections import Counter
from collections.abc import Callable
from typing import Any

logger = logging.getLogger(__name__)
MOST = 3  # failures in a row that turn a feature off for that version of the file

Version = tuple[str, str, int | None]  # the method, the file, its version


class Crashes:
    """Counts failures."""

    def __init__(self, notify: Callable[[str, Any], None]) -> None:
        self._notify = notify
        self._count: Counter[Version] = Counter()

    def is_off(self, version: Version) -> bool:
        """Whether a feature has failed too often to be tried again."""
        return bool(self._count) and self._count[version] >= MOST

    def note(self, version: Version) -> None:
        """Count a failure of a feature. Call it where the exception is handled."""
        self._count[version] += 1
        self.tell(f"{version[0]} for {version[1] or 'the workspace'}")
        if self._count[version] == MOST:
            self._log(f"{version[0]} is off for {version[1] or 'the workspace'} until that changes")

    def forget(self, version: Version) -> None:
        """A feature worked: start counting anew."""
        if self._count:
            self._count.pop(version, None)

    def tell(self, what: str) -> None:
        """Report a failure to the user. Call it where the exception is handled."""
        error = sys.exc_info()[1]
        logger.error("%s failed", what, exc_info=True)
        self._log(f"{what} failed; this is a bug in Potto: {type(error).__name__}: {error}")

    def _log(self, message: str) -> None:
        self._notify("window/logMessage", {"type": 1, "message": message})
