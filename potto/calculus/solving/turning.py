"""Where roots in closed form come and go, or move infinitely fast, as the other variables vary.

Owns `turning` and `steep`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from potto.calculus.algebra.ranges import positive, range_of, vanishing
from potto.core.terms import Branch, Const, Prim, Term, neg, postorder
from potto.primitives import PRIMITIVES


def turning(roots: Iterable[Term], indices: frozenset[str]) -> tuple[Term, ...]:
    """Radicands, divisors, arguments of log, kinks, conditions met in roots: a root comes, goes or turns where one is
    0. indices: those of periodic roots, for which nothing is said."""
    return _vanishing(roots, indices, _edges)


def steep(roots: Iterable[Term], indices: frozenset[str]) -> tuple[Term, ...]:
    """Those of them where roots may move infinitely fast. Where a condition ends them they don't, as those of
    abs(x) = t at t = 0."""
    return _vanishing(roots, indices, _steep)


def _vanishing(
    roots: Iterable[Term], indices: frozenset[str], edges: Callable[[Term], tuple[Term, ...]]
) -> tuple[Term, ...]:
    found: dict[Term, None] = {}
    for node in postorder(*roots):
        for edge in edges(node):
            for term in vanishing(_mostly(edge)):  # the surface and the cases of a branch are looked at on their own
                if not isinstance(term, Branch) and not term.free & indices:
                    found.setdefault(neg(term) if neg(term) in found else term)
    return tuple(found)


def _mostly(term: Term) -> Term:
    """The other case of a branch whose surface is nowhere positive: that changes no sides."""
    if isinstance(term, Branch) and range_of(term.surface).hi <= 0:
        return term.orelse
    return term


def _edges(node: Term) -> tuple[Term, ...]:
    match node:
        case Branch():
            return () if _mostly(node) is not node else (node.surface,)
        case Prim(op=op, args=args) if op in PRIMITIVES:
            return (*_steep(node), *PRIMITIVES[op].kinks(*args))
        case _:
            return ()


def _steep(node: Term) -> tuple[Term, ...]:
    """What is 0 where a builtin has a pole, or an infinite slope."""
    match node:
        case Prim(op="div", args=(_, below)):
            return () if positive(below) else (below,)
        case Prim(op="pow", args=(base, exponent)):
            whole = isinstance(exponent, Const) and exponent.value.is_integer() and exponent.value > 0
            return () if whole else (base,)
        case Prim(op=op, args=args) if op in PRIMITIVES:
            return PRIMITIVES[op].edges(*args)
        case _:
            return ()
