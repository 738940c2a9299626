"""A file cut into chunks: one for each top-level definition or statement.

Owns `Chunk`, `split`, `pieces` and `goes_on`. A chunk starts at each line with code in its first column, also while a
bracket is open that nothing closes before the next definition: so that a stray bracket can't swallow it. Some things go
with the chunk above or below: a line that starts with a closing bracket, which can start nothing, the lines within
brackets that are closed, the operand of an operator that ends the line before, and the body of a `let` whose `in`
does so, belong to the chunk above them; comment lines directly above a definition belong to it. Other comments in
the first column are chunks of their own, unless an indented line follows.

A piece is some neighbouring chunks. It begins where one begins whatever stands above it, at a definition, so that each
can be split by itself: after an edit all but one are what they were.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from msgspec import Struct

from potto.syntax.tokens import FIRST_NAME, awaits_operand, normalized

_LINE = re.compile(r"\n(?:#.*\n)*\f*([^\s])")
"""A line with code or a comment in its first column, and the comment lines directly above it. It begins with the end of
the line before, so that blank and indented lines are passed over as fast as memory is read."""
_BRACKETS = re.compile(r"""[(\[]|[)\]]|"[^"\n]*"?|\#[^\n]*|\n""")
_ITEM = re.compile(
    rf"(?:def|diffeo|from|import|for|print)\b|record[ \t]+{FIRST_NAME.pattern}[ \t]*\("
    rf"|{FIRST_NAME.pattern}[ \t]*(?::[^=\n?]*)?=(?!=)"
)
"""The start of a line in the first column that is not part of an expression."""
_BLOCK = re.compile(r"(?:#[^\n]*\n)*(?:def|diffeo|for)\b")
_IMPORT = re.compile(r"(?:#[^\n]*\n)*(?:from|import)\b")  # whose `*` is no operator
_LET, _IN = re.compile(r"\blet\b"), re.compile(r"(?<![\w.])in\Z")
_INDENTED = re.compile(r"\n[^\S\n]+[^\s]")
_PIECE = re.compile(rf"\n((?:#.*\n)*)(?={_ITEM.pattern})")
"""The line's end before a piece, and the comment lines that belong to its first definition."""

MOST_IN_VAIN = 100  # searches for closing brackets that end at the same item, which none of them reaches
PIECE = 2_000  # characters, beyond which the next piece begins as soon as it can


class Chunk(Struct, frozen=True):
    """`text` from the offset `start` of the file, without the blank lines after it."""

    start: int
    text: str


def pieces(text: str, former: Sequence[str] = ()) -> tuple[str, ...]:
    """A file in pieces. Those of `former`, of an earlier text, that it begins and ends with are taken over; where it is
    cut depends on them, what the chunks in the pieces are does not."""
    lines, first, start = normalized(text), 0, 0
    while first < len(former) and text.startswith(former[first], start):
        start += len(former[first])
        first += 1
    last, end = len(former), len(text)
    while last > first and end - len(former[last - 1]) >= start and text.endswith(former[last - 1], start, end):
        last -= 1
        end -= len(former[last])
    while first and (start == len(text) or not _begins(lines, start)):  # what was edited belongs to what is above it
        first -= 1
        start -= len(former[first])
    while last < len(former) and (end - start < PIECE // 2 or text[start:end].isspace() or not _begins(lines, end)):
        end += len(former[last])
        last += 1
    return (*former[:first], *_cut(text, start, end), *former[last:])


def _begins(lines: str, at: int) -> bool:
    """Whether a piece can begin at a place. The comment lines directly above it would be part of it."""
    if not at:
        return True
    above = lines.rfind("\n", 0, at - 1) + 1
    if lines[at - 1] != "\n" or lines[above:at].lstrip("\f").startswith("#"):
        return False
    while lines.startswith("#", at):
        at = lines.find("\n", at) + 1
        if not at:
            return False
    return _ITEM.match(lines, at) is not None


def _cut(text: str, start: int, end: int) -> list[str]:
    """What stands between two places, in pieces."""
    found: list[str] = []
    lines, at = normalized(text[start:end]), 0
    after = _PIECE.search(lines, PIECE)
    while after is not None:
        begin, next = after.start(1), after.end()
        if begin > at and _begins(lines, begin) and not lines[at:begin].isspace():
            found.append(text[start + at : start + begin])
            at, next = begin, begin + PIECE
        after = _PIECE.search(lines, next)
    if start + at < end:
        found.append(text[start + at : end])
    return found


def split(text: str) -> tuple[Chunk, ...]:
    """The chunks of a file, in order."""
    starts = _starts(text)
    ends = [*starts[1:], len(text)]
    return tuple([Chunk(start, text[start:end].rstrip()) for start, end in zip(starts, ends)])


def _starts(text: str) -> list[int]:
    starts: list[int] = []
    comments: list[int] = []  # where the blocks of comments since the last code start
    if text.startswith("\ufeff"):
        text = "\n" + text[1:]
    text = "\n" + normalized(text)  # a line starts in `text` where in this one the line before ends
    end = 0  # of the last comment
    lookahead, closed = _Lookahead(text), 0  # up to where the brackets that were open above a line go
    for found in _LINE.finditer(text):
        start, first = found.start(), found[1]
        if comments or not starts:
            comments = _passed(text, end, start, starts, comments)
        if not comments or start != end:
            comments.append(start)
        if first == "#":
            end = text.find("\n", found.end())
            end = len(text) if end < 0 else end
        elif starts and (first in ")]" or found.end() < closed):
            comments = []
        elif starts and (close := lookahead.goes_on(starts[-1], start, found.end() - 1)):
            comments, closed = [], close
        else:
            starts += comments
            comments = []
    return starts + _passed(text, end, len(text), starts, comments)


def _passed(text: str, end: int, start: int, starts: list[int], comments: list[int]) -> list[int]:
    """The comments that are still to be given to a chunk, behind the blank and indented lines from `end` to `start`."""
    indented = _INDENTED.search(text, end, start)
    if indented is None:
        return comments
    if not starts:  # there is no chunk yet that it could go on with
        starts += comments if comments and indented.start() == end else [*comments, indented.start()]
    return []


def _last_code(text: str, chunk: int, end: int) -> tuple[int, int]:
    """Where the last line of code of a chunk that ends at a place begins, and where its code ends."""
    while True:
        while end > chunk and text[end - 1].isspace():
            end -= 1
        begin = text.rfind("\n", chunk, end) + 1
        comment = text.find("#", begin, end)
        if comment < 0 or end <= chunk:
            return begin, end
        end = comment


def _is_body(text: str, chunk: int, end: int) -> bool:
    """Whether the body of a `let` of a chunk is still to come that ends at a place: at its `in`."""
    return _IN.search(text, max(chunk, end - 3), end) is not None and _LET.search(text, chunk, end) is not None


def _awaits_operand(text: str, chunk: int, begin: int, end: int) -> bool:
    """Whether the line of code from `begin` to `end` ends with an operator, and is no line of a block."""
    if not awaits_operand(text, chunk, end):
        return False
    start = chunk + (text[chunk] == "\n")
    in_block = text[begin].isspace() and _BLOCK.match(text, start) is not None
    return not in_block and _IMPORT.match(text, start) is None


def goes_on(text: str, line: str) -> bool:
    """Whether a line in the first column goes on with the one chunk above it, where what comes below is not known yet:
    it does while a bracket is open."""
    if _ITEM.match(line):
        return False
    text = normalized(text)
    begin, end = _last_code(text, 0, len(text))
    if begin < end and (_awaits_operand(text, 0, begin, end) or _is_body(text, 0, end)):
        return True
    words = [found.group() for found in _BRACKETS.finditer(text)]
    return words.count("(") + words.count("[") > words.count(")") + words.count("]")


class _Lookahead:
    """Finds what goes on with the chunk above it. How often it reads the same in vain is bounded, so that a file of
    nothing but opening brackets costs no more than its length."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.lets = "let" in text
        self.in_vain, self.seen = 0, 0  # searches in vain, and up to where the last one went

    def goes_on(self, start: int, end: int, line: int) -> int:
        """Up to where goes on what a chunk has begun that ends above a line; 0 if that is complete, as mostly."""
        begin, last = _last_code(self.text, start, end)
        unfinished = _awaits_operand(self.text, start, begin, last) or (self.lets and _is_body(self.text, start, last))
        if unfinished and _ITEM.match(self.text, line) is None:
            return line
        above = self.text[start:line]
        if above.count("(") + above.count("[") <= above.count(")") + above.count("]"):
            return 0
        if line >= self.seen:
            self.in_vain = 0
        elif self.in_vain >= MOST_IN_VAIN:
            return 0
        return self.closes(start, line)

    def closes(self, start: int, line: int) -> int:
        """Where the brackets end that a chunk has left open above a line; 0 if an item starts before."""
        text, depth, at = self.text, 0, line
        for found in _BRACKETS.finditer(text, start):
            char, at = found.group(), found.end()
            if char in ("(", "["):
                depth += 1
            elif char in (")", "]"):
                depth -= 1
                if depth <= 0 and at > line:
                    return at
            elif char == "\n" and at >= line and (depth <= 0 or _ITEM.match(text, at)):
                break
        self.in_vain, self.seen = self.in_vain + 1, at
        return 0
