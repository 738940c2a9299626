"""What lies between two bounds, whichever of them is the greater one.

Owns `either_way`. Where lo < at < hi counts as it is if lo <= hi and turned if not, the order of the bounds need not be
asked for: `[lo < at < hi] - [hi < at < lo]`, of which at least one is 0.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from itertools import combinations

from potto.calculus.algebra.rational_form import normal
from potto.calculus.explanation.brackets import Inequality
from potto.calculus.explanation.factors import factored
from potto.core.polynomials import Polynomial
from potto.core.terms import ZERO, Branch, Term, add, neg


def either_way(node: Branch) -> Term | None:
    """The sum of both sides of a choice, where the conditions of either hold on its own side only; else None."""
    if len(node.coordinates) > 1 or ZERO in (node.then, node.orelse):
        return None
    then, orelse = factored(node.then).conditions, factored(node.orelse).conditions
    if len(then) < 2 or len(orelse) < 2:  # as most choices have it
        return None
    here, there = _polynomial(node.surface), _polynomial(neg(node.surface))
    if here is None or there is None or not (_follows(here, then) and _follows(there, orelse)):
        return None
    return add(node.then, node.orelse)


def _polynomial(surface: Term) -> Polynomial | None:
    found = normal(surface)
    return found.top if found is not None and found.whole else None


def _follows(wanted: Polynomial, known: Iterable[Inequality]) -> bool:
    """Whether two of the strict conditions, added up as multiples, say that a polynomial is above 0."""
    forms = [form for item in known if item.strict and (form := _polynomial(item.surface)) is not None]
    return any(_adds_up(wanted, first, second) for first, second in combinations(forms, 2))


def _adds_up(wanted: Polynomial, first: Polynomial, second: Polynomial) -> bool:
    """Whether wanted = a*first + b*second for some a, b > 0."""
    lost = [m for m in first if m in second and m not in wanted]
    weight = -Fraction(first[lost[0]]) / Fraction(second[lost[0]]) if lost else Fraction(1)
    if weight <= 0:
        return False
    total = {m: Fraction(first.get(m, 0)) + weight * Fraction(second.get(m, 0)) for m in {*first, *second}}
    total = {m: c for m, c in total.items() if c}
    ratios = {Fraction(c) / total[m] for m, c in wanted.items() if m in total}
    return total.keys() == wanted.keys() and len(ratios) == 1 and min(ratios) > 0
