"""Products as factors with exponents, and how a product is written to be read.

Owns `Factors`, `factored` and `written`. Roots are powers of a half, brackets are conditions, exponentials are joined.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction
from math import gcd

from msgspec import Struct

from potto.calculus.algebra.ranges import range_of
from potto.calculus.explanation.brackets import (
    NEVER,
    Inequality,
    bracket,
    conditions,
    constant,
    fewer,
    sign_where,
    two_sides,
)
from potto.core.polynomials import Exact, number, over
from potto.core.printer import format_term
from potto.core.terms import (
    ONE,
    PI,
    ZERO,
    App,
    Branch,
    Const,
    Delta,
    Index,
    Integral,
    Prim,
    Proj,
    Term,
    Var,
    add,
    children,
    const,
    div,
    mul,
    neg,
    pow_,
    prim,
)

_HALF = Fraction(1, 2)
_PLAIN, _TANGENT, _INTEGRAL, _DELTA = range(4)
_DIGITS = 15
_FEW = 6  # digits of a number that a person has written
_LARGEST_DIVISOR = 1000
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


def factored(term: Term) -> Factors:
    """The factors of a term; one that is not a product is its own."""
    found = Factors()
    _collect(term, 1, found)
    return found


def _collect(term: Term, exponent: Exact, into: Factors) -> None:
    match term:
        case Const(name=None, value=value) if math.isfinite(value) and value and exponent.denominator == 1:
            into.coefficient *= Fraction(_short(value)) ** int(exponent)
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
        case Prim(op="add") if exponent.denominator == 1 and (found := _cosine(term)) is not None:
            into.coefficient *= Fraction(found[1]) ** int(exponent)
            into.times(found[0], 2 * exponent)
        case Prim(op="exp", args=(inner,)):
            into.exponents.append(inner if exponent == 1 else mul(_number(Fraction(exponent)), inner))
        case _:
            known = conditions(term) if exponent > 0 else None
            if known is not None:
                into.conditions += known
            else:
                into.times(term, exponent)


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


def _tidied(known: Factors) -> Factors:
    found = Factors(known.coefficient, dict(known.powers), known.exponents, fewer(known.conditions))
    for base, exponent in list(found.powers.items()):
        if isinstance(base, Const) and base.name is None and exponent.denominator == 2:
            value = Fraction(base.value)  # sqrt(2)/2 is 1/sqrt(2)
            other = any(n == -_HALF for n in found.powers.values())
            if exponent > 0 and value > 1 and (other or found.coefficient.denominator % value.numerator == 0):
                found.coefficient *= value
                found.powers[base] = exponent - 1
        if is_parity(base):
            found.times(base, exponent % 2 - exponent)
        if (inner := _signed_by(base)) is not None:
            _signed(found, base, inner)
        if isinstance(base, Prim) and base.op == "abs" and exponent.denominator == 1:
            _sized(found, base, int(exponent))
    return found


def _sized(found: Factors, size: Prim, exponent: int) -> None:
    """abs(v) as v or -v where the conditions tell the sign of v, and t/(v*abs(v)) as abs(t)/v^2 where t*v > 0."""
    inner = size.args[0]
    told = sign_where(found.conditions, inner)
    if told is not None:
        found.times(size, -exponent)
        found.times(inner, exponent)
        found.coefficient *= told[0] ** abs(exponent)
        return
    if exponent % 2 == 0 or found.powers.get(inner, 0) % 2 != 1:
        return
    for base, side in _of_one_sign(found.conditions, inner):
        own = found.powers.get(base, 0)
        if base != inner and own % 2 == 1:
            found.times(size, -exponent)
            found.times(inner, exponent)
            _by_size(found, base, side)
            return


def _by_size(found: Factors, base: Term, side: int) -> None:
    """A factor times its sign, or with -1 the other one."""
    step = 1 if found.powers[base] > 0 else -1
    found.coefficient *= side
    found.times(base, -step)
    found.times(prim("abs", base), step)


def is_parity(base: Term) -> bool:
    """Whether it is a power of -1, by a whole number."""
    return isinstance(base, Prim) and base.op == "pow" and base.args[0] == const(-1.0)


def _signed_by(base: Term) -> Term | None:
    """What a factor is the sign of, in one word or by two brackets."""
    return base.args[0] if isinstance(base, Prim) and base.op == "sign" else two_sides(base)


def _signed(found: Factors, sign: Term, inner: Term) -> None:
    """sign(v) v is abs(v), the square of a sign is 1, and so is a sign that the conditions tell."""
    if not found.powers.pop(sign).numerator % 2:
        return
    turned, named = 1, sign
    match inner:
        case Branch(coordinates=(surface,), then=Const(value=a), orelse=Const(value=b)) if a * b < 0:
            inner, turned = surface, 1 if a > b else -1
            named = prim("sign", inner)
        case _ if is_negative(inner):
            inner, turned = neg(inner), -1
            named = prim("sign", inner)
    told = sign_where(found.conditions, inner)
    if told is not None:
        found.coefficient *= told[0] * turned
        found.conditions = told[1]
        return
    alike = [(base, side, found.powers.get(base, 0)) for base, side in _of_one_sign(found.conditions, inner)]
    for base, side, own in sorted(alike, key=lambda each: each[2] % 2 == 0):  # abs(v)/w^2 before v/(w*abs(w))
        if own and own.denominator == 1:
            _by_size(found, base, side * turned)
            return
    two = two_sides(sign) is not None  # no `sign` may stand there
    found.coefficient *= 1 if two else turned
    found.powers[sign if two else named] = 1


def _of_one_sign(known: Sequence[Inequality], term: Term) -> Iterator[tuple[Term, int]]:
    """Whatever has the sign of a term, or with -1 the other one: itself, and t for x where t*x > 0."""
    yield term, 1
    for item in known:
        found = factored(item.surface)
        odd = [base for base, n in found.powers.items() if n.denominator == 1 and n % 2]
        if item.strict and term in odd and len(odd) == 2 and not found.conditions:
            yield odd[1 - odd.index(term)], 1 if found.coefficient > 0 else -1


# Writing


def written(found: Factors, tangents: frozenset[str]) -> Term:
    """The product: numbers, factors, tangents, integrals, brackets, deltas, over what it is divided by."""
    if not found.coefficient:
        return ZERO
    found = _tidied(found)
    if NEVER in found.conditions:
        return ZERO
    place = {base: (_place(base, tangents), _order(base)) for base, n in found.powers.items() if n > 0}
    top = sorted(place, key=place.__getitem__)
    below = sorted((b for b, n in found.powers.items() if n < 0), key=_order)
    scale, divisor = _scale(abs(found.coefficient), bool(below))
    exponent = [prim("exp", add(*found.exponents))] if found.exponents else []
    plain = [b for b in top if place[b][0] == _PLAIN]
    names = [b for b in plain if place[b][1][0] == 0 and found.powers[b].denominator == 1]
    above = [*_powers(found, names, 1), *exponent, *_powers(found, [b for b in plain if b not in names], 1)]
    tail = [_raised(b, found.powers[b]) for b in top if place[b][0] != _PLAIN]
    held = [bracket(found.conditions)] if found.conditions else []
    deltas = [b for b in tail if _place(b, tangents) == _DELTA]
    integrals = [_raised(b, found.powers[b]) for b in top if place[b][0] == _INTEGRAL]
    moving = [b for b in tail if b not in (*deltas, *integrals)]
    under = [divisor, *_powers(found, below, -1)]
    halved = [] if above or moving else integrals  # half of an integral, but dt/2 times one
    fraction = div(mul(scale, *above, *moving, *halved), mul(*under))
    whole = mul(fraction, *(integrals if not halved else ()), *held, *deltas)
    return neg(whole) if found.coefficient < 0 else whole


def _powers(found: Factors, bases: Iterable[Term], sign: int) -> list[Term]:
    """Bases with their exponents, square roots last."""
    roots: list[Term] = []
    out: list[Term] = []
    for base in bases:
        exponent = sign * found.powers[base]
        if exponent == _HALF:
            roots.append(base)
        else:
            out.append(_raised(base, exponent))
    return [*out, *(prim("sqrt", root) for root in roots)]


def with_one_root(node: Term) -> Term:
    """A product with its square roots as one."""
    if not isinstance(node, Prim) or node.op != "mul":
        return node
    roots = [arg for arg in node.args if isinstance(arg, Prim) and arg.op == "sqrt"]
    if len(roots) < 2:
        return node
    others = [arg for arg in node.args if arg not in roots]
    return mul(*others, prim("sqrt", mul(*(root.args[0] for root in roots))))


def _raised(base: Term, exponent: Exact) -> Term:
    if exponent == 1:
        return base
    if exponent == _HALF:
        return prim("sqrt", base)
    if exponent.denominator == 2:
        return mul(*([_raised(base, exponent - _HALF)] if exponent > _HALF else []), prim("sqrt", base))
    return pow_(base, number(exponent) or const(float(exponent)))


def _place(base: Term, tangents: frozenset[str]) -> int:
    if isinstance(base, Delta) or (isinstance(base, App) and isinstance(base.function, Var)
                                   and base.function.name.startswith("delta'")):  # fmt: skip
        return _DELTA
    if isinstance(base, Integral):
        return _INTEGRAL
    moves = is_tangent(base, tangents) or (isinstance(base, Prim) and base.op == "add" and base.free & tangents)
    return _TANGENT if moves else _PLAIN


def _order(base: Term) -> tuple[int, str]:
    """Names first, in the order of the alphabet, pi before others, then calls, then sums."""
    if isinstance(base, Var | Const):
        return 0, "" if base is PI else format_term(base)
    return (2 if isinstance(base, Prim) and base.op == "add" else 1), ""


def is_tangent(base: Term, tangents: frozenset[str]) -> bool:
    """Whether a factor is a tangent, a part of one, or that of a call."""
    while isinstance(base, Proj | Index):
        base = base.term if isinstance(base, Proj) else base.array
    if isinstance(base, App):
        return isinstance(base.function, Var) and base.function.name == "snd"
    return isinstance(base, Var) and (base.name in tangents or base.name.partition(".")[0] in tangents)


def _scale(value: Fraction, divided: bool) -> tuple[Term, Term]:
    """A coefficient as a factor and a divisor: r/2 rather than 0.5*r, 0.45 as it is, 1/0.18 for 5.555555555555555."""
    small = value.denominator <= 12 and value.numerator < 100
    if value.denominator == 1 or (small and (divided or value.denominator < 10)):
        return const(float(value.numerator)), const(float(value.denominator))
    if not _is_short(value):
        for top in range(1, 10):
            below = _short(float(top / value), _FEW)
            if _is_short(Fraction(repr(below))) and _rounds_to(Fraction(top) / Fraction(repr(below)), value):
                return const(float(top)), const(below)
        near = value.limit_denominator(_LARGEST_DIVISOR)
        if near.numerator < _LARGEST_DIVISOR and _rounds_to(near, value):
            return const(float(near.numerator)), const(float(near.denominator))
    return _number(value), ONE


def _is_short(value: Fraction) -> bool:
    """Whether its decimals are few."""
    return _rounds_to(Fraction(f"{float(value):.{_FEW}g}"), value)


def _rounds_to(exact: Fraction, value: Fraction) -> bool:
    """Whether a value is what rounding has made of another one."""
    return abs(exact - value) <= 4 * Fraction(math.ulp(float(value)))


def _number(value: Fraction) -> Term:
    nearest = _short(float(value))
    if abs(Fraction(nearest) - value) <= abs(value) / 2**50:
        return const(nearest)
    return number(value) or const(float(value))


def _short(value: float, digits: int = _DIGITS) -> float:
    """0.45 for what rounding has made 0.44999999999999996."""
    short = float(f"{value:.{digits}g}")
    return short if abs(short - value) <= 4 * math.ulp(value) else value


def added(parts: list[Term]) -> Term:
    """A sum, what is taken away last."""
    return add(*(p for p in parts if not is_negative(p)), *(p for p in parts if is_negative(p)))


def is_negative(term: Term) -> bool:
    return isinstance(term, Prim) and term.op == "neg"
