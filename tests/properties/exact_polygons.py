"""Areas and moments of what half planes leave of a rectangle, exactly: an oracle that shares nothing with Potto's.

Owns `Scene`. Lines cut the rectangle into convex cells, by clipping in rational arithmetic; on each of them conditions
are true or false and the integrand is affine. All of that is exact, and what it comes to is a piecewise polynomial of
what moves.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction

from polygons import Point, Polygon, clipped, moment

Truth = Callable[[tuple[bool, ...]], bool]


@dataclass(frozen=True)
class Line:
    """a x + b y < c + t d, with t the parameter."""

    a: float
    b: float
    c: float
    d: float

    def at(self, point: Point, t: Fraction) -> Fraction:
        """Positive where it holds."""
        return Fraction(self.c) + t * Fraction(self.d) - Fraction(self.a) * point[0] - Fraction(self.b) * point[1]


@dataclass(frozen=True)
class Scene:
    """The integral over [x0 + t u0, x1 + t u1] x [y0, y1] of p + q x + r y where lines make `truth` true.

    box: x0, u0, x1, u1, y0, y1. weight: p, q, r. An integral over a reversed range counts negative.
    """

    box: tuple[float, float, float, float, float, float]
    lines: tuple[Line, ...]
    truth: Truth
    weight: tuple[float, float, float]

    def value(self, t: Fraction) -> Fraction:
        x0, u0, x1, u1, y0, y1 = map(Fraction, self.box)
        lo, hi = x0 + t * u0, x1 + t * u1
        p, q, r = map(Fraction, self.weight)
        sign = (1 if lo <= hi else -1) * (1 if y0 <= y1 else -1)
        corners = [(lo, y0), (hi, y0), (hi, y1), (lo, y1)]
        return sign * sum((moment(cell, q, r, p) for cell in self._cells(corners, (), t)), Fraction(0))

    def rate(self, t: Fraction, step: Fraction) -> Fraction:
        """The derivative to the side of the step."""
        return (self.value(t + step) - self.value(t)) / step

    def _cells(self, corners: Polygon, sides: tuple[bool, ...], t: Fraction) -> Iterator[Polygon]:
        if len(corners) < 3:
            return
        if len(sides) == len(self.lines):
            if self.truth(sides):
                yield corners
            return
        line = self.lines[len(sides)]
        for side, sign in ((True, 1), (False, -1)):
            part = clipped(corners, lambda corner, sign=sign: sign * line.at(corner, t))  # type: ignore[misc]
            yield from self._cells(part, (*sides, side), t)
