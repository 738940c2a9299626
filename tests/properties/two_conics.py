"""Random scenes of two conics, and their areas by hand: sections by the formula for quadratic equations.

Owns `two_conics` and `Scene`. Along x the length of the section is smooth between the places where one of the conics
turns, leaves the box, or meets the other one (roots of the resultant); there it goes like a square root, which a cubic
substitution smooths. The derivative by t adds up the speeds of the ends of the sections. Where a conic turns on the
edge of the box, to rounding, nothing is vouched for.
"""

from __future__ import annotations

import random
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial

ORDERS = (60, 140)
CLOSE = 1e-7
Coefficients = tuple[float, float, float, float, float, float]


@dataclass(frozen=True)
class Conic:
    """a y^2 + b x y + c x^2 + d y + e x + f - rate*t < 0."""

    text: str
    coefficients: Coefficients
    rate: float

    def along(self, t: float) -> tuple[Polynomial, Polynomial, Polynomial]:
        """The coefficients of y^2, y and 1, as polynomials in x."""
        a, b, c, d, e, f = self.coefficients
        return Polynomial([a]), Polynomial([d, b]), Polynomial([f - self.rate * t, e, c])


@dataclass(frozen=True)
class Scene:
    """The area between two conics in [-1, 1]^2, as a program in t."""

    source: str
    conics: tuple[Conic, Conic]

    def area(self, t: float) -> tuple[float, float, float, float]:
        """The area, its derivative by t, and what fewer nodes change of either."""
        (rough, slope), (value, rate) = (self.by_gauss(t, order) for order in ORDERS)
        return value, rate, abs(value - rough), np.inf if self.turns_on_the_edge(t) else abs(rate - slope)

    def turns_on_the_edge(self, t: float) -> bool:
        roots = [(b * b - 4 * a * c).trim(1e-13).roots() for a, b, c in (conic.along(t) for conic in self.conics)]
        return bool((np.abs(np.abs(np.concatenate(roots)) - 1) < CLOSE).any())

    def by_gauss(self, t: float, order: int) -> tuple[float, float]:
        places = self.places(t)
        left, right = places[:-1, None], places[1:, None]
        nodes, weights = np.polynomial.legendre.leggauss(order)
        s = 0.5 * (nodes + 1)
        x = left + (right - left) * s * s * (3 - 2 * s)
        weight = (right - left) * 6 * s * (1 - s) * 0.5 * weights
        length, speed = self.section(x.ravel(), t)
        return float(length @ weight.ravel()), float(speed @ weight.ravel())

    def places(self, t: float) -> Any:
        quadratics = [conic.along(t) for conic in self.conics]
        found = [Polynomial([1.0, 0.0, -1.0])]
        for a, b, c in quadratics:
            found += [b * b - 4 * a * c, a + b + c, a - b + c, b]
        (a, b, c), (d, e, f) = quadratics
        found += [(a * f - c * d) ** 2 - (a * e - b * d) * (b * f - c * e), b * f - c * e]
        roots = np.concatenate([p.trim(1e-13).roots() for p in found if p.trim(1e-13).degree() > 0])
        near = roots.real[np.abs(roots.imag) < 1e-4]
        return np.unique(np.concatenate(([-1.0, 1.0], near[np.abs(near) < 1])))

    def section(self, x: Any, t: float) -> tuple[Any, Any]:
        """How long the section at x is, and how fast that grows."""
        ends, speeds = [np.full(x.shape, -1.0), np.full(x.shape, 1.0)], [np.zeros(x.shape)] * 2
        for conic in self.conics:
            a, b, c = (p(x) for p in conic.along(t))
            for y in _roots(a, b, c):
                slope = 2 * a * y + b
                there = np.abs(y) < 1
                ends.append(np.where(there, y, 1.0))
                speeds.append(np.where(there, conic.rate / np.where(slope == 0, 1.0, slope), 0.0))
        y, v = np.stack(ends), np.stack(speeds)
        order = np.argsort(y, axis=0)
        y, v = np.take_along_axis(y, order, 0), np.take_along_axis(v, order, 0)
        middle = 0.5 * (y[1:] + y[:-1])
        inside = y[1:] > y[:-1]
        for conic in self.conics:
            a, b, c = (p(x) for p in conic.along(t))
            inside &= (a * middle + b) * middle + c < 0
        return (inside * (y[1:] - y[:-1])).sum(axis=0), (inside * (v[1:] - v[:-1])).sum(axis=0)


def _roots(a: Any, b: Any, c: Any) -> list[Any]:
    with np.errstate(all="ignore"):
        root = np.sqrt(b * b - 4 * a * c)
        q = -0.5 * (b + np.where(b < 0, -1.0, 1.0) * root)
        both = [np.where(a == 0, np.nan, q / a), np.where(q == 0, np.nan, c / q)]
        linear = np.where(b == 0, np.nan, -c / b)
    both = [np.where(a == 0, np.nan, both[0]), np.where(a == 0, linear, both[1])]
    return [np.where(np.isnan(y), 2.0, y) for y in both]  # 2 is outside of the box


def _conic(pick: random.Random) -> Conic:
    def some(low: float, high: float) -> float:
        return round(pick.uniform(low, high), 2)

    kind, x, y = pick.choice(["circle", "ellipse", "tilted", "parabola", "sideways", "hyperbola", "product"]), \
        some(-0.7, 0.7), some(-0.7, 0.7)  # fmt: skip
    p, q, size, rate = some(0.3, 3.0), some(-0.9, 0.9), some(0.05, 0.8), pick.choice([1.0, 0.0, 0.5, -1.0])
    level = f"{size!r} + ({rate!r})*t"
    dx, dy = f"(x - ({x!r}))", f"(y - ({y!r}))"
    match kind:
        case "circle":
            return Conic(f"{dx}^2 + {dy}^2 < {level}", _moved(1, 0, 1, 0, 0, -size, x, y), rate)
        case "ellipse":
            return Conic(f"{p!r}*{dx}^2 + {dy}^2 < {level}", _moved(1, 0, p, 0, 0, -size, x, y), rate)
        case "tilted":
            return Conic(f"{dx}^2 + ({q!r})*{dx}*{dy} + {dy}^2 < {level}", _moved(1, q, 1, 0, 0, -size, x, y), rate)
        case "parabola":
            return Conic(f"{p!r}*{dx}^2 - {dy} < {level}", _moved(0, 0, p, -1, 0, -size, x, y), rate)
        case "sideways":
            return Conic(f"{p!r}*{dy}^2 + {dx} < {level}", _moved(p, 0, 0, 0, 1, -size, x, y), rate)
        case "hyperbola":
            return Conic(f"{dx}^2 - {p!r}*{dy}^2 < {level}", _moved(-p, 0, 1, 0, 0, -size, x, y), rate)
    return Conic(f"{dx}*{dy} < {level}", _moved(0, 1, 0, 0, 0, -size, x, y), rate)


def _moved(a: float, b: float, c: float, d: float, e: float, f: float, x: float, y: float) -> Coefficients:
    """Of a conic around (x, y)."""
    return (a, b, c, d - 2 * a * y - b * x, e - 2 * c * x - b * y,
            f + a * y * y + b * x * y + c * x * x - d * y - e * x)  # fmt: skip


def two_conics(seed: int) -> Scene:
    """A random scene: the source of a function f(t) and what it comes to."""
    pick = random.Random(seed)
    first, second = _conic(pick), _conic(pick)
    order = pick.choice(["x, y", "y, x"])
    body = f"[{first.text}]*[{second.text}]"
    return Scene(f"def f(t)\n    integral ([-1, 1], [-1, 1]) {body} d({order})\n", (first, second))
