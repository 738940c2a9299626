"""The colours of a file as they are sent, and what changed in them.

Owns `Colours` and `edits`.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

from msgspec import Struct

from potto_lsp.wire import Encoded


class TokenNumbers(Struct, frozen=True, dict=True):
    """The words of a piece as numbers: the line of the last one, and five for each, every word placed relative to the
    one before it. So they are the same wherever the piece stands, but for the first number."""

    last: int
    numbers: tuple[int, ...]

    @cached_property
    def text(self) -> bytes:
        """All but the first number as they are sent."""
        return b",".join([b"%d" % number for number in self.numbers[1:]])


class Colours(Struct, frozen=True):
    """The colours of a file: those of its pieces, and how many lines each piece begins below the last word of the one
    before."""

    id: str
    parts: list[TokenNumbers]
    below: list[int]

    def sent(self) -> Encoded:
        """All of them, as they are sent."""
        pieces = [b"%d,%b" % (below, part.text) for part, below in zip(self.parts, self.below)]
        return Encoded(pieces, {"resultId": self.id}, "data")

    def data(self, first: int, last: int) -> list[int]:
        """The numbers of some pieces."""
        found: list[int] = []
        for part, below in zip(self.parts[first:last], self.below[first:last]):
            found.append(below)
            found += part.numbers[1:]
        return found


def edits(old: Colours, new: Colours) -> list[dict[str, Any]]:
    """One edit that turns `old` into `new`: everything between their common beginning and end. Most of these are pieces
    that are the same objects, so their numbers are not compared."""
    least, head, tail = min(len(old.parts), len(new.parts)), 0, 0
    while head < least and _same(old, head, new, head):
        head += 1
    while tail < least - head and _same(old, len(old.parts) - 1 - tail, new, len(new.parts) - 1 - tail):
        tail += 1
    before, after = old.data(head, len(old.parts) - tail), new.data(head, len(new.parts) - tail)
    if before == after:
        return []
    start = sum([len(part.numbers) for part in old.parts[:head]])
    shortest = min(len(before), len(after))
    first = _in_common(before, after, shortest)
    last = _in_common(before[::-1], after[::-1], shortest - first)
    changed = after[first : len(after) - last]
    return [{"start": start + first, "deleteCount": len(before) - first - last, "data": changed}]


def _same(old: Colours, mine: int, new: Colours, other: int) -> bool:
    return old.parts[mine] is new.parts[other] and old.below[mine] == new.below[other]


def _in_common(old: list[int], new: list[int], most: int) -> int:
    """The length of the common beginning of two lists, up to `most`."""
    return next((place for place in range(most) if old[place] != new[place]), most)
