"""What is found when a term is searched for surfaces, and whom the search asks.

Owns `Finding`, `Resolve` and `Decide`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

from msgspec import Struct

from potto.calculus.decomposition.critical import Critical
from potto.core.terms import Deriv, Lam, Term

Kind = Literal["jump", "kink", "edge", "center", "critical", "step"]
# Where a part of the program gets its functions from: a Lam for the head of a call, or None if it is not known here.
Resolve = Callable[[Term], Lam | Deriv | None]
# The value of a plain term (a condition: 1 or 0), or None where it is not decided.
Decide = Callable[[Term], float | None]


class Finding(Struct, frozen=True):
    """One surface `surface = 0`, over the variables of the term that was searched.

    kind: a jump (a branch), a kink (abs, max), an edge, where the term stops being smooth or defined (sqrt at 0), or a
        center, around which a smooth term may be concentrated (x - m in exp(-(x - m)^2), u in 1/(1 + exp(u))), or a
        critical place of an integral: of `surface` and others, somewhere inside; or a step, where what parameters alone
        decide (`if a < b`, floor) changes.
    path: for a jump, the sites of the trace that lead to the branch.
    """

    kind: Kind
    surface: Term
    path: tuple[int, ...] = ()
    strict: bool = False
    critical: Critical | None = None
