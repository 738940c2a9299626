"""Boundary terms over many roots: told as a person would, and right at each of them."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import pairwise

import mpmath
import pytest
from formulas import Shown

from potto.calculus.algebra.ranges import range_of
from potto.core.terms import prim, var

PERIODIC = [
    (
        "integral [0, 10] [sin(3*x) < t]*x d(x)",
        "sum k in 0..5 (if [-1 < t < 1 and 0 < asin(t) + 2*pi*k < 30] then (asin(t) + 2*pi*k)/sqrt(1 - t^2) else 0)",
    ),
    ("integral [0, 3] [tan(x) < t]*x d(x)", "(atan(t)*[t > 0] + (atan(t) + pi)*[atan(t) + pi < 3])*dt/(t^2 + 1)"),
    ("integral [0, 7] [sin(x^2) < t]*x d(x)", "1/sqrt(1 - t^2)"),
    ("integral [1, 4] [cos(t*x) < 0.4]*x^2 d(x)", "..floor("),
    ("integral [0, 2] [cos(2*x + t) < 0]*exp(x) d(x)", "(-1)^k"),
    ("integral [0, 7] [sin(x) + cos(x) < t]*x d(x)", "acos(t/sqrt(2))"),
    ("integral [0, 3] [sin(5*sqrt(x + t)) < 1/2]*x d(x)", "pi/6"),
]


@pytest.mark.parametrize(("body", "read"), PERIODIC)
def test_periodic_roots_are_counted_by_integers_that_one_reads(body: str, read: str) -> None:
    """The slope is the sum of -F(x) psi_t/|psi_x| over the roots of psi = left - right in the domain, found in cells
    of a grid. To 1e-9, far above what doubles leave."""
    shown = Shown(f"def f(t) {body}\n", "f")
    assert read in shown.text.tangent
    assert "==" not in shown.text.tangent and len(shown.text.tangent) < 700
    assert shown.problems() == []
    module = shown.module()
    for t in (0.3, 0.83):
        assert module.eval(f"shown_1({t}, 1)").value == pytest.approx(_slope(body, t), rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("op", ["floor", "ceil"])
def test_whole_numbers_beside_what_is_anything_are_anything(op: str) -> None:
    """ceil(-inf) was taken for inf, so that no integer seemed to count where a bound of the domain moves."""
    assert (range_of(prim(op, var("t"))).lo, range_of(prim(op, var("t"))).hi) == (-math.inf, math.inf)
    shown = Shown("def f(t) integral [-t, 3] [sin(3*x) < t] d(x)\n", "f")
    by_roots = _slope("integral [-1/2, 3] [sin(3*x) < t] d(x)", 0.5)
    # [-t, 3] has its lower end at -1/2 there, where sin(-3/2) < 1/2: the bound adds 1
    assert shown.module().eval("shown_1(0.5, 1)").value == pytest.approx(by_roots + 1, rel=1e-9)


def _slope(body: str, t: float) -> float:
    bounds, condition, factor = _taken_apart(body)
    names = {name: getattr(mpmath, name) for name in ("sin", "cos", "tan", "sqrt", "exp")}

    def value(text: str, x: object, s: object) -> mpmath.mpf:
        return mpmath.mpf(eval(text.replace("^", "**"), {**names, "x": x, "t": s}))

    left, right = condition.split(" < ")
    psi = f"({left}) - ({right})"
    low, high = bounds
    grid = [mpmath.mpf(low) + (high - low) * mpmath.mpf(i) / 4000 for i in range(4001)]
    total = mpmath.mpf(0)
    for a, b in pairwise(grid):
        if value(psi, a, t) * value(psi, b, t) >= 0 or abs(value(psi, a, t)) > 100:  # a pole is no root that moves
            continue
        root = mpmath.findroot(lambda x: value(psi, x, t), (a, b), solver="anderson")
        along = mpmath.diff(lambda x: value(psi, x, t), root)
        over = mpmath.diff(lambda s: value(psi, root, s), mpmath.mpf(t))  # noqa: B023
        total -= value(factor, root, t) * over / abs(along)
    return float(total)


def _taken_apart(body: str) -> tuple[tuple[float, float], str, str]:
    """`integral [0, 1] [left < right]*factor d(x)`"""
    _, first, rest = body.split("[", 2)
    low, high = first.rstrip(" ]").split(", ")
    condition, _, factor = rest.rpartition("]")
    domain = float(Fraction(low)), float(Fraction(high))
    return domain, condition, factor.removeprefix("*").removesuffix(" d(x)") or "1"
