"""deriv(deriv(f)) and the symbolic dual on random programs, against differences of values by brute force.

Second differences with steps 0.02, 0.01 and 0.005, extrapolated, are good to about 1e-7 where f is smooth; where they
don't settle to 1e-4, the program has a kink nearby and nothing is compared.
"""

from __future__ import annotations

import math

import pytest
from how_many import examples
from plain_quadrature import Program, TooHard, estimate
from program_checks import Point, where
from program_source import random_program

import potto
from potto.diagnostics import PottoError

STEPS = (0.02, 0.01, 0.005)
BUDGET = 2_000_000


def bend(program: Program, point: Point) -> tuple[float, float]:
    """The second derivative along the direction of a point, and how far the extrapolations are apart. Raises TooHard,
    also where brute force has no number: scipy's besselj1 has none at infinity, where a density is 0."""
    value, off = estimate(program, **point.moved(0.0))
    found = []
    for h in STEPS:
        (up, a), (down, b) = estimate(program, **point.moved(h)), estimate(program, **point.moved(-h))
        found.append((up - 2 * value + down) / (h * h))
        off = max(off, a, b)
    first, second = (4 * found[1] - found[0]) / 3, (4 * found[2] - found[1]) / 3
    best = (16 * second - first) / 15
    if not math.isfinite(best):
        raise TooHard
    return best, 10 * abs(best - second) + (4e-13 * max(1.0, abs(value)) + 10 * off) / STEPS[-1] ** 2


def check(number: int) -> str:
    text, program = random_program(number, flat=True)
    point = where(number)
    try:
        exact, off = bend(program, point)
        f = potto.compile(text).f
        with potto.settings(max_evals=BUDGET):
            twice = potto.deriv(potto.deriv(f))(
                ((point.t, point.dt), (point.dt, 0.0)), ((point.s, point.ds), (point.ds, 0.0))
            )
            once = potto.deriv(f)((point.t, point.dt), (point.s, point.ds))
    except (TooHard, PottoError):
        return "refused"
    size = max(1.0, abs(exact))
    # The dual as a term, evaluated, says what the kernels' tangents say.
    (_, slope), (_, bound) = twice.value, twice.error
    if math.isnan(slope) or math.isnan(twice.tangent[1]):
        assert twice.reasons and not twice.converged, f"{text}{twice}"
        return "not known"
    assert abs(slope - once.tangent) <= bound + once.tangent_error + 1e-12 * size, f"{text}{slope} {once}"
    if off > 1e-4 * size:
        return "not smooth"
    (_, got), (_, error) = twice.tangent, twice.tangent_error
    assert abs(got - exact) <= error + off + 1e-6 * size, f"program {number}: {text}{twice} {exact} {point}"
    return "compared"


@pytest.mark.parametrize("start", range(300_000, 300_040, 10))
def test_second_derivatives(start: int) -> None:
    assert [check(number) for number in range(start, start + 10)].count("compared") >= 4


@pytest.mark.slow
@pytest.mark.parametrize("start", range(310_000, 310_000 + examples(50, 300), 50))
def test_many_second_derivatives(start: int) -> None:
    assert [check(number) for number in range(start, start + 50)].count("compared") >= 20
