"""Where a parse stopped, and what stood there.

Owns `Stop`.
"""

from __future__ import annotations

from typing import Any

from msgspec import Struct

from potto.source import Span
from potto.syntax.tokens import Token

_OPENING = frozenset(
    [
        "IF",
        "THEN",
        "ELSE",
        "LET",
        "IN",
        "QMARK",
        "LAMBDA",
        "INTEGRAL",
        "SUM",
        "FOR",
        "DEF",
        "DIFFEODEF",
        "FROM",
        "IMPORT",
        "LPAR",
        "LSQB",
        "ADJACENT",
        "FOLD",
        "WITH",
        "ARROW",
        "INVERSE",
        "WHERE",
    ]
)


class Stop(Struct, frozen=True):
    """Where a parse stopped: the values on the stack, the kinds of tokens that could follow, and the tokens."""

    values: list[Any]
    possible: frozenset[str]
    tokens: list[Token]
    index: int
    text: str

    @property
    def at(self) -> Token:
        return self.tokens[self.index]

    @property
    def before(self) -> Token | None:
        """The last written token before the stop."""
        return next((token for token in reversed(self.tokens[: self.index]) if token.text), None)

    @property
    def after(self) -> Token | None:
        """The token after the one it stopped at."""
        return self.tokens[self.index + 1] if self.index + 1 < len(self.tokens) else None

    @property
    def place(self) -> Span:
        """The token it stopped at; where that is empty (the end of a line, of the definition), the one before."""
        token = self.at if self.at.text else self.before
        return Span(0, 0) if token is None else token.span

    @property
    def opened(self) -> Token | None:
        """The innermost construct that is still open."""
        found = (value for value in reversed(self.values) if isinstance(value, Token) and value.kind in _OPENING)
        return next(found, None)

    def last(self, *kinds: str) -> Token | None:
        """The innermost open token of these kinds."""
        return next((v for v in reversed(self.values) if isinstance(v, Token) and v.kind in kinds), None)

    @property
    def continues(self) -> Token | None:
        """The first word of the line where it stopped, if that line goes on with the one above."""
        line = self.text.rfind("\n", 0, self.at.start) + 1
        first = next((token for token in self.tokens if token.text and token.start >= line), None)
        layout = any(t.kind in ("NEWLINE", "INDENT") and first and t.start == first.start for t in self.tokens)
        return None if line == 0 or layout else first

    @property
    def ended(self) -> bool:
        """Whether nothing more is written from here on."""
        return not any(token.text for token in self.tokens[self.index :])
