"""Iverson brackets as conditions, in as few and as plain comparisons as they can be told.

Owns `Inequality`, `conditions`, `turned_round`, `fewer`, `plainer`, `sign_where`, `opposite`, `complementary`,
`two_sides`, `constant` and `implies`; how they are written is in `bounds`. A root is compared by squares or by what it
is the root of, factors that do not change a sign are left out, and so is what another condition implies.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from functools import lru_cache
from itertools import combinations
from math import isqrt

from msgspec import Struct

from potto.calculus.algebra.ranges import Box, range_of
from potto.calculus.algebra.rational_form import as_term, equal, normal
from potto.calculus.explanation.inverse_angles import angle_bounds
from potto.calculus.explanation.squares import root_of_square
from potto.core.polynomials import Polynomial, number, shared_by, without
from potto.core.terms import (
    ONE,
    ZERO,
    Branch,
    Prim,
    Term,
    Var,
    add,
    const,
    div,
    mul,
    neg,
    prim,
    sub,
)

_ANYWHERE: Box = {}


class Inequality(Struct, frozen=True):
    """surface > 0, or >= 0."""

    surface: Term
    strict: bool


NEVER = Inequality(const(-1.0), True)


def conditions(term: Term) -> list[Inequality] | None:
    """The conditions under all of which a term is 1, if it is 0 elsewhere."""
    found: list[Inequality] = []
    while term is not ONE:
        if not isinstance(term, Branch) or (len(term.coordinates) > 1 and not term.strict):
            return None
        if term.orelse is ZERO:
            found.append(Inequality(term.surface, term.strict))
            term = term.then
        elif term.then is ZERO:
            found.append(Inequality(turned_round(term.surface), not term.strict))
            term = term.orelse
        else:
            return None
    return found


def turned_round(surface: Term) -> Term:
    """Its negative, summand by summand."""
    return add(*map(neg, surface.args)) if isinstance(surface, Prim) and surface.op == "add" else neg(surface)


def fewer(known: Iterable[Inequality], box: Box = _ANYWHERE) -> list[Inequality]:
    """The same conditions without what is said twice or follows from another one; of two that exclude each other none
    is left but that which never holds. box: the ranges of variables."""
    items = tuple(known)
    return list(_fewer_anywhere(items) if not box else _fewer(items, box)) if items else []


@lru_cache(maxsize=1 << 12)
def _fewer_anywhere(known: tuple[Inequality, ...]) -> list[Inequality]:
    return _fewer(known, _ANYWHERE)


def _fewer(known: Iterable[Inequality], box: Box) -> list[Inequality]:
    found: list[Inequality] = []
    for item in known:
        for plain in _plain(item, box):
            if any(_excludes(other, plain, box) for other in found):
                return [NEVER]
            if not any(implies(other, plain) for other in found):
                found = [other for other in found if not implies(plain, other)]
                found.append(plain)
    if len(found) < 2:
        return found
    whole = [_beside(item, found) for item in found]
    return _not_added_up(found) if whole == found else _fewer(whole, box)


def _beside(item: Inequality, known: Sequence[Inequality]) -> Inequality:
    """Without factors and divisors that other conditions say are above 0: a > 0.64 for 0.64/a < 1 where a > 0."""
    form = normal(item.surface)
    if form is None or len(form.below) != 1 or (form.whole and len(form.top) > 1):
        return item
    above = {other.surface for other in known if other.strict and other is not item}
    if not above:
        return item
    ((below, scale),) = form.below.items()
    if not all(n % 2 == 0 or atom in above for atom, n in below):
        return item
    shared = {atom: n for atom, n in shared_by(list(form.top)).items() if atom in above}
    if form.whole and not shared:
        return item
    top = as_term({without(m, shared): Fraction(c) / Fraction(scale) for m, c in form.top.items()})
    return item if top is None else Inequality(top, item.strict)


def _not_added_up(known: list[Inequality]) -> list[Inequality]:
    """Without those that say no more than two others do: 0 < v where 0 < t < v."""
    for item in known if len(known) > 2 else ():
        others = [other for other in known if other is not item and other.strict]
        for first, second in combinations(others, 2):
            if implies(Inequality(add(first.surface, second.surface), True), item):
                return _not_added_up([other for other in known if other is not item])
    return known


def plainer(surface: Term, box: Box) -> Term | None:
    """A surface of the same sign in the box, without factors whose sign is known there: s < 1 for s*x < x where x goes
    from 0 to 1. None if there are none. Where a variable of the box is 0 a surface may have been 0 as well; that is
    nothing to an integral over it."""
    found = normal(surface)
    if found is None or not found.top:
        return None
    turned, parts = False, list[Polynomial]()
    for form in (found.top, found.below):
        left: dict[Term, int] = {}
        for atom, n in shared_by(list(form)).items():
            bounds = range_of(atom, box)
            never_zero = not bounds.zero or (isinstance(atom, Var) and atom.name in box)
            if never_zero and (n % 2 == 0 or bounds.lo >= 0 or bounds.hi <= 0):
                left[atom] = n
                turned ^= bool(n % 2) and bounds.lo < 0
        parts.append({without(m, left): c for m, c in form.items()} if left else form)
    top, below = as_term({m: -c for m, c in parts[0].items()} if turned else parts[0]), as_term(parts[1])
    if top is None or below is None or (parts[0] is found.top and parts[1] is found.below):
        return None
    return top if below is ONE else div(top, below)


def sign_where(known: Sequence[Inequality], inner: Term) -> tuple[int, list[Inequality]] | None:
    """The sign of `inner` where the conditions hold, if they tell it, and the conditions without the places where it is
    0: sign(a)*[a >= 0] is [a > 0]."""
    for i, item in enumerate(known):
        for turned, signed in ((1, inner), (-1, neg(inner))):
            positive, strict = Inequality(signed, True), Inequality(item.surface, True)
            if implies(strict, positive):
                own = item if implies(item, positive) else strict
                return turned, [*known[:i], own, *known[i + 1 :]]
    return None


def constant(term: Term) -> Fraction | None:
    """The number that a term is, whatever its variables are."""
    found = normal(term)
    if found is None or not {*found.top, *found.below} <= {()}:
        return None
    return Fraction(found.top.get((), 0)) / Fraction(found.below[()])


def opposite(first: Inequality, second: Inequality) -> bool:
    """Whether one surface is above 0 where the other is below it."""
    return first.strict and second.strict and equal(first.surface, neg(second.surface))


def complementary(first: Inequality, second: Inequality) -> bool:
    """Whether one holds where the other does not."""
    return first.strict != second.strict and equal(first.surface, neg(second.surface))


def two_sides(term: Term) -> Term | None:
    """u, where a term is [u > 0] - [u < 0], but where u is 0."""
    match term:
        case Prim(op="add", args=(first, Prim(op="neg", args=(second,)))):
            pass
        case Prim(op="add", args=(Prim(op="neg", args=(second,)), first)):
            pass
        case _:
            return None
    match conditions(first), conditions(second):
        case [one], [other] if equal(one.surface, neg(other.surface)):
            return one.surface
        case _:
            return None


def _plain(item: Inequality, box: Box) -> list[Inequality]:
    """A condition as conditions without roots, and without factors whose sign is known; none if it always holds."""
    if range_of(item.surface, box).positive:
        return []
    found = normal(item.surface)
    if found is None:
        return [item]
    if found.whole and not set(found.top) - {()}:  # a number
        value = found.top.get((), Fraction(0))
        return [] if value > 0 or (value == 0 and not item.strict) else [NEVER]
    if not found.top:
        return [item]
    if found.whole:
        without_root = _squared(found.top, item.strict, box) or _odd_root(found.top, item.strict)
        if without_root is not None:
            return [each for one in without_root for each in _plain(one, box)]
    if found.whole and (around := angle_bounds(found.top, item.strict)) is not None:
        return [each for u, strict in around for each in _plain(Inequality(u, strict), box)]
    if found.whole and (bounds := _below_square(found.top, item.strict)) is not None:
        return bounds
    if len(found.top) == 1:
        return _without_even(item, found.top, found.below, box)
    if item.strict and set(found.below) == {()}:
        return _without_shared(item, found.top, box)
    return [item]


def _without_shared(item: Inequality, top: Polynomial, box: Box) -> list[Inequality]:
    """Without what all summands share where it is above 0 or a square, and nothing where the rest is a square too."""
    shared = shared_by(list(top))
    known = {a: n for a, n in shared.items() if n % 2 == 0 or range_of(a, box).lo >= 0}
    rest = {without(m, known): c for m, c in top.items()} if known else top
    if root_of_square(rest) is not None:
        return []
    left = as_term(rest) if known else None
    return [item] if left is None else [Inequality(left, True)]


def _squared(form: Polynomial, strict: bool, box: Box) -> list[Inequality] | None:
    """k*sqrt(u) + rest > 0 by squares, where the sign of the rest is known."""
    roots = [(m, c) for m, c in form.items() if any(isinstance(a, Prim) and a.op == "sqrt" for a, _ in m)]
    if len(roots) != 1:
        return None
    ((monomial, scale),) = roots
    if len(monomial) != 1 or monomial[0][1] != 1:
        return None
    root = monomial[0][0]
    assert isinstance(root, Prim)
    (inside,) = root.args
    size = scale if scale > 0 else -scale
    rest = as_term({m: Fraction(c / size) for m, c in form.items() if m != monomial})
    if rest is None:
        return None
    exists = Inequality(inside, False)
    if scale < 0 and strict and range_of(rest, box).hi <= 0:
        return [NEVER]
    if scale < 0:  # sqrt(u) < rest
        return (
            [exists, Inequality(multiplied_out(sub(mul(rest, rest), inside)), strict)]
            if range_of(rest, box).lo >= 0
            else None
        )
    if rest is ZERO:
        return [Inequality(inside, strict)]
    if range_of(rest, box).lo >= 0:
        return [exists]
    return [Inequality(multiplied_out(sub(inside, mul(rest, rest))), strict)] if range_of(rest, box).hi <= 0 else None


def _below_square(form: Polynomial, strict: bool) -> list[Inequality] | None:
    """u^2 < c^2 as -c < u < c, of a name u and a number c."""
    match [(monomial, scale) for monomial, scale in form.items() if monomial]:
        case [(((Var() as u, 2),), scale)] if len(form) == 2 and scale < 0:
            square = Fraction(form[()]) / -Fraction(scale)
        case _:
            return None
    if square <= 0:
        return None
    root = Fraction(isqrt(square.numerator), isqrt(square.denominator))
    bound = number(root) if root * root == square else None
    if bound is None and square.denominator == 1:
        bound = prim("sqrt", const(float(square)))
    return None if bound is None else [Inequality(add(u, bound), strict), Inequality(sub(bound, u), strict)]


def _odd_root(form: Polynomial, strict: bool) -> list[Inequality] | None:
    """k*sign(u)*abs(u)^(1/n) > a number, by u itself."""
    offset = form.get((), Fraction(0))
    match [(monomial, scale) for monomial, scale in form.items() if monomial]:
        case [(((a, 1), (b, 1)), scale)]:
            root, sign = (a, b) if isinstance(a, Prim) and a.op == "pow" else (b, a)
        case _:
            return None
    match root, sign:
        case Prim(op="pow", args=(Prim(op="abs", args=(u,)), power)), Prim(op="sign", args=(v,)) if u == v:
            part, value = constant(power), -Fraction(offset) / Fraction(scale)
        case _:
            return None
    bound = None if part is None or part.numerator != 1 else number(value * abs(value) ** (part.denominator - 1))
    if bound is None:
        return None
    return [Inequality(sub(u, bound) if scale > 0 else sub(bound, u), strict)]


def multiplied_out(term: Term) -> Term:
    """The same as a sum, if it is one of polynomials."""
    found = normal(term)
    written = as_term(found.top) if found is not None and found.whole else None
    return term if written is None else written


def _without_even(item: Inequality, top: Polynomial, below: Polynomial, box: Box) -> list[Inequality]:
    """Of a product only the factors that change its sign."""
    ((monomial, scale),) = top.items()
    if not monomial:  # a number over what may be 0, which is no place where it is 0 itself
        item = Inequality(item.surface, True)
    if not item.strict and not set(below) - {()} and len(monomial) == 1 and monomial[0][1] == 1:
        return [Inequality(monomial[0][0] if scale > 0 else neg(monomial[0][0]), False)]
    if len(below) != 1 or not item.strict:
        return [item]
    ((under, _),) = below.items()
    odd = [a for a, n in (*monomial, *under) if n % 2 and not range_of(a, box).positive]
    if not odd:
        return [] if scale > 0 else [NEVER]
    whole = mul(*odd)
    return [Inequality(whole if scale > 0 else neg(whole), item.strict)]


def _excludes(first: Inequality, second: Inequality, box: Box) -> bool:
    """Whether two conditions never hold together: their surfaces add up to what is nowhere above 0 in the box."""
    both = add(first.surface, second.surface)
    total = constant(both)
    most = total if total is not None else range_of(multiplied_out(both), box).hi if box else 1.0
    return most < 0 or (most == 0 and (first.strict or second.strict))


@lru_cache(maxsize=1 << 12)
def implies(first: Inequality, second: Inequality) -> bool:
    """Whether the second holds wherever the first does: its surface is the other's and what is never below 0."""
    more = range_of(multiplied_out(sub(second.surface, first.surface)))
    return more.lo > 0 or (more.lo == 0 and (first.strict or not second.strict))
