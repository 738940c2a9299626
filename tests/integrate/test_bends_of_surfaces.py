"""Second and third derivatives through surfaces that have kinks, look pixels up, or meet a delta.

Expected values are closed forms, differentiated by hand or by mpmath at 30 digits.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import mpmath as mp
import pytest

import potto

DERIVATIVES = """
def first(t) snd(deriv(f)((t, 1)))
def second(t) snd(deriv(first)((t, 1)))
def third(t) snd(deriv(second)((t, 1)))
"""


def norm_ball(p: Any) -> Any:
    """The area of |x|^p + |y|^p < 0.7."""
    return 4 * mp.gamma(1 + 1 / p) ** 2 / mp.gamma(1 + 2 / p) * mp.mpf("0.7") ** (2 / p)


def below_a_level(t: Any) -> Any:
    """How much of [0, 1] has a level below 0.4, of the picture at height 0.3 + t*u, which for u from 1/6 to 1/2 is
    bilinear in its first two columns, and from 1/2 to 5/6 in the others; beyond that it is clamped to their centres."""
    rows = [[mp.mpf(x) for x in row] for row in (("0.1", "0.7", "0.2"), ("0.5", "0.3", "0.9"))]

    def level(u: Any) -> Any:
        along, down = min(max(3 * u - mp.mpf(1) / 2, 0), 2), min(max(2 * (mp.mpf("0.3") + t * u) - mp.mpf(1) / 2, 0), 1)
        column = min(int(along), 1)
        part = along - column
        upper, lower = ((1 - part) * row[column] + part * row[column + 1] for row in rows)
        return (1 - down) * upper + down * lower - mp.mpf("0.4")

    places = [mp.mpf(k) / 300 for k in range(301)]
    signs = [level(u) < 0 for u in places]
    crossings = [
        mp.findroot(level, (a, b), solver="anderson", tol=1e-50)
        for (a, b), (low, high) in zip(pairwise(places), pairwise(signs), strict=True)
        if low != high
    ]
    edges = [mp.mpf(0), *crossings, mp.mpf(1)]
    return sum(b - a for k, (a, b) in enumerate(pairwise(edges)) if signs[0] == (k % 2 == 0))


# The error that is allowed is that of the search for roots without a closed form, whose places have 1e-15.
CASES: list[tuple[str, float, Callable[[Any], Any], float]] = [
    ("integral ([-1, 1], [-1, 1]) [abs(x)*t + abs(y) < 0.7] d(x, y)", 0.8, lambda t: mp.mpf("0.98") / t, 1e-12),
    ("integral ([-1, 1], [-1, 1]) [abs(x) + abs(y) < t] d(x, y)", 0.8, lambda t: 2 * t * t, 1e-12),
    ("integral ([-1, 1], [-1, 1]) [abs(x)^t + abs(y)^t < 0.7] d(x, y)", 1.8, norm_ball, 1e-7),
    ("integral ([0, 1], [0, 1]) [max(x*t, y) < 0.7] d(x, y)", 1.3, lambda t: mp.mpf("0.49") / t, 1e-12),
    (
        "integral [0, 1] [image([[0.1, 0.7, 0.2], [0.5, 0.3, 0.9]], u, 0.3 + t*u) < 0.4] d(u)",
        0.35,
        below_a_level,
        1e-11,
    ),
]


@pytest.mark.parametrize(("body", "at", "exact", "within"), CASES, ids=[case[0] for case in CASES])
def test_second_derivatives_through_kinks(body: str, at: float, exact: Callable[[Any], Any], within: float) -> None:
    found = potto.compile(f"def f(t) {body}{DERIVATIVES}").second(at)
    with mp.workdps(30):
        expected = float(mp.diff(exact, mp.mpf(repr(at)), 2))
    assert abs(float(found) - expected) <= found.error + 1e-13 and found.error <= within * max(1.0, abs(expected))


@pytest.mark.parametrize(("body", "at", "exact"), [(CASES[0][:3]), (CASES[2][:3])])
def test_third_ones(body: str, at: float, exact: Callable[[Any], Any]) -> None:
    """The velocity of the surface jumps at its kinks, which the derivative of an integral over it counts."""
    found = potto.compile(f"def f(t) {body}{DERIVATIVES}").third(at)
    with mp.workdps(30):
        expected = float(mp.diff(exact, mp.mpf(repr(at)), 3))
    assert abs(float(found) - expected) <= found.error + 1e-12 and found.error <= 1e-6


@pytest.mark.parametrize(
    ("inside", "factor", "exact"),
    [
        ("x^2 + y^2 < 1", "1", lambda t: mp.acos(t / 2)),
        # Over the angle: half of the integral of exp(cos u) from acos(-t/2) to its mirror image.
        ("x^2 + y^2 < 1", "exp(x - t)", lambda t: mp.quad(lambda u: mp.exp(mp.cos(u)), [mp.acos(-t / 2), mp.pi])),
    ],
)
def test_a_circle_under_a_delta_that_another_one_cuts(inside: str, factor: str, exact: Callable[[Any], Any]) -> None:
    """Both turn back along either variable, though not where they meet."""
    body = f"integral ([-2, 2], [-2, 2]) [{inside}]*delta(1 - (x - t)^2 - y^2)*{factor} d(x, y)"
    found = potto.compile(f"def f(t) {body}{DERIVATIVES}").second(0.5)
    with mp.workdps(30):
        expected = float(mp.diff(exact, mp.mpf("0.5"), 2))
    assert abs(float(found) - expected) <= found.error + 1e-14 and found.error <= 1e-11 and found.converged
