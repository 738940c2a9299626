"""Conditions that change sides at a pole, which moves: by quadrature and by samples. Closed forms, and central
differences of values by mpmath."""

from __future__ import annotations

import math
from typing import Literal

import mpmath as mp
import pytest

import potto

METHODS = ["quadrature", "mc", "qmc"]
Method = Literal["quadrature", "mc", "qmc"]


def check(text: str, at: float, value: float, rate: float, method: Method) -> None:
    f = potto.deriv(potto.compile(f"def f(t) {text}").f)
    for seed in (0, 1_000) if method != "quadrature" else (0,):
        with potto.settings(method=method, samples=10_000, seed=seed):
            found = f((at, 1.0))
        assert abs(found.value - value) <= found.error + 1e-14
        assert abs(found.tangent - rate) <= found.tangent_error + 1e-13
        assert found.tangent_error < 0.3


@pytest.mark.parametrize("method", METHODS)
def test_a_pole_in_closed_form(method: Method) -> None:
    # G(1 - t) + H(1 + t) with G' = min(2, 1 + 1/u) and H' = 1 - 1/u above 1
    t = 0.23
    value = 2 * (1 - t) + t - math.log(1 + t)
    check("integral ([-1, 1], [-1, 1]) [1/(x - t) > y] d(x, y)", t, value, -2 + 1 - 1 / (1 + t), method)


@pytest.mark.parametrize("method", METHODS)
def test_a_pole_among_bounds_that_move(method: Method) -> None:
    # 1 + (e - 1) [x > t] on t (1 + t) + t^2/2: all of x > t counts, as x < 1 + t and y < t < 1
    t = 0.9
    value = t * (1 + t) + t * t / 2 + (math.e - 1) * t
    check("integral ([0, t], [-y, 1 + t]) exp([1/(x - t) > y]) d(y, x)", t, value, 1 + 3 * t + math.e - 1, method)


@pytest.mark.parametrize("method", METHODS)
def test_a_pole_that_is_searched(method: Method) -> None:
    # Between the pole p, p^5 + p = t, and where x^5 + x = t + 1/(3 + y sin x)
    def length(t: mp.mpf) -> mp.mpf:
        def root(c: mp.mpf) -> mp.mpf:
            return mp.findroot(lambda x: x**5 + x - c, 0.5)

        def end(y: mp.mpf) -> mp.mpf:
            return mp.findroot(lambda x: (x**5 + x - t) * (3 + mp.sin(x) * y) - 1, 0.6)

        return mp.quad(end, [0, 1]) - root(t)

    value, rate = length(mp.mpf("0.4")), mp.diff(length, mp.mpf("0.4"))
    text = "integral ([0, 1], [0, 1]) [1/(x^5 + x - t) > 3 + sin(x)*y] d(y, x)"
    check(text, 0.4, float(value), float(rate), method)
