"""Signature help of what is not a call: folds and sums, and the fields of a record behind `with`. Owns `form_help`."""

from __future__ import annotations

import re
from collections.abc import Sequence

from potto.ide.completion.parts_of_values import changed_at, whole_type
from potto.ide.completion.place import operand_start
from potto.ide.model import ParameterText, Signature, SignatureHelp
from potto.ide.names.keywords import KEYWORDS
from potto.ide.names.places import site_at
from potto.query import Database
from potto.source import Span
from potto.types import TupleOf, format_type

_FORM = re.compile(r"(?<![\w.])(fold|sum|product|min|max)\s+(?=[^\W\d(]|\(|$)")
_FOLD = ("state = start", "for i in lo..hi", "(step)")
_SUM = ("i in lo..hi", "(body)")


def form_help(db: Database, file: str, offset: int) -> SignatureHelp | None:
    """What is to be written of the fold, the sum or the `with` at an offset, and which part of it is being written."""
    return _with(db, file, offset) or _through(db, file, offset)


def signature(head: str, parts: Sequence[str], tail: str, documentation: str, active: int | None) -> SignatureHelp:
    """One signature, its parts between commas, or between blanks where `head` ends with one."""
    between = " " if head.endswith(" ") else ", "
    text, places = head, list[ParameterText]()
    for number, part in enumerate(parts):
        text += between if number else ""
        places.append(ParameterText(Span(len(text), len(text) + len(part))))
        text += part
    return SignatureHelp((Signature(text + tail, documentation, tuple(places), active),), 0)


def _with(db: Database, file: str, offset: int) -> SignatureHelp | None:
    """The fields that `with` can change."""
    site = site_at(db, file, offset)
    place = changed_at(site.text, site.offset)
    if place is None:
        return None
    operand, written, last = place
    start = operand_start(site.text, operand)
    type = None if start is None else whole_type(db, site, Span(start, operand))
    if not isinstance(type, TupleOf) or type.record is None:
        return None
    fields = type.record.fields
    shown = [f"{name}: {format_type(item)}" for name, item in zip(fields, type.items)]
    left = [number for number, name in enumerate(fields) if name not in written]
    active = fields.index(last) if last in fields else next(iter(left), None)
    doc = f"A `{type.record.name}` with other values of some fields."
    return signature(f"{site.text[start:operand]} with (", shown, ")", doc, active)


def _through(db: Database, file: str, offset: int) -> SignatureHelp | None:
    """A fold or a sum that is not finished."""
    site = site_at(db, file, offset)
    if site.chunk is None:
        return None
    before = site.text[site.chunk.start : site.offset]
    for found in reversed(list(_FORM.finditer(before))):
        place = _part(found[1], before[found.end() :])
        if place is not None:
            parts = _FOLD if found[1] == "fold" else _SUM
            doc = KEYWORDS["sum" if found[1] == "sum" else "fold" if found[1] == "fold" else "product"].doc
            return signature(f"{found[1]} ", parts, "", doc, place)
    return None


def _part(word: str, rest: str) -> int | None:
    """Which part of the form a text ends in that begins behind its word; None if it is finished, or none."""
    body = _body(rest)
    if body is None:
        return None
    is_fold, inside = word == "fold", body >= 0
    if is_fold and not re.search(r"=(?!=)", rest):
        return 0 if re.fullmatch(r"\(?[\w\s,]*\)?\s*", rest) else None
    if not is_fold and not re.match(r"[^\W\d]\w*\s+in\b", rest):
        return 0 if re.fullmatch(r"\w*\s*(i?n?)", rest) and word == "sum" else None
    if inside:
        return 2 if is_fold else 1
    return 1 if is_fold and re.search(r"\bfor\b", rest) else 0


def _body(rest: str) -> int | None:
    """Where the body of a form opens, -1 if it doesn't yet, None if it is closed."""
    started = re.search(r"\bin\b", rest)
    depth = 0
    for place, char in enumerate(rest):
        over = "" if started is None else rest[started.end() : place]
        if depth == 0 and char == "(" and re.search(r"[\w)\]]\s+$", over):
            return place if _open(rest[place:]) else None
        depth += (char in "([") - (char in ")]")
        if depth < 0 or (char == "\n" and depth == 0):
            return None
    return -1


def _open(text: str) -> bool:
    """Whether the bracket that a text begins with is open at its end."""
    depth = 0
    for char in text:
        depth += (char in "([") - (char in ")]")
        if depth == 0:
            return False
    return True
