"""Gradients by many parameters, which are swept back from the answer: closed forms, what they cost, what they tell.

Costs are counted in evaluations and kernels, never timed. Tolerances: 1e-11 of the largest derivative, as for integrals
of polynomials over polygons elsewhere; the errors beside the numbers must cover what is off.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import potto
from potto.kernels import compile as kernels

EDGE = "[({2} - {0})*(y - {1}) - ({3} - {1})*(x - {0}) > 0]"
INSIDE = "*".join(EDGE.format(*f"{a} {b} {c} {d}".split()) for a, b, c, d in
                  (("ax", "ay", "bx", "by"), ("bx", "by", "cx", "cy"), ("cx", "cy", "ax", "ay")))  # fmt: skip
TRIANGLE = f"def tri(ax, ay, bx, by, cx, cy, s) integral ([0, 1], [0, 1]) s*{INSIDE} d(x, y)\n"
PLACES = (0.1, 0.1, 0.9, 0.2, 0.3, 0.8, 1.0)


def mesh(count: int) -> tuple[str, list[str], Any]:
    """The loss of so many triangles, its parameters, and where they are: (triangles, 7)."""
    names = [[f"{c}{i}" for c in ("ax", "ay", "bx", "by", "cx", "cy", "s")] for i in range(count)]
    parts = " + ".join(f"(tri({', '.join(own)}) - 0.{i % 9 + 1})^2" for i, own in enumerate(names))
    flat = [name for own in names for name in own]
    numbers = np.random.default_rng(count).normal(PLACES, 0.02, (count, 7))
    return f"{TRIANGLE}def loss({', '.join(flat)})\n    {parts}\n", flat, numbers


def by_hand(numbers: Any) -> tuple[float, Any]:
    """The loss and its gradient: areas by the corners."""
    corners, s = numbers[:, :6].reshape(-1, 3, 2), numbers[:, 6]
    after, before = np.roll(corners, -1, axis=1), np.roll(corners, 1, axis=1)
    area = 0.5 * (corners[..., 0] * after[..., 1] - corners[..., 1] * after[..., 0]).sum(axis=1)
    moved = 0.5 * np.stack([after[..., 1] - before[..., 1], before[..., 0] - after[..., 0]], axis=-1)
    off = s * area - [(i % 9 + 1) / 10 for i in range(len(s))]
    slopes = np.concatenate([s[:, None] * moved.reshape(-1, 6), area[:, None]], axis=1)
    return float((off**2).sum()), (2 * off[:, None] * slopes).ravel()


def within(found: Any, errors: Any, wanted: Any) -> None:
    off, size = np.abs(np.asarray(found) - wanted), np.max(np.abs(wanted))
    assert np.all(off <= 1e-11 * size) and np.all(off <= np.asarray(errors) + 1e-15 * size)


def test_a_mesh() -> None:
    """The gradient takes the evaluations of the value, and a triangle more takes no kernel more."""
    compiled = {}
    for count in (4, 40):
        text, names, numbers = mesh(count)
        at = dict(zip(names, numbers.ravel().tolist(), strict=True))
        loss = potto.compile(text).loss
        value, slopes = by_hand(numbers)
        plain = loss(**at)
        kernels.clear()
        found = potto.grad(loss, names)(**at)
        compiled[count] = found.stats["kernels compiled"]
        assert found.converged and found.evals <= 1.2 * plain.evals
        within(found.value, found.error, value)
        within(found.tangent, found.tangent_error, slopes)
    assert compiled[40] <= compiled[4] + 1


def test_few_directions_carry_what_an_integral_depends_on() -> None:
    """Three parameters make one number that moves: it is evaluated for that one."""
    m = potto.compile("def part(u) integral [0, 1] exp(u*x)*[x < u] d(x)\ndef f(a, b, c) part(a*b*c)")
    found, alone = potto.grad(m.f, ["a", "b", "c"])(0.8, 0.9, 1.1), potto.grad(m.part)(0.8 * 0.9 * 1.1)
    assert found.evals == alone.evals
    within(found.tangent, found.tangent_error, alone.tangent * np.array([0.9 * 1.1, 0.8 * 1.1, 0.8 * 0.9]))


NAMES = [f"x{i}" for i in range(16)]
AT = np.linspace(0.2, 0.9, 16)
HEAD = f"({', '.join(NAMES)})"
SQUARES = " + ".join(f"{name}^2" for name in NAMES)


def test_answers_that_are_tuples_and_arrays() -> None:
    text = f"def f{HEAD} ({SQUARES}, integral [0, 1] x0*[x < x1] d(x), sum k in 1..3 (k*x2*x3))"
    f = potto.compile(text).f
    wide = np.array([0.0, 0.1])
    given = [AT[0] + wide, *AT[1:].tolist()]
    matrix = potto.jacobian(f, NAMES)(*given).value
    assert matrix.shape == (2, 3, 16)
    wanted = np.zeros((2, 3, 16))
    wanted[:, 0] = 2 * AT
    wanted[:, 0, 0] += 2 * wide
    wanted[:, 1, 0], wanted[:, 1, 1], wanted[:, 2, 2], wanted[:, 2, 3] = AT[1], AT[0] + wide, 6 * AT[3], 6 * AT[2]
    within(matrix, 1e-14, wanted)
    pulled = potto.vjp(f, (0.0, wide, 1.0), NAMES)(*given)
    within(np.array(pulled.tangent), np.array(pulled.tangent_error), (wanted[:, 2] + wide[:, None] * wanted[:, 1]).T)


def test_hessians_sweep_back_what_was_differentiated_forward() -> None:
    f = potto.compile(f"def f{HEAD} ({SQUARES})^2/2 + (integral [0, 1] x0*x1*[x < x1] d(x))").f
    wanted = 2 * np.eye(16) * (AT**2).sum() + 4 * np.outer(AT, AT)
    wanted[0, 1] += 2 * AT[1]
    wanted[1, 0] += 2 * AT[1]
    wanted[1, 1] += 2 * AT[0]
    second = potto.hessian(f, NAMES)(*AT)
    within(second.value, second.error, wanted)


def test_two_sides_are_told() -> None:
    """A surface on a bound of the domain: one integral of many says so, and the others are as they are."""
    f = potto.compile(f"def f{HEAD} {SQUARES} + (integral [0, 1] x1*[x < x0] d(x))").f
    found = potto.grad(f, NAMES)(1.0, *AT[1:])
    alone = potto.grad(f, NAMES[:2])(1.0, *AT[1:])
    assert [str(note) for note in found.notes] == [str(note) for note in alone.notes] != []
    within(found.tangent[:2], found.tangent_error[:2], alone.tangent)
    within(found.tangent[2:], found.tangent_error[2:], 2 * AT[2:])


def test_functions_on_duals_that_are_written_by_hand() -> None:
    m = potto.compile(
        "def through(x, s) s(x)\ndef hand(d) (2*fst(d), 2*snd(d))\n"
        f"def f{HEAD} snd(deriv(through)((x0*x1, x1), hand)) + {SQUARES}"
    )
    found = potto.grad(m.f, NAMES)(*AT)
    within(found.tangent, found.tangent_error, 2 * AT + 2 * np.eye(16)[1])


def test_more_answers_than_parameters() -> None:
    """All derivatives are then not swept back one answer at a time; a product with a cotangent is one sweep."""
    rows = ", ".join(f"{name}*x{(i * 7) % 16} + {i}*x0" for i, name in enumerate(NAMES * 2))
    f = potto.compile(f"def f{HEAD} ({rows})").f
    wanted = np.zeros((32, 16))
    for i in range(32):
        wanted[i, i % 16] += AT[i * 7 % 16]
        wanted[i, i * 7 % 16] += AT[i % 16]
        wanted[i, 0] += i
    matrix = potto.jacobian(f, NAMES)(*AT)
    within(matrix.value, matrix.error, wanted)
    weights = np.linspace(-1, 1, 32)
    pulled = potto.vjp(f, tuple(weights.tolist()), NAMES)(*AT)
    within(pulled.tangent, pulled.tangent_error, weights @ wanted)
    within(pulled.value, pulled.error, [AT[i % 16] * AT[i * 7 % 16] + i * AT[0] for i in range(32)])


@pytest.mark.parametrize("method", ["mc", "qmc"])
def test_samples(method: Any) -> None:
    f = potto.compile(f"def f{HEAD} {SQUARES} + (integral ([0, 1], [0, 1]) x1*[x + y < x0] d(x, y))").f
    with potto.settings(method=method, samples=4000, seed=3):
        found = potto.grad(f, NAMES)(*AT)
    wanted = 2 * AT
    wanted[0] += AT[1] * AT[0]
    wanted[1] += AT[0] ** 2 / 2
    off = np.abs(np.array(found.tangent) - wanted)
    assert np.all(off <= 5 * np.array(found.tangent_error) + 1e-14)  # a drawn error is one standard deviation or two


SUMS = """
def corner(a) integral ([0, 1], [0, 1]) [x + y < a] d(x, y)
def squares(p: [n] Real) sum i in 0..n - 1 (corner(p[i])^2)
def nested(p: [n] Real) sum i in 0..n - 1 (sum j in 0..n - 1 (p[i]*corner(p[j])))
def as_many(a, m) sum i in 1..m (corner(a/i)^2)
def powers(p: [n] Real) (sum i in 0..n - 1 (p[i]^2), sum i in 0..n - 1 (p[i]^3))
"""


def test_hessians_of_sums() -> None:
    """Values and tangents of a sum are added up in one go, so that what it calls is evaluated once for both.

    Corners of triangles a^2/2. For each integral there are its value, and two of its boundary for those members that
    are solved for either variable, of which here is one: three times the value's evaluations at most.
    """
    m, p, v = potto.compile(SUMS), np.linspace(0.2, 0.9, 30), np.cos(np.arange(30.0))
    plain, found = m.squares(p), potto.hvp(m.squares, {"p": v})(p)
    within(found.tangent, found.tangent_error, 3 * p**2 * v)
    assert found.converged and found.evals <= 3 * plain.evals
    found = potto.hvp(m.nested, {"p": v})(p)
    within(found.tangent, found.tangent_error, (p * v).sum() + p * v.sum() + p.sum() * v)
    assert [potto.hvp(m.as_many, {"a": 1.0})(0.6, count).tangent for count in (0.0, 1.0)] == [0.0, pytest.approx(1.08)]


def test_two_answers_by_an_array() -> None:
    found = potto.grad(potto.compile(SUMS).powers)(p := np.linspace(0.2, 0.9, 30))
    within(found.tangent, found.tangent_error, np.stack([2 * p, 3 * p**2], axis=-1))


ROOTS = """
def roots(x: [n] Real) sum k in 0..n-1 (sqrt(x[k]))
def weighted(x: [n] Real) sum k in 0..n-1 (k*sqrt(x[k]) + x[k])
def squared(x: [n] Real) sum k in 0..n-1 (sqrt(x[k])^2)
def kinked(x: [n] Real) sum k in 0..n-1 (sqrt(x[k]^2))
"""


@pytest.mark.parametrize("count", [3, 20])
def test_elements_where_a_slope_is_infinite(count: int) -> None:
    """What is at 0 takes no other's derivative along, by few parameters or many; a factor of 0 leaves it out."""
    m, x = potto.compile(ROOTS), np.arange(float(count))
    found = potto.grad(m.roots)(x)
    assert found.tangent[0] == np.inf and not found.converged
    within(found.tangent[1:], found.tangent_error[1:], 0.5 / np.sqrt(x[1:]))
    found = potto.grad(m.weighted)(x)
    within(found.tangent, found.tangent_error, 0.5 * np.sqrt(x) + 1)  # k = x[k]


@pytest.mark.parametrize("count", [3, 20])
@pytest.mark.parametrize("name", ["squared", "kinked"])
def test_what_an_infinite_slope_makes_of_0_is_not_known(name: str, count: int) -> None:
    """sqrt(x)^2 has the slope 0 by its root, and that by x is infinite: their product is 1, and neither tells it."""
    found = potto.grad(getattr(potto.compile(ROOTS), name))(np.arange(float(count)))
    assert np.isnan(found.tangent[0]) and np.isinf(found.tangent_error[0]) and not found.converged
    within(found.tangent[1:], found.tangent_error[1:], np.ones(count - 1))
