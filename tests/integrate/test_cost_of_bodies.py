"""What bodies in space cost, counted in evaluations, with their volumes and surfaces by formula."""

from __future__ import annotations

import math
import operator
from typing import Any

import pytest
from spheres import directions

import potto
from potto.calculus.decomposition.strata import Stratum
from potto.core.terms import Term, add, mul, var
from potto.integrate.decomposition import box_search, critical_places

CUBE = "def f(t) integral ([-2, 2], [-2, 2], [-2, 2]) {} d(x, y, z)"


def test_nodes_that_crowd_where_a_ball_ends_are_not_taken_for_a_fold() -> None:
    """Two balls with their middles t apart have 8 pi/3 - pi/12 (4 + t) (2 - t)^2 between them: beside a silhouette
    rules have nodes within rounding of it, at which both roots are one."""
    f = potto.deriv(potto.compile(CUBE.format("[x^2 + y^2 + z^2 < 1 or (x - t)^2 + y^2 + z^2 < 1]")).f)
    found, t = f((0.8, 1.0)), 0.8
    lens = math.pi / 12 * (4 + t) * (2 - t) ** 2
    slope = math.pi / 12 * ((2 - t) ** 2 - 2 * (4 + t) * (2 - t))
    assert abs(found.value - (8 * math.pi / 3 - lens)) <= found.error <= 1e-9
    assert abs(found.tangent + slope) <= found.tangent_error + 1e-14 <= 1e-9
    assert found.converged and found.evals <= 250_000  # looked at beside the parameter, a million


def test_a_ball_without_eight_caps() -> None:
    """As the faces of an octahedron lie, turned: caps of height r - 0.7, none of which meets another. Of 28 edges of
    their planes, and the 56 corners, none is within the ball, and no variable is cut where these cast shadows: with all
    of them this took 939,180 evaluations, and 120,354 with four planes."""
    normals = (_turned(i, j, k) for i in (1, -1) for j in (1, -1) for k in (1, -1))
    caps = "*".join(f"[({a!r})*x + ({b!r})*y + ({c!r})*z < 0.7]" for a, b, c in normals)
    f = potto.deriv(potto.compile(f"def f(r) {CUBE[9:].format(f'[x^2 + y^2 + z^2 < r^2]*{caps}')}").f)
    found, r, h = f((0.8, 1.0)), 0.8, 0.8 - 0.7
    volume = 4 / 3 * math.pi * r**3 - 8 * math.pi * h**2 * (3 * r - h) / 3
    surface = 4 * math.pi * r**2 - 16 * math.pi * r * h
    assert abs(found.value - volume) <= found.error <= 1e-10
    assert abs(found.tangent - surface) <= found.tangent_error <= 1e-9
    assert found.evals <= 200_000


def _turned(x: float, y: float, z: float) -> tuple[float, float, float]:
    """A unit vector along (x, y, z), turned about two axes."""
    x, y = x * math.cos(0.4) - y * math.sin(0.4), x * math.sin(0.4) + y * math.cos(0.4)
    y, z = y * math.cos(0.9) - z * math.sin(0.9), y * math.sin(0.9) + z * math.cos(0.9)
    return x / math.sqrt(3), y / math.sqrt(3), z / math.sqrt(3)


def test_a_torus_is_not_made_a_table_of_roots() -> None:
    f = potto.deriv(potto.compile(CUBE.format("[(sqrt(x^2 + y^2) - 1)^2 + z^2 < t^2]")).f)
    found = f((0.3, 1.0))
    assert abs(found.value - 2 * math.pi**2 * 0.09) <= found.error <= 1e-6
    assert abs(found.tangent - 4 * math.pi**2 * 0.3) <= found.tangent_error <= 1e-5
    assert found.evals <= 2_500_000  # of tables alone, three million


def test_a_fold_all_along_the_variables_further_out_is_one() -> None:
    """At t = 0 the two roots in z are one wherever x and y are."""
    f = potto.deriv(potto.compile("def f(t) integral ([0, 1], [0, 1], [-1, 1]) [z^2 < t*(1 + x*y)] d(x, y, z)").f)
    (note,) = f((0.0, 1.0)).notes
    assert note.fold and note.variable == "z"
    assert (float(note.backward), float(note.forward)) == (0.0, math.inf)


# Middles of five balls of one radius in a plane, which stands on no axis: u = (2, 1, 2)/3 and v = (-2, 2, 1)/3 span it.
PLANE = ((0.0, 0.0), (0.7, 0.1), (0.2, 0.8), (-0.3, 0.4), (0.3, -0.5))


def test_what_five_balls_share() -> None:
    """By mpmath, from the areas that circles share in slices (`arcs.area`), cut where pairs and triples of these meet.

    Where pairs and triples of balls meet is searched for, of all that differ by numbers alone at once. One by one there
    were 17 searches for three balls, and 70 for five.
    """
    found, searches = _shared(5)
    assert abs(found.value - 0.37083424132940102) <= found.error <= 1e-11
    assert abs(found.tangent - 2.84032867811127238) <= found.tangent_error <= 1e-9
    assert found.converged and found.evals <= 300_000
    assert searches <= _shared(3)[1] + 3


def _shared(count: int) -> tuple[Any, int]:
    """What some of the balls share, and how many searches there were for each time that places were asked for."""
    middles = [
        [0.1 + (a * u + b * v) / 3 for u, v in zip((2, 1, 2), (-2, 2, 1), strict=True)] for a, b in PLANE[:count]
    ]
    balls = " and ".join(f"(x - {a!r})^2 + (y - {b!r})^2 + (z - {c!r})^2 < t^2" for a, b, c in middles)
    most, own, solved = 0, 0, box_search.Search.solved

    def counted(*given: Any) -> Any:
        nonlocal own
        own += 1
        return solved(*given)

    rows = critical_places.critical_rows

    def asked(*given: Any) -> Any:
        nonlocal most, own
        own = 0
        found = rows(*given)
        most = max(most, own)
        return found

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(box_search.Search, "solved", counted)
        patch.setattr("potto.integrate.adaptive.iterated.critical_rows", asked)
        return potto.grad(potto.compile(CUBE.format(f"[{balls}]")).f)(0.95), most


MIDDLE = (0.1, 0.05, -0.03)


def _capped(count: int) -> Any:
    """A ball without caps that do not overlap: by half spaces that leave 3/4 from the origin on."""
    planes = directions(count)
    sides = "*".join(f"[({a!r})*x + ({b!r})*y + ({c!r})*z < 0.75]" for a, b, c in planes)
    a, b, c = MIDDLE
    f = potto.deriv(potto.compile(CUBE.format(f"[(x - {a})^2 + (y - {b})^2 + (z - ({c}))^2 < t^2]*{sides}")).f)
    found = f((1.0, 1.0))
    heights = [0.25 + sum(map(operator.mul, plane, MIDDLE)) for plane in planes]
    value = 4 * math.pi / 3 - sum(math.pi * h * h * (3 - h) / 3 for h in heights)
    assert abs(found.value - value) <= found.error + 1e-15 <= 1e-9
    slope = 4 * math.pi - sum(2 * math.pi * h for h in heights)
    assert abs(found.tangent - slope) <= found.tangent_error + 1e-14 <= 1e-9
    return found


def test_twice_the_planes_that_cut_a_ball() -> None:
    """By volumes of caps. Circles on the ball are seen touching its silhouette, where nothing happens: formulas for
    that place left the rate two digits, and another order of the variables was asked."""
    assert _capped(4).evals <= 2.3 * _capped(2).evals


@pytest.mark.slow
def test_what_three_balls_cover() -> None:
    """By the arcs around slices, cut where these change: at vertices, and at the ends of balls and of their edges.

    What is hidden in the third ball cuts nothing; with it there were 2,553,363 evaluations.
    """
    middles = [tuple(0.35 * v for v in direction) for direction in directions(3)]
    balls = " or ".join(f"(x - ({a!r}))^2 + (y - ({b!r}))^2 + (z - ({c!r}))^2 < t^2" for a, b, c in middles)
    found = potto.deriv(potto.compile(CUBE.format(f"[{balls}]")).f)((0.9, 1.0))
    assert abs(found.value - 5.54123758772035) <= found.error + 2e-14 <= 1e-9
    assert abs(found.tangent - 15.61589836130495) <= found.tangent_error + 1e-13 <= 1e-8
    assert found.evals <= 500_000


def test_edges_that_pass_each_other_do_not_meet() -> None:
    """Of four surfaces in space two edges have nothing in common, of three they have a vertex; a silhouette touches an
    edge where nothing happens, but a wall that stands on it cuts it."""
    one, other, third, fourth = (add(var(name), mul(var("y"), var("z"))) for name in "abcd")
    inner = frozenset(("y", "z"))

    def edge(*surfaces: Term) -> Stratum:
        return Stratum(frozenset(surfaces))

    assert edge(one, other).meets(edge(one, third), inner)
    assert not edge(one, other).meets(edge(third, fourth), inner)
    silhouette = edge(one).turning("z")
    assert not silhouette.meets(edge(one, other), inner)
    assert silhouette.meets(edge(add(var("a"), var("y"))), inner)
