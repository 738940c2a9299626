"""The words of a whole file, for highlighting and for the eye. Owns `tokenize`."""

from __future__ import annotations

from potto.syntax.chunks import split
from potto.syntax.lexer import MAX_LENGTH, lex
from potto.syntax.tokens import Token


def tokenize(text: str, diffeo: bool = False) -> tuple[Token, ...]:
    """The written tokens of a file, comments among them (kind `COMMENT`), at their places in the file."""
    out: list[Token] = []
    for chunk in split(text):
        if len(chunk.text) > MAX_LENGTH:
            continue
        lexed = lex(chunk.text, diffeo)
        found = [token for token in lexed.tokens if token.text]
        found += [Token("COMMENT", c.text, c.span.start, c.span.end) for c in lexed.comments]
        found.sort(key=lambda token: token.start)
        out += [Token(kind, word, start + chunk.start, end + chunk.start) for kind, word, start, end in found]
    return tuple(out)
