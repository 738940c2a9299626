"""Roots, logarithms and powers of what comes near to 0 without reaching it, within a range or at its end: between a
stretch as narrow as that is small and the rest, where the integrand is smooth, no node need be on the former."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from mpmath import mp

import potto

ROOTS: dict[str, tuple[str, Callable[[Any], Any]]] = {
    "a wave at the end": (
        "integral [0, 2] sin(x)*sqrt(1 + t - cos(x)) d(x)",
        lambda t: ((1 + t - mp.cos(2)) ** 1.5 - t**1.5) * 2 / 3,
    ),
    "its power within": (
        "integral [-0.4, 1] (1/(2 + x))*(1 + t - cos(x))^2.5 d(x)",
        lambda t: mp.quad(lambda x: (1 + t - mp.cos(x)) ** 2.5 / (2 + x), SPLIT),
    ),
    "a logarithm beside the end": (
        "integral [1e-4, 2] sin(x)*log(1 + t - cos(x)) d(x)",
        lambda t: (lambda u: u(1 + t - mp.cos(2)) - u(1 + t - mp.cos(mp.mpf(1e-4))))(lambda u: u * mp.log(u) - u),
    ),
    "a power of a square": (
        "integral [0, 1] (x - 0.3)*(t + (x - 0.3)^2)^0.3 d(x)",
        lambda t: ((t + (1 - mp.mpf(0.3)) ** 2) ** 1.3 - (t + mp.mpf(0.3) ** 2) ** 1.3) / 2.6,
    ),
    "a cubic": (
        "integral [1.0005, 1.5] (x^2 - 1)*(x^3 - 3*x + 2 + t)^2.5 d(x)",
        lambda t: (
            lambda u: (u(mp.mpf(1.5)) ** 3.5 - u(mp.mpf(1.0005)) ** 3.5) / 10.5
        )(lambda x: x**3 - 3 * x + 2 + t),
    ),
    "in the variable further out": (
        "integral ([-0.4, 1], [0, 1]) sqrt(t + x^2)*x*exp(y) d(x, y)",
        lambda t: (mp.e - 1) * ((t + 1) ** 1.5 - (t + mp.mpf(0.4) ** 2) ** 1.5) / 3,
    ),
}  # fmt: skip
SPLIT = sorted({-mp.mpf(0.4), mp.mpf(1), mp.mpf(0), *(s * mp.mpf(2) ** -k for k in range(2, 24, 2) for s in (-1, 1))})


@pytest.mark.parametrize("name", ROOTS)
@pytest.mark.parametrize("t", [3e-7, 1.7e-4, 6e-3])
def test_nodes_are_where_a_root_turns(name: str, t: float) -> None:
    program, exact = ROOTS[name]
    f = potto.compile(f"def f(t)\n    {program}").f
    value, slope = potto.value_and_grad(f)(t)
    with mp.workdps(40):
        at, step = mp.mpf(t), mp.mpf(t) / 1000
        here = [exact(at + n * step) for n in (-3, -2, -1, 1, 2, 3)]
        rate = (here[5] - here[0] - 9 * (here[4] - here[1]) + 45 * (here[3] - here[2])) / (60 * step)
        wanted = exact(at), rate
    for found, right in zip((value, slope), wanted, strict=True):
        assert abs(found.value - right) <= found.error + 1e-15 * abs(right)
        assert found.error <= 1e-9 * abs(right) + 1e-12
    assert abs(f(t).value - wanted[0]) <= f(t).error + 1e-15 * abs(wanted[0])
