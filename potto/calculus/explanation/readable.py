"""The shortest way to write a derivative that is found: like terms collected, fractions joined, brackets made plain.

Owns `readable` and `formula`, the one home of what a shown formula is simplified by; `core.simplify` keeps values
everywhere and rewrites little. Here values are the same wherever both forms are defined, up to rounding. A sum is
written around its tangents, in which it is linear, and a product in the order of a textbook: numbers, factors,
tangents, brackets, deltas.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from math import inf, isfinite

from potto.calculus.algebra.ranges import Box, range_of
from potto.calculus.algebra.rational_form import Rational, normal
from potto.calculus.explanation.alike import alike, content
from potto.calculus.explanation.alternatives import in_one, sums_of_choices
from potto.calculus.explanation.angles import at_angle, length
from potto.calculus.explanation.bounds import between, with_squares
from potto.calculus.explanation.bounds import bracket as bracket_of
from potto.calculus.explanation.brackets import Inequality, conditions, fewer
from potto.calculus.explanation.common_factors import collected, taken_out
from potto.calculus.explanation.decided import decided, side_taken
from potto.calculus.explanation.decimals import over_whole_numbers, root_of_number
from potto.calculus.explanation.factors import Factors, factored
from potto.calculus.explanation.in_front import hides_index, in_front
from potto.calculus.explanation.named_sums import put_back, with_sums_named
from potto.calculus.explanation.oriented import either_way
from potto.calculus.explanation.products import added, in_order, is_negative, led_by, with_one_root, written
from potto.calculus.explanation.readable_parts import Part, ReadableParts
from potto.calculus.explanation.signs import of_two, sign_of_product, size_of_product, sums_of_sides, sums_of_signs
from potto.calculus.explanation.squares import root_of_square, squares_in
from potto.core.numerals import Numbers
from potto.core.polynomials import Monomial, Polynomial, shared_by, without
from potto.core.printer import LEFT_OUT, format_term
from potto.core.simplify import simplify
from potto.core.terms import (
    ONE,
    PI,
    ZERO,
    Array,
    Branch,
    Const,
    Delta,
    Fold,
    If,
    Integral,
    Prim,
    Sum,
    Term,
    Tuple,
    add,
    branch,
    children,
    const,
    delta,
    div,
    if_,
    integral,
    mul,
    neg,
    postorder,
    pow_,
    prim,
    sub,
    substitute,
    transform,
)

_ARITHMETIC = ("add", "neg", "mul", "div", "pow", "sqrt", "exp")
_LONG = 100_000  # characters of a formula of which nobody will read what can be made, beyond which nothing is tried
_MANY = 60  # nodes of what is expanded
_SUMMANDS = 24
_SIGNS_OF_A_SUM = 12  # characters that say no more than over what is summed
_TANGENT = 4  # how much longer a formula seems for each tangent that it names


def readable(
    term: Term, tangents: frozenset[str], box: Box | None = None, progress: ReadableParts | None = None
) -> Term:
    """The same value, written to be read; `tangents`: the names by which it is linear, `box`: the ranges of its
    variables."""
    if LEFT_OUT in format_term(term, _LONG):
        return term
    integers = frozenset(node.variable for node in postorder(term) if isinstance(node, Sum | Array | Fold))
    work = _Work(tangents, _bound(term) | frozenset(box or ()), integers, progress or ReadableParts())
    found = decided(transform(term, lambda _, new: work.node(new)), box or {}, work.node)
    return transform(found, lambda _, new: led_by(in_order(with_one_root(new), tangents), work.inside | integers))


def formula(term: Term) -> str:
    """What stands in no program, as people write it: the density of a measure, the slope of a builtin."""
    plain = over_whole_numbers(readable(simplify(term), frozenset()))
    return format_term(plain, numbers=Numbers.FRACTIONS)


def _bound(term: Term) -> frozenset[str]:
    """The variables of the integrals in a term."""
    return frozenset(name for node in postorder(term) if isinstance(node, Integral) for name in node.variables)


class _Work:
    def __init__(
        self, tangents: frozenset[str], inside: frozenset[str], integers: frozenset[str], progress: ReadableParts
    ) -> None:
        self.progress = progress
        self.tangents = tangents
        self.integers = integers
        self.inside = inside  # variables of integration, on which no `sign` may depend

    def node(self, node: Term) -> Term:
        if isinstance(node, Prim) and node.op == "sqrt":
            node = root_of_number(node)
        match node:
            case Prim(op="hypot"):
                return length(node)
            case Prim(op=op) if op in _ARITHMETIC:
                key = self._key(node)
                if key not in self.progress.known:
                    self.progress.pause()
                    self.progress.known[key] = self._shortest(node)
                return self.progress.known[key]
            case Delta(coordinates=(surface,)):
                return delta((with_squares(surface),))
            case Branch():
                if (whole := self._by_choice(node)) is not None:
                    return whole
                known = conditions(node)
                if known is not None:
                    return bracket_of(fewer(known))
                if len(node.coordinates) > 1:
                    return in_one(node, self.tangents, self.inside, self._cost)
                if ZERO in (node.then, node.orelse) and not isinstance(node.then, Tuple):
                    return self._by_bracket(node)
                return self._choice(node)
            case Prim(op="sign"):
                return sign_of_product(node)
            case Prim(op="abs"):
                return size_of_product(at_angle(node, self.integers))
            case Prim(op="min" | "max"):
                return of_two(node, self.node)
            case Prim():
                return at_angle(node, self.integers)
            case Sum(lo=Const(value=lo), hi=Const(value=hi)) if hi <= lo:
                return substitute(node.body, {node.variable: node.lo}) if lo == hi else ZERO
            case Sum():
                return self._of_few(node) or in_front(node, self._factored(node.body), self.tangents)
            case If():
                return in_one(node, self.tangents, self.inside, self._cost)
            case Integral():
                few = self._over_few(node)
                return in_front(few, self._factored(few.body), self.tangents) if isinstance(few, Integral) else few
            case _:
                return node

    def _choice(self, node: Branch) -> Term:
        """Between two formulas, in the shortest way."""
        (item,) = between([Inequality(node.surface, node.strict)])
        whole = branch((item.surface,), item.strict, node.then, node.orelse)
        whole = in_one(whole, self.tangents, self.inside, self._cost) if isinstance(whole, Branch) else whole
        both = either_way(node)
        return whole if both is None else min(whole, self.node(both), key=self._cost)

    def _by_bracket(self, node: Branch) -> Term:
        """What is 0 on one side as a product."""
        sides, other = ((ONE, ZERO), node.then) if node.orelse is ZERO else ((ZERO, ONE), node.orelse)
        return self.node(mul(other, branch(node.coordinates, node.strict, *sides)))

    def _by_choice(self, node: Branch) -> Term | None:
        """A branch whose surface is a choice, as a choice between its sides, where one of these has a known sign."""
        turned = isinstance(node.surface, Prim) and node.surface.op == "neg"
        choice = children(node.surface)[0] if turned else node.surface
        if len(node.coordinates) > 1 or not isinstance(choice, If | Branch):
            return None
        surfaces = [neg(side) if turned else side for side in (choice.then, choice.orelse)]
        sides = [side_taken(node, range_of(surface)) for surface in surfaces]
        if sides == [None, None]:
            return None
        then, orelse = (
            self.node(branch((surface,), node.strict, node.then, node.orelse)) if side is None else side
            for surface, side in zip(surfaces, sides, strict=True)
        )
        if isinstance(choice, If):
            return if_(choice.condition, then, orelse)
        return self.node(branch(choice.coordinates, choice.strict, then, orelse))

    def _of_few(self, node: Sum) -> Term | None:
        """A sum of two, one by one, if that is as short: x and 1 - x for the values at 0 and 1."""
        match node:
            case Sum(lo=Const(value=lo), hi=Const(value=hi)) if hi == lo + 1 and not hides_index(node):
                if any(isinstance(part, Integral) for part in postorder(node.body)):
                    return None
                both = add(*(substitute(node.body, {node.variable: end}) for end in (node.lo, node.hi)))
                whole = transform(both, lambda _, new: self.node(new))
                return whole if self._cost(whole) < self._cost(node) + _SIGNS_OF_A_SUM else None
            case _:
                return None

    def _over_few(self, node: Integral) -> Term:
        """An integral over the variables that something in it depends on, times the lengths of the others."""
        if node.body is ZERO:
            return ZERO
        named = node.body.free.union(*(bound.free for pair in node.bounds for bound in pair))
        rows = list(zip(node.variables, node.bounds, node.hints, strict=True))
        idle = [row for row in rows if row[0] not in named and not any(map(_is_endless, row[1]))]
        if not idle:
            return node
        body = self.node(mul(*(sub(hi, lo) for _, (lo, hi), _ in idle), node.body))
        left = [row for row in rows if row not in idle]
        if not left:
            return body
        variables, bounds, hints = zip(*left, strict=True)
        return self.node(integral(variables, bounds, body, hints))

    def _shortest(self, node: Prim) -> Term:
        """The shortest of: the product of its factors, and the node expanded, with the sums in it or around them."""
        match node.op:
            case "add":
                forms = [node, *sums_of_sides(node, self.tangents, self._factored), *self._choices(node)]
                forms += sums_of_signs(node, self.tangents, self.inside, self.node)
                forms += collected(node, self._factored, self.node, self.tangents)
            case "sqrt":
                forms = [written(factored(node), self.tangents), *self._of_squares(node)]
            case _:
                forms = [self._with_sums_as_products(node), written(factored(node), self.tangents)]
        if _is_small(node):
            whole, sums = with_sums_named(node, self.tangents)
            for form, named in ((node, []), (whole, sums)) if sums else ((node, sums),):
                found = normal(form)
                if found is not None and len(found.top) <= _SUMMANDS:
                    expanded = [put_back(each, named, self.tangents, self._sum) for each in self._expanded(found)]
                    below = self._roots_below(node)
                    forms += [each for each in expanded if self._roots_below(each) <= below]
        forms = list(dict.fromkeys(forms))
        return forms[0] if len(forms) == 1 else min(forms, key=self._cost)

    def _roots_below(self, node: Term) -> frozenset[Term]:
        """What all of a term divides by the roots of: of a + b/sqrt(t) nothing, so that where b is said to be 0 the a
        is asked for at a negative t as well."""
        if isinstance(node, Prim) and node.op == "add":
            return frozenset.intersection(*map(self._roots_below, node.args))
        powers = self._factored(node).powers.items()
        return frozenset(base for base, n in powers if n < 0 and n.denominator > 1 and not range_of(base).positive)

    def _with_sums_as_products(self, node: Term) -> Term:
        """A product, sums in it as products where their summands share a factor."""
        whole = factored(node)
        found = Factors(whole.coefficient, {}, list(whole.exponents), list(whole.conditions))
        for base, exponent in whole.powers.items():
            inner = self._product_of(base) if exponent.denominator == 1 else None
            if inner is None or (exponent < 0 and inner.conditions):
                found.times(base, exponent)
                continue
            found.times_all(inner, int(exponent))
        return written(found, self.tangents)

    def _product_of(self, base: Term) -> Factors | None:
        """A sum as a product, if its summands share a factor."""
        if not isinstance(base, Prim) or base.op != "add":
            return None
        key, known = self._key(base), self.progress.products
        if key not in known:
            known[key] = taken_out(base.args, self._factored, self.node, self.tangents)
        return known[key]

    def _key(self, node: Term) -> Part:
        """All that the way to write a part depends on: what is bound in it is among the variables of any formula."""
        return node, self.tangents, self.inside & node.free, self.integers & node.free

    def _choices(self, node: Prim) -> Iterator[Term]:
        """Sums by the sides of a choice in them, which leave a product where one side comes to 0."""
        for choice, *sides, others in sums_of_choices(node, self.tangents):
            then, orelse = map(self.node, sides)
            if isinstance(choice, If):
                whole = if_(choice.condition, then, orelse)
            elif orelse is ZERO:
                whole = self.node(mul(then, branch(choice.coordinates, choice.strict, ONE, ZERO)))
            elif then is ZERO and len(choice.coordinates) == 1:
                other = self.node(neg(choice.surface))
                whole = self.node(mul(orelse, branch((other,), not choice.strict, ONE, ZERO)))
            else:
                whole = self.node(branch(choice.coordinates, choice.strict, then, orelse))
            yield add(whole, others)

    def _of_squares(self, node: Prim) -> list[Term]:
        """sqrt(r^2 - (x - a)^2) for sqrt((r - a + x)*(r + a - x))."""
        match node.args:
            case (Prim(op="mul", args=(Prim(op="add") as u, Prim(op="add") as v)),):
                halves = [normal(div(form, const(2.0))) for form in (add(u, v), add(u, neg(v)))]
                if any(h is None or not h.top or len(h.top) + 2 > len(u.args) + len(v.args) for h in halves):
                    return []
                sides = [self._shortest_sum(h) for h in halves if h is not None]
                return [prim("sqrt", add(pow_(sides[0], const(2.0)), neg(pow_(sides[1], const(2.0)))))]
            case _:
                return []

    def _shortest_sum(self, form: Rational) -> Term:
        """Up to its sign, what varies inside of an integral first."""
        whole = self._expanded(form)[1]
        parts = whole.args if isinstance(whole, Prim) and whole.op == "add" else (whole,)
        led = [p for p in parts if not p.free.isdisjoint(self.inside)] or list(parts)
        return added([neg(p) for p in parts]) if all(map(is_negative, led)) else whole

    def _cost(self, form: Term) -> float:
        text = format_term(form)
        return inf if LEFT_OUT in text else len(text) + _TANGENT * sum(text.count(name) for name in self.tangents)

    def _product(self, coefficient: Fraction, *monomials: tuple[Monomial, int]) -> Term:
        key, known = (coefficient, monomials, self.tangents), self.progress.written
        if key not in known:
            known[key] = self._written(coefficient, monomials)
        return known[key]

    def _written(self, coefficient: Fraction, monomials: tuple[tuple[Monomial, int], ...]) -> Term:
        found = Factors(coefficient, {}, [], [])
        for monomial, sign in monomials:
            for base, n in monomial:
                found.times_all(self._factored(base), n * sign)
        return written(found, self.tangents)

    def _factored(self, base: Term) -> Factors:
        """Its factors, not to be changed: an atom stands in many summands."""
        known = self.progress.factors
        if base not in known:
            known[base] = factored(base)
        return known[base]

    def _expanded(self, found: Rational) -> list[Term]:
        """Written out, around what all summands share and around each tangent."""
        if not found.top:
            return [ZERO]
        shared = shared_by(list(found.top))
        if len(found.top) == 1:
            ((monomial, coefficient),) = found.top.items()
            under = ((self._sum(found.below), 1),) if found.below != {(): 1} else ()
            return [self._product(Fraction(coefficient), (monomial, 1), (under, -1))]
        rest = {without(m, shared): c for m, c in found.top.items()}
        scale = content(rest)
        rest = {m: Fraction(c / scale) for m, c in rest.items()}
        under = ((self._sum(found.below), 1),) if found.below != {(): 1} else ()
        is_angle = PI in shared  # (2*pi*k + pi/6)^2 is read as it is
        inner = self._around_tangents(rest, self._plain_sum if is_angle else self._sum)
        common = tuple(shared.items())
        whole = self._product(scale, (common, 1), *([(((inner, 1),), 1)]), (under, -1))
        apart = [self._product(c * scale, (m, 1), (common, 1), (under, -1)) for m, c in rest.items()]
        if not (common or under) and scale != 1 and squares_in(rest)[0]:
            apart = [self._sum({m: c * scale for m, c in rest.items()})]
        root = None if is_angle else root_of_square(rest)
        if root is not None:
            return [self._product(scale, (common, 1), (((self._sum(root), 2),), 1), (under, -1)), whole, added(apart)]
        return [whole, added(apart)]

    def _around_tangents(self, form: Polynomial, summed: Callable[[Polynomial], Term]) -> Term:
        """A polynomial as a sum over its tangents, each with all that it is multiplied by, or several of them that are
        multiplied by the same."""
        parts: list[Term] = []
        for group in alike(form, self.tangents):
            scale = content(group.moves)
            along = self._plain_sum({m: c / scale for m, c in group.moves.items()})
            factors = (group.shared, 1), (((summed(group.rest), 1),), 1), (((along, 1),), 1)
            parts.append(self._product(scale, *factors))
        return added(parts)

    def _sum(self, form: Polynomial) -> Term:
        squares, rest = squares_in(form)
        parts = [self._product(scale, (((self._plain_sum(root), 2),), 1)) for scale, root in squares]
        return added([*parts, self._plain_sum(rest)] if squares else [self._plain_sum(rest)])

    def _plain_sum(self, form: Polynomial) -> Term:
        return added([self._product(Fraction(c), (m, 1)) for m, c in form.items()])


def _is_small(term: Term) -> bool:
    """Whether a term has few parts, without counting more of them."""
    seen, waiting = set[Term](), [term]
    while waiting and len(seen) <= _MANY:
        node = waiting.pop()
        if node not in seen:
            seen.add(node)
            waiting += children(node)
    return len(seen) <= _MANY


def _is_endless(bound: Term) -> bool:
    return isinstance(bound, Const) and not isfinite(bound.value)
