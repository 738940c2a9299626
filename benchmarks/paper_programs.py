"""The programs that Teg was published with, in Potto, and what they are by other means.

Owns `PROGRAMS`. Teg's applications (github.com/ChezJrk/teg_applications) are energies of a triangle in a pixel, with a
colour that is constant, linear or quadratic, thresholded noise, and a cord that yields; the first is an example of its
page. Each is written from what it computes. References: closed forms, clipped polygons, quadrature by scipy between
roots that are solved for; derivatives by central differences of these, good to nine digits.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.integrate import quad

Place = Sequence[float]


class Program(NamedTuple):
    """A function of numbers, by the first `moving` of which its gradient is taken, where, and its value otherwise."""

    name: str
    function: str
    text: str
    parameters: tuple[str, ...]
    moving: int
    place: tuple[float, ...]
    exact: Callable[[Place], float]


EDGE = "def side(ax, ay, bx, by, x, y) (bx - ax) * (y - ay) - (by - ay) * (x - ax)\n"
MASK = "[side(ax, ay, bx, by, x, y) > 0 and side(bx, by, cx, cy, x, y) > 0 and side(cx, cy, ax, ay, x, y) > 0]"
CORNERS = ("ax", "ay", "bx", "by", "cx", "cy")
TRIANGLE = (-0.3, 0.1, 1.4, 0.35, 0.45, 1.3)
SHARES = """
def whole(ax, ay, bx, by, cx, cy) side(ax, ay, bx, by, cx, cy)
def first(ax, ay, bx, by, cx, cy, x, y) side(bx, by, cx, cy, x, y) / whole(ax, ay, bx, by, cx, cy)
def second(ax, ay, bx, by, cx, cy, x, y) side(cx, cy, ax, ay, x, y) / whole(ax, ay, bx, by, cx, cy)
"""


def energy(colours: Sequence[str], shade: str, more: str = "") -> str:
    names = ", ".join((*CORNERS, *colours))
    return f"""{EDGE}{more}
def energy({names})
    integral ([0, 1], [0, 1]) {MASK} * ({shade} - 0.25)^2 d(x, y)
"""


def clipped(triangle: Place) -> list[tuple[float, float]]:
    """What of a triangle is in the pixel (Sutherland and Hodgman, 1974)."""
    polygon = list(zip(triangle[::2], triangle[1::2], strict=True))
    for axis, bound, sign in ((0, 0.0, 1), (0, 1.0, -1), (1, 0.0, 1), (1, 1.0, -1)):
        out = []
        for p, q in zip(polygon, polygon[1:] + polygon[:1], strict=True):
            u, v = sign * (p[axis] - bound), sign * (q[axis] - bound)
            if u >= 0:
                out.append(p)
            if u * v < 0:
                s = u / (u - v)
                out.append((p[0] + s * (q[0] - p[0]), p[1] + s * (q[1] - p[1])))
        polygon = out
    return polygon


def over_polygon(polygon: Sequence[tuple[float, float]], f: Callable[[float, float], float]) -> float:
    """Over a fan of triangles by Gauss twice, exact up to the sixth degree."""
    nodes, weights = np.polynomial.legendre.leggauss(4)
    nodes, weights = (nodes + 1) / 2, weights / 2
    a, total = np.array(polygon[0]), 0.0
    for b, c in zip(map(np.array, polygon[1:]), map(np.array, polygon[2:])):
        double = (b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0]
        for s, ws in zip(nodes, weights, strict=True):
            for t, wt in zip(nodes, weights, strict=True):
                total += double * s * ws * wt * f(*(a + s * ((b - a) + t * (c - b))))
    return float(total)


def by_clipping(
    shade: Callable[[Sequence[float], Place], float], from_grey: float = 0.25, exponent: int = 2
) -> Callable[[Place], float]:
    """The energy of a colour that is a function of the three shares of a place, and of the colours given: the square of
    what it is off from a grey."""

    def exact(place: Place) -> float:
        triangle, colours = place[:6], place[6:]
        (ax, ay), (bx, by), (cx, cy) = zip(triangle[::2], triangle[1::2], strict=True)
        whole = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)

        def far(x: float, y: float) -> float:
            first = ((cx - bx) * (y - by) - (cy - by) * (x - bx)) / whole
            second = ((ax - cx) * (y - cy) - (ay - cy) * (x - cx)) / whole
            return (shade((first, second, 1 - first - second), colours) - from_grey) ** exponent

        return over_polygon(clipped(triangle), far)

    return exact


LINEAR = "u * p + v * q + (1 - u - v) * r"
QUADRATIC = ("u * (2 * u - 1) * p + v * (2 * v - 1) * q + w * (2 * w - 1) * r"
             " + 4 * v * w * f + 4 * u * w * g + 4 * u * v * k")  # fmt: skip


def with_shares(shade: str) -> str:
    at = f"({', '.join((*CORNERS, 'x', 'y'))})"
    return f"(let u = first{at}; v = second{at}; w = 1 - u - v in {shade})"


def quadratic(shares: Sequence[float], colours: Place) -> float:
    """On the middles of the sides, too."""
    u, v, w = shares
    p, q, r, f, g, k = colours
    at_corners = u * (2 * u - 1) * p + v * (2 * v - 1) * q + w * (2 * w - 1) * r
    return at_corners + 4 * (v * w * f + u * w * g + u * v * k)


NOISE = """
def above(c00, c10, c01, c11, t)
    integral ([0, 1], [0, 1]) (if [(c00 * (1 - x) + c10 * x) * (1 - y) + (c01 * (1 - x) + c11 * x) * y > t]
        then 0.81 else 0.04) d(x, y)
"""


def noise(place: Place) -> float:
    c00, c10, c01, c11, t = place

    def section(x: float) -> float:
        low, high = c00 * (1 - x) + c10 * x - t, c01 * (1 - x) + c11 * x - t
        if low * high >= 0:
            share = float(low + high > 0)
        else:
            share = max(low, high) / (abs(low) + abs(high))
        return 0.04 + 0.77 * share

    turns = [(t - a) / (b - a) for a, b in ((c00, c10), (c01, c11)) if a != b]
    ends = [0.0, *sorted(x for x in turns if 0 < x < 1), 1.0]
    return sum(quad(section, a, b, epsabs=1e-14, epsrel=1e-14)[0] for a, b in pairwise(ends))


CORD = """
def stress(s, limit, scale)
    scale * (if [s < limit] then 2 * s else 2.2 * limit - 0.8 * (s - 1.5 * limit)^2 / limit)
def speed(x, limit, scale) sqrt(2 * integral [0, x] (10 - stress(s, limit, scale)) d(s))
def time(limit, scale) integral [0, 10] 1 / speed(x, limit, scale) d(x)
"""


def cord(place: Place) -> float:
    """The work of the stress in closed form on both sides of the limit."""
    limit, scale = place

    def squared(x: float) -> float:
        s = min(x, limit)
        work = s**2
        if x > limit:
            cubes = (x - 1.5 * limit) ** 3 - (limit - 1.5 * limit) ** 3
            work += 2.2 * limit * (x - limit) - 0.8 * cubes / (3 * limit)
        return 2 * (10 * x - scale * work)

    def smooth(u: float) -> float:  # x = u^2 takes the root at the start away
        return 2 * u / np.sqrt(squared(u * u)) if u else 2 / np.sqrt(20)

    ends = (0.0, np.sqrt(limit), np.sqrt(10.0))
    return sum(quad(smooth, a, b, epsabs=1e-13, epsrel=1e-13)[0] for a, b in pairwise(ends))


PROGRAMS = (
    Program("a step", "f", "def f(t) integral [0, 1] [x < t] d(x)\n", ("t",), 1, (0.5,), lambda place: place[0]),
    Program("triangle, constant", "energy", energy(("p",), "p"), (*CORNERS, "p"), 7, (*TRIANGLE, 0.7),
            by_clipping(lambda shares, c: c[0])),
    Program("triangle, linear", "energy", energy(("p", "q", "r"), with_shares(LINEAR), SHARES),
            (*CORNERS, "p", "q", "r"), 9, (*TRIANGLE, 0.7, 0.4, 0.9),
            by_clipping(lambda s, c: sum(a * b for a, b in zip(s, c)))),
    Program("triangle, quadratic", "energy", energy(("p", "q", "r", "f", "g", "k"), with_shares(QUADRATIC), SHARES),
            (*CORNERS, "p", "q", "r", "f", "g", "k"), 12, (*TRIANGLE, 0.7, 0.4, 0.9, 0.3, 0.8, 0.6),
            by_clipping(quadratic)),
    Program("thresholded noise", "above", NOISE, ("c00", "c10", "c01", "c11", "t"), 5,
            (0.9, 0.1, 0.2, 0.75, 0.4), noise),
    Program("a cord that yields", "time", CORD, ("limit", "scale"), 2, (4.0, 0.5), cord),
)  # fmt: skip


def differences(program: Program, step: float = 1e-4) -> np.ndarray:
    """The gradient of the reference, by differences of fourth order."""
    found = []
    for k in range(program.moving):

        def at(h: float, k: int = k) -> float:
            place = list(program.place)
            place[k] += h
            return program.exact(place)

        found.append((8 * (at(step) - at(-step)) - (at(2 * step) - at(-2 * step))) / (12 * step))
    return np.array(found)
