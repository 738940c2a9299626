"""Answers to the problems of the bench by mathematics: closed forms, or one smooth integral in one variable, by mpmath.

Each is a function of the parameter, an mpf; derivatives are written out as well, never differenced.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath as mp

Exact = tuple[Callable[[Any], Any], Callable[[Any], Any]]


def step() -> Exact:
    """∫_0^t e^x dx"""
    return lambda t: mp.e**t - 1, lambda t: mp.e**t


def eq1(second: Callable[[Any], Any], first: Callable[[Any], Any]) -> Exact:
    """The unit square where z = x + y + c >= 0, -1 <= c <= 0, of a shader s(z); `second` has s as second derivative,
    `first` is its slope. Along z the square has the density z - c (up to 1 + c), then 2 + c - z: twice by parts."""

    def value(c: Any) -> Any:
        return second(2 + c) - 2 * second(1 + c) + second(mp.mpf(0)) + c * first(mp.mpf(0))

    def slope(c: Any) -> Any:
        return first(2 + c) - 2 * first(1 + c) + first(mp.mpf(0))

    return value, slope


def const() -> Exact:
    return eq1(lambda z: z**2 / 2, lambda z: z)


def lin() -> Exact:
    """s = 1/(r z + 2), r = √2"""
    r = mp.sqrt(2)
    return eq1(lambda z: ((r * z + 2) * mp.log(r * z + 2) - (r * z + 2)) / r**2, lambda z: mp.log(r * z + 2) / r)


def quad() -> Exact:
    """s = 1/(r z + 2)²"""
    r = mp.sqrt(2)
    return eq1(lambda z: -mp.log(r * z + 2) / r**2, lambda z: -1 / (r * (r * z + 2)))


def disc() -> Exact:
    """∫ e^(x+y) over a disc of radius r: 2π r I₁(√2 r)/√2, and 2π r I₀(√2 r) over its edge."""
    a = mp.sqrt(2)
    return lambda r: 2 * mp.pi * r * mp.besseli(1, a * r) / a, lambda r: 2 * mp.pi * r * mp.besseli(0, a * r)


def strip() -> Exact:
    """Where t <= x + y < t + w <= 1 the sum s has the density s: ∫ s e^-s ds."""
    w = mp.mpf(2) ** -20

    def primitive(s: Any) -> Any:
        return -(1 + s) * mp.e**-s

    return (lambda t: primitive(t + w) - primitive(t),
            lambda t: (t + w) * mp.e ** -(t + w) - t * mp.e**-t)  # fmt: skip


def sliver() -> Exact:
    """Between the lines x + y = t and x + (1 + e) y = t: over x in [0, t] of the height (t - x) e/(1 + e)."""
    e = mp.mpf(2) ** -20
    share = e / (1 + e)
    return lambda t: share * (t**2 / 2 + t**3 / 6), lambda t: share * (t + t**2 / 2)


def plane() -> Exact:
    """1/(1 + x + 2y + 3z) where x + y + z < t in the unit cube, 1 <= t <= 2: by quadrature over x alone."""

    def over_line(p: Any, q: Any, lo: Any, hi: Any) -> Any:  # ∫ ln(p + q y) dy
        def primitive(y: Any) -> Any:
            return (p + q * y) * (mp.log(p + q * y) - 1) / q

        return primitive(hi) - primitive(lo)

    def value(t: Any) -> Any:
        def at(x: Any) -> Any:  # z up to min(1, t - x - y): all of it up to y = t - 1 - x
            full = max(t - 1 - x, mp.mpf(0))
            end = min(mp.mpf(1), t - x)
            whole = over_line(4 + x, 2, 0, full) if full > 0 else 0
            cut = over_line(1 + 3 * t - 2 * x, -1, full, end)
            return (whole + cut - over_line(1 + x, 2, 0, end)) / 3

        return mp.quad(at, [0, t - 1, 1])

    def slope(t: Any) -> Any:  # over the cut: z = t - x - y, 1/(1 + 3t - 2x - y)
        def at(x: Any) -> Any:
            full = max(t - 1 - x, mp.mpf(0))
            end = min(mp.mpf(1), t - x)
            p = 1 + 3 * t - 2 * x
            return mp.log((p - full) / (p - end))

        return mp.quad(at, [0, t - 1, 1])

    return value, slope


def eight() -> Exact:
    """e^-s over the sum s of eight uniform numbers below t: the density of s is Σ (-1)^k C(8, k) (s - k)₊⁷/7!."""

    def value(t: Any) -> Any:
        return mp.fsum((-1) ** k * mp.binomial(8, k) * mp.e ** (-k) * mp.gammainc(8, 0, t - k, regularized=True)
                       for k in range(9) if k < t)  # fmt: skip

    def slope(t: Any) -> Any:
        return mp.e**-t * mp.fsum((-1) ** k * mp.binomial(8, k) * (t - k) ** 7 for k in range(9) if k < t) / 5040

    return value, slope


def wave() -> Exact:
    """cos(60x + 40y) over the triangle x + y < t."""
    return (lambda t: ((mp.cos(40 * t) - mp.cos(60 * t)) / 20 - (1 - mp.cos(40 * t)) / 40) / 60,
            lambda t: (mp.sin(60 * t) - mp.sin(40 * t)) / 20)  # fmt: skip


def peak() -> Exact:
    """Two Lorentz curves of half-width w = 2^-10, at x = 0.5 and y = 0.625, cut at x = t."""
    w = mp.mpf(2) ** -10

    def curve(u: Any) -> Any:
        return mp.atan(u / w)

    across = curve(mp.mpf(3) / 8) - curve(-mp.mpf(5) / 8)
    return (lambda t: across * (curve(t - mp.mpf(1) / 2) - curve(-mp.mpf(1) / 2)),
            lambda t: across * w / (w**2 + (t - mp.mpf(1) / 2) ** 2))  # fmt: skip


def ball() -> Exact:
    """A ball of radius 1 < r < √2 in the cube [-1, 1]³: less six caps of height r - 1."""
    return (lambda r: 4 * mp.pi * r**3 / 3 - 2 * mp.pi * (r - 1) ** 2 * (2 * r + 1),
            lambda r: 4 * mp.pi * r**2 - 12 * mp.pi * r * (r - 1))  # fmt: skip


EXACT: dict[str, Callable[[], Exact]] = {
    "step": step, "eq1-const": const, "eq1-lin": lin, "eq1-quad": quad, "disc": disc, "strip": strip, "sliver": sliver,
    "wave": wave, "peak": peak, "ball": ball, "plane": plane, "eight": eight,
}  # fmt: skip
