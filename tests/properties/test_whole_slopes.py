"""Slopes of sums and products: exact where all is whole, by tangents carried along and by a tape, alone and in arrays;
else within their bars of the slopes in rational numbers, which are exact for the doubles that are given."""

from __future__ import annotations

import random
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from how_many import examples

import potto

ROWS = 13  # parameters by which a tape is swept back
Row = tuple[Fraction, ...]
Dual = tuple[Fraction, Row]


def polynomial(pick: random.Random, depth: int) -> tuple[str, Callable[[list[Dual]], Dual]]:
    """A text over the elements of xs, and its value and slopes from theirs."""
    if depth == 0:
        if pick.random() < 0.3:
            n = pick.randint(0, 9)
            return str(n), lambda xs: (Fraction(n), (Fraction(0),) * len(xs))
        i = pick.randint(0, 2)
        return f"xs[{i}]", lambda xs: xs[i]
    (a, of_a), (b, of_b) = polynomial(pick, depth - 1), polynomial(pick, depth - 1)
    op = pick.choice("+-**2")
    if op == "2":
        return f"({a})^2", lambda xs: product(of_a(xs), of_a(xs))
    if op == "*":
        return f"({a})*({b})", lambda xs: product(of_a(xs), of_b(xs))
    sign = 1 if op == "+" else -1

    def added(xs: list[Dual]) -> Dual:
        (v, t), (w, u) = of_a(xs), of_b(xs)
        return v + sign * w, tuple(x + sign * y for x, y in zip(t, u, strict=True))

    return f"({a}) {op} ({b})", added


def product(a: Dual, b: Dual) -> Dual:
    return a[0] * b[0], tuple(a[0] * y + b[0] * x for x, y in zip(a[1], b[1], strict=True))


def slopes(of: Callable[[list[Dual]], Dual], xs: list[Fraction]) -> Row:
    n = len(xs)
    return of([(x, tuple(Fraction(int(i == j)) for j in range(n))) for i, x in enumerate(xs)])[1]


@pytest.mark.parametrize("seed", range(examples(30)))
def test_slopes_of_polynomials_are_exact_where_all_is_whole_and_else_within_their_bars(seed: int) -> None:
    pick = random.Random(seed)
    text, of = polynomial(pick, pick.randint(1, 4))
    module: Any = potto.compile(f"def f(xs: [n] Real) {text} + (sum x in xs (x^2 - 2*x))")
    for size in (3, ROWS):
        for whole in (True, False):
            xs = [float(pick.randint(-9, 9)) if whole else pick.uniform(-3, 3) for _ in range(size)]
            found = potto.grad(module.f)(np.array(xs))
            given = [Fraction(x) for x in xs]
            wanted = [s + 2 * x - 2 for s, x in zip(slopes(of, given), given, strict=True)]
            if whole and max(map(abs, wanted)) < 2**20:
                assert list(found.tangent) == [float(s) for s in wanted], text
                assert not np.any(found.tangent_error), text
            for slope, bar, s in zip(found.tangent, found.tangent_error, wanted, strict=True):
                assert abs(Fraction(float(slope)) - s) <= Fraction(float(bar)), (text, xs)


def test_a_slope_that_is_whole_by_chance_keeps_its_bar() -> None:
    module: Any = potto.compile("def f(x) sin(x)\ndef g(x) 3*x^3\ndef h(x) x*x*x*x")
    assert potto.grad(module.f)(1e-9).tangent_error > 0  # cos(1e-9) is 1 as a double, not exactly
    assert potto.grad(module.g)(1 / 3).tangent_error > 0  # 1 as a double, and 1/3 is none
    huge = potto.grad(module.h)(float(2**18 + 1))  # 4*x^3 is above 2^53, and odd in its last places
    assert huge.tangent_error >= abs(Fraction(float(huge.tangent)) - 4 * Fraction(2**18 + 1) ** 3) > 0


def test_slopes_of_arrays_are_exact_as_those_of_numbers_are() -> None:
    module: Any = potto.compile("def f(xs: [n] Real) [2*xs[i] for i in 0..n-1]\ndef g(x) 3*x - x + 4")
    found = potto.jacobian(module.f)(np.array([0.1, 2.0, 3.0]))
    assert np.array_equal(found.value, 2 * np.eye(3)) and not np.any(found.error)
    assert potto.jacobian(module.g)(3.0).error == 0
