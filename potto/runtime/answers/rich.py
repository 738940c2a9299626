"""Answers for notebooks: HTML and LaTeX of the digits that hold.

Owns `as_html` and `as_latex`, and the same for answers of several rows, as a derivative with its parts. The digits are
chosen in `printing`.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from potto.runtime.answers.printing import with_error

Row = tuple[str, Any, Any]  # what a number is called, the number, its error


def as_html(value: Any, error: Any, missed: str, cost: str) -> str:
    """The number with its bar, in front what it missed, and behind it what it cost, in small print."""
    import html  # its table of signs takes longer to load than all else here, and only notebooks ask

    warning = f'<strong style="color:#b3261e">{html.escape(missed)}</strong> ' if missed else ""
    text = html.escape(with_error(value, error))
    return f'{warning}<code>{text}</code> <small style="opacity:.7">{html.escape(cost)}</small>'


def rows_html(rows: Sequence[Row], missed: str, cost: str) -> str:
    """A table: what each number is called, the number with its bar; what it cost below."""
    if len(rows) == 1:
        return as_html(*rows[0][1:], missed, cost)
    import html

    warning = f'<strong style="color:#b3261e">{html.escape(missed)}</strong>' if missed else ""
    lines = [
        f'<tr><td style="text-align:left">{html.escape(label.strip())}</td>'
        f'<td style="text-align:left"><code>{html.escape(with_error(value, error))}</code></td></tr>'
        for label, value, error in rows
    ]
    return f'{warning}<table>{"".join(lines)}</table><small style="opacity:.7">{html.escape(cost)}</small>'


def rows_latex(rows: Sequence[Row]) -> str:
    """Numbers below each other, each with its bar and what it is called."""
    if len(rows) == 1:
        return as_latex(*rows[0][1:])
    lines = [rf"\text{{{label.strip()}}} &\quad {as_latex(value, error)[1:-1]}" for label, value, error in rows]
    return "$\\begin{aligned}" + r" \\ ".join(lines) + "\\end{aligned}$"


def as_latex(value: Any, error: Any, missed: str = "") -> str:
    """`$0.0270 \\pm 0.0051$`, powers of ten as such; in front what it missed."""
    text = with_error(value, error).replace("±", r"\pm").replace("…", r"\ldots").replace("...", r"\ldots")
    text = re.sub(r"(?<=\d)e(-?\d+)", r" \\times 10^{\1}", text)
    text = re.sub(r"\b(nan|at most |error unknown|more)(?![a-z])", r"\\text{\1}", text)
    text = re.sub(r"(?<![a-z])inf(?![a-z])", r"\\infty", text)
    return rf"$\text{{{missed}}}{text}$" if missed else f"${text}$"
