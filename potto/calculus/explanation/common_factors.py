"""Sums with what their summands share in front: v*(e + 1) for v + e*v.

Owns `taken_out` and `collected`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from fractions import Fraction
from functools import reduce

from potto.calculus.explanation.factors import Factors
from potto.calculus.explanation.products import added, is_tangent, written
from potto.core.terms import Const, Prim, Term, add, neg

Factored = Callable[[Term], Factors]
Simpler = Callable[[Term], Term]


def taken_out(
    summands: Sequence[Term], factored: Factored, simpler: Simpler, tangents: frozenset[str]
) -> Factors | None:
    """A sum as a product; None where its summands share nothing but numbers."""
    parts = _turned_alike(list(map(factored, summands)))
    shared = reduce(Factors.shared_with, parts)
    if any(_is_below_differently(base, parts) for part in parts for base in part.powers):
        return None  # one fraction is plainer
    for base, n in list(shared.powers.items()):
        if isinstance(base, Const) and n > 0:  # 2*pi*k + pi/6 is no product
            shared.times(base, -n)
    alike = {abs(part.coefficient) for part in parts}
    shared.coefficient = alike.pop() if len(alike) == 1 else shared.coefficient
    if not (shared.powers or shared.exponents or shared.conditions or shared.coefficient != 1):
        return None
    rest = factored(simpler(add(*(written(part.without(shared), tangents) for part in parts))))
    shared.times_all(rest)
    return shared


def _turned_alike(parts: list[Factors]) -> list[Factors]:
    """The same products, of two sums that differ by their sign the first one in all of them."""
    known: dict[frozenset[Term], Term] = {}
    found: list[Factors] = []
    for part in parts:
        turned = part
        for base, n in part.powers.items():
            if not isinstance(base, Prim) or base.op != "add" or n.denominator != 1:
                continue
            known.setdefault(frozenset(base.args), base)
            other = known.get(frozenset(map(neg, base.args)))
            if other is not None and other is not base:
                turned = Factors(
                    turned.coefficient * Fraction(-1) ** int(n), dict(turned.powers), part.exponents, part.conditions
                )
                turned.times(base, -n)
                turned.times(other, n)
        found.append(turned)
    return found


def _is_below_differently(base: Term, parts: Sequence[Factors]) -> bool:
    return len({n for part in parts if (n := part.powers.get(base, 0)) < 0}) > 1


def collected(node: Prim, factored: Factored, simpler: Simpler, tangents: frozenset[str]) -> Iterator[Term]:
    """A sum as a product, and as one of products: for each tangent, whatever it is divided by, and of what is alike."""
    whole = taken_out(node.args, factored, simpler, tangents)
    if whole is not None:
        yield written(whole, tangents)
    by_tangents: dict[object, list[Term]] = {}
    by_factors: dict[object, list[Term]] = {}
    for arg in node.args:
        powers = factored(arg).powers.items()
        by_tangents.setdefault(frozenset(b for b, _ in powers if is_tangent(b, tangents)), []).append(arg)
        by_factors.setdefault(frozenset(powers), []).append(arg)  # alike but for their brackets
    for groups in (by_tangents, by_factors):
        if 1 < len(groups) < len(node.args):
            yield _in_groups(groups.values(), factored, simpler, tangents)


def _in_groups(groups: Iterable[list[Term]], factored: Factored, simpler: Simpler, tangents: frozenset[str]) -> Term:
    found: list[Term] = []
    for group in groups:
        product = taken_out(group, factored, simpler, tangents) if len(group) > 1 else None
        found += group if product is None else [written(product, tangents)]
    return added(found)
