"""What `auto` chooses: quadrature as long as it is affordable and the accuracy asked for is worth it; it says so."""

from __future__ import annotations

import math

import pytest

import potto


def cube(names: str, body: str) -> potto.Function:
    box = ", ".join(["[0, 1]"] * len(names))
    return potto.compile(f"def f(t) integral ({box}) {body} d({', '.join(names)})").f


@pytest.mark.parametrize(
    ("names", "body", "method"),
    [
        ("xyz", "[x^2 + y^2 + z^2 < t]", "quadrature"),
        ("xyzw", "exp(-x - y - z - w)", "quadrature"),
        ("xyzw", "[x + y + z + w < t]", "quadrature"),
        ("xyzw", "[x + y + z + w < t]*[x^2 + y^2 + z*w < t]", "qmc"),
        ("xyzuv", "exp(-x - y - z - u - v)", "quadrature"),
        ("xyzuv", "[x + y + z + u + v < t]", "qmc"),
        ("abcdefgh", "exp(-(a + b + c + d + e + f + g + h))", "qmc"),
    ],
)
def test_by_dimension_and_smoothness(names: str, body: str, method: str) -> None:
    assert cube(names, body)(0.7).method == method


def test_by_tolerance() -> None:
    f = potto.deriv(cube("xyzw", "[x + y + z + w < t]"))
    fine = f((0.8, 1.0))
    with potto.settings(rtol=1e-3, samples=1_000_000):
        coarse = f((0.8, 1.0))
    # The simplex: t^4/24
    for answer in (fine, coarse):
        assert abs(answer.value - 0.8**4 / 24) <= answer.error
        assert abs(answer.tangent - 0.8**3 / 6) <= answer.tangent_error
    assert fine.method == "quadrature" and fine.converged and fine.error < 1e-12
    assert coarse.method == "qmc"


def test_sampling_stops_when_the_accuracy_is_reached() -> None:
    f = cube("abcdefgh", "exp(-(a + b + c + d + e + f + g + h))")
    with potto.settings(rtol=1e-2):
        coarse = f(0.0)
    fine = f(0.0)
    exact = (1 - math.exp(-1)) ** 8
    assert coarse.converged and coarse.evals < fine.evals / 8
    for answer in (coarse, fine):
        assert abs(answer.value - exact) <= answer.error
