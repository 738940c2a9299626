"""Where the body of `sum i in lo..hi (body)` begins: `n (body)` would otherwise read as a call.

Owns `mark_bodies`. A `(` set off by a blank begins the body; where there is none, the last of the first run of groups
does: `1..n(i^2)`, `1..f(n)(i)`.
"""

from __future__ import annotations

from potto.syntax.tokens import Token

_ENDS_OPERAND = frozenset({"NAME", "NUMBER", "MEMBER", "RPAR", "RSQB"})
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
        "$END",
    }
)


def mark_bodies(tokens: list[Token]) -> list[Token]:
    """The tokens with an empty SUMBODY before the body of each `sum`."""
    marks: set[int] = set()
    for index, token in enumerate(tokens):
        if token.kind == "DOTDOT":
            body = _body(tokens, index + 1)
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


def _body(tokens: list[Token], index: int) -> int | None:
    """The index of the `(` that opens the body of the sum whose upper bound starts at `index`."""
    depth, run_ended, best = 0, False, None
    previous = tokens[index - 1]
    while index < len(tokens):
        token = tokens[index]
        if token.kind in ("LPAR", "LSQB"):
            if depth == 0 and token.kind == "LPAR" and previous.kind in _ENDS_OPERAND:
                if token.start > previous.end:
                    return index
                if not run_ended:
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
