"""Sampling where hardly a point falls: thin strips, surfaces close to an axis, narrow peaks. Closed forms; the error
must cover whatever the seed, also of derivatives."""

from __future__ import annotations

import math

import pytest

import potto

W = 2.0**-20
SQUARE = "integral ([0, 1], [0, 1]) {} d(x, y)"
CUBE = "integral ([0, 1], [0, 1], [0, 1]) {} d(x, y, z)"
FOUR = "integral ([0, 1], [0, 1], [0, 1], [0, 1]) {} d(x, y, z, u)"

# name, integral of t, t, value, derivative
THIN = [
    ("strip across the outer variable", SQUARE.format(f"[t <= x < t + {W!r}]*(1 + y)"), 0.3, 1.5 * W, 0.0),
    ("strip across the inner variable", SQUARE.format(f"[t <= y < t + {W!r}]*(1 + x)"), 0.3, 1.5 * W, 0.0),
    ("surface close to an axis", SQUARE.format("[x + 6e-5*y < t]"), 0.5, 0.5 - 3e-5, 1.0),
    ("weight on a surface close to an axis", SQUARE.format("[x + 6e-5*y < t]*y"), 0.5, 0.25 - 2e-5, 0.5),
    ("closer than a double's half", SQUARE.format("[x + 1e-9*y < t]*y"), 0.5, 0.25 - 1e-9 / 3, 0.5),
    ("high wall beside a slope", SQUARE.format(f"(1 + y*[x + 6e-5*y < t] + 1e5*[t/2 <= x < t/2 + {W!r}])"), 0.5,
     1.25 - 2e-5 + 1e5 * W, 0.5),
    ("oblique strip", SQUARE.format(f"[abs(x + y - 2*t) < {W!r}]"), 0.4, 1.6 * W, 4 * W),
    ("strip in four variables", FOUR.format(f"[t <= x < t + {W!r}]*(1 + y*z + u)"), 0.3, 1.75 * W, 0.0),
    ("corner box", CUBE.format("[0.2 <= x < 0.2 + t]*[0.7 <= y < 0.7 + t]"), 1e-4, 1e-8, 2e-4),
    ("small disc", CUBE.format("[(x - 0.3)^2 + (y - 0.6)^2 < t^2]"), 1e-3, math.pi * 1e-6, 2 * math.pi * 1e-3),
    ("thin ring", SQUARE.format("[t^2 <= x^2 + y^2 < (t + 1e-6)^2]"), 0.5, math.pi / 4 * (1e-6 + 1e-12),
     math.pi / 2 * 1e-6),
    ("narrow peak", CUBE.format("exp(-((x - 0.3)^2 + (y - 0.6)^2)/t^2)"), 1e-3, math.pi * 1e-6, 2 * math.pi * 1e-3),
    ("power at an end", SQUARE.format("x^(-t)"), 0.9, 10.0, 100.0),
]  # fmt: skip


@pytest.mark.parametrize("method", ["mc", "qmc"])
@pytest.mark.parametrize(("name", "text", "at", "value", "rate"), THIN, ids=[row[0] for row in THIN])
def test_errors_cover_what_hardly_a_point_falls_into(
    name: str, text: str, at: float, value: float, rate: float, method: str
) -> None:
    program = potto.grad(potto.compile(f"def f(t) {text}").f, "t")
    for seed in range(10):
        with potto.settings(method=method, samples=20_000, seed=seed):
            found = program(t=at)
        for got, error, exact in ((found.value, found.error, value), (found.tangent, found.tangent_error, rate)):
            assert abs(got - exact) <= error + 1e-15 * abs(exact), (seed, got, error, exact)


@pytest.mark.parametrize("width", [0.1, 0.02, 0.011, 1e-3, 4.1e-4])
def test_a_thin_ring_has_all_digits_of_its_rate(width: float) -> None:
    """4 pi t, by adaptive panels: those that crowd towards the inner circle, as the outer one is near, are not to crowd
    until rounding is all that is left between the nodes, which left the rate 8 digits."""
    f = potto.deriv(potto.compile(
        "def f(R, t) integral ([-2, 2], [-2, 2]) [(sqrt(x^2 + y^2) - R)^2 < t^2] d(x, y)").f)  # fmt: skip
    answer = f((1.1, 0.0), (width, 1.0))
    assert abs(answer.value - 4.4 * math.pi * width) <= answer.error <= 1e-11
    assert abs(answer.tangent - 4.4 * math.pi) <= answer.tangent_error <= 1e-9
    assert answer.evals <= 5000
