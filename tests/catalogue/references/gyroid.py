"""The gyroid, sin x cos y + sin y cos z + sin z cos x < t, over a slab and over a cube."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import mpmath as mp
import numpy as np
from scipy.optimize import brentq

from references.tools import Value

mpf = mp.mpf


def slab(t: Any) -> Any:
    """Over a period in x and y, and 0 < z < 1: an arc in y over x and z.

    Over x it fills the period or vanishes where cos x passes the roots of (sz^2 + 1) c^2 - 2 t sz c + t^2 - 1 - cz^2.
    """

    def over(x: Any, s: Any, c: Any) -> Any:
        share = (t - s * mp.cos(x)) / mp.sqrt(mp.sin(x) ** 2 + c * c)
        return 2 * mp.pi - 2 * mp.acos(min(max(share, mpf(-1)), mpf(1)))

    def slice_at(z: Any) -> Any:
        s, c = mp.sin(z), mp.cos(z)
        root = mp.sqrt((1 + s * s) * (1 + c * c) - t * t)
        ends = [(t * s + sign * root) / (1 + s * s) for sign in (-1, 1)]
        cuts = sorted({mpf(0), mp.pi, *(mp.acos(e) for e in ends if abs(e) < 1)})
        return 2 * mp.fsum(mp.quad(lambda x: over(x, s, c), [a, b]) for a, b in itertools.pairwise(cuts))

    # at x = 0 the arc fills or vanishes where t = +-sin z +-cos z
    meets = mp.acos(t / mp.sqrt(2)) - mp.pi / 4
    return mp.quad(slice_at, [0, meets, 1]) if 0 < meets < 1 else mp.quad(slice_at, [0, 1])


# The unit cube, in doubles: Gauss rules in p where a variable is a + (b - a) sin(p)^2, which makes smooth what is like
# a root at the ends of its pieces

NODES, SHARES = np.polynomial.legendre.leggauss(40)
ANGLES = np.pi / 4 * (NODES + 1)
GRID = np.linspace(0, 1, 2001)  # of y, for signs
COLUMNS = np.linspace(0, 1, 101)  # of x, for changes of what cuts y


def smooth(f: Callable[[Any], Any], a: float, b: float) -> float:
    weights = np.pi / 4 * SHARES * np.sin(2 * ANGLES)
    return float((b - a) * (weights * f(a + (b - a) * np.sin(ANGLES) ** 2)).sum())


def height(x: float, y: Any, t: float) -> Any:
    """How much of 0 < z < 1 counts: all but an arc, as the condition is a sin z + b cos z < rest."""
    a, b, rest = np.cos(x), np.sin(y), t - np.sin(x) * np.cos(y)
    middle, half = np.arctan2(a, b), np.arccos(np.clip(rest / np.hypot(a, b), -1, 1))
    return 1 - (np.clip(middle + half, 0, 1) - np.clip(middle - half, 0, 1))


def kinks(x: float, t: float) -> list[tuple[float, int]]:
    """The y where the surface passes z = 0 or z = 1 or folds, each with its kind."""
    curves: tuple[Callable[[Any], Any], ...] = (
        lambda y: np.sin(x) * np.cos(y) + np.sin(y) - t,
        lambda y: np.sin(x) * np.cos(y) + np.sin(y) * np.cos(1) + np.sin(1) * np.cos(x) - t,
        lambda y: np.cos(x) ** 2 + np.sin(y) ** 2 - (t - np.sin(x) * np.cos(y)) ** 2,
    )
    found = []
    for kind, f in enumerate(curves):
        signs = f(GRID)
        for i in np.nonzero(signs[:-1] * signs[1:] < 0)[0]:
            found.append((brentq(f, GRID[i], GRID[i + 1], xtol=1e-16, rtol=1e-15), kind))
    return sorted(found)


def cube(t: Any) -> Any:
    """In [0, 1]^3, to some thirteen digits."""
    at = float(t)

    def order(x: float) -> list[int]:
        return [kind for _, kind in kinks(x, at)]

    def column(x: float) -> float:
        cuts = [0.0, *(y for y, _ in kinks(x, at)), 1.0]
        return sum(smooth(lambda y: height(x, y, at), a, b) for a, b in itertools.pairwise(cuts))

    cuts = [0.0]
    for a, b in itertools.pairwise(COLUMNS):
        while (before := order(a)) != order(b):
            high = b
            while high - a > 1e-15:
                middle = (a + high) / 2
                a, high = (middle, high) if order(middle) == before else (a, middle)
            cuts.append(a := high)
    ends = itertools.pairwise([*cuts, 1.0])
    return mpf(sum(smooth(np.vectorize(column), a, b) for a, b in ends))


VALUES: dict[str, tuple[Value, float]] = {"gyroid slab": (slab, 2e-3), "gyroid corner": (cube, 2e-3)}
