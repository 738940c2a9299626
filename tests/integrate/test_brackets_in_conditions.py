"""Conditions with brackets inside: controllers, simulations with switches, brackets in brackets.

References are pieces by hand: a state as a function of where it started is affine between breakpoints, which exact
rational arithmetic follows step by step; what comes out is a quadratic in the parameters as long as no piece appears,
so that a central difference of it is its derivative exactly.

Tolerances: 1e-13 of the answer, a few hundred ulp for what a composition of 16 affine maps amplifies, and every
reported error must cover.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import pytest

import potto

EPS = 2.0**-52
Map = tuple[Fraction, Fraction]  # gain and shift
Piece = tuple[Fraction, Fraction, Fraction, Fraction]  # from, to, slope, offset
H = Fraction(1, 10**15)


def covered(answer: Any, exact: Fraction | float, tangent: bool = False, rtol: float = 1e-13) -> None:
    value = answer.tangent if tangent else answer.value
    error = answer.tangent_error if tangent else answer.error
    assert answer.converged, answer.reasons
    off = abs(float(Fraction(value) - Fraction(exact)))
    assert off <= rtol * max(1.0, abs(float(exact))), (value, float(exact))
    assert off <= error + 8 * EPS * abs(float(exact)), (value, float(exact), error)


def switched(pieces: list[Piece], at: Fraction, below: Map, above: Map) -> list[Piece]:
    """The pieces of a state after one step: one affine map where it is below a threshold, one above it."""
    found = []
    for lo, hi, slope, offset in pieces:
        root = (at - offset) / slope
        cuts = [lo, *([root] if lo < root < hi else []), hi]
        for a, b in itertools.pairwise(cuts):
            gain, shift = below if slope * (a + b) / 2 + offset < at else above
            found.append((a, b, gain * slope, gain * offset + shift))
    return found


def mean(pieces: list[Piece]) -> Fraction:
    return sum(((b - a) * (slope * (a + b) / 2 + offset) for a, b, slope, offset in pieces), Fraction(0))


def rate(value: Callable[[Fraction], Fraction], at: float) -> Fraction:
    t = Fraction(at)
    return (value(t + H) - value(t - H)) / (2 * H)


SIMULATION = """
def step(s, t) if [s < t] then s + 0.3*(1 - s) else 0.8*s
def sim(n, s, t) if n > 0 then sim(n - 1, step(s, t), t) else s
def f(t) integral [0, 1] sim({n}, x, t) d(x)
"""


def thermostat(n: int, t: Fraction) -> Fraction:
    pieces: list[Piece] = [(Fraction(0), Fraction(1), Fraction(1), Fraction(0))]
    gain = Fraction(0.3)
    for _ in range(n):
        pieces = switched(pieces, t, (1 - gain, gain), (Fraction(0.8), Fraction(0)))
    return mean(pieces)


@pytest.mark.parametrize("n", range(1, 17))
@pytest.mark.parametrize("t", [0.5, 0.437, 0.713])
def test_a_thermostat_of_n_steps(n: int, t: float) -> None:
    f = potto.compile(SIMULATION.format(n=n)).f
    covered(f(t), thermostat(n, Fraction(t)))
    covered(potto.deriv(f)((t, 1.0)), rate(lambda t: thermostat(n, t), t), tangent=True)
