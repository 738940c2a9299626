r"""Boxes as LaTeX, for notebooks and papers.

Owns `latex` and `latex_integral`. MathJax and KaTeX read what they write.
"""

from __future__ import annotations

import re
from collections.abc import Container

from msgspec.structs import replace

from potto.syntax.typesetting.boxes import (
    GREEK,
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

_LETTERS = {symbol: name for name, symbol in GREEK.items() if name != "inf"} | {
    "Γ": "Gamma", "Δ": "Delta", "Θ": "Theta", "Λ": "Lambda", "Ξ": "Xi", "Π": "Pi", "Σ": "Sigma", "Φ": "Phi",
    "Ψ": "Psi", "Ω": "Omega", "ζ": "zeta", "ι": "iota", "ξ": "xi", "υ": "upsilon", "ℓ": "ell", "∞": "infty",
}  # fmt: skip
_NAMES = frozenset(_LETTERS.values())
_OPERATORS = frozenset(["sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "log", "min", "max"])
_SIGNS = {"≤": r" \le ", "≥": r" \ge ", "≠": r" \ne ", "=": " = ", "<": " < ", ">": " > ", "+": " + ", "−": " - ",
          "∂": r"\partial ", "~": r" \sim ", "∈": r" \in ", "·": r" \, ", "/": "/", "¬": r"\neg "}  # fmt: skip
_WORDS = {", ": ", ", " ∧ ": r" \wedge ", " ∨ ": r" \vee ", "d": r"\mathrm{d}", "": ""}
_INDEXED = re.compile(r"(.*?[^\W\d_]'*)_?(\d+)('*)")
_PART = re.compile(r"\.(\w+)|(\w+) = ")
_INDICES = str.maketrans("₀₁₂₃₄₅₆₇₈₉", "0123456789")


class _Code(Exception):
    """Internal: something that is a program, and has no form in mathematics."""


def latex(text: str, tangents: Container[str] = ()) -> str | None:
    """An expression without `$`; None for what does not parse, or has no form in mathematics, such as a fold."""
    found = boxes(text, tangents)
    try:
        return None if found is None else _text(found)
    except _Code:
        return None


def latex_integral(head: str, variables: str, body: str, tangents: Container[str] = ()) -> str | None:
    """The integral of a body that is LaTeX already, `head` being `integral [0, 1]`; None as of `latex`."""
    frame = boxes(f"{head} 0 d({variables})", tangents)
    try:
        return _text(replace(frame, body=Word(body, "latex"))) if isinstance(frame, Big) else None
    except _Code:
        return None


def _text(box: Box) -> str:
    match box:
        case Word():
            return _word(box)
        case Row(items=items):
            return _row(items)
        case Fenced(left=left, inner=inner, right=right):
            return rf"\left{left}{_text(inner)}\right{right}"
        case Fraction(top=top, below=below):
            return rf"\frac{{{_text(top)}}}{{{_text(below)}}}"
        case Raised(base=base, exponent=exponent):
            foot = rf"\left({_text(base)}\right)" if isinstance(base, Row | Raised) else _text(base)
            return f"{foot}^{{{_text(exponent)}}}"
        case SquareRoot(inner=inner):
            return rf"\sqrt{{{_text(inner)}}}"
        case Big(sign=sign, limits=limits, body=body, last=last):
            big = r"\int" if sign == "∫" else r"\sum"
            heads = "".join(f"{big}_{{{_text(low)}}}{_above(_text(high))} " for low, high in limits)
            return heads + _text(body) + "".join(rf"\, {_text(each)}" for each in last)
        case Cases(condition=condition, then=then, orelse=orelse):
            rows = rf"{_text(then)} & {_text(condition)} \\ {_text(orelse)} & \text{{else}}"
            return rf"\begin{{cases}} {rows} \end{{cases}}"
        case Where(body=body, equations=equations):
            return rf"{_text(body)} \quad \text{{where }} {_text(equations)}"


def _above(text: str) -> str:
    return f"^{{{text}}}" if text else ""


def _row(items: tuple[Box, ...]) -> str:
    """Side by side; a number behind another factor is set apart by a dot, and a sign in front stands close."""
    texts = [_text(item) for item in items]
    for place, item in enumerate(items):
        if isinstance(item, Word) and item.kind == "sign":
            if place == 0 and item.text in "−+":
                texts[0] = texts[0].strip()
            elif item.text == "·" and texts[place + 1][:1].isdigit():
                texts[place] = r" \cdot "
    return "".join(texts)


def _word(word: Word) -> str:
    match word.kind:
        case "latex":
            return word.text
        case "number":
            return _number(word.text)
        case "sign":
            return _SIGNS.get(word.text, word.text)
        case "words":
            return _words(word.text)
        case _:
            return rf"\{word.text}" if word.text in _OPERATORS else _name(word.text)


def _words(text: str) -> str:
    found = _PART.fullmatch(text)
    if found is not None:
        part = _name(found[1] or found[2])
        return f".{part}" if found[1] else f"{part} = "
    if text not in _WORDS:
        raise _Code
    return _WORDS[text]


def _number(text: str) -> str:
    mantissa, _, exponent = text.lower().partition("e")
    if not exponent:
        return text
    power = rf"10^{{{int(exponent)}}}"
    return power if mantissa == "1" else rf"{mantissa} \times {power}"


def _name(name: str) -> str:
    r"""As mathematics writes it: `theta` and `θ` are `\theta`, `x1` is x with an index."""
    plain = name.translate(_INDICES).replace("′", "'")
    found = _INDEXED.fullmatch(plain)
    if found is not None:
        return f"{_name(found[1])}_{{{found[2]}}}{found[3]}"
    stem = plain.rstrip("'")
    letter, primes = _LETTERS.get(stem, stem), plain[len(stem) :]
    if letter in _NAMES:
        return rf"\{letter}{primes}"
    if len(stem) < 2:
        return stem + primes
    escaped = stem.replace("_", r"\_")
    return rf"\mathrm{{{escaped}}}{primes}"
