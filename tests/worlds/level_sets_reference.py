"""Regions of the plane that curves bound, integrated by sections, in double precision: what the gallery is held to.

Owns `integral`. Knows nothing of how Potto does it: a square is turned by a fixed angle, so that no edge is upright,
and cut into strips where two curves meet or one turns round (Newton's method from a lattice of places); within a strip
each section is a sum over intervals between roots (Newton's method between the extremes of a curve's function).
Derivatives are Leibniz' rule: what the colours change inside, and the jumps at the roots times their speeds. All slopes
are by complex steps of 1e-30, which lose no digits: functions are given complex numbers, and compare real parts.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from itertools import combinations, pairwise
from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]
Given = Mapping[str, complex]
Function = Callable[[Any, Any, Given], Any]  # of x, y and parameters

ANGLE = 0.37  # generic: no picture has edges in that direction
STEP = 1e-30
STEPS = 60  # of Newton's method, halved intervals where it leaves them
TO_MEET = 20  # of it from many places at once, some of which get there sooner


def integral(
    surfaces: Sequence[Function], colour: Function, box: tuple[float, float, float, float], given: Mapping[str, float],
    seeds: int = 7, nodes: int = 24, across: int = 8,
) -> tuple[float, dict[str, float]]:  # fmt: skip
    """The integral over a box (x0, x1, y0, y1), and its derivatives by all that is given.

    colour: smooth where none of the surfaces is 0. seeds: places along each side of the box from which curves are
    looked for; there must be one near each meeting and each turn. nodes, across: of Gauss, over a
    strip and along an interval of a section.
    """
    scene = _Scene(surfaces, colour, box, given)
    places = scene.places(seeds)
    rule, weights = _gauss(nodes)
    s = 0.5 + 0.5 * rule
    value, slopes = 0.0, dict.fromkeys(given, 0.0)
    for a, b in pairwise(places):
        u = a + (b - a) * s * s * (3 - 2 * s)  # what ends like a square root has all its derivatives so
        w = 0.5 * weights * (b - a) * 6 * s * (1 - s)
        for place, weight, roots in zip(u, w, scene.roots(u, seeds), strict=True):
            part, moved = scene.section(place, sorted(roots), across)
            value += weight * part
            for name in slopes:
                slopes[name] += weight * moved[name]
    return value, slopes


class _Scene:
    """Surfaces and colours in turned coordinates (u, v); the sides of the box are its first four surfaces."""

    def __init__(
        self, surfaces: Sequence[Function], colour: Function, box: tuple[float, ...], given: Mapping[str, float]
    ) -> None:
        x0, x1, y0, y1 = box
        self.given: dict[str, complex] = dict(given)
        middle = 0.5 * (x0 + x1), 0.5 * (y0 + y1)
        c, s = np.cos(ANGLE), np.sin(ANGLE)

        def turned(f: Function) -> Function:
            return lambda u, v, g: f(middle[0] + c * u - s * v, middle[1] + s * u + c * v, g)

        sides: list[Function] = [lambda x, y, g: x - x0, lambda x, y, g: x1 - x,
                                 lambda x, y, g: y - y0, lambda x, y, g: y1 - y]  # fmt: skip
        self.surfaces = [turned(f) for f in (*sides, *surfaces)]
        self.colour = turned(colour)
        half = 0.5 * (x1 - x0), 0.5 * (y1 - y0)
        self.reach = abs(c) * half[0] + abs(s) * half[1], abs(s) * half[0] + abs(c) * half[1]

    def along(self, f: Function, u: Any, v: Any) -> tuple[Array, Array]:
        """A function and its derivative by v."""
        found = np.asarray(f(u, v + 1j * STEP, self.given) + 0j * u)
        return found.real, found.imag / STEP

    def inside(self, u: Any, v: Any, slack: float = 0.0) -> Array:
        least = [f(u, v, self.given).real + 0 * u for f in self.surfaces[:4]]
        return np.asarray(np.min(least, axis=0) >= -slack * self.reach[0])

    def places(self, seeds: int) -> list[float]:
        """Where strips begin and end: in u, from one corner to the other."""
        line = np.linspace(-1, 1, seeds)
        u, v = (x.ravel() for x in np.meshgrid(self.reach[0] * line, self.reach[1] * line))
        found = []
        pairs = [(f, g) for f, g in combinations(self.surfaces, 2)]
        turns = [(f, lambda u, v, g, f=f: self.bent(f, u, v)) for f in self.surfaces[4:]]
        for f, g in (*pairs, *turns):
            x, y = self.meeting(f, g, u, v)
            found += list(x[self.inside(x, y, 1e-9)])
        ends = np.sort([-self.reach[0], *found, self.reach[0]])
        apart = np.concatenate([[True], np.diff(ends) > 1e-12 * self.reach[0]])
        return [float(x) for x in ends[apart] if abs(x) <= self.reach[0] * (1 + 1e-12)]

    def bent(self, f: Function, u: Any, v: Any) -> Any:
        """The derivative of f by v; of complex places, to first order in what is imaginary."""
        at = np.real(u), np.real(v)
        here = self.along(f, *at)[1]
        h = 1e-5 * self.reach[0]
        by_u = (self.along(f, at[0] + h, at[1])[1] - self.along(f, at[0] - h, at[1])[1]) / (2 * h)
        by_v = (self.along(f, at[0], at[1] + h)[1] - self.along(f, at[0], at[1] - h)[1]) / (2 * h)
        return here + 1j * (np.imag(u) * by_u + np.imag(v) * by_v)

    def meeting(self, f: Function, g: Function, u: Array, v: Array) -> tuple[Array, Array]:
        """Where both are 0, by Newton's method from many places; what does not get there is left out."""
        size = max(self.reach)
        with np.errstate(all="ignore"):
            for _ in range(TO_MEET):
                along_u = [np.asarray(each(u + 1j * STEP, v, self.given) + 0j * u) for each in (f, g)]
                (p, q), (pu, qu) = [x.real for x in along_u], [x.imag / STEP for x in along_u]
                pv, qv = (np.imag(each(u, v + 1j * STEP, self.given) + 0j * u) / STEP for each in (f, g))
                below = pu * qv - pv * qu
                du, dv = (p * qv - pv * q) / below, (pu * q - p * qu) / below
                longest = np.maximum(1.0, np.hypot(du, dv) / size)
                u, v = u - du / longest, v - dv / longest
                if np.nanmax(np.hypot(du, dv), initial=0.0) < 1e-15 * size:
                    break
            there = np.isfinite(u) & (np.hypot(du, dv) < 1e-11 * size)
        return u[there], v[there]

    def roots(self, u: Array, seeds: int) -> list[list[tuple[float, int]]]:
        """Of all surfaces along each section, with their numbers."""
        found: list[list[tuple[float, int]]] = [[] for _ in u]
        grid = np.broadcast_to(np.linspace(-1.001, 1.001, 4 * seeds) * self.reach[1], (u.size, 4 * seeds))
        for number, f in enumerate(self.surfaces):
            if number < 4:
                rows, low, high = np.arange(u.size), grid[:, 0], grid[:, -1]
                where = self.zero(f, u, low, high)
            else:
                turns = [self.between(u, grid, lambda a, b, f=f: self.bent(f, a, b))]
                rows, where = self.monotone(f, u, grid, *turns[0])
            for row, v in zip(rows, where, strict=True):
                found[row].append((float(v), number))
        return found

    def between(self, u: Array, grid: Array, f: Callable[[Any, Any], Any]) -> tuple[Array, Array]:
        """Where f changes its sign between neighbours on a grid: rows and places."""
        values = np.real(f(u[:, None], grid))
        rows, at = np.nonzero(values[:, 1:] * values[:, :-1] < 0)
        return rows, self.zero(lambda a, b, g: f(a, b), u[rows], grid[rows, at], grid[rows, at + 1])

    def monotone(self, f: Function, u: Array, grid: Array, rows: Array, turns: Array) -> tuple[Array, Array]:
        """The roots of f, looked for between the places of a grid and where f turns."""
        found_rows, found = [], []
        for row in range(u.size):
            places = np.sort(np.concatenate([grid[row], turns[rows == row]]))
            values = np.real(f(u[row], places, self.given) + 0j * places)
            at = np.nonzero(values[1:] * values[:-1] < 0)[0]
            found_rows.append(np.full(at.size, row))
            found.append(np.stack([places[at], places[at + 1]]))
        all_rows, ends = np.concatenate(found_rows), np.concatenate(found, axis=1)
        return all_rows, self.zero(f, u[all_rows], *ends)

    def zero(self, f: Function, u: Array, low: Array, high: Array) -> Array:
        """The root between ends of different signs: Newton's method, halves where it leaves them."""
        low, high = low.copy(), high.copy()
        sign = np.sign(np.real(f(u, high, self.given) + 0j * u))
        v = 0.5 * (low + high)
        for _ in range(STEPS):
            value, slope = self.along(f, u, v)
            above = value * sign > 0
            low, high = np.where(above, low, v), np.where(above, v, high)
            with np.errstate(all="ignore"):
                step = v - value / slope
            following = np.where((step >= low) & (step <= high), step, 0.5 * (low + high))
            if np.all(np.abs(following - v) <= 4e-16 * self.reach[1]):
                break
            v = following
        return v

    def section(self, u: float, roots: list[tuple[float, int]], across: int) -> tuple[float, dict[str, float]]:
        """The integral along a section, and its derivatives."""
        nodes, weights = _gauss(across)
        ends = np.array([v for v, _ in roots])
        low, gap = ends[:-1, None], np.diff(ends)[:, None]
        v = low + gap * (0.5 + 0.5 * nodes)
        seen = self.inside(u + 0 * v, v)[:, [0]]
        w = np.where(seen, 0.5 * gap * weights, 0.0)
        colours = np.where(seen, np.real(self.colour(u, v, self.given) + 0j * v), 0.0)
        value = float((w * colours).sum())
        limits = colours @ _ends(across)  # signs of curves are lost to rounding where two roots are about to merge
        slopes = {}
        for name in self.given:
            moved = {**self.given, name: self.given[name] + 1j * STEP}
            slope = float((w * np.imag(self.colour(u, v, moved) + 0j * v)).sum()) / STEP
            for k, (place, number) in enumerate(roots):
                if number >= 4:
                    below = limits[k - 1, 1] if k else 0.0
                    above = limits[k, 0] if k < len(roots) - 1 else 0.0
                    if below != above:
                        f = self.surfaces[number]
                        by = np.imag(f(u, place, moved) + 0j) / STEP
                        slope -= float((below - above) * by / self.along(f, np.array(u), np.array(place))[1])
            slopes[name] = slope
        return value, slopes


@cache
def _gauss(n: int) -> tuple[Array, Array]:
    return np.polynomial.legendre.leggauss(n)


@cache
def _ends(n: int) -> Array:
    """What gives the values of a polynomial at -1 and 1 by those at n nodes of Gauss, (n, 2)."""
    inside, ends = (np.polynomial.legendre.legvander(at, n - 1) for at in (_gauss(n)[0], np.array([-1.0, 1.0])))
    return np.asarray(np.linalg.solve(inside.T, ends.T))
