"""Gradients by a tape against those by one tangent for each parameter, over random programs.

The two share rules of differentiation and integrators, but not what is done with slopes: one multiplies them from the
parameters on, one from the answer back. So they are equal up to rounding and to what the answers may be off: an
integral may be refined otherwise where it carries other directions.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from how_many import examples
from program_source import random_program

import potto
from potto.python import derived_calls

NAMES = ("a", "b", "c", "d")
ULPS = 1e-13  # of the size of what is added up: some hundred roundings
PIECES = """
def part(u, v) integral [0, 1] (1 + u*x)*[x < v*u] d(x)
def nested(u, v) integral [0, 1] (integral [0, x] exp(u*y)*[y < v] d(y))^2 d(x)
def power(u, n) if n < 1 then 1 else u*power(u, n - 1)
def pair(u, v) (u*v, sin(u) - v^2)
def turned(u, v, s) s(u)*cos(v)
sharp = \\x . integral [0, 1] [y < x] d(y)
"""


def expression(pick: random.Random, depth: int, names: tuple[str, ...] = NAMES) -> str:
    """A number made of the parameters, with conditions, sums, recursions, tuples, functions and integrals."""
    if depth == 0:
        return pick.choice([*names, *names, f"{pick.uniform(0.2, 1.5):.3f}"])

    def inner(more: tuple[str, ...] = ()) -> str:
        return expression(pick, depth - 1, names + more)

    kinds: list[Callable[[], str]] = [
        lambda: f"({inner()} + {inner()})",
        lambda: f"({inner()} - 0.5*{inner()})*{inner()}",
        lambda: f"{inner()}/(1.5 + ({inner()})^2)",
        lambda: f"{pick.choice(('sin', 'exp', 'atan', 'abs'))}(0.3*{inner()})",
        lambda: f"sqrt(1 + ({inner()})^2)",
        lambda: f"max({inner()}, 0.9*{inner()})",
        lambda: f"(if {inner()} < {inner()} then {inner()} else {inner()})",
        lambda: f"(let z = {inner()} in z*z + {inner(('z', 'z'))})",
        lambda: f"(sum k in 1..{pick.randint(1, 4)} (sin(k*{inner(('k',))})))",
        lambda: f"power(0.7*{inner()}, {pick.randint(0, 3)})",
        lambda: f"fst(pair({inner()}, {inner()}))*snd(pair({inner()}, {inner()}))",
        lambda: f"turned({inner()}, {inner()}, {pick.choice(('sharp', 'sin'))})",
        lambda: f"part({inner()}, {inner()})",
        lambda: f"nested({inner()}, {inner()})",
        lambda: f"f({inner()}, {inner()})",
        lambda: f"({' + '.join(f'(integral [0, {inner()}] x*[x < {inner()}] d(x))' for _ in range(3))})",  # alike
    ]
    return pick.choice(kinds)()


def program(seed: int) -> tuple[str, tuple[float, ...]]:
    pick = random.Random(seed)
    text, _ = random_program(seed, flat=True)
    whole = expression(pick, 3)
    return f"{text}{PIECES}def g({', '.join(NAMES)})\n    {whole}\n", tuple(pick.uniform(0.2, 1.3) for _ in NAMES)


def gradient(monkeypatch: pytest.MonkeyPatch, function: Any, at: tuple[Any, ...], many: int) -> Any:
    monkeypatch.setattr(derived_calls, "MANY", many)
    return potto.grad(function, NAMES)(*at)


def outcome(run: Callable[[], Any]) -> Any:
    try:
        return run()
    except potto.PottoError as error:
        return error.diagnostics[0].code


def hold(seed: int, monkeypatch: pytest.MonkeyPatch, wide: bool) -> None:
    text, at = program(seed)
    f = potto.compile(text).g
    given: tuple[Any, ...] = at
    if wide:  # some of the parameters are arrays, some are not
        given = tuple(x + np.array([0.0, 0.3, -0.15]) if i % 2 == seed % 2 else x for i, x in enumerate(at))
    with potto.settings(max_evals=200_000):
        forward, reverse = (outcome(lambda many=many: gradient(monkeypatch, f, given, many)) for many in (10**9, 1))
    if isinstance(forward, str) or isinstance(reverse, str):
        assert forward == reverse, text
        return
    off = np.asarray(forward.error) + reverse.error + 1e-12 * np.abs(forward.value)
    assert np.all(~(np.abs(np.asarray(forward.value) - reverse.value) > off)), text
    slopes = np.abs(np.array([np.broadcast_to(t, np.shape(forward.value)) for t in forward.tangent]))
    size = np.max(slopes, initial=1.0, where=np.isfinite(slopes))
    for i, name in enumerate(NAMES):
        bars = np.asarray(forward.tangent_error[i]) + reverse.tangent_error[i]
        apart = np.abs(np.asarray(forward[name]) - reverse[name])
        assert np.all(~(apart > bars + ULPS * size)), f"{name}\n{text}{given}"  # nan tells nothing
    assert forward.converged <= reverse.converged, f"{reverse.reasons}\n{text}{given}"


@pytest.mark.parametrize("seed", range(examples(60, 2000)))
def test_a_tape_gives_what_tangents_give(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    hold(seed, monkeypatch, wide=False)


@pytest.mark.parametrize("seed", range(examples(30, 1000)))
def test_so_it_does_for_arrays(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    hold(seed, monkeypatch, wide=True)
