"""Polynomials over terms as atoms, with exact coefficients: what both normal forms compute with.

Owns `Polynomial`, sums, the bound on sizes, and how coefficients and monomials are written as terms. `normal_form` puts
terms in order and must keep their values everywhere; `calculus.algebra.rational_form`
recognizes zero and may use identities between atoms, so that their products differ.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

from potto.core.terms import Prim, Term, add, const, div, mul, neg, pow_

Monomial = tuple[tuple[Term, int], ...]
"""Atoms with their exponents, in an order that their owner keeps."""
Exact = int | Fraction
"""A number without error; a whole one is an int, with which Python computes five times as fast."""
Polynomial = Mapping[Monomial, Exact]

ONE: Polynomial = {(): 1}
_BITS = 4096  # of a coefficient
_WHOLE = 2.0**53


class TooLarge(Exception):
    """Internal: the normal form is given up."""


def exact(value: float) -> Exact:
    """A double as what it is exactly."""
    return int(value) if value.is_integer() else Fraction(value)


def size_of(value: Exact) -> Exact:
    return value if value >= 0 else -value


def over(a: Exact, b: Exact) -> Exact:
    """a / b."""
    quotient = Fraction(a, b)
    return quotient.numerator if quotient.denominator == 1 else quotient


def total(parts: tuple[Polynomial, ...], largest: int) -> Polynomial:
    """The sum. Raises TooLarge beyond `largest` monomials."""
    result: dict[Monomial, Exact] = {}
    for part in parts:
        for monomial, coefficient in part.items():
            result[monomial] = result.get(monomial, 0) + coefficient
    return bounded({m: c for m, c in result.items() if c}, largest)


def bounded(result: Polynomial, largest: int) -> Polynomial:
    """The same. Raises TooLarge for more monomials than `largest`, or for coefficients of too many digits."""
    if len(result) > largest or any(
        c.numerator.bit_length() + c.denominator.bit_length() > _BITS for c in result.values()
    ):
        raise TooLarge
    return result


def number(value: Exact) -> Term | None:
    """A fraction as an exact term: a double, or a quotient of whole doubles."""
    try:
        nearest = float(value)
    except OverflowError:
        return None
    if Fraction(nearest) == value:
        return const(nearest)
    if abs(value.numerator) < _WHOLE and value.denominator < _WHOLE:
        return div(const(value.numerator), const(value.denominator))
    return None


def monomial_term(scale: Term, monomial: Monomial) -> Term:
    """scale * product of atom^exponent, what has negative exponents below the line."""
    above = [_power_term(atom, n) for atom, n in monomial if n > 0]
    below = [_power_term(atom, -n) for atom, n in monomial if n < 0]
    if isinstance(scale, Prim):  # a quotient of whole numbers
        above, below = [scale.args[0], *above], [scale.args[1], *below]
    else:
        above = [scale, *above]
    return div(mul(*above), mul(*below))


def as_term(polynomial: Polynomial, rounded: bool = False) -> Term | None:
    """A polynomial as a term, monomials in the order in which they stand; None if a coefficient cannot be written
    exactly, unless it may be `rounded`."""
    terms: list[Term] = []
    for monomial, coefficient in polynomial.items():
        scale = const(float(size_of(coefficient))) if rounded else number(size_of(coefficient))
        if scale is None:
            return None
        term = monomial_term(scale, monomial)
        terms.append(neg(term) if coefficient < 0 else term)
    return add(*terms)


def _power_term(atom: Term, n: int) -> Term:
    return atom if n == 1 else pow_(atom, const(n))


def divided(top: Polynomial, below: Polynomial, largest: int) -> Polynomial | None:
    """top / below where that is a polynomial again, by division of leading monomials, in at most `largest` steps."""
    if len(below) < 2 or len(top) < len(below) or len(top) * len(below) > largest:
        return None
    rank = {a: i for i, a in enumerate(sorted({a for m in (*top, *below) for a, _ in m}, key=lambda a: a.digest))}

    def order(monomial: Monomial) -> list[tuple[int, int]]:
        counts = dict(monomial)
        return [(rank[a], counts.get(a, 0)) for a in sorted(rank, key=rank.__getitem__)]

    lead = max(below, key=order)
    rest, result = dict(top), dict[Monomial, Exact]()
    for _ in range(largest):
        if not rest:
            return result
        head = max(rest, key=order)
        counts = dict(head)
        if any(counts.get(a, 0) < n for a, n in lead):
            return None
        step = without(head, dict(lead))
        factor = over(rest[head], below[lead])
        result[step] = factor
        for monomial, coefficient in below.items():
            counts = dict(step)
            for a, n in monomial:
                counts[a] = counts.get(a, 0) + n
            key = sorted_monomial(counts)
            left = rest.get(key, 0) - factor * coefficient
            if left:
                rest[key] = left
            else:
                rest.pop(key, None)
    return None


def shared_by(monomials: list[Monomial]) -> dict[Term, int]:
    """The powers of atoms that are factors of all of them."""
    common = dict(monomials[0])
    for monomial in monomials[1:]:
        other = dict(monomial)
        common = {a: min(n, other[a]) for a, n in common.items() if a in other}
        if not common:
            break
    return common


def without(monomial: Monomial, shared: Mapping[Term, int]) -> Monomial:
    """A monomial divided by these powers."""
    counts = dict(monomial)
    for a, n in shared.items():
        counts[a] = counts.get(a, 0) - n
    return sorted_monomial({a: n for a, n in counts.items() if n})


def sorted_monomial(counts: Mapping[Term, int]) -> Monomial:
    """Powers of atoms in the order of their digests."""
    return tuple(sorted(counts.items(), key=lambda pair: pair[0].digest))
