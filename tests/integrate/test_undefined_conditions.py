"""Conditions that have no value in a part of the domain: the integral is not a number, and says where and why.

A guard, or a factor that is 0 there, keeps them out; then the answers are lengths and areas, by hand.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import potto

METHODS = ["quadrature", "mc", "qmc"]
AGREE = 1e-10  # of quadrature with closed forms: what is asked for by default


def dual(body: str, a: Any, by: Any = 1.0, before: str = "") -> Any:
    return potto.deriv(potto.compile(f"{before}\ndef f(a)\n    {body}").f)((a, by))


UNDEFINED = [  # what is integrated, and the parameter
    ("integral [-3, 3] [sqrt(1 + x) >= 1.25] d(x)", 0.0),
    ("integral [-3, 3] [sqrt(1 + x) < 2] d(x)", 0.0),
    ("integral [-3, 3] [sqrt(1 + x) < a] d(x)", 2.0),
    ("integral [-3, 3] [log(x) < a] d(x)", 0.3),
    ("integral [-3, 3] [log1p(x) > a] d(x)", 0.3),
    ("integral [-3, 3] [asin(x) < a] d(x)", 0.3),
    ("integral [-3, 3] [acos(x/2) > a] d(x)", 0.3),
    ("integral [-3, 3] [x^0.5 < a] d(x)", 0.3),
    ("integral [-3, 3] (if [sqrt(1 + x) < a] then 5 else x) d(x)", 0.3),
    ("integral [-3, 3] exp(x)*[sqrt(sqrt(1 + x) - 1) < a] d(x)", 0.3),
    ("integral [0, 1] [x < sqrt(a)] d(x)", -1.0),
    ("integral ([-3, 3], [0, 1]) [sqrt(1 + x) >= y] d(x, y)", 0.3),
    ("integral ([0, 1], [-3, 3]) [sqrt(1 + x) >= y*a] d(y, x)", 0.3),
    ("integral ([-1, 1], [-1, 1]) [y < sqrt(a - x^2)] d(x, y)", 0.5),
    ("integral [0, 1] (integral [-3, 3] [log(x) < a*y] d(x)) d(y)", 0.3),
    ("sin(integral [-3, 3] [x^1.5 < a] d(x))", 0.3),
]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("body", "a"), UNDEFINED, ids=[row[0] for row in UNDEFINED])
def test_a_condition_without_a_value_makes_the_integral_no_number(body: str, a: float, method: str) -> None:
    with potto.settings(method=method, samples=2000, seed=1):
        answer = dual(body, a)
    assert math.isnan(answer.value) and math.isnan(answer.tangent)
    assert not answer.error < math.inf and not answer.tangent_error < math.inf and not answer.converged
    (reason,) = answer.reasons
    assert reason.startswith("a condition has no value")


def test_it_is_told_where() -> None:
    (reason,) = dual("integral [-3, 3] [sqrt(1 + x) >= a] d(x)", 1.25).reasons
    where = float(reason.split("x = ")[1].split(":")[0])
    assert -3 <= where < -1 and "sqrt(x + 1)" in reason


@pytest.mark.parametrize("method", METHODS)
def test_behind_a_call_as_in_the_open(method: str) -> None:
    before = "def root(x) sqrt(1 + x)\ndef share(g, a) integral [-3, 3] [g(x) < a] d(x)"
    with potto.settings(method=method, samples=2000):
        for body in ("integral [-3, 3] [root(x) < a] d(x)", "share(root, a)", "share(\\x . log(x), a)"):
            answer = dual(body, 1.5, before=before)
            assert math.isnan(answer.value) and not answer.converged


DEFINED = [  # what is integrated, at which parameter, value, derivative
    ("integral [-3, 3] (if [x > -1] then [sqrt(1 + x) >= a] else 0) d(x)", 1.25, 3 - 0.5625, -2.5),
    ("integral [-3, 3] [x > -1]*[sqrt(1 + x) >= a] d(x)", 1.25, 3 - 0.5625, -2.5),
    ("integral [-3, 3] [x > -1 and sqrt(1 + x) >= a] d(x)", 1.25, 3 - 0.5625, -2.5),
    ("integral [-3, 3] (if [x > -1] then [sqrt(1 + x) < a] else 1) d(x)", 1.25, 3.5625, 2.5),
    ("integral [-3, 3] [x > 0.5]*[log(x) < a] d(x)", 0.3, math.exp(0.3) - 0.5, math.exp(0.3)),
    ("integral [0, 1] [sqrt(x) < a] d(x)", 0.3, 0.09, 0.6),
    ("integral [0, 1] [log(x) < a] d(x)", -0.5, math.exp(-0.5), math.exp(-0.5)),
    ("integral [-1, 1] [asin(x) < a] d(x)", 0.3, 1 + math.sin(0.3), math.cos(0.3)),
    ("integral [a, 3] [sqrt(x - a) < 1] d(x)", 0.25, 1.0, 0.0),
    ("integral [0, a] [log(x) > -1] d(x)", 2.0, 2 - math.exp(-1), 1.0),
    ("integral ([-1, 1], [-1, 1]) [sqrt(x^2 + y^2) < a] d(x, y)", 0.5, math.pi / 4, math.pi),
    ("integral ([-a, a], [0, 2]) [y < sqrt(a^2 - x^2)] d(x, y)", 0.5, math.pi / 8, math.pi / 2),
]


@pytest.mark.parametrize(("body", "a", "value", "tangent"), DEFINED, ids=[row[0] for row in DEFINED])
def test_where_it_has_one_everywhere_that_is_asked_for(body: str, a: float, value: float, tangent: float) -> None:
    answer = dual(body, a)
    assert abs(answer.value - value) <= answer.error + 1e-15 <= AGREE
    assert abs(answer.tangent - tangent) <= answer.tangent_error + 1e-15 <= AGREE
    assert answer.converged and not answer.reasons


@pytest.mark.parametrize("method", ["mc", "qmc"])
@pytest.mark.parametrize(("body", "a", "value", "tangent"), DEFINED[:5], ids=[row[0] for row in DEFINED[:5]])
def test_guards_and_factors_keep_samples_out(body: str, a: float, value: float, tangent: float, method: str) -> None:
    with potto.settings(method=method, samples=4096, seed=5):
        answer = dual(body, a)
    assert abs(answer.value - value) <= answer.error <= 0.3
    assert abs(answer.tangent - tangent) <= answer.tangent_error + 1e-12 <= 1e-9


def test_a_removable_singularity_is_no_hole() -> None:
    """sin(x)/x has no value at 0 alone, which is the middle of the domain."""
    root = 0.786683072049212  # of sin(x)/x = 0.9, by mpmath; the length is that of what lies beyond it and -it
    module = potto.compile("def sinc(x) sin(x)/x\ndef share(g, a) integral [-1, 1] [g(x) < a] d(x)")
    answer = module.share(module.sinc, 0.9)
    assert abs(answer.value - 2 * (1 - root)) <= answer.error + 1e-14 and answer.error <= 1e-9


def test_members_of_an_array_are_lost_one_by_one() -> None:
    """[x < sqrt(a)] over [0, 1] has no value for a < 0, and for others the length sqrt(a)."""
    for count in (5, 101):
        a = np.linspace(-0.9, 0.8, count)
        answer = dual("integral [0, 1] [x < sqrt(a)] d(x)", a, np.ones(count))
        assert (np.isnan(answer.value) == (a < 0)).all()
        good = a > 0
        assert (np.abs(answer.value - np.sqrt(np.abs(a)))[good] <= answer.error[good] + 1e-15).all()
        assert (answer.error[good] <= AGREE).all()
