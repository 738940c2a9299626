"""Members of an array that are cut alike are integrated by one rule: values, derivatives, bars, and what it costs.

Answers are closed forms, and mpmath's where there is none; members that are not plain (a line through a corner, a
circle that touches the bounds) get what they get by themselves.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import mpmath as mp
import numpy as np
import pytest

import potto
from potto.integrate.fixed.cells import proved_shapes
from potto.integrate.fixed.cells.product_rule import ProductRule
from potto.integrate.fixed.lowered.cells import LoweredCells, places_of
from potto.kernels.cells import Cell
from potto.runtime.integration.methods import quadrature

PLAIN = np.linspace(-0.99, -0.01, 200)


def answered(text: str, at: Any, **others: Any) -> Any:
    return potto.deriv(potto.compile(text).f)((at, 1.0), **others)


def covered(answer: Any, value: Any, slope: Any, rtol: float = 1e-11) -> None:
    """Each member within its own bars, and these within `rtol`: roundings of a few hundred nodes are 1e-13."""
    assert answer.converged
    for number, error, exact in (
        (answer.value, answer.error, value), (answer.tangent, answer.tangent_error, slope)
    ):  # fmt: skip
        assert (np.abs(number - exact) <= error).all()
        assert (error <= rtol * np.maximum(np.abs(exact), 1e-2)).all()


def rules(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Of each rule that is applied, by numpy or by machine code, to how many cells."""
    cells, applied, add = list[int](), ProductRule.applied, LoweredCells.add

    def counted(self: ProductRule, env: Any, index: Any) -> Any:
        cells.append(index.size)
        return applied(self, env, index)

    def added(self: LoweredCells, function: Any, env: Any, members: Any, *others: Any) -> Any:
        if others[-1] is not False:  # not a look at what would be added
            cells.append(members.size)
        return add(self, function, env, members, *others)

    monkeypatch.setattr(ProductRule, "applied", counted)
    monkeypatch.setattr(LoweredCells, "add", added)
    return cells


def test_the_line_of_equation_1() -> None:
    shade = "1/(sqrt(2)*(x + y + c) + 2)^2"
    answer = answered(f"def f(c) integral ([0, 1], [0, 1]) {shade} * [x + y + c >= 0] d(x, y)", PLAIN)

    def value(c: Any) -> Any:
        """The shader depends on s = x + y alone: its density is s up to 1, 2 - s beyond."""
        return mp.quad(lambda s: min(s, 2 - s) / (mp.sqrt(2) * (s + c) + 2) ** 2, [-c, 1, 2])

    for i in (0, 57, 121, 199):
        c = mp.mpf(float(PLAIN[i]))
        exact, slope = value(c), mp.diff(value, c, h=mp.mpf("1e-6"))
        assert abs(answer.value[i] - exact) <= answer.error[i] <= 1e-12
        assert abs(answer.tangent[i] - slope) <= answer.tangent_error[i] + 1e-10  # what is left of a difference
    assert answer.converged and answer.evals <= 500 * PLAIN.size


def test_proofs_for_regions_of_parameters_ask_for_few_nodes() -> None:
    """Two parameters, each with a speed of its own; 10 x 10 nodes are enough where coefficients ask for 14 x 14."""
    a, b = np.random.default_rng(3).uniform(0.5, 2.0, (2, 2000))
    b /= 4
    program = potto.compile("def f(a, b) integral ([0, 1], [0, 1]) exp(a*x)/(1 + y)^2*[y < b*x] d(x, y)")
    with potto.settings(backend="numpy"):
        answer = potto.grad(program.f, ("a", "b"))(a, b)

    def value(a: Any, b: Any) -> Any:
        """Over y first: the integrand is exp(a*x)*b*x/(1 + b*x)."""
        return mp.quad(lambda x: mp.exp(a * x) * b * x / (1 + b * x), [0, 1])

    assert answer.converged and answer.evals <= 150 * a.size
    assert np.max(answer.error) <= 1e-13 and np.max(answer.tangent_error) <= 1e-12
    for i in range(0, 2000, 250):
        at = mp.mpf(float(a[i])), mp.mpf(float(b[i]))
        assert abs(answer.value[i] - value(*at)) <= answer.error[i]
        for d, wrt in enumerate(((1, 0), (0, 1))):  # tangent: one row per parameter
            exact = mp.diff(value, at, wrt)
            assert abs(answer.tangent[d][i] - exact) <= answer.tangent_error[d][i]


@pytest.mark.parametrize("count", [20, 100])
def test_few_members_get_the_nodes_that_are_proved_for_many(count: int) -> None:
    """Coefficients would have a member of a hundred take 350 nodes; 14 x 12 in each of one or two cells are enough."""
    shade = "1/(sqrt(2)*(x + y + c) + 2)^2"
    c = np.linspace(-1.99, -0.01, count)
    answer = answered(f"def f(c) integral ([0, 1], [0, 1]) {shade} * [x + y + c >= 0] d(x, y)", c)
    assert answer.converged and answer.evals <= 260 * count
    for i in (0, count // 3, count - 1):
        at = mp.mpf(float(c[i]))
        corners = sorted({-at, max(-at, mp.mpf(1)), mp.mpf(2)})
        exact = mp.quad(lambda s, at=at: min(s, 2 - s) / (mp.sqrt(2) * (s + at) + 2) ** 2, corners)
        assert abs(answer.value[i] - exact) <= answer.error[i] <= 1e-14


def test_what_is_proved_for_a_batch_is_known_of_others() -> None:
    """Values that are each a little larger lie in the same regions, so that nothing is made any more."""
    shade = "1/(sqrt(2)*(x + y + c) + 2)^2"
    program = potto.compile(f"def f(c) integral ([0, 1], [0, 1]) {shade} * [x + y + c >= 0] d(x, y)")
    slope, c = potto.grad(program.f, "c"), np.linspace(-1.99, -0.02, 300)
    with potto.settings(backend="numpy"):
        assert slope(c).compile_seconds > 0
        assert [slope(c + d).compile_seconds for d in (0.0, 1e-4, 2e-3)] == [0.0] * 3


def test_where_nothing_can_be_proved_nobody_tries_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of pixels all along a circle: in a region as large as it has to be for so few, the circle turns."""
    text = "def f(a, b, r) integral ([a, a + 1/512], [b, b + 1/512]) [(x - 0.5)^2 + (y - 0.5)^2 < r] d(x, y)"
    a, b = (z.ravel() for z in np.meshgrid(np.arange(512) / 512, np.arange(512) / 512))
    f, proofs, tried = potto.grad(potto.compile(text).f, "r"), proved_shapes._proofs, list[int]()

    def counted(*given: Any) -> Any:
        found = proofs(*given)
        tried.append(found[0].max())
        return found

    monkeypatch.setattr(proved_shapes, "_proofs", counted)
    for r in (0.1, 0.1, 0.1001):
        found = f(a, b, r)
        assert abs(found.value.sum() - r * math.pi) <= found.error.sum() <= 1e-11
    assert tried == [0]


@pytest.mark.parametrize("order", ["x, y", "y, x"])
def test_circles_turn_at_both_ends(order: str) -> None:
    r = np.linspace(0.2, 0.95, 100)
    answer = answered(f"def f(r) integral ([-1, 1], [-1, 1]) [x*x + y*y < r*r]/(2 + x) d({order})", r)
    root = np.sqrt(4 - r * r)
    covered(answer, 2 * math.pi * r * r / (2 + root), 2 * math.pi * r / root, 1e-10)
    assert answer.evals <= (150 if order == "x, y" else 1400) * r.size


@pytest.mark.parametrize("backend", ["numpy", "native"])
def test_a_disc_turns_where_pixels_meet(backend: Any) -> None:
    """Left and right of its centre a disc turns on a border of pixels, where its sections leave them: the cuts are one,
    and move as one. The general way, which takes as long as all the others, would have 84 evaluations more."""
    text = "def f(a, b, r) integral ([a, a + 1/16], [b, b + 1/16]) [(x - 0.5)^2 + (y - 0.5)^2 < r] d(x, y)"
    a, b = (z.ravel() for z in np.meshgrid(np.arange(16) / 16, np.arange(16) / 16))
    with potto.settings(backend=backend):
        answer = potto.grad(potto.compile(text).f, "r")(a, b, 0.1)
    assert answer.converged and answer.evals <= 1050
    assert abs(answer.value.sum() - 0.1 * math.pi) <= answer.error.sum() <= 1e-13
    assert abs(answer.tangent.sum() - math.pi) <= answer.tangent_error.sum() <= 1e-11
    turned = (a == 2 / 16) & (b == 8 / 16)  # the disc from 0.5 - sqrt(r) on, up to the next pixel: half a segment
    angle = mp.acos((mp.mpf("0.5") - mp.mpf(3) / 16) / mp.sqrt(mp.mpf(0.1)))
    assert abs(answer.tangent[turned][0] - angle / 2) <= answer.tangent_error[turned][0] <= 1e-12
    area = (mp.mpf(0.1) * angle - (mp.mpf("0.5") - mp.mpf(3) / 16) ** 2 * mp.tan(angle)) / 2
    assert abs(answer.value[turned][0] - area) <= answer.error[turned][0] <= 1e-14


@pytest.mark.parametrize("backend", ["numpy", "native"])
def test_few_cells_that_are_left_take_one_rule_more(backend: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a disc on pixels most cells are done by the first rule. Of the others each rule with a few nodes more would
    leave a few: they get at once as many as make little difference beside those of all."""
    if backend == "native":
        pytest.importorskip("llvmlite")
    text = "def f(a, b, r) integral ([a, a + 1/16], [b, b + 1/16]) [(x - 0.5)^2 + (y - 0.5)^2 < r] d(x, y)"
    a, b = (z.ravel() for z in np.meshgrid(np.arange(16) / 16, np.arange(16) / 16))
    cells = rules(monkeypatch)
    with potto.settings(backend=backend):
        answer = potto.grad(potto.compile(text).f, "r")(a, b, 0.1)
    first, left, *turning = cells
    assert first > 50 and 2 < left < first / 4 and turning == [2, 2]  # left and right of the centre
    assert abs(answer.value.sum() - 0.1 * math.pi) <= answer.error.sum() <= 1e-13
    assert abs(answer.tangent.sum() - math.pi) <= answer.tangent_error.sum() <= 1e-11


def test_rounding_is_followed_at_every_node_of_a_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    """Twice what it is at a few of them left three pixels of a disc to other variables, as not known to 1e-10."""
    text = "def f(a, b, r) integral ([a, a + 1/512], [b, b + 1/512]) [(x - 0.5)^2 + (y - 0.5)^2 < r] d(x, y)"
    a, b = (z.ravel() for z in np.meshgrid(np.arange(512) / 512, np.arange(512) / 512))
    members, alike = list[int](), quadrature._alike

    def counted(plan: Any, machine: Any, env: Any, batch: int, tight: bool) -> Any:
        members.append(batch)
        return alike(plan, machine, env, batch, tight)

    monkeypatch.setattr(quadrature, "_alike", counted)
    with potto.settings(backend="numpy"):
        answer = potto.grad(potto.compile(text).f, "r")(a, b, 0.1)
    assert answer.converged and max(members) > 1000
    assert members[members.index(max(members)) + 1 :] == []
    assert abs(answer.value.sum() - 0.1 * math.pi) <= answer.error.sum() <= 1e-13
    assert abs(answer.tangent.sum() - math.pi) <= answer.tangent_error.sum() <= 1e-11


def test_cells_with_coefficients_of_rounding_are_told_by_the_first_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    """Along the right of a disc, where it turns: the last of 12 coefficients of the two cells there are rounding, as
    are those of any rule with more nodes. The areas by rows, up to where the arc leaves a pixel, to 30 digits."""
    text = "def f(a, b, r) integral ([a, a + 1/256], [b, b + 1/256]) [(x - 0.5)^2 + (y - 0.5)^2 < r] d(x, y)"
    b = np.arange(102, 153) / 256
    a = np.floor(256 * (0.5 + np.sqrt(0.1 - (b + 1 / 512 - 0.5) ** 2))) / 256
    cells = rules(monkeypatch)
    with potto.settings(backend="numpy"):
        answer = potto.grad(potto.compile(text).f, "r")(a, b, 0.1)
    assert max(cells) > 90 and [n for n in cells if n <= 2] == [2]

    def area(low: mp.mpf, down: mp.mpf) -> mp.mpf:
        h, half = mp.mpf(1) / 256, mp.mpf("0.5")
        leaves = [mp.sqrt(max(mp.mpf(0.1) - (x - half) ** 2, 0)) for x in (low, low + h)]
        ends = [down, *sorted(y for c in leaves for y in (half - c, half + c) if down < y < down + h), down + h]
        return mp.quad(lambda y: min(max(half + mp.sqrt(mp.mpf(0.1) - (y - half) ** 2) - low, 0), h), ends)

    with mp.workdps(30):
        for i in (0, 25, 26, 50):
            exact = area(mp.mpf(a[i]), mp.mpf(b[i]))
            assert abs(answer.value[i] - float(exact)) <= answer.error[i] <= 1e-16


def test_cuts_that_are_one_and_move_apart_have_two_sides() -> None:
    """The smaller of a and b: where both are 0.5 the derivative by each is 0 or 1, or 1 by both together."""
    program = potto.compile("def f(a, b) integral ([0, 1], [0, 1]) [x < a]*[x < b]*2*y d(x, y)")
    a = np.append(np.linspace(0.1, 0.9, 80), 0.5)
    (note,) = potto.grad(program.f, "a")(a, 0.5).notes
    assert note.backward[-1] == pytest.approx(1.0, rel=1e-12) and note.forward[-1] == pytest.approx(0.0, abs=1e-12)
    together = potto.deriv(program.f)((a, 1.0), (0.5, 1.0))
    assert not together.notes
    covered(together, np.minimum(a, 0.5), 1.0)


def test_circles_that_leave_the_bounds() -> None:
    """Where the circle touches and leaves them, other rows bound its cells: four shapes in one array."""
    r = np.linspace(0.3, 1.35, 211)
    beyond = np.maximum(r, 1.0)
    angle = np.arccos(1 / beyond)
    area = math.pi * r * r - np.where(r > 1, 4 * (r * r * angle - np.sqrt(beyond * beyond - 1)), 0.0)
    slope = r * (2 * math.pi - 8 * np.where(r > 1, angle, 0.0))
    answer = answered("def f(r) integral ([-1, 1], [-1, 1]) [x*x + y*y < r*r] d(x, y)", r)
    assert (np.abs(answer.value - area) <= answer.error).all() and np.max(answer.error) <= 1e-9
    away = np.abs(r - 1) > 1e-9  # at r = 1 the derivative has an infinite one
    assert (np.abs(answer.tangent - slope) <= answer.tangent_error)[away].all()


def test_polynomials_between_planes_are_exact() -> None:
    """The share of a cube below x + y + z = c, a cubic spline: three shapes, and their corners at whole numbers."""
    c = np.linspace(0.05, 2.95, 59)
    answer = answered("def f(c) integral ([0, 1], [0, 1], [0, 1]) [x + y + z < c] d(x, y, z)", c)

    def spline(n: int) -> Any:
        parts = (k * np.maximum(c - j, 0.0) ** n for j, k in ((0, 1), (1, -3), (2, 3)))
        return sum(parts) / math.factorial(n)

    covered(answer, spline(3), spline(2))
    assert answer.evals <= 200 * c.size


NEEDLE = """
def edge(x, y, ax, ay, bx, by) (bx - ax)*(y - ay) - (by - ay)*(x - ax)
def f(ax, ay, bx, by, cx, cy)
    integral ([0, 1], [0, 1])
        [edge(x, y, ax, ay, bx, by) > 0]*[edge(x, y, bx, by, cx, cy) > 0]*[edge(x, y, cx, cy, ax, ay) > 0] d(x, y)
"""


@pytest.mark.parametrize("backend", ["numpy", "native"])
def test_the_place_of_a_sharp_tip_costs_no_digits(backend: Any) -> None:
    """Where two edges meet at an angle e is off by a rounding over e, and how fast that moves by one over e^2, but
    nothing is there. Held to half of the cross product of two edges, in fractions. One rule does for nearly all of the
    triangles, with 5 cells at the most; the general way takes 80 evaluations for each."""
    random = np.random.default_rng(5)
    (ax, ay), turn = random.uniform(0.05, 0.2, (2, 300)), random.uniform(0.3, 1.2, 300)
    e, length = 10.0 ** random.uniform(-5, -2, 300), random.uniform(0.4, 0.7, 300)
    bx, by, cx, cy = (
        start + length * f(angle) for angle in (turn, turn + e) for start, f in ((ax, np.cos), (ay, np.sin))
    )
    corners = np.stack((ax, ay, bx, by, cx, cy))
    with potto.settings(backend=backend):
        answer = potto.grad(potto.compile(NEEDLE).f, ("ax", "ay", "bx", "by", "cx", "cy"))(*corners)
    assert answer.converged and answer.evals <= 10 * e.size
    assert (answer.tangent_error <= 1e-10 * np.abs(answer.tangent).max(axis=0)).all()
    numbers, errors = np.stack((answer.value, *answer.tangent)), np.stack((answer.error, *answer.tangent_error))
    for corner, number, error in zip(corners.T, numbers.T, errors.T, strict=True):
        px, py, qx, qy, rx, ry = map(Fraction, map(float, corner))
        doubled = (qx - px) * (ry - py) - (rx - px) * (qy - py), qy - ry, rx - qx, ry - py, px - rx, py - qy, qx - px
        for found, exact, off in zip(number, doubled, error, strict=True):
            assert abs(Fraction(float(found)) - exact / 2) <= off


def test_members_at_corners_are_as_by_themselves() -> None:
    """The line goes through corners at -2, -1 and 0, where the derivative has two sides or the line leaves."""
    c = np.array([-2.5, -2.0, -1.5, -1.0, -0.5, 0.0, 0.5, *np.linspace(-1.9, -0.1, 30)])
    f = potto.deriv(potto.compile("def f(c) integral ([0, 1], [0, 1]) [x + y + c >= 0]*exp(x) d(x, y)").f)
    together = f((c, 1.0))
    for i, each in enumerate(c):
        alone = f((float(each), 1.0))
        assert abs(together.value[i] - alone.value) <= together.error[i] + alone.error
        assert abs(together.tangent[i] - alone.tangent) <= together.tangent_error[i] + alone.tangent_error
        assert together.error[i] <= 1e-12 and together.tangent_error[i] <= 1e-11


def test_where_the_derivative_crosses_0_nobody_looks_twice() -> None:
    """There rounding is more of it than was asked for, by any rule."""
    t = np.concatenate([np.linspace(-1, 1, 101), 1e-12 * np.arange(-5.0, 6.0)])
    answer = answered("def f(t) integral ([0, 1], [0, 1]) [x < 0.5 + t*t]*cos(y*t) d(x, y)", 0.4 * t)
    a = 0.4 * t
    with np.errstate(all="ignore"):
        sinc = np.where(np.abs(a) < 1e-3, 1 - a * a / 6, np.sin(a) / np.where(a == 0, 1, a))
        rate = np.where(np.abs(a) < 1e-3, -a / 3 + a**3 / 30, (np.cos(a) - sinc) / np.where(a == 0, 1, a))
    value, slope = (0.5 + a * a) * sinc, 2 * a * sinc + (0.5 + a * a) * rate
    assert (np.abs(answer.value - value) <= answer.error + 1e-15).all()
    assert (np.abs(answer.tangent - slope) <= answer.tangent_error + 1e-12).all()  # the closed form's own cancellation
    assert answer.evals <= 200 * t.size


def test_parameters_that_do_not_move_cost_nothing() -> None:
    """Only one of four is differentiated by; the tangent is that one's."""
    text = "def f(a, b, h, c) integral ([a, a + h], [b, b + h]) [x + 2*y < c]*(x + y) d(x, y)"
    g = np.linspace(0, 1, 24, endpoint=False)
    a, b = (z.ravel() for z in np.meshgrid(g, g))
    f = potto.deriv(potto.compile(text).f)
    answer = f((a, 0.0), (b, 0.0), (1 / 24, 0.0), (1.1, 1.0))
    assert answer.converged

    def whole(c: float) -> float:
        """Over the unit square, cut off at y = (c - x)/2."""
        x, y = mp.mpf(c), mp.mpf(c) / 2
        return float(mp.quad(lambda s: mp.quad(lambda t: s + t, [0, (c - s) / 2]), [0, 1])) if x and y else 0.0

    assert float(np.sum(answer.value)) == pytest.approx(whole(1.1), rel=1e-13)
    edge = float(mp.quad(lambda s: (s + (mp.mpf("1.1") - s) / 2) / 2, [0, 1]))  # what the line sweeps
    assert float(np.sum(answer.tangent)) == pytest.approx(edge, rel=1e-13)


@pytest.mark.parametrize("e", [1e-3, 1e-5, 1e-7, 1e-12])
@pytest.mark.parametrize("text", ["exp(-x/e)", "exp(-x/e)*[x < 2 + e]"])
def test_what_no_node_sees_at_the_ends(text: str, e: float) -> None:
    """A layer at an end of the range, e wide: e, and 1 for the derivative, to exp(-1000)."""
    answer = potto.deriv(potto.compile(f"def f(e) integral [0, 1] {text} d(x)").f)((e, 1.0))
    assert abs(answer.value - e) <= answer.error + 1e-15 * e and answer.error <= 1e-9 * e
    assert abs(answer.tangent - 1) <= answer.tangent_error + 1e-15 and answer.tangent_error <= 1e-8


def test_a_cut_that_starts_in_a_corner_of_the_bounds() -> None:
    """y = x meets y = 0 where x = 0: that cut is the bound, for all members, and tells no cells apart. In polar
    coordinates exp(xy) over a sector is one integral by the angle."""
    a = np.linspace(0.3, 0.9, 401)
    answer = answered("def f(a) integral ([0, 2], [0, 2]) exp(x*y)*[x*x + y*y < a]*[y < x] d(x, y)", a)
    assert answer.converged and answer.evals <= 400 * a.size
    for i in (0, 150, 400):
        value = mp.quad(lambda s, a=a[i]: mp.expm1(a * mp.sin(2 * s) / 2) / mp.sin(2 * s), [0, mp.pi / 4])
        slope = mp.quad(lambda s, a=a[i]: mp.exp(a * mp.sin(2 * s) / 2) / 2, [0, mp.pi / 4])
        assert abs(answer.value[i] - float(value)) <= answer.error[i] + 1e-15
        assert abs(answer.tangent[i] - float(slope)) <= answer.tangent_error[i] + 1e-15


def test_a_polynomial_from_a_turning_point_on() -> None:
    """The roots of x^2 < t merge where x = 0, the lower bound; x^2 takes two nodes where Gauss has them."""
    t = np.linspace(0.1, 0.9, 401)
    answer = answered("def f(t) integral [0, 1] x^2*[x^2 < t] d(x)", t)
    assert (np.abs(answer.value - t**1.5 / 3) <= answer.error + 1e-16).all()
    assert (np.abs(answer.tangent - t**0.5 / 2) <= answer.tangent_error + 2e-16).all()


def test_errors_of_zero_are_nothing_that_machine_code_reads() -> None:
    """Seeds of a tape have them: functions are the same as for seeds without, and read the tangent, not 1 for 0."""
    seeds = {"a": Cell(0.5, None, (1.0, None), (0.0, None)), "b": Cell(0.25, 0.0, (None, 2.0), (None, 0.0))}
    bare = {"a": Cell(0.5, None, (1.0, None), (None, None)), "b": Cell(0.25, None, (None, 2.0), (None, None))}
    assert places_of("ab", seeds) == places_of("ab", bare)
    unsure = {**bare, "b": Cell(0.25, None, (None, 2.0), (None, 1e-17))}
    assert places_of("ab", unsure) != places_of("ab", bare)


@pytest.mark.parametrize("backend", ["numpy", "native"])
def test_lines_along_an_axis_are_cut_like_others(backend: Any) -> None:
    """Half of them are level or upright, and meet the other variable nowhere: they are not gone over one by one."""
    if backend == "native":
        pytest.importorskip("llvmlite")
    random = np.random.default_rng(0)
    a, b = random.uniform(0.1, 0.9, (2, 400))
    a[::2] = b[::2]
    da, db = random.normal(size=(2, 400))
    level = potto.compile("def f(a, b) integral ([0, 1], [0, 1]) [y < a + (b - a)*x] d(x, y)").f
    upright = potto.compile("def f(a, b) integral ([0, 1], [0, 1]) [x < a + (b - a)*y] d(x, y)").f
    with potto.settings(backend=backend):
        for f in (level, upright):
            answer = potto.deriv(f)((a, da), (b, db))
            covered(answer, (a + b) / 2, (da + db) / 2)
            assert answer.evals <= 2 * a.size  # one for each cell: an area


def test_a_quadratic_that_is_a_line_has_its_one_root() -> None:
    """The other one is at infinity. By 50 digits, where a is not 0."""
    a = np.concatenate([np.zeros(100), np.linspace(0.1, 0.8, 100)])
    c = np.tile(np.linspace(0.1, 0.9, 100), 2)
    answer = answered("def f(c, a) integral [0, 1] [a*x^2 + x > c] d(x)", c, a=a)
    with mp.workdps(50):
        root = [(2 * y / (1 + mp.sqrt(1 + 4 * x * y))) for x, y in zip(map(mp.mpf, a), map(mp.mpf, c), strict=True)]
        slope = [-1 / mp.sqrt(1 + 4 * x * y) for x, y in zip(map(mp.mpf, a), map(mp.mpf, c), strict=True)]
    covered(answer, np.array([float(1 - r) for r in root]), np.array([float(s) for s in slope]), 1e-12)
