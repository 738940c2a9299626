"""Boxes on a line of Unicode.

Owns `unicode`.
"""

from __future__ import annotations

import re
from collections.abc import Container

from potto.syntax.typesetting.boxes import (
    Big,
    Box,
    Cases,
    Fenced,
    Fraction,
    Raised,
    Row,
    SquareRoot,
    Where,
    Word,
    boxes,
)

_ABOVE = str.maketrans("0123456789-−", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁻")
_BELOW = str.maketrans("0123456789-−", "₀₁₂₃₄₅₆₇₈₉₋₋")
_SMALL = re.compile(r"[-−]?\d+")
_SPACED = {"+", "−", "<", ">", "≤", "≥", "=", "≠"}


def unicode(text: str, tangents: Container[str] = ()) -> str:
    """An expression on one line, with the signs of mathematics."""
    found = boxes(text, tangents)
    return text if found is None else _text(found)


def _text(box: Box) -> str:
    match box:
        case Word(text=text):
            return text
        case Row(items=items):
            return _row(items)
        case Fenced(left=left, inner=inner, right=right):
            return f"{left}{_text(inner)}{right}"
        case Fraction(inline=inline):
            return _text(inline)
        case Raised(base=base, exponent=exponent):
            below = f"({_text(base)})" if isinstance(base, Row) and base.items[0] == Word("∂", "sign") else _text(base)
            power = _text(exponent)
            if _SMALL.fullmatch(power):
                return f"{below}{power.translate(_ABOVE)}"
            return f"{below}^{power}" if isinstance(exponent, Word) else f"{below}^({power})"
        case SquareRoot(inner=inner):
            text = _text(inner)
            return f"√{text}" if isinstance(inner, Word) else f"√({text})"
        case Big():
            return _big(box)
        case Cases(condition=condition, then=then, orelse=orelse):
            return f"if {_text(condition)} then {_text(then)} else {_text(orelse)}"
        case Where(body=body, equations=equations):
            return f"{_text(body)} where {_text(equations)}"


def _row(items: tuple[Box, ...]) -> str:
    out = ""
    for place, item in enumerate(items):
        text = _text(item)
        if isinstance(item, Word) and item.kind == "sign" and text in _SPACED and place:
            out += f" {text} "
        else:
            out += text
    return out


def _big(box: Big) -> str:
    signs = ""
    for low, high in box.limits:
        below, above = _text(low), _text(high)
        if _SMALL.fullmatch(below) and _SMALL.fullmatch(above):
            signs += box.sign + below.translate(_BELOW) + above.translate(_ABOVE)
        elif not above:
            signs += f"{box.sign}({below})"
        else:
            signs += f"{box.sign}[{below}, {above}]"
    return " ".join([signs, _text(box.body), *map(_last, box.last)])


def _last(box: Box) -> str:
    """dx, and d time."""
    text = _text(box)
    return text if len(text) == 2 else f"{text[:1]} {text[1:]}"
