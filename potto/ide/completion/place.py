"""What kind of word the cursor is in, from the text in front of it. Owns `place_in`."""

from __future__ import annotations

import re
from typing import Literal

from msgspec import Struct

from potto.ide.names.places import line_start
from potto.source import Span

Kind = Literal[
    "letter", "module", "imported", "member", "measure", "type", "new", "nothing", "clause", "top", "expression",
    "part", "changed", "file",
]  # fmt: skip

_LETTER = re.compile(r"\\(\w*)$")
_WORD = re.compile(r"[^\W\d]\w*$")
_FROM = re.compile(r"^from\s+([\w.]*)$")
_IMPORT = re.compile(r"^import\s+([\w.]*)$")
_NAMES = re.compile(r"^from\s+([\w.]+)\s+import\s+(?:[\w\s,]*,\s*)?(\w*)$")
_MODULE_ONLY = re.compile(r"^from\s+[\w.]+\s+(\w*)$")
_ALIAS = re.compile(r"^(?:from|import)\b.*\bas\s+\w*$")
_MEMBER = re.compile(r"((?:[^\W\d]\w*\.)+)(\w*)$")
_PART = re.compile(r"[)\]]((?:\.[^\W\d]\w*)*)\.(\w*)$")
_CHANGED = re.compile(r"\bwith\s+(?:\(.*)?(\w*)$")
_FILE = re.compile(r"\bload\s*\(\s*[\"\']([^\"\']*)$")
_MEASURE = re.compile(r"~\s*(\w*)$")
_NEW = re.compile(r"(?:\bfor\s+|\blet\s+|\bsum\s+|\\\s*\((?:\s*\w+\s*,)*\s*)\w*$")
_HEAD = re.compile(r"(def|diffeo)\s+\w*")
_RESULT = re.compile(r"\s*->\s*[(\[]?\s*(?:Real\*?,\s*)*\w*$")
_NUMBER = re.compile(r"(?:^|[^\w.])[0-9][\w.]*$")
_IMPORT_LINES = re.compile(r"(?:^|\n)(from\s[^\n]*(?:,|import)[ \t]*(?:\r?\n[ \t]+[^\n]*)*)$")


class CompletionPlace(Struct, frozen=True):
    """`span` is the word so far, absolute; `path` the module in front of it, where there is one."""

    kind: Kind
    span: Span
    word: str
    path: str = ""


def place_in(text: str, offset: int) -> CompletionPlace:
    """The kind of word at an offset of a text."""
    start = line_start(text, offset)
    line = text[start:offset]
    found = _WORD.search(line)
    word = found.group() if found else ""
    span = Span(offset - len(word), offset)
    letter = _LETTER.search(line)
    if letter is not None:
        return CompletionPlace("letter", Span(start + letter.start(), offset), letter.group(1))
    hash_at = line.find("#")
    if hash_at >= 0:
        if not line.startswith("#>", hash_at):
            return CompletionPlace("nothing", span, word)
        line = line[hash_at + 2 :].lstrip() or " "
        return _expression(" " + line, span, word)
    if _NUMBER.search(line) and not _FILE.search(line):
        return CompletionPlace("nothing", span, word)
    continued = _IMPORT_LINES.search(text[max(0, start - 2000) : offset]) if line[:1] in (" ", "\t") else None
    logical = " ".join(continued.group(1).split("\n")) if continued else line
    return _import(logical, span) or _expression(line, span, word)


def operand_start(text: str, end: int) -> int | None:
    """Where the operand begins that ends at an offset: a name, a call, an index, parentheses, with their parts."""
    at = end
    while at > 0:
        if text[at - 1] in ")]":
            depth, place = 0, at - 1
            while place >= 0:
                depth += (text[place] in ")]") - (text[place] in "([")
                if depth == 0:
                    break
                place -= 1
            if place < 0:
                return None
            at = place
            if at == 0 or not (text[at - 1].isalnum() or text[at - 1] in "_)]"):
                return at
            continue
        begin = at
        while begin and (text[begin - 1].isalnum() or text[begin - 1] in "_."):
            begin -= 1
        if begin == at:
            return at if at < end else None
        at = begin
        if text[begin] != ".":
            return begin
    return at if at < end else None


def _import(line: str, span: Span) -> CompletionPlace | None:
    if not line.startswith(("from", "import")):
        return None
    for pattern in (_FROM, _IMPORT):
        found = pattern.search(line)
        if found is not None:
            path = found.group(1)
            return CompletionPlace("module", Span(span.end - len(path), span.end), path)
    found = _NAMES.search(line)
    if found is not None:
        word = found.group(2)
        return CompletionPlace("imported", Span(span.end - len(word), span.end), word, found.group(1))
    if _ALIAS.search(line):
        return CompletionPlace("new", span, "")
    found = _MODULE_ONLY.search(line)
    if found is not None:
        return CompletionPlace("clause", span, found.group(1), "import")
    return CompletionPlace("clause", span, "", "as") if re.match(r"(from|import)\s", line) else None


def _expression(line: str, span: Span, word: str) -> CompletionPlace:
    loaded = _FILE.search(line)
    if loaded is not None:
        return CompletionPlace("file", Span(span.end - len(loaded.group(1)), span.end), loaded.group(1))
    part = _PART.search(line)
    if part is not None:
        return CompletionPlace("part", span, part.group(2))
    member = _MEMBER.search(line)
    if member is not None:
        return CompletionPlace("member", span, member.group(2), member.group(1).rstrip("."))
    if _MEASURE.search(line):
        return CompletionPlace("measure", span, word)
    headed = _in_head(line)
    if headed is not None:
        return CompletionPlace(headed, span, word)
    if _NEW.search(line):
        return CompletionPlace("new", span, word)
    if _CHANGED.search(line):
        return CompletionPlace("changed", span, word)
    return CompletionPlace("top" if line == word else "expression", span, word)


def _in_head(line: str) -> Kind | None:
    """What the head of a definition asks for at the end of a line: a new name or a type; None behind it."""
    head = _HEAD.match(line)
    if head is None:
        return None
    rest = line[head.end() :]
    if not rest:
        return "new"
    while rest.startswith("("):
        end = _closing(rest)
        if end is None:
            return "type" if ":" in _last_parameter(rest[1:]) else "new"
        rest = rest[end + 1 :]
    return "type" if head.group(1) == "def" and _RESULT.match(rest) else None


def _closing(text: str) -> int | None:
    """Where the parenthesis that a text begins with is closed."""
    depth = 0
    for place, char in enumerate(text):
        depth += (char == "(") - (char == ")")
        if depth == 0:
            return place
    return None


def _last_parameter(text: str) -> str:
    """What follows the last comma outside of brackets."""
    depth = start = 0
    for place, char in enumerate(text):
        depth += (char in "([") - (char in ")]")
        if char in ",;" and depth == 0:
            start = place + 1
    return text[start:]
