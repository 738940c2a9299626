"""Source text laid out: the same program, spaced and indented alike everywhere.

Owns `format_source`. It works on tokens, keeps the author's line breaks, and breaks lines that are too long. Chunks
with errors are kept as they are; so is a chunk whose layout would not read back as the same tree and comments.
"""

from __future__ import annotations

from dataclasses import dataclass

from potto.syntax.chunks import split
from potto.syntax.lexer import MAX_LENGTH, lex
from potto.syntax.parser import parse_chunk
from potto.syntax.spacing import Spaced, spaced
from potto.syntax.tokens import CLOSERS, OPENERS, Comment, normalized
from potto.syntax.walk import without_spans

WIDTH = 100
_INDENT = 4
_CLAUSES = frozenset({"INVERSE", "WHERE"})


def format_source(text: str, diffeo: bool = False) -> str:
    """The text of a file, formatted; `diffeo`: of a `.diffeo` file. Line ends are kept as the file has them."""
    end_of_line = "\r\n" if "\r\n" in text else "\n"
    text = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    out: list[str] = []
    end = 0
    for chunk in split(text):
        if out:
            blank_lines = text.count("\n", end, chunk.start) - 1
            out.append("\n" * (1 + min(max(blank_lines, 0), 2)))
        out.append(_format_chunk(chunk.text, diffeo))
        end = chunk.start + len(chunk.text)
    if not out:
        return ""
    return ("".join(out) + "\n").replace("\n", end_of_line)


def _format_chunk(text: str, diffeo: bool) -> str:
    """A chunk laid out; as it is if it has errors, or if the layout would change what it says."""
    if len(text) > MAX_LENGTH:
        return text
    parsed = parse_chunk(text, diffeo)
    if any(diagnostic.severity == "error" for diagnostic in parsed.diagnostics):
        return text
    if parsed.item is None:
        return "\n".join(comment.text.rstrip() for comment in parsed.comments)
    lexed = lex(text, diffeo)
    laid_out = _Layout(text, spaced(lexed.tokens, text), lexed.comments).text()
    again = parse_chunk(laid_out, diffeo)
    same = (
        not again.diagnostics
        and len(split(laid_out)) == 1
        and [comment.text.rstrip() for comment in again.comments] == [c.text.rstrip() for c in parsed.comments]
        and without_spans(again.item) == without_spans(parsed.item)
    )
    return laid_out if same else text


@dataclass(eq=False, repr=False, slots=True)
class _Line:
    """A line to be: the tokens from `first` up to `last`."""

    first: int
    last: int
    indent: int = 0


class _Layout:
    """The lines of one chunk. Each is made once, from the first to the last, so that to lay out a chunk takes time in
    proportion to its length, however it is broken."""

    def __init__(self, text: str, tokens: list[Spaced], comments: list[Comment]) -> None:
        self.source = normalized(text)
        self.tokens = tokens
        self.comments = comments
        self.inset = 0  # levels that are not written so: 1 behind a `def` whose body came to a line of its own

    def text(self) -> str:
        """The chunk's text, its lines broken until they fit or can't be broken."""
        return "\n".join(self._assembled(self._lines()))

    def _written_breaks(self) -> list[int]:
        """The tokens that the author began a line with."""
        out: list[int] = []
        for index in range(1, len(self.tokens)):
            before, token = self.tokens[index - 1].token, self.tokens[index].token
            if self.source.find("\n", before.end, token.start) >= 0:
                out.append(index)
        return out

    def _lines(self) -> list[_Line]:
        """The lines of tokens, indented, none too long that could be broken."""
        breaks = self._written_breaks()
        lines: list[_Line] = []
        opened: list[int] = []  # the indentations of the lines on which the brackets that are open here were opened
        for start, end in zip([0, *breaks], [*breaks, len(self.tokens)]):
            first: int | None = start
            while first is not None:
                line = _Line(first, end)
                line.indent = self._indent(line, opened)
                first = self._break_in(line)
                line.last = end if first is None else first
                lines.append(line)
                self._follow_brackets(line, opened)
        return lines

    def _follow_brackets(self, line: _Line, opened: list[int]) -> None:
        for index in range(line.first, line.last):
            kind = self.tokens[index].token.kind
            if kind in OPENERS:
                opened.append(line.indent)
            elif kind in CLOSERS:
                opened.pop()

    def _indent(self, line: _Line, opened: list[int]) -> int:
        first = self.tokens[line.first]
        if first.opens:
            self.inset = 1
            return _INDENT
        if first.starts:
            return first.level * _INDENT
        if first.token.kind in _CLAUSES:
            return max(1, first.level) * _INDENT
        if not opened:  # the bodies of `let`s stand below each other
            return max(1, first.level + self.inset + (not first.body)) * _INDENT
        closers = 0
        while line.first + closers < line.last and self.tokens[line.first + closers].token.kind in CLOSERS:
            closers += 1
        return opened[-closers] if closers else opened[-1] + _INDENT

    def _written(self, line: _Line) -> str:
        parts: list[str] = []
        for index in range(line.first, line.last):
            item = self.tokens[index]
            if item.blank and index > line.first:
                parts.append(" ")
            parts.append(item.token.text)
        return "".join(parts)

    def _break_in(self, line: _Line) -> int | None:
        """Where to break a line that is too long: as far out as can be, and then as late as fits."""
        width = line.indent
        best: int | None = None
        for index in range(line.first, line.last):
            item = self.tokens[index]
            if index > line.first and item.may_break and (best is None or item.depth <= self.tokens[best].depth):
                best = index
            width += len(item.token.text) + (1 if item.blank and index > line.first else 0)
            if width > WIDTH and best is not None:  # what follows does not fit, and is not looked at
                return best
        return None

    def _assembled(self, lines: list[_Line]) -> list[str]:
        """The lines with the comments and single blank lines that stood between them."""
        out: list[str] = []
        comments, told = self.comments, 0
        previous = 0
        for line in lines:
            start = self.tokens[line.first].token.start
            end = self.tokens[line.last - 1].token.end
            while told < len(comments) and comments[told].span.start < start:
                previous = self._comment(out, comments[told], line.indent, previous)
                told += 1
            self._blank_line(out, previous, start)
            out.append(" " * line.indent + self._written(line))
            previous = end
        for comment in comments[told:]:
            previous = self._comment(out, comment, max(_INDENT, lines[-1].indent), previous)
        return out

    def _comment(self, out: list[str], comment: Comment, indent: int, previous: int) -> int:
        """Add a comment: at the end of the line it stood on, or on a line of its own."""
        text = comment.text.rstrip()
        if comment.own_line or not out:
            self._blank_line(out, previous, comment.span.start)
            out.append(" " * (indent if out and previous else 0) + text)
        else:
            out[-1] += "  " + text
        return comment.span.end

    def _blank_line(self, out: list[str], previous: int, start: int) -> None:
        if out and self.source.count("\n", previous, start) > 1:
            out.append("")
