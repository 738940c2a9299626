"""Regions of the plane that lines and conics bound, integrated by sections: what the ray tracer is held to.

Knows nothing of how Potto does it. A pixel is cut into strips at all places where two of the curves meet or one turns
round; within a strip each section is a sum over intervals between roots, and the strips are integrated by mpmath.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations, pairwise
from typing import Any

import mpmath as mp

Curve = tuple[Any, Any, Any, Any, Any, Any]  # a x^2 + b x y + c y^2 + d x + e y + f


def curve(q: Callable[[Any, Any], Any]) -> Curve:
    """The coefficients of a polynomial of degree two."""
    f, r, l, u, d = q(0, 0), q(1, 0), q(-1, 0), q(0, 1), q(0, -1)
    a, c = (r + l) / 2 - f, (u + d) / 2 - f
    return a, q(1, 1) - r - u + f, c, (r - l) / 2, (u - d) / 2, f


def roots(a: Any, b: Any, c: Any) -> list[Any]:
    small = mp.mpf(10) ** (-mp.mp.dps + 8) * (abs(a) + abs(b) + abs(c))
    if abs(a) <= small:
        return [] if abs(b) <= small else [-c / b]
    under = b * b - 4 * a * c
    if under < 0:
        return []
    big = -(b + (mp.sqrt(under) if b >= 0 else -mp.sqrt(under))) / 2
    return [big / a, c / big] if big else [mp.mpf(0)]


def at(k: Curve, x: Any) -> list[Any]:
    a, b, c, d, e, f = k
    return roots(c, b * x + e, a * x * x + d * x + f)


def meetings(k: Curve, line: Curve) -> list[Any]:
    """Where a curve meets a line, by x."""
    a, b, c, d, e, f = k
    _, _, _, p, q, r = line
    if abs(q) < mp.mpf(10) ** (-mp.mp.dps + 8):
        return [-r / p]
    m, t = -p / q, -r / q
    return roots(a + b * m + c * m * m, b * t + 2 * c * m * t + d + e * m, c * t * t + e * t + f)


def turns(k: Curve) -> list[Any]:
    """Where the tangent of a curve is upright, by x."""
    a, b, c, d, e, f = k
    return roots(b * b - 4 * a * c, 2 * b * e - 4 * c * d, e * e - 4 * c * f)


def integral(
    colour: Callable[[Any, Any], Any], lines: Sequence[Curve], conics: Sequence[Curve], box: tuple[Any, Any, Any, Any]
) -> Any:
    """The integral over a box of a colour that is linear along each section between the curves."""
    x0, x1, y0, y1 = map(mp.mpf, box)
    level = [(0, 0, 0, 0, 1, -y) for y in (y0, y1)]
    straight = [*lines, *level]
    xs = [x for one, two in combinations(straight, 2) for x in meetings(one, two) if any(one[3:5]) and any(two[3:5])]
    xs += [x for k in conics for line in straight for x in meetings(k, line)] + [x for k in conics for x in turns(k)]
    places = sorted({x0, x1, *(x for x in xs if x0 < x < x1)})

    def section(x: Any) -> Any:
        ys = sorted([y0, y1, *(y for k in (*lines, *conics) for y in at(k, x) if y0 < y < y1)])
        return sum((b - a) * colour(x, (a + b) / 2) for a, b in pairwise(ys))

    method = "tanh-sinh" if conics else "gauss-legendre"
    parts = [mp.quad(section, [a, b], method=method) for a, b in pairwise(places)]
    return mp.fsum(parts)
