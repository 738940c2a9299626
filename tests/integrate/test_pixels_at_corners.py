"""A line that passes through the corner of a pixel, to rounding: what it cuts off is a triangle of a few roundings.

Answers by exact rational arithmetic on the doubles that the program is given. The bounds a - w and so on are rounded
before anything is integrated, to some 1e-16, which moves derivatives by as much: that is what is allowed beside the
reported error.
"""

from __future__ import annotations

import math
import random
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import potto

Pixel = tuple[float, float, float, float]  # a, b, c, w
ROUNDING = 2.0**-50
P, Q = 0.998, 1.003


def exact(pixel: Pixel, p: float = P, q: float = Q) -> tuple[Fraction, list[Fraction]]:
    """The area of p x + q y < c in the pixel, and its derivatives by a, b, c, w, for positive p and q."""
    a, b, c, w, p_, q_ = map(Fraction, (*pixel, p, q))
    signs = [(sx, sy) for sx in (-1, 1) for sy in (-1, 1)]
    corners = [(sx, sy, max(c - p_ * (a + sx * w) - q_ * (b + sy * w), Fraction(0))) for sx, sy in signs]
    area = sum(sx * sy * d * d for sx, sy, d in corners) / (2 * p_ * q_)
    slopes = [
        sum(sx * sy * d * rate(sx, sy) for sx, sy, d in corners) / (p_ * q_)
        for rate in (lambda sx, sy: -p_, lambda sx, sy: -q_, lambda sx, sy: 1, lambda sx, sy: -p_ * sx - q_ * sy)
    ]
    return Fraction(area), [Fraction(s) for s in slopes]


def random_pixels(count: int) -> list[Pixel]:
    """A corner lies within 4 units of the last place of the line."""
    pick = random.Random(11)
    found = []
    for _ in range(count):
        a, b, w = pick.uniform(-1, 1), pick.uniform(-1, 1), 0.00625
        sx, sy = pick.choice([-1, 1]), pick.choice([-1, 1])
        c = float(Fraction(P) * (Fraction(a) + sx * Fraction(w)) + Fraction(Q) * (Fraction(b) + sy * Fraction(w)))
        for _ in range(pick.randint(0, 4)):
            c = math.nextafter(c, pick.choice([-9.0, 9.0]))
        found.append((a, b, c, w))
    return found


PIXELS = [(-0.9871822346713797, 0.5452984024507772, -0.45077982254390725, 0.00625), *random_pixels(400)]
WRITTEN = [
    "integral ([a-w, a+w], [b-w, b+w]) [0.998*x + 1.003*y < c] d(x, y)",
    "integral ([a-w, a+w], [b-w, b+w]) [0.998*x + 1.003*y < c] d(y, x)".replace("[a-w, a+w], [b-w, b+w]",
                                                                                 "[b-w, b+w], [a-w, a+w]"),
    "integral ([a-w, a+w], [b-w, b+w]) [c - 0.998*x > 1.003*y] d(x, y)",
    "integral [a-w, a+w] (integral [b-w, b+w] [0.998*x + 1.003*y < c] d(y)) d(x)",
    "integral ([a-w, a+w], [b-w, b+w]) below(x, y, c) d(x, y)",
    "integral ([a-w, a+w], [b-w, b+w]) (if [0.998*x + 1.003*y < c] then 1 else 0) d(x, y)",
]  # fmt: skip


def program(body: str = WRITTEN[0]) -> Any:
    return potto.compile(f"def below(x, y, c) [0.998*x + 1.003*y < c]\ndef f(a, b, c, w)\n    {body}\n").f


def test_a_picture_of_such_pixels_has_no_holes() -> None:
    f, columns = program(), [np.array(column) for column in zip(*PIXELS, strict=True)]
    found = f(*columns)
    assert np.isfinite(found.value).all()
    for pixel, value, error in zip(PIXELS, found.value, found.error, strict=True):
        assert abs(Fraction(float(value)) - exact(pixel)[0]) <= Fraction(float(error)) + Fraction(ROUNDING * pixel[3])
    for d in range(4):
        duals = [(column, np.full(column.shape, float(i == d))) for i, column in enumerate(columns)]
        found = potto.deriv(f)(*duals)
        assert np.isfinite(found.value).all() and np.isfinite(found.tangent).all()
        for pixel, slope, error in zip(PIXELS, found.tangent, found.tangent_error, strict=True):
            assert abs(Fraction(float(slope)) - exact(pixel)[1][d]) <= Fraction(float(error)) + Fraction(ROUNDING)


@pytest.mark.parametrize("body", WRITTEN)
def test_one_by_one(body: str) -> None:
    f = program(body)
    for pixel in PIXELS[:20]:
        area, slopes = exact(pixel)
        plain = f(*pixel)
        assert math.isfinite(plain.value) and math.isfinite(plain.error)
        assert abs(Fraction(plain.value) - area) <= Fraction(plain.error) + Fraction(ROUNDING * pixel[3])
        for d, slope in enumerate(slopes):
            found = potto.deriv(f)(*((v, float(i == d)) for i, v in enumerate(pixel)))
            assert math.isfinite(found.value) and math.isfinite(found.tangent)
            assert abs(Fraction(found.tangent) - slope) <= Fraction(found.tangent_error) + Fraction(ROUNDING)


def test_what_does_diverge_still_does() -> None:
    f = potto.compile("def f(t) integral [0, 1] 1/(x*(1 + t)) d(x)\ndef g(t) integral ([0, t], [0, t]) 1/(x*y) d(x, y)")
    assert f.f(1.0).value == math.inf and not math.isfinite(f.g(1e-12).value)
