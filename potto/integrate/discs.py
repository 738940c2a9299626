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

from potto.core.terms import Const, Prim, Term, Var, postorder
from potto.kernels.cells import Array

# How near to a singularity of a function a disc may come, as a part of its centre's distance from it.
NEAREST = 0.95
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

    def share(self) -> Any:
        """How far the disc reaches, as a part of its centre's distance from 0; nan where it comes too near to it."""
        q = np.divide(self.spread, np.abs(self.m))
        return np.where(q <= NEAREST, q, np.nan)


def _inverse(x: Form) -> Form:
    q, one = x.share(), np.divide(1.0, x.m)
    return x.through(one, -one * one, np.abs(one) * q * q / (1 - q))


def _exp(x: Form) -> Form:
    e, d = np.exp(x.m), x.spread
    return x.through(e, e, e * (np.expm1(d) - d + _slack(d)))


def _slack(d: Any) -> Any:
    """More than the rounding of a difference of numbers of the size of d, where d is small: d^2 of the last places."""
    return 1e-15 * d + 1e-15 * d * d


def _expm1(x: Form) -> Form:
    e, d = np.exp(x.m), x.spread
    return x.through(np.expm1(x.m), e, e * (np.expm1(d) - d + _slack(d)))


def _sqrt(x: Form) -> Form:
    q, root = x.share(), np.sqrt(x.m)
    return x.through(root, np.divide(0.5, root), root * (1 - 0.5 * q - np.sqrt(1 - q) + _slack(q)))


def _log(x: Form) -> Form:
    q = x.share()
    return x.through(np.log(x.m), np.divide(1.0, x.m), -np.log1p(-q) - q + _slack(q))


def _log1p(x: Form) -> Form:
    return _log(x + Form(1.0, None, 0.0, x.h))


def _even_and_odd(d: Any) -> tuple[Any, Any]:
    """cosh d - 1 and sinh d - d."""
    half = np.sinh(0.5 * d)
    return 2 * half * half, np.sinh(d) - d + _slack(d)


def _sin(x: Form) -> Form:
    s, c = np.sin(x.m), np.cos(x.m)
    even, odd = _even_and_odd(x.spread)
    return x.through(s, c, np.abs(s) * even + np.abs(c) * odd)


def _cos(x: Form) -> Form:
    s, c = np.sin(x.m), np.cos(x.m)
    even, odd = _even_and_odd(x.spread)
    return x.through(c, -s, np.abs(c) * even + np.abs(s) * odd)


def _sinh(x: Form) -> Form:
    s, c = np.sinh(x.m), np.cosh(x.m)
    even, odd = _even_and_odd(x.spread)
    return x.through(s, c, np.abs(s) * even + c * odd)


def _cosh(x: Form) -> Form:
    s, c = np.sinh(x.m), np.cosh(x.m)
    even, odd = _even_and_odd(x.spread)
    return x.through(c, s, c * even + np.abs(s) * odd)


def _atan(x: Form) -> Form:
    """By the second derivative -2z/(1 + z^2)^2, bounded on the disc, whose distance from i and -i is `clear`."""
    far = np.hypot(x.m, 1.0)
    clear = np.where(x.spread <= NEAREST * far, far - x.spread, np.nan)
    return x.through(np.arctan(x.m), 1 / (far * far), (np.abs(x.m) + x.spread) / clear**4 * x.spread**2)


def _power(x: Form, exponent: float) -> Form:
    """By the binomial series, whose coefficients are those of (1 - q)^a or (1 + q)^a without their signs."""
    if exponent == int(exponent) and 0 <= exponent <= HIGHEST_POWER:
        return _repeated(x, int(exponent))
    if exponent == int(exponent) and -HIGHEST_POWER <= exponent < 0:
        a, q, m = exponent, x.share(), x.m
        value, beyond = np.power(m, a), np.power(1 - q, a) - 1 + a * q + _slack(q) * abs(a)
        return x.through(value, a * np.divide(value, m), np.abs(value) * beyond)
    return _exp(_log(x).scaled(exponent))


def _repeated(x: Form, exponent: int) -> Form:
    result: Form | None = None
    while exponent:
        if exponent & 1:
            result = x if result is None else result * x
        x, exponent = x * x if exponent > 1 else x, exponent >> 1
    return Form(1.0, None, 0.0, x.h) if result is None else result


_FUNCTIONS: dict[str, Callable[[Form], Form]] = {
    "neg": lambda x: -x,
    "sqrt": _sqrt,
    "exp": _exp,
    "expm1": _expm1,
    "log": _log,
    "log1p": _log1p,
    "sin": _sin,
    "cos": _cos,
    "tan": lambda x: _sin(x) * _inverse(_cos(x)),
    "sinh": _sinh,
    "cosh": _cosh,
    "tanh": lambda x: _sinh(x) * _inverse(_cosh(x)),
    "atan": _atan,
}
_OTHERS = frozenset({"add", "mul", "div", "pow"})


@lru_cache(maxsize=4096)
def enclosable(term: Term) -> bool:
    """Whether `enclosed` knows everything that a term is made of."""
    for node in postorder(term):
        match node:
            case Const() | Var():
                pass
            case Prim(op="pow"):
                if not isinstance(node.args[1], Const):
                    return False
            case Prim():
                if node.op not in _FUNCTIONS and node.op not in _OTHERS:
                    return False
            case _:
                return False
    return True


def enclosed(terms: Sequence[Term], env: Mapping[str, Form], known: dict[Term, Form], h: Array) -> list[Form]:
    """The forms of terms whose variables have those of `env`; `known` has what was worked out before, and grows."""
    for node in postorder(*terms):
        if node not in known:
            known[node] = _node(node, env, known, h)
    return [known[term] for term in terms]


def _reciprocal(term: Term, known: Mapping[Term, Form]) -> Form:
    """1/term, factor by factor: the disc of a square comes nearer to 0 than that of what is squared."""
    match term:
        case Prim(op="pow", args=(base, Const(value=exponent))):
            return _power(known[base], -float(exponent))
        case Prim(op="mul"):
            first, *rest = (_reciprocal(a, known) for a in term.args)
            for form in rest:
                first = first * form
            return first
        case Prim(op="exp"):
            return _exp(-known[term.args[0]])
        case _:
            return _inverse(known[term])


def _node(node: Term, env: Mapping[str, Form], known: Mapping[Term, Form], h: Array) -> Form:
    match node:
        case Const():
            return Form(float(node.value), None, 0.0, h)
        case Var():
            return env[node.name]
        case Prim(op="add"):
            first, *rest = (known[a] for a in node.args)
            for form in rest:
                first = first + form
            return first
        case Prim(op="mul"):
            first, *rest = (known[a] for a in node.args)
            for form in rest:
                first = first * form
            return first
        case Prim(op="div"):
            over, under = node.args
            if isinstance(under, Const):
                return known[over].scaled(1.0 / under.value if under.value else np.nan)
            return known[over] * _reciprocal(under, known)
        case Prim(op="pow"):
            exponent = node.args[1]
            assert isinstance(exponent, Const)
            return _power(known[node.args[0]], float(exponent.value))
        case Prim():
            return _FUNCTIONS[node.op](known[node.args[0]])
        case _:
            raise TypeError(f"no enclosure of {type(node).__name__}")
