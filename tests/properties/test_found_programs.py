"""Programs that random testing found wrong, made small. Expected values are closed forms, worked out beside each."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import mpmath as mp
import numpy as np
import pytest

import potto
from potto.diagnostics import PottoError

T = 0.65
CURRIED = "def call(h, v) h(v)\ncurried = \\a . \\b . [a < b]*(a + 2)\n"
STEP = "def step(u) [u > 0]\n"
BELOW = "def step(u, w) [u > 0]*w\n"


@pytest.mark.parametrize(
    ("program", "value", "tangent"),
    [
        # A jump under an inner integral that does not vary with it: int_0^t e^(2x) dx + (2 - t).
        (
            "def f(t) integral [0, 2] exp(integral [-1, 1] [x < t]*x d(y)) d(x)",
            (math.exp(2 * T) - 1) / 2 + 2 - T,
            math.exp(2 * T) - 1,
        ),
        # The same inside of a call: int_t^1 (1/2)^2 dx.
        (STEP + "def f(t) integral [0, 1] (integral [0, 1] step(x - t)*y d(y))^2 d(x)", (1 - T) / 4, -0.25),
        # In a call some of whose arguments vary with it: int_t^1 (x/2)^2 dx.
        (
            BELOW + "def f(t) integral [0, 1] (integral [0, 1] step(x - t, x*y) d(y))^2 d(x)",
            (1 - T**3) / 12,
            -(T**2) / 4,
        ),
        # In a function that is passed: the same number.
        (
            "def g(h, x) integral [0, 1] h(x)*y d(y)\ndef f(t) integral [0, 1] (g(\\a . [a > t]*a, x))^2 d(x)",
            (1 - T**3) / 12,
            -(T**2) / 4,
        ),
        # A surface that runs along both variables by turns, in a function that is passed: (t + 2)(t + 1).
        (
            "def g(h) integral ([-2, 2], [-1, 1]) h(x, y) d(x, y)\ndef f(t) g(\\(x, y) . [max(x, y) < t])",
            (T + 2) * (T + 1),
            2 * T + 3,
        ),
        # In a sum: (n/2)^2 for n = 3, 2, 1 on [0, t/3], [t/3, t/2], [t/2, t].
        (
            "def f(t) integral [0, 1] (integral [0, 1] (sum k in 1..3 ([x < t/k]*y)) d(y))^2 d(x)",
            T * (9 / 3 + 4 * (1 / 2 - 1 / 3) + (1 - 1 / 2)) / 4,
            (9 / 3 + 4 * (1 / 2 - 1 / 3) + (1 - 1 / 2)) / 4,
        ),
        # A bound that jumps: 2 for x < t and 1/2 above; and the same squared.
        ("def f(t) integral ([0, 1], [0, 1 + [x < t]]) y d(x, y)", 2 * T + (1 - T) / 2, 1.5),
        ("def f(t) integral [0, 1] (integral [0, 1 + [x < t]] y d(y))^2 d(x)", 4 * T + (1 - T) / 4, 3.75),
        # A function that was given its first group: (t + 2)(2 - t).
        (CURRIED + "def f(t) integral [0, 2] call(curried (t), x) d(x)", 4 - T * T, -2 * T),
        (CURRIED + "def f(t) integral ([0, 2], [0, 1]) call(curried (t), x) d(x, y)", 4 - T * T, -2 * T),
        # Kinks made of jumps: 1 below t, x - 0.3 above.
        ("def f(t) integral [0, 1] max([x < t], x - 0.3) d(x)", T + (0.49 - (T - 0.3) ** 2) / 2, 1.3 - T),
        (STEP + "def f(t) integral [0, 1] max(step(t - x), x - 0.3) d(x)", T + (0.49 - (T - 0.3) ** 2) / 2, 1.3 - T),
        # A kink of an inner integral that has a condition: max(x/2, 0.3) on [0, t].
        ("def f(t) integral [0, t] max(integral [0, 2] [y < x]*0.5 d(y), 0.3) d(x)", 0.18 + (T * T - 0.36) / 4, T / 2),
        # Surfaces that run along an axis in one part and along another in the next.
        ("def f(t) integral ([0, 1], [0, 1]) [max(x, y) < t] d(x, y)", T * T, 2 * T),
        ("def f(t) integral ([0, 1], [0, 1]) [min(x, y) < t] d(x, y)", 1 - (1 - T) ** 2, 2 * (1 - T)),
        ("def f(t) integral ([-1, 1], [-1, x]) [max(abs(x), abs(y)) < t] d(x, y)", 2 * T * T, 4 * T),
        # Surfaces that are 0 on a stretch: strictness decides.
        ("def f(t) integral [-1, 1] [max(x - t, 0) > 0] d(x)", 1 - T, -1.0),
        ("def f(t) integral [-1, 1] [max(x - t, 0) <= 0] d(x)", 1 + T, 1.0),
        ("def f(t) integral [-1, 1] [clamp(x - t, 0, 1) > 0]*x d(x)", (1 - T * T) / 2, -T),
        (STEP + "def f(t) integral [-1, 1] step(max(x - t, 0)) d(x)", 1 - T, -1.0),
        ("def step(u) [0 >= u]\ndef f(t) integral [-1, 1] step(max(x - t, 0)) d(x)", 1 + T, 1.0),
    ],
)
def test_a_program_that_was_wrong(program: str, value: float, tangent: float) -> None:
    answer = potto.deriv(potto.compile(program).f)((T, 1.0))
    assert answer.converged, answer.reasons
    # Closed forms of a few operations: good to a few roundings of numbers around 1.
    assert abs(answer.value - value) <= answer.error + 1e-14 and answer.error < 1e-10
    assert abs(answer.tangent - tangent) <= answer.tangent_error + 1e-14 and answer.tangent_error < 1e-10


def test_a_condition_on_an_integral_whose_surface_moves_is_refused() -> None:
    with pytest.raises(PottoError) as caught:
        potto.compile("def f(t) integral [-1, 1] [(integral [0, 1] [y < 2*x + t] d(y)) < t] d(x)")
    assert caught.value.diagnostics[0].code == "P0402"


def test_a_recursion_over_an_inner_variable_is_integrated_at_once() -> None:
    """What ends the recursion is the same at all nodes, so they are one batch, whatever else the recursion is given."""
    f = potto.compile("""
def g(n, x, t) if n <= 0 then 1 else n*[x < n/3]*g(n - 1, x, t) + t
def f(n, t) integral [0, 1] (integral [0, 1] g(n, x, t)*[y < t*x] d(y))^2 d(x)
""").f
    low, middle, high = 1.0, 0.0, 0.0  # g(4, x, t) for x below 1/3, below 2/3 and above
    for n in range(1, 5):
        low = n * low + T
        middle = n * middle + T if n > 1 else T
        high = n * high + T if n > 2 else T
    expected = T**2 / 3 * (low**2 / 27 + middle**2 * 7 / 27 + high**2 * 19 / 27)
    answer = f(4, T)
    assert answer.value == pytest.approx(expected, rel=1e-13)
    assert answer.error >= abs(answer.value - expected)
    assert answer.stats["integrals"] < 20


def test_recursions_of_different_depth_in_one_batch() -> None:
    f = potto.compile("""
def power(n, x) if n <= 0 then 1 else x*power(n - 1, x)
def f(n, t) integral [0, t] power(n, x)*[x < t/2] d(x)
""").f
    n, t = np.array([0.0, 1, 2, 3, 2]), np.array([0.5, 1, 1.5, 2, 0.25])
    assert f(n, t).value == pytest.approx((t / 2) ** (n + 1) / (n + 1), rel=1e-13)


def test_ranges_that_grow_with_a_variable_drawn_end_where_its_density_leaves_nothing() -> None:
    """int_0^inf e^(-y/2) [sin 4y < t] dy: 2 less the stretches from asin(t)/4 to (pi - asin(t))/4, again each pi/2.
    What lies beyond y = 300 is e^-150, and the roots there were looked for up to where doubles end."""
    t = 0.3
    a, repeated = math.asin(t) / 4, 1 - math.exp(-math.pi / 4)
    low, high = math.exp(-a / 2), math.exp(-(math.pi / 4 - a) / 2)
    text = "def f(t) integral (x ~ exponential(0.5)) (integral [0, x] [sin(4*y) < t] d(y)) d(x)"
    answer = potto.deriv(potto.compile(text).f)((t, 1.0))
    assert answer.value == pytest.approx(2 - 2 * (low - high) / repeated, abs=answer.error)
    slope = (low + high) / (4 * math.sqrt(1 - t * t)) / repeated
    assert answer.tangent == pytest.approx(slope, abs=answer.tangent_error)
    assert answer.error < 1e-10 and answer.tangent_error < 1e-9 and answer.evals < 20_000_000


def test_an_edge_along_a_side_of_the_box_up_to_rounding_leaves_no_infinite_area() -> None:
    """A triangle that has a sliver of some 1e-24 in common with the box: lengths that are rounding do not grow."""
    f = potto.compile("""
def edge(ax, ay, bx, by, x, y) (bx - ax)*(y - ay) - (by - ay)*(x - ax)
def f(ax, ay, bx, by, cx, cy, u, v, h) integral ([u, u + h], [v, v + h])
    [edge(ax, ay, bx, by, x, y) >= 0 and edge(bx, by, cx, cy, x, y) >= 0 and edge(cx, cy, ax, ay, x, y) >= 0] d(x, y)
""").f
    corners = (0.140625001, 0.781250000000001, 0.140625, 0.21875, 0.671875000000001, 0.750000001)
    answer = f(*corners, 0.140625, 0.78125, 1 / 64)
    assert 0 <= answer.value < 1e-22
    assert answer.error < 1e-22


def test_a_density_around_another_variable_in_another_order_of_the_variables() -> None:
    """The hints where y is concentrated depend on x, which comes to be innermost: it crashed. Given x, what is left is
    a logistic distribution's cdf; in x the places are roots of gamma(2 + sin x) = 2 (x - s) and of that with x + 3."""
    s = 0.3

    def gap(shift: float) -> Callable[[Any], Any]:
        return lambda x: mp.gamma(2 + mp.sin(x)) - 2 * (x + shift - s)

    def integrand(x: Any) -> Any:
        above = 1 / (1 + mp.exp((mp.mpf("0.25") - x) / 3 - x))
        return (above * (gap(3)(x) > 0) + (1 - above) * (gap(0)(x) > 0)) * mp.npdf(x)

    # each falls where it is 0, so that there is one root
    roots = [mp.findroot(gap(shift), (near - 1, near + 1), solver="anderson") for shift, near in ((3, -2.2), (0, 1.2))]
    exact = mp.quad(integrand, [-12, -5, *roots, 5])
    f = potto.compile(r"""def f(s) integral (x ~ normal(0, 1)) (integral (y ~ logistic(x, 1))
        [2*(x + 3*[3*y + x >= 0.25] - s) < gamma(2 + sin(x))] d(y)) d(x)""").f
    assert abs(f(s).value - exact) <= f(s).error < 1e-9


def test_samples_of_a_surface_across_a_variable_whose_range_follows_another() -> None:
    """The place along z where sections leave the range of x depends on y, which is not placed before x: it crashed.
    Below the plane x + y + z < t lies t^3/6 of the pyramid x + y < 1, z < 1, for t < 1."""
    text = "def f(t) integral [0, 1] (integral [0, 1 - x] (integral [0, 1] [x + y + z < t] d(z)) d(y)) d(x)"
    with potto.settings(method="mc", samples=4000, seed=1):
        answer = potto.deriv(potto.compile(text).f)((0.7, 1.0))
    assert abs(answer.value - 0.7**3 / 6) <= answer.error
    assert abs(answer.tangent - 0.7**2 / 2) <= answer.tangent_error


def test_a_section_at_infinity_beside_one_beyond_the_bounds() -> None:
    """The place y = 0.7/s is anywhere at s = 0: it was integrated up to y = 0.8, far beyond the upper bound."""
    f = potto.compile("def f(s, v) integral [v, v + 1/8] 1 + [y > 0.8]*[y*s < 0.7] d(y)").f
    g = potto.compile("def g(s, v) integral ([v, v + 1/8], [0, 1]) 1 + [y > 0.8]*[y*s < 0.7]*x d(y, x)").g
    for h in (f, g):
        for answer in (h(0.0, 0.125), h(np.zeros(300), np.full(300, 0.125))):
            assert (np.abs(answer.value - 1 / 8) <= answer.error).all()


def test_a_bound_that_moves_under_an_infinite_range() -> None:
    """Cuts of an infinite range were put on its bounds where derivatives to either side were looked at. Over y in
    [0, x + s] the integrand is 1 below y = s, unless 0.7 x is above s, and e^sin(1) elsewhere."""
    s = 1.0197915289425734
    f = potto.compile(
        """def f(s) integral ([-inf, inf], [0, x + s]) exp(sin([s <= max(y, 0.7*x)]) - (x - 0.9)^2) d(x, y)"""
    ).f
    e = mp.exp(mp.sin(1))

    def weighed(rate: Callable[[Any], Any], *ends: Any) -> Any:
        return mp.quad(lambda x: rate(x) * mp.exp(-((x - mp.mpf(0.9)) ** 2)), ends)

    # 1 for the bound below x = 0, then one for the step and e for the bound, then e; at x = s/0.7 s more of the step.
    edge = mp.mpf(s) / mp.mpf("0.7")
    exact = weighed(lambda x: 1, -8, -s, 0) + weighed(lambda x: 1, 0, edge) + weighed(lambda x: e, edge, 4, 10)
    exact -= (e - 1) * s / mp.mpf("0.7") * mp.exp(-((edge - mp.mpf(0.9)) ** 2))
    answer = potto.deriv(f)((s, 1.0))
    assert abs(answer.tangent - exact) <= answer.tangent_error < 1e-9


@pytest.mark.parametrize("backend", ["numpy", "native"])
@pytest.mark.parametrize("plain", ["0.3*t", "0.3*t*y/0.95"])
def test_what_is_small_beside_what_is_plain_falls_no_faster(plain: str, backend: Any) -> None:
    """Of a box that nothing cuts: d/dt is 0.3*h^2 and, from the bell's edge, h*(b(0.9 - t) - b(0.9 + h - t))."""
    f = potto.compile(f"""
def f(t, u, v) integral ([u, u + 0.1], [v, v + 0.1]) {plain} + exp(-(y - t)^2*40) d(x, y)
""").f
    u, v, t, h = np.zeros(100), np.full(100, 0.9), 0.309, 0.1
    with potto.settings(backend=backend, rtol=1e-6):
        answer = potto.grad(f, ["t"])(t, u, v)
    exact = 0.3 * h * h + h * (math.exp(-40 * (0.9 - t) ** 2) - math.exp(-40 * (0.9 + h - t) ** 2))
    assert (np.abs(answer.tangent - exact) <= answer.tangent_error + 1e-17).all()


def test_roots_that_merge_in_one_of_many_steps() -> None:
    """The surface of a step has its own number there: it crashed. (1 - s)*2*(s + e^(-2s)/2), since e^y > y + 1."""
    f = potto.compile("""
def f(t, s) integral ([s, 1], y ~ exponential(2), [-1, 1]) max(y, s)*[exp(y*t) - y - 1 > 0] d(z, y, x)
""").f
    s = 1 + 1e-9
    with potto.settings(rtol=1e-4, max_evals=200_000):
        answer = potto.grad(f, ["t", "s"])(1.0, s)
    assert abs(answer.value - (1 - s) * (2 * s + math.exp(-2 * s))) <= answer.error


def test_what_says_that_a_measure_is_none_is_not_evaluated_where_it_is_one() -> None:
    """It was refused. With a chance p(x) = 1/(x^2 + 5/4) of 1: 1 + (e - 1)p, and half of it above 0.3."""
    f = potto.compile("""def f(t) integral [-0.5, 1.5]
        (integral (y ~ bernoulli(1/(x^2 + 1.25))) exp(y)/(1 + [x + 0.25*[x >= t] >= 0.3]) d(y)) d(x)""").f

    def sums(a: float, b: float) -> float:
        r = math.sqrt(1.25)
        return b - a + (math.e - 1) * (math.atan(b / r) - math.atan(a / r)) / r

    answer = f(0.4)
    assert abs(answer.value - (sums(-0.5, 0.3) + sums(0.3, 1.5) / 2)) <= answer.error < 1e-9


def test_members_with_several_plans_all_of_which_are_0() -> None:
    """How many numbers the integrand is was asked of one plan for all: it crashed. Below s = -1 nothing is inside."""
    f = potto.compile("""def f(t, s)
        integral [0, cosh(1) + sinh(sin(s))] [x + 1.83*[max(x, 0.7*s) < s] <= s]*[max(x, 0.7*t) - t < 0.2] d(x)""").f
    answer = potto.deriv(f)((np.array([0.375, -1.0, -1.0]), np.ones(3)), (np.array([-1.0, -1.0, -0.8]), np.ones(3)))
    assert not answer.value.any() and not answer.tangent.any()


def test_a_surface_folds_under_a_variable_that_is_eliminated() -> None:
    """It crashed, where evaluations are so few that variables go one by one. 0.7 S(1), with S(t) = 2 sinh(t)/t; below
    t = 1 the stretch t < y < 1 comes in."""
    f = potto.compile("""def f(t) integral ([0, 1], [-1, 1], z ~ exponential(2))
        [x + [y > t] >= 0.3*t]*exp(-y*t) d(x, y, z)""").f
    with potto.settings(max_evals=20_000):
        answer = potto.deriv(f)((1.0, 1.0))
    above = -0.6 * math.sinh(1) + 1.4 * (math.cosh(1) - math.sinh(1))
    assert abs(answer.value - 1.4 * math.sinh(1)) <= answer.error <= 1e-3
    sides = above, above - 0.3 / math.e
    assert min(abs(answer.tangent - side) for side in sides) <= answer.tangent_error <= 1e-3


def test_sides_that_few_evaluations_leave_unknown_do_not_replace_what_is_known() -> None:
    """Two surfaces are one at t = 0 and move apart: at speeds 1/3 and 1, so that 2/3 - 1 of the weight of x is swept.
    Its second digit was wrong, with a bar of 3e-12."""
    f = potto.compile("""def f(t) integral ([-2, inf], [-1, 1], [0, 1])
        (2*[z^3 + y^3 >= t*z*y] - [z + y <= t])*exp(-x^2) d(x, y, z)""").f
    with potto.settings(max_evals=100_000):
        answer = potto.deriv(f)((0.0, 1.0))
    weight = math.sqrt(math.pi) / 2 * (1 + math.erf(2))
    assert abs(answer.value - 2.5 * weight) <= answer.error
    assert abs(answer.tangent + weight / 3) <= answer.tangent_error <= 1e-9


@pytest.mark.parametrize(
    ("summands", "below", "second"),
    [
        # Roots t and sqrt(t): no one formula, so that nan was part of the second derivative.
        ("sum i in 1..2 ([x^i < t])", T + math.sqrt(T), -(T**-1.5) / 4),
        # A summand whose surface is an element that does not vary: a delta outside of integrals.
        ("sum i in 0..1 ([[x^2, t][i] < t])", math.sqrt(T), -(T**-1.5) / 4),
        # The same with a plain conditional for an array: at the root of the one the other seemed to jump as well.
        ("sum i in 0..1 ([(if i < 1 then x^2 else t) < t])", math.sqrt(T), -(T**-1.5) / 4),
    ],
)
def test_summands_whose_index_tells_the_kind_of_their_surface(summands: str, below: float, second: float) -> None:
    f = potto.compile(f"def f(t) integral [0, 1] {summands} d(x)").f
    assert abs(f(T).value - below) <= f(T).error + 1e-15
    answer = potto.hessian(f)(T)
    assert answer.converged and abs(answer.value - second) <= answer.error + 1e-15 < 1e-12


def test_a_tail_whose_first_nodes_have_no_number() -> None:
    """The derivatives of 1/exp are 0/0 far out. What was added up stayed nan when that piece had been replaced, and all
    others were halved until the budget was spent. Of a logistic curve around the mean it is 1/2 for every t."""
    f = potto.compile("def f(t) integral (x ~ normal(t, 0.7)) 1/(1 + 1/exp(3*(x - t))) d(x)").f
    answer = potto.hessian(f)(0.923)
    assert answer.converged and abs(answer.value) <= answer.error < 1e-12
    assert answer.evals < 100_000


def test_a_difference_of_distances_runs_along_the_axes() -> None:
    """|x + y - 1| - |x - y| is 2y - 1, 2x - 1, 1 - 2y or 1 - 2x in the four quarters of the square, and below u in
    (2 - (1 - u)^2)/8 of each."""
    u = 0.3 * T
    f = potto.compile("def f(t) integral ([0, 1], [0, 1]) [abs(x + y - 1) - abs(x - y) < 0.3*t] d(x, y)").f
    answer = potto.deriv(f)((T, 1.0))
    assert abs(answer.value - (2 - (1 - u) ** 2) / 2) <= answer.error < 1e-13
    assert abs(answer.tangent - 0.3 * (1 - u)) <= answer.tangent_error < 1e-13
    assert answer.evals < 1000  # 277,000 where it was searched for
    bend = potto.hessian(f)(T)
    assert abs(bend.value + 0.09) <= bend.error + 1e-16 < 1e-13
