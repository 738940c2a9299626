"""Edges that lean by some doubles across a variable: their corners are different places of it, all within rounding.

A triangle with a corner at (u, v), one all but straight above it and one beside that, in a pixel through which the edge
between the first two runs: moved along x by its foot, the edge sweeps a triangle, so that the derivative is by hand.
"""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest
from polygons import Point, area, in_square

import potto

PROGRAM = """
def edge(a: (Real*, Real*), b: (Real*, Real*), x, y) (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x)
def inside(a: (Real*, Real*), b: (Real*, Real*), c: (Real*, Real*), x, y)
    [edge(a, b, x, y) >= 0 and edge(b, c, x, y) >= 0 and edge(c, a, x, y) >= 0]
def seen(ax, ay, bx, by, cx, cy)
    integral ([0.25, 0.5], [0.5, 1]) inside((ax, ay), (bx, by), (cx, cy), x, y) d(x, y)
def mesh(corners: [m] (Real, Real), faces: [n] (Real, Real, Real))
    integral ([0.25, 0.5], [0.5, 1]) sum i in 0..n - 1 (
        inside(corners[faces[i].0], corners[faces[i].1], corners[faces[i].2], x, y)) d(x, y)
"""
MODULE = potto.compile(PROGRAM)
U, LOW, HIGH = 0.37, 0.3, 0.83
# The edge at height y moves by (HIGH - y)/(HIGH - LOW) of what its foot does, and what is right of it is inside.
SLOPE = -((HIGH - 0.5) ** 2) / (2 * (HIGH - LOW))


@pytest.mark.parametrize("copies", [1, 12])
@pytest.mark.parametrize("doubles", [-40, -16, -3, -1, 0, 1, 2, 5, 16, 40, 300, 10_000])
def test_the_foot_of_an_edge_is_moved(doubles: int, copies: int) -> None:
    top = U + doubles * np.spacing(U)
    corners = [np.full(copies, x) for x in (U, LOW, 0.9, HIGH, top, HIGH)]
    directions = [np.full(copies, float(k == 0)) for k in range(6)]
    found = potto.deriv(MODULE.seen)(*zip(corners, directions, strict=True))
    assert np.all(found.converged)
    assert np.abs(np.asarray(found.tangent) - SLOPE).max() <= max(1e-14, np.max(found.tangent_error)) < 1e-10


@pytest.mark.parametrize("doubles", [-5, 1, 2, 16])
def test_leaning_in_both_ways(doubles: int) -> None:
    """The lower edge leans along the other variable as well: no order of the variables tells both."""
    corners = [U, HIGH, U - 2, HIGH + doubles * np.spacing(HIGH), U + doubles * np.spacing(U), LOW]
    by_x = potto.grad(MODULE.seen, ["ax"])(*corners)
    # Left of the edge: moved by its top, at height y by (y - LOW)/(HIGH - LOW).
    exact = ((HIGH - LOW) ** 2 - (0.5 - LOW) ** 2) / (2 * (HIGH - LOW))
    assert by_x.converged and abs(float(by_x.tangent) - exact) < 1e-13


def test_two_triangles_of_a_mesh_share_it() -> None:
    """Together they cover the same whatever the edge does: it was counted twice for one of them."""
    corners = np.array([[-0.02, LOW], [U, LOW], [U + 9 * np.spacing(U), HIGH], [0.9, HIGH]])
    direction = np.zeros_like(corners)
    direction[1, 0] = 1.0
    for faces in ([[0, 1, 2], [1, 3, 2]], [[1, 3, 2], [0, 1, 2]]):
        found = potto.deriv(MODULE.mesh)((corners, direction), np.array(faces, dtype=float))
        assert found.converged and abs(float(found.tangent)) < 1e-14


@pytest.mark.parametrize("rtol", [1e-9, 1e-14, 0.0])  # which ask for more and more nodes, between which nothing changes
def test_two_edges_that_cross_within_rounding(rtol: float) -> None:
    """x < -1/8 - (t + 1/4)/2 binds where y < 0, and the other edge where y > 0: a little to the left or to the right of
    t it is the one or the other all along, so that the derivative is -1 or 0 there, and -1/2 between."""
    edges = "[2*x < -0.5 - t]*[2*x + 1.1102230246251565e-16*y < -0.25]"
    with potto.settings(rtol=rtol):
        found = potto.deriv(potto.compile(f"def f(t) integral ([-1, 1], [-1, 1]) {edges} d(x, y)").f)((-0.25, 1.0))
    assert abs(found.tangent + 0.5) <= found.tangent_error


LEANING = """
def edge(a: (Real*, Real*), b: (Real*, Real*), x, y) (b.x - a.x)*(y - a.y) - (b.y - a.y)*(x - a.x)
def area(a: (Real, Real), b: (Real, Real), c: (Real, Real))
    integral ([207/512, 208/512], [304/512, 305/512])
        [edge(a, b, x, y) >= 0 and edge(b, c, x, y) >= 0 and edge(c, a, x, y) >= 0] d(x, y)
"""


def test_a_corner_of_two_edges_that_lean_along_either_axis() -> None:
    """They run along axes but for some doubles: what is beside the parameters is near by, not as far as no root of the
    outer variable moves."""
    a = (float.fromhex("0x1.6ed1c80cfc8bap-2"), float.fromhex("0x1.305f2dd0491a8p-1"))
    b = (float.fromhex("0x1.9f39efe4e1eaap-2"), float.fromhex("0x1.305f2dd049478p-1"))
    c = (float.fromhex("0x1.9f39efe4e248dp-2"), float.fromhex("0x1.489318f6bdce9p-1"))
    found = potto.grad(potto.compile(LEANING).area, ["b"])(a, b, c)
    (across, down), (off_across, off_down) = found.tangent, found.tangent_error
    exact = _slopes_of_area(a, b, c)
    assert abs(across - exact[0]) <= off_across < 1e-4 * across
    assert abs(down - exact[1]) <= off_down < -1e-3 * down


def _slopes_of_area(*corners: Point) -> list[float]:
    """How the area that a pixel sees of a triangle moves with the second corner: differences at 80 digits."""
    with mp.workdps(80):
        step, slopes = mp.mpf(10) ** -40, []
        for axis in (0, 1):
            seen = []
            for sign in (1, -1):
                moved = [[mp.mpf(x) for x in corner] for corner in corners]
                moved[1][axis] += sign * step
                polygon = [tuple(corner) for corner in moved]
                seen.append(area(in_square(polygon, mp.mpf(207) / 512, mp.mpf(304) / 512, mp.mpf(1) / 512)))
            slopes.append(float((seen[0] - seen[1]) / (2 * step)))
        return slopes
