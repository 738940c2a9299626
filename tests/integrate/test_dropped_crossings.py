"""Regions of more curves than whose crossings are worked out: the errors say what that misses."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest

import potto
from potto.calculus.decomposition import projection

Ellipse = tuple[float, float, float, float]


def ellipses(n: int, seed: int) -> list[Ellipse]:
    """(x - a)^2/c + (y - b)^2/d < t of `n`, which share a neighbourhood of 0."""
    pick, angles = random.Random(seed), [2 * math.pi * i / n for i in range(n)]
    return [
        (round(0.35 * math.cos(a), 6), round(0.35 * math.sin(a), 6),
         round(1 + 0.3 * pick.random(), 6), round(0.8 + 0.3 * pick.random(), 6))
        for a in angles
    ]  # fmt: skip


def reaches(shapes: list[Ellipse], t: float, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far each ellipse reaches from 0 in each direction, and how fast that grows with t."""
    a, b, c, d = np.array(shapes).T[:, :, None]
    x, y = np.cos(angle), np.sin(angle)
    square, half, rest = x**2 / c + y**2 / d, -(x * a / c + y * b / d), a**2 / c + b**2 / d - t
    root = np.sqrt(half**2 - square * rest)
    return (root - half) / square, 0.5 / root


def area(shapes: list[Ellipse], t: float) -> tuple[float, float]:
    """The area that ellipses share, and its slope, in polar coordinates between the angles at which the nearest of them
    changes: bisected to all digits, by 30 nodes on quarters of each stretch."""
    angles = np.linspace(0, 2 * np.pi, 40_001)
    nearest = reaches(shapes, t, angles)[0].argmin(axis=0)
    turns = [0.0]
    for i in np.nonzero(np.diff(nearest))[0]:
        low, high = angles[i], angles[i + 1]
        for _ in range(60):
            middle = (low + high) / 2
            far = reaches(shapes, t, np.array([middle]))[0][:, 0]
            low, high = (middle, high) if far[nearest[i]] < far[nearest[i + 1]] else (low, middle)
        turns.append(low)
    ends = np.concatenate([np.linspace(p, q, 5)[:-1] for p, q in zip(turns, [*turns[1:], 2 * np.pi], strict=True)])
    nodes, weights = np.polynomial.legendre.leggauss(30)
    width = np.diff([*ends, 2 * np.pi])[:, None] / 2
    angle = (ends[:, None] + width * (1 + nodes)).ravel()
    reach, speed = reaches(shapes, t, angle)
    own = reach.argmin(axis=0), np.arange(angle.size)
    weight = (width * weights).ravel()
    return float(weight @ reach[own] ** 2) / 2, float(weight @ (reach[own] * speed[own]))


@pytest.mark.parametrize(("n", "seed"), [(6, 1), (6, 2), (10, 1)])
def test_jumps_beside_the_ends_of_pieces_count(n: int, seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The slope of what is further in jumps at a corner that is no cut. Beyond the last node of a piece none sees it:
    slopes were off by up to 6,500 of their errors. Written with exp, so that ellipses are not known to be conics, of
    which all corners are found. 1e-14: what the reference is rounded by."""
    monkeypatch.setattr(projection, "MOST_JUMPS", 3)
    shapes = ellipses(n, seed)
    inside = " and ".join(f"exp((x - ({a}))^2/{c} + (y - ({b}))^2/{d}) < exp(t)" for a, b, c, d in shapes)
    answer = potto.deriv(potto.compile(f"def f(t) integral ([-3, 3], [-3, 3]) [{inside}] d(x, y)").f)((0.9, 1.0))
    value, slope = area(shapes, 0.9)
    assert abs(answer.value - value) <= answer.error + 1e-14 and answer.error < 1e-6
    assert abs(answer.tangent - slope) <= answer.tangent_error + 1e-14 and answer.tangent_error < 1e-4
