"""What rounding may put cells off is proved, and little more than it does: nodes and ends, then triangles in pixels.

Everything is held to fractions, which round nothing: areas by clipping, and how they change with a corner what
runs of the edges through the pixel (Reynolds' transport theorem).
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from polygons import area, in_square

import potto
from potto.integrate.fixed.axes import axis
from potto.integrate.fixed.cells.nodes import misplaced
from potto.integrate.rules.gauss import gauss
from potto.kernels.whole import UNIT_ROUNDOFF
from potto.runtime.integration.methods import quadrature, second_looks

CORNERS = ("ax", "ay", "bx", "by", "cx", "cy")
TRIANGLE = """
def edge(x, y, ax, ay, bx, by) (bx - ax)*(y - ay) - (by - ay)*(x - ax)
def covered(px, py, h, ax, ay, bx, by, cx, cy)
    integral ([px, px + h], [py, py + h])
        [edge(x, y, ax, ay, bx, by) > 0 and edge(x, y, bx, by, cx, cy) > 0 and edge(x, y, cx, cy, ax, ay) > 0] d(x, y)
"""
# Triangles, each with the place of a pixel. One has two corners that are nearly above each other, so that rounding
# spoils it where y is innermost, and where x is not. Hardly anything of the other is in its pixel: any rule leaves it
# less than ten digits.
TILTED = (0.6293221847692823, 0.2170062361721442, 0.8068215346721236, 0.9078762823810895, 0.6294057399708306,
          0.9042250146527319, 0.30564898297442245, 0.4321400004429484)  # fmt: skip
SLIVER = (0.00805007769535504, 0.8777839143014101, 0.01120730424315941, 0.8744956559710554, 0.7141980548887955,
          0.5806838970830245, 0.42559747047911933, 0.08106322220297624)  # fmt: skip


def exact(corners: np.ndarray, px: float, py: float, h: float) -> list[Fraction]:
    """The area of a triangle in a pixel, and its derivatives by the corners."""
    p, low, side = [Fraction(float(z)) for z in corners], (Fraction(float(px)), Fraction(float(py))), Fraction(h)
    within = in_square([(p[0], p[1]), (p[2], p[3]), (p[4], p[5])], *low, side)
    rates = [Fraction(0)] * 6
    for i, j in ((0, 2), (2, 4), (4, 0)):
        run = p[j] - p[i], p[j + 1] - p[i + 1]
        first, last = Fraction(0), Fraction(1)  # of the edge, as parts of it
        for start, length, least in zip((p[i], p[i + 1]), run, low, strict=True):
            ends = sorted(((least - start) / length, (least + side - start) / length))
            first, last = max(first, ends[0]), min(last, ends[1])
        if last > first:
            by_end = (last * last - first * first) / 2
            by_start = last - first - by_end
            for corner, share in ((i, by_start), (j, by_end)):
                rates[corner] += run[1] * share
                rates[corner + 1] -= run[0] * share
    return [area(within), *rates]


def turned_left(corners: np.ndarray) -> np.ndarray:
    """The corners, those to the right with two of them changed."""
    ax, ay, bx, by, cx, cy = corners
    right = (bx - ax) * (cy - ay) < (cx - ax) * (by - ay)
    return np.where(right, corners[[0, 1, 4, 5, 2, 3]], corners)


def held(answer: Any, corners: np.ndarray, px: np.ndarray, py: np.ndarray, h: float) -> np.ndarray:
    """Errors as parts of what they are of, (7, members): each number is held to them."""
    numbers, errors = np.stack((answer.value, *answer.tangent)), np.stack((answer.error, *answer.tangent_error))
    parts = np.full(numbers.shape, np.nan)
    for i in range(px.size):
        for c, truth in enumerate(exact(corners[:, i], px[i], py[i], h)):
            assert abs(Fraction(float(numbers[c, i])) - truth) <= errors[c, i], (i, c)
            if truth:
                parts[c, i] = errors[c, i] / abs(float(truth))
    return parts


def counted_cuts(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many members are integrated along cuts, each time that some are."""
    cut, iterated = list[int](), quadrature.iterated

    def counted(plan: Any, machine: Any, env: Any, batch: int, *others: Any) -> Any:
        cut.append(batch)
        return iterated(plan, machine, env, batch, *others)

    monkeypatch.setattr(quadrature, "iterated", counted)
    return cut


@pytest.mark.parametrize("order", [1, 2, 3, 5, 8, 14, 28])
def test_nodes_are_where_rules_have_them(order: int) -> None:
    """To two half places of 1: the roots of Legendre polynomials, which some ends have crowd."""
    with mp.workdps(30):
        roots = [mp.findroot(lambda x: mp.legendre(order, 2 * x - 1), float(u)) for u in gauss(order).nodes]
        for turning, crowded in {
            (False, False): lambda s: s,
            (True, False): lambda s: s * s,
            (False, True): lambda s: s * (2 - s),
            (True, True): lambda s: mp.sin(mp.pi * s / 2) ** 2,
        }.items():
            nodes = axis(order, (0,), turning, False).nodes
            off = [abs(mp.mpf(float(t)) - crowded(s)) for t, s in zip(nodes, roots, strict=True)]
            assert max(off) <= 2 * UNIT_ROUNDOFF


@pytest.mark.parametrize("scale", [1e-8, 1.0, 1e8])
@pytest.mark.parametrize("length", [1e-12, 1e-3, 1.0, 1e3])
def test_nodes_and_ends_are_off_by_no_more_than_rounding(scale: float, length: float) -> None:
    """Nodes of what begins at the lower end and is as long as was worked out, also when t is off by two half places of
    1; to first order, so that a millionth of it is added."""
    random = np.random.default_rng(3)
    low = scale * random.uniform(-1, 1, 2000)
    ends = np.stack((low, low + length * scale * random.uniform(0, 1, 2000)))
    width, t, wrong = ends[1] - ends[0], random.random(2000), random.choice([-2, -1, 0, 1, 2], 2000) * UNIT_ROUNDOFF
    nodes, (own, off) = ends[0] + width * t, misplaced(ends, width)
    for lo, hi, w, s, out, node, most, (at_low, at_high) in zip(
        *ends, width, t, wrong, nodes, own, off.T, strict=True
    ):  # fmt: skip
        lo, hi, w, s, out, node = (Fraction(float(z)) for z in (lo, hi, w, s, out, node))
        assert at_low == 0 and abs(lo + w - hi) <= at_high
        assert abs(lo + w * (s - out) - node) <= most * (1 + 1e-6)


@pytest.mark.parametrize("backend", ["numpy", "native"])
@pytest.mark.parametrize(("scale", "shift"), [(1.0, 0.0), (1e-8, 0.0), (1e8, 0.0), (1.0, 1e3)])
def test_triangles_in_a_pixel_of_any_size(
    scale: float, shift: float, backend: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Some are 1e-4 thin. As four digits are asked for, the rule does all but one, of which a derivative cancels."""
    if backend == "native":
        pytest.importorskip("llvmlite")
    random = np.random.default_rng(7)
    corners, (px, py) = random.random((6, 400)), 0.5 * random.random((2, 400))
    along, thin = random.uniform(0, 1.2, 200), 10.0 ** random.uniform(-4, -1, 200)
    for axis_of in (0, 1):
        start, run = corners[axis_of, :200], corners[2 + axis_of, :200] - corners[axis_of, :200]
        corners[4 + axis_of, :200] = start + along * run + thin * random.normal(size=200)
    corners, px, py, h = turned_left(corners * scale + shift), px * scale + shift, py * scale + shift, 0.5 * scale
    cut = counted_cuts(monkeypatch)
    with potto.settings(backend=backend, rtol=1e-4):
        answer = potto.grad(potto.compile(TRIANGLE).covered, CORNERS)(px, py, h, *corners)
    assert sum(cut) <= 1
    held(answer, corners, px, py, h)


@pytest.mark.parametrize("backend", ["numpy", "native"])
@pytest.mark.parametrize("scale", [1e-8, 1.0, 1e8])
def test_a_line_across_a_square_of_any_size(scale: float, backend: Any) -> None:
    """Also where it is 1e-8 of the square away from a corner. Of a function of x + y twice its antiderivative K, which
    is 0 on the dark side of the line: K(2 + c) - 2 K(1 + c) + K(c), at 50 digits."""
    if backend == "native":
        pytest.importorskip("llvmlite")
    near = [corner + side * off for corner in (-2, -1, 0) for off in (1e-8, 1e-5, 1e-3) for side in (-1, 1)]
    c = np.array([*near, *np.random.default_rng(4).uniform(-1.99, -0.01, 1000)]) * scale
    with mp.workdps(50):
        long, root = mp.mpf(scale), mp.sqrt(2)

        def folded(z: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
            """K(z) and its slope."""
            z = max(z, mp.mpf(0))
            slope = 1 / mp.sqrt(8) - 1 / (root * (root * z / long + 2))
            return long * long * (z / long / mp.sqrt(8) - mp.log(root * z / long / 2 + 1) / 2), long * slope

        parts = [[folded(mp.mpf(float(x)) + k * long) for k in (2, 1, 0)] for x in c]
        exact = [[a[i] - 2 * b[i] + d[i] for i in (0, 1)] for a, b, d in parts]
        shader, square = f"1/(sqrt(2)*(x + y + c)/{scale!r} + 2)^2", f"([0, {scale!r}], [0, {scale!r}])"
        text = f"def f(c) integral {square} {shader}*[x + y + c >= 0] d(x, y)"
        with potto.settings(backend=backend):
            answer = potto.grad(potto.compile(text).f, "c")(c)
        for i, (value, slope) in enumerate(exact):
            assert abs(mp.mpf(float(answer.value[i])) - value) <= answer.error[i]
            assert abs(mp.mpf(float(answer.tangent[i])) - slope) <= answer.tangent_error[i]
    lit = answer.value > 1e-3 * scale * scale
    assert (answer.error[lit] <= 1e-12 * answer.value[lit]).all()


def test_errors_of_small_pixels_are_those_of_their_cuts() -> None:
    """Pixels of a picture are short for how far from 0 they are. A half place of a double there, once for each end, is
    6e-14 of the length of one; nodes and ends that are said to be off by two more for each, whatever they are, have
    four times the errors, in the middle of all."""
    random = np.random.default_rng(8)
    px, py = np.floor(512 * random.random((2, 600))) / 512
    corners = random.uniform(-0.01, 0.01, (6, 600)) + np.stack((px, py) * 3)
    corners = turned_left(corners)
    answer = potto.grad(potto.compile(TRIANGLE).covered, CORNERS)(px, py, 1 / 512, *corners)
    parts = held(answer, corners, px, py, 1 / 512)
    assert np.nanmedian(parts[0]) <= 3e-13 and np.nanmedian(parts[1:]) <= 6e-13


def test_one_member_that_rounding_spoils_is_looked_at_along_another_variable(monkeypatch: pytest.MonkeyPatch) -> None:
    """Which takes a fifth of what it takes along cuts, for that one alone."""
    cut = counted_cuts(monkeypatch)
    random = np.random.default_rng(9)
    corners = np.concatenate((np.array([TILTED[:6]]).T, turned_left(random.random((6, 100)))), axis=1)
    px, py = np.concatenate((np.array([TILTED[6:]]).T, 0.5 * random.random((2, 100))), axis=1)
    answer = potto.grad(potto.compile(TRIANGLE).covered, CORNERS)(px, py, 0.5, *corners)
    assert cut == [] and answer.converged
    held(answer, corners, px, py, 0.5)


def test_a_sliver_among_thousands_is_left_as_rules_have_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Along cuts it takes as long as all others together. Its bar holds, and it is told that it is not what was asked
    for."""
    cut = counted_cuts(monkeypatch)
    random = np.random.default_rng(7)
    corners = np.concatenate((np.array([SLIVER[:6]]).T, turned_left(random.random((6, 2000)))), axis=1)
    px, py = np.concatenate((np.array([SLIVER[6:]]).T, 0.5 * random.random((2, 2000))), axis=1)
    answer = potto.grad(potto.compile(TRIANGLE).covered, CORNERS)(px, py, 0.5, *corners)
    assert cut == [] and not answer.member_converged[0] and answer.member_converged[1:].mean() > 0.999
    held(answer, corners[:, :50], px[:50], py[:50], 0.5)


def test_nobody_asks_for_more_than_a_polynomial_between_planes_has(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rules are exact for it: a second time with 32 times the accuracy asked for took as long as the first one, and
    told the same."""
    asked, attempted = list[float](), second_looks.attempted

    def noted(problem: Any, *others: Any) -> Any:
        asked.append(problem.machine.rtol)
        return attempted(problem, *others)

    monkeypatch.setattr(second_looks, "attempted", noted)
    f = potto.grad(potto.compile(TRIANGLE).covered, CORNERS)
    *corners, px, py = SLIVER
    answer = f(px, py, 0.5, *corners)
    assert not answer.converged and "rounding limits the accuracy" in answer.reasons
    assert asked == []
