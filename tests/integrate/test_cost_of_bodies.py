"""What bodies in space cost, counted in evaluations, with their volumes and surfaces by formula."""

from __future__ import annotations

import math
from typing import Any

import pytest

import potto
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
