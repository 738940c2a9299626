"""Integrals of brackets over one variable, with everything in awkward places, against exact rational arithmetic.

Ends that coincide and move apart, lie on bounds, merge, turn; ranges of length zero, reversed, with bounds that move;
as numbers and as arrays. An error that is reported must cover what is wrong; a derivative with two sides must come
with both, or with an error that covers both.
"""

from __future__ import annotations

import random
from fractions import Fraction

import numpy as np
from exact_answers import Rates, compare, rounding
from exact_stretches import random_stretch
from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st

import potto


def check(number: int) -> str:
    """Compare one program; what came of it."""
    pick = random.Random(number)
    stretch = random_stretch(pick)
    t = pick.choice((0.0, 0.0, 0.25, 0.5, -0.5, 1.0, 1e-8, pick.uniform(-1, 1)))
    dual = potto.deriv(potto.compile(stretch.text).f)
    answer = dual((t, 1.0))
    value, rates = float(stretch.value(Fraction(t))), Rates.of(stretch.rate, Fraction(t))
    context = f"program {number} at t = {t!r}:\n{stretch.text}\nis {value!r}, {rates}\n"
    outcome = compare(answer, value, rates, f"{context}{answer!r}")
    if pick.random() < 0.3:
        many = dual((np.array([t, 0.375, t]), np.ones(3)))
        assert abs(many.value[2] - value) <= many.error[2] + rounding(value), f"{context}as array {many!r}"
        if outcome == "compared":
            off = abs(many.tangent[2] - rates.forward)
            assert off <= many.tangent_error[2] + rounding(rates.forward), f"{context}as array {many!r}"
    return outcome


@seed(20262)
@settings(max_examples=100, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.integers(0, 10**9))
def test_stretches_in_awkward_places(number: int) -> None:
    check(number)
