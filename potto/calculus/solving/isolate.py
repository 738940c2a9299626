"""One step of undoing a builtin: from f(..., u, ...) = y to equations for u.

Owns the inverses that need more than the registry knows: operators, powers, `abs`, `hypot`, `min`, `max`, `clamp`,
`atan2`. Everything else comes from `Primitive.inverse` and `Primitive.period`, or from the formula of a builtin. A step
keeps the structure of what it moves to the other side, so that (x - 0.5)^2 = t gives 0.5 ± sqrt(t) and no digits are
lost by expanding.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from msgspec import Struct

from potto.calculus.algebra.radicals import even_root, guarded, minus, odd_root, quotient
from potto.calculus.algebra.ranges import range_of
from potto.core.terms import (
    ONE,
    PI,
    TWO,
    ZERO,
    Branch,
    Const,
    Prim,
    Term,
    add,
    children,
    const,
    div,
    mul,
    neg,
    postorder,
    pow_,
    prim,
    sub,
    substitute,
    var,
)
from potto.primitives import PRIMITIVES
from potto.primitives.walking import formula_of


class Guard(Struct, frozen=True):
    """A root counts only where `surface` >= 0 (> 0 when strict). The surface may contain the variable solved for."""

    surface: Term
    strict: bool = False


class IsolationStep(Struct, frozen=True):
    """One equation `inner = value` that the step leads to. With `period` set, also value + k period for integers k."""

    inner: Term
    value: Term
    guards: tuple[Guard, ...] = ()
    period: Term | None = None


class Stuck(Struct, frozen=True):
    """Why a step is not possible, in the user's words."""

    reason: str


Steps = tuple[IsolationStep, ...] | Stuck


def step(term: Prim, index: int, value: Term) -> Steps:
    """The equations for argument `index` of a builtin, the only argument that contains the variable."""
    special = _SPECIAL.get(term.op)
    if special is not None:
        return special(term.args, index, value)
    return _registered(term.op, term.args, index, value)


# Operators


def _add(args: tuple[Term, ...], index: int, value: Term) -> Steps:
    return (IsolationStep(args[index], add(value, *(minus(a) for i, a in enumerate(args) if i != index))),)


def _neg(args: tuple[Term, ...], index: int, value: Term) -> Steps:
    return (IsolationStep(args[0], minus(value)),)


def _mul(args: tuple[Term, ...], index: int, value: Term) -> Steps:
    if value is ZERO:
        return (IsolationStep(args[index], ZERO),)
    return (IsolationStep(args[index], quotient(value, mul(*(a for i, a in enumerate(args) if i != index)))),)


def _div(args: tuple[Term, ...], index: int, value: Term) -> Steps:
    top, bottom = args
    if index == 0:
        return (IsolationStep(top, mul(value, bottom)),)
    return () if value is ZERO else (IsolationStep(bottom, quotient(top, value)),)


def _pow(args: tuple[Term, ...], index: int, value: Term) -> Steps:
    base, exponent = args
    if index == 1:
        if value is ZERO:
            return ()
        return (IsolationStep(exponent, div(prim("log", value), prim("log", base))),)
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
            return (IsolationStep(base, ZERO),)
        back = 1 / power
        exponent = const(back) if back.is_integer() else div(ONE, const(power))
        return (IsolationStep(base, pow_(guarded(value, value), exponent)),)
    if int(power) % 2:
        return (IsolationStep(base, odd_root(value, int(power))),)
    if value is ZERO:
        return (IsolationStep(base, ZERO),)
    root = even_root(value, int(power))
    return (IsolationStep(base, neg(root)), IsolationStep(base, root))


def _symbolic_power(base: Term, exponent: Term, value: Term) -> Steps:
    """u^p = y for a p known at run time only: the positive root, and negative ones where p is an integer."""
    if value is ZERO:
        return (IsolationStep(base, guarded(exponent, ZERO, strict=True)),)
    inverse = div(ONE, exponent)
    up = prim("pow", value, inverse)
    down, odd = neg(up), neg(prim("pow", neg(value), inverse))
    # (-u)^p is nan unless p is an integer, and has the sign of y for an even p where y > 0, for an odd p where y < 0.
    down = guarded(mul(prim("pow", down, exponent), value), down, strict=True)
    odd = guarded(mul(prim("pow", odd, exponent), value), odd, strict=True)
    return (
        IsolationStep(base, guarded(value, up)),
        IsolationStep(base, guarded(value, down, strict=True)),
        IsolationStep(base, guarded(neg(value), odd, strict=True)),
    )


# Builtins that need more than one inverse


def _abs(args: tuple[Term, ...], index: int, value: Term) -> Steps:
    if value is ZERO:
        return (IsolationStep(args[0], ZERO),)
    root = guarded(value, value)
    return (IsolationStep(args[0], neg(root)), IsolationStep(args[0], root))


def _sqrt(args: tuple[Term, ...], index: int, value: Term) -> Steps:
    if value is ZERO:
        return (IsolationStep(args[0], ZERO),)
    if isinstance(value, Prim) and value.op == "sqrt":
        return (IsolationStep(args[0], value.args[0], (Guard(value.args[0]),)),)
    return (IsolationStep(args[0], guarded(value, pow_(value, TWO))),)


def _exp(args: tuple[Term, ...], index: int, value: Term) -> Steps:
    if value is ZERO or range_of(value).hi <= 0:
        return ()
    if isinstance(value, Prim) and value.op == "exp":
        return (IsolationStep(args[0], value.args[0]),)
    return (IsolationStep(args[0], ZERO if value is ONE else prim("log", value)),)


def _log(args: tuple[Term, ...], index: int, value: Term) -> Steps:
    if isinstance(value, Prim) and value.op == "log":
        return (IsolationStep(args[0], value.args[0], (Guard(value.args[0], strict=True),)),)
    return (IsolationStep(args[0], ONE if value is ZERO else prim("exp", value)),)


def _hypot(args: tuple[Term, ...], index: int, value: Term) -> Steps:
    other = args[1 - index]
    root = guarded(value, prim("sqrt", mul(sub(value, other), add(value, other))))
    return (IsolationStep(args[index], neg(root)), IsolationStep(args[index], root))


def _extreme(sign: Callable[[Term], Term]) -> Callable[[tuple[Term, ...], int, Term], Steps]:
    def run(args: tuple[Term, ...], index: int, value: Term) -> Steps:
        guards = tuple(Guard(sign(sub(value, a))) for i, a in enumerate(args) if i != index)
        return (IsolationStep(args[index], value, guards),)

    return run


def _clamp(args: tuple[Term, ...], index: int, value: Term) -> Steps:
    x, lo, hi = args
    if index == 0:
        return (IsolationStep(x, value, (Guard(sub(value, lo), True), Guard(sub(hi, value), True))),)
    if index == 1:
        return (IsolationStep(lo, value, (Guard(sub(value, x)), Guard(sub(hi, value), True))),)
    return (IsolationStep(hi, value, (Guard(sub(x, value)), Guard(sub(value, lo), True))),)


def _atan2(args: tuple[Term, ...], index: int, value: Term) -> Steps:
    y, x = args
    within = (Guard(sub(PI, value)), Guard(add(PI, value)))
    if index == 0:
        if value is ZERO:
            return (IsolationStep(y, ZERO, (Guard(x, True),)),)
        return (IsolationStep(y, mul(x, prim("tan", value)), (*within, Guard(mul(x, prim("cos", value)), True))),)
    if value is ZERO:
        return ()
    return (IsolationStep(x, div(y, prim("tan", value)), (*within, Guard(mul(y, prim("sin", value)), True))),)


def _registered(op: str, args: tuple[Term, ...], index: int, value: Term) -> Steps:
    """Through the registry: a builtin of one argument that has an inverse."""
    entry = PRIMITIVES.get(op)
    written = _written_out(op, args, index)
    if written is not None:
        return (IsolationStep(written, value),)
    if entry is None or len(args) != 1:
        return Stuck(f"`{op}` has no inverse")
    (inner,) = args
    if value is ZERO and entry.roots == ():
        return ()
    one_to_one = entry.increasing != 0
    if one_to_one and isinstance(value, Prim) and value.op == op and not entry.edges(inner):
        return (IsolationStep(inner, value.args[0]),)
    if value is ZERO and entry.roots == (0.0,):
        return (IsolationStep(inner, ZERO, (), entry.period(value)[0] if entry.period else None),)
    if entry.inverse is None:
        return Stuck(f"`{op}` has no inverse in closed form")
    solutions = tuple(_folded(s) for s in entry.inverse(value))
    if entry.period is None:
        return tuple(IsolationStep(inner, s) for s in solutions)
    period, further = entry.period(value)
    return tuple(IsolationStep(inner, s, (), period) for s in (*solutions, *further))


def _written_out(op: str, args: tuple[Term, ...], index: int) -> Term | None:
    """The formula of a builtin without an inverse of its own, if the argument stands in it once."""
    entry = PRIMITIVES.get(op)
    if entry is None or entry.formula is None or entry.inverse is not None:
        return None
    whole, names = formula_of(op, len(args))
    uses = sum(part is var(names[index]) for node in postorder(whole) for part in children(node))
    return substitute(whole, dict(zip(names, args, strict=True))) if uses == 1 else None


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
            return (IsolationStep(args[0], start, (), PI),)
        return _registered("sin" if start is ZERO else "cos", args, 0, value)

    return run


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
