"""A polynomial as a sum over what moves in it: each tangent with all that it is multiplied by, tangents that are
multiplied by the same together.

Owns `CollectedTerms`, `alike` and `content`.
"""

from __future__ import annotations

from fractions import Fraction
from math import gcd, lcm

from msgspec import Struct

from potto.calculus.explanation.products import is_tangent
from potto.core.polynomials import Exact, Monomial, Polynomial, shared_by, without
from potto.core.printer import format_term


class CollectedTerms(Struct, frozen=True):
    """shared * rest * moves: of all that is multiplied by the same what moves, each with its coefficient."""

    shared: Monomial
    rest: dict[Monomial, Exact]
    moves: dict[Monomial, Exact]


def alike(form: Polynomial, tangents: frozenset[str]) -> list[CollectedTerms]:
    """The sum that a polynomial is, in the order of its monomials."""
    coefficients: dict[Monomial, dict[Monomial, Exact]] = {}
    for monomial, c in form.items():
        moving = tuple((a, n) for a, n in monomial if is_tangent(a, tangents))
        coefficients.setdefault(moving, {})[tuple(p for p in monomial if p not in moving)] = c
    if len(coefficients) == 1 and () in coefficients:
        return [CollectedTerms((), coefficients[()], {(): 1})]
    groups: dict[tuple[Monomial, frozenset[tuple[Monomial, Exact]]], CollectedTerms] = {}
    for moving, coefficient in coefficients.items():
        shared = shared_by(list(coefficient))
        rest = {without(m, shared): c for m, c in coefficient.items()}
        scale = content(rest)
        if scale != 1:
            rest = {m: c / scale for m, c in rest.items()}
        key = tuple(shared.items()), frozenset(rest.items())
        opposite = key[0], frozenset((m, -c) for m, c in rest.items())
        known, sign = (opposite, -1) if opposite in groups else (key, 1)
        groups.setdefault(known, CollectedTerms(key[0], rest, {})).moves[moving] = sign * scale
    return list(map(_turned, groups.values()))


def _turned(group: CollectedTerms) -> CollectedTerms:
    """With fewer signs, if both sums may be turned: (x - y)*(da - db) for (y - x)*(db - da)."""
    if len(group.moves) < 2:
        return group
    first = min(group.moves, key=lambda moving: [format_term(atom) for atom, _ in moving])
    balance = sum(1 if c < 0 else -1 for c in group.rest.values())
    if balance < 0 or (balance == 0 and group.moves[first] > 0):
        return group
    rest, moves = ({m: -c for m, c in form.items()} for form in (group.rest, group.moves))
    return CollectedTerms(group.shared, rest, moves)


def content(form: Polynomial) -> Fraction:
    """What the coefficients of a polynomial share, and the sign of all if they are one."""
    top = gcd(*(c.numerator for c in form.values()))
    below = lcm(*(c.denominator for c in form.values()))
    if below > 1000 or top > 1000:
        return Fraction(1)
    return Fraction(-top if all(c < 0 for c in form.values()) else top, below)
