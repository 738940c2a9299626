"""What a derivative costs that is 0, or that one order of the variables makes hard: counted in evaluations."""

from __future__ import annotations

import math
import statistics
from typing import Any

import pytest

import potto


def polygon(sides: int, exact: bool, order: str = "x, y") -> Any:
    """A product of half planes, some of whose edges are parallel to an axis, but for rounding: cos(pi/2) is 6e-17."""
    parts = []
    for k in range(sides):
        c, s = math.cos(2 * math.pi * k / sides), math.sin(2 * math.pi * k / sides)
        c, s = (0.0 if exact and abs(v) < 1e-15 else v for v in (c, s))
        parts.append(f"[({c!r})*(x - px) + ({s!r})*(y - py) < r]")
    return potto.compile(f"def f(px, py, r)\n    integral ([-1, 1], [-1, 1]) ({'*'.join(parts)}) d({order})\n").f


@pytest.mark.parametrize("d", range(3))
@pytest.mark.parametrize(("sides", "order"), [(8, "x, y")])
def test_edges_that_are_parallel_to_an_axis_but_for_rounding(sides: int, order: str, d: int) -> None:
    """Of a regular polygon of inner radius r: the area n tan(pi/n) r^2, which moving it leaves as it is."""
    at = [(v, float(i == d)) for i, v in enumerate((0.1, 0.05, 0.5))]
    found, plain = potto.deriv(polygon(sides, False, order))(*at), potto.deriv(polygon(sides, True, order))(*at)
    area = sides * math.tan(math.pi / sides)
    assert abs(found.value - area / 4) <= found.error + 1e-15
    assert abs(found.tangent - (area if d == 2 else 0.0)) <= found.tangent_error + 1e-14 <= 1e-11
    assert found.converged and found.evals <= 4 * plain.evals


PEAKS = [
    "exp(-((x - t)^2 + (y - t)^2)/1e-6)*[y < x]",
    "exp(-((x - t)^2 + (y - t)^2)/1e-6)*[x^2 + y^2 < 1]",
    "exp(-((x - t)^2 + (y - 0.5)^2)/1e-6)",
    "exp(-((x - t)^2 + (y - 2*t + 0.3)^2)/1e-6)",
    "exp(-(((x - t)/0.001)^2 + ((y - t)/0.002)^2))*[y < x + 0.1]",
]


@pytest.mark.parametrize("body", PEAKS)
def test_a_narrow_peak_that_moves_where_it_loses_nothing(body: str) -> None:
    """Its derivative is 0, of terms that are large: known for a zero, there is nothing more to be found out."""
    f = potto.compile(f"def f(t)\n    integral ([0, 1], [0, 1]) ({body}) d(x, y)\n").f
    found, plain = potto.deriv(f)((0.3, 1.0)), f(0.3)
    assert abs(found.tangent) <= found.tangent_error <= 1e-8 * 1e3 * plain.value  # 1e3: one over the peak's width
    assert found.evals <= 6 * plain.evals


TRIANGLE = (
    "[({1} - {0})*(y - {3}) - ({4} - {3})*(x - {0}) > 0]*[({2} - {1})*(y - {4}) - ({5} - {4})*(x - {1}) > 0]"
    "*[({0} - {2})*(y - {5}) - ({3} - {5})*(x - {2}) > 0]*{6}"
)
FOUR = [
    ("ax", "bx", "cx", "ay", "by", "cy", "s"),
    ("ax + 0.1", "bx + 0.2", "cx", "ay", "by", "cy + 0.1", "t"),
    ("ax", "bx", "cx + 0.1", "ay + 0.2", "by + 0.1", "cy", "s*t"),
    ("ax + 0.15", "bx", "cx", "ay + 0.05", "by", "cy + 0.05", "s"),
]
AT = {"ax": 0.12, "ay": 0.21, "bx": 0.73, "by": 0.17, "cx": 0.41, "cy": 0.69, "s": 1.0, "t": 2.0}
CALLED = [
    ("def tri(x, y, a, b, c, d, e, f, s)\n    " + TRIANGLE.format(*"abcdef", "s"), "tri(x, y, {})"),
    ("def one(x, y, a, b, c, d, e, f)\n    " + TRIANGLE.format(*"abcdef", "1") + "\ndef tri(x, y, a, b, c, d, e, f, s)"
     " s*one(x, y, a, b, c, d, e, f)", "tri(x, y, {})"),
    ("tri = \\x . \\y . \\a . \\b . \\c . \\d . \\e . \\f . \\s . " + TRIANGLE.format(*"abcdef", "s"), "tri x y {}"),
]  # fmt: skip


@pytest.mark.parametrize(("definition", "call"), CALLED, ids=["called", "called by a call", "curried"])
def test_triangles_through_a_function_cost_like_triangles_written_out(definition: str, call: str) -> None:
    written = " + ".join(TRIANGLE.format(*(f"({v})" for v in each)) for each in FOUR)
    between = " " if call.startswith("tri x") else ", "
    calls = " + ".join(call.format(between.join(f"({v})" for v in each)) for each in FOUR)
    names = ", ".join(AT)
    made = potto.compile(
        f"{definition}\ndef f({names})\n    integral ([0, 1], [0, 1]) ({calls}) d(x, y)\n"
        f"def g({names})\n    integral ([0, 1], [0, 1]) ({written}) d(x, y)\n"
    )
    through, out = (potto.grad(f, wrt=list(AT))(**AT) for f in (made.f, made.g))
    assert through.converged and out.converged
    assert abs(through.value - out.value) <= through.error + out.error + 1e-15
    for a, b, e, o in zip(through.tangent, out.tangent, through.tangent_error, out.tangent_error, strict=True):
        assert abs(a - b) <= e + o + 1e-14
    assert through.evals <= 10 * out.evals


CAMERA = """
def lambert(x, y, z, nx, ny, nz, lx, ly, lz, th)
    dx = lx - x
    dy = ly - y
    dz = lz - z
    (if [nx*dx + ny*dy + nz*dz > th*sqrt(nx^2 + ny^2 + nz^2)*sqrt(dx^2 + dy^2 + dz^2)] then 1 else 0.3)
def edge(ax, ay, az, bx, by, bz, x, y)
    [(ay*bz - az*by)*x + (az*bx - ax*bz)*y + ax*by - ay*bx > 0]
def shade(shader, nx, ny, nz, x, y, d, lx, th)
    c = d/(nx*x + ny*y + nz)
    shader(c*x, c*y, c, nx, ny, nz, lx, 0.4, 0.8, th)
def pixel(shader, u, v, w, s, lx, th)
    ax = -1
    ay = -0.9
    az = 2.5
    bx = 1.1
    by = -0.6
    bz = 3 + s
    cx = 0.1
    cy = 1.2
    cz = 3.5
    nx = (by - ay)*(cz - az) - (bz - az)*(cy - ay)
    ny = (bz - az)*(cx - ax) - (bx - ax)*(cz - az)
    nz = (bx - ax)*(cy - ay) - (by - ay)*(cx - ax)
    integral ([u - w, u + w], [v - w, v + w])
        (edge(ax, ay, az, bx, by, bz, x, y)*edge(bx, by, bz, cx, cy, cz, x, y)*edge(cx, cy, cz, ax, ay, az, x, y)
        *shade(shader, -nx, -ny, -nz, x, y, -(nx*ax + ny*ay + nz*az), lx, th)) d(x, y)
"""


def test_no_pixel_of_a_triangle_in_space_costs_far_more_than_the_others() -> None:
    """A pinhole camera, a point light, a shader with a threshold: in one pixel the shader's circle turns."""
    m = potto.compile(CAMERA)
    shader, pixel = potto.deriv(m.lambert), potto.deriv(m.pixel)
    w, costs = 0.125, []
    for i in range(4):
        for j in range(4):
            at = [(-0.5 + (2 * i + 1) * w, 0.0), (-0.5 + (2 * j + 1) * w, 0.0), (w, 0.0), (0.1, 1.0), (0.0, 0.0)]
            found = pixel(shader, *at, (0.85, 0.0))
            assert found.converged
            costs.append(found.evals)
            if (i, j) == (3, 1):  # against differences of values, to 1e-8
                values = [m.pixel(m.lambert, *(v for v, _ in at[:3]), 0.1 + h, 0.0, 0.85).value for h in (1e-3, -1e-3)]
                more = [m.pixel(m.lambert, *(v for v, _ in at[:3]), 0.1 + h, 0.0, 0.85).value for h in (2e-3, -2e-3)]
                slope = (8 * (values[0] - values[1]) - (more[0] - more[1])) / 12e-3
                assert abs(found.tangent - slope) <= found.tangent_error + 1e-7
    assert max(costs) <= 20 * statistics.median(costs)
