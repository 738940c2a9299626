"""Where a term's values can lie while its variables run through discs of the complex plane.

Owns `Form` and `enclosed`. A form is `m + sum_i g_i s_i + rest`, over symbols `|s_i| <= h_i` of the complex plane, with
`|rest| <= r`: affine arithmetic (Comba and Stolfi 1993) with complex symbols, so that what the same variable does in
two places cancels to first order. An analytic function f adds to r what its Taylor series at m has beyond the linear
term, with every coefficient replaced by its magnitude. What is not shown to be analytic has the form with r = inf.

The arithmetic is that of doubles, not rounded outwards: a bound that is large enough to matter is 1e-13 of it off at
the most, and quotients and roots are only taken where the disc stays 5 % clear of the singularity.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from potto.core.terms import Const, Prim, Term, Var, postorder, var
from potto.kernels.cells import Array
from potto.kernels.support import ARRAYS, OPS
from potto.primitives import PRIMITIVES, Primitive
from potto.primitives.bounds import share, slack
from potto.primitives.walking import Domain

HIGHEST_POWER = 64


class Form:
    """One quantity at N probes: centre m (N,), slopes g (S, N) or None for 0, rest r (N,); h (S, N) are the radii."""

    __slots__ = ("g", "h", "m", "r", "spread")

    def __init__(self, m: Any, g: Array | None, r: Any, h: Array) -> None:
        self.m, self.g, self.r, self.h = m, g, r, h
        self.spread = r if g is None else r + (np.abs(g) * h).sum(axis=0)

    @property
    def most(self) -> Any:
        """A bound of the magnitude; inf where there is none."""
        size = np.abs(self.m) + self.spread
        return np.where(np.isfinite(size), size, np.inf)

    def __add__(self, other: Form) -> Form:
        g = other.g if self.g is None else self.g if other.g is None else self.g + other.g
        return Form(self.m + other.m, g, self.r + other.r, self.h)

    def __neg__(self) -> Form:
        return Form(-self.m, None if self.g is None else -self.g, self.r, self.h)

    def __sub__(self, other: Form) -> Form:
        return self + -other

    def scaled(self, factor: float) -> Form:
        return Form(self.m * factor, None if self.g is None else self.g * factor, self.r * abs(factor), self.h)

    def __mul__(self, other: Form) -> Form:
        for a, b in ((self, other), (other, self)):
            if b.g is None and b.r.__class__ is float and b.r == 0.0 and b.m.__class__ is float:
                return a.scaled(b.m)
        parts = [m * g for m, g in ((self.m, other.g), (other.m, self.g)) if g is not None]
        g = None if not parts else parts[0] if len(parts) == 1 else parts[0] + parts[1]
        r = np.abs(self.m) * other.r + np.abs(other.m) * self.r + self.spread * other.spread
        return Form(self.m * other.m, g, r, self.h)

    def through(self, value: Any, slope: Any, beyond: Any) -> Form:
        """f of the form, from f and f' at the centre and a bound of what f has beyond the linear term."""
        g = None if self.g is None else slope * self.g
        r = np.abs(slope) * self.r + beyond
        return Form(value, g, np.where(np.isfinite(r) & np.isfinite(value), r, np.inf), self.h)


def _inverse(x: Form) -> Form:
    q, one = share(OPS, x.m, x.spread), np.divide(1.0, x.m)
    return x.through(one, -one * one, np.abs(one) * q * q / (1 - q))


def _power(x: Form, power: Form) -> Form:
    """By the binomial series, whose coefficients are those of (1 - q)^a or (1 + q)^a without their signs."""
    exponent = power.m  # a constant
    if exponent == int(exponent) and 0 <= exponent <= HIGHEST_POWER:
        return _repeated(x, int(exponent))
    if exponent == int(exponent) and -HIGHEST_POWER <= exponent < 0:
        a, m = exponent, x.m
        q: Any = share(OPS, m, x.spread)
        value, beyond = np.power(m, a), np.power(1 - q, a) - 1 + a * q + slack(q) * abs(a)
        return x.through(value, a * np.divide(value, m), np.abs(value) * beyond)
    return _exp(DISCS.apply("log", (x,)).scaled(exponent))


def _repeated(x: Form, exponent: int) -> Form:
    result: Form | None = None
    while exponent:
        if exponent & 1:
            result = x if result is None else result * x
        x, exponent = x * x if exponent > 1 else x, exponent >> 1
    return Form(1.0, None, 0.0, x.h) if result is None else result


@lru_cache(maxsize=4096)
def enclosable(term: Term) -> bool:
    """Whether `enclosed` knows everything that a term is made of."""
    return all(map(known_to_discs, postorder(term)))


@lru_cache(maxsize=4096)
def known_to_discs(node: Term) -> bool:
    """Whether `enclosed` knows what a term does with its parts."""
    match node:
        case Const() | Var():
            return True
        case Prim(op="pow"):
            return not node.args[1].free
        case Prim():
            return DISCS.knows(node.op)
    return False


def enclosed(terms: Sequence[Term], env: Mapping[str, Form], known: dict[Term, Form], h: Array) -> list[Form]:
    """The forms of terms whose variables have those of `env`; `known` has what was worked out before, and grows."""
    return Discs(h).walk(terms, env, known)


class Discs(Domain[Form]):
    """Forms over symbols with the radii h: arithmetic as below, every other builtin by its series."""

    def __init__(self, h: Array) -> None:
        self.h = h

    def constant(self, node: Const) -> Form:
        return Form(float(node.value), None, 0.0, self.h)

    def unknown(self) -> Form:
        return Form(np.nan, None, np.inf, self.h)

    def builtin(self, node: Prim, known: Mapping[Term, Form]) -> Form:
        return self.quotient(node, known) if node.op == "div" else super().builtin(node, known)

    def rule(self, entry: Primitive) -> Callable[..., Form] | None:
        return _ARITHMETIC.get(entry.name) or _series(entry.name)

    def quotient(self, node: Prim, known: Mapping[Term, Form]) -> Form:
        over, under = node.args
        if isinstance(under, Const):
            return known[over].scaled(1.0 / under.value if under.value else np.nan)
        return known[over] * self.reciprocal(under, known)

    def reciprocal(self, term: Term, known: Mapping[Term, Form]) -> Form:
        """1/term, factor by factor: the disc of a square comes nearer to 0 than that of what is squared."""
        match term:
            case Prim(op="pow", args=(base, Const(value=exponent))):
                return _power(known[base], Form(float(-exponent), None, 0.0, self.h))
            case Prim(op="mul"):
                first, *rest = (self.reciprocal(a, known) for a in term.args)
                return _product(first, *rest)
            case Prim(op="exp"):
                return _exp(-known[term.args[0]])
            case _:
                return _inverse(known[term])


DISCS = Discs(np.zeros((1, 1)))


@lru_cache(maxsize=256)
def _series(op: str) -> Callable[..., Form] | None:
    """A builtin by its value, its slope and the remainder of its series."""
    entry = PRIMITIVES[op]
    remainder = entry.remainder
    if remainder is None or entry.partials is None:
        return None
    names = tuple(f"#{i}" for i in range(entry.orders + 1))
    f, slope = ARRAYS.function(op), entry.partials(*map(var, names))[-1]

    def run(*args: Form) -> Form:
        *orders, x = args
        at = [order.m for order in orders]
        (steep,) = ARRAYS.walk((slope,), dict(zip(names, (*at, x.m), strict=True)), {})
        return x.through(f(*at, x.m), steep, remainder(OPS, *at, x.m, x.spread))

    return run


def _exp(x: Form) -> Form:
    return DISCS.apply("exp", (x,))


def _sum(first: Form, *rest: Form) -> Form:
    for form in rest:
        first = first + form
    return first


def _product(first: Form, *rest: Form) -> Form:
    for form in rest:
        first = first * form
    return first


_ARITHMETIC: dict[str, Callable[..., Form]] = {
    "add": _sum,
    "mul": _product,
    "neg": lambda x: -x,
    "div": lambda a, b: a * _inverse(b),
    "pow": _power,
}
