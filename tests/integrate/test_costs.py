"""Only what a scene needs: evaluations of interior and boundary, cells, surfaces kept and dropped, counted."""

from __future__ import annotations

import numpy as np
import pytest

import potto

M = potto.compile("""
def step(t, a) integral [0, 1] a*[x < t] d(x)
def bent(t, a) integral [0, 1] a*exp(abs(x - 2))*[x < t] d(x)
def scene(c, s, a) integral ([0, 1], [0, 1]) a*x*[x + y + c >= 0]*[x < s]*[y < 5*a] d(x, y)
def rough(c, s, a) integral ([0, 1], [0, 1]) a*abs(x - 2)*[x + y + c >= 0]*[x < s]*[y < 5*a] d(x, y)
def still(a) integral ([0, 1], [0, 1]) a*x*[x + y >= 1] d(x, y)
def four(t, a) integral ([0, 1], [0, 1], [0, 1], [0, 1]) a*[x + y + z + w < t]*[x < 1/2] d(x, y, z, w)
def walled(c, a) integral ([0, 1], [0, 1]) a*[x < 1/2]*[x + y + c >= 0] d(x, y)
""")
INTERIOR, BOUNDARY, CHECKS = "interior evaluations", "boundary evaluations", "checks at still ends"


def costs(call, **chosen):
    with potto.counting(), potto.settings(**chosen):
        return call().stats


def fates(stats):
    return {entry["surface"]: (entry["kept"], entry["why"]) for entry in stats["surfaces"]}


def test_nobody_pays_who_does_not_ask():
    assert INTERIOR not in M.step(0.3, 2.0).stats


def test_the_parts_are_the_whole():
    for call in (lambda: M.scene(-0.7, 0.5, 1.0), lambda: potto.grad(M.scene, ["c", "s", "a"])(-0.7, 0.5, 1.0),
                 lambda: potto.grad(M.scene, ["c"])(0.0, 1.0, 1.0)):  # fmt: skip
        found = costs(call)
        assert found[INTERIOR] + found[BOUNDARY] + found[CHECKS] == found["evaluations"] > 0


def test_a_line_costs_eleven_nodes_and_its_two_ends():
    """One stretch with the first rule; its end at t is the boundary, its end at 0 a check; [t, 1] is left out."""
    found = costs(lambda: potto.grad(M.bent, "t")(0.3, 2.0))
    assert (found[INTERIOR], found[BOUNDARY], found[CHECKS]) == (11, 1, 1)
    assert (found["cells"], found["empty cells left out"]) == (1, 1)


def test_a_polynomial_costs_the_nodes_that_make_a_rule_exact():
    """Two of them; they move with the end at t, so that nothing is evaluated on it."""
    found = costs(lambda: potto.grad(M.step, "t")(0.3, 2.0))
    assert (found[INTERIOR], found[BOUNDARY], found[CHECKS]) == (2, 0, 0)
    assert (found["cells"], found["empty cells left out"]) == (1, 1)
    assert fates(found) == {"x = t": (True, "it moves: it has a boundary term")}


def test_a_surface_that_nothing_moves_costs_no_boundary_work():
    found = costs(lambda: potto.grad(M.still, "a")(1.0))
    assert found[BOUNDARY] == 0
    assert fates(found) == {"x + y = 1": (False, "nothing that is differentiated moves it")}


@pytest.mark.parametrize("method", ["mc", "qmc"])
def test_nor_when_it_is_sampled(method):
    still = costs(lambda: potto.grad(M.four, "a")(1.5, 2.0), method=method, samples=512)
    moves = costs(lambda: potto.grad(M.four, "t")(1.5, 2.0), method=method, samples=512)
    assert still[BOUNDARY] == 0 and still[INTERIOR] == moves[INTERIOR]
    assert (moves[BOUNDARY] > 0) == (method == "mc")  # nodes along lines move with the end at t, as those above do
    assert [kept for kept, _ in fates(still).values()] == [False, False]
    assert sorted(kept for kept, _ in fates(moves).values()) == [False, True]
    alone = costs(lambda: M.four(1.5, 2.0), method=method, samples=512)
    assert alone[INTERIOR] == still[INTERIOR]


@pytest.mark.parametrize(("f", "boundary"), [(M.scene, False), (M.rough, True)], ids=["proved", "refined"])
def test_parameters_that_are_not_perturbed_cost_nothing(f, boundary):
    """Differentiating by `c` alone, by a dual with tangent 0 for the rest, or by all: the same cells and nodes."""
    one = costs(lambda: potto.grad(f, "c")(-0.7, 0.5, 1.0))
    zero = costs(lambda: potto.deriv(f)((-0.7, 1.0), (0.5, 0.0), (1.0, 0.0)))
    every = costs(lambda: potto.grad(f, ["c", "s", "a"])(-0.7, 0.5, 1.0))
    value = costs(lambda: f(-0.7, 0.5, 1.0))
    assert one[INTERIOR] == zero[INTERIOR] == value[INTERIOR]
    assert one[BOUNDARY] == zero[BOUNDARY] and value[BOUNDARY] == 0
    assert one[BOUNDARY] < every[BOUNDARY] if boundary else every[BOUNDARY] == 0


def test_every_surface_says_what_became_of_it():
    moved = (True, "it moves: it has a boundary term")
    still = (False, "nothing that is differentiated moves it")
    outside = (False, "it does not meet the domain")
    whole = ("x = s", "x + y + c = 0", "y = 5*a")
    by_c = fates(costs(lambda: potto.grad(M.scene, "c")(-0.7, 0.5, 1.0)))
    assert by_c == dict(zip(whole, (still, moved, outside)))
    by_s = fates(costs(lambda: potto.grad(M.scene, "s")(-0.7, 0.5, 1.0)))
    assert by_s == dict(zip(whole, (moved, still, outside)))
    value = fates(costs(lambda: M.scene(-0.7, 0.5, 1.0)))
    assert value["x = s"] == (True, "cut along; no derivative is asked for") and value["y = 5*a"] == outside


def test_a_cell_without_light_is_left_out():
    """Right of x = 1/2 the integrand is 0: those cells are counted, and nothing is evaluated there."""
    found = costs(lambda: M.walled(-0.7, 1.0))
    assert found["empty cells left out"] > 0
    everywhere = costs(lambda: potto.compile("def f(a) integral ([0, 1], [0, 1]) a*x d(x, y)").f(1.0))
    assert everywhere["empty cells left out"] == 0 and everywhere["cells"] > 0


def test_pixels_that_no_surface_crosses_are_told_apart():
    """Of 128 x 128 pixels the line x + y = 1 crosses the 127 on the diagonal below it and touches corners of others."""
    m = potto.compile("def p(x, y) integral ([x, x + 1/128], [y, y + 1/128]) [u + v >= 1] d(u, v)")
    x, y = np.meshgrid(np.arange(128) / 128, np.arange(128) / 128)
    whole = costs(lambda: m.p(x, y))["members that no surface crosses"]
    assert 128 * 128 - 3 * 128 <= whole <= 128 * 128 - 127


def test_what_is_made_once_is_told_apart() -> None:
    """Of a first call half goes into plans, proofs, kernels, and what is loaded for them; a second one makes nothing.
    Half, of times beside other tests: a third at least."""
    text = "def f(t, a) integral ([0, 1], [0, 1]) [1/(1 + (x + a*y)^2) > t]*[x*x + y*y < a]*sin(x*y + 0.123) d(x, y)"
    f = potto.deriv(potto.compile(text).f)
    first, second = (f((0.7, 1.0), (0.62, 0.0)) for _ in range(2))
    assert first.compile_seconds > first.seconds / 3
    assert second.compile_seconds < 0.1 * first.compile_seconds


def test_a_surface_is_named_in_a_line() -> None:
    long = " + ".join(f"sin({k}*x + 0.{k}*y)/{k}" for k in range(1, 40))
    with potto.counting():
        answer = potto.compile(f"def f(t) integral ([0, 1], [0, 1]) [{long} < t] d(x, y)").f(0.3)
    (surface,) = answer.stats["surfaces"]
    assert len(surface["surface"]) < 150 and "characters" in surface["surface"]


def test_members_that_are_cut_alike_tell_what_they_met() -> None:
    """A line that moves, one that no member meets, and one that nothing moves."""
    text = "def f(c, s) integral ([0, 1], [0, 1]) [x + y + c >= 0]*[x < s]*[y < 2*x + 5]*exp(x) d(x, y)"
    with potto.counting():
        stats = potto.deriv(potto.compile(text).f)((np.linspace(-0.8, -0.2, 90), 1.0), (0.5, 0.0)).stats
    told = {entry["surface"]: entry["why"] for entry in stats["surfaces"]}
    assert sum(why.startswith("it moves") for why in told.values()) == 1
    assert sum(why.startswith("nothing that is differentiated") for why in told.values()) == 1
    # where the line leaves the square beyond x = s there is one lit cell, else a second below its end
    assert stats["cells"] == 45 + 2 * 45 and stats["boundary evaluations"] == 0


def test_surfaces_have_the_names_that_the_program_has() -> None:
    """Of what an integral reads of arrays and records it has numbers alone; each is told by where it was read."""
    m = potto.compile("""
record Camera(eye: (Real, Real), focal: Real)
def first(xs: [n] Real, t) integral [0, 1] [x < xs[0]*t] d(x)
def each(xs: [n] Real, t) integral [0, 1] sum i in 0..n-1 ([x < xs[i]*t]) d(x)
def seen(c: Camera, t) integral [0, 1] [x < c.eye.y]*[x < c.focal*t] d(x)
def nested(xs: [n] Real, t) integral [0, 1] (integral [0, 1] [y < xs[0]*x] d(y))*[x < xs[1]*t] d(x)
def twice(xs: [n] Real, ys: [n] Real, t) first(xs, t) + first(ys, t)
""")
    cases = (
        (m.first, ([0.3, 0.4],), {"x = xs[0]*t"}),
        (m.each, ([0.3, 0.4],), {"x = xs[i]*t"}),
        (m.seen, (((0.1, 0.2), 0.3),), {"x = c.eye.1", "x = c.focal*t"}),
        (m.nested, ([0.3, 0.4],), {"x = xs[1]*t", "y = xs[0]*x"}),
        (m.twice, ([0.3, 0.4], [0.5, 0.6]), {"x = xs[0]*t"}),
    )
    for function, arguments, surfaces in cases:
        with potto.counting():
            stats = function(*arguments, 0.9).stats
        assert {entry["surface"] for entry in stats["surfaces"]} == surfaces
