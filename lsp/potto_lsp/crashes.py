"""Bugs of ours, survived: logged, told, and a feature that fails again and again on one text switched off for it.

Owns `Crashes`.
"""

from __future__ import annotations

import logging
import sys
from collections import Counter
from collections.abc import Callable
from typing import Any

logger = logging.getLogger(__name__)
MOST = 3  # failures in a row, after which a feature is off for that version of that file

Version = tuple[str, str, int | None]  # the method, the file, its version


class Crashes:
    """What failed how often."""

    def __init__(self, notify: Callable[[str, Any], None]) -> None:
        self._notify = notify
        self._count: Counter[Version] = Counter()

    def is_off(self, version: Version) -> bool:
        """Whether a feature has failed too often to be tried again."""
        return bool(self._count) and self._count[version] >= MOST

    def note(self, version: Version) -> None:
        """A feature failed; to be called where the exception is handled."""
        self._count[version] += 1
        self.tell(f"{version[0]} for {version[1] or 'the workspace'}")
        if self._count[version] == MOST:
            self._log(f"{version[0]} is off for {version[1] or 'the workspace'} until that changes")

    def forget(self, version: Version) -> None:
        """A feature works."""
        if self._count:
            self._count.pop(version, None)

    def tell(self, what: str) -> None:
        """Something failed; to be called where the exception is handled."""
        error = sys.exc_info()[1]
        logger.error("%s failed", what, exc_info=True)
        self._log(f"{what} failed; this is a bug in Potto: {type(error).__name__}: {error}")

    def _log(self, message: str) -> None:
        self._notify("window/logMessage", {"type": 1, "message": message})
