"""Calls written into the function that makes them, for machine code that does all of it at once.

Owns `WrittenIn`. By numpy a function is compiled alone and called for all points at once; so it could be as machine
code, with memory between the two for each number that is handed over. But LLVM takes 3.4 ms for a short function, and
3.8 with two others written into it: what a call between them would save is less than it costs at the points.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from potto.calculus.inlining.expand import expanded
from potto.core.terms import App, Deriv, Lam, Term, lam, postorder, substitute
from potto.kernels.cells import Cell, Value
from potto.runtime.evaluation.functions import Closure

MOST_TERMS = 300  # of the whole: what is larger takes a tenth of a second to compile, and is worth keeping in parts
MOST_KNOWN = 1000


class WrittenIn:
    """function: what a term that is called leads to."""

    def __init__(self, function: Callable[[Term], Lam | Deriv | None]) -> None:
        self.function = function
        self.known: dict[tuple[Lam, tuple[Lam | None, ...]], Lam | None] = {}

    def of(self, function: Lam, args: Sequence[Value]) -> tuple[Lam, list[Value]] | None:
        """A function of numbers that calls nothing, and its arguments; None where there is none that is short."""
        passed = tuple([arg.lam if type(arg) is Closure and not arg.captured else None for arg in args])
        rest = [arg for arg, own in zip(args, passed, strict=True) if own is None]
        if not all(isinstance(arg, Cell) for arg in rest):
            return None
        key = function, passed
        if key not in self.known:
            if len(self.known) >= MOST_KNOWN:
                self.known.clear()
            self.known[key] = self._whole(function, passed)
        whole = self.known[key]
        return None if whole is None else (whole, rest)

    def _whole(self, function: Lam, passed: tuple[Lam | None, ...]) -> Lam | None:
        given = {name: own for name, own in zip(function.params, passed, strict=True) if own is not None}
        body = expanded(substitute(function.body, given), self.function)
        terms = postorder(body)
        if len(terms) > MOST_TERMS or any(isinstance(term, App) for term in terms):
            return None
        return lam(tuple(name for name in function.params if name not in given), body)
