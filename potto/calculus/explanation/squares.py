"""Squares of sums that have been multiplied out.

Owns `root_of_square` and `squares_in`.
"""

from __future__ import annotations

from collections import Counter
from fractions import Fraction
from itertools import combinations
from math import gcd, isqrt, lcm

from potto.core.polynomials import Exact, Monomial, Polynomial
from potto.core.printer import format_term
from potto.core.terms import PI


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


def squares_in(form: Polynomial) -> tuple[list[tuple[Fraction, Polynomial]], Polynomial]:
    """Multiples of squares of two summands, each with the sum that is squared, and what is left: of
    r^2 + 2*a*x - a^2 - x^2 the square of a - x, -1 times, and r^2."""
    found: list[tuple[Fraction, Polynomial]] = []
    rest = dict(form)
    squares = [m for m in rest if all(n % 2 == 0 and n > 0 for _, n in m) and (PI, 2) not in m]  # 2*pi*k is an angle
    if len(squares) < 2 or len(rest) < 3:
        return found, rest
    squares.sort(key=lambda monomial: (not monomial, [format_term(atom) for atom, _ in monomial]))
    for one, other in combinations(squares, 2):
        if one not in rest or other not in rest or (rest[one] > 0) != (rest[other] > 0):
            continue
        counts = Counter(dict(one)) + Counter(dict(other))
        halved = {atom: n // 2 for atom, n in counts.items()}
        mixed = next((m for m in rest if m not in (one, other) and dict(m) == halved), None)
        if mixed is None:
            continue
        three = {m: Fraction(rest[m]) for m in (one, other, mixed)}
        scale = Fraction(gcd(*(c.numerator for c in three.values())), lcm(*(c.denominator for c in three.values())))
        if scale.denominator > 1:  # (x - 1/2)^2 before (2*x - 1)^2/4
            scale = abs(three[one if one else other])
        scale = scale if rest[one] > 0 else -scale
        root = root_of_square({m: c / scale for m, c in three.items()})
        if root is not None:
            found.append((scale, root))
            rest = {m: c for m, c in rest.items() if m not in three}
    return found, rest


def _root(monomial: Monomial, c: Exact) -> tuple[Monomial, Fraction] | None:
    """The root of a monomial, with that of its coefficient."""
    if c <= 0 or any(n <= 0 or n % 2 for _, n in monomial):
        return None
    root = Fraction(isqrt(c.numerator), isqrt(c.denominator))
    return (tuple([(atom, n // 2) for atom, n in monomial]), root) if root * root == c else None
