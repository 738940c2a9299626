"""Answers for notebooks: HTML and LaTeX of the digits that hold.

Owns `as_html` and `as_latex`. The digits are chosen in `printing`.
"""

from __future__ import annotations

import html
import re
from typing import Any

from potto.runtime.answers.printing import with_error


def as_html(value: Any, error: Any, missed: str, cost: str) -> str:
    """The number with its bar, in front what it missed, and behind it what it cost, in small print."""
    warning = f'<strong style="color:#b3261e">{html.escape(missed)}</strong> ' if missed else ""
    text = html.escape(with_error(value, error))
    return f'{warning}<code>{text}</code> <small style="opacity:.7">{html.escape(cost)}</small>'


def as_latex(value: Any, error: Any) -> str:
    """`$0.0270 \\pm 0.0051$`, powers of ten as such."""
    text = with_error(value, error).replace("±", r"\pm").replace("…", r"\ldots").replace("...", r"\ldots")
    text = re.sub(r"(?<=\d)e(-?\d+)", r" \\times 10^{\1}", text)
    text = re.sub(r"\b(nan|at most|error unknown|more)\b", r"\\text{\1}", text)
    text = re.sub(r"(?<![a-z])inf(?![a-z])", r"\\infty", text)
    return f"${text}$"
