"""What is proved before any evaluation holds: enclosures hold all values, and rules err by no more than their bounds.

Terms are drawn by a seeded generator, evaluated by a small evaluator of this file's own over complex numpy arrays, and
integrated for reference by Gauss rules of 40 nodes in each variable. Rules are asked for with few digits, so that what
they err is far above rounding.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

from potto.core.terms import Const, Prim, Term, Var, add, const, div, mul, neg, pow_, prim, sub, var
from potto.integrate.rules.complex_enclosures import Form, enclosed
from potto.integrate.rules.proved_orders import FrameCell, Region, proved, proved_of_each

OPS: dict[str, Callable[..., Any]] = {
    "add": lambda *a: sum(a[1:], a[0]),
    "mul": lambda *a: np.prod(np.broadcast_arrays(*a), axis=0),
    "div": np.divide,
    "neg": np.negative,
    "pow": np.power,
    "sqrt": np.sqrt,
    "exp": np.exp,
    "expm1": lambda x: np.exp(x) - 1,
    "log": np.log,
    "log1p": lambda x: np.log(1 + x),
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "sinh": np.sinh,
    "cosh": np.cosh,
    "tanh": np.tanh,
    "atan": np.arctan,
}
ENTIRE = ("sin", "cos", "exp", "expm1", "sinh", "cosh", "tanh", "atan")


def value(term: Term, env: Mapping[str, Any]) -> Any:
    match term:
        case Const():
            return np.complex128(term.value)
        case Var():
            return env[term.name]
        case Prim():
            return OPS[term.op](*(value(a, env) for a in term.args))
    raise TypeError(term)


def drawn(r: random.Random, names: tuple[str, ...], depth: int) -> Term:
    """A term over some variables; what stands under a root, a logarithm or a fraction bar is mostly away from 0."""
    if depth == 0:
        return var(r.choice(names)) if r.random() < 0.75 else const(round(r.uniform(-2, 2), 2))
    part = lambda: drawn(r, names, depth - 1)  # noqa: E731
    match r.randrange(8):
        case 0 | 1:
            return add(part(), part())
        case 2:
            return mul(part(), part())
        case 3:
            return sub(part(), neg(part()))
        case 4:
            return div(part(), add(part(), const(r.choice([1.5, 2.0, 4.0]))))
        case 5:
            return pow_(add(part(), const(3.0)), const(r.choice([2.0, 3.0, -1.0, -2.0, 0.5, -1.5])))
        case 6:
            return prim(r.choice(["sqrt", "log", "log1p"]), add(part(), const(r.choice([2.0, 3.0, 5.0]))))
        case _:
            return prim(r.choice(ENTIRE), part())


@pytest.mark.parametrize("seed", range(3))
def test_an_enclosure_holds_every_value(seed: int) -> None:
    r, rng = random.Random(seed), np.random.default_rng(seed)
    checked = 0
    for _ in range(60):
        term = drawn(r, ("x", "y"), r.randrange(1, 5))
        h = np.array([[r.choice([0.1, 0.3, 1.0, 2.0])], [r.choice([0.05, 0.2, 0.5])]])
        middle = rng.uniform(-1, 1, 2)
        unit = np.eye(2)[:, :, None]
        env = {n: Form(np.float64(m), unit[i], 0.0, h) for i, (n, m) in enumerate(zip("xy", middle, strict=True))}
        with np.errstate(all="ignore"):
            (form,) = enclosed((term,), env, {}, h)
        if not np.isfinite(form.most).all():
            continue
        s = h * np.sqrt(rng.uniform(0, 1, (2, 400))) * np.exp(2j * np.pi * rng.uniform(0, 1, (2, 400)))
        s[:, :200] *= h / np.abs(s[:, :200])  # half of them on the rim
        with np.errstate(all="ignore"):
            at = value(term, {n: m + s[i] for i, (n, m) in enumerate(zip("xy", middle, strict=True))})
        linear = form.m + (0 if form.g is None else (form.g * s).sum(axis=0))
        assert (np.abs(at - linear) <= np.asarray(form.r) * (1 + 1e-9) + 1e-12 * np.abs(at)).all(), term
        checked += 1
    assert checked > 25


def integral(term: Term, cell: FrameCell, frames: list[list[Term]], c: float, orders: tuple[int, ...]) -> float:
    """The product rule over one cell."""
    rules = [np.polynomial.legendre.leggauss(n) for n in orders]
    env: dict[str, Any] = {"c": np.complex128(c)}
    weight: Any = 1.0
    for i, (name, (low, high)) in enumerate(zip("xy", cell.rows, strict=False)):
        u = (rules[i][0] + 1).reshape([-1] + [1] * (len(orders) - 1 - i)) / 2
        lo, hi = value(frames[i][low], env), value(frames[i][high], env)
        env[name] = lo + (hi - lo) * u
        weight = weight * (hi - lo) * (rules[i][1] / 2).reshape(u.shape)
    return float(np.sum(weight * value(term, env)).real)


def error(region: Region, term: Term, cell: FrameCell, frames: list[list[Term]], c: float) -> float:
    orders = (region.outer[0], *region.inner)
    return integral(term, cell, frames, c, orders) - integral(term, cell, frames, c, (40,) * len(orders))


@pytest.mark.parametrize("seed", range(4))
def test_a_rule_errs_by_no_more_than_was_proved(seed: int) -> None:
    """The value anywhere in the region of the parameter, and the derivative, by differences of the error itself."""
    r = random.Random(seed)
    x, c = var("x"), var("c")
    bounds = [[const(0.0), add(c, const(0.3))], [mul(c, x), add(const(1.0), mul(const(0.5), x))]]
    checked = largest = 0.0
    for _ in range(30):
        count = r.choice([1, 2])
        term = drawn(r, (*"xy"[:count], "c"), r.randrange(2, 5))
        frames, cell = bounds[:count], FrameCell(((0, 1),) * count, term)
        middle, radius = r.uniform(0.3, 0.7), 2.0**-6
        with np.errstate(all="ignore"):
            region = proved("xy"[:count], frames, [cell], {"c": middle}, {"c": radius}, r.choice([1e-3, 1e-6, 1e-8]))
            if region is None:
                continue
            size = abs(integral(term, cell, frames, middle, (12,) * count)) + 1.0
            for shift in (-1.0, 0.0, 0.6):
                at = middle + shift * radius
                off = error(region, term, cell, frames, at)
                assert abs(off) <= region.error + 1e-13 * size, term
                step = 1e-4 * radius
                rate = error(region, term, cell, frames, at + step) - error(region, term, cell, frames, at - step)
                assert abs(rate) / (2 * step) <= region.rate({"c": 1.0}) + 1e-13 * size / step, term
                largest = max(largest, abs(off) / region.error if region.error > 1e-11 else 0.0)
        checked += 1
    assert checked > 8
    assert largest > 1e-7  # the bound is not so far off that nothing was tested


@np.errstate(all="ignore")
def test_many_regions_at_once_are_proved_as_one_by_one() -> None:
    """The same nodes and, to rounding, the same bounds; of a polynomial no variable takes more than it is known to."""
    x, y, c = var("x"), var("y"), var("c")
    frames = [[const(0.0), add(c, const(0.3))], [mul(c, x), add(const(1.0), x)]]
    cell = FrameCell(((0, 1), (0, 1)), mul(add(const(2.0), mul(x, y)), prim("exp", mul(c, y))))
    middles, radius, tolerance = np.array([0.3, 0.5, 0.9]), {"c": 2.0**-6}, 1e-10
    at_once = proved_of_each("xy", frames, cell, {"c": middles}, radius, (None, None), tolerance)
    for number, middle in enumerate(middles):
        alone = proved("xy", frames, [cell], {"c": float(middle)}, radius, tolerance)
        assert alone is not None
        assert tuple(at_once.nodes[number]) == (*alone.outer, *alone.inner)
        assert at_once.error[number] == pytest.approx(alone.error, rel=1e-12)
    known = proved_of_each("xy", frames, cell, {"c": middles}, radius, (1, None), tolerance)
    assert (known.nodes[:, 0] == 1).all() and (known.nodes[:, 1] <= at_once.nodes[:, 1]).all()
