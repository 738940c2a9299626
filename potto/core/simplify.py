"""Shorter terms with the same values.

Owns `simplify`, which keeps the values (up to rounding, and up to where an intermediate result is infinite or not
defined), and the questions asked of whole terms: `polynomial`, `is_zero`, `normalized_surface`. What is not shortened
stays as it was written: nothing is reordered or multiplied out for its own sake.
"""

from __future__ import annotations

import math
from fractions import Fraction
from functools import lru_cache

from potto.core.normal_form import as_term, leading, normal_form
from potto.core.polynomials import Polynomial
from potto.core.rewrite import Rewriter
from potto.core.sampling import vanishes
from potto.core.terms import ONE, ZERO, Const, Prim, Term, Var, add, const, div, mul, neg, postorder, pow_

__all__ = ["is_zero", "normalized_surface", "polynomial", "simplify"]


@lru_cache(maxsize=4096)
def simplify(term: Term) -> Term:
    """The same value, shorter: like terms collected, factors cancelled, constants folded where that is exact."""
    return Rewriter(normalized_surface).run(term)


def polynomial(term: Term, name: str, max_degree: int = 4) -> tuple[Term, ...] | None:
    """The coefficients of a term as a polynomial in one variable, constant term first; None if it is none.

    The last coefficient is not known to be 0; the zero polynomial is `(ZERO,)`.
    """
    memo: dict[Term, list[Term]] = {}
    for node in postorder(term):
        if name not in node.free:
            memo[node] = [node]
            continue
        found = _coefficients(node, name, memo, 2 * max_degree)
        if found is None:
            return None
        memo[node] = found
    result = [simplify(c) for c in memo[term]]
    while len(result) > 1 and is_zero(result[-1]):
        result.pop()
    return tuple(result) if len(result) <= max_degree + 1 else None


def _coefficients(node: Term, name: str, memo: dict[Term, list[Term]], limit: int) -> list[Term] | None:
    if isinstance(node, Var):
        return [ZERO, ONE]
    if not isinstance(node, Prim):
        return None
    parts = [memo.get(a) for a in node.args]
    match node.op, parts:
        case "add", _:
            return _summed([p for p in parts if p is not None])
        case "neg", [list() as a]:
            return [neg(c) for c in a]
        case "mul", _:
            product: list[Term] = [ONE]
            for part in parts:
                product = _multiplied(product, part or [])
                if len(product) > limit + 1:
                    return None
            return product
        case "div", [list() as a, [below]] if name not in node.args[1].free:
            return [div(c, below) for c in a]
        case "pow", [list() as a, _]:
            n = node.args[1].value if isinstance(node.args[1], Const) else math.nan
            if not n.is_integer() or n < 0 or n * (len(a) - 1) > limit:
                return None
            return _powered(a, int(n))
        case _:
            return None


def _summed(parts: list[list[Term]]) -> list[Term]:
    size = max(map(len, parts))
    return [add(*(p[i] for p in parts if i < len(p))) for i in range(size)]


def _multiplied(a: list[Term], b: list[Term]) -> list[Term]:
    return [
        add(*(mul(a[i], b[k - i]) for i in range(len(a)) if 0 <= k - i < len(b))) for k in range(len(a) + len(b) - 1)
    ]


def _powered(a: list[Term], n: int) -> list[Term]:
    if n and all(c is ZERO for c in a[:-1]):
        return [*(ZERO,) * (n * (len(a) - 1)), pow_(a[-1], const(n))]
    result: list[Term] = [ONE]
    for _ in range(n):
        result = _multiplied(result, a)
    return result


@lru_cache(maxsize=4096)
def is_zero(term: Term) -> bool:
    """Whether a term is 0 wherever it is defined: by its normal form, else on sample points to 50 digits."""
    if isinstance(term, Const):
        return term.value == 0
    form = normal_form(term)
    if not form:
        return True
    if all(isinstance(atom, Const | Var) for monomial in form for atom, _ in monomial):
        return False  # a polynomial in variables only is 0 only if all of its coefficients are
    return vanishes(term)


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
    monic = {monomial: coefficient / form[first] for monomial, coefficient in form.items()}
    written = as_term(monic) or as_term(_scaled(form, abs(form[first]), side))
    return (surface, 1) if written is None else (written, side)


def _scaled(form: Polynomial, size: Fraction, side: int) -> Polynomial:
    """A polynomial times the power of two that brings `size` to between 1 and 2: doubles stay doubles."""
    power = size.numerator.bit_length() - size.denominator.bit_length()
    power -= size < Fraction(2) ** power
    return {monomial: side * coefficient / Fraction(2) ** power for monomial, coefficient in form.items()}
