"""Whether the integral of a summand is known to have a value, also where those of the others should have none.

Owns `is_finite`. Where only the sum of two is integrable, as of cos(x)/x and -1/x, it may not be taken apart.
"""

from __future__ import annotations

import math
from collections.abc import Set

from potto.calculus.decomposition.factors import factors
from potto.core.terms import App, Const, Delta, Integral, Prim, Term, postorder
from potto.primitives import PRIMITIVES


def is_finite(term: Integral) -> bool:
    """Nothing in it has poles, and along a variable whose range is infinite it is some exponential times what does not
    grow like one: the density of a measure."""
    names = set(term.variables)
    endless = {name for name, ends in zip(term.variables, term.bounds, strict=True) if any(map(_holds_infinity, ends))}
    rest: list[Term] = []
    decaying = set[str]()
    for factor in factors(term.body):
        if isinstance(factor, Prim) and factor.op == "exp" and factor.free & endless:
            decaying |= factor.free
        else:
            rest.append(factor)
    ends = [end for pair in term.bounds for end in pair]
    return endless <= decaying and not any(
        _has_poles(node, names) or _grows(node, endless) for node in postorder(*rest, *ends)
    )


def _holds_infinity(bound: Term) -> bool:
    return any(isinstance(node, Const) and math.isinf(node.value) for node in postorder(bound))


def _has_poles(node: Term, names: Set[str]) -> bool:
    """Whether a term may be infinite at some values of variables where its parts are not."""
    if isinstance(node, Prim):
        entry = PRIMITIVES[node.op]
        return entry.broken and any(edge.free & names for edge in entry.edges(*node.args))
    return isinstance(node, App | Integral | Delta)


def _grows(node: Term, names: Set[str]) -> bool:
    """Whether a term may grow like an exponential of some variables."""
    return isinstance(node, Prim) and any(part.free & names for part in PRIMITIVES[node.op].exponents(*node.args))
