"""What an integrand or a summand is a multiple of, in front of its integral or its sum.

Owns `in_front` and `hides_index`.
"""

from __future__ import annotations

from fractions import Fraction

from potto.calculus.algebra.ranges import range_of
from potto.calculus.explanation.factors import Factors
from potto.calculus.explanation.products import is_tangent, written
from potto.core.polynomials import Exact
from potto.core.terms import (
    Branch,
    Const,
    If,
    Integral,
    Prim,
    Proj,
    Sum,
    Term,
    Var,
    postorder,
    with_integrand,
    with_summand,
)

_EVERYWHERE = ("add", "mul", "neg", "abs", "sin", "cos", "atan", "tanh")  # no exp, which can be inf


def in_front(node: Integral | Sum, factors: Factors, tangents: frozenset[str]) -> Term:
    """An integral or a sum with what does not vary in the `factors` of its body before it: numbers, tangents and what
    has a value everywhere; where no bracket is beside them, the others too. Else brackets guard them where they are."""
    names = node.variables if isinstance(node, Integral) else (node.variable,)
    if isinstance(node, Sum) and hides_index(node):
        return node
    still = {base: n for base, n in factors.powers.items() if base.free.isdisjoint(names)}
    if not _is_bare(node, factors):
        still = {base: n for base, n in still.items() if not base.free or _is_safe(base, n, tangents)}
    rest = {base: n for base, n in factors.powers.items() if base not in still}
    if not still and factors.coefficient == 1:
        return node
    return _apart(node, factors, still, rest, tangents)


def _apart(
    node: Integral | Sum, factors: Factors, still: dict[Term, Exact], rest: dict[Term, Exact], tangents: frozenset[str]
) -> Term:
    inner = written(Factors(Fraction(1), rest, factors.exponents, factors.conditions), tangents)
    whole = with_integrand(node, inner) if isinstance(node, Integral) else with_summand(node, inner)
    return written(Factors(factors.coefficient, {whole: 1, **still}, [], []), tangents)


def _is_safe(base: Term, n: Exact, tangents: frozenset[str]) -> bool:
    if n.denominator > 1 or (n < 0 and not range_of(base).positive):
        return False
    return _has_values(base) or is_tangent(base, tangents)


def _is_bare(node: Integral | Sum, factors: Factors) -> bool:
    """Whether nothing is left out: no bracket, and a range that is never empty."""
    if factors.conditions or any(isinstance(part, Branch | If) for base in factors.powers for part in postorder(base)):
        return False
    ends = node.bounds if isinstance(node, Integral) else ((node.lo, node.hi),)
    return all(range_of(hi).lo >= range_of(lo).hi for lo, hi in ends)


def hides_index(node: Sum) -> bool:
    """Whether an index may stand within a name, as in `people[i].age`, the name of a field."""
    return any("[" in name for name in node.body.free)


def _has_values(term: Term) -> bool:
    """Whether a term has a value wherever its variables have."""
    return all(isinstance(part, Var | Const | Proj) or _is_everywhere(part) for part in postorder(term))


def _is_everywhere(part: Term) -> bool:
    match part:
        case Prim(op="pow", args=(_, Const(value=n))):
            return n.is_integer() and n > 0
        case Prim(op=op):
            return op in _EVERYWHERE
        case _:
            return False
