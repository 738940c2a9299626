"""Whether the integral of a summand is known to have a value, also where those of the others should have none.

Owns `is_finite`. Where only the sum of two is integrable, as of cos(x)/x and -1/x, it may not be taken apart.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Set

from potto.calculus.algebra.ranges import range_of
from potto.calculus.decomposition.factors import factors
from potto.core.terms import App, Const, Delta, Integral, Prim, Term, postorder
from potto.primitives import PRIMITIVES

Box = Mapping[str, tuple[float, float]]


def is_finite(term: Integral) -> bool:
    """Nothing in it has poles where it is integrated, and along a variable whose range is infinite it is some
    exponential times what does not grow like one: the density of a measure."""
    box = _box(term)
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
        _has_poles(node, box) or _grows(node, endless) for node in postorder(*rest, *ends)
    )


def _box(term: Integral) -> Box:
    """Between which numbers the variables are, as far as their bounds show."""
    box: dict[str, tuple[float, float]] = {}
    for name, ends in zip(term.variables, term.bounds, strict=True):
        found = [range_of(end, box) for end in ends]
        box[name] = min(each.lo for each in found), max(each.hi for each in found)
    return box


def _holds_infinity(bound: Term) -> bool:
    return any(isinstance(node, Const) and math.isinf(node.value) for node in postorder(bound))


def _has_poles(node: Term, box: Box) -> bool:
    """Whether a term may be infinite at some values of variables where its parts are not."""
    if isinstance(node, Prim):
        entry = PRIMITIVES[node.op]
        edges = entry.edges(*node.args) if entry.broken else ()
        return any(edge.free & box.keys() and not _has_a_sign(edge, box) for edge in edges)
    return isinstance(node, App | Integral | Delta)


def _has_a_sign(term: Term, box: Box) -> bool:
    found = range_of(term, box)
    return found.lo > 0 or found.hi < 0


def _grows(node: Term, names: Set[str]) -> bool:
    """Whether a term may grow like an exponential of some variables."""
    return isinstance(node, Prim) and any(part.free & names for part in PRIMITIVES[node.op].exponents(*node.args))
