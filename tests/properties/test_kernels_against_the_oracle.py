"""The numpy kernels equal the oracle point by point: values, tangents, and branches forced to a side.

The oracle works with 40 digits and more. Doubles are allowed 8 roundings, each as large as the term's condition makes
it: what the value changes by when every builtin's result, and pi, which no double is, is off by a relative 2^-53. Where
such a change decides which side a condition falls on (`sin(pi) > 0`), nothing is compared.
"""

from __future__ import annotations

import math
import random
from typing import Any

import numpy as np
import pytest
from how_many import examples
from mpmath import mp

from potto.calculus.surfaces.trace import Side, layout
from potto.core import terms as core
from potto.core.reference import evaluate
from potto.core.terms import Branch, Prim, Term
from potto.kernels.cells import Cell, Trace
from potto.projects.settings import DEFAULTS
from potto.runtime.evaluate import Program

NAMES = ("x", "y", "t")
POINTS = 7
EPS = 2.0**-53
# What a relative change of 2^-40 does at most to a number that is not on the edge of a condition.
ON_AN_EDGE = 2.0**-20
UNARY = ("sin", "cos", "exp", "tanh", "atan", "sinh", "cosh", "erf", "expm1", "abs", "neg", "asinh")
POSITIVE = ("sqrt", "log", "log1p")


def leaf(pick: random.Random) -> Term:
    return pick.choice([*map(core.var, NAMES), core.const(0.5), core.const(-2.0), core.const(0.3), core.PI])


def term(pick: random.Random, depth: int) -> Term:
    if not depth:
        return leaf(pick)
    a, b, at = term(pick, depth - 1), term(pick, depth - 1), pick.random()
    if at < 0.35:
        return pick.choice((core.add, core.sub, core.mul))(a, b)
    if at < 0.42:
        return core.div(a, core.add(core.ONE, core.mul(b, b)))
    if at < 0.50:
        return core.pow_(a, core.const(pick.choice((2.0, 3.0))))
    if at < 0.72:
        op = pick.choice(UNARY)
        return core.neg(a) if op == "neg" else core.prim(op, core.prim("sin", a) if op in ("exp", "sinh") else a)
    if at < 0.80:
        return core.prim(pick.choice(POSITIVE), core.add(core.const(0.5), core.mul(a, a)))
    if at < 0.88:
        return core.prim(pick.choice(("min", "max", "hypot", "atan2")), a, b)
    if at < 0.92:
        return core.if_(core.prim("lt", a, b), b, term(pick, depth - 1))
    return core.branch((a,), pick.random() < 0.5, b, term(pick, depth - 1))


def kernel(whole: Term, env: dict[str, Any], tangents: dict[str, Any] | None, trace: Trace | None) -> Cell:
    machine = Program(lambda module, name: core.ZERO).machine(DEFAULTS).with_directions(1 if tangents else 0)
    function = core.lam(tuple(sorted(whole.free)), whole)
    cells = {n: Cell(env[n], None, (tangents[n],) if tangents else ()) for n in function.params}
    with np.errstate(all="ignore"):
        value = machine.evaluate(function, cells, trace)
    assert isinstance(value, Cell)
    return value


def shaken(node: Term, pick: random.Random) -> Term:
    """The term with every builtin's result off by about a rounding, and so pi."""
    memo: dict[Term, Term] = {}
    for part in core.postorder(node):
        new = core.rebuild(part, tuple(memo[c] for c in core.children(part)))
        decides = isinstance(part, Prim) and part.op in ("lt", "le", "eq")
        if (isinstance(part, Prim) and not decides) or part is core.PI:
            new = core.prim("mul", new, core.const(1.0 + pick.choice((-1, 1)) * 2.0**-40))
        memo[part] = new
    return memo[node]


def exact(whole: Term, env: dict[str, float]) -> Any:
    return evaluate(whole, {n: env[n] for n in whole.free}, digits=40)


def allowed(whole: Term, env: dict[str, float], value: Any) -> float:
    """8 times what roundings of 2^-53 may come to; measured with 2^-40, so that no difference is lost.

    Infinite where such a rounding decides what there is.
    """
    pick = random.Random(0)
    moved = max(abs(float(exact(shaken(whole, pick), env) - value)) for _ in range(6))
    if moved > ON_AN_EDGE * (1 + abs(float(value))):
        return math.inf
    return 8 * (moved * 2.0**40 * EPS + EPS * abs(float(value)))


def points(seed: int) -> dict[str, Any]:
    generator = np.random.default_rng(seed)
    return {n: generator.uniform(-1.5, 1.5, POINTS) for n in NAMES}


def at(env: dict[str, Any], i: int) -> dict[str, float]:
    return {n: float(v[i]) for n, v in env.items()}


def check_values(seed: int) -> int:
    """Compare one term at every point; at how many of them nothing could be said."""
    whole, env, edges = term(random.Random(seed), 4), points(seed), 0
    got = np.broadcast_to(kernel(whole, env, None, None).v, (POINTS,))
    for i in range(POINTS):
        here = at(env, i)
        value = exact(whole, here)
        if mp.isfinite(value) and abs(value) < 1e150:
            bound = allowed(whole, here, value)
            edges += bound == math.inf
            assert abs(got[i] - float(value)) <= bound, (seed, i, got[i], value)
    return edges


def check_tangents(seed: int) -> None:
    """Against a difference with a step of 1e-20 in numbers of 60 digits, so good to about 1e-20."""
    whole, env = term(random.Random(seed), 3), points(seed)
    speed = dict(zip(NAMES, (1.0, -0.5, 2.0), strict=True))
    got = kernel(whole, env, {n: np.full(POINTS, v) for n, v in speed.items()}, None).t
    tangent = np.broadcast_to(0.0 if not got or got[0] is None else got[0], (POINTS,))
    for i in range(POINTS):
        here = at(env, i)
        with mp.workdps(60):
            h = mp.mpf(10) ** -20
            ahead, behind = ({n: mp.mpf(v) + k * h * speed[n] for n, v in here.items()} for k in (1, -1))
            slope = (evaluate(whole, ahead, digits=60) - evaluate(whole, behind, digits=60)) / (2 * h)
        # Derivatives are sums of many products: 1e-12 of the largest partial tells a wrong rule from a rounding.
        if mp.isfinite(slope) and abs(slope) < 1e6 and allowed(whole, here, exact(whole, here)) < math.inf:
            assert abs(tangent[i] - float(slope)) <= 1e-11 * (1 + abs(float(slope))), (seed, i, tangent[i], slope)


def check_sides(seed: int) -> None:
    """A branch forced to a side everywhere is that side in its place."""
    whole, env = term(random.Random(seed), 4), points(seed)
    sites = [(k, s.branch) for k, s in enumerate(layout(whole).sites) if isinstance(s, Side)]
    for number, branch in sites:
        for side in (True, False):
            mask = np.full(POINTS, side)
            got = np.broadcast_to(kernel(whole, env, None, {number: mask}).v, (POINTS,))
            wanted = np.broadcast_to(kernel(replaced(whole, branch, side), env, None, None).v, (POINTS,))
            # Putting the side in its place may add in another order: some roundings of numbers around 10.
            assert np.allclose(got, wanted, rtol=1e-13, atol=1e-13, equal_nan=True), (seed, number, side)


def replaced(whole: Term, branch: Branch, side: bool) -> Term:
    memo: dict[Term, Term] = {}
    for part in core.postorder(whole):
        new = core.rebuild(part, tuple(memo[c] for c in core.children(part)))
        if part is branch:
            new = memo[branch.then if side else branch.orelse]
        memo[part] = new
    return memo[whole]


@pytest.mark.parametrize("seed", range(80))
def test_values(seed: int) -> None:
    check_values(seed)


@pytest.mark.parametrize("seed", range(60))
def test_tangents(seed: int) -> None:
    check_tangents(seed)


@pytest.mark.parametrize("start", range(0, 300, 100))
def test_forced_sides(start: int) -> None:
    for seed in range(start, start + 100):
        check_sides(seed)


@pytest.mark.slow
@pytest.mark.parametrize("start", range(1000, 1000 + examples(100, 2000), 100))
def test_many_terms(start: int) -> None:
    edges = 0
    for seed in range(start, start + 100):
        edges += check_values(seed)
        check_tangents(seed)
    assert edges <= 0.02 * 100 * POINTS
