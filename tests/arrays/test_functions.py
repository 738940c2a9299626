"""Functions in arrays, tuples and records, and chosen by plain conditions."""

from __future__ import annotations

import math

import numpy as np
import pytest

import potto

MODULE = potto.compile(r"""
shapes = [\x . x, \x . x^2, \x . [x < 0.5]]
def at(i, x) shapes[i](x)
def all_of(x) [s(x) for s in shapes]
def scene(t) integral [0, 1] sum s in shapes (s(x*t)) d(x)
def picked(i, t) integral [0, 1] shapes[i](x*t) d(x)
def chosen(p, t) integral [0, 1] (if p > 0 then sin else cos)(x*t) d(x)
record Light(shader: Real -> Real, power: Real)
lamp = Light(shader=\x . x^2, power=2)
def lit(l: Light, t) integral [0, 1] l.power*l.shader(x*t) d(x)
pair = (\x . 3*x, 5)
def part(t) pair.0(t) + pair.1
""")
T = 0.8
EXACT = [T / 2, T**2 / 3, min(1, 0.5 / T)]


def test_elements_that_are_functions() -> None:
    assert [MODULE.at(i, 3).value for i in range(3)] == [3, 9, 0]
    assert MODULE.at(np.array([0.0, 1, 2, 1]), np.array([3.0, 3, 0.25, 4])).value.tolist() == [3, 9, 1, 16]
    assert MODULE.all_of(0.25).value.tolist() == [0.25, 0.0625, 1]
    assert potto.grad(MODULE.at, "x")(1.0, 3.0).tangent == 6


def test_functions_of_an_array_under_an_integral() -> None:
    found = potto.grad(MODULE.scene)(T)
    assert found.value == pytest.approx(sum(EXACT), rel=1e-13)
    assert found.tangent == pytest.approx(1 / 2 + 2 * T / 3 - 0.5 / T**2, rel=1e-12)
    for number, exact in enumerate(EXACT):
        assert MODULE.picked(number, T).value == pytest.approx(exact, rel=1e-13)
    assert MODULE.picked(np.array([0.0, 2, 1]), T).value == pytest.approx([EXACT[i] for i in (0, 2, 1)], rel=1e-13)
    with pytest.raises(potto.PottoError, match="out of range"):
        MODULE.picked(3, T)


def test_functions_chosen_by_a_plain_condition() -> None:
    assert MODULE.chosen(1, T).value == pytest.approx((1 - math.cos(T)) / T, rel=1e-13)
    assert MODULE.chosen(-1, T).value == pytest.approx(math.sin(T) / T, rel=1e-13)
    slope = potto.grad(MODULE.chosen, "t")(-1.0, T).tangent
    assert slope == pytest.approx(math.cos(T) / T - math.sin(T) / T**2, rel=1e-12)


def test_functions_in_records_and_tuples() -> None:
    module_of_lamp = MODULE.eval("lit(lamp, 0.8)")
    assert module_of_lamp.value == pytest.approx(2 * EXACT[1], rel=1e-13)
    assert MODULE.part(2).value == 11


def test_a_condition_that_varies_chooses_between_numbers() -> None:
    with pytest.raises(potto.PottoError, match="P0313"):
        potto.compile("def f(t) integral [0, 1] (if [x < t] then sin else cos)(x) d(x)")
