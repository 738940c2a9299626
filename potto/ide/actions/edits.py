"""Edits of texts: applying them, and the least that leads from one text to another."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping, Sequence

from potto.ide.model import Change, Edit, FileEdits
from potto.source import Span

_BLANKS = re.compile(r"\s+")


def applied(text: str, edits: Iterable[Edit]) -> str:
    """A text with edits made; they do not overlap."""
    parts: list[str] = []
    at = 0
    for edit in sorted(edits, key=lambda e: (e.span.start, e.span.end)):
        parts += (text[at : edit.span.start], edit.text)
        at = edit.span.end
    return "".join((*parts, text[at:]))


def change_of(edits: Mapping[str, Sequence[Edit]]) -> Change:
    """A change from the edits of each file, put in order, each once."""
    return Change(
        tuple(
            FileEdits(file, tuple(sorted(dict.fromkeys(given), key=lambda e: e.span)))
            for file, given in edits.items()
            if given
        )
    )


def one_file(file: str, *edits: Edit) -> Change:
    """A change of one file."""
    return change_of({file: edits})


def minimal(old: str, new: str, start: int = 0) -> tuple[Edit, ...]:
    """Small edits from one text to another: only of blanks if nothing else differs, otherwise by lines and then within
    them. `start` is added to the places."""
    if old == new:
        return ()
    if "".join(old.split()) == "".join(new.split()):
        return _respaced(old, new, start)
    before, after = old.splitlines(keepends=True), new.splitlines(keepends=True)
    out: list[Edit] = []
    offsets = [0]
    for line in before:
        offsets.append(offsets[-1] + len(line))
    matcher = difflib.SequenceMatcher(None, before, after, autojunk=False)
    for tag, first, last, new_first, new_last in matcher.get_opcodes():
        if tag == "equal":
            continue
        if tag == "replace" and last - first == new_last - new_first:
            for number in range(last - first):
                place, text = start + offsets[first + number], after[new_first + number]
                out += _in_line(before[first + number], text, place)
            continue
        place = start + offsets[first]
        out.append(_trimmed("".join(before[first:last]), "".join(after[new_first:new_last]), place))
    return tuple(out)


def _respaced(old: str, new: str, start: int) -> tuple[Edit, ...]:
    """The edits where texts differ in nothing but blanks: one for each place, in time proportional to their length; a
    search for what they have in common would take the square of it."""
    before, after, blanks, out = _gaps(old), _gaps(new), 0, list[Edit]()
    for solid in sorted({*before, *after}):
        first, last = before.get(solid, (solid + blanks, solid + blanks))
        wanted = new[slice(*after.get(solid, (0, 0)))]
        if old[first:last] != wanted:
            out.append(_trimmed(old[first:last], wanted, start + first))
        blanks += last - first
    return tuple(out)


def _gaps(text: str) -> dict[int, tuple[int, int]]:
    """The runs of blanks of a text, by how many other characters stand before them."""
    found, blanks = dict[int, tuple[int, int]](), 0
    for gap in _BLANKS.finditer(text):
        found[gap.start() - blanks] = gap.span()
        blanks += len(gap.group())
    return found


def _in_line(old: str, new: str, start: int) -> list[Edit]:
    if old == new:
        return []
    matcher = difflib.SequenceMatcher(None, old, new, autojunk=False)
    return [
        Edit(Span(start + first, start + last), new[new_first:new_last])
        for tag, first, last, new_first, new_last in matcher.get_opcodes()
        if tag != "equal"
    ]


def _trimmed(old: str, new: str, start: int) -> Edit:
    """One edit without what both texts begin and end with."""
    head = 0
    while head < min(len(old), len(new)) and old[head] == new[head]:
        head += 1
    tail = 0
    while tail < min(len(old), len(new)) - head and old[-1 - tail] == new[-1 - tail]:
        tail += 1
    return Edit(Span(start + head, start + len(old) - tail), new[head : len(new) - tail])
