"""`interp` and `image`: what lies between elements, against interpolation by hand."""

from __future__ import annotations

import bisect

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp
from snippets import close, value

LOOK_UPS = """
    record P(y: Real, x: Real)
    def at(xs: [n] Real, ys: [n] Real, x) interp(xs, ys, x)
    def slope(xs: [n] Real, ys: [n] Real, x) snd(deriv(\\z . interp(xs, ys, z))((x, 1)))
    def even(ys: [n] Real, x) interp([i/(n - 1) for i in 0..n-1], ys, x)
    def pairs(ps: [n] (Real, Real), x) interp([0, 1, 3], ps, x)
    def lines(m: [n, k] Real, x) interp([i for i in 0..n-1], m, x)
    def records(x) interp([0, 1, 3], [P(1, 2), P(3, 4), P(5, 6)], x).x
    def pixel(p: [h, w] Real, u, v) image(p, u, v)
    def colour(p: [h, w] (Real, Real), u, v) image(p, u, v)
    def mean(ys: [n] Real) integral [0, 1] even(ys, x) d(x)
"""


def between(xs: list[float], ys: list[float], x: float) -> object:
    """Piecewise linear, constant beyond the ends."""
    if x <= xs[0] or x >= xs[-1]:
        return mp.mpf(ys[0] if x <= xs[0] else ys[-1])
    k = bisect.bisect(xs, x) - 1
    part = (mp.mpf(x) - xs[k]) / (mp.mpf(xs[k + 1]) - xs[k])
    return ys[k] + part * (mp.mpf(ys[k + 1]) - ys[k])


NUMBERS = st.integers(-20, 20).map(lambda n: n / 4)


@settings(deadline=None, max_examples=40)
@given(st.lists(NUMBERS, min_size=1, max_size=6, unique=True).map(sorted), st.data())
def test_interpolation(xs, data):
    ys = [data.draw(NUMBERS) for _ in xs]
    x = data.draw(st.integers(-60, 60).map(lambda n: n / 8))
    close(value(LOOK_UPS, "at(xs, ys, x)", xs=xs, ys=ys, x=x), between(xs, ys, x))


def test_the_slope_of_an_interpolation():
    points = {"xs": [0.0, 1.0, 3.0], "ys": [10.0, 20.0, 0.0]}
    for x, wanted in ((-1.0, 0), (0.5, 10), (2.0, -10), (4.0, 0)):
        assert abs(value(LOOK_UPS, "slope(xs, ys, x)", x=x, **points) - wanted) < 1e-20


def test_what_is_looked_up_may_be_made_of_several_numbers():
    close(value(LOOK_UPS, "pairs([(0, 1), (2, 5), (6, 1)], 2)"), (4, 3))
    close(value(LOOK_UPS, "lines([[1, 2], [3, 6], [7, 7]], 1.5)"), [5, 6.5])
    close(value(LOOK_UPS, "records(2)"), 5)


def test_an_integral_of_an_interpolation():
    """The trapezoidal rule."""
    close(value(LOOK_UPS, "mean([1, 3, 7])"), mp.mpf(1 / 2 + 3 + 7 / 2) / 2)


def by_hand(photo: list[list[float]], u: float, v: float) -> object:
    rows = [between([(j + 0.5) / len(row) for j in range(len(row))], row, u) for row in photo]
    return between([(i + 0.5) / len(photo) for i in range(len(photo))], rows, v)  # type: ignore[arg-type]


PHOTO = [[1.0, 2.0, 4.0, 0.0], [3.0, 5.0, 8.0, 1.0]]  # two rows of four: centres lie at numbers that are exact


@pytest.mark.parametrize("u", [0.0, 0.125, 0.3, 0.5, 0.875, 0.9, 1.0])
@pytest.mark.parametrize("v", [0.0, 0.25, 0.4, 0.75, 1.0])
def test_an_image_between_the_centres_of_its_pixels(u, v):
    close(value(LOOK_UPS, "pixel(p, u, v)", p=PHOTO, u=u, v=v), by_hand(PHOTO, u, v))


def test_an_image_of_colours():
    colours = [[(1.0, 0.0), (2.0, 1.0)], [(3.0, 0.0), (5.0, 1.0)]]
    close(value(LOOK_UPS, "colour(p, 0.5, 0.5)", p=colours), (2.75, 0.5))
