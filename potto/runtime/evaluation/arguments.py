"""Arguments of calls, and functions that take all that is given at once.

Owns `fit` and `uncurried`.
"""

from __future__ import annotations

from potto.calculus.inlining.currying import uncurry
from potto.core.terms import Lam, Term, lam
from potto.kernels import errors
from potto.kernels.cells import Value

MOST = 10_000
_known: dict[tuple[Lam, tuple[int, ...]], tuple[Lam, tuple[int, ...]]] = {}


def fit(group: tuple[Value, ...], arity: int) -> tuple[Value, ...]:
    """A group of arguments as the parameters take it: a tuple spread out, or several made into one tuple."""
    if len(group) == arity:
        return group
    if len(group) == 1 and isinstance(group[0], tuple) and len(group[0]) == arity:
        return group[0]
    if arity == 1 and len(group) > 1:
        return (tuple(group),)
    raise errors.wrong_call(f"{len(group)} argument(s) given to a function that takes {arity}")


def uncurried(function: Lam, sizes: tuple[int, ...]) -> tuple[Lam, tuple[int, ...]]:
    """The function with captured names and as many groups of parameters as are given at once; the size of each."""
    found = _known.get((function, sizes))
    if found is None:
        params, body = uncurry(function, sizes)
        arities: list[int] = []
        inner: Term = function
        for size in sizes:
            arities.append(len(inner.params) if isinstance(inner, Lam) else size)
            inner = inner.body if isinstance(inner, Lam) else inner
        captured = tuple(sorted(function.free))
        found = (lam(captured + params, body), tuple(arities))
        if len(_known) > MOST:
            _known.clear()
        _known[function, sizes] = found
    return found
