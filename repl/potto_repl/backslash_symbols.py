"""Symbols that are typed as `\\theta` and a tab, and how answers use them.

Owns `SYMBOLS`, `typed`, `expanded`, `named`, `pretty`, `ascii_only` and `readable`. Everything that is
inserted can be read by Potto.
"""

from __future__ import annotations

import re

SYMBOLS: dict[str, str] = {
    "alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ", "epsilon": "ε", "zeta": "ζ", "eta": "η", "theta": "θ",
    "iota": "ι", "kappa": "κ", "lambda": "λ", "mu": "μ", "nu": "ν", "xi": "ξ", "pi": "pi", "rho": "ρ", "sigma": "σ",
    "tau": "τ", "upsilon": "υ", "phi": "φ", "chi": "χ", "psi": "ψ", "omega": "ω",
    "Gamma": "Γ", "Delta": "Δ", "Theta": "Θ", "Lambda": "Λ", "Xi": "Ξ", "Pi": "Π", "Sigma": "Σ", "Phi": "Φ",
    "Psi": "Ψ", "Omega": "Ω",
    "int": "∫", "integral": "∫", "partial": "∂", "le": "≤", "leq": "≤", "ge": "≥", "geq": "≥", "ne": "≠", "neq": "≠",
    "ell": "ℓ",
}  # fmt: skip
SYMBOLS.update({f"_{digit}": symbol for digit, symbol in zip("0123456789", "₀₁₂₃₄₅₆₇₈₉", strict=True)})
_TYPED = re.compile(r"\\(_[0-9]|[A-Za-z]+)$")
_ASCII = {"±": "+/-", "∫": "integral ", "∂": "deriv ", "≤": "<=", "≥": ">=", "≠": "!=", "π": "pi", "…": "...", "·": "*",
          "→": "->", "−": "-", "×": "x", "▀": "#", "█": "#"}  # fmt: skip


def typed(before: str) -> str | None:
    r"""What was typed of a symbol just before the cursor: `\the` of `x + \the`."""
    found = _TYPED.search(before)
    return found[0] if found is not None else None


def expanded(word: str) -> str | None:
    r"""The symbol that `\theta` stands for; also of a beginning that only one symbol has."""
    name = word.removeprefix("\\")
    if name in SYMBOLS:
        return SYMBOLS[name]
    matches = {symbol for key, symbol in SYMBOLS.items() if key.startswith(name)}
    return matches.pop() if len(matches) == 1 else None


def named(word: str) -> list[str]:
    r"""The symbols whose names begin with what was typed, as they are typed: `\phi` and `\psi` of `\p`."""
    return sorted(f"\\{name}" for name in SYMBOLS if name.startswith(word.removeprefix("\\")))


def pretty(text: str, unicode: bool) -> str:
    """A formula with the symbols that Potto reads as well."""
    if not unicode:
        return text
    for word, symbol in ((r"\bintegral\b ?", "∫ "), ("<=", "≤"), (">=", "≥"), ("!=", "≠")):
        text = re.sub(word, symbol, text)
    return text


def ascii_only(text: str) -> str:
    """The text for a screen without Unicode. What has no other form is escaped."""
    if text.isascii():
        return text
    replaced = "".join(_ASCII.get(char, char) for char in text)
    return replaced.encode("ascii", "backslashreplace").decode("ascii")


def readable(text: str) -> str:
    """An entry as the parser takes it: `∂ f` is `deriv f`."""
    return re.sub(r"∂[ \t]*", "deriv ", text) if "∂" in text else text
