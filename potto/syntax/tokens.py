"""The words of the language: token kinds, keywords and the one pattern that cuts text into them.

Owns `Token`, `Comment` and the tables of words, and tells which words end no line. Knows no layout: that is `lexer`.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from msgspec import Struct

from potto.source import Span


class Token(NamedTuple):
    """A word of the grammar. Layout tokens and inserted ones are empty: `start == end`."""

    kind: str
    text: str
    start: int
    end: int

    @property
    def span(self) -> Span:
        return Span(self.start, self.end)


class Comment(Struct, frozen=True):
    """A comment from its `#` to the end of its line; `own_line` when nothing else stands on the line."""

    span: Span
    text: str
    own_line: bool


# Kinds of tokens that open and close brackets.
OPENERS = frozenset({"LPAR", "LSQB", "ADJACENT"})
CLOSERS = frozenset({"RPAR", "RSQB"})
KEYWORDS: dict[str, str] = {
    "def": "DEF",
    "for": "FOR",
    "in": "IN",
    "if": "IF",
    "then": "THEN",
    "else": "ELSE",
    "let": "LET",
    "and": "BINOP",
    "or": "BINOP",
    "not": "NOT",
    "integral": "INTEGRAL",
    "sum": "SUM",
    "diffeo": "DIFFEO",
    "from": "FROM",
    "import": "IMPORT",
    "as": "AS",
}
"""Words that can't be names. `inverse` and `where` are words only among the clauses of a diffeomorphism, and `d` only
before `(` after the body of an integral; `record`, `fold`, `with`, `product`, `min` and `max` only where what follows
makes them so (`lexer`)."""

RESERVED = frozenset(KEYWORDS)

OPERATORS: dict[str, str] = {
    "(": "LPAR",
    ")": "RPAR",
    "[": "LSQB",
    "]": "RSQB",
    ",": "COMMA",
    ";": "SEMI",
    ":": "COLON",
    "=": "EQ",
    "?": "QMARK",
    ".": "DOT",
    "..": "DOTDOT",
    "->": "ARROW",
    "~": "TILDE",
    "+": "SIGN",
    "-": "SIGN",
    "−": "SIGN",
    "*": "STAR",
    "/": "BINOP",
    "^": "BINOP",
    "<": "BINOP",
    ">": "BINOP",
    "<=": "BINOP",
    ">=": "BINOP",
    "==": "BINOP",
    "!=": "BINOP",
    "≤": "BINOP",
    "≥": "BINOP",
    "≠": "BINOP",
    "\\": "LAMBDA",
    "λ": "LAMBDA",
    "∫": "INTEGRAL",
}

PLAIN_OPERATOR: dict[str, str] = {"−": "-", "≤": "<=", "≥": ">=", "≠": "!=", "**": "^", "&&": "and", "||": "or"}
"""Operators that are written differently in the tree than in the text."""

_NAME_CHAR = "[^\\W²³¹⁰⁴-⁹]"
_NAME = f"(?!λ)[^\\W\\d²³¹⁰⁴-⁹]{_NAME_CHAR}*"

MASTER = re.compile(
    rf"""[ \t\f\v]*(?:
      (?P<NAME>{_NAME}(?:\.{_NAME})*)
    | (?P<NUMBER>[0-9]+(?:\.(?![.\w])|(?:\.[0-9]+)?(?:[eE][+-]?[0-9]+)?(?!\w|\.[0-9])))
    | (?P<FOREIGN>//|[+\-*/]=(?!=))
    | (?P<OPERATOR>\*\*|&&|\|\||<=|>=|==|!=|->|\.\.|[()\[\],;:=?.~+\-−*/^<>≤≥≠\\λ∫])
    | (?P<NEWLINE>\n)
    | (?P<COMMENT>\#[^\n]*)
    | (?P<BADNUMBER>[0-9](?:\w|\.(?=\w)|(?<=[eE])[+-](?=[0-9]))*)
    | (?P<STRING>"[^"\n]*"?|'[^'\n]*')
    | (?P<END>\Z)
    | (?P<UNKNOWN>[^\n])
    )""",
    re.VERBOSE,
)

_AWAITS = re.compile(r"(?:[+\-−*/^?<≤≥≠]|(?<!-)>|[=!<>]=|(?<![\w.])(?:and|or|not)|(?P<colon>:))\Z")

FIRST_NAME = re.compile(_NAME)
NUMBER_PREFIX = re.compile(r"[0-9]+(?:\.[0-9]+)?(?:[eE][+-]?[0-9]+)?")


def awaits_operand(code: str, start: int, end: int) -> bool:
    """Whether code from `start` to `end`, where no comment stands, ends with an operator: an operand is to come.
    The `:` of `p ? a : b` is one, that of a loop or a type is not."""
    found = _AWAITS.search(code, max(start, end - 4), end)
    return found is not None and (found["colon"] is None or code.find("?", start, end) >= 0)


def normalized(text: str) -> str:
    """The text with every line end as one LF at the same offsets: a lone CR becomes LF, CRLF a blank and LF."""
    if "\r" not in text:
        return text
    return text.replace("\r\n", " \n").replace("\r", "\n")
