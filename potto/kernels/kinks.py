"""Builtins with kinks in kernels: what tells at run time whether one of them is just at a kink.

Owns `bends` and `watched`.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

from potto.core.terms import Prim, Term, postorder, var
from potto.kernels.emit import COMPARISONS, ZERO, Lines, Scalar
from potto.primitives import PRIMITIVES


@lru_cache(maxsize=16384)
def bends(body: Term) -> bool:
    """Whether there is a builtin with kinks in a term."""
    builtins = (node for node in postorder(body) if isinstance(node, Prim) and node.op not in COMPARISONS)
    return any(PRIMITIVES[node.op].kinks(*node.args) for node in builtins)


def watched(out: Lines, term: Prim, args: Sequence[Scalar]) -> str | None:
    """The numbers that are 0 at the kinks of a builtin that moves, with their errors, as the text of a tuple."""
    if term.op in COMPARISONS or not any(t for arg in args for t in arg.t):
        return None
    names = [f"#{i}" for i in range(len(args))]
    kinks = PRIMITIVES[term.op].kinks(*map(var, names))
    local = {name: Scalar(arg.v, arg.e, out.none, out.none) for name, arg in zip(names, args, strict=True)}
    memo: dict[Term, Scalar] = {}
    numbers = [out.smooth(kink, local, memo) for kink in kinks]
    return f"({''.join(f'({x.v}, {x.e or ZERO}), ' for x in numbers)})" if numbers else None
