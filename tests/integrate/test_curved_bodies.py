"""Second and mixed derivatives of areas and volumes, by Hessian-vector products. Closed forms.

Every error must cover; how large it may be says the row. In three variables the boundary term's own boundary is where
its integrand is infinite, so that few digits are left.
"""

from __future__ import annotations

from typing import Any

import mpmath as mp
import pytest

import potto

PI = mp.pi
PLANE, SPACE = "integral ([-2, 2], [-2, 2]) {} d(x, y)", "integral ([-2, 2], [-2, 2], [-2, 2]) {} d(x, y, z)"
ELLIPSOID = SPACE.format("[(x/a)^2 + (y/b)^2 + (z/c)^2 < 1]")
AXES = {"a": 1.1, "b": 0.7, "c": 0.9}


def lens(d: Any) -> Any:
    return 2 * mp.acos(d / 2) - d / 2 * mp.sqrt(4 - d * d)


def segment(c: Any) -> Any:
    return mp.acos(c) - c * mp.sqrt(1 - c * c)


# name, integral, parameters, the two that it is differentiated by, the answer, how large the error may be
BODIES: list[tuple[str, str, dict[str, float], str, str, Any, float]] = [
    ("ball", SPACE.format("[x^2 + y^2 + z^2 < r^2]"), {"r": 1.1}, "r", "r", 8 * PI * 1.1, 1e-2),
    ("disc", PLANE.format("[x^2 + y^2 < r^2]"), {"r": 1.1}, "r", "r", 2 * PI, 1e-9),
    ("disc by its square", PLANE.format("[x^2 + y^2 < r]"), {"r": 1.1}, "r", "r", 0, 1e-6),
    ("ellipse", PLANE.format("[(x/a)^2 + (y/b)^2 < 1]"), {"a": 1.1, "b": 0.7}, "a", "b", PI, 1e-9),
    ("ellipsoid, two axes", ELLIPSOID, AXES, "a", "b", 4 * PI / 3 * mp.mpf(0.9), 1e-5),
    ("ellipsoid, one axis", ELLIPSOID, AXES, "a", "a", 0, 1e-3),
    ("corner of a box", PLANE.format("[x < a]*[y < b]"), {"a": 0.3, "b": 0.7}, "a", "b", 1, 1e-12),
    ("corner along the diagonal", PLANE.format("[x < a]*[y < a]"), {"a": 0.3}, "a", "a", 2, 1e-12),
    ("lens", PLANE.format("[(x - d/2)^2 + y^2 < 1]*[(x + d/2)^2 + y^2 < 1]"), {"d": 0.8}, "d", "d",
     mp.diff(lens, 0.8, 2), 1e-6),
    ("disc cut off", PLANE.format("[x^2 + y^2 < 1]*[x > c]"), {"c": 0.3}, "c", "c", mp.diff(segment, 0.3, 2), 1e-10),
    ("ring, one radius", PLANE.format("[a^2 < x^2 + y^2]*[x^2 + y^2 < b^2]"), {"a": 0.6, "b": 1.2}, "a", "a",
     -2 * PI, 1e-9),
    ("ring, both radii", PLANE.format("[a^2 < x^2 + y^2]*[x^2 + y^2 < b^2]"), {"a": 0.6, "b": 1.2}, "a", "b", 0, 1e-9),
    ("weight on a moved disc", PLANE.format("[(x - c)^2 + y^2 < r^2]*x"), {"c": 0.2, "r": 1.1}, "c", "r",
     2 * PI * 1.1, 1e-4),
    ("cone", SPACE.format("[sqrt(x^2 + y^2) < z*t]*[z < 1]*[z > 0]"), {"t": 0.8}, "t", "t", 2 * PI / 3, 1e-8),
    ("simplex", "integral ([0, 1], [0, 1], [0, 1]) [x + y + z < t] d(x, y, z)", {"t": 0.7}, "t", "t", 0.7, 1e-10),
    ("half-plane", "integral ([0, 1], [0, 1]) [a*x + b*y < 1] d(x, y)", {"a": 2.0, "b": 3.0}, "a", "b", 1 / 72, 1e-10),
]  # fmt: skip


@pytest.mark.parametrize(("name", "text", "at", "one", "two", "exact", "most"), BODIES, ids=[row[0] for row in BODIES])
def test_second_derivatives_of_bodies_are_covered(
    name: str, text: str, at: dict[str, float], one: str, two: str, exact: Any, most: float
) -> None:
    f = potto.compile(f"def f({', '.join(at)}) {text}").f
    found = potto.hvp(f, {two: 1.0} if one == two else {two: 1.0, one: 0.0})(**at)
    tangent, error = found.tangent, found.tangent_error
    if isinstance(tangent, tuple):
        index = list(found.wrt).index(one)
        tangent, error = tangent[index], error[index]
    assert abs(tangent - exact) <= error <= most
