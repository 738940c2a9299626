"""Integrals of brackets over one variable, with everything in awkward places, against exact rational arithmetic.

Ends that coincide and move apart, lie on bounds, merge, turn; ranges of length zero, reversed, with bounds that move;
as numbers and as arrays. An error that is reported must cover what is wrong; a derivative with two sides must come
with both, or with an error that covers both.
"""

from __future__ import annotations

import random
from fractions import Fraction

from exact_answers import held_against
from exact_stretches import random_stretch
from how_many import examples, the_same
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st


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
