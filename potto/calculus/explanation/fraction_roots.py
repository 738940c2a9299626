"""Roots of fractions in a product, as fractions of roots where what they are divided by has a known sign.

Owns `without_fractions`: abs(l)*sqrt(1 - d^2/l^2) is sqrt(l^2 - d^2), sqrt(0.64/a) is 0.8/sqrt(a) where a > 0, and
1/sqrt(h/3) is 3/sqrt(3*h).
"""

from __future__ import annotations

from fractions import Fraction
from math import isqrt

from potto.calculus.algebra.ranges import range_of
from potto.calculus.algebra.rational_form import Rational, as_term, normal
from potto.calculus.explanation.brackets import sign_where
from potto.calculus.explanation.factors import Factors, shortest
from potto.core.polynomials import Exact
from potto.core.terms import Prim, Term, const, prim

_LARGEST = 1000  # of what a plain number is divided by


def without_fractions(found: Factors) -> None:
    """Change a product so."""
    for base, exponent in list(found.powers.items()):
        if exponent.denominator != 2 or not isinstance(base, Prim) or base.op not in ("add", "mul", "div"):
            continue
        form = normal(base)
        if form is None or form.whole or len(form.below) != 1:
            continue
        if set(form.below) == {()}:
            _over_number(form, base, exponent, found)
            continue
        apart = _of_quotient(form, found) if set(form.top) == {()} else _by_sizes(form, exponent, found)
        if apart is not None:
            found.times(base, -exponent)
            _times_root(found, apart, exponent)


def _over_number(form: Rational, base: Term, exponent: Exact, found: Factors) -> None:
    """What is divided by the root of u/n, by that of n*u; a root of u/n that is no divisor is read as it is."""
    (divisor,) = form.below.values()
    inside = as_term({m: c * divisor for m, c in form.top.items()})
    if exponent < 0 and divisor > 0 and inside is not None:
        found.times(base, -exponent)
        found.times(inside, exponent)
        found.coefficient = _plain(found.coefficient * _as_written(divisor) ** int(-2 * exponent))


def _plain(value: Fraction) -> Fraction:
    """The 1/2 that 4.905/9.81 is but for rounding."""
    near = value.limit_denominator(_LARGEST)
    return near if abs(near - value) <= abs(value) / 2**50 else value


def _of_quotient(form: Rational, found: Factors) -> Factors | None:
    """A number over a product, by its factors, all of which are above 0 where the conditions hold."""
    (number,), ((below, divisor),) = form.top.values(), form.below.items()
    value = _as_written(number) / _as_written(divisor)
    powers: dict[Term, Exact] = {atom: -n for atom, n in below}
    told = value > 0 and all(n % 2 == 0 or _is_above(atom, found) for atom, n in powers.items())
    return Factors(value, powers, [], []) if told else None


def _is_above(atom: Term, found: Factors) -> bool:
    told = sign_where(found.conditions, atom)
    return range_of(atom).lo >= 0 or (told is not None and told[0] > 0)


def _by_sizes(form: Rational, exponent: Exact, found: Factors) -> Factors | None:
    """A sum over squares times these, each of which stands beside the root as a size."""
    ((below, divisor),) = form.below.items()
    side = 1 if exponent > 0 else -1
    sizes = {prim("abs", atom): n // 2 for atom, n in below}
    whole = as_term(form.top)
    if (
        whole is None
        or any(n % 2 for _, n in below)
        or any(found.powers.get(s, 0) * side < n for s, n in sizes.items())
    ):
        return None
    for size, n in sizes.items():
        found.times(size, -n * side)
    return Factors(1 / _as_written(divisor), {whole: 1}, [], [])


def _as_written(value: Exact) -> Fraction:
    """0.64 as 16/25, and not as the binary fraction that it is in a program."""
    return Fraction(repr(shortest(float(value))))


def _times_root(found: Factors, inner: Factors, exponent: Exact) -> None:
    """Times inner^exponent, which has a half in it."""
    for number, n in ((inner.coefficient.numerator, exponent), (inner.coefficient.denominator, -exponent)):
        root = isqrt(number)
        if root * root == number:
            found.coefficient *= Fraction(root) ** int(2 * n)
        else:
            found.times(const(float(number)), n)
    for base, n in inner.powers.items():
        found.times(prim("abs", base) if n % 2 == 0 else base, n * exponent)
