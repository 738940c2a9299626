"""Areas of what discs and half planes make by `and`, `or` and `not`, along the arcs and segments around it.

By Green's theorem, in closed form: an edge counts where what is asked of a point changes across it.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

import mpmath as mp

Disc = tuple[float, float]  # middles; all have one radius
Line = tuple[float, float, float]  # a*x + b*y < c
Inside = Callable[[Sequence[bool]], bool]


def area(discs: Sequence[Disc], lines: Sequence[Line], r: mp.mpf, inside: Inside) -> tuple[mp.mpf, mp.mpf]:
    """The area of what is inside, and its derivative by the radius. inside: of the discs, then of the half planes."""
    whole = slope = mp.mpf(0)
    for own, (a, b) in enumerate(discs):
        ends = sorted(_angles(a, b, r, [d for k, d in enumerate(discs) if k != own], lines))
        for lo, hi in itertools.pairwise([*ends, ends[0] + 2 * mp.pi] if ends else [mp.mpf(0), 2 * mp.pi]):
            middle = (lo + hi) / 2
            sign = _changes(a + r * mp.cos(middle), b + r * mp.sin(middle), own, discs, lines, r, inside)
            sines, cosines = mp.sin(hi) - mp.sin(lo), mp.cos(hi) - mp.cos(lo)
            whole += sign * (r * r * (hi - lo) + r * (a * sines - b * cosines)) / 2
            slope += sign * r * (hi - lo)
    for own, (a, b, c) in enumerate(lines):
        size = mp.hypot(a, b)
        x, y = a * c / size**2, b * c / size**2
        ends = sorted(_places(x, y, -b / size, a / size, discs, [of for k, of in enumerate(lines) if k != own], r))
        for lo, hi in itertools.pairwise(ends):
            at = (lo + hi) / 2
            sign = _changes(x - b / size * at, y + a / size * at, len(discs) + own, discs, lines, r, inside)
            whole += sign * (hi - lo) * c / size / 2
    return whole, slope


def _angles(a: float, b: float, r: mp.mpf, discs: Sequence[Disc], lines: Sequence[Line]) -> list[mp.mpf]:
    """Where a circle crosses others and lines."""
    cuts = [(mp.mpf(p) - a, mp.mpf(q) - b) for p, q in discs]
    found = [(p, q, mp.hypot(p, q) / 2) for p, q in cuts if p or q]
    found += [(mp.mpf(p), mp.mpf(q), (c - p * mp.mpf(a) - q * mp.mpf(b)) / mp.hypot(p, q)) for p, q, c in lines]
    pairs = ((mp.atan2(q, p), mp.acos(gap / r)) for p, q, gap in found if abs(gap) < r)
    return [mp.fmod(way + half + 4 * mp.pi, 2 * mp.pi) for way, wide in pairs for half in (wide, -wide)]


def _places(
    x: mp.mpf, y: mp.mpf, u: mp.mpf, v: mp.mpf, discs: Sequence[Disc], lines: Sequence[Line], r: mp.mpf
) -> list[mp.mpf]:
    """Where a line through x, y along u, v crosses others and circles."""
    found = [(c - p * x - q * y) / (p * u + q * v) for p, q, c in lines if p * u + q * v]
    for p, q in discs:
        along, gap = (p - x) * u + (q - y) * v, (p - x) * v - (q - y) * u
        if abs(gap) < r:
            found += [along + mp.sqrt(r * r - gap * gap), along - mp.sqrt(r * r - gap * gap)]
    return found


def _changes(
    x: mp.mpf, y: mp.mpf, own: int, discs: Sequence[Disc], lines: Sequence[Line], r: mp.mpf, inside: Inside
) -> int:
    """1 where a point gets inside as it gets into its own disc or half plane, -1 where it gets outside."""
    held = [(x - a) ** 2 + (y - b) ** 2 < r * r for a, b in discs] + [a * x + b * y < c for a, b, c in lines]
    held[own] = True
    within = inside(held)
    held[own] = False
    return within - inside(held)
