"""Conditions without closed-form roots, accepted in definitions: values and derivatives against mpmath.

The reference finds every root by the sign of the condition on a fine grid and by the turning points between, refined by
bisection to 30 digits. What is integrated has an antiderivative in closed form.

Tolerance: every answer must lie within its reported error plus 64 ulp of what is added up; converged answers must be
right to 1e-10.
"""

from __future__ import annotations

import itertools
import random
from collections.abc import Callable
from typing import Any

import mpmath as mp
import pytest

import potto

EPS = 2.0**-52
NODES = 1500  # of the grid on which the reference looks for sign changes and turns
Function = Callable[[Any, Any], Any]


def polynomial(draw: random.Random) -> tuple[str, Function]:
    c = [draw.uniform(-2, 2) for _ in range(draw.randint(4, 6))]
    text = " + ".join(f"{a!r}*x^{n}" for n, a in enumerate(c, 1))
    return text, lambda x, t: mp.fsum(a * x**n for n, a in enumerate(c, 1)) - t


def waves(draw: random.Random) -> tuple[str, Function]:
    a, b = draw.uniform(0.5, 2), draw.uniform(0.5, 2)
    w, v = draw.uniform(1, 6), draw.uniform(1, 6)
    return (
        f"{a!r}*cos({w!r}*x) + {b!r}*sin({v!r}*x) + x/3",
        lambda x, t: a * mp.cos(w * x) + b * mp.sin(v * x) + x / 3 - t,
    )


def damped(draw: random.Random) -> tuple[str, Function]:
    a, b, c = (draw.uniform(-2, 2) for _ in range(3))
    k = draw.uniform(0.5, 2)
    return (
        f"({a!r} + {b!r}*x + {c!r}*x^2)*exp(-{k!r}*x)",
        lambda x, t: (a + b * x + c * x**2) * mp.exp(-k * x) - t,
    )


def with_bracket(draw: random.Random) -> tuple[str, Function]:
    text, function = polynomial(draw)
    jump, at = draw.uniform(-1, 1), draw.uniform(-0.5, 0.5)
    return f"{text} + {jump!r}*[x < {at!r}]", lambda x, t: function(x, t) + jump * (x < at)


KINDS = {"polynomial": polynomial, "waves": waves, "damped": damped, "with a bracket": with_bracket}
LO, HI = -1.0, 1.5


def roots_of(f: Callable[[Any], Any]) -> list[Any]:
    """Where f changes sign. Between two nodes it may do so twice: then it has a turn there with another sign."""
    xs = [mp.mpf(LO) + (mp.mpf(HI) - LO) * k / NODES for k in range(NODES + 1)]
    ys = [f(x) for x in xs]
    found = []
    for k in range(NODES):
        if ys[k] * ys[k + 1] < 0:
            found.append(bisected(f, xs[k], xs[k + 1]))
        elif k > 0 and abs(ys[k]) < min(abs(ys[k - 1]), abs(ys[k + 1])) and ys[k] * ys[k - 1] > 0:
            turn = lowest(lambda x, y=ys[k]: mp.sign(y) * f(x), xs[k - 1], xs[k + 1])
            if f(turn) * ys[k] < 0:
                found += [bisected(f, xs[k - 1], turn), bisected(f, turn, xs[k + 1])]
    return found


def bisected(f: Callable[[Any], Any], a: Any, b: Any) -> Any:
    sign = mp.sign(f(a))
    for _ in range(110):
        middle = (a + b) / 2
        a, b = (middle, b) if mp.sign(f(middle)) == sign else (a, middle)
    return (a + b) / 2


def lowest(f: Callable[[Any], Any], a: Any, b: Any) -> Any:
    ratio = (mp.sqrt(5) - 1) / 2
    for _ in range(140):
        c, d = b - ratio * (b - a), a + ratio * (b - a)
        a, b = (a, d) if f(c) < f(d) else (c, b)
    return (a + b) / 2


@mp.workdps(34)
def truth(function: Function, t: float) -> tuple[Any, Any, Any]:
    """The integral of exp(x) where function(x, t) < 0, its derivative by t, and the size of what is added up."""

    def f(x: Any) -> Any:
        return function(x, mp.mpf(t))

    roots = roots_of(f)
    ends = [mp.mpf(LO), *roots, mp.mpf(HI)]
    value = mp.mpf(0)
    for a, b in itertools.pairwise(ends):
        if f((a + b) / 2) < 0:
            value += mp.exp(b) - mp.exp(a)
    h = mp.mpf(10) ** -12
    slopes = [(f(x + h) - f(x - h)) / (2 * h) for x in roots]
    parts = [mp.exp(x) / abs(s) if abs(s) < 1e9 else mp.mpf(0) for x, s in zip(roots, slopes, strict=True)]
    return value, mp.fsum(parts), mp.fsum(abs(p) for p in parts)


def inside(found: float, error: float, exact: Any, size: Any) -> bool:
    return abs(found - exact) <= error + 64 * EPS * max(1, float(size))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(6))
def test_random_conditions(kind: str, seed: int) -> None:
    draw = random.Random(f"{kind} {seed}")
    for _ in range(3):
        text, function = KINDS[kind](draw)
        t = draw.uniform(-1, 1)
        f = potto.compile(f"def f(t) integral [{LO}, {HI}] exp(x)*[{text} < t] d(x)").f
        value, rate, size = truth(function, t)
        answer = potto.deriv(f)((t, 1.0))
        assert inside(answer.value, answer.error, value, 4), (text, t, answer, value)
        assert inside(answer.tangent, answer.tangent_error, rate, size), (text, t, answer, rate)
        assert answer.converged, (text, t, answer.reasons)
        assert answer.value == pytest.approx(float(value), rel=1e-10, abs=1e-12)
