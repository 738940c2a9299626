"""Machine code equals numpy: bit by bit where there is arithmetic alone, else within what both may round off.

Elementary functions are those of the C library, held against mpmath one by one. (Arithmetic is not reordered and not
fused in either; where a builtin's values differ in the last place, what follows may differ by more.)
"""

from __future__ import annotations

import math
import platform
import random
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from how_many import examples
from mpmath import mp
from msgspec.structs import replace

import potto
from potto.calculus.surfaces.trace import Side, layout
from potto.core import terms as core
from potto.core.terms import Term
from potto.kernels.cells import Cell, Trace, Value, all_cells
from potto.projects.settings import DEFAULTS
from potto.runtime.evaluate import Program

pytest.importorskip("llvmlite")

COUNT = 1_500  # numpy does fewer than 256 points by itself, whatever is asked for
NAMES = ("x", "y", "t")


def arithmetic(pick: random.Random, depth: int) -> Term:
    """A term of operations that IEEE 754 defines to the last bit."""
    if not depth or pick.random() < 0.1:
        return pick.choice([*map(core.var, NAMES), core.const(pick.choice((0.5, -2.0, 1e-8, 1e8, 0.0)))])
    a, b, at = arithmetic(pick, depth - 1), arithmetic(pick, depth - 1), pick.random()
    if at < 0.35:
        return core.prim(pick.choice(("add", "mul")), a, b, *([arithmetic(pick, depth - 1)] if at < 0.1 else []))
    if at < 0.50:
        return core.div(a, b)
    if at < 0.58:
        return core.pow_(a, core.const(pick.choice((2.0, 3.0))))
    if at < 0.72:
        return core.prim(pick.choice(("abs", "neg", "sqrt", "floor", "ceil", "sign")), a)
    if at < 0.80:
        return core.prim(pick.choice(("min", "max")), a, b)
    if at < 0.84:
        return core.prim("clamp", a, b, arithmetic(pick, depth - 1))
    if at < 0.92:
        compared = core.prim(pick.choice(("lt", "le", "eq", "ne")), a, b)
        return core.if_(core.prim("not", compared) if at < 0.88 else compared, b, arithmetic(pick, depth - 1))
    return core.branch((a,), pick.random() < 0.5, b, arithmetic(pick, depth - 1))


def cells(pick: random.Random, names: tuple[str, ...], shape: tuple[int, ...]) -> dict[str, Value]:
    """Numbers for names: some the same at every point, some that vary along one axis only, with tangents and errors."""
    generator = np.random.default_rng(pick.randrange(1 << 30))

    def numbers(scale: float) -> Any:
        kind = pick.random()
        if kind < 0.2:
            return float(pick.choice((0.0, 1.0, -0.7, 2.0, math.nan)) * scale)
        own = shape if kind < 0.7 else tuple(n if pick.random() < 0.5 else 1 for n in shape)
        found = generator.uniform(-1.5, 1.5, own) * scale
        found[generator.random(own) < 0.02] = pick.choice((0.0, math.inf, math.nan, 1.0))
        return found

    tangent = pick.choice((None, 1.0, numbers))
    return {
        name: Cell(numbers(1.0), error, (tangent(1.0) if callable(tangent) else tangent,))
        for name, error in ((name, pick.choice((None, abs(numbers(1e-16))))) for name in names)
    }


def forced(pick: random.Random, whole: Term, shape: tuple[int, ...]) -> Trace:
    """Sides for some of the branches of a term: everywhere the same, or not."""
    generator = np.random.default_rng(pick.randrange(1 << 30))
    return {
        at: pick.random() < 0.5 if pick.random() < 0.4 else generator.random(shape) < 0.5
        for at, site in enumerate(layout(whole).sites)
        if isinstance(site, Side) and pick.random() < 0.7
    }


def outcome(whole: Term, env: dict[str, Value], backend: str, rounding: bool, trace: Trace | None = None) -> list[Any]:
    """All parts of a term's value."""
    machine = Program(lambda module, name: core.ZERO).machine(replace(DEFAULTS, backend=backend)).with_directions(1)
    machine = machine if rounding else machine.inside()
    function = core.function_of(whole)
    with np.errstate(all="ignore"):
        value = machine.evaluate(function, {name: env[name] for name in function.params}, trace)
    return [part for cell in all_cells(value) for part in (cell.v, cell.e, *cell.t, *cell.et)]


@pytest.mark.parametrize("seed", range(examples(60, 600)))
def test_arithmetic_is_the_same_to_the_last_bit(seed: int) -> None:
    pick = random.Random(seed)
    whole = arithmetic(pick, 4)
    shape = pick.choice(((COUNT,), (3, COUNT), (COUNT, 3), (5, 7, 60), (2, 3, 4, 100)))
    env, rounding = cells(pick, NAMES, shape), pick.random() < 0.5
    trace = forced(pick, whole, shape) or None
    native, numpy = (outcome(whole, env, backend, rounding, trace) for backend in ("native", "numpy"))
    for ours, theirs in zip(native, numpy, strict=True):
        assert (ours is None) == (theirs is None)
        if ours is not None:
            np.testing.assert_array_equal(*np.broadcast_arrays(ours, theirs))


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="other processors have an order of zeros")
@pytest.mark.parametrize("op", ["max", "min"])
def test_of_two_zeros_the_one_that_numpy_takes(op: str) -> None:
    """Whether 1/max(x, y) is inf or -inf is told by the sign of the zero; and nan of either side is nan."""
    f = potto.compile(f"def f(x, y) {op}(x, y)").f
    x = np.repeat([0.0, -0.0, 1.0, np.nan, -np.inf], 5)
    x, y = np.tile(x, 100), np.tile([0.0, -0.0, 1.0, np.nan, -np.inf], 500)
    with potto.settings(backend="native"):
        found = f(x, y).value
    exact = {"max": np.maximum, "min": np.minimum}[op](x, y)
    np.testing.assert_array_equal(found, exact)
    assert (np.signbit(found) == np.signbit(exact)).all()


@pytest.mark.parametrize("kind", ["plain", "not to be written to", "every second", "turned", "empty", "column and row"])
def test_arrays_lie_in_memory_as_they_like(kind: str) -> None:
    def placed(numbers: Any) -> Any:
        if kind == "not to be written to":
            numbers.flags.writeable = False
        return {"every second": numbers[..., ::2], "turned": numbers.T[::-1], "empty": numbers[:0]}.get(kind, numbers)

    generator = np.random.default_rng(3)
    shapes = ((300, 1), (1, 400)) if kind == "column and row" else ((40, 50), (40, 50))
    x, y = (placed(generator.random(shape)) for shape in shapes)
    a, b = core.var("x"), core.var("y")
    whole = core.add(core.div(a, core.add(b, core.const(1.0))), core.mul(a, b))
    env: dict[str, Value] = {"x": Cell(x, None, (1.0,)), "y": Cell(y, None, (None,))}
    value, _, tangent, _ = outcome(whole, env, "native", False)
    np.testing.assert_array_equal(value, np.broadcast_to(x / (y + 1.0) + x * y, np.shape(value)))
    np.testing.assert_allclose(
        tangent, np.broadcast_to(1 / (y + 1.0) + y, np.shape(value)), rtol=1e-15
    )  # one rounding each


@pytest.mark.parametrize("op", ["add", "mul"])
@pytest.mark.parametrize("count", [2, 3])
def test_tangents_that_cancel_keep_what_they_round_off(op: str, count: int) -> None:
    """Tangents of 1e8 with a sum of about 1: what their products and sums round off is 1e8 times as much as that of
    the result. Held against rational numbers, and against numpy to the last bit."""
    generator = np.random.default_rng(7)
    values, tangents = generator.uniform(0.5, 1.5, (2, count, COUNT))
    tangents[0] *= 1e8
    rest = values[1] / values[0] if op == "mul" else 1.0
    tangents[1] = -tangents[0] * rest + generator.uniform(-1, 1, COUNT)
    env: dict[str, Value] = {name: Cell(v, None, (t,)) for name, v, t in zip(NAMES, values, tangents, strict=False)}
    whole = core.prim(op, *map(core.var, NAMES[:count]))
    native, numpy = (outcome(whole, env, backend, True) for backend in ("native", "numpy"))
    for ours, theirs in zip(native, numpy, strict=True):
        np.testing.assert_array_equal(ours, theirs)
    for v, t, found, error in zip(values.T.tolist(), tangents.T.tolist(), native[2], native[3], strict=True):
        parts = [Fraction(x) for x in t]
        if op == "mul":
            parts = [x * math.prod(Fraction(y) for j, y in enumerate(v) if j != i) for i, x in enumerate(parts)]
        assert abs(Fraction(float(found)) - sum(parts)) <= Fraction(float(error))


OURS = ("exp", "log", "sin", "cos")
ELEMENTARY = {
    "exp": (-20.0, 20.0), "log": (1e-8, 1e8), "log1p": (-0.9, 50.0), "expm1": (-5.0, 5.0), "sinh": (-5.0, 5.0),
    "cosh": (-5.0, 5.0), "tanh": (-4.0, 4.0), "asinh": (-50.0, 50.0), "acosh": (1.0, 50.0), "atanh": (-0.99, 0.99),
    "sin": (-300.0, 300.0), "cos": (-300.0, 300.0), "tan": (-1.5, 1.5), "asin": (-1.0, 1.0), "acos": (-1.0, 1.0),
    "atan": (-50.0, 50.0), "erf": (-3.0, 3.0),
}  # fmt: skip


@pytest.mark.parametrize("name", ELEMENTARY)
def test_elementary_functions(name: str) -> None:
    """Within 1 unit in the last place where the polynomials are ours, within 2 where they are the C library's; half a
    unit more for what mpmath's value is rounded to."""
    least, most = ELEMENTARY[name]
    x = np.random.default_rng(1).uniform(least, most, COUNT)
    (found, *_) = outcome(core.prim(name, core.var("x")), {"x": Cell(x, None, (None,))}, "native", False)
    with mp.workdps(40):
        truth = np.array([float(getattr(mp, name)(mp.mpf(value))) for value in x.tolist()])
    units = np.abs(found - truth) / np.spacing(np.abs(truth))
    assert units.max() <= (1.5 if name in OURS else 2.5), units.max()


ENDS = [("exp", 1000.0), ("exp", -1000.0), ("log", 0.0), ("log", -1.0), ("sin", math.inf), ("cos", 1e22),
        ("exp", math.nan), ("log", 5e-324), ("tanh", 1e300)]  # fmt: skip


@pytest.mark.parametrize(("name", "x"), ENDS)
def test_elementary_functions_at_their_ends(name: str, x: float) -> None:
    env: dict[str, Value] = {"x": Cell(np.full(COUNT, x), None, (None,))}
    (found, *_) = outcome(core.prim(name, core.var("x")), env, "native", False)
    with np.errstate(all="ignore"):
        np.testing.assert_allclose(found, getattr(np, name)(x), rtol=4e-16)


PROGRAMS = r"""
def line(c) integral ([0, 1], [0, 1]) c/(1.4142135623730951*(x + y + c) + 2)^2*[x + y + c >= 0] d(x, y)
def disc(r) integral ([-1, 1], [-1, 1]) [x^2 + y^2 < r^2]/(2 + x) d(x, y)
def waves(a) integral [0, 3] exp(-x)*sin(a*x)*[x < a] d(x)
def steps(a) integral ([0, 1], [0, 1]) (x + a)^3*[x < a]*[y < x] d(x, y)
def solid(t) integral ([0, 1], [0, 1], [0, 1]) [x + y + z < t]/(1 + x*y) d(x, y, z)
def shaded(a, b) integral ([0, 1], [0, 1]) (if a < 0.5 then x else y)*[a*x + b*y < 0.6]*sqrt(x + 0.5) d(x, y)
"""
CALLS = [("line", (-1.9, -0.1)), ("disc", (0.2, 0.9)), ("waves", (0.5, 2.5)), ("steps", (0.1, 0.9)),
         ("solid", (0.3, 2.7)), ("shaded", (0.2, 0.9))]  # fmt: skip


@pytest.mark.parametrize(("name", "ends"), CALLS)
def test_integrals_over_many_members(name: str, ends: tuple[float, float]) -> None:
    """Sums in another order: 1e-14 of the largest is 45 units in the last place, for sums of up to 400 terms."""
    module = potto.compile(PROGRAMS)
    function = getattr(module, name)
    given = [np.linspace(*ends, 400)] + [0.7] * (len(function.parameters) - 1)
    answers = []
    for backend in ("numpy", "native"):
        with potto.settings(backend=backend):
            answers.append(potto.grad(function, list(function.parameters)[:1])(*given))
    ours, theirs = answers[1], answers[0]
    for a, b in ((ours.value, theirs.value), (ours.tangent, theirs.tangent)):
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-14 * np.abs(b).max())
    assert ours.converged == theirs.converged
    assert ours.evals == theirs.evals
    np.testing.assert_allclose(ours.error, theirs.error, rtol=0.5, atol=1e-15)


def test_the_settings_name_what_there_is() -> None:
    complaint = "backend must be one of auto, numpy, native"
    with pytest.raises(potto.PottoError, match=complaint), potto.settings(backend="c"):
        pass
