"""How high the degree of an integrand is in its variables, between the surfaces that cut it.

Owns `degree`, `plane` and `quadric`. A Gauss rule with n nodes is exact up to degree 2n - 1: of a length, an area or a
volume one node along the innermost variable says everything.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache

from potto.core.terms import Branch, Const, If, Prim, Proj, Term, Tuple, Var, children, postorder, unknown
from potto.core.walking import Kept

_ARITHMETIC = frozenset(("add", "neg", "mul", "div"))
MOST = 40  # more nodes than these ask for are no saving


def degree(term: Term, variables: Iterable[str]) -> int | None:
    """The largest degree that a term has in some variables together on any side of its surfaces; None if it is no
    polynomial."""
    names = frozenset(variables)
    found = _known(names).table()
    for node in unknown(term, found, value_parts):
        found[node] = 0 if names.isdisjoint(node.free) else _node(node, [found[part] for part in value_parts(node)])
    return found[term]


@lru_cache(maxsize=64)
def _known(names: frozenset[str]) -> Kept[Term, int | None]:
    """Degrees in these variables: where another shader stands between surfaces, most parts are what they were."""
    return Kept()


def plane(term: Term, variables: Iterable[str]) -> bool:
    """Whether a term is affine in some variables together, without sides, by its form."""
    names = frozenset(variables)
    return _steady(term, names, _ARITHMETIC) and degree(term, names) in (0, 1)


@lru_cache(maxsize=4096)
def quadric(term: Term, names: frozenset[str]) -> bool:
    """Whether a term is a polynomial of degree 2 at most in some variables together, without sides, by its form."""
    return _steady(term, names, _ARITHMETIC | {"pow"}) and degree(term, names) in (0, 1, 2)


def _steady(term: Term, names: frozenset[str], allowed: frozenset[str]) -> bool:
    return all(names.isdisjoint(n.free) or isinstance(n, Var) or (isinstance(n, Prim) and n.op in allowed)
               for n in postorder(term))  # fmt: skip


def value_parts(node: Term) -> Sequence[Term]:
    """What a term's value is made of: of a conditional both sides, whatever decides."""
    return (node.then, node.orelse) if isinstance(node, Branch | If) else children(node)


def _node(node: Term, parts: Sequence[int | None]) -> int | None:
    known = [part for part in parts if part is not None]
    if len(known) < len(parts):
        return None
    match node:
        case Var():
            return 1
        case Branch() | Tuple() | Proj() | Prim(op="add" | "neg" | "abs" | "min" | "max"):
            total = max(known)
        case Prim(op="mul"):
            total = sum(known)
        case Prim(op="div") if known[1] == 0:
            total = known[0]
        case Prim(op="pow", args=(_, Const(value=exponent))) if exponent >= 0 and exponent.is_integer():
            total = known[0] * int(exponent)
        case Prim() if not any(known):  # of steps
            total = 0
        case _:
            return None
    return total if total <= MOST else None
