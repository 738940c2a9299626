"""What `auto` chooses: quadrature as long as it is affordable and the accuracy asked for is worth it; it says so."""

from __future__ import annotations

import math

import mpmath as mp
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
        ("xyzuv", "[x*y + y*z + z*u + u*v + v*x < t]", "qmc"),
        ("abcdefgh", "exp(-(a*b + b*c + c*d + d*e + e*f + f*g + g*h + h*a))", "qmc"),
        # One variable after the other
        ("xyzuv", "[x + y + z + u + v < t]", "quadrature"),
        ("abcdefgh", "[a*b + b*c + c*d + d*e + e*f + f*g + g*h < t]", "qmc"),
        ("abcdefgh", "exp(-(a*b + b*c + c*d + d*e + e*f + f*g + g*h))", "quadrature"),
    ],
)
def test_by_dimension_and_smoothness(names: str, body: str, method: str) -> None:
    assert cube(names, body)(0.7).method == method


def test_by_tolerance() -> None:
    f = potto.deriv(cube("xyzw", "[x*y < t]*(1 + x*z)*(1 + y*w)"))
    fine = f((0.8, 1.0))
    with potto.settings(rtol=1e-3, samples=1_000_000):
        coarse = f((0.8, 1.0))

    # (1 + x/2)(1 + y/2) under the hyperbola
    def exact(t: mp.mpf) -> mp.mpf:
        inner = mp.quad(lambda x: (1 + x / 2) * (t / x + t * t / x**2 / 4), [t, 1])
        return (t + t * t / 4) * mp.mpf("1.25") + inner

    value, rate = exact(mp.mpf("0.8")), mp.diff(exact, mp.mpf("0.8"))
    for answer in (fine, coarse):
        assert abs(answer.value - value) <= answer.error
        assert abs(answer.tangent - rate) <= answer.tangent_error
    assert fine.method == "quadrature" and fine.converged and fine.error < 1e-10
    assert coarse.method == "qmc"


def test_sampling_stops_when_the_accuracy_is_reached() -> None:
    f = cube("abcdefgh", "exp(-(a + b + c + d + e + f + g + h))*cos(t*(a*b*c*d + e*f*g*h + a*h))")
    with potto.settings(rtol=1e-2):
        coarse = f(0.0)
    fine = f(0.0)
    exact = (1 - math.exp(-1)) ** 8
    assert coarse.converged and coarse.evals < fine.evals / 8
    for answer in (coarse, fine):
        assert abs(answer.value - exact) <= answer.error
