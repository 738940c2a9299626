"""Integrals of brackets over one variable, with everything in awkward places, against exact rational arithmetic.

Ends that coincide and move apart, lie on bounds, merge, turn; ranges of length zero, reversed, with bounds that move;
as numbers and as arrays. An error that is reported must cover what is wrong; a derivative with two sides must come
with both, or with an error that covers both.
"""

from __future__ import annotations

import random
from fractions import Fraction

import pytest
from exact_answers import held_against
from exact_stretches import random_stretch
from how_many import examples, the_same
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import potto


def check(number: int) -> str:
    """Compare one program; what came of it."""
    pick = random.Random(number)
    stretch = random_stretch(pick)
    t = pick.choice((0.0, 0.0, 0.25, 0.5, -0.5, 1.0, 1e-8, pick.uniform(-1, 1)))
    text = f"# program {number}\n{stretch.text}"
    return held_against(text, t, stretch.value(Fraction(t)), stretch.rate, pick.random() < 0.3)


@the_same(20262)
@settings(max_examples=examples(100), deadline=None, suppress_health_check=list(HealthCheck))
@given(st.integers(0, 10**9))
def test_stretches_in_awkward_places(number: int) -> None:
    check(number)


@pytest.mark.parametrize("number", [310400, 313576])
def test_stretches_that_were_wrong(number: int) -> None:
    """What lies at a bound is shorter than how far beside it was looked."""
    check(number)


@pytest.mark.parametrize("width", [1e-3, 1e-6, 1e-7, 1e-8, 1e-12, 1e-16])
def test_a_short_stretch_at_a_bound(width: float) -> None:
    """(x - w)^2 < t^2 on [0, 1] at t = w: it ends at 0 and 2 w, and grows by 1 as it comes in, shrinks by 2."""
    f = potto.compile(f"def f(t) integral [0, 1] [(x - {width!r})^2 < t^2] d(x)").f
    answer = potto.deriv(f)((width, 1.0))
    assert abs(answer.value - 2 * width) <= answer.error + 1e-15 * width
    assert [(float(note.backward), float(note.forward)) for note in answer.notes] == [(2.0, 1.0)]


@pytest.mark.parametrize("gap", [1e-3, 1e-7, 1e-9, 1e-12])
def test_two_short_stretches_that_meet(gap: float) -> None:
    """[x < g] and [x < t] count together, beside a stretch that begins within g of where they meet."""
    body = f"[x < {gap!r} and not x < t]*(1 + [x < {0.5 * gap!r}])"
    answer = potto.deriv(potto.compile(f"def f(t) integral [-1, 1] {body} d(x)").f)((gap, 1.0))
    assert abs(answer.value) <= answer.error
    assert [(float(note.backward), float(note.forward)) for note in answer.notes] == [(-1.0, 0.0)]
