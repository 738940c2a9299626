"""Where the body of `sum i in lo..hi (body)` begins, or that of a fold: `n (body)` would otherwise read as a call.

Owns `mark_bodies`. A `(` set off by a blank begins the body; where there is none, the last of the first run of groups
does: `1..n(i^2)`, `1..f(n)(i)`.
"""

from __future__ import annotations

from potto.syntax.contextual import ENDS_OPERAND
from potto.syntax.tokens import OPENERS, Token

_STOPS = frozenset(
    {
        "COMMA",
        "SEMI",
        "NEWLINE",
        "INDENT",
        "DEDENT",
        "THEN",
        "ELSE",
        "IN",
        "QMARK",
        "COLON",
        "D",
        "EQ",
        "DOTDOT",
        "ALSO",
        "SUM",
        "FOLD",
        "FOR",
        "$END",
    }
)


def mark_bodies(tokens: list[Token]) -> list[Token]:
    """The tokens with an empty SUMBODY before the body of each `sum` and each `fold`."""
    marks: set[int] = set()
    for index, token in enumerate(tokens):
        if token.kind == "SUM" or token.kind == "FOLD":
            start = _last_range(tokens, index)
            body = None if start is None else _body(tokens, start)
            if body is not None:
                marks.add(body)
    if not marks:
        return tokens
    out: list[Token] = []
    for index, token in enumerate(tokens):
        if index in marks:
            out.append(Token("SUMBODY", "", token.start, token.start))
        out.append(token)
    return out


def _last_range(tokens: list[Token], index: int) -> int | None:
    """The index at which the last operand begins of what a sum or a fold goes through."""
    depth, start, waiting = 0, None, tokens[index].kind == "FOLD"  # for the `for` of a fold
    for place in range(index + 1, len(tokens)):
        kind = tokens[place].kind
        if kind in OPENERS:
            depth += 1
        elif kind == "RPAR" or kind == "RSQB":
            depth -= 1
            if depth < 0:
                break
        elif depth == 0:
            if waiting:
                if kind == "NEWLINE" or kind == "SEMI" or kind == "COMMA":
                    break
                waiting = kind != "FOR"
            elif kind == "IN" or kind == "DOTDOT":
                if kind == "IN" and start is not None and tokens[place - 2].kind != "ALSO":
                    break
                start = place + 1
            elif kind in _STOPS and kind != "ALSO":
                break
    return start


def _body(tokens: list[Token], index: int) -> int | None:
    """The index of the `(` that opens the body of the sum whose last range ends with the operand that starts here."""
    depth, run_ended, best = 0, False, None
    previous = tokens[index - 1]
    while index < len(tokens):
        token = tokens[index]
        if token.kind in OPENERS:
            if depth == 0 and token.kind == "LPAR" and previous.kind in ENDS_OPERAND:
                if token.start > previous.end:
                    return index
                if not run_ended and previous.text != "len":  # which is not a bound itself
                    best = index
            depth += 1
        elif token.kind in ("RPAR", "RSQB"):
            depth -= 1
            if depth < 0:
                break
        elif depth == 0:
            if token.kind in _STOPS:
                break
            run_ended = run_ended or best is not None
        previous = token
        index += 1
    return best
