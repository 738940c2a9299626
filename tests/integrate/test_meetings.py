"""Surfaces that coincide at the parameters given and move apart: added up they have a derivative, multiplied two."""

from __future__ import annotations

import numpy as np
import pytest

import potto

# At t = 1/2 both conditions of each program change at the same place, with speeds 1 and 2.
PROGRAM = """
def added(t) integral [0, 1] ([x < t] + [x < 2*t - 0.5]) d(x)
def times(t) integral [0, 1] [x < t]*[x < 2*t - 0.5] d(x)
def either(t) integral [0, 1] max([x < t], [x < 2*t - 0.5]) d(x)
def apart(t) integral [0, 1] exp(x)*([x < t] - [x < 2*t - 0.5]) d(x)
def plane(t) integral ([0, 1], [0, 1]) ([x + y < t] + [x + y < 2*t - 0.5]) d(x, y)
def corner(t) integral ([0, 1], [0, 1]) [x + y < t]*[x + y < 2*t - 0.5] d(x, y)
def top(t) integral ([0, 1], [0, 1]) exp(x)*[y < 2*t] d(x, y)
def bound(t) integral [0, 1] [x < 1 - 2*t]*[x < 0.5 - t] d(x)
def both_ways(t) integral [0, 1] ([x > t - 0.5] - [x > 0.5 - t]) d(x)
def three(t) integral [0, 1] [x < t]*[x < 2*t - 0.5]*[x < 3*t - 1] d(x)
"""


def rate(name: str) -> potto.Estimate:
    found: potto.Estimate = potto.deriv(getattr(potto.compile(PROGRAM), name))((0.5, 1.0))
    return found


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("added", 3.0),  # 1 + 2
        ("apart", -np.exp(0.5)),  # e^(1/2) (1 - 2)
        ("both_ways", -1.0),  # of two surfaces on one bound one comes in as t grows, one as it shrinks
        ("plane", 1.5),  # areas t^2/2 and (2 t - 1/2)^2/2
    ],
)
def test_jumps_that_are_added_up_have_the_sum_of_their_derivatives(name: str, expected: float) -> None:
    got = rate(name)
    assert abs(got.tangent - expected) <= 1e-14 * abs(expected)
    assert got.converged and not got.notes and got.tangent_error < 1e-12


@pytest.mark.parametrize(
    ("name", "backward", "forward"),
    [
        ("times", 2.0, 1.0),  # min(t, 2 t - 1/2)
        ("either", 1.0, 2.0),  # max(t, 2 t - 1/2)
        ("corner", 1.0, 0.5),  # min(t, 2 t - 1/2)^2/2
        ("three", 3.0, 1.0),  # min(t, 2 t - 1/2, 3 t - 1)
        ("bound", -1.0, 0.0),  # two surfaces on one bound: max(min(1 - 2 t, 1/2 - t), 0)
        ("top", 2 * (np.e - 1), 0.0),  # min(2 t, 1) (e - 1): a surface on a bound, further in
    ],
)
def test_where_there_are_two_derivatives_both_are_told(name: str, backward: float, forward: float) -> None:
    got = rate(name)
    (note,) = got.notes
    assert abs(note.backward - backward) <= 1e-13 and abs(note.forward - forward) <= 1e-13
    assert min(abs(got.tangent - backward), abs(got.tangent - forward)) <= 1e-13


def test_the_note_names_both_surfaces() -> None:
    (note,) = rate("times").notes
    assert str(note) == (
        "the surface x = t coincides with x + 0.5 = 2*t: the one-sided derivatives differ (2 backward, 1 forward)"
    )


@pytest.mark.parametrize("level", [0.0, 1e-17, 1e-12, 1e-9, 0.1, 0.25, 0.3])
@pytest.mark.parametrize("order", ["x, y", "y, x"])
def test_lines_that_coincide_where_their_place_is_rounded(level: float, order: str) -> None:
    """The lower one of y - x = a + t/2 and a + t counts: int_0^(1-a) (2 x + a) dx = 1 - a, times its speed."""
    body = f"[y - x < {level!r} + 0.5*t]*[y - x < {level!r} + t]*(x + y)"
    f = potto.compile(f"def f(t)\n    integral ([0, 1], [0, 1]) {body} d({order})").f
    (note,) = potto.deriv(f)((0.0, 1.0)).notes
    whole = 1 - level
    assert abs(note.backward - whole) <= note.backward_error + 1e-15
    assert abs(note.forward - whole / 2) <= note.forward_error + 1e-15
