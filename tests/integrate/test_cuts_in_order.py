"""Cuts that lie in the order of the call before, and cuts that pass each other, leave the range or are not there:
one program along a course of parameters, against closed forms in 30 digits.
"""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from call_counts import calls_in

import potto

DIGITS = 30
NAMES = ("a", "b", "c", "k", "d", "e")
PROGRAM = """
def f(a, b, c, k, d, e)
  integral [0, 1] exp(x)*([x < a] + 2*[x^2 < b] + 4*[exp(x) < 1 + c] + 8*[k*x < d] + 16*[x^3 < e]) d(x)
"""
COURSE = [
    (0.2, 0.16, 0.9, 1.0, 0.8, 0.7),
    (0.21, 0.17, 0.91, 1.01, 0.81, 0.71),  # as before
    (0.6, 0.17, 0.91, 1.01, 0.81, 0.71),  # one passes others
    (0.6, 0.17, 0.91, -1.01, -0.81, 0.71),  # the same cut, and the other side of it
    (0.61, 0.17, 0.9, -1.02, -0.82, 0.7),
    (0.61, -0.17, 0.9, -1.02, -0.82, 0.7),  # a pair of roots less
    (0.61, -0.18, 0.91, -1.02, -0.82, 0.7),
    (0.61, -0.18, -1.5, -1.02, -0.82, 0.7),  # exp(x) is never below -0.5
    (0.61, -0.18, -1.6, -1.02, -0.82, 0.7),
    (0.61, -0.18, 2.5, -1.02, -0.82, 0.7),  # and always below 3.5
    (1.3, 0.25, 0.9, -1.02, 0.82, -0.7),  # beyond the bounds, on either side
    (1.31, 0.26, 0.91, -1.02, 0.81, -0.71),
    (-0.2, 0.26, 0.91, 1.02, 0.81, 0.71),
]


def exact(at: tuple[float, ...]) -> tuple[mpmath.mpf, list[mpmath.mpf]]:
    """The value and the derivatives: each condition holds up to its place, or from there."""
    with mpmath.workdps(DIGITS):
        a, b, c, k, d, e = map(mpmath.mpf, at)
        roots = [(a, 1, {"a": 1})]
        roots.append((mpmath.sqrt(b), 2, {"b": 0.5 / mpmath.sqrt(b)}) if b > 0 else (mpmath.mpf(-1), 2, {}))
        roots.append((mpmath.log(1 + c), 4, {"c": 1 / (1 + c)}) if c > -1 else (mpmath.mpf(-1), 4, {}))
        roots.append((d / k, 8, {"k": -d / k**2, "d": 1 / k}))
        cube = mpmath.sign(e) * mpmath.cbrt(abs(e))
        roots.append((cube, 16, {"e": 1 / (3 * cube**2)}))
        value, slopes = mpmath.mpf(0), dict.fromkeys(NAMES, mpmath.mpf(0))
        for place, weight, speeds in roots:
            end, rising = min(max(place, mpmath.mpf(0)), mpmath.mpf(1)), weight != 8 or k > 0
            value += weight * (mpmath.exp(end) - 1 if rising else mpmath.e - mpmath.exp(end))
            for name, speed in speeds.items() if 0 < place < 1 else ():
                slopes[name] += (weight if rising else -weight) * mpmath.exp(place) * speed
        return value, list(slopes.values())


@pytest.mark.parametrize("course", [COURSE, COURSE[::-1]])
def test_along_a_course_of_parameters(course: list[tuple[float, ...]]) -> None:
    """Within the bounds that answers give, and 1e-13 of the largest number, as one cut is off by 1e-15 of itself."""
    f = potto.compile(PROGRAM).f
    gradient = potto.grad(f, list(NAMES))
    for at in course:
        value, slopes = exact(at)
        size = max(map(abs, (value, *slopes)))
        for answer in (f(*at), gradient(*at)):
            assert answer.converged
            assert abs(answer.value - value) <= min(answer.error, 1e-13 * size)
        for found, error, slope in zip(answer.tangent, answer.tangent_error, slopes, strict=True):
            assert abs(found - slope) <= min(error, 1e-13 * size) or found == slope


def test_what_the_order_decides_is_found_once() -> None:
    """Functions that a call of a union of twenty calls: where cuts lie as before, less than where they do not."""
    names = [f"a{k}" for k in range(20)]
    inside = " or ".join(f"abs(x - {name}) < 0.01" for name in names)
    f = potto.compile(f"def f({', '.join(names)}) integral [0, 1] exp(x)*[{inside}] d(x)").f
    places = np.linspace(0.1, 0.9, 20)
    f(*places)
    f(*places[::-1])
    again, turned = calls_in(lambda: f(*places[::-1] + 1e-3)), calls_in(lambda: f(*places))
    assert again < 0.75 * turned


def test_what_rises_is_not_asked_where_it_is_above() -> None:
    """Functions that a call calls: of a surface that rises the root tells the sides, as of a line. The formula of a
    cube root goes by a sign, which is looked at for each."""
    costs = []
    for condition in ("x < {}", "exp(x) < 1 + {}", "x^3 < {}"):
        terms = " + ".join(f"[{condition.format(f'{k}/31*t')}]" for k in range(1, 31))
        f = potto.compile(f"def f(t) integral [0, 1] 1/(1 + {terms}) d(x)").f
        f(0.9)
        f(0.8)
        costs.append(calls_in(lambda f=f: f(0.85)))  # type: ignore[misc]
    line, exponential, cube = costs
    assert exponential <= 1.5 * line
    assert cube <= 4 * line


@pytest.mark.parametrize("condition", ["sqrt(x) > 0", "sqrt(x)*(1 + x) > 0", "log(x) < 5*a"])
def test_where_a_condition_has_no_value_is_told(condition: str) -> None:
    """Below 0, also where its only root is the end of what it is defined on."""
    others = " + ".join(f"[x < a/{k}]" for k in range(2, 8))
    f = potto.compile(f"def f(a) integral [-1, 1] 1/(1 + [{condition}] + {others}) d(x)").f
    assert np.isnan(f(0.9).value)
