"""Members of an array get the answer, the cost and the reasons that they get by themselves.

The meshes are triangles over pixels, each pixel's covered area with its derivative by the vertices, which are held
against the clipped polygon: its area, and the lengths of its edges' pieces by the chain rule (`mpmath` nowhere needed:
areas of polygons are finite sums).
"""

from __future__ import annotations

import math
import warnings
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from polygons import area, in_square

import potto
from potto.integrate.adaptive.iterated import Iteration
from potto.integrate.events import Events, Spot, SurfaceFold, TwoSided

TRIANGLE = """
def covered(x0, y0, ax, ay, bx, by, cx, cy)
    integral ([x0, x0 + 1/16], [y0, y0 + 1/16])
        [(bx - ax)*(y - ay) - (by - ay)*(x - ax) >= 0]
        *[(cx - bx)*(y - by) - (cy - by)*(x - bx) >= 0]
        *[(ax - cx)*(y - cy) - (ay - cy)*(x - cx) >= 0] d(x, y)
"""
NAMES = ["x0", "y0", "ax", "ay", "bx", "by", "cx", "cy"]
WRT = NAMES[2:]
MODULE = potto.compile(TRIANGLE)


def mesh(kind: str, count: int) -> Any:
    """Pairs of a pixel and a triangle of a mesh that it may meet: (count, 8)."""
    random = np.random.default_rng(3)
    g = np.arange(9) / 8
    x, y = np.meshgrid(g, g, indexing="ij")
    if kind == "diagonal":
        x = x + y / 2
    if kind == "nearly":
        x = x + 2.0**-20 * y
    if kind == "warped":
        x, y = x + 0.02 * random.normal(size=x.shape), y + 0.02 * random.normal(size=y.shape)
    rows = []
    for i in range(8):
        for j in range(8):
            a, b, c, d = [(x[p], y[p]) for p in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))]
            for corners in ((a, b, c), (a, c, d)):
                xs, ys = zip(*corners, strict=True)
                for p in range(math.floor(min(xs) * 16), math.ceil(max(xs) * 16)):
                    for q in range(math.floor(min(ys) * 16), math.ceil(max(ys) * 16)):
                        rows.append([p / 16, q / 16, *(z for corner in corners for z in corner)])
    return np.array(rows)[random.permutation(len(rows))[:count]]


def covered_area(row: Any) -> float:
    """Of the triangle clipped to the pixel, in fractions."""
    x0, y0, *rest = (Fraction(float(z)) for z in row)
    return float(area(in_square([(rest[i], rest[i + 1]) for i in (0, 2, 4)], x0, y0, Fraction(1, 16))))


def both(rows: Any) -> tuple[Any, list[Any]]:
    f = potto.grad(MODULE.covered, WRT)
    columns = dict(zip(NAMES, rows.T, strict=True))
    return f(**columns), [f(**dict(zip(NAMES, map(float, row), strict=True))) for row in rows]


@pytest.mark.parametrize("kind", ["axes", "nearly", "diagonal", "warped"])
def test_a_mesh_as_an_array_is_what_its_pairs_are(kind: str) -> None:
    rows = mesh(kind, 40)
    together, single = both(rows)
    exact = np.array([covered_area(row) for row in rows])
    assert (np.abs(together.value - exact) <= together.error + 1e-17).all()
    tangents, errors = np.array(together.tangent), np.array(together.tangent_error)
    assert np.isfinite(tangents).all() and (errors <= 1e-6).all()
    for i, one in enumerate(single):
        assert abs(one.value - together.value[i]) <= one.error + together.error[i]
        off = np.abs(np.array(one.tangent) - tangents[:, i])
        assert (off <= np.array(one.tangent_error) + errors[:, i]).all()
        # of the same size: within 8 times, or both rounding
        assert (errors[:, i] <= 8 * np.array(one.tangent_error) + 1e-13).all()
        assert one.converged == together.member_converged[i]
        assert set(one.reasons) == set(together.reasons_of(i))
    # those without the accuracy asked for (rounding) are tried once more by themselves
    assert together.evals <= 2.2 * sum(one.evals for one in single) + 1000


def test_an_interior_derivative_of_a_warped_mesh_by_differences() -> None:
    """Steps of 1e-6 in exact areas: good to 1e-7 of the pixel's width where no corner is crossed."""
    rows = mesh("warped", 60)
    answer = potto.grad(MODULE.covered, WRT)(**dict(zip(NAMES, rows.T, strict=True)))
    assert answer.converged and answer.member_converged.all()
    for i, row in enumerate(rows):
        for d in range(6):
            up, down = row.copy(), row.copy()
            up[2 + d] += 1e-6
            down[2 + d] -= 1e-6
            slope = (covered_area(up) - covered_area(down)) / (up[2 + d] - down[2 + d])
            assert abs(answer.tangent[d][i] - slope) <= 1e-6


T = np.linspace(0.1, 0.9, 30)
HARD = [  # one or two members that meet something, at the end
    ("integral [0, 1] x^(-t) d(x)", [1.0, 1.5]),  # diverges
    ("integral ([-1, 1], [-1, 1]) [x*y < t] d(x, y)", [0.0]),  # an infinite derivative
    ("integral [-1, 1] exp(-(x/t)^2) d(x)", [1e-7]),  # a peak
    ("integral [-1, 1] [x^2 < t - 1/2]*exp(x) d(x)", [0.5]),  # a fold
    ("integral ([0, 1], [0, 1]) [x > (t - 1/2)*y]*exp(x) d(x, y)", [0.5]),  # along a bound
    ("integral ([0, 1], [0, 1]) [x < t]*[y < t]*[x + y < 1] d(x, y)", [0.5, 1.0, 0.0]),  # corners and bounds
    ("integral [0, 2] [x < t]*[x < 2*t - 1/2] d(x)", [0.5]),  # surfaces that meet
    ("integral ([-1, 1], [-1, 1]) [x > y*(t - 1/2)] d(y, x)", [0.5]),  # along a variable, further in
]


@pytest.mark.parametrize(("body", "hard"), HARD)
@pytest.mark.parametrize("place", ["last", "first"])
def test_a_hard_member_costs_the_others_nothing(body: str, hard: list[float], place: str) -> None:
    f = potto.deriv(potto.compile(f"def f(t)\n    {body}").f)
    t = np.append(T, hard) if place == "last" else np.append(hard, T)
    together = f((t, np.ones(t.size)))
    single = [f((float(x), 1.0)) for x in t]
    for i, one in enumerate(single):
        for a, b, slack in (
            (one.value, together.value[i], one.error + together.error[i]),
            (one.tangent, together.tangent[i], one.tangent_error + together.tangent_error[i]),
        ):
            assert np.array_equal(a, b, equal_nan=True) or abs(a - b) <= slack
        assert one.converged == together.member_converged[i] and set(one.reasons) == set(together.reasons_of(i))
        assert math.isinf(one.tangent_error) == math.isinf(together.tangent_error[i])
    # what is hard is met once in the batch and once by itself
    assert together.evals <= 1.7 * sum(one.evals for one in single) + 400
    assert {note.surface for one in single for note in one.notes} == {note.surface for note in together.notes}


def test_sides_are_those_of_the_member() -> None:
    f = potto.deriv(potto.compile("def f(t)\n    integral [0, 1] [x < t]*(1 + x) d(x)").f)
    t = np.append(T, [0.0, 1.0])
    answer = f((t, np.ones(t.size)))
    assert len(answer.notes) == 1
    (note,) = answer.notes
    assert np.isnan(note.forward[:-2]).all() and list(note.forward[-2:]) == [1.0, 0.0]
    assert list(note.backward[-2:]) == [0.0, 2.0] and "not known" not in str(note)
    assert (np.abs(answer.tangent[:-2] - (1 + T)) <= answer.tangent_error[:-2]).all()


def test_roots_left_out_are_the_members_own() -> None:
    """sin(1/x) < c has too many roots where the domain reaches 0."""
    f = potto.compile("def f(t)\n    integral [t, 1] [sin(1/x) < 0.3] d(x)").f
    t = np.append(T, [0.0])
    answer = f(t)
    assert np.isinf(answer.error[-1]) and not answer.member_converged[-1]
    assert answer.member_converged[:-1].all() and (answer.error[:-1] <= 1e-12).all()


@pytest.mark.parametrize("method", ["quadrature", "mc"])
def test_a_budget_is_each_members(method: Any) -> None:
    f = potto.compile("def f(t)\n    integral ([0, 1], [0, 1]) exp(-((x - 1/3)/t)^2 - ((y - 1/3)/t)^2) d(x, y)").f
    t = np.append(np.linspace(0.5, 2.0, 20), [1e-3])
    with potto.settings(method=method, max_evals=2000, samples=1500, rtol=1e-6):
        answer = f(t)
    assert answer.evals <= 2 * 2000 * t.size + 40_000
    if method == "quadrature":
        assert answer.member_converged[:-1].all() and not answer.member_converged[-1]
    erf = np.array([math.erf(2 / 3 / x) + math.erf(1 / 3 / x) for x in t])
    exact = np.pi / 4 * (t * erf) ** 2
    assert (np.abs(answer.value - exact) <= answer.error).all()


def test_members_of_any_shape() -> None:
    f = potto.compile("def f(t, s)\n    integral [0, 1] s*x^(-t) d(x)").f
    answer = f(np.array([[0.5], [1.0]]), np.linspace(1.0, 2.0, 12))
    assert answer.member_converged.shape == (2, 12)
    assert answer.member_converged[0].all() and not answer.member_converged[1].any()
    assert answer.reasons_of((1, 3)) and not answer.reasons_of((0, 3))
    (mask,) = answer.shortfalls.values()
    assert mask[1].all() and not mask[0].any()


def test_roots_that_merge_for_one_member_leave_the_bounds_of_all_moving() -> None:
    """sin(3x) reaches y + t in one point, the corner (pi/6, 0.5) of the last member's box, where its roots move
    infinitely fast; elsewhere the integrand is 1, so that the derivative is the height times the speed of the bound."""
    program = """
def f(a, b, t)
    integral ([a, a + t/16], [b, b + 1/16]) (if [sin(3*x) - y - t >= 0] then 2 else 1) d(x, y)
"""
    a = np.append(np.linspace(0.05, 0.25, 11), [math.pi / 6])
    answer = potto.deriv(potto.compile(program).f)((a, 0.0), (0.5, 0.0), (0.5, 1.0))
    assert (np.abs(answer.tangent - 1 / 256) <= answer.tangent_error + 1e-17).all()
    assert (answer.tangent_error[:-1] <= 1e-14).all()


def test_members_at_folds_are_looked_at_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 16 pixels an ellipse touches the sides of eight exactly. All that is looked at beside these is one batch, and
    each has the derivative that it has by itself: to the last bit, as nodes are the same."""
    text = """
def f(px, py, r) integral ([px, px + 1/4], [py, py + 1/4]) [(x - 1/2)^2 + 2*(y - 1/2)^2 < r] d(x, y)
"""
    x, y = (side.ravel() for side in np.meshgrid(np.arange(4) / 4, np.arange(4) / 4))
    slope, calls, whole = potto.grad(potto.compile(text).f, "r"), [], Iteration.whole
    monkeypatch.setattr(Iteration, "whole", lambda *args: calls.append(args[2]) or whole(*args))
    found = slope(x, y, 0.125)
    assert found.converged and not found.notes and len(calls) <= 4
    assert found.tangent.sum() == pytest.approx(math.pi / math.sqrt(2), abs=1e-14)
    assert found.tangent.tolist() == [slope(*map(float, at), 0.125).tangent for at in zip(x, y, strict=True)]


def test_members_along_every_axis_are_looked_at_in_all_directions_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """Triangles whose edges lie on those of pixels, by six numbers: all directions are one batch, and both sides of a
    bound one pass, so that there are eight (27 by one direction and side at a time)."""
    rows, calls, whole = mesh("axes", 120), [], Iteration.whole
    columns = dict(zip(NAMES, rows.T, strict=True))
    monkeypatch.setattr(Iteration, "whole", lambda *args: calls.append(args[2]) or whole(*args))
    answer = potto.grad(MODULE.covered, WRT)(**columns)
    assert answer.converged and 0 < len(calls) <= 10
    exact = np.array([covered_area(row) for row in rows])
    assert (np.abs(answer.value - exact) <= answer.error + 1e-17).all()


def test_places_of_folds_go_with_their_members() -> None:
    """Also of members that are named out of order, or twice; the first to name one says where it is."""
    cause, met = TwoSided("x", fold=True), Events()
    met.note(SurfaceFold(cause, tuple(Spot(0, 0, place) for place in (5.0, 2.0, 5.5))), np.array([5, 2, 5]))
    met.note(SurfaceFold(cause, (Spot(0, 0, 2.5), Spot(0, 0, 9.0), Spot(0, 0, 1.0))), np.array([2, 9, 1]))
    ((event, members),) = met.every(SurfaceFold)
    assert members is not None and members.tolist() == [1, 2, 5, 9]
    assert [event.spot(i).place for i in range(4)] == [1.0, 2.0, 5.0, 9.0]
    ((some, kept),) = met.of(np.array([2, 3, 9])).every(SurfaceFold)
    assert kept is not None and kept.tolist() == [0, 2] and [spot.place for spot in some.spots] == [2.0, 9.0]


def test_members_that_rounding_spoils_are_cut_once_in_each_order(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of slivers, up to a 200th of a pixel wide, some have so little of their tips in a pixel that no rule has all
    digits of the derivatives. Those for which no rule goes at all may be tried once more by themselves, a handful."""
    random = np.random.default_rng(1)
    corners = random.random((6, 4000))
    corners[2:4] = corners[:2] + 3e-4 * random.random((2, 4000))
    (ax, ay), (bx, by), (cx, cy) = corners.reshape(3, 2, -1)
    turned = (bx - ax) * (cy - ay) < (cx - ax) * (by - ay)
    corners = np.where(turned, corners[[0, 1, 4, 5, 2, 3]], corners)
    inside = random.dirichlet((1, 1, 1), 4000).T
    pixel = np.einsum("cdn,cn->dn", corners.reshape(3, 2, -1), inside) - random.random((2, 4000)) / 16
    seen: list[tuple[object, float]] = []
    whole = Iteration.whole

    def counted(self: Iteration, env: Any, batch: int) -> Any:
        seen.extend((self.plan, x) for x in np.broadcast_to(env["ax"].v, batch).tolist())
        return whole(self, env, batch)

    monkeypatch.setattr(Iteration, "whole", counted)
    found = potto.grad(MODULE.covered, WRT)(*pixel, *corners)
    assert len(seen) > 10 and len(seen) - len(set(seen)) <= 5
    for i in [*np.flatnonzero(~found.member_converged), *range(0, 4000, 200)]:
        assert abs(found.value[i] - covered_area([*pixel[:, i], *corners[:, i]])) <= found.error[i] + 1e-17


@pytest.mark.parametrize("count", [3, 1000, 5000])
def test_infinite_members_of_both_signs_beside_others(count: int) -> None:
    """Each infinite one is told, all others are what they are alone, and numpy has nothing to warn of."""
    f = potto.compile("def f(t) integral [0, t] exp(-x) d(x)").f
    t = np.linspace(0.1, 0.9, count)
    t[1:3] = math.inf, -math.inf
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = potto.grad(f)(t)
    assert found.value[2] == -math.inf and found.tangent[2] == math.inf
    fine = np.arange(count) != 2
    assert (found.member_converged == fine).all()
    value, error, slope, slope_error = (
        part[fine] for part in (found.value, found.error, found.tangent, found.tangent_error)
    )
    assert (np.abs(value + np.expm1(-t[fine])) <= error).all()
    assert (np.abs(slope - np.exp(-t[fine])) <= slope_error + 1e-18).all()
