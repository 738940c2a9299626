"""Kinks just at the parameters: both derivatives are told, in every number of variables and whichever way they lie.

The derivatives backward and forward are worked out by hand; where there is but one, nothing is noted.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import potto

PI, ROOT, ROOT_OF_THIRD = math.pi, 0.6823278038280193, math.sqrt(1 / 3)
HALF = "integral ([-1, 1], [0, 1])"
SQUARE, BOX = "integral ([-1, 1], [-1, 1])", "integral ([-1, 1], [-1, 1], [-1, 1])"
UNIT, CUBE = "integral ([0, 1], [0, 1])", "integral ([0, 1], [0, 1], [0, 1])"
PLANE, SPACE = "integral ([-2, 2], [-2, 2])", "integral ([-2, 2], [-2, 2], [-2, 2])"
DISC, BALL = "[x^2 + y^2 < 1]", "[x^2 + y^2 + z^2 < 1]"

# program, where, the derivatives backward and forward
KINKS = [
    # numbers
    ("abs(t)", 0.0, -1, 1),
    ("3*max(t, 0)", 0.0, 0, 3),
    ("min(t, 1) + t", 1.0, 2, 1),
    ("clamp(t, 0, 1)", 1.0, 1, 0),
    ("max(t, 1/2, 1 - t)", 0.5, -1, 1),
    ("exp(abs(t))", 0.0, -1, 1),
    ("abs(integral [-1, 1] [x < t] d(x) - 1)", 0.0, -1, 1),
    ("max(integral [0, 1] [x < t] d(x), 0.5)", 0.5, 0, 1),
    ("integral [0, 1] delta(x - 0.5)*max(x, t) d(x)", 0.5, 0, 1),
    ("integral [0, 1] abs(x - t)*delta(x - 0.5) d(x)", 0.5, -1, 1),
    # integrands: all along the domain
    ("integral [0, 1] abs(x*t) d(x)", 0.0, -0.5, 0.5),
    ("integral [-1, 1] abs(x*t) d(x)", 0.0, -1, 1),
    ("integral [0, 1] max(x*t, 0) d(x)", 0.0, 0, 0.5),
    ("integral [0, 1] abs(t)*x d(x)", 0.0, -0.5, 0.5),
    ("integral [0, 1] max(clamp(x - 0.7, 0, 1)*t, 0) d(x)", 0.0, 0, 0.045),
    ("integral [0, 1] (integral [0, 1] max(y*t, 0) d(y)) d(x)", 0.0, 0, 0.5),
    ("integral [0, 1] exp(integral [0, 1] max(y*t, 0) d(y)) d(x)", 0.0, 0, 0.5),
    ("integral [0, 1] max(integral [0, 1] [y < t]*x d(y), 0.5*x) d(x)", 0.5, 0, 0.5),
    (f"{UNIT} abs(x*y*t) d(x, y)", 0.0, -0.25, 0.25),
    (f"{UNIT} max(x*t, y*t) d(x, y)", 0.0, 1 / 3, 2 / 3),
    (f"{SQUARE} max(x + t*y, x) d(x, y)", 0.0, -1, 1),
    (f"{SQUARE} max(y + t*x, y) d(x, y)", 0.0, -1, 1),
    (f"{SQUARE} abs(t*x + t*y) d(x, y)", 0.0, -8 / 3, 8 / 3),
    (f"{BOX} max(x + t*y, x) d(x, y, z)", 0.0, -2, 2),
    ("integral (x ~ normal(0, 1)) max(t*x, 0) d(x)", 0.0, -1 / math.sqrt(2 * PI), 1 / math.sqrt(2 * PI)),
    # bounds
    ("integral [0, min(t, 1)] x d(x)", 1.0, 1, 0),
    ("integral [0, abs(t)] exp(x) d(x)", 0.0, -1, 1),
    ("integral [0, max(t, 0)] (integral [0, 1] exp(x*y) d(y)) d(x)", 0.0, 0, 1),
    ("integral [t, 1] [x < 0.5] d(x)", 0.5, -1, 0),
    ("integral ([0, 1], [0, t]) [y < 0.5]*x d(x, y)", 0.5, 0.5, 0),
    ("integral ([0, 1], [0, t*x]) [y < x/2] d(x, y)", 0.5, 0.5, 0),
    ("integral (x ~ uniform(0, 1), y ~ uniform(0, 1)) [y < t] d(x, y)", 1.0, 1, 0),
    # to rounding: 18.5 - 0.1*13.5 is 17.15 and a few doubles
    ("integral [-3, 3] [x + 18.5 - 0.1*(18.5 - 5) < t] d(x)", 20.15, 1, 0),
    ("integral ([0, 1], [-3, 3]) [y + 18.5 - 0.1*(18.5 - 5) + [x < t - 19.9] < t] d(x, y)", 20.15, 0, -0.75),
    # surfaces that coincide, or run along a bound, an axis or another one
    (f"{CUBE} [max(x, y, z) < t] d(x, y, z)", 1.0, 3, 0),
    (f"{UNIT} [x < t*y] d(x, y)", 0.0, 0, 0.5),
    (f"{UNIT} [y < t*x] d(x, y)", 0.0, 0, 0.5),
    (f"{CUBE} [x < t*y] d(x, y, z)", 0.0, 0, 0.5),
    (f"{CUBE} [z < t*y] d(x, y, z)", 0.0, 0, 0.5),
    (f"{SQUARE} [x < 0]*[x < t*y] d(x, y)", 0.0, 0.5, -0.5),
    (f"{SQUARE} [y < 0]*[y < t*x] d(x, y)", 0.0, 0.5, -0.5),
    (f"{SQUARE} [x + y < 0]*[x + y < t*x] d(x, y)", 0.0, 0.5, -0.5),
    (f"{BOX} [abs(x) < t] d(x, y, z)", 0.0, 0, 8),
    (f"{BOX} [abs(z) < t] d(x, y, z)", 0.0, 0, 8),
    (f"{CUBE} [x + y + z < 1]*[x + y + z < t] d(x, y, z)", 1.0, 0.5, 0),
    (f"{UNIT} [sin(3*x) + y < 1]*[sin(3*x) + y < t] d(x, y)", 1.0, 1, 0),
    (f"{PLANE} {DISC}*[(x - t)^2 + y^2 < 1] d(x, y)", 0.0, 2, -2),
    (f"{PLANE} {DISC}*[x^2 + (y - t)^2 < 1] d(x, y)", 0.0, 2, -2),
    (f"{PLANE} {DISC}*[x^2 + t*y^2 < 1] d(x, y)", 1.0, 0, -PI / 2),
    (f"{SPACE} {BALL}*[x^2 + (y - t)^2 + z^2 < 1] d(x, y, z)", 0.0, PI, -PI),
    (f"{SPACE} {BALL}*[x^2 + y^2 + (z - t)^2 < 1] d(x, y, z)", 0.0, PI, -PI),
    # which of two is the faster one changes where nothing is cut: int max(1, 2 y) = 5/4, int min(1, 2 y) = 3/4
    (f"{HALF} [x > t or x > 2*t*y] d(x, y)", 0.0, -1.25, -0.75),
    (f"{HALF} [x > t]*[x > 3*t*y^2] d(x, y)", 0.0, -1 + 2 / 3 * ROOT_OF_THIRD, -1 - 2 / 3 * ROOT_OF_THIRD),
    # conditions, or kinks in them, that are equalities all along
    (f"{HALF} [max(x - t, x - 2*t*y) > 0] d(x, y)", 0.0, -1.25, -0.75),
    ("integral ([0, 1], [-1, 1]) [max(y - t, y - 2*t*x) > 0] d(x, y)", 0.0, -1.25, -0.75),
    (f"{HALF} [x + max(y*t, 2*t) <= 0]*y d(x, y)", 0.0, -1 / 3, -1),
    # the value is another one on one side
    ("integral [0, 1] [x*t <= 0] d(x)", 0.0, 0, -math.inf),
    ("integral [0, 1] [x*t < 0] d(x)", 0.0, -math.inf, 0),
    ("integral [0, 1] [x*t <= 2*t] d(x)", 0.0, math.inf, 0),
    (f"{UNIT} [(x + y^2)*t <= 0]*y d(x, y)", 0.0, 0, -math.inf),
    ("integral [0, 1] exp(integral [0, 1] [x*y*t <= 0]*y d(y)) d(x)", 0.0, 0, -math.inf),
    # and so where parameters alone decide it
    ("if t <= 0.7 then 1 else 2", 0.7, 0, math.inf),
    ("if t < 0.7 or t > 0.9 then t else 3*t", 0.7, math.inf, 3),
    ("if t <= 0.7 then t^2 else 0.49", 0.7, 1.4, 0),
    ("if t == 0 then 2 else sin(t)/t", 0.0, math.inf, -math.inf),
    ("if t == 0 then 1 else (if t > 0 then sin(t)/t else 1 - t)", 0.0, -1, 0),
    ("[t <= 0.7]", 0.7, 0, -math.inf),
    ("2*floor(t) + t", 1.0, math.inf, 1),
    ("sum k in 1..3 ([k*t <= 1.4]*t)", 0.7, 2, -math.inf),
    ("if (integral [0, 1] [x < t] d(x)) <= 0.7 then 1 else 2", 0.7, 0, math.inf),
    ("integral [0, 1] [y <= 0.3]*(if t <= 0.7 then 1 else 2) d(y)", 0.7, 0, math.inf),
    ("integral [0, 1] (if t <= 0.7 then x else x*t/0.7) d(x)", 0.7, 0, 5 / 7),
    ("integral [0, 1] [max(y, t) <= 0.7] d(y)", 0.7, 0, -math.inf),
    ("integral [0, 1] (integral [0, 1] [x + y <= 1]*[t <= 0.7] d(x)) d(y)", 0.7, 0, -math.inf),
    (f"{CUBE} [max(x, y, t) <= 0.7]*z d(x, y, z)", 0.7, 0, -math.inf),
]  # fmt: skip


def rate(program: str, t: Any, dt: Any = 1.0) -> potto.Estimate:
    return potto.deriv(potto.compile(f"def f(t)\n    {program}").f)((t, dt))


GUARD = "(if t == 0 then 1 else (exp(t) - 1)/t)"


@pytest.mark.parametrize(("program", "t", "backward", "forward"), KINKS, ids=[row[0] for row in KINKS])
def test_both_derivatives_are_told(program: str, t: float, backward: float, forward: float) -> None:
    answer = rate(program, t)
    assert answer.notes, answer
    # those beside the parameters are good for 6 digits and more (docs/numerics.md)
    told = [(float(note.backward), float(note.forward)) for note in answer.notes]
    assert any(np.allclose(sides, (backward, forward), rtol=1e-6, atol=1e-6) for sides in told), told
    low, high = sorted((backward, forward))
    assert low - 1e-9 <= answer.tangent <= high + 1e-9  # one of them, or what lies between, as conditions fall


@pytest.mark.parametrize("program", ["integral [-1, 1] [x*t <= 0] d(x)", "integral [-1, 1] [max(x, 0)*t < t^2] d(x)"])
def test_where_the_value_is_another_one_on_both_sides_there_is_no_derivative(program: str) -> None:
    answer = rate(program, 0.0)
    assert not answer.converged and answer.tangent_error == math.inf
    (note,) = answer.notes
    assert np.isinf([note.backward, note.forward]).all() and note.backward != note.forward
    assert "lies all along `x`" in str(note)


@pytest.mark.parametrize("size", [2, 12, 300])
def test_of_a_surface_all_along_the_domain_any_batch_tells(size: int) -> None:
    """1 - 0.3*t + max(t - 1, 0)/2, whose derivatives at t = 1 are -0.3 and 0.2, and t < 1 everywhere else."""
    f = potto.compile("def f(t) integral [0, 1] (if [x - t*x >= 0] then 0 else x*(t - 1)) + [x > 0.3*t] d(x)").f
    t = np.append(np.linspace(0.2, 0.9, size - 1), 1.0)
    answer = potto.grad(f)(t)
    (note,) = answer.notes
    assert np.flatnonzero(np.isfinite(note.backward)).tolist() == [size - 1]
    assert abs(note.backward[-1] + 0.3) <= note.backward_error[-1] + 1e-15
    assert abs(note.forward[-1] - 0.2) <= note.forward_error[-1] + 1e-15
    assert np.all(abs(answer.tangent[:-1] + 0.3) <= answer.tangent_error[:-1] + 1e-15)


@pytest.mark.parametrize("size", [2, 12, 300])
def test_where_the_value_jumps_a_member_of_any_batch_has_no_derivative(size: int) -> None:
    f = potto.compile("def f(t) integral [-1, 1] [x*t <= 0] d(x)").f
    answer = potto.grad(f)(np.append(np.linspace(0.2, 0.9, size - 1), 0.0))
    assert answer.notes
    assert np.flatnonzero(np.isinf(answer.tangent_error)).tolist() == [size - 1]
    assert np.flatnonzero(~answer.member_converged).tolist() == [size - 1]


@pytest.mark.parametrize("program", ["abs(t)", "integral [0, 1] abs(x*t) d(x)", f"{SQUARE} max(x + t*y, x) d(x, y)"])
def test_the_other_way_the_sides_are_turned_round(program: str) -> None:
    there, back = (rate(program, 0.0, dt).notes[0] for dt in (1.0, -1.0))
    assert float(back.backward) == pytest.approx(-float(there.forward), abs=1e-9)
    assert float(back.forward) == pytest.approx(-float(there.backward), abs=1e-9)


@pytest.mark.parametrize(("program", "t", "exact"), [
    ("abs(t - 1)^3", 1.0, 0.0),
    ("abs(t) + abs(t - 1)", 0.3, 0.0),
    ("max(t, 0) - max(0, -t)", 0.0, 1.0),  # max(t, 0) + min(t, 0) = t
    ("max(t, 0) + min(t, 0)", 0.0, 1.0),
    ("integral [0, 1] [x*t <= 0 or x < 2] d(x)", 0.0, 0.0),
    (f"{HALF} ([x > t] + [x > 2*t*y]) d(x, y)", 0.0, -2.0),
    ("abs(0*t) + t", 0.0, 1.0),
    ("if t <= 0.7 then t^2 else 1.4*t - 0.49", 0.7, 1.4),
    ("if t < 0 then 2*t - 1 else 2*[t >= 0] - 3 + 2*t", 0.0, 2.0),
    ("integral [0, 1] (max(x*t, 0) + min(x*t, 0)) d(x)", 0.0, 0.5),
    ("integral [0, 1] abs(x - t) d(x)", 0.25, -0.5),
    (f"{SQUARE} abs(x + y - t)*[x < 0] d(x, y)", 0.0, 1.0),
    # surfaces that are flat both ways: roots r*t, with r^3 + r = 1, and r^3 + y*r = 1
    ("integral [-1, 1] [x^3 + x*t^2 - t^3 > 0] d(x)", 0.0, -ROOT),
    (f"{SQUARE} [x^3 + x*t^2 - t^3 > 0] d(x, y)", 0.0, -2 * ROOT),
    ("integral ([-1, 1], [0, 1]) [x^3 + y*x*t^2 - t^3 > 0] d(x, y)", 0.0, math.log(ROOT) - 2 / 3 * ROOT),
])  # fmt: skip
def test_where_the_whole_has_one_derivative_nothing_is_noted(program: str, t: float, exact: float) -> None:
    answer = rate(program, t)
    assert not answer.notes and answer.converged
    assert abs(answer.tangent - exact) <= answer.tangent_error + 1e-15


@pytest.mark.parametrize(("program", "t", "exact"), [
    ("if t == 0 then 1 else sin(t)/t", 0.0, 0.0),
    ("if t == 0 then 1 else (exp(t) - 1)/t", 0.0, 0.5),
    ("if t == 0 then 1 else log(1 + t)/t", 0.0, -0.5),
    ("if t == 3 then 0.25 else (sqrt(t + 1) - 2)/(t - 3)", 3.0, -1 / 64),
    ("integral [0, 1] (if t == 0 then x else sin(x*t)/t) d(x)", 0.0, 0.0),
    (f"integral [0, 1] {GUARD}*x d(x)", 0.0, 1 / 4),
    (f"integral [0, {GUARD}] x d(x)", 0.0, 1 / 2),
    # int_0^1 [x < g/2] 2 x dx = g^2/4, and the area below x + y = g has the derivative g g' on either side of g = 1
    (f"integral [0, 1] [x < {GUARD}/2]*2*x d(x)", 0.0, 1 / 4),
    (f"let z = {GUARD} in integral [0, 1] [x < z/2]*2*x d(x)", 0.0, 1 / 4),
    (f"integral ([0, 1], [0, 1]) [x + y < {GUARD}] d(x, y)", 0.0, 1 / 2),
])  # fmt: skip
def test_a_guard_at_a_single_point_has_the_derivative_of_what_it_guards(program: str, t: float, exact: float) -> None:
    """Extrapolated from places beside it: nine digits, since what is guarded cancels, by eps/t^2 of its derivative."""
    answer = rate(program, t)
    assert not answer.notes
    assert abs(answer.tangent - exact) <= answer.tangent_error <= 1e-9


def test_a_condition_of_the_parameters_within_a_surface_has_two_sides() -> None:
    """x < z/2 with z = 1 up to t = 0 and 1 + t/2 beyond it: the length is z/2."""
    answer = rate("integral [0, 1] [x < (if t <= 0 then 1 else 1 + t/2)/2] d(x)", 0.0)
    (note,) = answer.notes
    assert (float(note.backward), float(note.forward)) == pytest.approx((0.0, 0.25), abs=1e-9)


def test_members_of_an_array_are_told_apart() -> None:
    for program in ("abs(t)", "integral [0, 1] abs(x*t) d(x)"):
        answer = rate(program, np.array([0.5, 0.0, -0.5]), np.ones(3))
        scale = 1.0 if program == "abs(t)" else 0.5
        assert answer.tangent[[0, 2]] == pytest.approx([scale, -scale], abs=1e-12)
        (note,) = answer.notes
        assert np.isnan(note.backward[[0, 2]]).all()
        assert (note.backward[1], note.forward[1]) == pytest.approx((-scale, scale), abs=1e-6)


def test_a_kink_that_moves_alike_everywhere_in_one_direction_and_not_in_another() -> None:
    """The kink x/2 = s moves with s alone, as fast at every x: int_0^1 max(x/2, s) t dx = t (1/4 + s^2)."""
    f = potto.compile("def f(t, s) integral [0, 1] max(integral [0, 1] y*x d(y), s)*t d(x)").f
    found = potto.grad(f, wrt=["t", "s"])(1.5, 0.2)
    # on [0, 2 s] it is s, beyond x/2: 2 s^2 + (1 - 4 s^2)/4, whose derivative is 2 s
    assert abs(found.value - 1.5 * (0.25 + 0.2**2)) <= found.error + 1e-15
    assert np.abs(np.array(found.tangent) - (0.25 + 0.2**2, 1.5 * 2 * 0.2)).max() <= 1e-12
    assert not found.notes


@pytest.mark.parametrize("method", ["mc", "qmc"])
def test_samples_have_kinks_as_well(method: Any) -> None:
    with potto.settings(method=method, samples=1024):
        answer = rate(f"{UNIT} max(x*t, y*t) d(x, y)", 0.0)
    assert (float(answer.notes[0].backward), float(answer.notes[0].forward)) == pytest.approx((1 / 3, 2 / 3), abs=1e-6)


def test_gradients_tell_kinks_forward_and_in_reverse() -> None:
    f = potto.compile("def f(xs: [n] Real) sum i in 0..n-1 (max(xs[i], 0))").f
    for count in (2, 60):
        xs = np.ones(count)
        xs[1] = 0.0
        assert potto.grad(f)(xs).notes
        assert not potto.grad(f)(xs + 1).notes


def test_the_message_says_where() -> None:
    assert str(rate("abs(t)", 0.0).notes[0]) == (
        "the kink t = 0 is just here: the one-sided derivatives differ (-1 backward, 1 forward)"
    )
    assert str(rate("integral [0, 1] abs(x*t) d(x)", 0.0).notes[0]) == (
        "the kink x*t = 0 lies all along `x`: the one-sided derivatives differ (-0.5 backward, 0.5 forward)"
    )


def test_a_measure_at_a_kink_takes_what_its_density_takes() -> None:
    """`uniform` asks whether its range is one; what is then taken is one integral, whose sides are looked at once."""
    spent = []
    for over in ("(x ~ uniform(-n, n)) [x < t]", "[-n, n] [x < t]*(1/(2*n))", "[-n, n] [x < t]/(2*n)"):
        found = potto.deriv(potto.compile(f"def f(t, n) integral {over} d(x)").f)((1.0, 1.0), (1.0, 0.0))
        (note,) = found.notes
        assert (note.backward, note.forward) == (0.5, 0.0)
        spent.append(found.evals)
    assert spent[0] == spent[1] <= spent[2]  # that 0/(2*n) is 0 is found at nodes


@pytest.mark.parametrize(
    "source", ["integral [0, inf] exp(-x)*[x > t] d(x)", "integral (x ~ normal(0, 1)) [x < t] d(x)"]
)
def test_no_surface_lies_along_an_infinite_bound(source: str) -> None:
    """Where it was taken to, all was integrated again beside the parameters: two to five times the work of sampling."""
    f = potto.deriv(potto.compile(f"def f(t) {source}").f)
    with potto.settings(method="mc", samples=10_000):
        assert f((0.6, 1.0)).evals <= 1.05 * 10_000


@pytest.mark.parametrize("surface", [
    "x - x", "x*t - t*x", "(x + 1)^2 - x^2 - 2*x - 1", "sin(x)^2 + cos(x)^2 - 1", "max(x, 2*x) - 2*x",
])  # fmt: skip
def test_a_surface_that_does_not_vary_lies_all_along(surface: str) -> None:
    """The integral is that of [0 < t], however its surface is written: 0 below t = 0 and 1 above."""
    program = f"integral [0, 1] [{surface} < t] d(x)"
    (note,) = rate(program, 0.0).notes
    assert note.along and (note.backward, note.forward) == (0.0, math.inf)
    f = potto.compile(f"def f(t) {program}\n").f
    assert (f(-0.5).value, f(0.5).value) == (0.0, 1.0)
    assert abs(potto.hessian(f)(0.5).value) <= 1e-15


JUMPS = potto.compile("""
def i(t) integral [0, 1] [z*(t - 1) > 0] d(z)
def ramp(t) (t - 1)*i(t)
def beside(t) (t - 1)*i(t) + t^2
def scaled(t) cos(t)*i(t)
def spike(t) i(t) + i(2 - t)
def flat(t) (t - 1)^2*i(t)
def body(t) integral ([0, 1], [0, 1], [0, 1]) (if [z*(1 - t) >= 0] then 0 else x*(t - 1)) d(x, y, z)
""")


@pytest.mark.parametrize(
    ("name", "sides"),
    [
        ("ramp", (0, 1)),
        ("beside", (2, 3)),
        ("scaled", (0, math.inf)),  # cos(1) beyond, 0 at the place
        ("spike", (-math.inf, math.inf)),  # 1 on both sides, 0 at the place
        ("body", (0, 0.5)),
    ],
)
def test_what_is_made_of_an_integral_that_jumps_has_the_derivatives_of_both_sides(
    name: str, sides: tuple[float, float]
) -> None:
    """As a part of a sum or product, and where an integral is taken apart into a product; alone and in a batch. The
    jump of the part is one of its value: what it is at the place leads to no derivative beside it."""
    function = potto.deriv(getattr(JUMPS, name))
    (note,) = function((1.0, 1.0)).notes
    assert (note.backward, note.forward) == pytest.approx(sides, rel=1e-12, abs=1e-12)
    (note,) = function((np.array([1.0, 0.5, 1.0]), 1.0)).notes
    assert note.backward[[0, 2]] == pytest.approx(sides[:1] * 2, rel=1e-12, abs=1e-12)
    assert note.forward[[0, 2]] == pytest.approx(sides[1:] * 2, rel=1e-12, abs=1e-12)


def test_a_jump_that_is_multiplied_away_leaves_one_derivative() -> None:
    found = potto.deriv(JUMPS.flat)((1.0, 1.0))
    assert found.converged and not found.notes
    assert found.tangent == pytest.approx(0, abs=1e-15)


@pytest.mark.parametrize(
    ("program", "slope"),
    [
        ("t*integral [-1, 1] [x^2 < t] d(x)", 0.0),  # 2 t^1.5
        ("(3 + t)*t + exp(t)*sin(t)*integral [-1, 1] cos(x)*[x^2 < t] d(x)", 3.0),
        ("t + t*integral [-1, 1] [x^2 < t] d(x) + t*integral [-1, 1] [x^4 < t] d(x)", 1.0),  # 2 t^1.5 + 2 t^1.25 + t
    ],
)
def test_beside_a_fold_derivatives_go_like_roots_of_the_step(program: str, slope: float) -> None:
    """The nearest steps alone leave as much as the root of a step, 1e-4."""
    found = potto.grad(potto.compile(f"def f(t) {program}").f, "t")(0.0)
    assert abs(found.tangent - slope) <= found.tangent_error <= 1e-10
    assert found.converged and not found.notes


def test_beside_a_fold_of_many_roots_the_derivative_is_not_told_better_than_it_is_known() -> None:
    """2 t^(7/6): nothing is smooth in the fourth root of a step."""
    found = potto.grad(potto.compile("def f(t) t*integral [-1, 1] [x^6 < t] d(x)").f, "t")(0.0)
    assert abs(found.tangent) <= found.tangent_error
    assert not found.notes
