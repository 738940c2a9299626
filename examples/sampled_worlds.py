"""The worlds as programs that sample first: sums over points, and steps in time, for numpy or for JAX.

Owns `WORLDS`. Each is written as it is in a library of arrays: `where` at the jumps, means over points at the middles
of cells. `xp` is the library.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

POINTS, SIDE, EACH = 1_000_000, 1000, 100  # along one variable, along each of two, of three and four


class World(NamedTuple):
    """A program's function of one number, where it is looked at, and the same by samples.

    near: how far the sampled value may be off. smooth: what it computes does not jump, so that the derivative of the
    sum is right but for the sampling.
    """

    program: str
    function: str
    place: float
    sampled: Callable[[Any, Any], Any]
    near: float = 2e-3
    smooth: bool = False


def middles(xp: Any, low: float, high: float, n: int = POINTS) -> Any:
    return low + (high - low) * (xp.arange(n) + 0.5) / n


def square(xp: Any, low: float = 0.0, high: float = 1.0) -> Any:
    return xp.meshgrid(middles(xp, low, high, SIDE), middles(xp, low, high, SIDE))


def normal(xp: Any, z: Any) -> Any:
    return xp.exp(-(z**2) / 2) / np.sqrt(2 * np.pi)


def repeated(xp: Any, steps: int, step: Callable[[Any], Any], state: Any) -> Any:
    """A loop; one of JAX's is compiled."""
    if xp is np:
        for _ in range(steps):
            state = step(state)
        return state
    import jax

    return jax.lax.fori_loop(0, steps, lambda _, s: step(s), state)


# Contact and control


def ball(xp: Any, wall: Any) -> Any:
    t = middles(xp, 0, 1)
    return xp.mean(xp.where(2 * t < wall.real, 2, -1))


def throw(xp: Any, v: Any) -> Any:
    t, speed, at = middles(xp, 0, 2.2), 2.0, 0.0
    for k in range(3):
        at = at + 2 * v * 0.8**k / 9.81
        speed = speed * xp.where(t > at.real, 0.9, 1.0)
    return 2.2 * xp.mean(speed)


def spring(xp: Any, stop: Any) -> Any:
    """Turned round wherever it is found beyond the stop."""

    def step(state: Any) -> Any:
        x, v = state
        v = v - 0.001 * x
        y = x + 0.001 * v
        beyond = y.real < stop.real
        return xp.where(beyond, 2 * stop - y, y), xp.where(beyond, -0.8 * v, v)

    return repeated(xp, 3000, step, (1 + 0 * stop, 0 * stop))[0]


def switch(xp: Any, s: Any) -> Any:
    t = middles(xp, 0, 2)
    return 2 * xp.mean((2 - t) * xp.where(t < s.real, 1, -1))


def pole(xp: Any, speed: Any) -> Any:
    noise = middles(xp, -0.4, 0.4, 1000)

    def step(state: Any) -> Any:
        x, v = state
        push = xp.mean(xp.where((x + speed * v).real + noise > 0, -0.5, 0.5))
        v = v + 0.005 * (xp.sin(x) + push * xp.cos(x))
        return x + 0.005 * v, v

    return repeated(xp, 1000, step, (0.1 + 0 * speed, 0 * speed))[0]


def room(xp: Any, target: Any) -> Any:
    t = 18.5 + 0 * target
    for axis in range(3):
        reading = middles(xp, -3, 3, EACH).reshape([-1 if k == axis else 1 for k in range(3)])
        t = t - 0.1 * (t - 5) + xp.where((t + reading).real < target.real, 3, 0)
    return xp.mean(t)


# Probability


def truncated(xp: Any, a: Any) -> Any:
    x = middles(xp, -8, 8)
    inside = xp.where((x > a.real) & (x < 2), 1, 0) * normal(xp, x)
    return xp.sum(inside * x) / xp.sum(inside)


def survivors(xp: Any, time: Any) -> Any:
    t = middles(xp, 0, 40)
    return 40 * xp.mean(xp.where(t > time.real, 1, 0) * 1.5 * 0.4**1.5 * t**0.5 * xp.exp(-((0.4 * t) ** 1.5)))


def order(xp: Any, q: Any) -> Any:
    z = middles(xp, -8, 8)
    d = xp.exp(3 + 0.4 * z)
    return 16 * xp.mean(normal(xp, z) * xp.where(d < q.real, q - d, 3 * (d - q)))


def digital(xp: Any, spot: Any) -> Any:
    z = middles(xp, -8, 8)
    later = spot * xp.exp(0.01 + 0.2 * z)
    return np.exp(-0.03) * 16 * xp.mean(normal(xp, z) * xp.where(later.real > 105, 1, 0))


def mistakes(xp: Any, threshold: Any) -> Any:
    x = middles(xp, -9, 9)
    sick = normal(xp, x - 1.5) * xp.where(x < threshold.real, 1, 0)
    return 18 * xp.mean(sick + 0.8 * normal(xp, x) * xp.where(x > threshold.real, 1, 0))


def accepted(xp: Any, near: Any) -> Any:
    p, noise = xp.meshgrid(middles(xp, -12, 12, SIDE), middles(xp, -6, 6, SIDE))
    kept = normal(xp, p / 2) * normal(xp, noise) * xp.where(abs(p + noise - 1.5) < near.real, 1, 0)
    return xp.sum(kept * p) / xp.sum(kept)


# Physics and geometry


def states(xp: Any, energy: Any) -> Any:
    k = middles(xp, -np.pi, np.pi)
    return xp.mean(xp.where(-2 * xp.cos(k) < energy.real, 1, 0))


def blobs(xp: Any, apart: Any) -> Any:
    x, y = square(xp, -3, 3)
    field = xp.exp(-((x + apart) ** 2) - y**2) + xp.exp(-((x - apart) ** 2) - y**2)
    return 36 * xp.mean(xp.where(field.real > 0.5, 1, 0))


def plate(xp: Any, w: Any) -> Any:
    x, y = square(xp)
    field = sum(k * xp.exp(-4 * ((x - c) ** 2 + (y - 0.5) ** 2)) for c, k in ((0, 0.5), (0.5, w), (1, 0.5))) - 0.5
    return xp.mean(xp.where(field.real > 0, 1, 0) * (1 / (1 + 4 * (x - 0.5) ** 2 + 4 * y**2) - 0.6))


def clouds(xp: Any, threshold: Any) -> Any:
    x, y = square(xp, 0, 2)
    waves = ((1.0, 2.3, 0.4), (-2.9, 1.1, 1.7), (2.1, -3.7, 4.2), (4.3, 3.1, 2.9))
    return xp.mean(xp.where(sum(xp.cos(a * x + b * y + c) for a, b, c in waves) / 4 > threshold.real, 1, 0))


def half(xp: Any, x_of_site: Any) -> Any:
    x = middles(xp, 0, 1)  # both sites have the same height
    return xp.mean(xp.where((x - 0.2) ** 2 < ((x - x_of_site) ** 2).real, 1, 0))


def arrow(xp: Any, tip: Any) -> Any:
    x, y = square(xp)
    corners = ((0.1, 0.1), (tip, 0.5), (0.2, 0.9), (0.4, 0.45))
    turns = 0
    for (ax, ay), (bx, by) in zip(corners, (*corners[1:], corners[0])):
        beside = x < (ax + (y - ay) * (bx - ax) / (by - ay)).real
        up, down = (ay <= y) & (y < by), (by <= y) & (y < ay)
        turns = turns + xp.where(beside & up, 1, 0) - xp.where(beside & down, 1, 0)
    return xp.mean(turns)


# Pictures: one pixel each


def light(xp: Any, c: Any) -> Any:
    x, y = square(xp, 0.25, 0.5)
    s = x + y + c
    return xp.mean(xp.where(s.real >= 0, 1 / (np.sqrt(2) * s + 2) ** 2, 0))


def dot(a: Any, b: Any) -> Any:
    return sum(u * v for u, v in zip(a, b))


def cross(a: Any, b: Any) -> Any:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def minus(a: Any, b: Any) -> Any:
    return tuple(u - v for u, v in zip(a, b))


def facing(a: Any, b: Any, c: Any, ray: Any) -> Any:
    """Whether rays are inside of a triangle, and one over its distance."""
    n = cross(minus(c, a), minus(b, a))
    inside = (dot(cross(a, b), ray).real >= 0) & (dot(cross(b, c), ray).real >= 0) & (dot(cross(c, a), ray).real >= 0)
    return inside, dot(n, ray) / dot(n, a), n


def tones(xp: Any, q: Any) -> Any:
    """The tilted triangle in two tones, in a pixel of 0.2 around (0.1, -0.2)."""
    x, y = xp.meshgrid(middles(xp, 0.0, 0.2, SIDE), middles(xp, -0.3, -0.1, SIDE))
    corners = ((-1.4, -1.1, 3.0), (1.5, q, 4.0), (-0.3, 1.2, 2.5))
    inside, near, n = facing(*corners, (x, y, 1.0))
    lamp = (0.2 - x / near, -0.2 - y / near, 1.5 - 1 / near)
    cosine = dot(n, lamp) / xp.sqrt(dot(n, n) * dot(lamp, lamp))
    return xp.mean(xp.where(inside, xp.where(cosine.real > 0.8, 0.9, 0.3), 0))


def planks(xp: Any, z: Any) -> Any:
    x, y = xp.meshgrid(middles(xp, 0.25, 0.5, SIDE), middles(xp, -0.25, 0.0, SIDE))
    scene = (((-2, -1, 3), (2, -1, z), (2, -0.5, z)), ((1.5, -2, 3), (1.5, 2, 5), (1, 2, 5)),
             ((1.8, 1.6, 3.2), (-1.8, -1.9, 4.4), (-1.2, -1.9, 4.6)))  # fmt: skip
    colour, nearest = xp.zeros(x.shape), xp.zeros(x.shape)
    for grey, triangle in zip((0.9, 0.6, 0.3), scene):
        inside, near, _ = facing(*triangle, (x, y, 1.0))
        seen = inside & (near.real > nearest)
        colour, nearest = xp.where(seen, grey, colour), xp.where(seen, near.real, nearest)
    return xp.mean(colour)


def sphere(xp: Any, r: Any) -> Any:
    x, y = xp.meshgrid(middles(xp, 0.2, 0.4, SIDE), middles(xp, -0.1, 0.1, SIDE))
    m = (0.2, 0.1, 3.0)
    md, dd = m[0] * x + m[1] * y + m[2], x**2 + y**2 + 1
    return xp.mean(xp.where((md**2 - dd * (dot(m, m) - r**2)).real > 0, 1, 0))


def shadow(xp: Any, q: Any) -> Any:
    """Cast by a lamp three times as high as the triangle."""
    x, y = xp.meshgrid(middles(xp, 0.9, 1.15, SIDE), middles(xp, 0.2, 0.45, SIDE))
    cast = [(1.5 * a - 0.25, 1.5 * b - 0.2) for a, b in ((0.3, 0.3), (q, 0.35), (0.4, 0.8))]
    dark = x > -1e9
    for (ax, ay), (bx, by) in zip(cast, (*cast[1:], cast[0])):
        dark = dark & (((bx - ax) * (y - ay) - (by - ay) * (x - ax)).real > 0)
    return xp.mean(xp.where(dark, 0, 1))


def soft(xp: Any, lx: Any) -> Any:
    x, y, u, v = (middles(xp, low, high, 32).reshape([-1 if k == axis else 1 for k in range(4)])
                  for axis, (low, high) in enumerate(((0.3, 0.5), (0.2, 0.4), (-0.2, 0.2), (-0.2, 0.2))))  # fmt: skip
    lit = (x - 0.6 + (lx + u) / 2) - 0.2 * (y + (0.4 + v) / 2)
    return xp.mean(xp.where(lit.real > 0, 1, 0))


def mesh(xp: Any, place: Any) -> Any:
    """A picture of one pixel, 0.2, under a grey triangle of which a corner moves and a white rest."""
    x, y = square(xp)
    corners = ((0.1, 0.1), (place, 0.3), (0.3, 0.9))
    inside = x > -1e9
    for (ax, ay), (bx, by) in zip(corners, (*corners[1:], corners[0])):
        inside = inside & (((bx - ax) * (y - ay) - (by - ay) * (x - ax)).real >= 0)
    return xp.mean(xp.where(inside, 3 * 0.3**2, 0))


TILTED = "pixel(tilted(t), camera(0, 1), \\(p, n, s) . lambert(p, n, s, lamp(0.2), 0.8), 0, -0.3, 0.2)"
SPHERE = "pixel((0.2, 0.1, 1), t, Camera((0, 0, -2), 1), \\(p, n, s) . 1, 0.2, -0.1, 0.2)"
SHADOW = "sharp(Triangle((0.3, 0.3, 1), (t, 0.35, 1), (0.4, 0.8, 1)), lamp(0.5), 0.9, 0.2, 0.25)"
SOFT = "soft((0.4, 0, 1), (0.6, 1, 1), lamp(t), 0.4, 0.3, 0.2, 0.2)"
MESH = "by_constant([(0.1, 0.1), (t, 0.3), (0.3, 0.9)], [(0, 1, 2)], [[(0.5, 0.5, 0.5)]], [[(0.2, 0.2, 0.2)]])"
WORLDS = (
    World("paper/image", r"\c . mean(0.375, 0.375, 0.25, c, quad_shader)", -0.7, light),
    World("raytrace/main", rf"\t . {TILTED}", -0.2, tones),
    World("raytrace/hidden", r"\z . pixel(planks(z), greys, 0.25, -0.25, 0.25)", 5.0, planks),
    World("raytrace/sphere", rf"\t . {SPHERE}", 0.8, sphere),
    World("raytrace/shadows", rf"\t . {SHADOW}", 0.9, shadow),
    World("raytrace/shadows", rf"\t . {SOFT}", 0.5, soft, 1e-2),
    World("stylize/stylize", rf"\t . {MESH}", 0.9, mesh),
    World("dynamics/ball_and_wall", r"\w . place(2, w, 0.5)", 1.5, ball),
    World("dynamics/three_impacts", r"\v . fst(landing(2, v, 2.2))", 4.0, throw),
    World("dynamics/spring_and_stop", "rebound", -0.5, spring, 5e-3),
    World("dynamics/parking", r"\s . place(2, s)", 0.75, switch),
    World("dynamics/balancing", "tilt", 0.8, pole),
    World("dynamics/room", "by_set", 20.0, room),
    World("probability/truncated", r"\a . mean(a, 2)", -1.0, truncated),
    World("probability/censored", r"\t . survival(t, 1.5, 0.4)", 2.0, survivors),
    World("probability/newsvendor", "best", 20.0, order, smooth=True),
    World("probability/options", r"\s . digital(market with spot = s, 105, 1)", 100.0, digital),
    World("probability/threshold", r"\t . cost(t, 5, 1)", 0.5, mistakes),
    World("probability/acceptance", r"\n . posterior_mean(1.5, n)", 0.5, accepted),
    World("fields/bands", "below", 1.0, states),
    World("fields/metaballs", r"\a . area(a, 1, 0.5)", 0.7, blobs),
    World("fields/plate", r"\w . gain([0.5, w, 0.5], 0.6)", 0.7, plate),
    World("fields/noise", "clouds", 0.1, clouds),
    World("fields/voronoi", r"\x . cell([(0.2, 0.5), (x, 0.5)], 0)", 0.6, half),
    World("fields/polygon", r"\x . area([(0.1, 0.1), (x, 0.5), (0.2, 0.9), (0.4, 0.45)])", 0.9, arrow),
)
