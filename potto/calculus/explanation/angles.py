"""Sines and cosines at the roots of periodic conditions, and lengths.

Owns `at_angle` and `length`. Roots are found as multiples of pi beside an inverse function, so that a formula
asks for cos(asin(t) + 2*pi*k), which is sqrt(1 - t^2).
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from potto.calculus.algebra.rational_form import normal
from potto.calculus.explanation.brackets import constant
from potto.calculus.explanation.factors import Factors
from potto.calculus.explanation.products import written
from potto.core.terms import ONE, PI, TWO, ZERO, Prim, Term, Var, add, const, div, mul, neg, pow_, prim, sub

_HALF = Fraction(1, 2)
_SIXTH, _QUARTER = Fraction(1, 6), Fraction(1, 4)
_TABLE = {  # multiples of pi
    "asin": {Fraction(0): Fraction(0), _HALF: _SIXTH, -_HALF: -_SIXTH, Fraction(1): _HALF, Fraction(-1): -_HALF},
    "acos": {Fraction(0): _HALF, _HALF: 2 * _SIXTH, -_HALF: 4 * _SIXTH, Fraction(1): Fraction(0),
             Fraction(-1): Fraction(1)},
    "atan": {Fraction(0): Fraction(0), Fraction(1): _QUARTER, Fraction(-1): -_QUARTER},
}  # fmt: skip


def at_angle(node: Prim, integers: frozenset[str]) -> Term:
    """The sine, cosine or tangent of an angle without turns, and an angle that everybody knows as a part of pi;
    `integers`: variables that are whole numbers."""
    if node.op in _TABLE:
        known = constant(node.args[0])
        part = None if known is None else _TABLE[node.op].get(known)
        return node if part is None else _of_pi(part)
    if node.op == "atan2":
        return _direction(*node.args) or node
    if node.op not in ("sin", "cos", "tan"):
        return node
    quarters, turns, rest = _turned(node.args[0], integers)
    if node.op == "tan":
        whole = _same("tan", rest) if quarters % 2 == 0 else None
    else:
        op, sign = _SHIFTED[node.op, quarters % 4]
        value = _turned_by_an_eighth(op, rest) or _same(op, rest)
        whole = mul(*(pow_(const(-1.0), turn) for turn in turns), neg(value) if sign < 0 else value)
    return node if whole is None else whole


_SHIFTED = {
    ("sin", 0): ("sin", 1), ("sin", 1): ("cos", 1), ("sin", 2): ("sin", -1), ("sin", 3): ("cos", -1),
    ("cos", 0): ("cos", 1), ("cos", 1): ("sin", -1), ("cos", 2): ("cos", -1), ("cos", 3): ("sin", 1),
}  # fmt: skip


def _turned(angle: Term, integers: frozenset[str]) -> tuple[int, list[Term], Term]:
    """An angle as so many quarters of a turn, half turns by whole numbers, and the rest."""
    found = normal(angle)
    if found is None or not found.whole:
        return 0, [], angle
    quarters, turns, rest = 0, list[Term](), dict(found.top)
    for monomial, scale in found.top.items():
        names = [(atom, n) for atom, n in monomial if atom is not PI]
        whole = all(isinstance(a, Var) and a.name in integers and n > 0 for a, n in names)
        if dict(monomial).get(PI) != 1 or not whole:
            continue
        if not names and Fraction(4 * scale).denominator == 1:
            quarters += round(float(2 * scale))
            left = Fraction(scale) - Fraction(round(float(2 * scale)), 2)
            if left:
                rest[monomial] = left
                continue
        elif names and Fraction(scale).denominator == 1:
            turns += [mul(*(pow_(a, const(float(n))) for a, n in names))] if int(scale) % 2 else []
        else:
            continue
        del rest[monomial]
    if rest == found.top:
        return 0, [], angle
    return quarters, turns, add(*(written(Factors(Fraction(c), dict(m)), frozenset()) for m, c in rest.items()))


def _turned_by_an_eighth(op: str, angle: Term) -> Term | None:
    """The sine or cosine of an angle that is known by one of them and is turned by pi/4."""
    match angle:
        case Prim(op="add", args=(inner, turn)) if not turn.free:
            part = normal(div(mul(const(4.0), turn), PI))
        case Prim(op="add", args=(turn, inner)) if not turn.free:
            part = normal(div(mul(const(4.0), turn), PI))
        case _:
            return None
    if part is None or not part.whole or part.top not in ({(): 1}, {(): -1}):
        return None
    size = inner.args[0] if isinstance(inner, Prim) and inner.op == "neg" else inner
    if not isinstance(size, Prim) or (op, size.op) not in _KNOWN:
        return None
    sin, cos = _same("sin", inner), _same("cos", inner)
    turned = cos if op == "sin" else neg(sin)
    return div(add(sin if op == "sin" else cos, turned if part.top[()] == 1 else neg(turned)), prim("sqrt", TWO))


def _same(op: str, angle: Term) -> Term:
    """sin, cos or tan of an angle that is known by one of them."""
    if angle is ZERO:
        return ONE if op == "cos" else ZERO
    if isinstance(angle, Prim) and angle.op == "neg":
        inner = _same(op, angle.args[0])
        return inner if op == "cos" else neg(inner)
    if isinstance(angle, Prim) and (op, angle.op) in _KNOWN:
        return _KNOWN[op, angle.op](angle.args[0])
    return prim(op, angle)


def _other(u: Term) -> Term:
    return prim("sqrt", sub(ONE, pow_(u, TWO)))


def _longest(u: Term) -> Term:
    return prim("sqrt", add(ONE, pow_(u, TWO)))


def _itself(u: Term) -> Term:
    return u


_KNOWN: dict[tuple[str, str], Callable[[Term], Term]] = {
    ("sin", "asin"): _itself, ("cos", "acos"): _itself, ("tan", "atan"): _itself,
    ("cos", "asin"): _other, ("sin", "acos"): _other,
    ("cos", "atan"): lambda u: div(ONE, _longest(u)), ("sin", "atan"): lambda u: div(u, _longest(u)),
}  # fmt: skip


def _direction(y: Term, x: Term) -> Term | None:
    """atan2 of numbers along an axis or a diagonal."""
    a, b = constant(y), constant(x)
    if a is None or b is None or (a == b == 0) or (a and b and abs(a) != abs(b)):
        return None
    if not a or not b:
        part = _HALF * (1 if a > 0 else -1) if a else Fraction(0 if b > 0 else 1)
    else:
        part = (_QUARTER if b > 0 else 3 * _QUARTER) * (1 if a > 0 else -1)
    return _of_pi(part)


def _of_pi(part: Fraction) -> Term:
    if not part:
        return ZERO
    whole = div(mul(const(float(abs(part.numerator))), PI), const(float(part.denominator)))
    return neg(whole) if part < 0 else whole


def length(node: Prim) -> Term:
    """hypot(x, -y) as hypot(x, y), and the length of (x, sqrt(r^2 - x^2)) as abs(r)."""
    sides = tuple(a.args[0] if isinstance(a, Prim) and a.op == "neg" else a for a in node.args)
    found = normal(add(*(mul(a, a) for a in sides)))
    if found is not None and found.whole and len(found.top) == 1:
        ((monomial, scale),) = found.top.items()
        if not monomial:
            return prim("sqrt", const(float(scale)))
        if scale == 1 and all(n % 2 == 0 for _, n in monomial):
            return prim("abs", mul(*(pow_(a, const(n / 2)) for a, n in monomial)))
    return prim("hypot", *sides)
