"""Squares of sums that have been multiplied out. Owns `root_of_square`."""

from __future__ import annotations

from collections import Counter
from fractions import Fraction
from math import isqrt

from potto.core.polynomials import Exact, Monomial, Polynomial


def root_of_square(form: Polynomial) -> Polynomial | None:
    """a - b for a^2 - 2*a*b + b^2, of monomials; None for what is no such square."""
    if len(form) != 3:
        return None
    squares = [(monomial, root) for monomial, c in form.items() if (root := _root(monomial, c)) is not None]
    if len(squares) != 2:
        return None
    ((first, (one, a)), (second, (other, b))) = squares
    ((mixed, c),) = [(m, c) for m, c in form.items() if m not in (first, second)]
    if Counter(dict(mixed)) != Counter(dict(one)) + Counter(dict(other)) or abs(c) != 2 * a * b:
        return None
    return {one: a, other: b if c > 0 else -b}


def _root(monomial: Monomial, c: Exact) -> tuple[Monomial, Fraction] | None:
    """The root of a monomial, with that of its coefficient."""
    if c <= 0 or any(n <= 0 or n % 2 for _, n in monomial):
        return None
    root = Fraction(isqrt(c.numerator), isqrt(c.denominator))
    return (tuple([(atom, n // 2) for atom, n in monomial]), root) if root * root == c else None
