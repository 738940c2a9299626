"""Summands that differ in their numbers alone are one batch, however written, with the answers of each alone."""

from __future__ import annotations

import math

import numpy as np
import pytest

import potto

N = 60
# What may differ between two ways of adding up N numbers, as a part of their sum.
ROUNDING = N * 2.0**-52


def test_written_out_as_a_sum_and_through_calls() -> None:
    """`k*[x < k*t/(N + 1)]` for k to N: t * the sum of k^2/(N + 1)."""
    ways = {
        "written": " + ".join(f"{k}*[x < {k}*t/{N + 1}]" for k in range(1, N + 1)),
        "called": " + ".join(f"step(x, {k}, t)" for k in range(1, N + 1)),
        "mean": f"(sum k in 1..{N} (step(x, k, t)))*2/2",
        "looped": f"sum k in 1..{N} (k*[x < k*t/{N + 1}])",
    }
    definitions = "\n".join(f"def {name}(t) integral [0, 1] ({body}) d(x)" for name, body in ways.items())
    m = potto.compile(f"def step(x, k, t) k*[x < k*t/{N + 1}]\n{definitions}")
    exact = math.fsum(k * k / (N + 1) for k in range(1, N + 1))
    found = {name: potto.deriv(getattr(m, name))((0.9, 1.0)) for name in ways}
    for answer in found.values():
        assert abs(answer.value - 0.9 * exact) <= answer.error + ROUNDING * exact and answer.error <= 1e-12 * exact
        assert abs(answer.tangent - exact) <= answer.tangent_error and answer.tangent_error <= 1e-11 * exact
        assert answer.converged and answer.evals <= 1.5 * found["looped"].evals


def test_parameters_of_their_own() -> None:
    """A gradient in N parameters, each of one summand, and one of all of them: t*(1 - exp(-a))."""
    names = [f"a{k}" for k in range(N)]
    body = " + ".join(f"t*exp(-x)*[x < {name}]" for name in names)
    f = potto.compile(f"def f(t, {', '.join(names)}) integral [0, 1] ({body}) d(x)").f
    at = {name: 0.9 * (k + 1) / N for k, name in enumerate(names)}
    answer = potto.grad(f, ["t", *names])(t=1.5, **at)
    whole = math.fsum(1 - math.exp(-a) for a in at.values())
    exact = np.array([whole, *(1.5 * math.exp(-a) for a in at.values())])
    assert np.all(np.abs(np.array(answer.tangent) - exact) <= np.array(answer.tangent_error) + 4e-16 * exact)
    assert np.max(answer.tangent_error) <= 1e-9 and answer.converged


def test_calls_of_one_function_are_one_batch() -> None:
    """Squares of (exp(a) - 1)*t - b, with calls and numbers of their own, through arithmetic around each."""
    names = [f"a{k}" for k in range(N)]
    terms = " + ".join(f"(part({name}, t) - {k / N})^2" for k, name in enumerate(names, 1))
    m = potto.compile(f"def part(a, t) integral [0, 1] t*exp(x)*[x < a] d(x)\ndef loss(t, {', '.join(names)}) {terms}")
    at, t = [0.9 * (k + 1) / N for k in range(N)], 1.5
    rests = [t * math.expm1(a) - k / N for k, a in enumerate(at, 1)]
    exact = [math.fsum(2 * rest * math.expm1(a) for rest, a in zip(rests, at, strict=True)),
             *(2 * rest * t * math.exp(a) for rest, a in zip(rests, at, strict=True))]  # fmt: skip
    value, gradient = m.loss(t, *at), potto.grad(m.loss, ["t", *names])(t, *at)
    for found in (value, gradient):
        assert abs(found.value - math.fsum(rest**2 for rest in rests)) <= found.error + ROUNDING * found.value
        assert found.converged and found.stats["integrals"] == 1
    size = max(map(abs, exact))
    for slope, error, true in zip(gradient.tangent, gradient.tangent_error, exact, strict=True):
        assert abs(slope - true) <= error + 4e-16 * size and error <= 1e-12 * size


@pytest.mark.parametrize("names", [["x"], ["x", "y", "k"]], ids=["one name", "several"])
def test_integrals_written_out_are_one_batch(names: list[str]) -> None:
    """The sum of exp(t/k) - 1 for k from 2, whatever the variables are called."""
    parts = [f"(integral [0, 1] exp({x})*[{k}*{x} < t] d({x}))" for k, x in zip(range(2, 2 + 2 * N), names * 2 * N)]
    f = potto.compile(f"def f(t) {' + '.join(parts)}").f
    value, dual = f(0.9), potto.deriv(f)((0.9, 1.0))
    exact = math.fsum(math.expm1(0.9 / k) for k in range(2, 2 + 2 * N))
    slope = math.fsum(math.exp(0.9 / k) / k for k in range(2, 2 + 2 * N))
    for found in (value, dual):
        assert abs(found.value - exact) <= found.error + 2 * ROUNDING * exact and found.error <= 1e-12
        assert found.converged and found.stats["integrals"] == 1
    assert abs(dual.tangent - slope) <= dual.tangent_error + 2 * ROUNDING * slope and dual.tangent_error <= 1e-12


def test_a_name_that_is_bound_in_one_summand_and_free_in_the_next() -> None:
    """exp(a) - 1 + exp(b) - 1 + ..., where what one is integrated over is a bound of the other."""
    f = potto.compile("""
def f(a, b)
    (integral [0, a] exp(b) d(b)) + (integral [0, b] exp(a) d(a))
    + (integral [0, a] exp(a) d(a)) + (integral [0, b] exp(b) d(b))
""").f
    found = potto.grad(f, ["a", "b"])(0.3, 0.8)
    assert found.value == pytest.approx(2 * (math.expm1(0.3) + math.expm1(0.8)), rel=1e-14, abs=0)
    assert found.tangent == pytest.approx((2 * math.exp(0.3), 2 * math.exp(0.8)), rel=1e-14, abs=0)


def test_recursions_that_add_up_calls_of_themselves() -> None:
    """Leaves of a tree, each 1 - exp(-a): as many as the depth says."""
    m = potto.compile("""
def leaf(a) integral [0, 1] exp(-x)*[x < a] d(x)
def tree(a, n)
    if n < 1 then leaf(a) else tree(a, n - 1) + tree(0.5*a, n - 1) + tree(0.5*a, n - 2)
""")

    def tree(a: float, n: int) -> tuple[float, float]:
        if n < 1:
            return -math.expm1(-a), math.exp(-a)
        (v1, s1), (v2, s2), (v3, s3) = tree(a, n - 1), tree(0.5 * a, n - 1), tree(0.5 * a, n - 2)
        return v1 + v2 + v3, s1 + 0.5 * (s2 + s3)

    found = potto.grad(m.tree, "a")(0.7, 4)
    value, slope = tree(0.7, 4)
    assert abs(found.value - value) <= found.error + ROUNDING * value
    assert abs(found.tangent - slope) <= found.tangent_error + ROUNDING * slope


def test_arrays_of_sums() -> None:
    """A sum at an array of parameters is what it is at each of them."""
    body = " + ".join(f"exp({k / N}*x)*[x < {k / N}*t]" for k in range(1, N + 1))
    f = potto.deriv(potto.compile(f"def f(t) integral [0, 1] ({body}) d(x)").f)
    t = np.array([[0.2, 0.5], [0.7, 0.95], [0.01, 0.3]])
    together = f((t, np.ones_like(t)))
    assert together.value.shape == t.shape
    for index in np.ndindex(*t.shape):
        exact = math.fsum(math.expm1(c * c * t[index]) / c for c in (k / N for k in range(1, N + 1)))
        slope = math.fsum(c * math.exp(c * c * t[index]) for c in (k / N for k in range(1, N + 1)))
        assert abs(together.value[index] - exact) <= together.error[index] + ROUNDING * exact
        assert abs(together.tangent[index] - slope) <= together.tangent_error[index] + ROUNDING * slope


def test_what_decides_formulas_stays() -> None:
    """Exponents that differ, here and through a call, are not parameters: the roots keep their closed forms."""
    parts = [f"power(x, {n})*[x^{n} < {c}*t]" for n in (1, 2, 3) for c in (0.2, 0.4, 0.6)]
    m = potto.compile(f"def power(x, n) x^n\ndef f(t) integral [0, 1] ({' + '.join(parts)}) d(x)")
    answer = potto.deriv(m.f)((0.8, 1.0))
    cuts = [((c * 0.8) ** (1 / n), n, c) for n in (1, 2, 3) for c in (0.2, 0.4, 0.6)]
    exact = math.fsum(r ** (n + 1) / (n + 1) for r, n, _ in cuts)
    slope = math.fsum(r**n * r / (n * 0.8) for r, n, _ in cuts)
    assert abs(answer.value - exact) <= answer.error + 1e-15 and answer.error <= 1e-11
    assert abs(answer.tangent - slope) <= answer.tangent_error + 1e-15 and answer.evals <= 200


@pytest.mark.parametrize("t", [0.0, 0.5])
def test_members_say_of_themselves_what_they_have_to(t: float) -> None:
    """Summands with two derivatives, or none, name their own conditions, and the rest has its answer: what is told is
    how all of them grow on both sides."""
    parts = [f"[x < {k}*t]" for k in range(1, 7)]
    m = potto.compile("\n".join(
        [f"def f(t) integral [0, 1] ({' + '.join(parts)}) d(x)"]
        + [f"def p{k}(t) integral [0, 1] {part} d(x)" for k, part in enumerate(parts)]
    ))  # fmt: skip
    whole = potto.deriv(m.f)((t, 1.0))
    single = [potto.deriv(getattr(m, f"p{k}"))((t, 1.0)) for k in range(6)]
    assert whole.value == math.fsum(one.value for one in single)
    (told,) = whole.notes
    assert told.surface in {note.surface for one in single for note in one.notes}
    for side in ("backward", "forward"):
        grown = math.fsum(float(getattr(one.notes[0], side)) if one.notes else one.tangent for one in single)
        assert abs(getattr(told, side) - grown) <= 1e-12
    assert whole.converged == all(one.converged for one in single)


def test_a_sum_that_cancels_is_as_accurate_as_its_value() -> None:
    """Two hundred waves that leave a hundredth of what they are: each is to be known better than relative to itself."""
    ks = np.arange(1, 201)
    signs = (-1.0) ** ks
    body = " + ".join(f"{s}*cos({k / 200}*x)*exp(x*t)" for k, s in zip(ks, signs)) + " + [x < t]"
    answer = potto.deriv(potto.compile(f"def f(t) integral [0, 1] ({body}) d(x)").f)((0.7, 1.0))

    def wave(w: float, t: float) -> complex:
        z = complex(t, w)
        return (np.exp(z) - 1) / z

    exact = 0.7 + math.fsum(s * wave(k / 200, 0.7).real for k, s in zip(ks, signs))
    assert abs(answer.value - exact) <= answer.error + 1e-13 and answer.converged


def test_a_function_that_is_given_is_one_for_all_summands() -> None:
    """`[x < a]*f(a, x)` with parameters of their own: all share the kernels of one, also for the next function."""
    names = [f"a{k}" for k in range(N)]
    body = " + ".join(f"[x < {name}]*f({name}, x)" for name in names)
    m = potto.compile(f"""def g({", ".join(names)}, f) integral [0, 1] ({body}) d(x)
plus = \\(a, x) . a + x
times = \\(a, x) . a*x
def slanted(c) \\(a, x) . a + c*x
""")
    at = [0.9 * (k + 1) / N for k in range(N)]
    for f, value, slope in (  # of each summand, with its value of a
        (m.plus, lambda a: 1.5 * a**2, lambda a: 3 * a),
        (m.times, lambda a: a**3 / 2, lambda a: 1.5 * a**2),
        (m.slanted(3.0), lambda a: 2.5 * a**2, lambda a: 5 * a),
    ):
        with potto.settings(backend="numpy"):
            answer = potto.grad(m.g, names)(*at, f)
        whole, exact = math.fsum(map(value, at)), np.array(list(map(slope, at)))
        assert abs(answer.value - whole) <= answer.error + ROUNDING * whole and answer.converged
        assert np.all(np.abs(np.array(answer.tangent) - exact) <= np.array(answer.tangent_error) + ROUNDING)
        assert answer.stats["kernels compiled"] < N // 2


def test_a_function_that_moves_moves_all_summands() -> None:
    names = [f"a{k}" for k in range(N)]
    body = " + ".join(f"[x < {name}]*f({name}, x)" for name in names)
    given = ", ".join(names)
    m = potto.compile(f"""def g({given}, f) integral [0, 1] ({body}) d(x)
def h(c, {given}) g({given}, \\(a, x) . a + c*x)
""")
    at = [0.9 * (k + 1) / N for k in range(N)]
    answer = potto.grad(m.h, ["c", *names])(3.0, *at)
    exact = np.array([math.fsum(a * a / 2 for a in at), *(5 * a for a in at)])
    assert np.all(np.abs(np.array(answer.tangent) - exact) <= np.array(answer.tangent_error) + ROUNDING)


def test_what_a_function_decides_by_its_argument_stays() -> None:
    """The length of a sum: `f(k, x)` is k*x, so that a summand is k/2*(k/8)^2."""
    body = " + ".join(f"[x < {k}/8]*f({k}, x)" for k in range(1, 9))
    m = potto.compile(f"def g(f) integral [0, 1] ({body}) d(x)\nlong = \\(n, x) . sum i in 1..n (x)\n")
    answer = m.g(m.long)
    exact = math.fsum(k**3 / 128 for k in range(1, 9))
    assert abs(answer.value - exact) <= answer.error <= 1e-12 and answer.converged
