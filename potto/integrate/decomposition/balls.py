"""Numbers known up to a radius: arithmetic with a bound of all that rounding, and what is not known, may lead to.

Owns `Ball`. Midpoints and radii (Rump, Fast and parallel interval arithmetic, 1999), for values that are known to
nearly all digits: of such the radius of a product says as much as an interval, for a third of the operations.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from msgspec import Struct

from potto.integrate.rules.gauss import EPS
from potto.kernels.cells import Array, Bools


class Ball(Struct, frozen=True):
    """Values, and how far off each may be, in arrays of one shape; nan or infinite radii where nothing is known."""

    v: Array
    e: Array

    def __getitem__(self, at: Any) -> Ball:
        return Ball(self.v[at], self.e[at])

    def __neg__(self) -> Ball:
        return Ball(-self.v, self.e)

    def __add__(self, other: Ball) -> Ball:
        v = self.v + other.v
        return Ball(v, self.e + other.e + EPS * np.abs(v))

    def __sub__(self, other: Ball) -> Ball:
        return self + -other

    def __mul__(self, other: Ball) -> Ball:
        v = self.v * other.v
        e = np.abs(self.v) * other.e + self.e * (np.abs(other.v) + other.e)
        return Ball(v, e + EPS * np.abs(v))

    def __truediv__(self, other: Ball) -> Ball:
        """Infinite where what it is divided by may be 0."""
        v, least = self.v / other.v, np.abs(other.v) - other.e
        e = np.where(least > 0, (self.e + np.abs(v) * other.e) / least, np.inf)
        return Ball(v, e + EPS * np.abs(v))

    def times(self, scale: Any) -> Ball:
        """The product with what is exact."""
        v = self.v * scale
        return Ball(v, self.e * np.abs(scale) + EPS * np.abs(v))

    def root(self) -> Ball:
        """The square root, of what of it is not below 0; nan where all of it is."""
        v = np.sqrt(np.where(self.v < -self.e, np.nan, np.maximum(self.v, 0.0)))
        return Ball(v, np.fmin(self.e / v, np.sqrt(self.e)) + EPS * v)

    def may_vanish(self) -> Bools:
        """Where it may be 0, which it may where it is not known."""
        found: Bools = ~(np.abs(self.v) > self.e)
        return found


def exact(v: Array) -> Ball:
    """Numbers as they are."""
    return Ball(v, np.zeros_like(v))


def stacked(balls: list[Ball]) -> Ball:
    """Balls along a new first axis."""
    return Ball(np.stack([ball.v for ball in balls]), np.stack([ball.e for ball in balls]))
