"""Infinite stretches are run through at the pace of what they hold: tails in any unit, by closed forms and mpmath."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

import potto

PROGRAM = """
def survival(rate, t) integral (x ~ exponential(rate)) [x > t] d(x)
def above(s, t) integral (x ~ normal(0, s)) [x > t] d(x)
def below(s, t) integral (x ~ normal(0, s)) [x < -t] d(x)
def heavy(s, t) integral [t, inf] s/(s^2 + x^2) d(x)
def power(s, t) integral [t, inf] s^3/(s + x)^4 d(x)
def far(m) integral [0, inf] exp(-(x - m)^2/2) d(x)
def swing(w) integral [0, inf] exp(-x)*sin(w*x) d(x)
"""
UNITS = 1e-6, 1e-3, 1.0, 1e3, 1e6
# ten digits are asked for; of the derivatives two more may be lost where a place is far out in units of the decay
CLOSE = 1e-9


@pytest.fixture(scope="module")
def module() -> potto.Module:
    return potto.compile(PROGRAM)


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("times", [0.0, 0.3, 3.0, 30.0])
def test_the_tail_of_an_exponential(module: potto.Module, unit: float, times: float) -> None:
    rate, t = 1 / unit, times * unit
    found = potto.grad(module.survival, ["rate", "t"])(rate, t)
    exact = np.exp(-rate * t)
    assert found.value == pytest.approx(exact, rel=CLOSE)
    assert found["rate"] == pytest.approx(-t * exact, rel=CLOSE, abs=CLOSE * unit * exact)
    if t > 0:  # at 0 the surface lies on the end of the support
        assert found["t"] == pytest.approx(-rate * exact, rel=CLOSE)


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("times", [0.5, 5.0, 20.0])
def test_both_tails_of_a_normal_density(module: potto.Module, unit: float, times: float) -> None:
    exact = float(mpmath.erfc(times / mpmath.sqrt(2)) / 2)
    density = float(mpmath.npdf(times))
    for function in (module.above, module.below):
        found = potto.grad(function, ["s", "t"])(unit, times * unit)
        assert found.value == pytest.approx(exact, rel=CLOSE)
        assert found["s"] == pytest.approx(times * density / unit, rel=CLOSE)
        assert found["t"] == pytest.approx(-density / unit, rel=CLOSE)


@pytest.mark.parametrize("unit", UNITS)
def test_tails_that_fall_like_a_power(module: potto.Module, unit: float) -> None:
    assert module.heavy(unit, 2 * unit).value == pytest.approx(float(mpmath.atan(0.5)), rel=CLOSE)
    assert module.power(unit, 2 * unit).value == pytest.approx(1 / (3 * 3**3), rel=CLOSE)


def test_what_lies_far_from_the_end_and_what_oscillates(module: potto.Module) -> None:
    for m in (0.0, 3.0, 100.0):
        exact = float(mpmath.sqrt(mpmath.pi / 2) * mpmath.erfc(-m / mpmath.sqrt(2)))
        assert module.far(m).value == pytest.approx(exact, rel=CLOSE)
    for w in (0.5, 10.0):
        assert module.swing(w).value == pytest.approx(w / (1 + w * w), rel=CLOSE)


def test_a_unit_costs_what_another_does(module: potto.Module) -> None:
    """By powers of eight, the distance of the places that are looked at, so that nothing but the scale differs."""
    for name, t in (("survival", 0.7), ("above", 0.7), ("heavy", 2.0)):
        spent = set()
        for unit in (8.0**-4, 1.0, 8.0**4):
            scale = 1 / unit if name == "survival" else unit
            spent.add(getattr(module, name)(scale, t * unit).stats["evaluations"])
        assert len(spent) == 1


def test_many_tails_in_one_batch(module: potto.Module) -> None:
    """Each member has the pace of its own tail: none is left to be done by itself, however far out."""
    t = np.linspace(0, 12, 5_000)
    found = module.above(1.0, t)
    exact = np.array([float(mpmath.erfc(x / mpmath.sqrt(2)) / 2) for x in t])
    assert np.abs(found.value / exact - 1).max() < CLOSE
    assert found.stats["evaluations"] < 200 * t.size  # 250 and, for one in a hundred, 22 ms each, at one pace for all
