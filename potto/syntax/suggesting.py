"""Changes of a text that can't be read, as suggestions: they see the text around the place that they change."""

from __future__ import annotations

from potto.diagnostics import Replacement, Suggestion, shortened, suggest
from potto.source import Span


def write(text: str, span: Span, new: str) -> tuple[Suggestion, ...]:
    """Something else in a place, with blanks where it would run into the words around it."""
    before = " " if new[:1].isalpha() and text[: span.start][-1:].isalnum() else ""
    after = " " if new[-1:].isalpha() and text[span.end : span.end + 1].isalnum() else ""
    return (suggest(span, f"{before}{new}{after}", f"Write `{shortened(new)}`"),)


def insert(at: int, new: str) -> Suggestion:
    """Something more at a place."""
    return suggest(Span(at, at), new, f"Write `{shortened(new.strip())}`")


def take_out(text: str, span: Span) -> tuple[Suggestion, ...]:
    """What stands in a place is left out, with the blanks behind it."""
    end = span.end
    while text[end : end + 1] == " ":
        end += 1
    title = f"Take out `{shortened(text[span.start : span.end])}`"
    return (Suggestion(title, (Replacement(Span(span.start, end), ""),)),)
