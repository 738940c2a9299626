"""What happens within a stretch too short for nodes, beside something smooth that they see: transitions, peaks, pairs
of peaks that cancel, in all spellings, on finite and infinite ranges. Values, and slopes by where they are."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from mpmath import mp

import potto

STEP = mp.mpf(2) ** -40  # of t along the imaginary axis: what becomes imaginary is the slope, off by its square


def across(f: Callable[..., Any], low: Any, high: Any) -> Callable[[Any, Any], Any]:
    """The integral of f(s, t, k) over x = t + s from low to high, by panels that double in length from t on."""

    def run(k: Any, t: Any) -> Any:
        at, off = t.real, t.imag * 1j
        steps = [2**n / mp.mpf(k) for n in range(-1, 60, 2) if 2**n < high * k]
        ends = sorted({low - at, high - at, mp.mpf(0), *(s * sign for s in steps for sign in (-1, 1))})
        ends = [s for s in ends if low - at <= s <= high - at]
        return mp.quad(lambda s: f(s - off, t, k), ends, maxdegree=4, method="gauss-legendre")

    return run


def logistic(u: Any) -> Any:
    return 1 / (1 + mp.exp(u))


def gone(u: Any) -> Any:
    return mp.exp(-mp.cosh(u)) if abs(u) < 50 else mp.mpf(0)


FEATURES: dict[str, tuple[str, Callable[[Any, Any], Any]]] = {
    "a peak in t^2": (
        "integral [0, 1] 1/(2 + x) + 1/cosh(k*(x^2 - t^2))^2 d(x)",
        across(lambda s, t, k: 1 / (2 + t + s) + mp.sech(k * s * (s + 2 * t)) ** 2, 0, 1),
    ),
    "two that cancel": (
        "integral [0, 1] exp(x) + (x - t)*exp(-k*k*(x - t)^2) d(x)",
        lambda k, t: mp.e - 1 + (mp.exp(-((k * t) ** 2)) - mp.exp(-((k * (1 - t)) ** 2))) / (2 * k * k),
    ),
    "a high power": (
        "integral [0, 1] exp(x) + cos(x - t)^5e9 d(x)",
        lambda k, t: mp.e - 1 + mp.sqrt(mp.pi) * mp.gammaprod([2.5e9 + 0.5], [2.5e9 + 1]),
    ),
    "a power by a parameter": (
        "integral [0, 1] exp(x) + cos(x - t)^(8*k^2) d(x)",
        lambda k, t: mp.e - 1 + mp.sqrt(mp.pi) * mp.gammaprod([4 * k * k + 0.5], [4 * k * k + 1]),
    ),
    "a comb, the first peak beside the end": (
        "integral [0, 3] x + exp(k*(cos(10*x - t) - 1)) d(x)",
        lambda k, t: 4.5 + 0 * t + mp.pi * mp.besseli(0, k) * mp.exp(-k),
    ),
    "a comb to infinity": (
        "integral [0, inf] exp(-x)*(1 + exp(k*(cos(10*x - t) - 1))) d(x)",
        lambda k, t: 1 + mp.exp(-t / 10) / (1 - mp.exp(-mp.pi / 5)) * across(
            lambda s, t, k: mp.exp(k * (mp.cos(10 * s) - 1) - s), -mp.pi / 10, mp.pi / 10)(k, mp.mpc(0)),
    ),
    "a power of 2": (
        "integral [0, 1] exp(x) + 2^(-(k*(x - t))^2) d(x)",
        lambda k, t: mp.e - 1 + mp.sqrt(mp.pi / mp.log(2)) / k,
    ),
    "a step in a normal": (
        "integral (x ~ normal(0, 1)) x + erf(k*(x - t)) d(x)",
        lambda k, t: -mp.erf(k * t / mp.sqrt(1 + 2 * mp.mpf(k) ** 2)),
    ),
    "a step that falls, to infinity": (
        "integral [0, inf] exp(-x)*(1 + erf(k*(t - x))) d(x)",
        lambda k, t: 1 + mp.erf(k * t) - mp.exp(1 / (4 * mp.mpf(k) ** 2) - t) * mp.erfc(1 / (2 * mp.mpf(k)) - k * t),
    ),
    "two exponentials that grow": (
        "integral [0, inf] exp(-x)*(x + 1/(exp(k*(t - x)) + exp(k*(x - t)))) d(x)",
        across(lambda s, t, k: mp.exp(-t - s) * (t + s + mp.sech(k * s) / 2), 0, mp.mpf(60)),
    ),
    "one beside a density": (
        "integral (x ~ exponential(1)) 1 + exp(-x)/(1 + exp(k*(x^3 - t^3))) d(x)",
        across(lambda s, t, k: mp.exp(-t - s) * (
            1 + mp.exp(-t - s) * logistic(k * s * (s * s + 3 * s * t + 3 * t * t))), 0, mp.mpf(60)),
    ),
    "a bend, a thousand times as sharp": (
        "integral [0, inf] exp(-x)*(1 + 1000*k*(x - t)/sqrt(1 + (1000*k*(x - t))^2)) d(x)",
        lambda k, t: across(lambda s, t, k: mp.exp(-t - s) * (1 + k * s / mp.sqrt(1 + (k * s) ** 2)), 0, mp.mpf(60))(
            1000 * k, t
        ),
    ),
    "what falls as an exponential of an exponential": (
        "integral [0, inf] exp(-x)*(x + (1 + x)*exp(-cosh(k*(x - t)))) d(x)",
        across(lambda s, t, k: mp.exp(-t - s) * (t + s + (1 + t + s) * gone(k * s)), 0, mp.mpf(60)),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", FEATURES)
def test_what_lies_between_nodes_is_seen(name: str) -> None:
    program, exact = FEATURES[name]
    f = potto.compile(f"def f(k, t)\n    {program}").f
    k, t = 24_600.0, 0.3071
    found = potto.deriv(f)((k, 0.0), (t, 1.0))
    with mp.workdps(30):
        exact_value = exact(k, mp.mpc(t, STEP))
        value, slope = exact_value.real, exact_value.imag / STEP
    for got, error, right in ((f(k, t).value, f(k, t).error, value), (found.tangent, found.tangent_error, slope)):
        assert abs(got - right) <= error + 1e-15
        assert (
            error <= 1e-6
        )  # a cosine to the power of 5e9 is rounded to as much of itself, and x - t to 2e-9 of the bend


def test_tails_that_rise_beyond_the_last_node_of_a_long_panel_are_counted() -> None:
    """What a neighbour holds begins at 1e-8 of the integrand there, over 1 % of the panel: the terms at 11 nodes are as
    small as if nothing were there. By the same rule on 400 panels, on which all is smooth."""
    peak = potto.compile("""def f(t)
    integral [0, 1] 3 + sin(2*x) - 2*exp(-((x - t)/0.107)^4)/(1 + ((x - t + 0.0536)/0.0164)^4) d(x)""").f(0.8084)
    u, w = np.polynomial.legendre.leggauss(20)
    x = (np.arange(400)[:, None] + (u + 1) / 2) / 400
    values = 3 + np.sin(2 * x) - 2 * np.exp(-(((x - 0.8084) / 0.107) ** 4)) / (1 + ((x - 0.7548) / 0.0164) ** 4)
    assert abs(peak.value - (values @ w).sum() / 800) <= peak.error <= 1e-8


@pytest.mark.parametrize("power", [228_600.0, 3.1e7])
def test_rounding_of_a_power_by_which_it_is_differentiated_is_in_the_bar(power: float) -> None:
    """A base rounded to 1e-16 leaves 1e-16 of the power, which is all within an eightieth of what is cut out for it."""
    f = potto.compile("def f(n, t) integral [0, 1] x + (1/(1 + (x - t)^2))^n d(x)").f
    found = potto.deriv(f)((power, 1.0), (0.5891, 0.0))
    with mp.workdps(30):
        n = mp.mpf(power)
        area = mp.sqrt(mp.pi) * mp.gammaprod([n - 0.5], [n])
        assert abs(found.value - 0.5 - area) <= found.error
        assert abs(found.tangent - area * (mp.digamma(n - 0.5) - mp.digamma(n))) <= found.tangent_error
