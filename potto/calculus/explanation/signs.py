"""Signs in a formula: of products, and those that a sum of two brackets is; sizes, and which of two is the larger.

Owns `sign_of_product`, `sums_of_signs`, `sums_of_sides`, `size_of_product` and `of_two`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction

from potto.calculus.algebra.ranges import range_of
from potto.calculus.explanation.brackets import Inequality, complementary, constant, opposite, turned_round
from potto.calculus.explanation.factors import Factors, factored, is_parity
from potto.calculus.explanation.products import added, is_negative, written
from potto.core.terms import Prim, Term, add, mul, neg, prim, sub


def sign_of_product(node: Prim) -> Term:
    """The sign of a product by those of its factors whose signs are not known."""
    found = factored(node.args[0])
    if found.conditions or not found.coefficient:
        return node
    turned, left = found.coefficient < 0, list[Term]()
    for base, n in found.powers.items():
        if n.denominator != 1 or n % 2 == 0:  # a root, or an even power, has a value where it is above 0
            continue
        bounds = range_of(base)
        if bounds.lo >= 0 or bounds.hi <= 0:
            turned ^= bounds.lo < 0
        elif is_parity(base):
            left.append(base)
        else:
            left.append(prim("sign", base))
    whole = mul(*left)
    return neg(whole) if turned else whole


def size_of_product(node: Term) -> Term:
    """abs of a product: what is known to be above 0 stands before it, 3*abs(c)/4 for abs(3*c/4)."""
    if not isinstance(node, Prim) or node.op != "abs":
        return node
    found = factored(node.args[0])
    if found.conditions or found.exponents or not found.coefficient:
        return node
    outside = {base: n for base, n in found.powers.items() if n % 2 == 0 or range_of(base).lo >= 0}
    inside = {base: n for base, n in found.powers.items() if base not in outside}
    if abs(found.coefficient) == 1 and not outside:
        return node
    size = prim("abs", written(Factors(Fraction(1), inside, [], []), frozenset()))
    whole = Factors(abs(found.coefficient), {**outside, **({size: 1} if inside else {})}, [], [])
    return written(whole, frozenset())


def of_two(node: Prim, simpler: Callable[[Term], Term]) -> Term:
    """The larger or the smaller of two terms, where one of them always is; of c and -c the size."""
    if len(node.args) != 2:
        return node
    first, second = node.args
    more = range_of(simpler(sub(first, second)))
    if more.lo >= 0 or more.hi <= 0:
        return first if (more.lo >= 0) == (node.op == "max") else second
    if constant(add(first, second)) == 0:
        size = size_of_product(prim("abs", second if is_negative(first) else first))
        return size if node.op == "max" else neg(size)
    return node


def sums_of_signs(
    node: Prim, tangents: frozenset[str], inside: frozenset[str], simpler: Callable[[Term], Term]
) -> Iterator[Term]:
    """[u > 0] - [u < 0] as the sign of u; inside: variables on which no sign may depend."""
    parts = [factored(arg) for arg in node.args]
    for i, first in enumerate(parts):
        for j in range(i + 1, len(parts)):
            found = _sign(first, parts[j], tangents, inside, simpler)
            if found is not None:
                yield added([found, *(a for k, a in enumerate(node.args) if k not in (i, j))])
                return


def sums_of_sides(node: Prim, tangents: frozenset[str], factors: Callable[[Term], Factors]) -> Iterator[Term]:
    """[u > 0] + [u <= 0] as 1, and 1 - [u > 0] as [u <= 0]."""
    parts, joined = list(map(factors, node.args)), False
    left: list[Factors] = []
    while parts and any(part.conditions for part in parts):
        first = parts.pop()
        for i, second in enumerate(parts):
            both = _one_side(first, second) or _one_side(second, first)
            if both is not None:
                parts[i], joined = both, True
                break
        else:
            left.append(first)
    if joined:
        yield added([written(part, tangents) for part in (*parts, *reversed(left))])


def _one_side(whole: Factors, part: Factors) -> Factors | None:
    """What remains of a product where the same with a further condition is taken off it, or added with the opposite."""
    if whole.powers != part.powers or whole.exponents != part.exponents:
        return None
    more = [c for c in part.conditions if c not in whole.conditions]
    lacks = [c for c in whole.conditions if c not in part.conditions]
    kept = [c for c in whole.conditions if c not in lacks]
    if len(more) != 1 or len(lacks) > 1:
        return None
    if lacks and (whole.coefficient != part.coefficient or not complementary(lacks[0], more[0])):
        return None
    if not lacks and whole.coefficient != -part.coefficient:
        return None
    side = [] if lacks else [Inequality(turned_round(more[0].surface), not more[0].strict)]
    return Factors(whole.coefficient, dict(whole.powers), list(whole.exponents), [*kept, *side])


def _sign(
    first: Factors, second: Factors, tangents: frozenset[str], inside: frozenset[str], simpler: Callable[[Term], Term]
) -> Term | None:
    same = first.powers == second.powers and first.exponents == second.exponents
    if not same or first.coefficient != -second.coefficient:
        return None
    one = [c for c in first.conditions if c not in second.conditions]
    other = [c for c in second.conditions if c not in first.conditions]
    if len(one) != 1 or len(other) != 1 or not opposite(one[0], other[0]):
        return None
    if not one[0].surface.free.isdisjoint(inside):
        return None
    kept = [c for c in first.conditions if c is not one[0]]
    found = Factors(first.coefficient, dict(first.powers), list(first.exponents), kept)
    positive, turned = (one[0].surface, 1) if not is_negative(one[0].surface) else (other[0].surface, -1)
    found.coefficient *= turned
    found.times_all(factored(sign_of_product(prim("sign", simpler(positive)))))
    return written(factored(written(found, tangents)), tangents)
