"""What an integrand or a summand is a multiple of, in front of its integral or its sum.

Owns `in_front` and `hides_index`.
"""

from __future__ import annotations

from fractions import Fraction

from potto.calculus.explanation.factors import Factors
from potto.calculus.explanation.products import is_tangent, written
from potto.core.terms import Const, Integral, Prim, Sum, Term, Var, postorder, with_integrand, with_summand

_EVERYWHERE = ("add", "mul", "neg", "sin", "cos", "atan", "tanh")  # no exp, which can be inf


def in_front(node: Integral | Sum, factors: Factors, tangents: frozenset[str]) -> Term:
    """An integral or a sum with the number, the tangents and what has a value everywhere of the `factors` of its body
    before it: what has none somewhere stays, since brackets guard it there."""
    names = node.variables if isinstance(node, Integral) else (node.variable,)
    if isinstance(node, Sum) and hides_index(node):
        return node
    still = {base: n for base, n in factors.powers.items() if base.free.isdisjoint(names)}
    fixed = {
        base: n
        for base, n in still.items()
        if n > 0 and n.denominator == 1 and (_has_values(base) or is_tangent(base, tangents))
    }
    if not fixed and factors.coefficient == 1:
        return node
    rest = {base: n for base, n in factors.powers.items() if base not in fixed}
    inner = written(Factors(Fraction(1), rest, factors.exponents, factors.conditions), tangents)
    whole = with_integrand(node, inner) if isinstance(node, Integral) else with_summand(node, inner)
    return written(Factors(factors.coefficient, {whole: 1, **fixed}, [], []), tangents)


def hides_index(node: Sum) -> bool:
    """Whether an index may stand within a name, as in `people[i].age`, the name of a field."""
    return any("[" in name for name in node.body.free)


def _has_values(term: Term) -> bool:
    """Whether a term has a value wherever its variables have."""
    return all(isinstance(part, Var | Const) or _is_everywhere(part) for part in postorder(term))


def _is_everywhere(part: Term) -> bool:
    match part:
        case Prim(op="pow", args=(_, Const(value=n))):
            return n.is_integer() and n > 0
        case Prim(op=op):
            return op in _EVERYWHERE
        case _:
            return False
