"""What files were found to hold, kept in memory by what is in them, so that each is parsed once.

Owns `Memory`: bounded by the numbers in it and by how many files there are; the longest unused go first.
"""

from __future__ import annotations

from collections import OrderedDict
from threading import Lock

from potto.data.mistakes import DataMistake
from potto.data.values import Value, size

Found = Value | DataMistake


class Memory:
    """A bounded memory; `numbers` of eight bytes each and `files` are its bounds."""

    def __init__(self, numbers: int = 32_000_000, files: int = 64) -> None:
        self.numbers, self.files = numbers, files
        self._kept: OrderedDict[str, Found] = OrderedDict()
        self._used = 0
        self._lock = Lock()

    def get(self, key: str) -> Found | None:
        """What was kept under a key."""
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
            return self._kept.get(key)

    def put(self, key: str, found: Found) -> None:
        """Keep something, if it is within the bounds at all."""
        if _cost(found) > self.numbers:
            return
        with self._lock:
            self._used += _cost(found) - (_cost(self._kept.pop(key)) if key in self._kept else 0)
            self._kept[key] = found
            while self._used > self.numbers or len(self._kept) > self.files:
                self._used -= _cost(self._kept.popitem(last=False)[1])

    def clear(self) -> None:
        """Forget everything."""
        with self._lock:
            self._kept.clear()
            self._used = 0

    def __len__(self) -> int:
        return len(self._kept)


def _cost(found: Found) -> int:
    return 1 if isinstance(found, DataMistake) else size(found)
