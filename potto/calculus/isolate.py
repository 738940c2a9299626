"""One step of undoing a builtin: from f(..., u, ...) = y to equations for u.

Owns the inverses that need more than the registry knows: operators, powers, `abs`, `hypot`, `min`, `max`, `clamp`,
`atan2`. Everything else comes from `Primitive.inverse` and `Primitive.period`. A step keeps the structure of what it
moves to the other side, so that (x - 0.5)^2 = t gives 0.5 ± sqrt(t) and no digits are lost by expanding.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from potto.calculus.ranges import range_of
from potto.core.terms import (
    ONE,
    PI,
    ZERO,
    Branch,
    Const,
    Prim,
    Term,
    add,
    branch,
    const,
    div,
    mul,
    neg,
    pow_,
    prim,
    sub,
)
from potto.primitives import PRIMITIVES

NAN = const(math.nan)
TWO = const(2.0)
HALF = const(0.5)


@dataclass(frozen=True, slots=True)
class Guard:
    """A root counts only where `surface` >= 0 (> 0 when strict). The surface may contain the variable solved for."""

    surface: Term
    strict: bool = False


@dataclass(frozen=True, slots=True)
class Step:
    """One equation `inner = value` that the step leads to. With `period` set, also value + k period for integers k."""

    inner: Term
    value: Term
    guards: tuple[Guard, ...] = ()
    period: Term | None = None


@dataclass(frozen=True, slots=True)
class Stuck:
    """Why a step is not possible, in the user's words."""

    reason: str


Steps = tuple[Step, ...] | Stuck


def step(term: Prim, index: int, value: Term) -> Steps:
    """The equations for argument `index` of a builtin, the only argument that contains the variable."""
    special = _SPECIAL.get(term.op)
    if special is not None:
        return special(term.args, index, value)
    return _registered(term.op, term.args, value)


def guarded(surface: Term, value: Term, strict: bool = False) -> Term:
    """`value` where surface >= 0 (> 0 when strict), else nan."""
    bounds = range_of(surface)
    if bounds.negative or (strict and bounds.hi <= 0):
        return NAN
    if bounds.positive or (not strict and bounds.lo >= 0):
        return value
    return branch((surface,), strict, value, NAN)


def signed(surface: Term, then: Term, orelse: Term) -> Term:
    """`then` where surface >= 0, else `orelse`; decided at once where the form of the surface shows its sign."""
    bounds = range_of(surface)
    if bounds.lo >= 0:
        return then
    return orelse if bounds.negative else branch((surface,), False, then, orelse)


def quotient(top: Term, below: Term) -> Term:
    """top / below with the signs in front."""
    if isinstance(below, Const) and below.value < 0:
        return quotient(minus(top), neg(below))
    if isinstance(below, Prim) and below.op == "neg":
        return quotient(minus(top), below.args[0])
    if isinstance(top, Prim) and top.op == "neg":
        return neg(div(top.args[0], below))
    return div(top, below)


def minus(term: Term) -> Term:
    """-term, with the sign inside a sum."""
    if isinstance(term, Prim) and term.op == "add":
        return add(*(neg(a) for a in term.args))
    if isinstance(term, Prim) and term.op == "div":
        return div(minus(term.args[0]), term.args[1])
    return neg(term)


# Roots


def square_root(value: Term) -> Term:
    """sqrt(value), with squares pulled out and a difference of squares as a product, which cancels less."""
    if isinstance(value, Const):
        return _constant_root(value)
    base = squared(value)
    if base is not None:
        return _size(base)
    if range_of(value).negative:
        return NAN
    if isinstance(value, Prim) and value.op == "div":
        below = squared(value.args[1])
        if below is not None:
            return div(square_root(value.args[0]), _size(below))
    if isinstance(value, Prim) and value.op == "mul":
        bases = [squared(f) if not isinstance(f, Const) else None for f in value.args]
        outside: list[Term] = [_size(b) for b in bases if b is not None]
        inside = [f for f, b in zip(value.args, bases, strict=True) if b is None]
        if outside:
            return mul(*outside, square_root(mul(*inside))) if inside else mul(*outside)
    return prim("sqrt", factored(value))


def _size(term: Term) -> Term:
    """abs(term), unless its form shows its sign."""
    bounds = range_of(term)
    if bounds.lo >= 0:
        return term
    return minus(term) if bounds.hi <= 0 else prim("abs", minus(term) if _is_neg(term) else term)


def _is_neg(term: Term) -> bool:
    return isinstance(term, Prim) and term.op == "neg"


def factored(value: Term) -> Term:
    """a^2 - b^2 as (a - b) (a + b)."""
    if isinstance(value, Prim) and value.op == "add" and len(value.args) == 2:
        first, second = value.args
        for plus, minus in ((first, second), (second, first)):
            a, b = squared(plus), squared(neg(minus))
            if a is not None and b is not None:
                return mul(sub(a, b), add(a, b))
    return value


def squared(value: Term) -> Term | None:
    """b with value = b^2, where that can be read off."""
    if isinstance(value, Prim):
        if value.op == "pow" and isinstance(value.args[1], Const) and value.args[1].value == 2:
            return value.args[0]
        if value.op == "mul" and len(value.args) == 2 and value.args[0] is value.args[1]:
            return value.args[0]
    if isinstance(value, Const) and value.value > 0 and value.name is None:
        root = math.sqrt(value.value)
        if root * root == value.value and root.is_integer():
            return const(root)
    return None


def _constant_root(value: Const) -> Term:
    root = math.sqrt(value.value) if value.value >= 0 else math.nan
    if root.is_integer() or value.value < 0:
        return const(root)
    return prim("sqrt", value)


def even_root(value: Term, n: int) -> Term:
    """The root >= 0 of u^n = value for an even n; nan where value < 0."""
    while n % 2 == 0:
        value, n = square_root(value), n // 2
    return value if n == 1 else pow_(value, div(ONE, const(n)))


def odd_root(value: Term, n: int) -> Term:
    """The real root of u^n = value for an odd n."""
    if n == 1 or value is ZERO:
        return value
    if isinstance(value, Const) and abs(value.value) == 1:
        return value
    if isinstance(value, Prim) and value.op == "neg":
        return neg(odd_root(value.args[0], n))
    exponent = div(ONE, const(n))
    return signed(value, prim("pow", value, exponent), neg(prim("pow", neg(value), exponent)))


# Operators


def _add(args: tuple[Term, ...], index: int, value: Term) -> Steps:
    return (Step(args[index], add(value, *(minus(a) for i, a in enumerate(args) if i != index))),)


def _neg(args: tuple[Term, ...], index: int, value: Term) -> Steps:
    return (Step(args[0], minus(value)),)


def _mul(args: tuple[Term, ...], index: int, value: Term) -> Steps:
    if value is ZERO:
        return (Step(args[index], ZERO),)
    return (Step(args[index], quotient(value, mul(*(a for i, a in enumerate(args) if i != index)))),)


def _div(args: tuple[Term, ...], index: int, value: Term) -> Steps:
    top, bottom = args
    if index == 0:
        return (Step(top, mul(value, bottom)),)
    return () if value is ZERO else (Step(bottom, quotient(top, value)),)


def _pow(args: tuple[Term, ...], index: int, value: Term) -> Steps:
    base, exponent = args
    if index == 1:
        if value is ZERO:
            return ()
        return (Step(exponent, div(prim("log", value), prim("log", base))),)
    if isinstance(exponent, Const):
        return _constant_power(base, exponent.value, value)
    return _symbolic_power(base, exponent, value)


def _constant_power(base: Term, power: float, value: Term) -> Steps:
    if power == 0 or not math.isfinite(power):
        return Stuck(f"a power of {power:g} does not determine its base")
    if power < 0:
        return () if value is ZERO else _constant_power(base, -power, div(ONE, value))
    if not power.is_integer():
        if value is ZERO:
            return (Step(base, ZERO),)
        back = 1 / power
        exponent = const(back) if back.is_integer() else div(ONE, const(power))
        return (Step(base, pow_(guarded(value, value), exponent)),)
    if int(power) % 2:
        return (Step(base, odd_root(value, int(power))),)
    if value is ZERO:
        return (Step(base, ZERO),)
    root = even_root(value, int(power))
    return (Step(base, neg(root)), Step(base, root))


def _symbolic_power(base: Term, exponent: Term, value: Term) -> Steps:
    """u^p = y for a p known at run time only: the positive root, and negative ones where p is an integer."""
    if value is ZERO:
        return (Step(base, guarded(exponent, ZERO, strict=True)),)
    inverse = div(ONE, exponent)
    up = prim("pow", value, inverse)
    down, odd = neg(up), neg(prim("pow", neg(value), inverse))
    # (-u)^p is nan unless p is an integer, and has the sign of y for an even p only (for an odd p when y < 0).
    return (
        Step(base, guarded(value, up)),
        Step(base, guarded(mul(prim("pow", down, exponent), value), down, strict=True)),
        Step(base, guarded(mul(prim("pow", odd, exponent), value), odd, strict=True)),
    )


# Builtins that need more than one inverse


def _abs(args: tuple[Term, ...], index: int, value: Term) -> Steps:
    if value is ZERO:
        return (Step(args[0], ZERO),)
    root = guarded(value, value)
    return (Step(args[0], neg(root)), Step(args[0], root))


def _sqrt(args: tuple[Term, ...], index: int, value: Term) -> Steps:
    if value is ZERO:
        return (Step(args[0], ZERO),)
    if isinstance(value, Prim) and value.op == "sqrt":
        return (Step(args[0], value.args[0], (Guard(value.args[0]),)),)
    return (Step(args[0], guarded(value, pow_(value, TWO))),)


def _exp(args: tuple[Term, ...], index: int, value: Term) -> Steps:
    if value is ZERO or range_of(value).hi <= 0:
        return ()
    if isinstance(value, Prim) and value.op == "exp":
        return (Step(args[0], value.args[0]),)
    return (Step(args[0], ZERO if value is ONE else prim("log", value)),)


def _log(args: tuple[Term, ...], index: int, value: Term) -> Steps:
    if isinstance(value, Prim) and value.op == "log":
        return (Step(args[0], value.args[0], (Guard(value.args[0], strict=True),)),)
    return (Step(args[0], ONE if value is ZERO else prim("exp", value)),)


def _hypot(args: tuple[Term, ...], index: int, value: Term) -> Steps:
    other = args[1 - index]
    root = guarded(value, prim("sqrt", mul(sub(value, other), add(value, other))))
    return (Step(args[index], neg(root)), Step(args[index], root))


def _extreme(sign: Callable[[Term], Term]) -> Callable[[tuple[Term, ...], int, Term], Steps]:
    def run(args: tuple[Term, ...], index: int, value: Term) -> Steps:
        guards = tuple(Guard(sign(sub(value, a))) for i, a in enumerate(args) if i != index)
        return (Step(args[index], value, guards),)

    return run


def _clamp(args: tuple[Term, ...], index: int, value: Term) -> Steps:
    x, lo, hi = args
    if index == 0:
        return (Step(x, value, (Guard(sub(value, lo), True), Guard(sub(hi, value), True))),)
    if index == 1:
        return (Step(lo, value, (Guard(sub(value, x)), Guard(sub(hi, value), True))),)
    return (Step(hi, value, (Guard(sub(x, value)), Guard(sub(value, lo), True))),)


def _atan2(args: tuple[Term, ...], index: int, value: Term) -> Steps:
    y, x = args
    within = (Guard(sub(PI, value)), Guard(add(PI, value)))
    if index == 0:
        if value is ZERO:
            return (Step(y, ZERO, (Guard(x, True),)),)
        return (Step(y, mul(x, prim("tan", value)), (*within, Guard(mul(x, prim("cos", value)), True))),)
    if value is ZERO:
        return ()
    return (Step(x, div(y, prim("tan", value)), (*within, Guard(mul(y, prim("sin", value)), True))),)


def _registered(op: str, args: tuple[Term, ...], value: Term) -> Steps:
    """Through the registry: a builtin of one argument that has an inverse."""
    entry = PRIMITIVES.get(op)
    if entry is None or len(args) != 1:
        return Stuck(f"`{op}` has no inverse")
    (inner,) = args
    one_to_one = entry.increasing != 0
    if one_to_one and isinstance(value, Prim) and value.op == op and not entry.edges(inner):
        return (Step(inner, value.args[0]),)
    if value is ZERO and op in _ODD:
        return (Step(inner, ZERO, (), entry.period(value)[0] if entry.period else None),)
    if entry.inverse is None:
        return Stuck(f"`{op}` has no inverse in closed form")
    solutions = tuple(_folded(s) for s in entry.inverse(value))
    if entry.period is None:
        return tuple(Step(inner, s) for s in solutions)
    period, further = entry.period(value)
    return tuple(Step(inner, s, (), period) for s in (*solutions, *further))


def _folded(term: Term) -> Term:
    """A solution with the guards that the form of the value decides taken off."""
    while isinstance(term, Branch):
        bounds = range_of(term.surface)
        if bounds.positive or (bounds.lo >= 0 and not term.strict):
            term = term.then
        elif bounds.negative or (bounds.hi <= 0 and term.strict):
            term = term.orelse
        else:
            break
    return term


def _turn(start: Term) -> Callable[[tuple[Term, ...], int, Term], Steps]:
    """sin u = 0 and cos u = 0 have one root in half a period, which is better than two in a whole one."""

    def run(args: tuple[Term, ...], index: int, value: Term) -> Steps:
        if value is ZERO:
            return (Step(args[0], start, (), PI),)
        return _registered("sin" if start is ZERO else "cos", args, value)

    return run


# Builtins with f(0) = 0, and nowhere else within a period.
_ODD = frozenset(("erf", "sinh", "tanh", "asinh", "atanh", "atan", "asin", "tan", "expm1", "log1p"))

_SPECIAL: dict[str, Callable[[tuple[Term, ...], int, Term], Steps]] = {
    "add": _add,
    "neg": _neg,
    "mul": _mul,
    "div": _div,
    "pow": _pow,
    "abs": _abs,
    "sqrt": _sqrt,
    "exp": _exp,
    "sin": _turn(ZERO),
    "cos": _turn(div(PI, TWO)),
    "log": _log,
    "hypot": _hypot,
    "max": _extreme(lambda gap: gap),
    "min": _extreme(neg),
    "clamp": _clamp,
    "atan2": _atan2,
}
