"""Words that are words of the language only where the right thing stands around them, and names elsewhere; and dots."""

from __future__ import annotations

import re

from potto.syntax.tokens import FIRST_NAME, KEYWORDS, OPERATORS, Token

ENDS_OPERAND = frozenset({"NAME", "NUMBER", "MEMBER", "FIELD", "RPAR", "RSQB"})
BEHIND = ENDS_OPERAND - {"NUMBER"}
"""What a bracket or a dot belongs to that stands directly behind it."""
_FIELD = FIRST_NAME.pattern
_THROUGH = re.compile(rf"[ \t\n]+{FIRST_NAME.pattern}[ \t\n]+in\b")
_CONTEXTUAL = {
    "fold": ("FOLD", re.compile(rf"[ \t\n]*(?:[ \t\n]{FIRST_NAME.pattern}|\((?:[^()]|\([^()]*\))*\))[ \t\n]*=(?!=)")),
    "with": ("WITH", re.compile(rf"[ \t\n]+(?:\([ \t\n]*)?{_FIELD}(?:\.{_FIELD})?[ \t\n]*=(?!=)")),
    "record": ("RECORDDEF", re.compile(rf"[ \t]+{FIRST_NAME.pattern}[ \t]*\(")),
    "product": ("SUM", _THROUGH),
    "min": ("SUM", _THROUGH),
    "max": ("SUM", _THROUGH),
}
"""The kind of each, and what has to follow."""
MAY_BE_WORDS = frozenset({*KEYWORDS, *_CONTEXTUAL, "d", "return"})
"""All that is not always a name."""
_SEEN_TO = ("LPAR", "LSQB", "RPAR", "RSQB", "COMMA", "DOT", "INTEGRAL")
SIMPLE_OPERATORS = {word: kind for word, kind in OPERATORS.items() if kind not in _SEEN_TO}
"""Those that mean the same wherever they stand."""


def contextual(tokens: list[Token], word: str, text: str, end: int) -> str | None:
    """The kind of a word that ends here, behind these tokens; None where it is a name."""
    found = _CONTEXTUAL.get(word)
    if found is None or found[1].match(text, end) is None:
        return None
    if (word == "record" and tokens) or (tokens and tokens[-1].kind in ("DEF", "DIFFEODEF")):
        return None
    return found[0] if word != "with" or (tokens and tokens[-1].kind in BEHIND) else None


def uses_parameters(tokens: list[Token], start: int) -> bool:
    """Whether what begins at `start`, behind a dot of a lambda, uses a parameter of that lambda. Then it is no further
    group of parameters: `\\p . p.0` is a part of p, where `\\p . c.0` takes p and c."""
    place = next(place for place in reversed(range(len(tokens))) if tokens[place].start == start)
    used = {token.text.partition(".")[0] for token in tokens[place:] if token.kind in ("NAME", "MEMBER")}
    while place > 0 and tokens[place - 1].kind not in ("LAMBDA", "INVERSE"):
        place -= 1
        if tokens[place].kind == "NAME" and tokens[place].text in used:
            return True
    return False
