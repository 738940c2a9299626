"""References in three and more variables: closed forms, exact polytopes, or one smooth integral of heights."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

import mpmath as mp

from references import gyroid
from references.plane import below_energy, lens, states
from references.tools import WEIGHTS, Truth, Value, cube, differenced, polytope, second

mpf = mp.mpf


def ball(n: int) -> Value:
    """The volume of a ball in n dimensions, over its radius."""
    return lambda r: mp.pi ** (mpf(n) / 2) / mp.gamma(mpf(n) / 2 + 1) * r**n


def cap_of_ball(h: Any) -> Any:
    """Of the unit ball, a cap as high as h."""
    return mp.pi * h * h * (3 - h) / 3


def common_of_balls(d: Any) -> Any:
    """What two unit balls d apart have in common."""
    return 2 * cap_of_ball(1 - d / 2)


def torus(r: Any) -> Any:
    return 2 * mp.pi**2 * r * r


def three_cosines(t: Any) -> Truth:
    """cos x + cos y + cos z < t over the zone: the area in x and y, over z, and of their density of states."""
    edge = mp.acos(t - 2) if t > 1 else mp.acos(t + 2) if t < -1 else None
    middle = mp.acos(t)  # where the energy of the other two is 0
    cuts = sorted({mpf(0), middle, mp.pi, *([edge] if edge is not None else [])})

    def energy(z: Any) -> Any:
        return t - mp.cos(z)

    def area(z: Any) -> Any:
        e = energy(z)
        return below_energy(e) if abs(e) < 2 else (4 * mp.pi**2 if e > 0 else mpf(0))

    def density(z: Any) -> Any:
        return states(energy(z)) if abs(energy(z)) < 2 else mpf(0)

    return 2 * mp.quad(area, cuts), 2 * mp.quad(density, cuts)


def product_of_three(t: Any) -> Any:
    """x y z < t in the unit cube."""
    s = -mp.log(t)
    return t * (1 + s + s * s / 2)


def normal_ball(t: Any) -> Any:
    """x^2 + y^2 + z^2 < t, all normal: chi squared with three degrees of freedom."""
    return mp.gammainc(mpf(3) / 2, 0, t / 2, regularized=True)


def half_space(weights: Sequence[int]) -> Value:
    """The part of the unit cube where the weighted sum is below t: by its corners, with signs."""
    n = len(weights)

    def value(t: Any) -> Any:
        corners = itertools.product((0, 1), repeat=n)
        parts = ((-1) ** sum(c) * max(t - sum(w * k for w, k in zip(weights, c)), mpf(0)) ** n for c in corners)
        return mp.fsum(parts) / (math.factorial(n) * math.prod(weights))

    return value


def exactly(volume: Callable[[Fraction], Fraction], step: Fraction = Fraction(1, 2**20)) -> Callable[[Any], Truth]:
    """An exact volume at the double that the parameter is, and its derivative by differences without rounding."""

    def truth(t: Any) -> Truth:
        at = Fraction(float(t))
        parts = (w * (volume(at + k * step) - volume(at - k * step)) for k, w in enumerate(WEIGHTS, 1))
        value, slope = volume(at), sum(parts, Fraction(0)) / step
        return mpf(value.numerator) / value.denominator, mpf(slope.numerator) / slope.denominator

    return truth


def two_half_spaces(t: Fraction) -> Fraction:
    """x + t y + z + w < 2 and x - y + 2 z - t w < 1/2 in the unit cube of four variables."""
    rows, bounds = cube(4)
    one = Fraction(1)
    return polytope([*rows, [one, t, one, one], [one, -one, 2 * one, -t]], [*bounds, 2 * one, one / 2])


def three_half_spaces(t: Fraction) -> Fraction:
    """In three variables: x + y + z < 3/2, x - y < t, y - 2 z < t/2."""
    rows, bounds = cube(3)
    one = Fraction(1)
    more = [[one, one, one], [one, -one, one * 0], [one * 0, one, -2 * one]]
    return polytope([*rows, *more], [*bounds, one * 3 / 2, t, t / 2])


def cross_polytope(t: Any) -> Any:
    """|x1| + ... + |x5| < t."""
    return (2 * t) ** 5 / math.factorial(5)


def chain(t: Any) -> Any:
    """x1 < x2 < x3 < x4 with a sum below t: one order of 24."""
    return half_space((1, 1, 1, 1))(t) / 24


def sphere_and_half_space(t: Any) -> Any:
    """The unit ball where x < t."""
    return cap_of_ball(1 + t)


def quartic_ball(t: Any) -> Any:
    """x^4 + y^4 + z^4 < t."""
    return t ** (mpf(3) / 4) * 8 * mp.gamma(mpf(5) / 4) ** 3 / mp.gamma(mpf(7) / 4)


def smooth_eight(t: Any) -> Any:
    """exp(-t (x1 + ... + x8)) over the unit cube."""
    return ((1 - mp.exp(-t)) / t) ** 8


def ridge(t: Any) -> Any:
    """exp(-(x/a + y/b - z/c)^2/(2 w^2) - x^2/(2 t^2)) in [-10, 10]^3, over z by the normal distribution."""
    w, a, b, c = 2 * mpf(1.61) / mpf(1.13), mpf(0.0778), mpf(0.13985), mpf(0.1)
    spread = w * c

    def over(x: Any, y: Any) -> Any:
        middle = (x / a + y / b) * c
        part = mp.ncdf((10 - middle) / spread) - mp.ncdf((-10 - middle) / spread)
        return spread * mp.sqrt(2 * mp.pi) * part * mp.exp(-((x / t) ** 2) / 2)

    def line(x: Any) -> Any:
        return mp.quad(lambda y: over(x, y), mp.linspace(-10, 10, 9), method="gauss-legendre")

    return mp.quad(line, mp.linspace(-10, 10, 9), method="gauss-legendre")


def five_normals(t: Any) -> Any:
    """x1 + 2 x2 - x3 + x4/2 + x5 < t, all normal."""
    return mp.ncdf(t / mp.sqrt(1 + 4 + 1 + mpf(1) / 4 + 1))


VALUES: dict[str, tuple[Value, float]] = {
    "ball": (ball(3), 1e-3), "ball, nested": (ball(3), 1e-3), "touching ball, 3-D": (ball(3), 1e-3),
    "touching ball, 4-D": (ball(4), 1e-3), "touching ball, 5-D": (ball(5), 1e-3),
    "touching ball, 6-D": (ball(6), 1e-3), "union of balls": (lambda d: 2 * ball(3)(1) - common_of_balls(d), 1e-3),
    "common part of balls": (common_of_balls, 1e-3), "torus": (torus, 1e-3), "torus, quartic": (torus, 1e-3),
    **gyroid.VALUES,
    "product of three": (product_of_three, 1e-4), "ball of normals": (normal_ball, 1e-3),
    "half space, 3-D": (half_space((1, 2, 3)), 1e-3), "half space, 4-D": (half_space((1, 2, 3, 4)), 1e-3),
    "half space, 5-D": (half_space((1, 1, 2, 3, 3)), 1e-3), "half space, 6-D": (half_space((1, 1, 1, 1, 1, 1)), 1e-3),
    "chain": (chain, 1e-3), "cross polytope": (cross_polytope, 1e-3), "ball cut off": (sphere_and_half_space, 1e-3),
    "quartic ball": (quartic_ball, 1e-3), "two cylinders": (lambda r: 16 * r**3 / 3, 1e-3),
    "three cylinders": (lambda r: 8 * (2 - mp.sqrt(2)) * r**3, 1e-3), "cone": (lambda t: mp.pi * t * t / 3, 1e-3),
    "six below": (lambda t: t**6, 1e-3), "smooth, 8-D": (smooth_eight, 1e-3),
    "smooth, 8-D, nested": (smooth_eight, 1e-3), "five normals": (five_normals, 1e-3),
    "sphere, by a delta": (lambda t: 2 * mp.pi * mp.sqrt(t), 1e-3),
    "moved sphere, by a delta": (lambda t: 2 * mp.pi * mp.exp(t) * mp.sinh(mpf(0.8)), 1e-3),
    "ridge in space": (ridge, 1e-2), "cylinder and lens": (lambda d: 2 * lens(d), 1e-3),
}  # fmt: skip
TRUTHS: dict[str, Callable[[Any], Truth]] = {
    **{name: differenced(value, step) for name, (value, step) in VALUES.items()},
    "three cosines": three_cosines, "two half spaces, 4-D": exactly(two_half_spaces),
    "three half spaces": exactly(three_half_spaces),
}  # fmt: skip
SECONDS: dict[str, Value] = {name: second(VALUES[name][0]) for name in (
    "half space, 3-D", "cone", "ball", "ball cut off", "sphere, by a delta", "moved sphere, by a delta",
)}  # fmt: skip
