"""Areas and moments of what half planes leave of a rectangle, exactly: an oracle that shares nothing with Potto's.

Owns `Scene`. Lines cut the rectangle into convex cells, by clipping in rational arithmetic; on each of them conditions
are true or false and the integrand is affine. All of that is exact, and what it comes to is a piecewise polynomial of
what moves.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction

Point = tuple[Fraction, Fraction]
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
        sign = (1 if lo <= hi else -1) * (1 if y0 <= y1 else -1)
        corners = [(lo, y0), (hi, y0), (hi, y1), (lo, y1)]
        return sign * sum(map(self._moment, self._cells(corners, (), t)), Fraction(0))

    def rate(self, t: Fraction, step: Fraction) -> Fraction:
        """The derivative to the side of the step."""
        return (self.value(t + step) - self.value(t)) / step

    def _cells(self, corners: list[Point], sides: tuple[bool, ...], t: Fraction) -> Iterator[list[Point]]:
        if len(corners) < 3:
            return
        if len(sides) == len(self.lines):
            if self.truth(sides):
                yield corners
            return
        margin = [self.lines[len(sides)].at(corner, t) for corner in corners]
        for side in (True, False):
            yield from self._cells(_clipped(corners, [m if side else -m for m in margin]), (*sides, side), t)

    def _moment(self, corners: list[Point]) -> Fraction:
        p, q, r = map(Fraction, self.weight)
        total = Fraction(0)
        for i in range(1, len(corners) - 1):
            three = (corners[0], corners[i], corners[i + 1])
            (x0, y0), (x1, y1), (x2, y2) = three
            area = abs((x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)) / 2
            total += area * (p + q * (x0 + x1 + x2) / 3 + r * (y0 + y1 + y2) / 3)
        return total


def _clipped(corners: list[Point], margin: list[Fraction]) -> list[Point]:
    """What of a convex polygon has a margin that is not negative."""
    out: list[Point] = []
    for i, (here, m) in enumerate(zip(corners, margin, strict=True)):
        there, n = corners[i - 1], margin[i - 1]
        if (m > 0 > n) or (m < 0 < n):
            share = n / (n - m)
            out.append((there[0] + share * (here[0] - there[0]), there[1] + share * (here[1] - there[1])))
        if m >= 0:
            out.append(here)
    return out
