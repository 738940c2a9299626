"""Records and arrays in the notations of other languages.

Owns `declared_elsewhere`, one message for a declaration with braces, with `=` or by lines (`type Row = {x: Real}`), and
`in_braces`, one for `{x: 1}` and `{1, 2}`; and how they are written here.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from potto.diagnostics import Diagnostic, Replacement, Suggestion, suggest
from potto.source import Span
from potto.syntax import kinds
from potto.syntax.tokens import Token

_DECLARING = ("record", "type", "data", "newtype", "typedef", "struct", "class", "interface")
_FIELD = re.compile(r"([^\W\d]\w*)\s*[:=]\s*([^:=,;{}\n]+)")
_TYPE = re.compile(r"[A-Z([]")
_NAME = re.compile(r"([^\W\d]\w*)\Z")
_ANY = "x: Real, y: Real"
MOST_FIELDS = 12  # that are written out in a hint


def declared_elsewhere(text: str, tokens: Sequence[Token]) -> tuple[str | None, Diagnostic] | None:
    """The name that a chunk with errors declares as other languages do, and what is said of that."""
    head = [token for token in tokens[:2] if token.kind == "NAME"]
    if len(head) < 2 or head[0].text not in _DECLARING:
        return None
    word, name = head
    fields = ", ".join(f"{field}: {type}" for field, type in _fields(text[name.end :]))
    written = f"record {name.text}({fields or _ANY})"
    suggestions = (suggest(Span(word.start, len(text.rstrip())), written),) if fields and "#" not in text else ()
    said = (
        "the fields of a record stand in parentheses behind its name"
        if word.text == "record"
        else f"Potto has no `{word.text}`: a value with named parts is a record"
    )
    span = word.span.cover(name.span)
    return name.text, kinds.OTHER_LANGUAGE(span, said, help=f"write `{written}`", suggestions=suggestions)


def in_braces(text: str, found: Sequence[Diagnostic]) -> Diagnostic | None:
    """What is said of a record or an array in braces. found: the messages of the text, two of them about the braces."""
    unknown = kinds.UNKNOWN_CHARACTER.code
    starts = [d.span.start for d in found if d.code == unknown and text[d.span.start] == "{"]
    end = text.find("}", starts[0]) if starts else -1
    if end < 0:
        return None
    start, inside = starts[0], text[starts[0] + 1 : end]
    span, fields = Span(start, end + 1), _fields(inside)
    if fields:
        types = all(_TYPE.match(what) for _, what in fields)
        record = ", ".join(f"{name}: {what if types else 'Real'}" for name, what in fields)
        value = ", ".join(f"{name}=…" if types else f"{name}={what}" for name, what in fields)
        known = _NAME.search(text[:start])
        if known is not None:
            help, suggestions = f"write `{known[1]}({value})`", (suggest(span, f"({value})"),) * (not types)
        else:
            help = f"declare `record Point({record})` at the top, then write `Point({value})`; the type is `Point`"
            suggestions = ()
        said = "a record has a name, and parentheses for braces"
        return kinds.OTHER_LANGUAGE(span, said, help=help, suggestions=suggestions)
    if "," not in inside or "\n" in inside:
        return None
    edits = Replacement(Span(start, start + 1), "["), Replacement(Span(end, end + 1), "]")
    help = f"write `[{inside}]`" if len(inside) < 40 else "write `[` and `]`"
    suggestions = (Suggestion("Write brackets", edits),)
    return kinds.OTHER_LANGUAGE(span, "an array stands in brackets", help=help, suggestions=suggestions)


def _fields(text: str) -> list[tuple[str, str]]:
    """Names with their types, or values; none if there are too many to be read."""
    found = [(name, what.strip(" )\t")) for name, what in _FIELD.findall(text)]
    return found if len(found) <= MOST_FIELDS else []
