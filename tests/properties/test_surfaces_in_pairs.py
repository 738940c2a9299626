"""Two surfaces at a time, of every kind: where they cross, the integral further out has a kink that must not be missed.

Periodic and searched sections in both orders of the variables, and conics; values and derivatives by `plain_sections`
and `two_conics`, each with what it knows of its own error. Nothing may be off by more than is reported.
"""

from __future__ import annotations

import random
import warnings

from how_many import examples
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from plain_sections import Answer
from two_conics import two_conics
from two_surfaces import two_surfaces

import potto

ROUNDING = 1e-11  # of the references
POOR = 1e-7  # a reference that is no better than this is none


def compared(source: str, t: float, exact: Answer) -> bool:
    """Whether the program converged; it must be right within what it reports."""
    if exact.value_error > POOR or exact.slope_error > POOR:
        return False
    with potto.settings(max_evals=2_000_000), warnings.catch_warnings():
        warnings.simplefilter("ignore", potto.ProgramWarning)
        found = potto.deriv(potto.compile(source).f)((t, 1.0))
    context = f"{source}at {t}: {found}, {exact}"
    assert abs(found.value - exact.value) <= found.error + 3 * exact.value_error + ROUNDING, context
    allowed = found.tangent_error + 3 * exact.slope_error + ROUNDING * (1 + abs(exact.slope)) * 100
    assert abs(found.tangent - exact.slope) <= allowed, context
    assert found.converged or found.reasons, context
    return found.converged


def near_the_bounds(number: int) -> float:
    """A parameter, half of them such that surfaces meet near a corner of the box."""
    pick = random.Random(number)
    return pick.choice([0.03, 0.97, round(pick.uniform(0.02, 1.0), 3), round(pick.uniform(0.02, 1.0), 3)])


def periodic_or_searched(number: int) -> bool:
    source, region = two_surfaces(number)
    t = near_the_bounds(number)
    return compared(source, t, region.integral(t))


def conics(number: int) -> bool:
    scene = two_conics(number)
    t = round(random.Random(number + 1).uniform(0.02, 0.4), 3)
    value, slope, value_error, slope_error = scene.area(t)
    return compared(scene.source, t, Answer(value, slope, value_error, slope_error))


@settings(max_examples=examples(25), suppress_health_check=list(HealthCheck))
@given(st.integers(0, 10**6))
def test_periodic_and_searched_sections_beside_others(number: int) -> None:
    periodic_or_searched(number)


@settings(max_examples=examples(25), suppress_health_check=list(HealthCheck))
@given(st.integers(0, 10**6))
def test_two_conics(number: int) -> None:
    conics(number)


def test_cuts_are_kept_beside_a_formula_that_changes_sides() -> None:
    """The crossing at y = 0.93066 of two ellipses whose roots are written otherwise on the two sides of y = 0.51."""
    assert conics(550182)


def test_nearly_all_of_them_converge() -> None:
    assert sum(map(periodic_or_searched, range(20))) >= 19
    assert sum(map(conics, range(20))) >= 19
