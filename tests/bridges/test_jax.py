"""`potto.to_jax` under JAX itself. `make test-bridges` installs it; without it these tests are skipped, and say so."""

from __future__ import annotations

import math
import pickle
from typing import Any

import numpy as np
import pytest

import potto
from potto.bridges.flat import FlatFunction

jax = pytest.importorskip("jax", reason="JAX is not installed: `make test-bridges` runs these tests")
jnp = jax.numpy

m = potto.compile(r"""
record Lens(width: Real, height: Real)

# How much of a field is lit.
def area(a, c)
    integral [0, 1] a*[x < c^2]*exp(x) d(x)

def quadratic(xs: [n] Real, p: (Real, Real), k)
    k*sum i in 0..n-1 ((i + 1)*xs[i]^2) + p.0^2*p.1

def two(a, b)
    (a*b, a^2)

def lens(q: Lens, t)
    q.width*q.height^2*t

def shaded(shader)(c)
    integral [0, 1] shader(x)*[x < c] d(x)

def noisy(c)
    integral [0, 1] [x < c] d(x)

square = \x . x^2
""")
E = math.exp(0.25)


@pytest.fixture(autouse=True)
def doubles() -> Any:
    before = jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", True)
    yield
    jax.config.update("jax_enable_x64", before)


@pytest.fixture(scope="module")
def area() -> Any:
    return potto.to_jax(m.area)


def test_values_and_derivatives(area: Any) -> None:
    assert area(2.0, 0.5) == pytest.approx(2 * (E - 1), rel=1e-12)
    assert area(c=0.5, a=2.0) == area(2.0, 0.5)
    assert jax.grad(area, (0, 1))(2.0, 0.5) == pytest.approx((E - 1, 2 * E), rel=1e-10)
    assert jax.jvp(area, (2.0, 0.5), (1.0, 3.0))[1] == pytest.approx(E - 1 + 6 * E, rel=1e-10)
    assert jax.vjp(area, 2.0, 0.5)[1](2.0) == pytest.approx((2 * E - 2, 4 * E), rel=1e-10)
    assert np.array(jax.hessian(area, (0, 1))(2.0, 0.5)) == pytest.approx(np.array([[0, E], [E, 6 * E]]), abs=1e-9)
    assert np.array(jax.jit(jax.hessian(area, (0, 1)))(2.0, 0.5))[1, 1] == pytest.approx(6 * E)
    assert area.__name__ == "area" and "field" in area.__doc__


def test_they_pickle() -> None:
    area = pickle.loads(pickle.dumps(potto.to_jax(m.area, wrt=["c"], error=True)))
    assert area.__name__ == "area" and "to_jax" in repr(area)
    value, off = area(2.0, 0.5)
    assert value == pytest.approx(2 * (E - 1), rel=1e-12) and 0 < off < 1e-9
    slopes = jax.jit(jax.vmap(jax.grad(lambda c: area(2.0, c)[0])))(jnp.array([0.5, 0.2]))
    assert slopes == pytest.approx(np.array([2 * E, 0.8 * math.exp(0.04)]), rel=1e-10)


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("area", (2.0, 0.5)),
        ("quadratic", (np.arange(1.0, 4.0), (1.0, 2.0), 1.5)),
        ("quadratic", (np.arange(1.0, 4.0), np.array([1.0, 2.0]), 1.5)),
        ("two", (1.5, 2.0)),
        ("lens", ({"width": 1.5, "height": 2.0}, 0.5)),
    ],
)
def test_the_checks_of_jax_itself(name: str, arguments: Any) -> None:
    from jax.test_util import check_grads

    check_grads(potto.to_jax(getattr(m, name)), jax.tree.map(jnp.asarray, arguments), order=2)


def test_a_batch_is_one_call(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []
    slopes = FlatFunction.slopes
    monkeypatch.setattr(FlatFunction, "slopes", lambda self, *args: calls.append(1) or slopes(self, *args))
    area, cs = potto.to_jax(m.area), jnp.linspace(0.1, 0.9, 50)
    found = jax.jit(jax.vmap(jax.grad(area, 1), (None, 0)))(2.0, cs)
    assert found == pytest.approx(np.array(4 * cs * jnp.exp(cs**2)), rel=1e-10)
    assert len(calls) == 1
    inner = jax.vmap(lambda a: jax.vmap(lambda c: area(a, c))(cs))(jnp.arange(3.0))
    assert inner == pytest.approx(np.outer(np.arange(3), np.exp(np.array(cs) ** 2) - 1), rel=1e-10)
    assert area(2.0, cs) == pytest.approx(np.array(2 * (jnp.exp(cs**2) - 1)), rel=1e-12)


def test_arrays_with_a_batch_in_front() -> None:
    quadratic = potto.to_jax(m.quadratic)
    xs = jnp.arange(12.0).reshape(4, 3)
    slopes = jax.vmap(jax.grad(quadratic), (0, None, None))(xs, (1.0, 2.0), 2.0)
    assert slopes == pytest.approx(4 * np.array([1.0, 2.0, 3.0]) * np.array(xs))


def test_functions_are_given_at_once_and_errors_come_along() -> None:
    shaded = potto.to_jax(m.shaded, given={"shader": m.square}, error=True)
    value, error = shaded(0.6)
    assert value == pytest.approx(0.072, abs=float(error) + 1e-15) and error >= 0
    assert jax.grad(lambda c: shaded(c)[0])(0.6) == pytest.approx(0.36)
    assert jax.grad(lambda c: shaded(c)[1])(0.6) == 0
    assert jax.jit(potto.to_jax(m.shaded(m.square)))(0.6) == pytest.approx(0.072)


def test_what_is_not_differentiated_by_stands_still() -> None:
    area = potto.to_jax(m.area, wrt="c")
    assert jax.grad(area, (0, 1))(2.0, 0.5) == pytest.approx((0, 2 * E), rel=1e-10)


def test_single_precision_goes_in_and_comes_out() -> None:
    jax.config.update("jax_enable_x64", False)
    found = potto.to_jax(m.area)(2.0, 0.5)
    assert found.dtype == jnp.float32 and float(found) == pytest.approx(2 * (E - 1), rel=1e-6)


def test_third_derivatives_are_refused(area: Any) -> None:
    with pytest.raises(potto.PottoError, match="no third ones"):
        jax.grad(jax.grad(jax.grad(area)))(2.0, 0.5)


def test_a_fit_with_optax() -> None:
    optax = pytest.importorskip("optax", reason="optax is not installed: `make test-bridges` runs this test")
    noisy = potto.to_jax(m.noisy)
    step, state = optax.adam(0.05), None
    c = jnp.array(0.9)
    state = step.init(c)
    loss = jax.jit(jax.value_and_grad(lambda c: (noisy(c) - 0.3) ** 2))
    for _ in range(200):
        _, slope = loss(c)
        change, state = step.update(slope, state)
        c = optax.apply_updates(c, change)
    assert c == pytest.approx(0.3, abs=1e-3)


@pytest.mark.parametrize("transform", [jax.grad, jax.jit, jax.vmap], ids=lambda t: t.__name__)
def test_what_jax_traces_is_refused_with_what_it_takes(transform: Any) -> None:
    argument = jax.numpy.ones(3) if transform is jax.vmap else 0.3
    with pytest.raises(potto.PottoError, match=r"`potto\.to_jax\(f\)` makes `f` one"):
        transform(potto.compile("def f(t) t^2").f)(argument)
