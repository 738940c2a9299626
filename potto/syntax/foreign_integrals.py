"""Integrals in the notations of mathematics and of other languages.

Owns `foreign_integral`: one message for an integral that names its variables at its head (`integral x = 0..1 body`),
lets its bounds stand side by side, or is written as a call; and how it is written here.
"""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import Struct

from potto.diagnostics import Diagnostic, Replacement, Suggestion
from potto.source import Span
from potto.syntax import kinds
from potto.syntax.tokens import Token

_OPENING, _CLOSING = ("LPAR", "LSQB", "ADJACENT"), ("RPAR", "RSQB")
_OPERATORS = ("BINOP", "STAR", "SIGN")
LONGEST = 200  # tokens that are looked at behind an `integral`


class _Bound(Struct, frozen=True):
    """One variable of the head: its name (empty if it is not said) and its bound as it is written here."""

    variable: str
    written: str


class _Head(Struct, frozen=True):
    """The bounds that follow an `integral`, how many tokens they take, and whether they are written as here."""

    bounds: tuple[_Bound, ...]
    size: int
    foreign: bool


def foreign_integral(text: str, tokens: Sequence[Token], found: Sequence[Diagnostic]) -> Diagnostic | None:
    """What is said of the first integral of a chunk with errors that is not written as Potto writes it.

    `found` are the messages of the chunk: one of them knows where an integral without its `d(…)` ends.
    """
    tokens = [token for token in tokens if token.text]
    for index, word in enumerate(tokens):
        if word.kind != "INTEGRAL":
            continue
        rest = tokens[index + 1 : index + 1 + LONGEST]
        head = _head(text, rest)
        if head is not None and head.foreign and head.bounds:
            end = tokens[index + head.size].end
            return _rewritten(word, head.bounds, end, found)
        called = _called(text, rest)
        if called is not None:
            return kinds.OTHER_LANGUAGE(word.span, "an integral is not a call", help=f"write `{called}`")
    return None


def _rewritten(word: Token, bounds: tuple[_Bound, ...], end: int, found: Sequence[Diagnostic]) -> Diagnostic:
    first = ", ".join(bound.written for bound in bounds)
    if len(bounds) > 1 or "~" in first:
        first = f"({first})"
    variables = ", ".join(bound.variable or "xyzuvw"[place % 6] for place, bound in enumerate(bounds))
    closing = f" d({variables})"
    open_end = [d.related[0].span.end for d in found if d.code == kinds.NO_DIFFERENTIAL.code and d.span == word.span]
    edits = [Replacement(Span(word.end, end), f" {first}")]
    if open_end and open_end[0] >= end:
        edits.append(Replacement(Span(open_end[0], open_end[0]), closing))
    named = all(bound.variable for bound in bounds)
    order = "the bounds of an integral come first, in brackets, and its variables last"
    grouped = "the bounds of several variables stand in parentheses, with commas between them"
    return kinds.OTHER_LANGUAGE(
        Span(word.start, end),
        order if any(bound.variable for bound in bounds) or len(bounds) == 1 else grouped,
        help=f"write `{word.text} {first} …{closing}`",
        suggestions=(Suggestion(f"Write `{word.text} {first} …{closing}`", tuple(edits)),) if named else (),
    )


def _head(text: str, tokens: Sequence[Token]) -> _Head | None:
    """The bounds at the start of these tokens, in any notation; None if there are none."""
    first = [token.kind for token in tokens[:3]]
    if len(first) < 3:
        return None
    if first[0] in ("LPAR", "LSQB") and first[1] == "NAME" and first[2] in ("IN", "EQ", "TILDE", "FROM"):
        inner = _several(text, tokens[1:])
        if inner is None or inner.size + 1 >= len(tokens) or tokens[inner.size + 1].kind not in _CLOSING:
            return None
        right = first[0] == "LPAR" and not inner.foreign
        return _Head(inner.bounds, inner.size + 2, not right)
    found = _several(text, tokens)
    if found is None:
        return None
    alone = len(found.bounds) == 1 and first[0] == "LSQB"
    return _Head(found.bounds, found.size, not alone)


def _several(text: str, tokens: Sequence[Token]) -> _Head | None:
    """Bounds with commas between them, or side by side."""
    bounds: list[_Bound] = []
    at, foreign = 0, False
    while True:
        one = _one(text, tokens[at:])
        if one is None:
            return None
        bounds += one.bounds
        foreign = foreign or one.foreign
        at += one.size
        if at + 1 < len(tokens) and tokens[at].kind == "COMMA":
            at += 1
        elif _is_bound(tokens[at:]):
            foreign = True
        else:
            return _Head(tuple(bounds), at, foreign)


def _is_bound(tokens: Sequence[Token]) -> bool:
    """Whether `[c, d]` behind `[a, b]` is a second bound, and no array: what is integrated comes behind it."""
    size = _operand(tokens) if tokens and tokens[0].text == "[" else 0
    behind = tokens[size].kind if 0 < size < len(tokens) else ""
    return _commas(tokens[1 : size - 1]) == 1 and (behind in ("NAME", "NUMBER") or behind in _OPENING)


def _one(text: str, tokens: Sequence[Token]) -> _Head | None:
    """`x in [a, b]`, `x = a..b`, `x from a to b`, `from a to b`, `a..b`, `x ~ m(…)` or `[a, b]`."""
    name, at = "", 0
    if len(tokens) > 2 and tokens[0].kind == "NAME":
        name, at = tokens[0].text, 1
        if tokens[1].kind == "TILDE" and tokens[2].kind == "NAME":
            size = _operand(tokens[2:])
            if not size:
                return None
            return _Head((_Bound(name, f"{name} ~ {_text(text, tokens[2 : 2 + size])}"),), 2 + size, False)
        if tokens[1].kind in ("IN", "EQ"):
            at = 2
        elif tokens[1].kind != "FROM":
            return None
    start = at + 1 if at < len(tokens) and tokens[at].kind == "FROM" else at
    if start == at and at < len(tokens) and tokens[at].text == "[":
        size = _operand(tokens[at:])
        inside = tokens[at + 1 : at + size - 1]
        if not size or _commas(inside) != 1:
            return None
        return _Head((_Bound(name, _text(text, tokens[at : at + size])),), at + size, bool(name))
    low = _arithmetic(tokens[start:])
    between = tokens[start + low] if low and start + low < len(tokens) else None
    if between is None or not (between.kind == "DOTDOT" or (start > at and between.text == "to")):
        return None
    second = start + low + 1
    high = _arithmetic(tokens[second:])
    if not high:
        return None
    written = f"[{_text(text, tokens[start : start + low])}, {_text(text, tokens[second : second + high])}]"
    return _Head((_Bound(name, written),), second + high, True)


def _called(text: str, tokens: Sequence[Token]) -> str | None:
    """How the integral in `integral([a, b], body, x)` is written, if that is what follows the word."""
    if not tokens or tokens[0].kind not in ("LPAR", "ADJACENT"):
        return None
    parts: list[list[Token]] = [[]]
    depth = 0
    for token in tokens[1 : max(_operand(tokens) - 1, 0)]:
        depth += (token.kind in _OPENING) - (token.kind in _CLOSING)
        if depth == 0 and token.kind == "COMMA":
            parts.append([])
        else:
            parts[-1].append(token)
    bounds = [part for part in parts if part and part[0].kind == "LSQB" and _commas(part[1:-1]) == 1]
    variables = [part for part in parts if len(part) == 1 and part[0].kind == "NAME"]
    bodies = [part for part in parts if part not in bounds and part not in variables]
    if len(bounds) != 1 or len(variables) != 1 or len(bodies) != 1:
        return None
    return f"integral {_text(text, bounds[0])} {_text(text, bodies[0])} d({variables[0][0].text})"


def _arithmetic(tokens: Sequence[Token]) -> int:
    """How many tokens at the start are operands with operators between them."""
    at = 1 if tokens and tokens[0].kind == "SIGN" else 0
    size = _operand(tokens[at:])
    if not size:
        return 0
    at += size
    while at < len(tokens) and tokens[at].kind in _OPERATORS:
        size = _operand(tokens[at + 1 :])
        if not size:
            break
        at += 1 + size
    return at


def _operand(tokens: Sequence[Token]) -> int:
    """How many tokens at the start are a number, a name with what it is applied to, or something in brackets."""
    if not tokens or not (tokens[0].kind in ("NAME", "NUMBER", "MEMBER") or tokens[0].kind in _OPENING):
        return 0
    at = 0 if tokens[0].kind in _OPENING else 1
    while at < len(tokens) and tokens[at].kind in _OPENING and (at == 0 or tokens[at].start == tokens[at - 1].end):
        depth = 0
        while at < len(tokens):
            depth += (tokens[at].kind in _OPENING) - (tokens[at].kind in _CLOSING)
            at += 1
            if depth == 0:
                break
        else:
            return 0
        if tokens[0].kind in _OPENING:
            break
    return at


def _commas(tokens: Sequence[Token]) -> int:
    """The commas that no brackets enclose."""
    depth, count = 0, 0
    for token in tokens:
        depth += (token.kind in _OPENING) - (token.kind in _CLOSING)
        count += depth == 0 and token.kind == "COMMA"
    return count


def _text(text: str, tokens: Sequence[Token]) -> str:
    return text[tokens[0].start : tokens[-1].end]
