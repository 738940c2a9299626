"""Products as factors with exponents. Roots are powers of a half, brackets are conditions, exponentials are joined.

Owns `Factors` and `factored`, and `as_number` and `shortest` for what rounding has made of numbers; `products` writes
them.
"""

from __future__ import annotations

import math
from fractions import Fraction
from math import gcd, isqrt, lcm

from msgspec import Struct

from potto.calculus.algebra.ranges import range_of
from potto.calculus.algebra.rational_form import as_term, normal
from potto.calculus.explanation.brackets import (
    Inequality,
    conditions,
    constant,
)
from potto.core.polynomials import Exact, number, over, size_of
from potto.core.printer import format_term
from potto.core.terms import (
    Const,
    Prim,
    Term,
    add,
    children,
    const,
    div,
    mul,
    neg,
    prim,
)

_DIGITS = 15
_LARGEST = 64  # of an exponent
_PARTS = range(3, 13)  # of roots that are told as exponents


class Factors(Struct):
    """coefficient * the product of base^exponent * exp(the sum of `exponents`), where all conditions hold."""

    coefficient: Fraction = Fraction(1)
    powers: dict[Term, Exact] = {}
    exponents: list[Term] = []
    conditions: list[Inequality] = []

    def times(self, base: Term, exponent: Exact) -> None:
        """One more factor."""
        if exponent:
            self.powers[base] = self.powers.get(base, 0) + exponent
            if not self.powers[base]:
                del self.powers[base]

    def times_all(self, other: Factors, power: int = 1) -> None:
        """All that another product has, to a power."""
        if other.coefficient != 1:
            self.coefficient *= other.coefficient**power
        for base, exponent in other.powers.items():
            self.times(base, exponent * power)
        self.exponents += [mul(const(float(power)), exponent) for exponent in other.exponents]
        self.conditions += other.conditions

    def shared_with(self, other: Factors) -> Factors:
        """What both are products of, but for numbers."""
        found = Factors(Fraction(1), {}, [], [c for c in self.conditions if c in other.conditions])
        for base, n in self.powers.items():
            m = other.powers.get(base, 0)
            if n * m > 0:
                found.times(base, min(n, m, key=size_of))
        found.exponents = [e for e in self.exponents if e in other.exponents]
        return found

    def without(self, shared: Factors) -> Factors:
        """Divided by what it is a product of."""
        rest = Factors(self.coefficient / shared.coefficient, dict(self.powers), [], [])
        for base, n in shared.powers.items():
            rest.times(base, -n)
        rest.exponents = [e for e in self.exponents if e not in shared.exponents]
        rest.conditions = [c for c in self.conditions if c not in shared.conditions]
        return rest


def factored(term: Term) -> Factors:
    """The factors of a term; one that is not a product is its own."""
    found = Factors()
    _collect(term, 1, found)
    return found


def _collect(term: Term, exponent: Exact, into: Factors) -> None:
    match term:
        case Const(name=None, value=value) if math.isfinite(value) and value and exponent.denominator == 1:
            into.coefficient *= Fraction(shortest(value)) ** int(exponent)
        case Prim(op="neg", args=(inner,)) if exponent.denominator == 1:
            into.coefficient *= Fraction(-1) ** int(exponent)
            _collect(inner, exponent, into)
        case Prim(op="mul", args=args) if exponent.denominator == 1 or all(range_of(a).lo >= 0 for a in args):
            for arg in args:
                _collect(arg, exponent, into)
        case Prim(op="div", args=(top, below)) if exponent.denominator == 1:
            _collect(top, exponent, into)
            _collect(below, -exponent, into)
        case Prim(op="pow", args=(base, Const(name=None, value=value))) if (
            value.is_integer() and abs(value) <= _LARGEST and exponent.denominator == 1
        ):
            _collect(base, exponent * int(value), into)
        case Prim(op="pow", args=(Prim(op="abs") as base, power)) if (
            exponent.denominator == 1 and (part := constant(power)) is not None and part.denominator in _PARTS
        ):
            into.times(base, exponent * part)
        case Prim(op="sqrt", args=(inner,)) if exponent.denominator == 1:
            _collect(inner, over(exponent, 2), into)
        case Prim(op="add", args=args) if exponent.denominator == 1 and all(map(_negative, args)):
            into.coefficient *= Fraction(-1) ** int(exponent)
            into.times(add(*map(neg, args)), exponent)
        case Prim(op="add", args=args) if exponent.denominator == 1 and (shared := gcd(*map(_whole, args))) > 1:
            into.coefficient *= Fraction(shared) ** int(exponent)
            into.times(add(*(_without(arg, shared) for arg in args)), exponent)
        case Prim(op="add") if exponent.denominator == 2 and (whole := _over_square(term)) is not None:
            into.coefficient *= whole[1] ** int(2 * exponent)
            into.times(whole[0], exponent)
        case Prim(op="add") if exponent.denominator == 1 and (found := _cosine(term)) is not None:
            into.coefficient *= Fraction(found[1]) ** int(exponent)
            into.times(found[0], 2 * exponent)
        case Prim(op="exp", args=(inner,)):
            into.exponents.append(inner if exponent == 1 else mul(as_number(Fraction(exponent)), inner))
        case _:
            known = conditions(term) if exponent > 0 else None
            if known is not None:
                into.conditions += known
            else:
                into.times(term, exponent)


def _over_square(term: Term) -> tuple[Term, Fraction] | None:
    """4 - x^2 and 1/2 for 1 - x^2/4, whose root is half of that of the first; None where that is no shorter."""
    form = normal(term)
    if form is None or not form.whole:
        return None
    numbers = [Fraction(c) for c in form.top.values()]
    below = lcm(*(c.denominator for c in numbers))
    root = isqrt(below)
    if below == 1 or below > _LARGEST**2 or root * root != below:
        return None
    whole = as_term({m: c * below for m, c in form.top.items()})
    shorter = whole is not None and len(format_term(whole)) + 1 < len(format_term(term))
    return (whole, Fraction(1, root)) if whole is not None and shorter else None


def _negative(term: Term) -> bool:
    return (isinstance(term, Prim) and term.op == "neg") or (isinstance(term, Const) and term.value < 0)


def _whole(term: Term) -> int:
    """The whole number that a term is a multiple of as it is written."""
    match term:
        case Const(name=None, value=value) if value.is_integer():
            return abs(int(value))
        case Prim(op="neg" | "div", args=(inner, *_)):
            return _whole(inner)
        case Prim(op="mul", args=args):
            return max(map(_whole, args))
        case _:
            return 1


def _without(term: Term, number: int) -> Term:
    """A multiple of a whole number divided by it."""
    match term:
        case Const(value=value):
            return const(value / number)
        case Prim(op="neg", args=(inner,)):
            return neg(_without(inner, number))
        case Prim(op="div", args=(top, below)):
            return div(_without(top, number), below)
        case _:
            parts = list(children(term))
            place = max(range(len(parts)), key=lambda n: _whole(parts[n]))
            parts[place] = _without(parts[place], number)
            return mul(*parts)


def _cosine(term: Prim) -> tuple[Term, int] | None:
    """cos(u) and -1 for sin(u)^2 - 1, of which it is the square: +1 with the signs turned."""
    match term.args:
        case (Prim(op="pow", args=(Prim(op="sin", args=(u,)), Const(value=2.0))), Const(value=-1.0)):
            return prim("cos", u), -1
        case (Prim(op="neg", args=(Prim(op="pow", args=(Prim(op="sin", args=(u,)), Const(value=2.0))),)),
              Const(value=1.0)):  # fmt: skip
            return prim("cos", u), 1
        case _:
            return None


def is_parity(base: Term) -> bool:
    """Whether it is a power of -1, by a whole number."""
    return isinstance(base, Prim) and base.op == "pow" and base.args[0] == const(-1.0)


def as_number(value: Fraction) -> Term:
    nearest = shortest(float(value))
    if abs(Fraction(nearest) - value) <= abs(value) / 2**50:
        return const(nearest)
    return number(value) or const(float(value))


def shortest(value: float, digits: int = _DIGITS) -> float:
    """0.45 for what rounding has made 0.44999999999999996."""
    short = float(f"{value:.{digits}g}")
    return short if abs(short - value) <= 4 * math.ulp(value) else value
