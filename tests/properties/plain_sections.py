"""Integrals over regions of a box by sections: a reference for tests that shares nothing with Potto.

Owns `Region`. Where all of some functions g(x, y, t) are negative, a weight w(x, y, t) is integrated. At a fixed x the
roots of each g in y are found between its turning points, and these on a grid, by halving; along x the section is
smooth between the places where the roots that matter, or their order, change, which are found in the same way. How the
ends of sections move comes from derivatives by complex steps, exact to rounding; so functions must be analytic. Two
rules say how good it all was, and a third one whose nodes crowd at the ends, down to 1e-15: where a section ends just
before it folds the others see nothing of that.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

Function = Callable[[Any, Any, Any], Any]  # of x, y, t
ACROSS, ALONG = 601, 181  # points of the grids, at places that no program would choose
HALVINGS = 52
ORDERS = (36, 60)
CROWDED, REACH = 101, 3.15  # a rule with double exponentials, whose outermost nodes are 1e-16 from the ends
DOUBT = 1e-7  # what that one may be off by itself, since there roots are rounded
STEP = 1e-30  # of complex steps
BESIDE = 1e-13  # how far from a step it is looked at
INNER, INNER_WEIGHTS = np.polynomial.legendre.leggauss(24)


@dataclass(frozen=True)
class Answer:
    """An integral and its derivative by t, and what a rule with fewer nodes changes of them."""

    value: float
    slope: float
    value_error: float
    slope_error: float


def smoothing(count: int) -> tuple[Any, Any]:
    """Gauss nodes and weights in [0, 1] behind a cubic substitution, which smooths square roots at the ends."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    s = 0.5 * (nodes + 1)
    return s * s * (3 - 2 * s), 3 * s * (1 - s) * weights


def tanh_sinh(count: int) -> tuple[Any, Any]:
    """Nodes in [0, 1] and weights of the rule of Takahasi and Mori."""
    s = np.linspace(-REACH, REACH, count)
    e = np.exp(-np.pi * np.sinh(np.abs(s)))
    nearer = e / (1 + e)  # the distance from the nearer end
    weights = np.cosh(s) * nearer * (1 - nearer)
    return np.where(s < 0, nearer, 1 - nearer), weights / weights.sum()


@dataclass(frozen=True)
class Region:
    """Where all `functions` are negative in [low, high]^2, weighted."""

    functions: Sequence[Function]
    weight: Function
    low: float
    high: float

    def integral(self, t: float) -> Answer:
        places = self.places(t)
        (rough, rate), (value, slope) = (self.by_rule(places, t, *smoothing(order)) for order in ORDERS)
        _, crowded = self.by_rule(places, t, *tanh_sinh(CROWDED))
        apart = abs(slope - crowded)
        return Answer(value, slope, abs(value - rough), max(abs(slope - rate), apart if apart > DOUBT else 0.0))

    def by_rule(self, places: Any, t: float, nodes: Any, weights: Any) -> tuple[float, float]:
        left, width = places[:-1, None], np.diff(places)[:, None]
        x, w = left + width * nodes, (width * weights).ravel()
        f, df = self.section(x.ravel(), t)
        return float(f @ w), float(df @ w) + self.steps(places[1:-1], t)

    def steps(self, places: Any, t: float) -> float:
        """What the derivative gains where a surface that runs along y moves."""
        total = 0.0
        for g in self.functions:
            if not places.size:
                break
            x = np.linspace(self.low, self.high, 7)
            if not np.array_equal(g(x, self.low, t) + 0 * x, g(x, self.high, t) + 0 * x):
                continue
            slope = np.imag(g(places + 1j * STEP, self.low, t)) / STEP + 0 * places
            here = np.abs(g(places, self.low, t)) <= 1e-9 * (1 + np.abs(slope))
            x, slope, places = places[here], slope[here], places[~here]  # the same surface may be there twice
            moved = np.imag(g(x, self.low, t + 1j * STEP)) / STEP
            before, after = (self.section(x + side * BESIDE, t)[0] for side in (-1, 1))
            total += float(np.sum((before - after) * -moved / slope))
        return total

    def places(self, t: float) -> Any:
        """The ends of the box, and all places between them where a section changes its ends."""
        x = self.low + (self.high - self.low) * (np.linspace(0, 1, ACROSS) * 0.9999998 + 1e-7)
        marks = self.marks(x, t)
        at = np.nonzero(marks[1:] != marks[:-1])[0]
        brackets = [(x[at], x[at + 1], marks[at], marks[at + 1])]
        found: list[Any] = []
        for _ in range(HALVINGS):
            a, b, at_a, at_b = brackets.pop()
            if not a.size:
                break
            middle = 0.5 * (a + b)
            here = self.marks(middle, t)
            same, other = here == at_a, (here != at_a) & (here != at_b)
            brackets.append(tuple(
                np.concatenate(pair) for pair in (
                    (np.where(same, middle, a), middle[other]), (np.where(same, b, middle), b[other]),
                    (at_a, here[other]), (np.where(same, at_b, here), at_b[other]),
                )
            ))  # fmt: skip
        if brackets:
            found.append(brackets[0][1])
        inner = np.unique(np.concatenate([*found, np.zeros(0)]))
        return np.concatenate(([self.low], inner[(inner > self.low) & (inner < self.high)], [self.high]))

    def marks(self, x: Any, t: float) -> Any:
        """One number for each x that tells which surfaces bound the section there, in which order."""
        _, which, inside = self.pieces(x, t)
        mark = np.full(x.size, 7, dtype=np.uint64)
        for lower, upper, here in zip(which[:-1], which[1:], inside, strict=True):
            number = (np.uint64(31) * lower.astype(np.uint64) + upper.astype(np.uint64) + np.uint64(1)) * np.uint64(2)
            mark = np.where(here, (mark ^ number) * np.uint64(0x9E3779B97F4A7C15), mark)
        return mark

    def pieces(self, x: Any, t: float) -> tuple[Any, Any, Any]:
        """Roots and bounds in order, which function each is of (0 and 1 are the bounds), what lies between counts."""
        rows, owners = [np.full(x.size, self.low), np.full(x.size, self.high)], [0, 1]
        for number, g in enumerate(self.functions):
            found = self.roots(g, x, t)
            rows += list(found)
            owners += [number + 2] * len(found)
        y, which = np.stack(rows), np.repeat(np.array(owners)[:, None], x.size, axis=1)
        order = np.argsort(y, axis=0, kind="stable")
        y, which = np.take_along_axis(y, order, 0), np.take_along_axis(which, order, 0)
        middle = 0.5 * (y[1:] + y[:-1])
        inside = (y[1:] > y[:-1]) & (y[1:] <= self.high)
        for g in self.functions:
            inside &= g(x, middle, t) < 0
        return y, which, inside

    def roots(self, g: Function, x: Any, t: float) -> Any:
        """The roots along y at each x, a row each; rows are filled up with places beyond the box."""
        y = np.repeat(self.low + (self.high - self.low) * np.linspace(0, 1, ALONG)[:, None], x.size, axis=1)
        turns = self.changes(lambda x, y: np.imag(g(x, y + 1j * STEP, t)), x, y)
        return self.changes(lambda x, y: g(x, y, t), x, np.sort(np.concatenate((y, np.minimum(turns, self.high))), 0))

    def changes(self, g: Callable[[Any, Any], Any], x: Any, y: Any) -> Any:
        """Where the sign changes along columns of places, by halving."""
        values = np.broadcast_to(g(x, y), y.shape) > 0
        at, column = np.nonzero(values[1:] != values[:-1])
        a, b, rising = y[at, column], y[at + 1, column], values[at + 1, column]
        for _ in range(HALVINGS):
            middle = 0.5 * (a + b)
            above = (g(x[column], middle) > 0) == rising
            a, b = np.where(above, a, middle), np.where(above, middle, b)
        order = np.lexsort((at, column))
        column, a = column[order], a[order]
        count = np.bincount(column, minlength=x.size)
        rows = np.full((int(count.max(initial=0)), x.size), self.high + 1.0)
        rows[np.arange(column.size) - (np.cumsum(count) - count)[column], column] = a
        return rows

    def section(self, x: Any, t: float) -> tuple[Any, Any]:
        """The integral over the section at each x, and its derivative."""
        y, which, inside = self.pieces(x, t)
        speeds = np.zeros(y.shape)
        for number, g in enumerate(self.functions):
            mine = (which == number + 2) & (y < self.high)
            along = np.imag(g(x, y + 1j * STEP, t))
            moved = np.imag(g(x, y, t + 1j * STEP))
            speeds = np.where(mine, -moved / np.where(along == 0, 1.0, along), speeds)
        f, df = np.zeros(x.size), np.zeros(x.size)
        for i, here in enumerate(inside):
            a, b = y[i], y[i + 1]
            u = a + 0.5 * (b - a) * (INNER[:, None] + 1)
            w = self.weight(x, u, t + 1j * STEP) * np.ones_like(u)
            part, rate = (0.5 * (b - a) * (INNER_WEIGHTS @ v) for v in (np.real(w), np.imag(w) / STEP))
            ends = [np.real(self.weight(x, end, t)) * np.ones_like(x) for end in (b, a)]
            f += np.where(here, part, 0.0)
            df += np.where(here, rate + ends[0] * speeds[i + 1] - ends[1] * speeds[i], 0.0)
        return f, df
