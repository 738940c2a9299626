"""What the pictures of the gallery are by other means than Potto.

Owns `PICTURES`: by chapter, program and function or shader, as in the tables of the gallery, the mean over a pixel and
its derivatives, of its middle, its side and what is given.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
from exact_curves import differences
from exact_rays import half_shadow
from level_sets_reference import Function, Given, integral

Seen = tuple[float, dict[str, float]]


class Vector(NamedTuple):
    """In space; each part a number, or numbers of many places."""

    x: Any
    y: Any
    z: Any

    def less(self, other: Vector) -> Vector:
        return Vector(*(a - b for a, b in zip(self, other, strict=True)))

    def times(self, factor: Any) -> Vector:
        return Vector(*(factor * a for a in self))


def pixel(surfaces: list[Function], colour: Function) -> Callable[[float, float, float, Mapping[str, float]], Seen]:
    """The mean over a pixel of what has a colour between surfaces."""

    def seen(x: float, y: float, h: float, given: Mapping[str, float]) -> Seen:
        box = x - h / 2, x + h / 2, y - h / 2, y + h / 2
        value, slopes = integral(surfaces, colour, box, given)
        return value / h**2, {name: slope / h**2 for name, slope in slopes.items()}

    return seen


def _dot(a: Any, b: Any) -> Any:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Any, b: Any) -> Any:
    return Vector(*(a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3)))


def _all(*conditions: Any) -> Any:
    """Where all are positive."""
    return np.logical_and.reduce([np.real(c) > 0 for c in np.broadcast_arrays(*conditions)])


# The paper's second figure


def _light(shade: Callable[[Any], Any]) -> Callable[[float, float, float, Mapping[str, float]], Seen]:
    def line(x: Any, y: Any, given: Given) -> Any:
        return x + y + given["c"]

    return pixel([line], lambda x, y, g: np.where(np.real(line(x, y, g)) > 0, shade(line(x, y, g)), 0.0))


# The tilted triangle: a ray from the eye meets its plane at the eye + s d


def _rays(x: Any, y: Any, given: Given) -> tuple[Any, list[Any], Any, Any]:
    """The ray, the sides of the pyramid over the triangle, its normal and a corner, all from the eye."""
    eye = Vector(given["ex"], 0, -2)
    a, b, c = (
        corner.less(eye) for corner in (Vector(-1.4, -1.1, 1), Vector(1.5, given["q"], 2), Vector(-0.3, 1.2, 0.5))
    )
    ray = Vector(x, y, given["focal"])
    return ray, [_dot(_cross(p, q), ray) for p, q in ((a, b), (b, c), (c, a))], _cross(c.less(a), b.less(a)), a


def _lit(x: Any, y: Any, given: Given, law: bool) -> Any:
    """How much more of the light arrives than the threshold."""
    ray, _, n, a = _rays(x, y, given)
    hit = ray.times(_dot(n, a) / _dot(n, ray))
    light = Vector(given["lx"], -0.2, -0.5).less(Vector(given["ex"], 0, -2)).less(hit)
    far = _dot(light, light)
    cosine = _dot(n, light) / (np.sqrt(_dot(n, n)) * np.sqrt(far))
    return (cosine / far if law else cosine) - given["threshold"]


def _side(k: int) -> Function:
    return lambda x, y, given: _rays(x, y, given)[1][k]


def _depth(x: Any, y: Any, given: Given) -> Any:
    ray, sides, n, a = _rays(x, y, given)
    return np.where(_all(*sides), _dot(n, ray) / _dot(n, a), 0.0)


def _tones(law: bool) -> Callable[[float, float, float, Mapping[str, float]], Seen]:
    def colour(x: Any, y: Any, given: Given) -> Any:
        bright = np.where(np.real(_lit(x, y, given, law)) > 0, 0.9, 0.3)
        return np.where(_all(*_rays(x, y, given)[1]), bright, 0.0)

    return pixel([_side(0), _side(1), _side(2), lambda x, y, given: _lit(x, y, given, law)], colour)


# Three planks


def _planks(z: Any) -> list[list[Any]]:
    corners = [[(-2, -1, 3), (2, -1, z), (2, -0.5, z)], [(1.5, -2, 3), (1.5, 2, 5), (1, 2, 5)],
               [(1.8, 1.6, 3.2), (-1.8, -1.9, 4.4), (-1.2, -1.9, 4.6)]]  # fmt: skip
    return [[Vector(*corner) for corner in t] for t in corners]


def _met(k: int, x: Any, y: Any, given: Given) -> list[Any]:
    """Three numbers that are positive where a ray meets a plank, and one over the distance of its plane."""
    a, b, c = _planks(given["z"])[k]
    ray, n = Vector(x, y, 1), _cross(b.less(a), c.less(a))
    return [*(_dot(_cross(p, q), ray) for p, q in ((a, b), (b, c), (c, a))), _dot(n, ray) / _dot(n, a)]


def _nearest(x: Any, y: Any, given: Given) -> Any:
    shown, nearest = 0.0 * np.real(x + y), 0.0 * np.real(x + y)
    for k, grey in enumerate((0.9, 0.6, 0.3)):
        *sides, near = _met(k, x, y, given)
        front = _all(*sides) & (np.real(near) > nearest)
        shown, nearest = np.where(front, grey, shown), np.where(front, np.real(near), nearest)
    return shown


PLANKS: list[Function] = [lambda x, y, g, k=k, i=i: _met(k, x, y, g)[i] for k in range(3) for i in range(3)]
PLANKS += [lambda x, y, g, i=i, j=j: _met(i, x, y, g)[3] - _met(j, x, y, g)[3] for i, j in combinations(range(3), 2)]


# A sphere around (0.2, 0.1, 3), as the eye sees it


def _under(x: Any, y: Any, given: Given) -> Any:
    """What is under the root of the distance: positive where the sphere is met."""
    middle, ray = Vector(0.2, 0.1, 3), Vector(x, y, 1)
    return _dot(middle, ray) ** 2 - _dot(ray, ray) * (_dot(middle, middle) - given["r"] ** 2)


def _towards(x: Any, y: Any, given: Given) -> Any:
    """The cosine of the light's angle without 0.7; beyond the silhouette, as on it."""
    middle, ray, under = Vector(0.2, 0.1, 3), Vector(x, y, 1), _under(x, y, given)
    reached = np.where(np.real(under) > 0, under, 0)
    hit = ray.times((_dot(middle, ray) - np.sqrt(reached)) / _dot(ray, ray))
    n, light = hit.less(middle), Vector(given["lx"], 1, 0.5).less(hit)
    return _dot(n, light) / (np.sqrt(_dot(n, n)) * np.sqrt(_dot(light, light))) - 0.7


def _round(x: Any, y: Any, given: Given) -> Any:
    tones = np.where(np.real(_towards(x, y, given)) > 0, 0.9, 0.3)
    return np.where(np.real(_under(x, y, given)) > 0, tones, 0.0)


# Shadows on the floor


def _cast(x: Any, y: Any, given: Given) -> list[Any]:
    """The sides of a triangle's shadow: the lamp is three times as high as the triangle."""
    lamp = given["lx"], 0.4
    corners = [[c + (c - end) / 2 for c, end in zip(corner, lamp)]
               for corner in ((0.3, 0.3), (given["q"], 0.35), (0.4, 0.8))]  # fmt: skip
    return [(b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) for a, b in zip(corners, corners[1:] + corners[:1])]


def _half_shadow(x: float, y: float, h: float, given: Mapping[str, float]) -> Seen:
    value, slope = differences(lambda lx: half_shadow(lx, x, y, h), 60, 1e-25)(given["lx"])[1]
    return value, {"lx": slope}


def soft_triangle(x: float, y: float, h: float, given: Mapping[str, float]) -> Seen:
    """Of a level triangle by a square lamp: p is dark for a light at l where p + l/2 is in 1.5 times the triangle.

    Both coordinates of p + l/2 are a sum of two even ones, of widths h and 0.2: their densities are trapezes.
    """
    half, slant = (0.2 + h) / 2, (0.2 - h) / 2

    def density(t: Any) -> Any:
        inwards = np.where(np.real(t) > 0, half - t, half + t) / (0.2 * h)
        return np.where(np.abs(np.real(t)) < slant, 5.0, inwards)

    def away(x: Any, y: Any, given: Given) -> tuple[Any, Any]:
        return x - middle[0] - 0.5 * (given["lx"] - place), y - middle[1]

    def sides(x: Any, y: Any, given: Given) -> list[Any]:
        corners = [(1.5 * a, 1.5 * b) for a, b in ((0.3, 0.3), (given["q"], 0.35), (0.4, 0.8))]
        return [(b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])
                for a, b in zip(corners, corners[1:] + corners[:1])]  # fmt: skip

    def dark(x: Any, y: Any, given: Given) -> Any:
        dx, dy = away(x, y, given)
        inside = _all(*sides(x, y, given)) & (np.abs(np.real(dx)) < half)
        return np.where(inside, density(dx) * density(dy), 0.0)

    place = given["lx"]
    middle = x + 0.5 * place, y + 0.5 * 0.4
    lines: list[Function] = [lambda x, y, g, k=k: sides(x, y, g)[k] for k in range(3)]
    lines += [lambda x, y, g, a=a, s=s: away(x, y, g)[a] - s for a in (0, 1) for s in (slant, -slant)]
    lines += [lambda x, y, g, s=s: away(x, y, g)[0] - s for s in (0.0, half, -half)]
    lines += [lambda x, y, g: away(x, y, g)[1]]
    reach = half + 0.01, half
    box = middle[0] - reach[0], middle[0] + reach[0], middle[1] - reach[1], middle[1] + reach[1]
    value, slopes = integral(lines, dark, box, given)
    return 1 - value, {name: -slope for name, slope in slopes.items()}


ROOT = np.sqrt(2)
PICTURES: dict[tuple[str, str, str], Callable[[float, float, float, Mapping[str, float]], Seen]] = {
    ("paper", "image", "const_shader"): _light(lambda u: 1.0 + 0 * u),
    ("paper", "image", "lin_shader"): _light(lambda u: 1 / (ROOT * u + 2)),
    ("paper", "image", "quad_shader"): _light(lambda u: 1 / (ROOT * u + 2) ** 2),
    ("raytrace", "main", "by_depth"): pixel([_side(0), _side(1), _side(2)], _depth),
    ("raytrace", "main", "two_tones"): _tones(False),
    ("raytrace", "main", "by_law"): _tones(True),
    ("raytrace", "hidden", "picture"): pixel(PLANKS, _nearest),
    ("raytrace", "sphere", "silhouette"): pixel([_under], lambda x, y, g: np.where(_all(_under(x, y, g)), 1.0, 0.0)),
    ("raytrace", "sphere", "shaded"): pixel([_under, _towards], _round),
    ("raytrace", "shadows", "triangle"): pixel(
        [lambda x, y, g, k=k: _cast(x, y, g)[k] for k in range(3)],
        lambda x, y, g: np.where(_all(*_cast(x, y, g)), 0.0, 1.0),
    ),
    ("raytrace", "shadows", "edge"): _half_shadow,
}


def _projected(given: Mapping[str, float]) -> list[tuple[float, float]]:
    """Where the corners of the tilted triangle are seen."""
    corners = (-1.4, -1.1, 1), (1.5, given["q"], 2), (-0.3, 1.2, 0.5)
    return [(given["focal"] * (x - given["ex"]) / (z + 2), given["focal"] * y / (z + 2)) for x, y, z in corners]


def _plank_corners(given: Mapping[str, float]) -> list[tuple[float, float]]:
    return [(c.x / c.z, c.y / c.z) for plank in _planks(given["z"]) for c in plank]


def _shadow_corners(given: Mapping[str, float]) -> list[tuple[float, float]]:
    corners = (0.3, 0.3), (given["q"], 0.35), (0.4, 0.8)
    return [(1.5 * x - 0.5 * given["lx"], 1.5 * y - 0.2) for x, y in corners]


CORNERS: dict[tuple[str, str], Callable[[Mapping[str, float]], list[tuple[float, float]]]] = {
    ("raytrace", "main"): _projected,
    ("raytrace", "hidden"): _plank_corners,
    ("raytrace", "shadows"): lambda given: _shadow_corners(given) if "q" in given else [],
}
