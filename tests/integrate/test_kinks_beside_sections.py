"""Surfaces without closed-form sections, or with periodic ones, where they cross others: kinks further out.

The regions are intervals in y whose ends are explicit functions, so that mpmath integrates them piece by piece.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath as mp
import numpy as np
import pytest

import potto


def triangle(h: Any) -> Any:
    """The area below y = x and y = h in the unit square."""
    h = min(max(h, mp.mpf(0)), mp.mpf(1))
    return h - h * h / 2


def sine_triangle(a: Any, factor: Any = 3) -> Any:
    """Of y < x and sin(factor y) < a, for 0 < a < sin(factor) or where the sine stays below its second crossing."""
    first, second = mp.asin(a) / factor, (mp.pi - mp.asin(a)) / factor
    return triangle(first) + mp.mpf(1) / 2 - triangle(second)


def root(f: Callable[[Any], Any], low: float = 0, high: float = 1) -> Any:
    low, high = mp.mpf(low), mp.mpf(high)
    if f(low) * f(high) > 0:
        return high if f(low) < 0 else low
    return mp.findroot(f, (low, high), solver="anderson", tol=1e-60)


def searched(a: Any) -> Any:
    return triangle(root(lambda y: y**3 + y - a))


CASES: list[tuple[str, Callable[[Any], Any], list[float]]] = [
    ("[y < x]*[sin(3*y) < a]", sine_triangle, [0.03, 0.01, 0.5, 0.9]),
    ("[sin(3*y) < a]*[y < x]", sine_triangle, [0.03]),
    ("[x > y]*[a > sin(3*y)]", sine_triangle, [0.03]),
    ("(if [sin(3*y) < a] then [y < x] else 0)", sine_triangle, [0.03]),
    ("[y < x and sin(3*y) < a]", sine_triangle, [0.03]),
    ("under(x, y)*[sin(3*y) < a]", sine_triangle, [0.03, 0.02]),
    ("[y < x]*[cos(3*y) > 1 - a]", lambda a: triangle(mp.acos(1 - a) / 3), [0.03, 0.2]),
    ("[y < x]*[tan(y) < a]", lambda a: triangle(mp.atan(a)), [0.03, 0.97]),
    ("[y < x]*[sin(3*y + 1) > a]", lambda a: triangle((mp.pi - mp.asin(a) - 1) / 3) - triangle((mp.asin(a) - 1) / 3),
     [0.97]),
    ("[y < x]*[sin(y)^2 < a]", lambda a: triangle(mp.asin(mp.sqrt(a))), [0.001, 0.5]),
    ("[y < x]*[y^3 + y < a]", searched, [0.03, 0.02, 0.5, 1.9]),
    ("[y < x]*[exp(y) + y < 1 + a]", lambda a: triangle(root(lambda y: mp.exp(y) + y - 1 - a)), [0.03, 1.5]),
    ("[y < x]*[y + 0.3*sin(2*y) < a]",
     lambda a: triangle(root(lambda y: y + mp.mpf(0.3) * mp.sin(2 * y) - a)), [0.03, 0.4]),
    # neither has roots in closed form along the variable that they cut: x < asin(a)/3 beside y^3 + y < x, and the like
    ("[y^3 + y < x]*[sin(3*y) < a]",
     lambda a: (lambda h: h - h**4 / 4 - h * h / 2)(min(mp.asin(a) / 3, root(lambda y: y**3 + y - 1))), [0.03, 0.5]),
    ("[y^3 + y < x]*[exp(y) + y < 1 + a]",
     lambda a: (lambda h: h - h**4 / 4 - h * h / 2)(
         min(root(lambda y: mp.exp(y) + y - 1 - a), root(lambda y: y**3 + y - 1))), [0.03, 0.5]),
    ("[sin(2*y) < x]*[sin(3*y) < a]",
     lambda a: (lambda h: h - mp.sin(h)**2)(mp.asin(a) / 3)
     + mp.quad(lambda y: max(1 - mp.sin(2 * y), 0), [min((mp.pi - mp.asin(a)) / 3, 1), 1]), [0.03, 0.2]),
]  # fmt: skip


@pytest.mark.parametrize("order", ["x, y", "y, x"])
@pytest.mark.parametrize(("body", "exact", "places"), CASES, ids=[body for body, _, _ in CASES])
def test_kinks_where_sections_cross(
    body: str, exact: Callable[[Any], Any], places: list[float], order: str
) -> None:  # fmt: skip
    f = potto.compile(f"def under(x, y) [y < x]\ndef f(a)\n    integral ([0, 1], [0, 1]) ({body}) d({order})\n").f
    for a in places:
        found = potto.deriv(f)((a, 1.0))
        with mp.workdps(40):
            value, slope = exact(mp.mpf(a)), mp.diff(exact, mp.mpf(a), h=mp.mpf("1e-12"))
        assert abs(found.value - value) <= found.error + 1e-15 <= 1e-9
        assert abs(found.tangent - slope) <= found.tangent_error + 1e-15 * (1 + abs(slope)) <= 1e-8
        assert found.converged


def test_arrays_and_second_derivatives() -> None:
    f = potto.compile("def f(a) integral ([0, 1], [0, 1]) ([y < x]*[sin(3*y) < a]) d(x, y)").f
    places = np.linspace(0.005, 0.13, 26)
    found = f(places)
    for a, value, error in zip(places, found.value, found.error, strict=True):
        assert abs(value - sine_triangle(mp.mpf(a))) <= error + 1e-15 <= 1e-9
    twice = potto.deriv(potto.deriv(f))(((0.03, 1.0), (1.0, 0.0)))
    with mp.workdps(40):
        bend = mp.diff(sine_triangle, mp.mpf(0.03), 2, h=mp.mpf("1e-10"))
    assert abs(twice.tangent[1] - bend) <= twice.tangent_error[1] + 1e-13 <= 1e-8


def test_in_three_variables() -> None:
    """Of y < x, y^3 + y < z and sin(3 y) < a: at each y an oblong, between crossings of surfaces that have no roots."""
    f = potto.compile("""
def f(a)
    integral ([0, 1], [0, 1], [0, 1]) ([y < x]*[y^3 + y < z]*[sin(3*y) < a]) d(z, x, y)
""").f
    top = root(lambda y: y**3 + y - 1)
    for a in (0.03, 0.6):
        found = potto.deriv(f)((a, 1.0))

        def exact(a: Any) -> Any:
            return mp.quad(lambda y: (1 - y) * (1 - y**3 - y), [0, min(mp.asin(a) / 3, top)])

        with mp.workdps(30):
            value, slope = exact(mp.mpf(a)), mp.diff(exact, mp.mpf(a), h=mp.mpf("1e-10"))
        assert abs(found.value - value) <= found.error + 1e-15 <= 1e-8
        assert abs(found.tangent - slope) <= found.tangent_error + 1e-13 <= 1e-7
