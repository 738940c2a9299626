"""What is in folders: the programs under the roots of a workspace, and the names that an import could mean.

Owns `Programs` and `list_folder`. A root may be somebody's home folder, and `.po` is also what gettext calls its
translations. So the walk is bounded in folders, files and bytes, nearest folders first; it leaves out hidden folders,
those that tools fill, what is too large to have been written by hand, and translations. What it leaves out is only not
listed: a file that is open or imported is read whatever it is.
"""

from __future__ import annotations

import os
import re
from collections import deque
from collections.abc import Iterator, Sequence

from potto.modules.lookup import SUFFIXES

MAX_FILES, MAX_FOLDERS = 20_000, 5_000
MAX_FILE_BYTES, MAX_TOTAL_BYTES = 1_000_000, 32_000_000
HEAVY = frozenset(
    {"node_modules", "bower_components", "__pycache__", "site-packages", "dist-packages", "venv", "env"}
    | {"build", "dist", "target", "LC_MESSAGES"}
)
SNIFFED = 16_384  # bytes at the start of a translation in which its first entry stands

_TRANSLATION = re.compile(rb"^(?:#~ ?)?msg(?:id|ctxt)[ \t]+\"", re.MULTILINE)
Stamp = tuple[int, int]


class Programs:
    """The programs under some folders. What was found out about a file holds until it changes."""

    def __init__(self) -> None:
        self._translations: dict[str, tuple[Stamp, bool]] = {}

    def under(self, roots: Sequence[str]) -> list[str]:
        """Their paths, in no order that matters."""
        found: list[str] = []
        budget = MAX_TOTAL_BYTES
        for entry in _walk(roots):
            size = self._size(entry)
            if size is None or size > budget:
                continue
            budget -= size
            found.append(entry.path)
            if len(found) >= MAX_FILES:
                break
        return found

    def _size(self, entry: os.DirEntry[str]) -> int | None:
        """The bytes of a file that is to be listed; None for one that is not."""
        try:
            if not entry.is_file():
                return None
            status = entry.stat()
        except OSError:
            return None
        if status.st_size > MAX_FILE_BYTES:
            return None
        if entry.name.endswith(".po"):
            stamp = (status.st_mtime_ns, status.st_size)
            known = self._translations.get(entry.path)
            if known is None or known[0] != stamp:
                known = self._translations[entry.path] = (stamp, is_translation(entry.path))
            if known[1]:
                return None
        return status.st_size


def _walk(roots: Sequence[str]) -> Iterator[os.DirEntry[str]]:
    """The files that are called like programs, folder by folder, the nearest first; links to folders are passed by."""
    folders = deque(roots)
    seen = set(roots)
    for _ in range(MAX_FOLDERS):
        if not folders:
            return
        try:
            with os.scandir(folders.popleft()) as listed:
                entries = sorted(listed, key=lambda entry: entry.name)
        except (OSError, ValueError):  # gone, or not ours to look into
            continue
        for entry in entries:
            if entry.name.endswith(SUFFIXES):
                yield entry
            elif not entry.name.startswith(".") and entry.name not in HEAVY and entry.path not in seen:
                try:
                    inside = entry.is_dir(follow_symlinks=False)
                except OSError:
                    continue
                if inside:
                    seen.add(entry.path)
                    folders.append(entry.path)


def is_translation(path: str) -> bool:
    """Whether a file is one of gettext's, as its first entry tells."""
    try:
        with open(path, "rb") as file:
            start = file.read(SNIFFED)
            return b"msg" in start and _TRANSLATION.search(start) is not None
    except OSError:
        return False


def list_folder(path: str) -> tuple[str, ...]:
    """The names in a folder that a module could be called by: programs, and folders (ending with `/`), sorted."""
    try:
        with os.scandir(path) as entries:
            names = [
                entry.name + ("/" if entry.is_dir() else "")
                for entry in entries
                if not entry.name.startswith(".") and (entry.is_dir() or entry.name.endswith(SUFFIXES))
            ]
    except (OSError, ValueError):  # no such folder, or not ours to look into: nothing is there to be imported
        return ()
    return tuple(sorted(names))
