"""`converged` is true where the error is within what was asked for, and nowhere else.

Within `rtol` of the value, or within `atol`; and what is 0 because its parts cancel, within 1e-12 of these. Infinite
derivatives are infinities. Answers by hand: the area of x*y < t has the derivative -2 log|t| + ..., infinite at 0.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

import potto
from potto.core.terms import ONE, ZERO, add, integral, var
from potto.integrate.pieces import Sums
from potto.projects.settings import DEFAULTS
from potto.runtime.answers.convergence import missing

INF = math.inf


def rate(body: str, t: float = 0.0) -> Any:
    return potto.deriv(potto.compile(f"def f(t)\n    {body}").f)((t, 1.0))


BOUNDLESS = [  # where, value, derivative
    ("integral ([-1, 1], [-1, 1]) [x*y < t] d(x, y)", 0.0, 2.0, INF),
    ("integral ([-1, 1], [-1, 1]) [t > y*x] d(x, y)", 0.0, 2.0, INF),
    ("integral ([-1, 1], [-1, 1]) [x*y > t] d(x, y)", 0.0, 2.0, -INF),
    ("integral ([1, -1], [-1, 1]) [x*y < t] d(x, y)", 0.0, -2.0, -INF),
    ("integral ([-1, 1], [-1, 1]) [x*y < t]*exp(x) d(x, y)", 0.0, 2 * math.sinh(1.0), INF),
    ("integral ([-1, 1], [-1, 2]) (if [x*y - t < 0] then 1 else 0) d(x, y)", 0.0, 3.0, INF),
    ("integral ([-1, 1], [-1, 1]) [(x - 0.1)*(y - 0.2) < t] d(x, y)", 0.0, 1.1 * 0.8 + 0.9 * 1.2, INF),
    ("integral ([-1, 1], [-1, 1]) [x^2 - y^2 < t] d(x, y)", 0.0, 2.0, INF),
    ("integral ([0, 2], [0, 2]) [x^3 + y^3 - 3*x*y < t] d(x, y)", 0.0, 1.5, INF),
    ("integral ([-1, 1], [-1, 1]) [x^3 - 3*x*y^2 > t] d(x, y)", 0.0, 2.0, -INF),
    ("integral [-1, 1] [x^3 < t] d(x)", 0.0, 1.0, INF),
    ("integral [-1, 1] (integral [-1, 1] [x*y < t] d(y)) d(x)", 0.0, 2.0, INF),
]


@pytest.mark.parametrize(("body", "t", "value", "exact"), BOUNDLESS, ids=[row[0] for row in BOUNDLESS])
def test_an_infinite_derivative_is_infinite(body: str, t: float, value: float, exact: float) -> None:
    answer = rate(body, t)
    assert abs(answer.value - value) <= answer.error + 4e-16 <= 1e-9
    assert answer.tangent == exact and answer.tangent_error == INF
    assert not answer.converged and "infinite" in answer.reasons[0]
    assert answer.evals <= 1_000_000


NEARLY = [  # finite, however steep: 4*t*(1 - log t) + ... by hand
    ("integral ([-1, 1], [-1, 1]) [x*y < t] d(x, y)", 1e-3),
    ("integral ([-1, 1], [-1, 1]) [x*y < t] d(x, y)", 1e-8),
    ("integral ([-1, 1], [-1, 1]) [x*y < t] d(x, y)", -1e-6),
]


@pytest.mark.parametrize(("body", "t"), NEARLY)
def test_a_steep_derivative_is_a_number(body: str, t: float) -> None:
    """Of 2 + 2 (t - t log t) the derivative is -2 log |t|."""
    answer = rate(body, t)
    assert abs(answer.tangent + 2 * math.log(abs(t))) <= answer.tangent_error <= 1e-6


LOST = [  # 1, beside what is 1e16 times as large
    "integral [0, 1] (1e16*[x < t] - 1e16*[x > t] + 1) d(x)",
    "integral [0, 1] (1 + 1e16*[x < t] - 1e16*[x > t]) d(x)",
    "integral [0, 1] (1e16*(2*[x < t] - 1) + 1) d(x)",
    "integral [0, 1] (if [x < t] then 1e16 + 1 else 1 - 1e16) d(x)",
    "integral [-1, 1] (1e17*(t - 0.5 + 1)*x^3 + 1/2) d(x)",
    "integral ([0, 1], [0, 1]) (1e16*[x < t] - 1e16*[x > t] + 1) d(x, y)",
    "1e16*integral [0, 1] [x < t] d(x) - 1e16*integral [0, 1] [x > t] d(x) + 1",
    "1e16*integral [0, 1] ([x < t] - [x > t]) d(x) + 1",
]


@pytest.mark.parametrize("body", LOST)
def test_what_is_lost_beside_something_large_is_missed(body: str) -> None:
    for answer in (rate(body, 0.5), potto.compile(f"def f(t) {body}").f(0.5)):
        assert abs(answer.value - 1.0) <= answer.error
        assert not answer.converged and answer.reasons


CANCEL = [
    "integral [-1, 1] t*x^3*cos(x) d(x)",
    "integral [-1, 1] sin(t*x) d(x)",
    "integral [-1, 1] t*x d(x)",
    "integral [0, 2*pi] cos(x)*t d(x)",
    "integral ([-1, 1], [-1, 1]) [x^2 + y^2 < t]*x d(x, y)",
    "integral ([-1, 1], [-1, 1]) [x^2 + y^2 < t]*(x + y) d(x, y)",
    "integral [0, 1] ([x < t] - t) d(x)",
    "integral [0, 1] (x - 1/2)*t d(x)",
    # in proportion to a factor outside of the integral: odd, or of nothing
    "1e4*integral [-1e-5, 1e-5] sin(t*x)*(2 + cos(x)) d(x)",
    "(integral [-1e-5, 1e-5] sin(t*x)*(2 + cos(x)) d(x))/1e-4",
    "exp(9)*integral ([-1e-3, 1e-3], [0, 1e-3]) (sin(x*y) + t*x^3) d(x, y)",
]


@pytest.mark.parametrize("body", CANCEL)
def test_a_zero_by_cancellation_has_converged(body: str) -> None:
    """Both the value and the derivative are 0; nobody knows more than what is added up has digits. A factor outside of
    an integral scales what its error may be."""
    answer = rate(body, 0.5)
    assert abs(answer.value) <= answer.error <= 1e-12 and abs(answer.tangent) <= answer.tangent_error <= 1e-12
    assert answer.converged, answer.reasons


def test_of_an_infinite_value_no_finite_integral_is_to_blame() -> None:
    """It is said of the value, and of an integral where that is infinite."""
    f = potto.compile("def f(x, t) 1/x + integral [0, 1] [y < t]*exp(y) d(y)").f
    alone, batch = f(0.0, 0.5), f(np.array([0.0, 1.0]), 0.5)
    assert alone.value == INF and alone.reasons == ("the value is infinite here, or beyond what numbers can hold",)
    assert batch.reasons_of(0) == alone.reasons and batch.member_converged.tolist() == [False, True]
    assert abs(batch.value[1] - math.exp(0.5)) <= batch.error[1] <= 1e-12
    slope = potto.deriv(potto.compile("def f(x, t) sqrt(x) + integral [0, 1] [y < t]*exp(y) d(y)").f)((0.0, 1.0), 0.5)
    assert slope.tangent == INF and slope.reasons == ("the derivative is infinite here",)
    none = potto.compile("def f(x, t) (1/x)*x + integral [0, 1] [y < t]*exp(y) d(y)").f(0.0, 0.5)
    assert none.reasons == ("the value is not a number",)
    pole = potto.compile("def f(x) integral [0, 1] x/y d(y)").f
    assert pole(1.0).value == INF and "integral" in pole(1.0).reasons[0] and not pole(1.0).converged


@pytest.mark.parametrize("body", ["exp(3000*t)", "1/(t - 1)", "-log(t - 1)"])
def test_what_is_infinite_without_any_integral_has_not_converged_either(body: str) -> None:
    """A pole, and what overflows, which is no infinity at all. The constant `inf` is known to be one."""
    f = potto.compile(f"def f(t) {body}").f
    alone, batch, slope = f(1.0), f(np.array([1.0, 0.0])), potto.deriv(f)((1.0, 1.0))
    assert alone.value == alone.error == INF and not alone.converged and "infinite" in alone.reasons[0]
    assert not batch.member_converged[0] and batch.reasons_of(0) == alone.reasons
    assert slope.value == INF and not slope.converged and alone.reasons[0] in slope.reasons
    assert potto.compile("def f(t) inf").f(1.0).converged


def test_what_was_asked_for_counts() -> None:
    lost = potto.compile("def f(t) integral [0, 1] (1e16*[x < t] - 1e16*[x > t] + 1) d(x)").f
    with potto.settings(atol=1e4):
        assert lost(0.5).converged
    odd = potto.compile("def f(t) integral [-1, 1] sin(t*x) d(x)").f
    with potto.settings(rtol=1e-18):
        assert not odd(1.0).converged


HALF = "def f(t) integral ([0, 1], [0, 1]) [x + y < t]*(1 + x) d(x, y)"


@pytest.mark.parametrize("method", ["mc", "qmc"])
def test_samples_converge_where_they_are_good(method: Any) -> None:
    """At t = 1 it is 2/3; a bar of 5 % is good enough where nobody asked for another one."""
    f = potto.compile(HALF).f
    with potto.settings(method=method, samples=100_000):
        good = f(1.0)
        assert abs(good.value - 2 / 3) <= good.error <= 0.05 * good.value and good.converged and not good.reasons
    with potto.settings(method=method, samples=64):
        bad = f(1.0)
        assert abs(bad.value - 2 / 3) <= bad.error
        assert bad.converged == (bad.error <= 0.05 * bad.value)
    with potto.settings(method=method, samples=100_000, rtol=1e-12):
        asked = f(1.0)
        assert not asked.converged and "samples" in asked.reasons[0]
    with potto.settings(method=method, samples=100_000, rtol=0.2):
        assert potto.deriv(f)((1.0, 1.0)).converged


def test_a_rare_event_has_not_converged_by_few_samples() -> None:
    f = potto.compile("def f(t) integral ([0, 1], [0, 1]) [x*y < t] d(x, y)").f
    with potto.settings(method="mc", samples=2000):
        answer = f(1e-4)
    assert not answer.converged and answer.error > 0.05 * answer.value
    assert abs(answer.value - 1e-4 * (1 + math.log(1e4))) <= answer.error


@pytest.mark.parametrize("method", ["mc", "qmc"])
def test_members_of_a_batch_converge_by_themselves(method: Any) -> None:
    f = potto.compile("def f(t) integral ([0, 1], [0, 1]) [x*y < t] d(x, y)").f
    with potto.settings(method=method, samples=2000, rtol=0.1):
        answer = f(np.array([1e-6, 0.5]))
    assert (answer.member_converged == (answer.error <= 0.1 * answer.value)).all()
    assert answer.member_converged[1] and not answer.member_converged[0] and not answer.converged
    assert answer.reasons_of(0) == answer.reasons and not answer.reasons_of(1)


def test_what_is_infinite_give_or_take_infinity_is_looked_at_again() -> None:
    """Of the derivatives 1, inf, inf and 1 with these errors only the first is as accurate as was asked for."""
    v, t = np.full((1, 4), 2.0), np.array([[[1.0, INF, -INF, 1.0]]])
    sums = Sums(v, np.full((1, 4), 1e-14), t, np.array([[[1e-13, INF, INF, 0.1]]]))
    term = integral(("x",), ((ZERO, ONE),), add(var("x"), ONE))
    assert missing(term, sums, DEFAULTS, {}).tolist() == [False, True, True, True]


def test_arrays_say_who_missed() -> None:
    f = potto.compile("def f(t) integral ([-1, 1], [-1, 1]) [x*y < t] d(x, y)").f
    t = np.array([-0.5, 0.0, 0.25, 0.5])
    answer = potto.deriv(f)((t, np.ones(4)))
    assert list(answer.member_converged) == [True, False, True, True] and not answer.converged
    assert answer.tangent[1] == INF and "infinite" in answer.reasons_of(1)[0] and not answer.reasons_of(0)
    exact = -2 * np.log(np.abs(t[[0, 2, 3]]))
    assert (np.abs(answer.tangent[[0, 2, 3]] - exact) <= answer.tangent_error[[0, 2, 3]]).all()
    assert (answer.tangent_error[[0, 2, 3]] <= 1e-9).all()


def test_lists_are_as_good_as_their_worst() -> None:
    answer = potto.compile("def f(t) [integral [0, 1] [x < t] d(x), integral [0, 1] t/x d(x)]").f(0.5)
    assert not answer.converged and answer.reasons


def test_the_command_line_says_so(tmp_path: Any) -> None:
    file = tmp_path / "p.po"
    file.write_text("def f(t) integral ([-1, 1], [-1, 1]) [x*y < t] d(x, y)\n")
    run = [sys.executable, "-m", "potto", "eval", str(file), "deriv(f)((0, 1))"]
    ran = subprocess.run([*run, "--json"], capture_output=True, text=True, check=False)
    answer = json.loads(ran.stdout)
    assert answer["tangent"] == "inf" and answer["converged"] is False and "infinite" in answer["reasons"][0]
    shown = subprocess.run(run, capture_output=True, text=True, check=False)
    assert "inf" in shown.stdout and "infinite" in shown.stderr


def test_a_sum_whose_terms_do_not_all_move_or_count_is_as_accurate_as_its_largest() -> None:
    """Of [0, 1], [1, 2] and [2, 3] the first is below t/x, the others are beyond: 1, and no edge to move. Terms that
    cancel leave rounding, which is measured by them, not by the one that is 0."""
    m = potto.compile("""
def f(xs: [n] Real, t) sum i in 0..n-1 (integral [i, i+1] [xs[i]*u < t] d(u))
def g(xs: [n] Real, t) sum i in 0..n-1 (integral [0, 1] xs[i]*sin(3*u + t)^2*[u < 0.7] d(u))
""")
    found = potto.grad(m.f, "t")(np.array([0.3, 0.7, 0.45]), 0.4)
    assert (found.value, found.tangent, found.converged) == (1, 0, True)
    batch = potto.grad(m.f, "t")(np.array([0.3, 0.7, 0.45]), np.array([0.4, 0.41]))
    assert batch.converged and batch.tangent.tolist() == [0, 0]
    cancelled = m.g(np.array([1.0, -1.0, 0.0]), 0.2)
    assert abs(cancelled.value) <= cancelled.error < 1e-12 and cancelled.converged
