"""Integrands that are products of what varies independently: products of integrals over fewer variables."""

from __future__ import annotations

import itertools
import math
from typing import Any

import mpmath as mp
import numpy as np
import pytest

import potto

T = 0.3


def derived(text: str, t: Any = T) -> Any:
    return potto.grad(potto.compile(f"def f(t) {text}").f, "t")(t)


def holds(answer: Any, value: Any, tangent: Any) -> None:
    """Within the errors, which are small: all that is asked for are integrals in one variable."""
    assert abs(answer.value - value) <= answer.error <= 1e-10
    assert abs(answer.tangent - tangent) <= answer.tangent_error <= 1e-10


def test_a_variable_that_nothing_depends_on() -> None:
    """The mean over noise that is not used: 1. Together the three took a million evaluations."""
    nested = "(integral (x ~ exponential(2)) integral [-t, 1] integral (z ~ normal(t, 0.5)) x*y + 1 d(z) d(y) d(x))"
    answer = derived(nested)
    holds(answer, (1 - T * T) / 4 + 1 + T, 1 - T / 2)
    assert answer.evals < 5_000


MEASURES = {"x": "normal(0, 1)", "y": "normal(t, 1)", "z": "exponential(1)"}


@pytest.mark.parametrize("order", list(itertools.permutations("xyz")))
@pytest.mark.parametrize("nested", [False, True])
def test_a_pair_and_a_third(order: tuple[str, ...], nested: bool) -> None:
    """P(x < y) P(z < t), in any order of the variables, joined or not."""
    body = "[x < y]*[z < t]"
    if nested:
        for name in order:
            body = f"(integral ({name} ~ {MEASURES[name]}) {body} d({name}))"
    else:
        body = f"integral ({', '.join(f'{n} ~ {MEASURES[n]}' for n in order)}) {body} d({', '.join(order)})"
    with mp.workdps(20):
        t = mp.mpf(T)
        value = mp.ncdf(t / mp.sqrt(2)) * (1 - mp.exp(-t))
        tangent = mp.npdf(t / mp.sqrt(2)) / mp.sqrt(2) * (1 - mp.exp(-t)) + mp.ncdf(t / mp.sqrt(2)) * mp.exp(-t)
    holds(derived(body), value, tangent)


def test_bounds_connect() -> None:
    """y runs up to x, so that the two stay together; z stands by itself."""
    answer = derived("integral ([0, 1], [0, x], [0, 1]) [y < t]*(1 + z)*exp(x*y) d(x, y, z)")
    with mp.workdps(20):

        def area(t: Any) -> Any:  # of exp(x y) over y < min(x, t)
            return mp.quad(lambda y: (mp.exp(y) - mp.exp(y * y)) / y, [0, t])

        holds(answer, 1.5 * area(mp.mpf(T)), 1.5 * (mp.exp(T) - mp.exp(mp.mpf(T) ** 2)) / T)


def test_what_has_no_end_and_no_density_stays() -> None:
    """Over all of the line 1 has no integral; a product with it has none either, unless it is 0."""
    with potto.settings(max_evals=20_000):
        answer = derived("integral ([0, 1], [0, inf], [0, 1]) [x < t]*[z < t] d(x, y, z)")
    assert not answer.converged or not math.isfinite(answer.value)


def test_each_factor_has_derivatives_of_both_sides() -> None:
    """At t = 0 two of them bend; what is told is how the whole grows on both sides."""
    answer = derived("integral (x ~ normal(0, 1), [0, 1], [-1, 1]) exp(y)*[z < t]*[x < max(t, 0)] d(x, y, z)", 0.0)
    before = (math.e - 1) / 2  # what y and x come to, times 1 + t
    beyond = before + (math.e - 1) / math.sqrt(2 * math.pi)
    assert answer.value == pytest.approx(before, abs=1e-12)
    (note,) = answer.notes
    assert (note.backward, note.forward) == (pytest.approx(before, abs=1e-12), pytest.approx(beyond, abs=1e-12))
    assert answer.tangent in (note.backward, note.forward)


def test_batches_and_reverse() -> None:
    """Arrays as numbers, and gradients in many parameters."""
    text = "def f(t, a, b) integral (x ~ normal(a, 1), y ~ normal(b, 2), [0, 1]) [x < t]*max(y, t)*exp(z*a) d(x, y, z)"
    f = potto.compile(text).f
    ts = np.array([-8.0, 0.0, T, 1e-8, 30.0])
    names = ["t", "a", "b"]
    whole = potto.grad(f, names)(ts, 0.5, -0.25)
    for i, t in enumerate(ts):
        one = potto.grad(f, names)(float(t), 0.5, -0.25)
        for many, single in ((whole.value[i], one.value), *((whole.tangent[k][i], one.tangent[k]) for k in range(3))):
            assert many == pytest.approx(single, rel=1e-11, abs=1e-11)
    reverse, tangent = potto.value_and_grad(f, names)(T, 0.5, -0.25), potto.grad(f, names)(T, 0.5, -0.25)
    assert np.allclose(np.ravel(reverse[1]), np.ravel(tangent.tangent), rtol=1e-11)


def test_an_exponential_of_a_sum() -> None:
    """exp(-(x^2 + y^2)/2), as densities are written by hand; the constant of it belongs to one of the two."""
    answer = derived("integral ([-inf, inf], [-inf, inf]) exp(-(x^2 + y^2)/2 - t)*[x < t]*abs(y) d(x, y)")
    with mp.workdps(20):
        t = mp.mpf(T)
        both = 2 * mp.sqrt(2 * mp.pi) * mp.ncdf(t) * mp.exp(-t)
        holds(answer, both, 2 * mp.exp(-t * t / 2 - t) - both)
    assert answer.evals < 2_000


def test_an_exponential_of_a_sum_that_connects() -> None:
    """exp(-(x^2 + x y + y^2)) is integrated as it is written: exp(-x y) by itself overflows."""
    answer = derived("integral ([-inf, inf], [-inf, inf], [0, 1]) exp(-(x^2 + x*y + y^2))*[z < t] d(x, y, z)")
    area = 2 * math.pi / math.sqrt(3)
    holds(answer, area * T, area)


@pytest.mark.parametrize("order", ["abcd", "cadb"])
def test_summands_of_different_variables(order: str) -> None:
    """A spread between two auctions: each of the means takes two variables. All four together took 60 million
    evaluations to an answer of which nothing was known."""
    measures = {"a": "normal(0, 1)", "b": "normal(t, 1)", "c": "uniform(0, 1)", "d": "exponential(1)"}
    bounds = ", ".join(f"{name} ~ {measures[name]}" for name in order)
    answer = derived(f"integral ({bounds}) (max(a, b) - min(c, d) + t) d({', '.join(order)})")
    with mp.workdps(20):
        t = mp.mpf(T)
        apart = mp.sqrt(2)
        greatest = t * mp.ncdf(t / apart) + apart * mp.npdf(t / apart)
        least = mp.quad(lambda s: (1 - s) * mp.exp(-s), [0, 1])
        holds(answer, greatest - least + t, mp.ncdf(t / apart) + 1)
    assert answer.evals < 500_000


def test_summands_that_share_a_variable_stay_together() -> None:
    answer = derived("integral (a ~ exponential(1), b ~ exponential(2), c ~ exponential(3)) (a*b + b*c)*t d(a, b, c)")
    holds(answer, T * (0.5 + 1 / 6), 0.5 + 1 / 6)
