"""Builtins with kinks, and what jumps, in kernels: what tells at run time whether one of them is just at such a place.

Owns `bends` and `watched`.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

from potto.core.terms import Branch, Prim, Term, postorder, prim, var
from potto.kernels.emit import ZERO, Lines, Scalar
from potto.primitives import PRIMITIVES


@lru_cache(maxsize=16384)
def bends(body: Term) -> bool:
    """Whether there is a builtin with kinks in a term, or anything that jumps."""
    return any(isinstance(node, Branch) or (isinstance(node, Prim) and places(node)) for node in postorder(body))


def places(term: Prim) -> tuple[Term, ...]:
    """Terms that are 0 where a builtin has its kinks, or jumps."""
    entry = PRIMITIVES[term.op]
    return (*entry.kinks(*term.args), *entry.steps(*term.args))


def watched(out: Lines, term: Prim, args: Sequence[Scalar]) -> str | None:
    """The numbers that are 0 at the kinks of a builtin that moves, or where it jumps, with their errors, as the text of
    a tuple."""
    if not any(t for arg in args for t in arg.t):
        return None
    names = [f"#{i}" for i in range(len(args))]
    kinks = places(prim(term.op, *map(var, names)))
    local = {name: Scalar(arg.v, arg.e, out.none, out.none) for name, arg in zip(names, args, strict=True)}
    memo: dict[Term, Scalar] = {}
    numbers = [out.smooth(kink, local, memo) for kink in kinks]
    return f"({''.join(f'({x.v}, {x.e or ZERO}), ' for x in numbers)})" if numbers else None
