"""Calls that are one integral, on the short way from arguments to the answer: as exact as ever, and the same."""

from __future__ import annotations

import importlib.util
import math
import warnings
from collections.abc import Callable
from typing import Any

import mpmath as mp
import numpy as np
import pytest

import potto
from potto.kernels.making import counts
from potto.python.calls import Call
from potto.runtime.evaluate import Program
from potto.runtime.integration.problem import Problem

BACKENDS = [
    "numpy",
    pytest.param(
        "native",
        marks=pytest.mark.skipif(importlib.util.find_spec("llvmlite") is None, reason="llvmlite is not installed"),
    ),
]
RENDERER = r"""
def quad(x, y, c) 1/(sqrt(2)*(x + y + c) + 2)^2
def f(c) integral ([0, 1], [0, 1]) quad(x, y, c)*[x + y + c >= 0] d(x, y)
def twice(a) f(a)
def two(a, b) integral [0, 2] (if [x < a] then exp(-b*x) else x^2) d(x)
def shaded(c, shader) integral [0, 1] shader(x, c)*[x < c] d(x)
def loss(c, d) (f(c) - integral [0, 1] [x < d]*exp(-x) d(x))^2/abs(c - 0.2)
shader = \(x, c) . exp(c*x)
"""


def quad(c: float) -> tuple[mp.mpf, mp.mpf]:
    """The value of f and its derivative: over s = x + y, whose density is s up to 1 and 2 - s from there."""
    with mp.workdps(30):
        inside = [p for p in (max(-mp.mpf(c), 0), 1, 2) if p >= -c]

        def value(c: mp.mpf) -> mp.mpf:
            return mp.quad(lambda s: min(s, 2 - s) / (mp.sqrt(2) * (s + c) + 2) ** 2, inside)

        jump = min(-mp.mpf(c), 2 + mp.mpf(c)) / 4 if -2 < c < 0 else mp.mpf(0)
        slope = mp.quad(lambda s: -2 * mp.sqrt(2) * min(s, 2 - s) / (mp.sqrt(2) * (s + c) + 2) ** 3, inside)
        return value(mp.mpf(c)), slope + jump


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("name", ["f", "twice"])
def test_value_and_derivative_are_right(name: str, backend: str) -> None:
    function = getattr(potto.compile(RENDERER), name)
    slope = potto.deriv(function)
    with potto.settings(backend=backend):
        for c in (-0.7, -0.70001, -1.3, -1.9999999, -1e-8, 0.5, 1e8):
            exact, rate = quad(c)
            found = slope((c, 1.0))
            assert abs(found.value - exact) <= found.error
            assert abs(found.tangent - rate) <= found.tangent_error
            assert function(c).value == pytest.approx(float(exact), rel=1e-14, abs=0)


@pytest.mark.parametrize("backend", BACKENDS)
def test_several_directions_at_once(backend: str) -> None:
    two = potto.compile(RENDERER).two
    with potto.settings(backend=backend):
        for a, b in ((0.6, 1.3), (1.9, -0.4), (0.6, 1.3)):
            found = potto.grad(two, wrt=["a", "b"])(a, b)
            value = -math.expm1(-b * a) / b + (8 - a**3) / 3
            by_a = math.exp(-b * a) - a * a
            by_b = a * math.exp(-b * a) / b + math.expm1(-b * a) / b**2
            assert abs(found.value - value) <= found.error + 1e-15  # the closed forms are rounded as well
            assert np.allclose(found.tangent, (by_a, by_b), rtol=1e-13, atol=0)


def test_functions_are_part_of_what_is_integrated() -> None:
    module = potto.compile(RENDERER)
    other = potto.compile(r"shader = \(x, c) . x").shader
    for c in (0.3, 0.31):  # the second call has all that the first one found out
        exact = math.expm1(c * c) / c
        assert module.shaded(c, module.shader).value == pytest.approx(exact, rel=1e-14, abs=0)
        assert module.shaded(c, other).value == pytest.approx(c * c / 2, rel=1e-14, abs=0)
        dual = potto.deriv(module.shaded)((c, 1.0), potto.deriv(other))
        assert dual.tangent == pytest.approx(c, rel=1e-14, abs=0)


def test_the_general_way_gives_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    module = potto.compile(RENDERER)
    places = [-1.99, -1.2, -0.7, -0.3, 0.4]
    short = [potto.deriv(module.f)((c, 1.0)) for c in places]
    monkeypatch.setattr(Program, "shortest", lambda self, term: None)
    for c, found in zip(places, short, strict=True):
        general = potto.deriv(module.f)((c, 1.0))
        assert (found.value, found.tangent) == (general.value, general.tangent)
        assert (found.error, found.method, found.evals) == (general.error, general.method, general.evals)
        assert (found.converged, found.notes) == (general.converged, general.notes)


@pytest.mark.parametrize("shape", [None, (1, 1)])
@pytest.mark.parametrize("backend", BACKENDS)
def test_calls_near_those_of_before_are_answered_the_same(
    backend: str, shape: tuple[int, ...] | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Through corners, edges of the domain and far away, back and forth, so that what is known is used and left; with
    numbers, and with arrays of one."""
    module = potto.compile(RENDERER)
    random = np.random.default_rng(5)
    near = [c + d for c in (-0.7, -1.3, 0.4) for d in (0.0, 1e-3, -1e-3, 1e-9)]
    places = [*near, -1.0, -1 + 1e-9, 0.0, -1e-9, -2.0, -2 + 1e-7, 5.0, -5.0, 1e8, *random.uniform(-2.2, 0.4, 20)]
    given = places * 2 if shape is None else [np.full(shape, c) for c in places * 2]
    calls: list[Callable[[Any], potto.Estimate]] = [
        lambda c: module.f(c),
        lambda c: potto.grad(module.f)(c),
        lambda c: potto.grad(module.two, ("b", "a"))(-c, 0.5),
        lambda c: potto.grad(module.loss, ("d", "c"))(c, 0.25),
        lambda c: module.shaded(-c, module.shader),
        lambda c: potto.deriv(module.shaded)((-c, 1.0), potto.deriv(module.shader)),
        lambda c: potto.deriv(module.two)((-c, 1.0), (0.5, -2.0)),
    ]

    def told(found: potto.Estimate) -> tuple[object, ...]:
        return (type(found), np.shape(found.value), np.shape(found.tangent), found.method, found.converged,
                repr(found.member_converged), list(map(str, found.notes)), found.text, found.shortfalls)  # fmt: skip

    def numbers(found: potto.Estimate) -> tuple[Any, Any]:
        pairs = (found.value, found.error), (found.tangent, found.tangent_error)
        return tuple(np.hstack([np.ravel(x) for x in part if x is not None]) for part in zip(*pairs, strict=True))

    at_once, answered = Call.at_once, []

    def spied(self: Call, *given: Any) -> potto.Estimate | None:
        found = at_once(self, *given)
        answered.append(found is not None)
        return found

    with potto.settings(backend=backend):
        for call in calls:
            for c in given:
                call(c)
            with monkeypatch.context() as patch:
                patch.setattr(Call, "at_once", spied)
                found = [call(c) for c in given[: len(places)]]
            with monkeypatch.context() as patch:
                patch.setattr(Call, "at_once", lambda *_: None)
                general = [call(c) for c in given[: len(places)]]
            for ours, theirs in zip(found, general, strict=True):
                assert told(ours) == told(theirs)
                (v, e), (w, f) = numbers(ours), numbers(theirs)
                # How many nodes are enough is proved for regions, and these are larger where several calls lie in one:
                # two rules, each within its own bound of the same truth.
                assert ((np.abs(v - w) <= e + f) | (v == w) | (np.isnan(v) & np.isnan(w))).all()
    assert sum(answered) >= 25 and not all(answered)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("last", [3, 4, 7, 8, 9, 12])
def test_many_cells_are_added_up_at_once(last: int, backend: str) -> None:
    """Bands from t/2 to t, t/4 to t/3 and so on: up to six cells with one integrand."""
    ends = range(1, last)
    bands = " + ".join(f"{(-1) ** (k + 1)}*[x < t/{k}]" for k in ends)
    module = potto.compile(f"def f(t) integral [0, 2] exp(-x)*({bands}) d(x)")
    slope = potto.grad(module.f, "t")
    with potto.settings(backend=backend):
        for t in (0.5, 0.5001, 0.4999, 0.5):
            slope(t)
        found = module.f.at_once((0.5,), ("t",))
    assert found is not None and found.converged
    with mp.workdps(30):
        value = sum((-1) ** (k + 1) * (1 - mp.exp(-mp.mpf(1) / (2 * k))) for k in ends)
        rate = sum((-1) ** (k + 1) * mp.exp(-mp.mpf(1) / (2 * k)) / k for k in ends)
        assert abs(found.value - value) <= found.error < 1e-13
        assert abs(found.tangent - rate) <= found.tangent_error < 1e-13


@pytest.mark.parametrize("shape", [(2,), (30,), (5, 40)])
@pytest.mark.parametrize("backend", BACKENDS)
def test_batches_are_answered_the_same_from_the_second_call_on(
    backend: str, shape: tuple[int, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two arrays that broadcast, a number beside one, members beyond all edges, and arrays that are other ones."""
    module = potto.compile(RENDERER)
    random = np.random.default_rng(3)
    calls: list[Callable[[Any], potto.Estimate]] = [
        lambda c: module.f(c),
        lambda c: potto.grad(module.f)(c),
        lambda c: potto.grad(module.two, ("b", "a"))(-c, np.full(shape[-1:], 0.5)),
        lambda c: potto.grad(module.two, "b")(0.75, -c),
        lambda c: potto.grad(module.two, ("a", "b"))(np.round(-c), 0.5),  # edges on bounds: notes
        lambda c: potto.grad(module.two, "b")(-2.0, c),  # nothing but rounding in the derivative
    ]
    with potto.settings(backend=backend):
        for call in calls:
            for least in (-1.99, -2.5, -1.9):
                c = random.uniform(least, -0.01, shape)
                call(c)
                found = call(c)
                with monkeypatch.context() as patch:
                    patch.setattr(Call, "at_once", lambda *_: None)
                    general = call(c)
                for ours, theirs in ((found.value, general.value), (found.error, general.error),
                                     (found.tangent, general.tangent), (found.tangent_error, general.tangent_error),
                                     (found.member_converged, general.member_converged)):  # fmt: skip
                    assert np.array_equal(np.asarray(ours), np.asarray(theirs))
                assert (type(found), found.evals, found.method) == (type(general), general.evals, general.method)
                assert (found.converged, found.reasons) == (general.converged, general.reasons)
                assert list(map(str, found.notes)) == list(map(str, general.notes))


@pytest.fixture
def answered(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Of each call that asks for it, whether it was answered at once."""
    told: list[bool] = []
    at_once = Call.at_once

    def spied(self: Call, *given: Any) -> potto.Estimate | None:
        found = at_once(self, *given)
        told.append(found is not None)
        return found

    monkeypatch.setattr(Call, "at_once", spied)
    return told


@pytest.mark.parametrize("shape", [(1,), (1, 1)])
@pytest.mark.parametrize("backend", BACKENDS)
def test_gradients_at_arrays_of_one_are_kept_where_no_number_came_before(
    backend: str, shape: tuple[int, ...], answered: list[bool]
) -> None:
    module = potto.compile("""
def f(t) (integral [0, 1] [x < t]*x d(x) - 0.3)^2 + t
def g(a, b) integral [0, 1] exp(b*x)*[x < a] d(x)
""")
    t = np.full(shape, 0.7)
    with potto.settings(backend=backend):
        for call in (potto.grad(module.f), lambda t: potto.grad(module.g, ["b", "a"])(t, 0.5)):
            answered.clear()
            first, second = [call(t) for _ in range(4)][2:]
            assert answered[-2:] == [True, True]
            assert np.shape(second.value) == np.shape(first.member_converged) == shape
    found = potto.grad(module.f)(t)
    value, slope = (0.7**2 / 2 - 0.3) ** 2 + 0.7, 2 * (0.7**2 / 2 - 0.3) * 0.7 + 1
    assert abs(found.value - value).item() <= found.error.item() and found.tangent.shape == shape
    assert abs(found.tangent - slope).item() <= found.tangent_error.item()


def test_arguments_by_name_are_those_by_place(answered: list[bool]) -> None:
    """They are answered at once as well; what is missing or unknown is told as ever."""
    f = potto.compile("def f(a, b) integral [0, 1] exp(b*x)*[x < a] d(x)").f
    for call in (f, potto.grad(f, ["b", "a"])):
        answered.clear()
        by_place = call(0.5, 1.5), call(0.5, 1.5)
        for found in (call(a=0.5, b=1.5), call(b=1.5, a=0.5), call(0.5, b=1.5)):
            assert (found.value, found.tangent) == (by_place[1].value, by_place[1].tangent)
        assert answered == [False, *[True] * 4] or answered == [True] * 4
        for wrong in ({"a": 0.5}, {"a": 0.5, "c": 1.5}, {"a": 0.5, "b": 1.5, "c": 1.0}):
            with pytest.raises(potto.PottoError):
                call(**wrong)


def test_batches_go_straight_to_the_integral(answered: list[bool]) -> None:
    """And what is to be told of them is told as ever: at t = 1 the edge lies on the bound."""
    f = potto.grad(potto.compile("def f(t) integral [0, 1] exp(x)*[x < t] d(x)").f)
    plain, on_bound = np.linspace(0.1, 0.9, 50), np.linspace(0.02, 1.0, 50)
    for t in (plain, plain, on_bound, on_bound, plain[:7]):
        found = f(t)
        assert np.allclose(found.value, np.expm1(t), rtol=1e-14, atol=0)  # closed form, to rounding
        assert bool(found.notes) == (t is on_bound)
    assert answered == [True] * 4  # of the first call nothing is known


def test_batches_go_there_whatever_passes_by_their_first_member(answered: list[bool]) -> None:
    """The disc passes by the first pixels; all together have its area, and its derivative by the square of the
    radius."""
    text = "def f(a, b, r) integral ([a, a + 1/12], [b, b + 1/12]) [(x - 0.5)^2 + (y - 0.5)^2 < r] d(x, y)"
    f = potto.grad(potto.compile(text).f, "r")
    a, b = (z.ravel() for z in np.meshgrid(np.arange(12) / 12, np.arange(12) / 12))
    for r in (0.1, 0.1, 0.11):
        found = f(a, b, r)
        assert abs(found.value.sum() - r * math.pi) <= found.error.sum() <= 1e-12
        assert abs(found.tangent.sum() - math.pi) <= found.tangent_error.sum() <= 1e-10
    assert answered == [True] * 2  # of the first call nothing is known


def test_members_have_the_plan_of_their_batch(monkeypatch: pytest.MonkeyPatch) -> None:
    """A plan that holds for a batch is not looked for again for each of its members."""
    asked, own = [], Problem._plan

    def counted(self: Problem) -> Any:
        asked.append(self.batch)
        return own(self)

    slope = potto.grad(potto.compile(RENDERER).f, "c")
    monkeypatch.setattr(Problem, "_plan", counted)
    places = np.linspace(-0.8, -0.7, 8)
    found = slope(places)
    assert asked and asked.count(1) <= 1
    for i, c in enumerate(places):
        exact, rate = quad(c)
        assert abs(found.value[i] - exact) <= found.error[i] and abs(found.tangent[i] - rate) <= found.tangent_error[i]


@pytest.mark.parametrize("shape", [(0,), (0, 3)])
def test_empty_batches_teach_nothing(shape: tuple[int, ...]) -> None:
    """Nothing is kept of them for later calls: empty answers are all the same."""
    f = potto.grad(potto.compile("def f(t, s) integral [0, 1] exp(x) d(x)").f, ["t", "s"])
    for _ in range(2):
        assert np.shape(f(np.zeros(shape), 0.5).value) == shape
    found = f(np.array([0.1, 0.2]), 0.5)
    assert np.allclose(found.value, np.expm1(1.0), rtol=1e-14, atol=0)  # closed form, to rounding
    assert np.array_equal(found.tangent, np.zeros((2, 2)))


def test_what_is_known_of_calls_is_left_where_more_is_asked() -> None:
    f = potto.compile(RENDERER).f
    for _ in range(3):
        assert f(-0.7).stats["integrals"] == 1
    assert repr(f(np.float64(-0.7))).split()[0] == repr(f(-0.7)).split()[0]
    assert f(-1).value == f(-1.0).value
    with potto.settings(method="mc", samples=1000):
        assert f(-0.7).method == "mc"
    assert f(np.array([-0.7])).value.shape == (1,)
    assert math.isnan(f(math.nan).value) and f(-5).value == 0
    with pytest.raises(potto.PottoError, match="bool"):
        f(True)


def test_infinite_answers_near_those_of_before_have_not_converged() -> None:
    """What stands beside an integral may be infinite where all about the integral is settled."""
    text = "def f(a, b) 1/a + integral [0, 1] exp(b*x) d(x)\ndef g(a, b) sqrt(a) + integral [0, 1] exp(b*x) d(x)\n"
    known, new = potto.compile(text), potto.compile(f"{text}\n")
    for _ in range(3):
        assert known.f(4.0, 1.0).converged and potto.grad(known.g)(4.0, 1.0).converged
    for module in (known, new):
        value, slope = module.f(0.0, 1.0), potto.grad(module.g)(0.0, 1.0)
        assert value.value == slope.tangent == math.inf
        assert not value.converged and not slope.converged


@pytest.mark.parametrize(
    ("outside", "before", "after"),
    [("abs(a)*", 1 - math.e, math.e - 1), ("max(a, 0) + ", 0, 1), ("floor(a) + ", math.inf, 0)],
)
def test_kinks_beside_an_integral_are_told_after_calls_near_by(outside: str, before: float, after: float) -> None:
    """At a = 0, each time that it is asked for: the integral is e - 1, and settled for all a."""
    slope = potto.grad(potto.compile(f"def f(a, b) {outside}integral [0, 1] exp(b*x) d(x)").f)
    for _ in range(3):
        assert not slope(0.3, 1.0).notes
    for _ in range(2):
        (note,) = slope(0.0, 1.0).notes
        assert note.backward == pytest.approx(before, rel=1e-14, abs=0)  # closed forms, to rounding
        assert note.forward == pytest.approx(after, rel=1e-14, abs=0)


def test_where_the_edge_lies_on_a_corner_the_general_way_says_so() -> None:
    f = potto.compile("def f(t) integral [0, 1] [x < t] d(x)").f
    assert not potto.deriv(f)((0.3, 1.0)).notes
    found = potto.deriv(f)((1.0, 1.0))
    assert "one-sided derivatives differ (1 backward, 0 forward)" in str(found.notes[0])
    assert math.isnan(f(math.nan).value)


@pytest.mark.filterwarnings("error")
def test_numbers_without_a_value_are_no_warnings_of_numpy() -> None:
    f = potto.compile("def f(a, b) integral [0, 1] [b*x < a] d(x)").f
    for place in ((0.3, 1.0), (0.31, 1.0), (0.3, 0.0), (0.0, 0.0), (1e200, 1e-200)):
        assert not 0 < f(*place).value < 0.29
        potto.grad(f, ["a", "b"])(*place)


def test_arguments_with_errors_keep_them() -> None:
    f = potto.compile("def f(t) integral [0, 1] [x < t] d(x)").f
    f(0.3)
    inexact = potto.compile("def g(s) integral [0, s] exp(-x*x) d(x)").g(1)
    found = f(inexact)
    assert found.error >= inexact.error > 0
    assert abs(found.value - float(mp.sqrt(mp.pi) / 2 * mp.erf(1))) <= found.error


def test_an_edit_counts_at_once() -> None:
    for factor in (2, 3):
        f = potto.compile(f"def f(t) integral [0, 1] {factor}*[x < t] d(x)", name="edited").f
        assert f(0.25) == factor / 4


@pytest.mark.skipif(importlib.util.find_spec("llvmlite") is None, reason="llvmlite is not installed")
def test_machine_code_says_that_it_answered() -> None:
    f = potto.compile("def f(t) integral [0, 1] exp(0.0625*x)*[x < t] d(x)").f
    with potto.settings(backend="native"):
        f(0.3)
        before = counts.native_points
        found = f(0.31)
    assert counts.native_points > before
    assert found.stats["points by machine code"] == found.evals
    assert found.value == pytest.approx(math.expm1(0.0625 * 0.31) / 0.0625, rel=1e-14, abs=0)


def test_cuts_at_infinity_are_nobodys_concern() -> None:
    """Edges that are parallel to an axis have no sections along it: no warning of numpy's comes through."""
    edges = "[x*cos(a) + y*sin(a) < 0.6]*[y*cos(a) - x*sin(a) > -0.6]"
    f = potto.compile(f"def f(a) integral ([-1, 1], [-1, 1]) {edges} d(x, y)").f
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for ask in (f, potto.grad(f, ["a"])):
            answers = [ask(0.0) for _ in range(2)]
            assert all(abs(answer.value - 2.56) <= answer.error + 1e-15 for answer in answers)
