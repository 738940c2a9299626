"""Fitting: minima with answers on paper, targets, bounds, and the ends that are no minimum."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import potto

PROGRAM = """
def area(t) integral [0, 1] x*[x < t] d(x)
def loss(t) (area(t) - 0.08)^2
def rosenbrock(a, b, k) (1 - a)^2 + k*(b - a^2)^2
def two(a, b) (area(a), integral [0, 1] [x < a*b] d(x))
def box(x, a, b) integral [0, 1] a*[u < b*x] d(u)
def line(t) t
def kink(t) abs(t - 0.3)
def root(t) sqrt(t)
def trough(t) 2 + (t - 0.3)^2 + (t - 0.3)^3/8
def shaded(t, shader) integral [0, 1] shader(x)*[x < t] d(x) - t/4
"""


@pytest.fixture(scope="module")
def m():
    return potto.compile(PROGRAM)


def test_a_minimum_through_a_boundary_term(m):
    """t^2/2 = 0.08 at t = 0.4; without the boundary term the slope is 0 everywhere and nothing moves."""
    found = potto.fit(m.loss, {"t": 0.9})
    assert found.converged and abs(found["t"] - 0.4) < 1e-6 and found.reason == "no slope is left"


def test_the_way_is_told_step_by_step(m):
    told = []
    found = potto.fit(m.loss, {"t": 0.9}, progress=told.append)
    assert tuple(told) == found.steps and [s.number for s in told] == list(range(len(told)))
    assert told[0].parameters == (0.9,) and told[-1].value == found.value
    assert all(after.value <= before.value for before, after in itertools.pairwise(told))


def test_rosenbrocks_valley(m):
    found = potto.fit(m.rosenbrock, {"a": -1.2, "b": 1}, given={"k": 100})
    assert found.converged and abs(found["a"] - 1) < 1e-6 and abs(found["b"] - 1) < 1e-6


def test_targets_for_several_numbers(m):
    """a^2/2 = 0.18 and a b = 0.24 at a = 0.6, b = 0.4."""
    found = potto.fit(m.two, {"a": 0.5, "b": 0.5}, target=(0.18, 0.24))
    assert found.converged and abs(found["a"] - 0.6) < 1e-6 and abs(found["b"] - 0.4) < 1e-6


def test_a_table_of_targets(m):
    """min(1, b x) with b = 1.6 at eight places, in one array call a step."""
    x = np.linspace(0.1, 1, 8)
    found = potto.fit(m.box, {"b": 0.7}, given={"x": x, "a": 1.0}, target=np.minimum(1, 1.6 * x))
    assert found.converged and abs(found["b"] - 1.6) < 1e-6


def test_a_bound_that_holds(m):
    found = potto.fit(m.line, {"t": 0.9}, bounds={"t": (-1, 2)})
    assert found.converged and found["t"] == -1 and found.slope == 0


def test_a_function_among_what_is_given(m):
    """The derivative of int_0^t x dx - t/4 is t - 1/4."""
    found = potto.fit(m.shaded, {"t": 0.6}, given={"shader": potto.compile("def s(x) x").s})
    assert found.converged and abs(found["t"] - 0.25) < 1e-6


@pytest.mark.parametrize(("name", "reason"), [
    ("line", "runs away"), ("kink", "though a slope is left"), ("root", "not a number"),
])  # fmt: skip
def test_what_is_no_minimum_is_said(m, name, reason):
    found = potto.fit(getattr(m, name), {"t": 0.9})
    assert not found.converged and reason in found.reason


def test_where_values_have_no_digits_left_slopes_have(m):
    """Around a minimum of 2 a value tells places apart to 1e-8, half of its digits; the slope tells them all."""
    found = potto.fit(m.trough, {"t": 1.9})
    assert found.converged and abs(found["t"] - 0.3) < 1e-8


def test_too_few_steps_are_said(m):
    found = potto.fit(m.rosenbrock, {"a": -1.2, "b": 1}, given={"k": 100}, steps=3)
    assert not found.converged and "3 steps" in found.reason and len(found.steps) <= 4


@pytest.mark.parametrize(("arguments", "said"), [
    ({"start": {"s": 1.0}}, "no parameter `s`"),
    ({"start": {}}, "no parameter is named"),
    ({"start": {"t": 1.0}, "bounds": {"tt": (0, 1)}}, "did you mean `t`"),
    ({"start": {"t": -1.0}, "name": "root"}, "at the start"),
    ({"start": {"a": 0.5, "b": 0.5}, "name": "two"}, "give a target"),
    ({"start": {"a": 0.5, "b": 0.5}, "name": "two", "target": (1, 2, 3)}, "the target has 3 numbers"),
])  # fmt: skip
def test_mistakes_are_told(m, arguments, said):
    arguments = dict(arguments)
    function = getattr(m, arguments.pop("name", "area"))
    with pytest.raises(potto.PottoError) as caught:
        potto.fit(function, **arguments)
    diagnostic = caught.value.diagnostics[0]
    assert said in f"{diagnostic.message} {diagnostic.help}"


def test_an_array_of_records_starts_as_a_list_of_dicts() -> None:
    """(a - 1)^2 + (b + 2)^2 for each, so that the least place is known; within the tolerance of a fit's slopes."""
    module = potto.compile("record P(a: Real, b: Real)\ndef f(ps: [n] P) sum p in ps ((p.a - 1)^2 + (p.b + 2)^2)")
    found = potto.fit(module.f, {"ps": [{"a": 0.0, "b": 0.0}, {"a": 3.0, "b": 1.0}]})
    assert list(found.numbers) == ["ps[0].a", "ps[0].b", "ps[1].a", "ps[1].b"]
    assert [p["a"] for p in found.parameters["ps"]] == pytest.approx([1, 1], abs=1e-6)
    assert module.f(found.parameters["ps"]).value < 1e-10
