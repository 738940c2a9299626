"""A function of arrays is the function at each element, whoever calls it and however many do so at once."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
from plain_quadrature import estimate
from program_source import random_program

import potto
from potto.diagnostics import PottoError

EXACT = """
def f(t, s) sin(t)*exp(s) + (if [t < s] then t^2 else sqrt(s)) + max(t, s)/(1 + t*t)
"""
INTEGRAL = """
step = \\u . [u > 0]
def f(t, s) integral ([0, 1], [0, t]) step(t*x + y - s)*exp(x*y) d(x, y)
"""
RECURSIVE = """
def f(t, s) if t > 0 then [t < s]*t + f(t - 1, s) else s
"""
SHAPES: tuple[tuple[tuple[int, ...], tuple[int, ...]], ...] = (
    ((), ()),
    ((5,), ()),
    ((), (4,)),
    ((3, 1), (4,)),
    ((2, 1, 3), (4, 1)),
    ((0,), ()),
    ((1,), (1,)),
)


def numbers(shape: tuple[int, ...], seed: int) -> Any:
    return np.random.default_rng(seed).uniform(0.2, 1.4, shape)


@pytest.mark.parametrize("source", [EXACT, INTEGRAL, RECURSIVE], ids=["exact", "integral", "recursive"])
@pytest.mark.parametrize(("first", "second"), SHAPES, ids=str)
def test_broadcasting(source: str, first: tuple[int, ...], second: tuple[int, ...]) -> None:
    f = potto.compile(source).f
    t, s = numbers(first, 1), numbers(second, 2)
    dual = potto.deriv(f)((t, np.ones(first)), (s, 0.5))
    shape = np.broadcast_shapes(first, second)
    assert np.shape(f(t, s).value) == np.shape(dual.value) == np.shape(dual.tangent) == shape
    for index in np.ndindex(shape):
        here = [float(np.broadcast_to(x, shape)[index]) for x in (t, s)]
        alone = potto.deriv(f)((here[0], 1.0), (here[1], 0.5))
        # Members of a batch may be refined together; both answers are right to what they say.
        for got, error, one, other in (
            (dual.value, dual.error, alone.value, alone.error),
            (dual.tangent, dual.tangent_error, alone.tangent, alone.tangent_error),
        ):
            at, bound = np.broadcast_to(got, shape)[index], np.broadcast_to(error, shape)[index]
            assert abs(at - one) <= bound + other + 4 * np.spacing(abs(one)), (index, at, one)
            if source is not INTEGRAL:
                assert abs(at - one) <= 4 * np.spacing(abs(one))


@pytest.mark.parametrize("number", range(10))
def test_random_programs_over_arrays(number: int) -> None:
    """Against brute force at each element, so that a batch can't be wrong together."""
    text, program = random_program(50_000 + number, flat=number < 8)
    try:
        f = potto.compile(text).f
    except PottoError:
        return
    t, s = numbers((4, 1), number), numbers((3,), number + 100)
    with potto.settings(max_evals=2_000_000):
        answer = f(t, s)
    for i, j in np.ndindex(4, 3):
        value, off = estimate(program, t=t[i, 0], s=s[j])
        got, error = np.broadcast_to(answer.value, (4, 3))[i, j], np.broadcast_to(answer.error, (4, 3))[i, j]
        assert abs(got - value) <= error + 1e-11 * max(1.0, abs(value)) + 3 * off, f"{text}{t[i, 0]} {s[j]}"


def test_the_same_from_eight_threads() -> None:
    """Drawn numbers to the last bit; of the others the last digits depend on which rules were proved before, for larger
    regions or smaller ones, each within its own bound."""
    module = potto.compile(INTEGRAL.replace("def f", "def g") + EXACT)
    calls = [(0.2 + 0.05 * k, 0.3 + 0.04 * k) for k in range(12)]

    def every(worker: int) -> list[tuple[float, ...]]:
        order = calls[worker:] + calls[:worker]  # not all the same call at the same time
        found = {}
        for t, s in order:
            with potto.settings(method="mc" if worker % 2 else "auto", seed=worker % 2, samples=500):
                d = potto.deriv(module.g)((t, 1.0), (s, 0.0))
            e = module.f(t, s)
            found[t, s] = (d.value, d.error, d.tangent, d.tangent_error, e.value, e.error)
        return [found[c] for c in calls]

    alone = [every(0), every(1)]
    with ThreadPoolExecutor(8) as pool:
        together = list(pool.map(every, range(8)))
    for worker, answers in enumerate(together):
        if worker % 2:
            assert [found[:4] for found in answers] == [found[:4] for found in alone[1]]
        for found, first in zip(answers, alone[worker % 2], strict=True):
            for value in (0, 2, 4):
                assert abs(found[value] - first[value]) <= found[value + 1] + first[value + 1]


def test_compiling_from_eight_threads() -> None:
    def answer(k: int) -> float:
        return float(potto.compile(f"def f(t) integral [0, {k % 4 + 1}] [x < t]*x d(x)").f(0.5))

    with ThreadPoolExecutor(8) as pool:
        assert list(pool.map(answer, range(24))) == pytest.approx([0.125] * 24, rel=1e-13, abs=0)
