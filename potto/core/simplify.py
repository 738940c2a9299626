"""Shorter terms with the same values.

Owns `simplify`, which keeps the values (up to rounding, and up to where an intermediate result is infinite or not
defined), and `normalized_surface`, by which surfaces are known. What is not shortened stays as it was written: nothing
is reordered or multiplied out for its own sake.
"""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache

from potto.core.normal_form import as_term, leading, normal_form
from potto.core.polynomials import Exact, Polynomial, over, size_of
from potto.core.rewrite import Rewriter
from potto.core.terms import ZERO, Term


@lru_cache(maxsize=4096)
def simplify(term: Term) -> Term:
    """The same value, shorter: like terms collected, factors cancelled, constants folded where that is exact."""
    return Rewriter(normalized_surface).run(term)


@lru_cache(maxsize=8192)
def normalized_surface(surface: Term) -> tuple[Term, int]:
    """The canonical form of a condition's surface, and +1 or -1 for its side: surface = positive * side * canonical.

    Surfaces that differ by a constant scale or sign, or in the order of sums and products, have one canonical form.
    Its first monomial has coefficient 1, or one between 1 and 2 where the others could not be written exactly else.
    What cannot be written exactly at all is its own canonical form: rounded, (x - 1e8)^2 < 0.25 and (x - 1e8)^2 < 0.36
    would be one surface. A canonical form tells surfaces apart; where they are, the form as written knows better.
    """
    form = normal_form(surface)
    if not form:
        return ZERO, 1
    first = leading(form)
    side = 1 if form[first] > 0 else -1
    monic = {monomial: over(coefficient, form[first]) for monomial, coefficient in form.items()}
    written = as_term(monic) or as_term(_scaled(form, size_of(form[first]), side))
    return (surface, 1) if written is None else (written, side)


def _scaled(form: Polynomial, size: Exact, side: int) -> Polynomial:
    """A polynomial times the power of two that brings `size` to between 1 and 2: doubles stay doubles."""
    power = size.numerator.bit_length() - size.denominator.bit_length()
    power -= size < Fraction(2) ** power
    return {monomial: over(side * coefficient, Fraction(2) ** power) for monomial, coefficient in form.items()}
