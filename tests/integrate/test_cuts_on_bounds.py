"""Cuts that lie on a bound: the derivatives to both sides by rules with a proof, against closed forms.

Tolerances are a few roundings of numbers of this size: the rules leave out less. Few evaluations tell that they are
used.
"""

from __future__ import annotations

from fractions import Fraction
from itertools import product

import pytest

import potto

EVENING = """
def hour(t, reading, set) t - (t - 5)/8 + (if [t + reading < set] then 3 else 0)
def cost(set)
    integral (a ~ uniform(-3, 3), b ~ uniform(-3, 3), c ~ uniform(-3, 3))
        (hour(hour(hour(17, a, set), b, set), c, set) - 20)^2
        d(a, b, c)
"""


def expected_cost(place: Fraction, step: Fraction) -> tuple[Fraction, Fraction]:
    """The value, and its slope between `place` and `place + step`, of which the probabilities are polynomials there."""

    def chance(temperature: Fraction, at: Fraction) -> Fraction:
        return min(max((at - temperature + 3) / 6, Fraction(0)), Fraction(1))

    def cost(at: Fraction) -> Fraction:
        total = Fraction(0)
        for ways in product((True, False), repeat=3):
            t, weight = Fraction(17), Fraction(1)
            for heated in ways:
                p = chance(t, at)
                weight *= p if heated else 1 - p
                t = t - (t - 5) / 8 + (3 if heated else 0)
            total += weight * (t - 20) ** 2
        return total

    f0, f1, f2, f3 = (cost(place + i * step) for i in range(4))
    return f0, (-11 * f0 + 18 * f1 - 9 * f2 + 2 * f3) / (6 * step)  # exact for cubics


@pytest.mark.parametrize("place", [Fraction(20), Fraction(43, 2), Fraction(31, 2), Fraction(14)])
def test_an_evening_at_set_points_that_put_a_cut_on_the_end_of_the_noise(place: Fraction) -> None:
    value, forward = expected_cost(place, Fraction(1, 4096))
    _, backward = expected_cost(place, Fraction(-1, 4096))
    found = potto.deriv(potto.compile(EVENING).cost)((float(place), 1.0))
    v, t = (float(x) for x in found)
    assert v == pytest.approx(float(value), rel=1e-13)
    if forward == backward:
        assert not found.notes
        assert t == pytest.approx(float(forward), rel=1e-12, abs=1e-12)
    else:
        (note,) = found.notes
        assert float(note.backward) == pytest.approx(float(backward), rel=1e-12, abs=1e-12)
        assert float(note.forward) == pytest.approx(float(forward), rel=1e-12, abs=1e-12)
        assert min(abs(t - float(backward)), abs(t - float(forward))) < 1e-12
    assert found.evals < 1000


@pytest.mark.parametrize(
    ("source", "at", "value", "backward", "forward"),
    [
        ("integral [0, 1] (if [x < t] then x^2 else 3*x) d(x)", 1.0, 1 / 3, -2.0, 0.0),
        ("integral [0, 1] (if [x > t] then x^2 + 1 else 3*x) d(x)", 0.0, 4 / 3, 0.0, -1.0),
        ("integral [0, 3] [x < t - 1.7]*x d(x)", 4.7, 9 / 2, 3.0, 0.0),
        ("integral [0, t] [x < 1]*x d(x)", 1.0, 1 / 2, 1.0, 0.0),
        ("integral [t, 2] [x > 1]*x d(x)", 1.0, 3 / 2, 0.0, -1.0),
        ("integral [0, 2 - t] (if [x < t] then x else 5) d(x)", 1.0, 1 / 2, -9.0, -1.0),
        ("integral (x ~ uniform(0, 1), y ~ uniform(0, 1)) ([x < t] + 2*[y < 2*t - 1]) d(x, y)", 1.0, 3.0, 5.0, 0.0),
        ("integral (x ~ uniform(0, 1), y ~ uniform(0, 1)) ([x < t] + 2*[y < 1 - t]) d(x, y)", 1.0, 1.0, -1.0, 0.0),
        ("integral (x ~ uniform(0, 1), y ~ uniform(-1, 1)) [y < t]*(1 + y)*x d(x, y)", 1.0, 1 / 2, 1 / 2, 0.0),
    ],
)
def test_one_sided_derivatives(source: str, at: float, value: float, backward: float, forward: float) -> None:
    found = potto.deriv(potto.compile(f"def f(t) {source}").f)((at, 1.0))
    assert float(found[0]) == pytest.approx(value, rel=1e-14)
    assert float(found[1]) == pytest.approx(
        min(backward, forward, key=lambda side: abs(side - float(found[1]))), abs=1e-13
    )
    for note in found.notes:
        assert (float(note.backward), float(note.forward)) == pytest.approx((backward, forward), abs=1e-13)
    assert found.notes and found.evals <= 16


def test_a_bound_that_is_a_cut_as_well() -> None:
    """Inside of the range [x < 1] is 1 up to the bound."""
    (note,) = potto.deriv(potto.compile("def f(t) integral [0, 1] [x < 1]*[x > t]*x d(x)").f)((1.0, 1.0)).notes
    assert (float(note.backward), float(note.forward)) == pytest.approx((-1.0, 0.0), abs=1e-13)


def test_a_cut_that_stays_on_a_bound_has_one_derivative() -> None:
    found = potto.deriv(potto.compile("def f(t, s) integral [0, s] (if [x < 1] then x*t else 5) d(x)").f)(
        (2.0, 1.0), 1.0
    )
    assert not found.notes
    assert [float(x) for x in found] == pytest.approx([1.0, 0.5], rel=1e-14)
    assert float(potto.compile("def f(t) integral [0, 1] [x < t] d(x)").f(1.0)) == pytest.approx(1.0, rel=1e-15)
