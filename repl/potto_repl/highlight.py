"""Colours of what is typed, and completion, as prompt_toolkit wants them.

Owns `PottoLexer`, `PottoCompleter` and the styles of the themes. Words are cut by the parser's own lexer; what is wrong
is underlined where the checker, which runs beside, has found it so for exactly this text.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache

from prompt_toolkit.completion import CompleteEvent, Completer, Completion
from prompt_toolkit.document import Document
from prompt_toolkit.formatted_text import StyleAndTextTuples
from prompt_toolkit.lexers import Lexer
from prompt_toolkit.styles import Style

from potto_repl.session_loading import Loader

Mark = tuple[int, int]  # from where to where something is wrong
THEMES: dict[str, dict[str, str]] = {
    "dark": {
        "prompt": "ansibrightgreen bold", "continuation": "ansibrightblack", "keyword": "ansibrightmagenta",
        "number": "ansibrightcyan", "comment": "ansibrightblack", "builtin": "ansibrightblue", "operator": "",
        "command": "ansibrightyellow bold", "wrong": "underline ansibrightred", "auto-suggestion": "ansibrightblack",
    },
    "light": {
        "prompt": "ansigreen bold", "continuation": "ansibrightblack", "keyword": "ansimagenta",
        "number": "ansiblue", "comment": "ansibrightblack", "builtin": "ansicyan", "operator": "",
        "command": "ansired bold", "wrong": "underline ansired", "auto-suggestion": "ansibrightblack",
    },
    "none": {"wrong": "underline"},
}  # fmt: skip
_KINDS = {"NUMBER": "number", "COMMENT": "comment", "INTEGRAL": "keyword", "SUM": "keyword", "DIFFEO": "keyword",
          "D": "keyword", "DEF": "keyword", "FOR": "keyword", "IN": "keyword", "IF": "keyword", "THEN": "keyword",
          "ELSE": "keyword", "LET": "keyword", "NOT": "keyword", "FROM": "keyword", "IMPORT": "keyword",
          "AS": "keyword", "FOLD": "keyword", "WITH": "keyword", "RECORDDEF": "keyword"}  # fmt: skip


@lru_cache(maxsize=8)
def style(theme: str) -> Style:
    """The style of a theme, the same object each time: prompt_toolkit keeps what it works out of a style."""
    return Style.from_dict(THEMES.get(theme, THEMES["none"]))


class PottoLexer(Lexer):
    """Colours a document. Before the parser is loaded, none."""

    def __init__(self, loader: Loader, wrong: Callable[[str], Sequence[Mark]]) -> None:
        self.loader = loader
        self.wrong = wrong
        self._last: tuple[str, tuple[Mark, ...], bool, list[StyleAndTextTuples]] | None = None

    def lex_document(self, document: Document) -> Callable[[int], StyleAndTextTuples]:
        text = document.text
        marks = tuple(self.wrong(text))
        if self._last is None or self._last[:3] != (text, marks, self.loader.ready):
            self._last = (text, marks, self.loader.ready, self._lines(text, marks))
        lines = self._last[3]
        return lambda number: lines[number] if number < len(lines) else []

    def _lines(self, text: str, marks: Sequence[Mark]) -> list[StyleAndTextTuples]:
        classes = styled(text) if self.loader.ready else [""] * len(text)
        for start, end in marks:
            for place in range(start, min(max(end, start + 1), len(text))):
                classes[place] += " class:wrong"
        lines: list[StyleAndTextTuples] = []
        at = 0
        for line in text.split("\n"):
            lines.append(_fragments(line, classes[at : at + len(line)]))
            at += len(line) + 1
        return lines


def styled(text: str) -> list[str]:
    """The style of each character."""
    from potto.modules.builtins import is_builtin
    from potto.syntax import tokenize

    classes = [""] * len(text)
    start = 0
    if text.startswith(":"):
        start = len(text.split(None, 1)[0])
        classes[:start] = ["class:command"] * start
    for token in tokenize(text[start:]):
        kind = _KINDS.get(token.kind, "")
        if not kind and token.text in ("and", "or"):
            kind = "keyword"
        elif not kind and token.kind == "NAME" and (is_builtin(token.text) or token.text in ("deriv", "print")):
            kind = "builtin"
        if kind:
            classes[start + token.start : start + token.end] = [f"class:{kind}"] * (token.end - token.start)
    return classes


def _fragments(line: str, classes: Sequence[str]) -> StyleAndTextTuples:
    out: StyleAndTextTuples = []
    at = 0
    while at < len(line):
        end = at
        while end < len(line) and classes[end] == classes[at]:
            end += 1
        out.append((classes[at], line[at:end]))
        at = end
    return out


class PottoCompleter(Completer):
    """Completion from the session; called on a thread of its own."""

    def __init__(self, loader: Loader) -> None:
        self.loader = loader

    def get_completions(self, document: Document, complete_event: CompleteEvent) -> Iterable[Completion]:
        from potto.query import Cancelled
        from potto_repl.complete import candidates

        try:
            found = candidates(self.loader.session, document.text_before_cursor)
        except Cancelled:
            return
        for item in found:
            meta = " ".join(filter(None, (item.type, item.doc.partition("\n")[0])))
            yield Completion(item.text, -item.length, display_meta=meta)
