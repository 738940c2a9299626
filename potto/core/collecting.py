"""Like terms of sums, and common factors of products.

Owns `sum_of` and `product_of`. Coefficients are added up and multiplied as exact fractions; a sum or a product in
which nothing merges is given back as it stands.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from fractions import Fraction

from msgspec import Struct

from potto.core.polynomials import number
from potto.core.terms import ONE, ZERO, Const, Prim, Term, add, const, div, mul, neg, pow_, prim

_HALF = Fraction(1, 2)
_BITS = 2200  # of a fraction that is still a double, or a product of two


def sum_of(node: Prim) -> Term:
    """A sum with its like terms collected, sums inside taken apart if that makes it shorter."""
    closed = _collected((Fraction(1), a) for a in node.args)
    opened = _collected(_opened(node.args))
    best = min(closed, opened, key=lambda found: len(found.terms))
    if len(best.terms) >= len(node.args):
        return node
    return best.written()


class _Collected(Struct):
    """Coefficients by what they multiply, in the order in which they were met."""

    terms: dict[tuple[Term, ...], tuple[Fraction, Term]] = {}

    def place(self, value: Fraction) -> tuple[Term, ...]:
        """Where a number is added: numbers whose sum is not exact stay apart."""
        key: tuple[Term, ...] = (ONE,)
        while key in self.terms and number(abs(self.terms[key][0] + value)) is None:
            key = (ONE, *key)
        return key

    def written(self) -> Term:
        return add(*(_scaled(c, core) for c, core in self.terms.values()))


def _collected(items: Iterable[tuple[Fraction, Term]]) -> _Collected:
    result = _Collected()
    for scale, item in items:
        coefficient, core = split(item)
        key = result.place(coefficient * scale) if core is ONE else _key(core)
        before, core = result.terms.get(key, (Fraction(0), core))
        result.terms[key] = before + coefficient * scale, core
    result.terms = {k: v for k, v in result.terms.items() if v[0]}
    return result


def _opened(args: Iterable[Term]) -> Iterable[tuple[Fraction, Term]]:
    for arg in args:
        coefficient, core = split(arg)
        if isinstance(core, Prim) and core.op == "add":
            yield from ((coefficient, a) for a in core.args)
        else:
            yield Fraction(1), arg


def split(term: Term) -> tuple[Fraction, Term]:
    """A number times the rest."""
    coefficient = Fraction(1)
    while True:
        match term:
            case Prim(op="neg", args=(inner,)):
                coefficient, term = -coefficient, inner
            case Const(name=None, value=value) if math.isfinite(value):
                return coefficient * Fraction(value), ONE
            case Prim(op="mul", args=(Const(name=None, value=value), *rest)) if math.isfinite(value):
                coefficient, term = coefficient * Fraction(value), mul(*rest)
            case Prim(op="div", args=(inner, Const(name=None, value=value))) if math.isfinite(value) and value:
                coefficient, term = coefficient / Fraction(value), inner
            case _:
                return coefficient, term


def _key(core: Term) -> tuple[Term, ...]:
    """The same for products that differ in order only."""
    if isinstance(core, Prim) and core.op == "mul":
        return tuple(sorted(core.args, key=lambda a: a.digest))
    return (core,)


def _scaled(coefficient: Fraction, core: Term) -> Term:
    size = abs(coefficient)
    scale = number(size)
    if scale is None:
        scale = const(float(size))
    if isinstance(scale, Prim):
        above, below = scale.args
        scaled = div(mul(above, core), below)
    else:
        scaled = mul(scale, core)
    return neg(scaled) if coefficient < 0 else scaled


# Products


class _Factors(Struct):
    """A product taken apart: coefficient * product of base^exponent, and how many factors there were."""

    coefficient: Fraction = Fraction(1)
    powers: dict[Term, list[Fraction]] = {}
    numbers: int = 0
    levels: int = 0

    def take(self, root: Term) -> None:
        stack: list[tuple[Term, int]] = [(root, 1)]
        while stack:
            term, n = stack.pop()
            match term:
                case Const(name=None, value=value) if self.folds(value, n):
                    self.coefficient *= Fraction(value) ** n
                    self.numbers += value != 1
                case Prim(op="mul", args=args):
                    stack.extend((a, n) for a in reversed(args))
                case Prim(op="div", args=(a, b)):
                    self.levels += b is not root
                    stack.extend(((b, -n), (a, n)))
                case Prim(op="neg", args=(a,)):
                    self.coefficient = -self.coefficient if n % 2 else self.coefficient
                    stack.append((a, n))
                case Prim(op="pow", args=(a, Const(value=value))) if value.is_integer() and abs(value * n) <= 64:
                    stack.append((a, n * int(value)))
                case Prim(op="sqrt", args=(a,)) if n % 2 == 0:
                    stack.append((a, n // 2))
                case Prim(op="sqrt", args=(a,)):
                    self.put(a, n * _HALF)
                case Prim(op="pow", args=(a, Const(value=value))) if math.isfinite(value):
                    self.put(a, n * Fraction(value))
                case _:
                    self.put(term, Fraction(n))

    def folds(self, value: float, n: int) -> bool:
        """Whether a number can be multiplied into the coefficient exactly."""
        if not math.isfinite(value) or (value == 0 and n < 0) or abs(n) > 64:
            return False
        product = self.coefficient * Fraction(value) ** n
        return product.numerator.bit_length() + product.denominator.bit_length() < _BITS and number(product) is not None

    def put(self, base: Term, exponent: Fraction) -> None:
        self.powers.setdefault(base, []).append(exponent)


def product_of(node: Prim) -> Term:
    """A product, quotient or power with its numbers folded, common factors cancelled, equal ones gathered."""
    if node.op == "pow" and isinstance(node.args[1], Const) and node.args[1].value == 0:
        return ONE
    factors = _Factors()
    factors.take(node)
    if not factors.coefficient:
        return ZERO
    merged = {base: _gathered(exponents) for base, exponents in factors.powers.items()}
    if merged == factors.powers and factors.numbers < 2 and factors.levels < 2 and not _cancels(node):
        return node
    written = _written(factors.coefficient, merged)
    return written if written is not node else node


def _cancels(node: Prim) -> bool:
    """Whether a number below the line, or a power of a product or of a power, can be written more simply."""
    if node.op == "pow":
        base = node.args[0]
        return isinstance(base, Prim) and base.op in ("mul", "div", "neg", "pow", "sqrt")
    return False


def _gathered(exponents: list[Fraction]) -> list[Fraction]:
    """Exponents of one base added up, if a whole exponent comes of it; x * sqrt(x) stays."""
    total = sum(exponents, Fraction(0))
    if total.denominator == 1:
        return [total] if total else []
    whole = sum((e for e in exponents if e.denominator == 1), Fraction(0))
    parts = [e for e in exponents if e.denominator != 1]
    return ([whole] if whole else []) + parts


def _written(coefficient: Fraction, powers: dict[Term, list[Fraction]]) -> Term:
    above: list[Term] = []
    below: list[Term] = []
    for base, exponents in powers.items():
        for exponent in exponents:
            (above if exponent > 0 else below).append(_power(base, abs(exponent)))
    size = number(abs(coefficient))
    assert size is not None  # `folds` has seen to it
    if isinstance(size, Prim):
        above, below = [size.args[0], *above], [size.args[1], *below]
    else:
        above = [size, *above]
    term = div(mul(*above), mul(*below))
    return neg(term) if coefficient < 0 else term


def _power(base: Term, exponent: Fraction) -> Term:
    if exponent == 1:
        return base
    return prim("sqrt", base) if exponent == _HALF else pow_(base, const(float(exponent)))
