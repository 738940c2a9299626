"""Parameters at which a derivative has two sides, or none: folds, surfaces along axes and along bounds.

Answers by hand: lengths and areas as functions of t on both sides of where they are asked for.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from mpmath import mp

import potto
from potto.integrate.pieces import Sums
from potto.kernels.cells import Value
from potto.runtime.integration.problem import Problem

INF = math.inf


def rate(body: str, t: float = 0.0, by: float = 1.0) -> Any:
    return potto.deriv(potto.compile(f"def f(t)\n    {body}").f)((t, by))


FOLDS = [  # what is integrated, where, backward, forward
    ("integral [-1, 1] [x^2 < t] d(x)", 0.0, 0.0, INF),  # 2 sqrt(t)
    ("integral [-1, 1] [x^2 > t] d(x)", 0.0, 0.0, -INF),
    ("integral [0, 1] [x^2 < t] d(x)", 0.0, 0.0, INF),  # and it lies on the bound
    ("integral [0, 1] [(x - 1/2)^2 < t]*exp(x) d(x)", 0.0, 0.0, INF),
    ("integral [-1, 1] [x^2 < t^2] d(x)", 0.0, -2.0, 2.0),  # 2 |t|
    ("integral [-1, 1] [abs(x) < t] d(x)", 0.0, 0.0, 2.0),
    ("integral [-1, 1] [x^2 + t*x < t^2] d(x)", 0.0, -math.sqrt(5), math.sqrt(5)),  # roots t*(-1 +- sqrt(5))/2
    ("integral [-1, 1] [x <= t and x^2 + t*x <= t^2] d(x)", 0.0, 0.0, math.sqrt(5)),
    ("integral [-1, 1] [x^4 < t] d(x)", 0.0, 0.0, INF),
    ("integral [-1, 1] [x^3 < t] d(x)", 0.0, INF, INF),
    ("integral [0, 3] [sin(x) > t] d(x)", 1.0, -INF, 0.0),  # pi - 2 asin(t)
    ("integral ([-1, 1], [-1, 1]) [x^2 + y^2 < t] d(x, y)", 0.0, 0.0, math.pi),  # pi t
    ("integral ([-1, 1], [-1, 1]) [x^2 + y^2 > t]*exp(x) d(x, y)", 0.0, 0.0, -math.pi),
    (
        "integral ([-1, 1], [-1, 1]) [(x - 1/4)^2 + y^2 > t - 1/2] d(x, y)",
        0.5,
        0.0,
        -math.pi,
    ),
    ("integral ([-1, 1], [-1, 1]) [2*(x - 1/4)^2 + (y - 0.7)^2 > t - 1/2]*t d(x, y)", 0.5, 4.0, 4 - math.pi / 8**0.5),
    ("integral ([-1e-150, 1e-150], [-1, 1]) [1e300*x^2 + y^2 < t] d(x, y)", 0.0, 0.0, math.pi * 1e-150),
    ("integral ([0, 1], [-1, 1], [-1, 1]) [x^2 + z^2 < t]*y d(y, x, z)", 0.0, 0.0, math.pi / 2),
    ("integral ([0, 1], [-1, 1]) [x^2 < t]*y d(y, x)", 0.0, 0.0, INF),
    # strips along a curve, as wide as t: 2 t times its length in the measure |dx|
    ("integral ([0, 1], [0, 1]) [abs(x - y) < t] d(x, y)", 0.0, 0.0, 2.0),
    ("integral ([0, 1], [0, 1]) [abs(x - y) > t]*exp(x + y) d(x, y)", 0.0, 0.0, 1 - math.e**2),
    ("integral ([0, 1], [0, 1]) [(x - y)^2 < t^2] d(x, y)", 0.0, -2.0, 2.0),
    ("integral ([0, 1], [0, 1]) [(x - y)^2 < t] d(x, y)", 0.0, 0.0, INF),
    ("integral ([0, 1], [0, 1]) [max(x - y, y - x) < t] d(x, y)", 0.0, 0.0, 2.0),
    ("integral ([0, 1], [0, 1]) [x - y < t and y - x < t] d(x, y)", 0.0, 0.0, 2.0),
    ("integral ([0, 1], [0, 1]) ([x - y < t]*[y - x < t]) d(x, y)", 0.0, 0.0, 2.0),
    ("integral [0, 1] (integral [0, 1] [abs(x - y) < t] d(y)) d(x)", 0.0, 0.0, 2.0),
    ("integral ([0, 1], [0, 1], [0, 1]) [abs(x - y) < t] d(x, y, z)", 0.0, 0.0, 2.0),
    ("integral ([-1, 1], [-1, 1]) [abs(x*x + y*y - 0.25) < t] d(x, y)", 0.0, 0.0, 2 * math.pi),
    # a kink at the root
    ("integral [-1, 1] [max(x, -x) < t] d(x)", 0.0, 0.0, 2.0),
    ("integral [-1, 1] [max(x, 2*x) < t] d(x)", 0.0, 1.0, 0.5),
    ("integral [-1, 1] [x + abs(x)/2 < t] d(x)", 0.0, 2.0, 2 / 3),
    ("integral [-1, 1] [clamp(x, 0, 1/2) + x < t] d(x)", 0.0, 1.0, 0.5),
    # reversed bounds turn the signs round
    ("integral [1, -1] [abs(x) < t] d(x)", 0.0, 0.0, -2.0),
    ("integral [1, -1] [x^2 < t^2] d(x)", 0.0, 2.0, -2.0),
    ("integral [1, -1] [max(x, -x) < t] d(x)", 0.0, 0.0, -2.0),
    ("integral ([1, 0], [0, 1]) [abs(x - y) < t] d(x, y)", 0.0, 0.0, -2.0),
    ("integral ([0, 1], [1, 0]) [abs(x - y) < t] d(x, y)", 0.0, 0.0, -2.0),
]


@pytest.mark.parametrize(("body", "t", "backward", "forward"), FOLDS, ids=[row[0] for row in FOLDS])
def test_sections_that_appear_have_two_sides(body: str, t: float, backward: float, forward: float) -> None:
    answer = rate(body, t)
    note = answer.notes[0]
    assert ("folds along" in str(note)) == note.fold != (note.other is not None)
    sides = (note.backward, note.backward_error, backward), (note.forward, note.forward_error, forward)
    for found, off, exact in sides:
        assert float(found) == pytest.approx(exact, rel=1e-6, abs=0)
        assert found == exact or abs(found - exact) <= off + 1e-15 * abs(exact)


def test_the_other_direction_turns_the_sides_round() -> None:
    (note,) = rate("integral [-1, 1] [x^2 < t] d(x)", by=-1.0).notes
    assert (float(note.backward), float(note.forward)) == (-INF, 0.0)


SMOOTH = [  # roots at one place, and a derivative all the same
    ("integral ([-1, 1], [0, 1]) [y > x^2 + t] d(x, y)", 0.0, -2.0),
    ("integral ([-1, 1], [-1, 1]) [x^2 + y^2 < t^2] d(x, y)", 0.0, 0.0),  # pi t^2
    ("integral ([-1, 1], [-1, 1], [-1, 1]) [x^2 + y^2 + z^2 < t] d(x, y, z)", 0.0, 0.0),  # t^1.5
    ("integral ([-1, 1], [-1, 1]) [abs(x) + abs(y) < t] d(x, y)", 0.0, 0.0),  # 2 t^2
    ("integral ([0, 1], [0, 1]) [x + y < t] d(x, y)", 0.0, 0.0),
]


@pytest.mark.parametrize(("body", "t", "exact"), SMOOTH, ids=[row[0] for row in SMOOTH])
def test_where_both_sides_agree_there_is_a_derivative(body: str, t: float, exact: float) -> None:
    answer = rate(body, t)
    assert not answer.notes
    assert abs(answer.tangent - exact) <= answer.tangent_error <= 1e-9


def test_members_of_a_batch_have_sides_of_their_own() -> None:
    f = potto.compile("def f(t)\n    integral [-1, 1] [x^2 < t]*exp(x) d(x)").f
    answer = potto.deriv(f)((np.array([-0.1, 0.0, 0.1]), np.ones(3)))
    exact = np.cosh(math.sqrt(0.1)) / math.sqrt(0.1)
    assert answer.tangent[0] == 0.0 and abs(answer.tangent[2] - exact) <= answer.tangent_error[2] <= 1e-9
    assert len(answer.notes) == 1


def test_only_members_that_meet_something_are_looked_at_on_both_sides() -> None:
    """Twice what two integrals come to, 2*t*(1 + exp(t) - 1) within 0 < t < 1; the others are evaluated once."""
    f = potto.compile("def f(t) 2*(integral [0, 1] [x < t] d(x))*(integral [0, 1] [x < t]*exp(x) d(x) + 1)").f
    t = np.linspace(0.0, 1.0, 201)[1:-1]
    plain, met = (potto.deriv(f)((at, np.ones_like(at))) for at in (t, np.append(t, 0.0)))
    assert met.evals < plain.evals + 100  # 6,400 more where all are
    assert np.array_equal(met.tangent[:-1], plain.tangent)
    assert met.tangent[:-1] == pytest.approx(2 * np.exp(t) * (1 + t), rel=1e-11)  # what is asked for is 1e-10
    (note,) = met.notes
    assert np.isnan(note.backward[..., :-1]).all() and np.isnan(note.forward[..., :-1]).all()
    assert (note.backward[..., -1], note.forward[..., -1]) == (0.0, pytest.approx(2.0, rel=1e-11))


def test_a_surface_that_turns_off_a_bound() -> None:
    """t*y > x takes the triangle t/2 away for t > 0, and nothing for t < 0; at 0 it runs along the whole bound."""
    (note,) = rate("integral ([0, 1], [0, 1]) [x - t*y > 0] d(x, y)").notes
    assert (float(note.backward), float(note.forward)) == (0.0, pytest.approx(-0.5, rel=1e-12, abs=0))


TURNED = "[abs(x*cos(t) + y*sin(t)) < a]*[abs(y*cos(t) - x*sin(t)) < b]"


def test_a_rectangle_that_stands_upright() -> None:
    """Its sides run along both axes: of x*y it is 2/3 a b (a^2 - b^2) sin(2t), and its area 4 a b."""
    module = potto.compile(f"def f(t, a, b)\n    integral ([-1, 1], [-1, 1]) {TURNED}*(x*y + 1) d(x, y)")
    answer = potto.grad(module.f, ["t", "a", "b"])(0.0, 0.5, 0.25)
    exact = (4 / 3 * 0.125 * 0.1875, 1.0, 2.0)
    for found, off, wanted in zip(answer.tangent, answer.tangent_error, exact, strict=True):
        assert abs(found - wanted) <= off + 1e-15 and off <= 1e-7


def test_a_root_at_a_kink_that_turns_nothing() -> None:
    """max(y, 2y) < 0 is y < 0 on both sides, wherever its kink is the root."""
    answer = rate("integral [-1, 1] [max(x - t, 2*x - 2*t) < 0] d(x)", 0.25)
    assert not answer.notes and abs(answer.tangent - 1.0) <= answer.tangent_error <= 1e-9


@pytest.mark.parametrize("t", [math.pi / 2, math.pi])
def test_a_rectangle_that_stands_upright_but_for_rounding(t: float) -> None:
    turned = TURNED.replace("< a", "< 1/2").replace("< b", "< 1/4")
    answer = rate(f"integral ([-1, 1], [-1, 1]) {turned}*x*y d(x, y)", t)
    assert abs(answer.tangent - math.cos(2 * t) / 32) <= answer.tangent_error <= 1e-7


def test_an_odd_integrand_over_an_even_domain_is_0() -> None:
    """What integrals further in leave is rounding: no reason to give up."""
    f = potto.compile("def f(t)\n    integral ([-1, 1], [-1, 1]) [abs(x) < 1/2]*[abs(y) < 1/4]*x*y*t d(x, y)").f
    answer = f(1.0)
    assert abs(answer.value) <= answer.error <= 1e-14 and answer.converged


@pytest.mark.parametrize("ulps", [-10, -2, -1, 0, 1, 2, 10])
@pytest.mark.parametrize("scale", [1.0, 3.0])
def test_a_fold_hit_to_the_last_place(ulps: int, scale: float) -> None:
    """x^3 - x < t at its local maximum, which no double is: below it two roots move infinitely fast, above is one.

    The value is to either side of it 2 + 2/sqrt(3), to sqrt(rounding); the slope of the root that stays is 1/3.
    """
    fold = scale * 2 / (3 * math.sqrt(3))
    t = fold + ulps * math.ulp(fold)
    text = f"def f(t) integral [-2, 2] [{scale!r}*(x^3 - x) < t] d(x)"
    answer = potto.deriv(potto.compile(text).f)((t, 1.0))
    with mp.workdps(40):
        below = max(float(mp.mpf(2) / (3 * mp.sqrt(3)) - mp.mpf(t) / scale), 0.0)
    gap = 2 * math.sqrt(below / math.sqrt(3))  # that x^3 - x leaves open around its maximum
    assert abs(answer.value - (2 + 2 / math.sqrt(3) - gap)) <= answer.error <= 1e-6
    assert not answer.converged
    (note,) = answer.notes
    assert float(note.backward) == math.inf and abs(float(note.forward) - 1 / (3 * scale)) <= 1e-9


@pytest.mark.parametrize(
    ("body", "backward", "forward"),
    [
        ("3*(integral [0, 1] [x < t] d(x)) + t", 1.0, 4.0),
        ("(integral [0, 1] [x < t] d(x)) + (integral [0, 1] [x < 2*t] d(x))", 0.0, 3.0),
        ("sum k in 1..6 (integral [0, 1] [0.7*x < t*k] d(x))", 0.0, 30.0),
        ("abs(t) + 2*(integral ([-1, 1], [-1, 1]) [x^2 + y^2 < t] d(x, y))", -1.0, 1 + 2 * math.pi),
        ("abs(t) + (integral [-1, 1] [x^2 < t] d(x))", -1.0, INF),
        ("abs(t) + (integral [0, 1] max(x*t, 0) d(x))", -1.0, 1.5),
        # of many surfaces on one bound, the last of which comes in as far as it is fast: the sum of e^j - 1 over 0.7
        ("integral [0, 1] exp(sum k in 1..6 ([0.7*x < t*k])) d(x)", 0.0, sum(math.expm1(j) for j in range(1, 7)) / 0.7),
        # of many inside, between which e^j stands: k more of them are above it on one side, k less on the other
        ("integral [-1, 1] exp(sum k in 1..6 ([x < t*k])) d(x)",
         6 * math.e**6 - sum(math.exp(j) for j in range(6)), sum(math.exp(j) for j in range(1, 7)) - 6),
    ],
)  # fmt: skip
def test_what_is_made_of_integrals_has_the_two_sides_of_the_whole(body: str, backward: float, forward: float) -> None:
    (note,) = rate(body).notes
    assert note.backward == pytest.approx(backward, rel=1e-9) and note.forward == pytest.approx(forward, rel=1e-9)


def test_what_leaves_one_integral_and_comes_into_another() -> None:
    answer = rate("(integral [0, 1] [x < t] d(x)) + (integral [-1, 0] [x < t] d(x))")
    assert not answer.notes and abs(answer.tangent - 1) <= answer.tangent_error < 1e-12


@pytest.mark.parametrize("method", ["mc", "qmc"])
def test_samples_tell_surfaces_on_bounds(method: Any) -> None:
    with potto.settings(method=method, samples=1024):
        (note,) = rate("integral ([0, 1], [0, 1]) [x < t]*y d(x, y)", 1.0).notes
    assert (note.backward, note.forward) == pytest.approx((0.5, 0.0), abs=1e-9) and "lies on a bound" in str(note)


@pytest.mark.parametrize(
    ("body", "t", "backward", "forward"),
    [
        ("integral (x ~ gamma(2, 1.5)) [x < t] d(x)", 0.0, 0.0, 0.0),  # the density falls like x
        ("integral (x ~ beta(2, 1.5)) [x < t]*x d(x)", 1.0, 0.0, 0.0),  # like sqrt(1 - x)
        ("integral [0, 1] [x < t]*sin(x)/x d(x)", 0.0, 0.0, 1.0),
        ("integral [0, 1] [x < t]*exp(-1/x)/x d(x)", 0.0, 0.0, 0.0),
    ],
)
def test_an_integrand_without_a_value_at_the_bound_has_its_limit(
    body: str, t: float, backward: float, forward: float
) -> None:
    answer = rate(body, t)
    sides = [(float(note.backward), float(note.forward)) for note in answer.notes] or [(answer.tangent,) * 2]
    assert sides == [pytest.approx((backward, forward), abs=1e-7)] and answer.tangent_error < 1e-7


@pytest.mark.parametrize("body", ["1/sqrt(x)", "log(x)", "1/100 - 1/log(x)"])
def test_where_no_limit_shows_the_derivative_is_not_known(body: str) -> None:
    answer = rate(f"integral [0, 1/2] [x < t]*{body} d(x)")
    assert answer.tangent_error == INF and not answer.converged


@pytest.mark.parametrize("backend", ["numpy", "native"])
def test_members_at_which_an_ellipse_appears_are_looked_at_by_themselves(backend: str) -> None:
    """Among members that are settled at once, as the surface does not cross the square beside it."""
    f = potto.compile("def f(t) integral ([-1, 1], [-1, 1]) [(x - 1/4)^2 + y^2 > t - 1/2] d(x, y)").f
    t = np.where(np.arange(600) % 100 == 7, 0.5, np.linspace(0.4, 0.499, 600))
    with potto.settings(backend=backend):
        r = potto.deriv(f)((t, 1.0))
    (note,) = r.notes
    assert np.flatnonzero(np.isfinite(note.forward)).tolist() == [*range(7, 600, 100)]
    assert np.abs(note.forward[7::100] + math.pi).max() < 1e-8


@pytest.mark.parametrize("count", [3, 40])
def test_members_of_a_batch_on_a_bound_tell_what_each_tells_alone(count: int) -> None:
    """Few members, which may be proved one by one, and many: of x < t at t = 1 the derivative is 2w before and w
    beyond, as 1 + t - x is 1 there and its own slope w (closed form, to rounding)."""
    f = potto.compile("def f(t, w) integral [0, 1] [x < t]*w*(1 + t - x) d(x)").f
    w = np.arange(1.0, count + 1)
    (note,) = potto.grad(f, "t")(np.ones(count), w).notes
    assert note.backward == pytest.approx(2 * w, rel=1e-13) and note.forward == pytest.approx(w, rel=1e-13)


@pytest.mark.parametrize(("t", "backward", "forward"), [(0.0, 0.0, math.pi), (1.0, math.pi, math.pi)])
def test_all_places_beside_a_fold_are_one_batch(
    t: float, backward: float, forward: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Six of them, three on either side. A disc that appears, and one that comes to touch its box: pi*t is its area,
    to 1e-11 of what three steps leave."""
    sizes, own = [], Problem.beside

    def counted(problem: Problem, env: dict[str, Value], batch: int | None = None) -> Sums:
        sizes.append(batch)
        return own(problem, env, batch)

    monkeypatch.setattr(Problem, "beside", counted)
    answer = rate("integral ([-1, 1], [-1, 1]) [x^2 + y^2 < t] d(x, y)", t)
    sides = [(float(note.backward), float(note.forward)) for note in answer.notes] or [(answer.tangent,) * 2]
    assert sides == [pytest.approx((backward, forward), abs=1e-11)]
    assert sizes == [6]
