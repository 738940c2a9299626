"""Diagnostics made readable: an excerpt of the source for people, JSON for machines.

Owns the look of a diagnostic. Takes diagnostics whose spans are absolute and asks for the text of files by name; reads
no file itself. Columns shown to people count from 1 in code points; JSON ranges are LSP's (from 0, in UTF-16).
"""

from __future__ import annotations

import os
import re
import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from msgspec import Struct

from potto.diagnostics import Diagnostic, PottoError, Related, Suggestion, headline
from potto.reports.excerpt import WIDTH, Excerpt, Mark, excerpt, printable
from potto.source import Position, SourceText, Span

Sources = Callable[[str], SourceText | None]
BESIDE, LEAST = 6, 14  # columns beside an excerpt, for its gutter; the least that is shown
NARROW = 60  # columns of a screen on which what goes on is not indented as far as it began


class Located(Struct, frozen=True):
    """A diagnostic and the file that it is about; None for one that has no place in a file."""

    file: str | None
    diagnostic: Diagnostic


class Palette(Struct, frozen=True):
    """How to switch colours on, per role; `off` ends any of them. Empty strings: no colours."""

    error: str = ""
    warning: str = ""
    info: str = ""
    bold: str = ""
    gutter: str = ""
    off: str = ""

    def severity(self, name: str) -> str:
        return {"error": self.error, "warning": self.warning}.get(name, self.info)

    def paint(self, style: str, text: str) -> str:
        return f"{style}{text}{self.off}" if style else text


PLAIN = Palette()
COLORS = Palette("\x1b[1;31m", "\x1b[1;33m", "\x1b[1;36m", "\x1b[1m", "\x1b[1;34m", "\x1b[0m")


def display_name(file: str) -> str:
    """A file as people call it: relative to the working folder when it lies there; of a part of a cell, the cell."""
    if not os.path.isabs(file):
        return file.partition("#")[0] if file.startswith("<") else file
    try:
        relative = os.path.relpath(file)
    except (OSError, ValueError):
        return file
    return file if relative.startswith("..") else relative


def render(
    located: Located, sources: Sources, *, palette: Palette = PLAIN, inline_header: bool = False,
    columns: int | None = None,
) -> str:  # fmt: skip
    """One diagnostic as text, without a final newline.

    `inline_header` puts the place in front of the message (`file:line:col: severity[CODE]: message`), as `potto check`
    does; otherwise it stands on a line of its own after ` --> `. columns: how wide a screen it has to fit on, if any.
    """
    diagnostic, file = located.diagnostic, located.file
    source = sources(file) if file is not None else None
    head = palette.paint(palette.severity(diagnostic.severity), f"{diagnostic.severity}[{diagnostic.code}]")
    named = len(f"{diagnostic.severity}[{diagnostic.code}]")
    message = palette.paint(palette.bold, broken(": " + printable(diagnostic.message), columns, 2, named))
    if file is None or source is None:
        place = f"{printable(display_name(file))}: " if file is not None else ""
        return "\n".join([place + head + message, *_footer(diagnostic, palette, 1, columns)])
    place = _place(file, source, diagnostic.span)
    here, elsewhere = _marks(located, source, sources)
    room = WIDTH if columns is None else min(max(columns - BESIDE, LEAST), WIDTH)
    blocks: list[tuple[str | None, Excerpt]] = [(None, excerpt(source, here, room))]
    blocks += [(f, excerpt(s, [mark], room)) for f, s, mark in elsewhere]
    width = max(block.gutter_width for _, block in blocks)
    lines = [f"{place}: {head}{message}"] if inline_header else [head + message]
    if not inline_header:
        lines.append(f"{' ' * width}{palette.paint(palette.gutter, '-->')} {place}")
    for index, (other, block) in enumerate(blocks):
        if other is not None:
            _, other_source, mark = elsewhere[index - 1]
            where = _place(other, other_source, mark.span)
            lines.append(f"{' ' * width}{palette.paint(palette.gutter, ':::')} {where}")
        lines += block.lines(width, palette.gutter, palette.severity(diagnostic.severity), palette.off)
    return "\n".join([*lines, *_footer(diagnostic, palette, width, columns)])


def broken(text: str, columns: int | None, indent: int, used: int = 0) -> str:
    """Prose in lines of at most so many columns; `used` are taken on the first. Later ones are indented.

    What stands in backticks stays on one line, where it is short enough for that.
    """
    if columns is None or used + len(text) < columns:
        return text
    width, first = max(columns - 1, indent + 8), "\0" * used

    def whole(code: re.Match[str]) -> str:
        return code[0].replace(" ", "\1") if len(code[0]) < width / 2 else code[0]

    together = re.sub(r"`[^`\n]+`", whole, text)
    lines = textwrap.wrap(first + together, width, subsequent_indent=" " * indent, break_long_words=False,
                          break_on_hyphens=False)  # fmt: skip
    return "\n".join(lines).removeprefix(first).replace("\1", " ")


def _place(file: str, source: SourceText, span: Span) -> str:
    position = source.position(_clamp(span, source).start)
    return f"{printable(display_name(file))}:{position.line + 1}:{position.column + 1}"


def _clamp(span: Span, source: SourceText) -> Span:
    size = len(source.text)
    start = min(max(span.start, 0), size)
    return Span(start, min(max(span.end, start), size))


def _marks(
    located: Located, source: SourceText, sources: Sources
) -> tuple[list[Mark], list[tuple[str, SourceText, Mark]]]:
    """What to underline in the diagnostic's own file, and what in others."""
    diagnostic = located.diagnostic
    here = [Mark(_clamp(diagnostic.span, source), diagnostic.label, True)]
    elsewhere: list[tuple[str, SourceText, Mark]] = []
    for related in diagnostic.related:
        if related.file is None or related.file == located.file:
            here.append(Mark(_clamp(related.span, source), related.message, False))
            continue
        other = sources(related.file)
        if other is not None:
            elsewhere.append((related.file, other, Mark(_clamp(related.span, other), related.message, False)))
    return here, elsewhere


def _footer(diagnostic: Diagnostic, palette: Palette, width: int, columns: int | None) -> list[str]:
    equals = " " * (width + 1) + palette.paint(palette.gutter, "=") + " "
    indent = " " * (width + 3)
    lines: list[str] = []
    for word, text in [*(("note", note) for note in diagnostic.notes), ("help", diagnostic.help)]:
        if text:
            first, *rest = printable(text, keep_newlines=True).split("\n")
            deep = len(indent) + (len(word) + 2 if columns is None or columns >= NARROW else 0)
            head = broken(f"{word}: {first}", columns, deep, len(indent)).removeprefix(word)
            lines.append(f"{equals}{palette.paint(palette.bold, word)}{head}")
            lines += [broken(" " * deep + line, columns, deep) for line in rest]
    return lines


# For machines


def to_json(located: Located, sources: Sources) -> dict[str, Any]:
    """One diagnostic as the object that interfaces promise to machines."""
    diagnostic, file = located.diagnostic, located.file
    source = sources(file) if file is not None else None
    return {
        "code": diagnostic.code,
        "severity": diagnostic.severity,
        "message": diagnostic.message,
        "file": None if file is None else display_name(file),
        "range": range_json(source, diagnostic.span),
        "label": diagnostic.label,
        "related": [_related_json(related, file, sources) for related in diagnostic.related],
        "notes": list(diagnostic.notes),
        "help": diagnostic.help,
        "tags": list(diagnostic.tags),
        "suggestions": [_suggestion_json(s, source) for s in diagnostic.suggestions],
    }


def all_to_json(diagnostics: Iterable[Located], sources: Sources) -> dict[str, Any]:
    """`{"diagnostics": [...]}`."""
    return {"diagnostics": [to_json(located, sources) for located in diagnostics]}


def range_json(source: SourceText | None, span: Span) -> dict[str, dict[str, int]]:
    """A span as LSP's range; without a text, the start of the file."""
    if source is None:
        return {"start": {"line": 0, "character": 0}, "end": {"line": 0, "character": 0}}
    span = _clamp(span, source)
    return {"start": _point(source, span.start), "end": _point(source, span.end)}


def _point(source: SourceText, offset: int) -> dict[str, int]:
    position: Position = source.position(offset)
    return {"line": position.line, "character": source.utf16_column(position)}


def _related_json(related: Related, file: str | None, sources: Sources) -> dict[str, Any]:
    other = related.file if related.file is not None else file
    return {
        "file": None if other is None else display_name(other),
        "range": range_json(sources(other) if other is not None else None, related.span),
        "message": related.message,
    }


def _suggestion_json(suggestion: Suggestion, source: SourceText | None) -> dict[str, Any]:
    edits = [{"range": range_json(source, edit.span), "text": edit.text} for edit in suggestion.edits]
    return {"title": suggestion.title, "edits": edits}


def summary(diagnostics: Sequence[Located]) -> str:
    """`2 errors, 1 warning`, or nothing for none."""
    parts = []
    for severity in ("error", "warning"):
        count = sum(located.diagnostic.severity == severity for located in diagnostics)
        if count:
            parts.append(f"{count} {severity}{'' if count == 1 else 's'}")
    return ", ".join(parts)


class ProgramError(PottoError):
    """A PottoError that knows the files its diagnostics are about; as text it shows the source."""

    def __init__(self, located: Sequence[Located], sources: Sources) -> None:
        super().__init__([item.diagnostic for item in located])
        self.located = tuple(located)
        self.sources = sources

    def __str__(self) -> str:
        """The first message, its place, and then the other diagnostics."""
        texts = [render(item, self.sources) for item in self.located]
        if texts:
            _, newline, rest = texts[0].partition("\n")
            texts[0] = f"{printable(headline(self.located[0].diagnostic))}{newline}{rest}"
        return "\n".join(texts)

    def __reduce__(self) -> tuple[object, ...]:
        files = {item.file for item in self.located} | {r.file for d in self.diagnostics for r in d.related}
        return _arrived, (self.located, {file: self.sources(file) for file in files if file is not None})


def _arrived(located: Sequence[Located], texts: Mapping[str, SourceText | None]) -> ProgramError:
    """An error that was raised in another process, with the texts that it shows."""
    return ProgramError(located, texts.get)
