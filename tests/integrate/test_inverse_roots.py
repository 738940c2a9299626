"""Integrands like 1/sqrt(t - cos(x)) up to where the radicand is 0: next to it nothing but rounding is left of it, and
the error says so. Closed forms; of the density of states of two bands by the complete elliptic integral (mpmath)."""

from __future__ import annotations

from collections.abc import Callable

import mpmath as mp
import pytest

import potto

COSINE = "def f(t) integral [0, pi/2] (if [cos(x) < t] then sin(x)/sqrt(t - cos(x)) else 0) d(x)\n"
EXPONENTIAL = "def f(t) integral [0, 1] (if [exp(x) > t] then exp(x)/sqrt(exp(x) - t) else 0) d(x)\n"
CUBIC = "def f(t) integral [0, 1] (if [x^3 + x > t] then (3*x^2 + 1)/sqrt(x^3 + x - t) else 0) d(x)\n"
BANDS = "def f(t) integral [-pi, pi] (if [(t - cos(x))^2 < 1] then 2/sqrt(1 - (t - cos(x))^2) else 0) d(x)\n"


@pytest.mark.parametrize(
    ("program", "exact", "values"),
    [
        (COSINE, lambda t: 2 * mp.sqrt(t), (0.9999923597140324, 0.99998, 0.993, 0.7)),
        (EXPONENTIAL, lambda t: 2 * mp.sqrt(mp.e - t), (2.2946238413959676, 1.3, 1.9)),
        (CUBIC, lambda t: 2 * mp.sqrt(2 - t), (1.7958183432742207, 0.2914, 1.1)),
        (BANDS, lambda t: 4 * mp.ellipk(1 - t**2 / 4), (1e-4, 8.959343989943021e-06, -0.0344640, 1.2725)),
    ],
)
def test_errors_cover_what_rounding_does(
    program: str, exact: Callable[[mp.mpf], mp.mpf], values: tuple[float, ...]
) -> None:
    f = potto.compile(program).f
    for t in values:
        answer = f(t)
        with mp.workdps(40):
            assert abs(mp.mpf(answer.value) - exact(mp.mpf(t))) <= answer.error <= 1e-7


@pytest.mark.parametrize("t", [0.01, 0.003, 3e-4, 1e-5])
def test_states_beside_a_saddle_by_their_level(t: float) -> None:
    """Of one band in two dimensions, and how many more there are a little higher. Nodes that crowd at the end of what
    has roots are where nothing is known of an inverse root, not even how far off it is."""
    f = potto.deriv(potto.compile("def f(t) integral ([0, pi], [0, pi]) delta(cos(x) + cos(y) - t) d(x, y)").f)
    found = f((t, 1.0))
    with mp.workdps(40):
        states, rate = mp.ellipk(1 - mp.mpf(t) ** 2 / 4), mp.diff(lambda u: mp.ellipk(1 - u**2 / 4), mp.mpf(t))
        assert abs(mp.mpf(found.value) - states) <= found.error <= 1e-9
        assert abs(mp.mpf(found.tangent) - rate) <= found.tangent_error <= 1e-6 * abs(rate)
