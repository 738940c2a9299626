"""Smart constructors of arithmetic.

Owns `add`, `sub`, `mul`, `div`, `neg`, `pow_` and `apply`. They fold constants where the result is exact, drop neutral
elements and flatten; they never reorder operands and never change where a term is defined or which value it takes.
"""

from __future__ import annotations

import math
from typing import Any, TypeGuard

from potto.core.term_kinds import ONE, ZERO, Const, Prim, Term, const, prim

LONGEST = 1000


def _exact_integer(value: float) -> bool:
    return value.is_integer() and abs(value) < 2.0**53


def _flattens(arg: Term, op: str) -> TypeGuard[Prim]:
    """Whether the operands of `arg` join those around it. Long ones stay apart: x*x of a shared x would double them."""
    return isinstance(arg, Prim) and arg.op == op and len(arg.args) <= LONGEST


def add(*args: Term) -> Term:
    """The sum; flattened, zeros dropped, integers added up (exactly)."""
    terms: list[Term] = []
    total = 0.0
    for arg in args:
        for term in arg.args if _flattens(arg, "add") else (arg,):
            if isinstance(term, Const) and _exact_integer(term.value) and _exact_integer(total + term.value):
                total += term.value
            else:
                terms.append(term)
    if total:
        terms.append(const(total))
    if not terms:
        return ZERO
    return terms[0] if len(terms) == 1 else prim("add", *terms)


def neg(arg: Term) -> Term:
    if isinstance(arg, Const) and arg.name is None:
        return const(-arg.value)
    if isinstance(arg, Prim) and arg.op == "neg":
        return arg.args[0]
    return prim("neg", arg)


def sub(a: Term, b: Term) -> Term:
    if a is b and not isinstance(a, Const):
        return prim("add", a, neg(b))  # x - x is not 0 where x is not finite; `simplify` may decide
    return add(a, neg(b))


def mul(*args: Term) -> Term:
    """The product; flattened, ones dropped, integers multiplied (exactly). A factor 0 makes it 0."""
    factors: list[Term] = []
    total, sign = 1.0, 1
    for arg in args:
        for term in arg.args if _flattens(arg, "mul") else (arg,):
            if isinstance(term, Prim) and term.op == "neg":
                sign, term = -sign, term.args[0]
            if isinstance(term, Const) and _exact_integer(term.value) and _exact_integer(total * term.value):
                total *= term.value
            else:
                factors.append(term)
    if total == 0:
        return ZERO
    if total != 1:
        factors.insert(0, const(abs(total)))
        sign = -sign if total < 0 else sign
    if total == -1:
        factors.pop(0)
    if not factors:
        return const(sign)
    product = factors[0] if len(factors) == 1 else prim("mul", *factors)
    return product if sign > 0 else neg(product)


def div(a: Term, b: Term) -> Term:
    if b is ONE:
        return a
    if (
        isinstance(a, Const)
        and isinstance(b, Const)
        and _exact_integer(a.value)
        and _exact_integer(b.value)
        and b.value
    ):
        quotient = a.value / b.value
        if math.frexp(b.value)[0] in (0.5, -0.5) or quotient.is_integer():
            return const(quotient)
    return prim("div", a, b)


def pow_(base: Term, exponent: Term) -> Term:
    if exponent is ONE:
        return base
    if isinstance(base, Const) and isinstance(exponent, Const):
        whole = _exact_integer(base.value) and exponent.value.is_integer() and 0 <= exponent.value <= 64
        if whole and abs(base.value) ** exponent.value < 2.0**53:
            return const(base.value**exponent.value)
    return prim("pow", base, exponent)


def apply(op: str, *args: Term) -> Term:
    """A builtin, folded where one of the folding constructors exists for it."""
    fold = _FOLDING.get(op)
    return prim(op, *args) if fold is None else fold(*args)


_FOLDING: dict[str, Any] = {"add": add, "mul": mul, "neg": neg, "div": div, "pow": pow_}
