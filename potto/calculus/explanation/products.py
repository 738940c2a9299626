"""How a product is written to be read.

Owns `written`, `with_one_root`, `in_order`, `led_by`, `added`, `is_negative` and `is_tangent`. Signs and sizes are told
by the conditions beside them, where these do.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction

from potto.calculus.algebra.rational_form import as_term, normal, shorter
from potto.calculus.explanation.bounds import bracket
from potto.calculus.explanation.brackets import (
    NEVER,
    Inequality,
    conditions,
    fewer,
    implies,
    sign_where,
    two_sides,
)
from potto.calculus.explanation.factors import Factors, as_number, factored, is_parity, shortest
from potto.calculus.explanation.fraction_roots import without_fractions
from potto.core.polynomials import Exact, number
from potto.core.printer import format_term
from potto.core.terms import (
    ONE,
    PI,
    ZERO,
    App,
    Branch,
    Const,
    Delta,
    If,
    Index,
    Integral,
    Prim,
    Proj,
    Sum,
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
_PLAIN, _TANGENT, _SUM, _INTEGRAL, _EITHER, _DELTA = range(6)
_FEW = 6  # digits of a number that a person has written
_LARGEST_DIVISOR = 1000


def _tidied(known: Factors) -> Factors:
    found = Factors(known.coefficient, dict(known.powers), known.exponents, fewer(known.conditions))
    without_fractions(found)
    for base, exponent in list(found.powers.items()):
        if exponent.denominator == 1 and (decided := _where(found.conditions, base)) is not None:
            found.times(base, -exponent)
            found.times_all(factored(decided), int(exponent))
            continue
        if isinstance(base, Const) and base.name is None and exponent.denominator == 2:
            value = Fraction(base.value)  # sqrt(2)/2 is 1/sqrt(2)
            other = any(n == -_HALF for n in found.powers.values())
            if exponent > 0 and value > 1 and (other or found.coefficient.denominator % value.numerator == 0):
                found.coefficient *= value
                found.powers[base] = exponent - 1
        if is_parity(base):
            found.times(base, exponent % 2 - exponent)
        if exponent == _HALF:
            _rooted(found, base)
        if (inner := _signed_by(base)) is not None:
            _signed(found, base, inner)
        if isinstance(base, Prim) and base.op == "abs":
            _sized(found, base, exponent)
    return found


def _rooted(found: Factors, base: Term) -> None:
    """1/sqrt(4*pi*t) for sqrt(4*pi*t)/(4*pi*t), whose factors stand below the line one by one."""
    inner = factored(base)
    if base in inner.powers or inner.exponents or inner.conditions or not inner.powers:
        return
    if all(found.powers.get(factor, 0) <= -n < 0 for factor, n in inner.powers.items()):
        found.coefficient *= inner.coefficient
        for factor, n in inner.powers.items():
            found.times(factor, n)
        found.times(base, -1)


def _where(known: Sequence[Inequality], base: Term) -> Term | None:
    """A sum without brackets that hold where all these conditions do, as what it comes to there; None if it has none
    of these, or is no product of powers then."""
    if not known or not isinstance(base, Prim) or base.op != "add" or two_sides(base) is not None:
        return None
    parts = list(map(factored, base.args))
    pieces = []
    for part in parts:
        kept = [c for c in part.conditions if not any(implies(each, c) for each in known)]
        if fewer([*known, *kept]) != [NEVER]:
            pieces.append(Factors(part.coefficient, part.powers, part.exponents, kept))
    if sum(len(piece.conditions) for piece in pieces) == sum(len(part.conditions) for part in parts):
        return None
    whole = add(*(written(piece, frozenset()) for piece in pieces))
    inner = factored(whole)
    return None if whole is ZERO or inner.exponents or inner.conditions else whole


def _sized(found: Factors, size: Prim, exponent: Exact) -> None:
    """abs(v) as v or -v where the conditions tell the sign of v, and t/(v*abs(v)) as abs(t)/v^2 where t*v > 0. Its cube
    root is that of v where v is above 0."""
    inner = size.args[0]
    told = sign_where(found.conditions, inner)
    if exponent.denominator != 1:
        if told is not None and told[0] > 0:
            found.times(size, -exponent)
            found.times(inner, exponent)
        return
    if told is not None:
        found.times(size, -exponent)
        found.times(inner, exponent)
        found.coefficient *= told[0] ** abs(int(exponent))
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
    exponent = [prim("exp", _exponent(found.exponents))] if found.exponents else []
    plain = [b for b in top if place[b][0] == _PLAIN]
    led = [b for b in plain if place[b][1][0] <= 1 and (found.powers[b].denominator == 1 or _is_number(b))]
    above = [*_powers(found, led, 1), *exponent, *_powers(found, [b for b in plain if b not in led], 1)]
    moving, integrals, either, deltas = (
        [_raised(b, found.powers[b]) for b in top if place[b][0] in places]
        for places in ((_TANGENT, _SUM), (_INTEGRAL,), (_EITHER,), (_DELTA,))
    )
    held = [*either, *([bracket(found.conditions)] if found.conditions else [])]
    under = [divisor, *_powers(found, below, -1)]
    halved = [] if above or moving else integrals  # half of an integral, but dt/2 times one
    fraction = div(mul(scale, *above, *moving, *halved), mul(*under))
    whole = mul(fraction, *(integrals if not halved else ()), *held, *deltas)
    return neg(whole) if found.coefficient < 0 else whole


def _exponent(parts: Sequence[Term]) -> Term:
    """The sum of exponents, the same however these come: what stands in it twice is told once."""
    if len(parts) == 1:
        return parts[0]
    sums = (part.args if isinstance(part, Prim) and part.op == "add" else (part,) for part in parts)
    count = Counter(arg for each in sums for arg in each)
    several = {arg for arg, n in count.items() if n > 1}
    each = [written(factored(mul(const(float(count[arg])), arg)), frozenset()) if arg in several else arg
            for arg in sorted(count, key=format_term)]  # fmt: skip
    return shorter(add(*each))


def _powers(found: Factors, bases: Iterable[Term], sign: int) -> list[Term]:
    """Bases with their exponents, square roots last, but those of numbers first: sqrt(2)*x*sqrt(t)."""
    numbers: list[Term] = []
    roots: list[Term] = []
    out: list[Term] = []
    for base in bases:
        exponent = sign * found.powers[base]
        if exponent == _HALF:
            (numbers if _is_number(base) else roots).append(base)
        else:
            out.append(_raised(base, exponent))
    first, last = ([prim("sqrt", base) for base in bases] for bases in (numbers, roots))
    return [*first, *out, *last]


def _is_number(base: Term) -> bool:
    return isinstance(base, Const) and base.name is None


def with_one_root(node: Term) -> Term:
    """A product with its square roots as one."""
    if not isinstance(node, Prim) or node.op != "mul":
        return node
    roots = [arg for arg in node.args if isinstance(arg, Prim) and arg.op == "sqrt"]
    if len(roots) < 2:
        return node
    others = [arg for arg in node.args if arg not in roots]
    inside = mul(*(root.args[0] for root in roots))
    found = normal(inside)
    plain = as_term(found.top) if found is not None and found.whole else None
    shorter = plain is not None and len(format_term(plain)) < len(format_term(inside))
    return mul(*others, prim("sqrt", plain if plain is not None and shorter else inside))


def in_order(node: Term, tangents: frozenset[str]) -> Term:
    """A product with the names among its factors in order: c*t for t*c."""
    if not isinstance(node, Prim) or node.op != "mul":
        return node
    places = [n for n, arg in enumerate(node.args) if _is_power_of_name(arg, tangents)]
    names = sorted((node.args[n] for n in places), key=lambda arg: _order(_base(arg)))
    ordered = dict(zip(places, names, strict=True))
    args = [ordered.get(n, arg) for n, arg in enumerate(node.args)]
    return node if tuple(args) == node.args else mul(*args)


def _is_power_of_name(term: Term, tangents: frozenset[str]) -> bool:
    base = _base(term)
    named = isinstance(base, Var) or (isinstance(base, Const) and base.name is not None)
    return named and _place(base, tangents) == _PLAIN


def _base(term: Term) -> Term:
    match term:
        case Prim(op="pow", args=(base, Const())):
            return base
        case _:
            return term


def led_by(node: Term, inside: frozenset[str]) -> Term:
    """An even power of a difference with what varies inside of an integral first: (x - a)^2 for (a - x)^2."""
    match node:
        case Prim(op="pow", args=(Prim(op="add", args=args), Const(value=n) as exponent)) if n % 2 == 0:
            led = [is_negative(part) for part in args if not part.free.isdisjoint(inside)]
            return pow_(added([neg(part) for part in args]), exponent) if led and all(led) else node
        case _:
            return node


def _raised(base: Term, exponent: Exact) -> Term:
    if exponent == 1:
        return base
    if exponent == _HALF:
        return prim("sqrt", base)
    if exponent.denominator == 2 and not (isinstance(base, Prim) and base.op == "add"):  # (x^2 + y^2)^(3/2)
        return mul(*([_raised(base, exponent - _HALF)] if exponent > _HALF else []), prim("sqrt", base))
    return pow_(base, number(exponent) or const(float(exponent)))


def _place(base: Term, tangents: frozenset[str]) -> int:
    if isinstance(base, Delta) or (isinstance(base, App) and isinstance(base.function, Var)
                                   and base.function.name.startswith("delta'")):  # fmt: skip
        return _DELTA
    if isinstance(base, Sum):
        return _SUM
    if isinstance(base, Integral) or _is_of_brackets(base):
        return _INTEGRAL
    if isinstance(base, Branch) and ONE in (base.then, base.orelse) and format_term(base).startswith("["):
        return _EITHER
    moves = is_tangent(base, tangents) or (isinstance(base, Prim) and base.op == "add" and base.free & tangents)
    return _TANGENT if moves else _PLAIN


def _is_of_brackets(base: Term) -> bool:
    """Whether it is a sum of brackets, which people write where one bracket would stand."""
    if not isinstance(base, Prim) or base.op != "add":
        return False
    return all(conditions(children(part)[0] if is_negative(part) else part) for part in base.args)


def _order(base: Term) -> tuple[int, str]:
    """Names first, in the order of the alphabet, pi before others, then sums, then calls, choices last."""
    if isinstance(base, Var | Const):
        return 0, "" if base is PI else str(base.name) if base.name is not None else format_term(base)
    return 1 if isinstance(base, Prim) and base.op == "add" else 3 if isinstance(base, If | Branch) else 2, ""


def is_tangent(base: Term, tangents: frozenset[str]) -> bool:
    """Whether a factor is a tangent, a part of one, or that of a call."""
    while isinstance(base, Proj | Index):
        base = base.term if isinstance(base, Proj) else base.array
    if isinstance(base, App):
        return isinstance(base.function, Var) and base.function.name == "snd"
    return isinstance(base, Var) and (base.name in tangents or base.name.partition(".")[0] in tangents)


def _scale(value: Fraction, divided: bool) -> tuple[Term, Term]:
    """A coefficient as a factor and a divisor: r/2 rather than 0.5*r, 0.45 as it is, 1/0.18 for 5.555555555555555."""
    small = (value.denominator <= 12 or _is_halved(value)) and value.numerator < 100
    if value.denominator == 1 or (small and (divided or value.denominator < 10 or _is_halved(value))):
        return const(float(value.numerator)), const(float(value.denominator))
    if not _is_short(value):
        for top in range(1, 10):
            below = shortest(float(top / value), _FEW)
            if _is_short(Fraction(repr(below))) and _rounds_to(Fraction(top) / Fraction(repr(below)), value):
                return const(float(top)), const(below)
        near = value.limit_denominator(_LARGEST_DIVISOR)
        if near.numerator < _LARGEST_DIVISOR and _rounds_to(near, value):
            return const(float(near.numerator)), const(float(near.denominator))
    return as_number(value), ONE


def _is_halved(value: Fraction) -> bool:
    """Whether it is a number halved so often that its decimals are many: 1/32."""
    return 16 <= value.denominator <= 64 and value.denominator & (value.denominator - 1) == 0


def _is_short(value: Fraction) -> bool:
    """Whether its decimals are few."""
    return _rounds_to(Fraction(f"{float(value):.{_FEW}g}"), value)


def _rounds_to(exact: Fraction, value: Fraction) -> bool:
    """Whether a value is what rounding has made of another one."""
    return abs(exact - value) <= 4 * Fraction(math.ulp(float(value)))


def added(parts: list[Term]) -> Term:
    """A sum, numbers behind what else is added, what is taken away last."""
    return add(*sorted(parts, key=lambda part: 2 if is_negative(part) else 0 if part.free else 1))


def is_negative(term: Term) -> bool:
    return isinstance(term, Prim) and term.op == "neg"
