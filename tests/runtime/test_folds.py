"""Folds against arithmetic of many digits, against the same program written out, and forward against reverse."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any, Literal, cast

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf

import potto
from potto.python import derived_calls
from potto.runtime.evaluation.folds import folds, linear

DIGITS = 400  # what is chaotic loses one in two steps

FOLDS = potto.compile("""
def settling(r, n) fold s = 0.3 for i in 1..n (r*s*(1 - s))
def turning(k, n) fold (x, v) = (1, 0) for i in 1..n (let w = v - 0.1*k*x in (x + 0.1*w, w))
def growing(k, n) fold (x, v) = (1, 0) for i in 1..n ((x + 0.1*v, v - 0.1*k*x))
def folding(a, n) fold (x, y) = (0.1, 0.1) for i in 1..n ((1 - a*x^2 + 0.3*y, x))
def waning(k, n) fold s = 1 for i in 1..n (s*cos(k) + k/i)
def counting(n) fold s = 0 for i in 1..n (s + i)
def tenths(h, n) fold s = 0 for i in 1..n (s + h)
def cooling(us: [n] Real, r, c)
    fold u = us for i in 1..c ([u[j] + r*(u[min(j + 1, n - 1)] - 2*u[j] + u[max(j - 1, 0)]) for j in 0..n-1])
def factors(xs: [n] Real, k) product i in 0..n-1 (xs[i] + k)
def least(xs: [n] Real, k) min i in 0..n-1 (k*xs[i]^2 - xs[i])
def most(xs: [n] Real, k) max x in xs (k*x^2 - x)
def along(xs: [n] Real, k) fold (s, p) = (k, 1) for i in 0..n-1 ((s*cos(k) + xs[i]^2, p - s*xs[n - 1 - i]/3))
def within(k, n) fold s = k for i in 1..n, j in 1..i (s/2 + sin(j*k))
def kept(xs: [n] Real, k) (fold u = [k, k^2, 1] for i in 0..n-1 ([u[1]*xs[i], u[2] - u[0], cos(u[0])]))[1]
""")

Pair = tuple[Any, Any]  # a number and its derivative by the parameter


def times(a: Pair, b: Pair) -> Pair:
    return a[0] * b[0], a[0] * b[1] + a[1] * b[0]


def plus(a: Pair, b: Pair, sign: int = 1) -> Pair:
    return a[0] + sign * b[0], a[1] + sign * b[1]


def exact(x: float) -> Pair:
    return mpf(x), mpf(0)


def settled(s: list[Pair], r: Pair, i: int) -> list[Pair]:
    return [times(r, times(s[0], plus(exact(1), s[0], -1)))]


def turned(s: list[Pair], k: Pair, i: int) -> list[Pair]:
    w = plus(s[1], times(exact(0.1), times(k, s[0])), -1)
    return [plus(s[0], times(exact(0.1), w)), w]


def grown(s: list[Pair], k: Pair, i: int) -> list[Pair]:
    return [plus(s[0], times(exact(0.1), s[1])), plus(s[1], times(exact(0.1), times(k, s[0])), -1)]


def folded(s: list[Pair], a: Pair, i: int) -> list[Pair]:
    return [plus(plus(exact(1), times(a, times(s[0], s[0])), -1), times(exact(0.3), s[1])), s[0]]


def waned(s: list[Pair], k: Pair, i: int) -> list[Pair]:
    return [plus(times(s[0], (mp.cos(k[0]), -mp.sin(k[0]))), (k[0] / i, 1 / mpf(i)))]


KINDS: dict[str, tuple[Callable[..., list[Pair]], tuple[float, ...]]] = {
    "settling": (settled, (0.3,)),
    "turning": (turned, (1, 0)),
    "growing": (grown, (1, 0)),
    "folding": (folded, (0.1, 0.1)),
    "waning": (waned, (1,)),
}


def in_digits(name: str, parameter: float, n: int) -> list[Pair]:
    step, start = KINDS[name]
    state, moving = [exact(x) for x in start], (mpf(parameter), mpf(1))
    for i in range(1, n + 1):
        state = step(state, moving, i)
    return state


def parts(value: Any) -> list[float]:
    return list(value) if isinstance(value, tuple) else [value]


@settings(max_examples=60)
@given(
    st.sampled_from(
        [("settling", 1.2, 2.9), ("settling", 3.6, 3.99), ("turning", 0.3, 2), ("growing", 0.3, 2), ("folding", 1, 1.4),
         ("waning", 0.1, 3)]
    ),
    st.floats(0, 1),
    st.integers(1, 60),
    st.sampled_from(["numpy", "native"]),
)  # fmt: skip
@example(("settling", 2.5, 2.5), 0.0, 1000, "numpy")
@example(("turning", 1.0, 1.0), 0.0, 3000, "native")
@example(("growing", 1.0, 1.0), 0.0, 3000, "native")
def test_errors_of_values_and_derivatives_are_bounded(
    kind: tuple[str, float, float], share: float, n: int, backend: Literal["numpy", "native"]
) -> None:
    name, low, high = kind
    parameter = low + share * (high - low)
    with potto.settings(backend=backend):
        found = potto.grad(getattr(FOLDS, name))(parameter, float(n))
    with mp.workdps(DIGITS):
        state = in_digits(name, parameter, n)
        sides = (found.value, found.error), (found.tangent, found.tangent_error)
        for place, (values, errors) in enumerate(sides):
            for value, error, pair in zip(parts(values), parts(errors), state, strict=True):
                assert abs(mpf(float(value)) - pair[place]) <= error


def test_a_bound_does_not_grow_where_the_state_does_not() -> None:
    assert FOLDS.settling(2.5, 10000.0).error < 1e-14
    assert max(FOLDS.turning(1.0, 10000.0).error) < 1e-10
    growing = FOLDS.growing(1.0, 10000.0)
    assert all(error < 1e-10 * abs(value) for value, error in zip(growing.value, growing.error, strict=True))
    slope = potto.grad(FOLDS.turning)(1.0, 10000.0)
    assert all(e < 1e-8 * abs(t) for t, e in zip(slope.tangent, slope.tangent_error, strict=True))


STEPPED = potto.compile("""
def stopping(k, n)
    fold (x, v) = (1, 0) for i in 1..n (let w = v - 0.1*k*x in let y = x + 0.1*w in if y < 0 then (-y, -w) else (y, w))
def nested(k, n)
    s = fold s = ((k, 1), 2) for i in 0..n-1 (((s.0.1/2, 0.3*s.0.0 + k*i), min(s.1, s.0.0)))
    (s.0.0, s.0.1, s.1)
def turned_back(k, n) fold s = k for i in 1-n..0 (if i < -2 then 0.9*s + i else s - k*i)
def still(k, n) fold (s, t) = (k, 0.5) for i in 1..n ((t, 0.25))
levels = [0.5, -1, 2, 0.25]
def reading(k, n) fold s = k for i in 1..n (let d = levels[i - 4*floor(i/4)] in if s < d then s/2 + d*k else -s/4)
def guarded(k, n) fold s = k for i in 1..n (if s < 0 then s + levels[i] else s/2)
def bounded(k, n) fold s = 1 for i in 1..n (clamp(s*k, -3, 3) - abs(s)/4)
""")


@pytest.mark.parametrize("name", ["stopping", "nested", "turned_back", "still", "bounded", "reading", "guarded"])
@given(st.lists(st.floats(0.1, 2), min_size=1, max_size=20), st.integers(1, 30))
@settings(max_examples=15)
def test_machine_code_takes_the_steps_that_numpy_takes(name: str, ks: list[float], n: int) -> None:
    """Nothing but arithmetic: to the last bit, for one member and for a batch of any size."""
    step = getattr(STEPPED, name)
    for k in (ks[0], np.array(ks)):
        by: dict[str, Any] = {}
        for backend in ("numpy", "native"):
            with potto.settings(backend=cast("Any", backend)):
                found = potto.grad(step, "k")(k, float(n))
            by[backend] = [found.value, found.error, found.tangent, found.tangent_error]
        assert np.array_equal(by["numpy"][0], by["native"][0])
        for one, other in zip(by["numpy"], by["native"], strict=True):
            np.testing.assert_allclose(np.array(one), np.array(other), rtol=1e-12, atol=0)


def test_steps_read_what_the_array_holds_at_each() -> None:
    """A filter over data of a batch: against the same in numpy, and its derivative by each element."""
    smooth = potto.compile("""
def smooth(xs: [n] Real, r) fold s = xs[0] for i in 1..n-1 (s + r*(xs[i] - s) + 0.1*(xs[i] - xs[i - 1]))
""").smooth
    xs, r = np.sin(np.arange(200.0)), np.array([0.1, 0.5, 0.9])
    wanted, slope = np.full(3, xs[0]), np.zeros(3)
    for before, now in pairwise(xs):
        wanted, slope = wanted + r * (now - wanted) + 0.1 * (now - before), slope * (1 - r) + (now - wanted)
    for backend in ("numpy", "native"):
        with potto.settings(backend=cast("Any", backend)):
            found = potto.grad(smooth, "r")(xs, r)
            swept = potto.grad(smooth, "xs")(xs, 0.5)
        np.testing.assert_allclose(found.value, wanted, rtol=1e-13)
        np.testing.assert_allclose(found.tangent, slope, rtol=1e-12)
        by_hand = [0.6 * 0.5 ** (199 - i) - 0.1 * 0.5 ** (198 - i) for i in range(1, 199)]
        np.testing.assert_allclose(swept.tangent, [0.5**199 - 0.1 * 0.5**198, *by_hand, 0.6], rtol=1e-12, atol=1e-300)


def test_what_is_lost_always_in_one_direction_is_bounded() -> None:
    found = FOLDS.tenths(0.1, 10000.0)
    off = abs(mpf(found.value) - 10000 * mpf(0.1))
    assert off > 1e-10  # far more than random signs would make of it
    assert off <= found.error < 1e-9


def test_whole_numbers_are_exact() -> None:
    found = FOLDS.counting(1000.0)
    assert (found.value, found.error) == (500500.0, 0.0)


@pytest.mark.parametrize("steps", [5, 200])
def test_a_state_of_many_numbers(steps: int) -> None:
    start, r = np.sin(0.3 * np.arange(30)), 0.2
    found = potto.grad(FOLDS.cooling, "r")(start, r, float(steps))
    with mp.workdps(50):
        u, du = [mpf(x) for x in start], [mpf(0)] * 30

        def bent(row: list[Any]) -> list[Any]:
            return [row[min(j + 1, 29)] - 2 * row[j] + row[max(j - 1, 0)] for j in range(30)]

        for _ in range(steps):
            du = [a + b + mpf(r) * c for a, b, c in zip(du, bent(u), bent(du), strict=True)]
            u = [a + mpf(r) * b for a, b in zip(u, bent(u), strict=True)]
        assert all(abs(mpf(v) - w) <= e for v, e, w in zip(found.value, found.error, u, strict=True))
        assert all(abs(mpf(v) - w) <= e for v, e, w in zip(found.tangent, found.tangent_error, du, strict=True))
    assert found.error.max() < 1e-12
    assert found.tangent_error.max() < 1e-9


# Products, least, largest

numbers = st.lists(st.integers(-3, 3).map(float), min_size=1, max_size=6)


@given(numbers, st.sampled_from([0.0, 1.0, -2.0]))
def test_a_product_is_differentiated_where_factors_are_zero(xs: list[float], k: float) -> None:
    found = potto.grad(FOLDS.factors, ["xs", "k"])(np.array(xs), k)
    others = [float(np.prod([x + k for j, x in enumerate(xs) if j != i])) for i in range(len(xs))]
    assert found.value == float(np.prod(np.array(xs) + k))
    assert found["xs"].tolist() == others
    assert found["k"] == sum(others)


@given(st.lists(st.floats(-3, 3), min_size=1, max_size=6, unique=True), st.floats(0.1, 2))
def test_least_and_largest_move_with_the_one_that_is_taken(xs: list[float], k: float) -> None:
    array = np.array(xs)
    all_of_them = k * array**2 - array
    for function, at in ((FOLDS.least, np.argmin(all_of_them)), (FOLDS.most, np.argmax(all_of_them))):
        found = potto.grad(function, ["xs", "k"])(array, k)
        rest = np.delete(all_of_them, at)
        if np.any(np.abs(rest - all_of_them[at]) < 1e-9):
            continue  # either may be taken
        slopes = np.zeros(len(xs))
        slopes[at] = 2 * k * xs[at] - 1
        assert found.value == pytest.approx(all_of_them[at], rel=1e-14, abs=1e-14)
        assert found["xs"] == pytest.approx(slopes, rel=1e-14, abs=1e-14)
        assert found["k"] == pytest.approx(xs[at] ** 2, rel=1e-14, abs=1e-300)


@pytest.mark.parametrize("op", ["max", "min"])
def test_where_several_are_the_greatest_or_the_least_both_derivatives_are_told(op: str) -> None:
    """Of t, 2*t and 0*t at t = 0, written out or not, by t alone or by every number, to either side."""
    m = potto.compile(f"""
def f(xs: [n] Real, t) {op} i in 0..n-1 (xs[i]*t)
def g(t) {op}(t, 2*t, 0*t)
def h(t) sum k in 1..2 (k*({op} i in 1..3 ((3 - i)*t))) - ({op} i in 0..2 (i*t))
def whole(t) integral [0, 1] 3*u*({op} i in 0..2 (i*t)) d(u)
def first(xs: [n] Real) {op} x in xs (x)
""")
    backward, forward = (0, 2) if op == "max" else (2, 0)
    xs = np.array([1.0, 2, 0])
    found = [potto.grad(m.g)(0.0), potto.grad(m.f, "t")(xs, 0.0), potto.jvp(m.f, {"t": 1.0})(xs, 0.0)]
    found += [m.eval("deriv(h)((0, 1))"), m.eval("deriv(whole)((0, 1))")]
    for each, times in zip(found, (1, 1, 1, 2, 1.5), strict=True):  # of h 1 + 2 - 1 times, of `whole` 3/2
        (note,) = each.notes
        assert (note.backward, note.forward) == (times * backward, times * forward)
        assert each.tangent in (note.backward, note.forward)
    wide = potto.grad(m.f, ["xs", "t"])(np.tile(xs, 5), 0.0)  # for so many a tape is tried first
    assert wide.tangent[1] in (backward, forward) and not wide.tangent[0].any() and wide.notes
    assert potto.grad(m.first)(np.ones(20)).tangent.tolist() == [1] + [0] * 19  # one of them is taken


def test_a_product_of_a_batch() -> None:
    found = potto.grad(FOLDS.factors, "k")(np.array([1.0, 0.0, 3.0]), np.array([0.0, 0.5]))
    assert found.value.tolist() == [0.0, 1.5 * 0.5 * 3.5]
    assert found.tangent.tolist() == [3.0, 0.5 * 3.5 + 1.5 * 3.5 + 1.5 * 0.5]


# Forward and reverse

elements = st.lists(st.floats(-1, 1), min_size=1, max_size=5)


def both_ways(function: Any, wrt: list[str], *args: Any) -> tuple[Any, Any]:
    found = []
    for many in (1 << 30, 1):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(derived_calls, "MANY", many)
            found.append(potto.grad(function, wrt)(*args))
    return found[0], found[1]


def must_agree(forward: Any, reverse: Any) -> None:
    for name in forward.wrt:
        off = np.abs(np.subtract(forward[name], reverse[name]))
        assert np.all(off <= 1e-12 * (1 + np.abs(forward[name])))


@given(st.sampled_from(["along", "kept", "factors", "least", "most"]), elements, st.floats(0.2, 1.5))
def test_forward_is_reverse(name: str, xs: list[float], k: float) -> None:
    must_agree(*both_ways(getattr(FOLDS, name), ["xs", "k"], np.array(xs), k))


@given(st.sampled_from(["along", "kept", "factors", "most"]), elements, st.floats(0.2, 1.5), st.floats(0.2, 1.5))
def test_forward_is_reverse_over_a_batch(name: str, xs: list[float], k: float, other: float) -> None:
    must_agree(*both_ways(getattr(FOLDS, name), ["xs", "k"], np.array(xs), np.array([k, other])))


def test_bounds_that_differ_over_a_batch() -> None:
    k, n = np.array([0.3, 0.4, 0.3]), np.array([5.0, 3.0, 0.0])
    forward, reverse = both_ways(FOLDS.within, ["k"], k, n)
    must_agree(forward, reverse)
    for place in range(3):
        one = potto.grad(FOLDS.within, "k")(k[place], n[place])
        assert forward.value[place] == pytest.approx(one.value, rel=1e-14, abs=0)
        assert forward.tangent[place] == pytest.approx(one.tangent, rel=1e-13, abs=0)


def test_reverse_costs_as_much_as_some_values_however_many_steps() -> None:
    """Ten thousand elements, a step each: every derivative is known, 0.9^(steps that are left) 2 x."""
    swept = potto.compile("def f(xs: [n] Real) fold s = 0 for i in 0..n-1 (0.9*s + xs[i]^2)")
    xs = np.linspace(0.5, 1.5, 10000)
    found = potto.grad(swept.f)(xs)
    wanted = 2 * xs * 0.9 ** np.arange(9999, -1, -1.0)
    assert np.all(np.abs(found.tangent - wanted) <= 1e-12 * wanted + 1e-300)
    assert found.tangent_error[-1] < 1e-13


# The same program written out


@given(elements, st.floats(0.2, 1.5))
def test_a_fold_is_its_steps_written_out(xs: list[float], k: float) -> None:
    state = "k", "1"
    lines = []
    for i in range(len(xs)):
        s, p = state
        state = f"s{i}", f"p{i}"
        last = xs[len(xs) - 1 - i]
        lines.append(f"let s{i} = {s}*cos(k) + ({xs[i]!r})^2 in let p{i} = {p} - {s}*({last!r})/3 in")
    written = potto.compile(f"def f(k) {' '.join(lines)} ({state[0]}, {state[1]})")
    long, short = potto.grad(written.f)(k), potto.grad(FOLDS.along, "k")(np.array(xs), k)
    assert short.value == pytest.approx(long.value, rel=1e-13, abs=1e-13)
    assert short.tangent == pytest.approx(long.tangent, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("size", [1, 2, 5])
def test_every_index_at_every_bound(size: int) -> None:
    element = potto.compile("def at(xs: [n] Real, i) xs[i]").at
    xs = np.arange(10.0, 10.0 + size)
    assert [element(xs, float(i)).value for i in range(size)] == xs.tolist()
    assert element(xs, np.arange(float(size))).value.tolist() == xs.tolist()
    for i in (-1.0, float(size), size + 5.0):
        with pytest.raises(potto.PottoError, match="P0511"):
            element(xs, i)
    with pytest.raises(potto.PottoError, match="P0512"):
        element(xs, 0.5)


@pytest.mark.parametrize("way", ["forward", "reverse"])
def test_more_steps_than_are_looked_at_at_once_are_taken_in_stretches(way: str, monkeypatch: Any) -> None:
    """A rotation by k at every step: after n of them (cos(n k), sin(n k)). Errors are no larger than those of all steps
    at once, but for what is forgotten of their signs at six places."""
    text = """
def turned(k, n)
    (x, y) = fold (x, y) = (1, 0) for i in 1..n ((x*cos(k) - y*sin(k), x*sin(k) + y*cos(k)))
    x
"""

    def answer() -> Any:
        f = potto.compile(text).turned
        if way == "forward":
            return potto.deriv(f)((0.3, 1.0), (600.0, 0.0))
        monkeypatch.setattr(derived_calls, "MANY", 0)
        return potto.grad(f, "k")(0.3, 600.0)

    whole = answer()
    monkeypatch.setattr(folds, "LEAST", 64)
    monkeypatch.setattr(linear, "MOST_WORK", 8 * 100)
    found = answer()
    assert abs(found.value - math.cos(180)) <= found.error <= 4 * whole.error < 2e-12
    assert abs(found.tangent + 600 * math.sin(180)) <= found.tangent_error <= 4 * whole.tangent_error < 4e-9


THERMOSTAT = """
def after(s, t, h, n) fold s = s for i in 1..n (if [s < t] then s + h else 0.5*s)
def below(t, h, n) integral [0, 1] [after(s, t, h, n) < 0.6] d(s)
def mean(t, h, n) integral [0, 1] after(s, t, h, n) d(s)
"""


@pytest.mark.parametrize("steps", [1, 3, 9])
def test_a_jump_at_each_step_within_a_condition(steps: int) -> None:
    """Which states end below a number: exactly, from the pieces on which the last state is affine."""
    module = potto.compile(THERMOSTAT)
    t, h = 0.55, 0.17
    pieces = [(0.0, 1.0, 1.0, 0.0)]  # from, to, and the state there as slope*s + rest
    for _ in range(steps):
        stepped = []
        for low, high, slope, rest in pieces:
            cut = min(max((t - rest) / slope, low), high)
            stepped += [(low, cut, slope, rest + h), (cut, high, slope / 2, rest / 2)]
        pieces = [piece for piece in stepped if piece[0] < piece[1]]
    ends = [(low, min(high, max(low, (0.6 - rest) / slope))) for low, high, slope, rest in pieces]
    assert module.below(t, h, steps) == pytest.approx(sum(high - low for low, high in ends), abs=1e-13)
    mean = sum((high - low) * (slope * (low + high) / 2 + rest) for low, high, slope, rest in pieces)
    assert module.mean(t, h, steps) == pytest.approx(mean, abs=1e-13)
