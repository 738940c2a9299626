"""Holding an answer of Potto's against exact values and one-sided derivatives.

Owns `Rates` and `held_against`. No allowance is made but for rounding of the answer itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

import potto

ULP = 2.0**-52
STEP = Fraction(1, 10**40)  # of a piecewise polynomial: some 35 digits of its derivative
NEXT = Fraction(1, 10**13)  # to rounding the same parameter
SAME, NOTED = 1e-9, 1e-6  # what is taken for one derivative; how well those in notes, which are extrapolated, are known


@dataclass(frozen=True)
class Rates:
    """The derivative to both sides of a parameter, and to both sides of those that differ from it by rounding."""

    backward: float
    forward: float
    before: float
    beyond: float

    @classmethod
    def of(cls, rate: Callable[[Fraction, Fraction], Fraction], t: Fraction) -> Rates:
        """Those of `rate(parameter, step)`."""
        return cls(*(float(rate(t + off, step)) for off, step in ((0, -STEP), (0, STEP), (-NEXT, -STEP), (NEXT, STEP))))

    @property
    def all(self) -> tuple[float, ...]:
        return (self.backward, self.forward, self.before, self.beyond)


def rounding(x: float) -> float:
    return 8 * ULP * max(1.0, abs(x))


def held_against(
    text: str, t: float, value: Fraction, rate: Callable[[Fraction, Fraction], Fraction], many: bool
) -> str:
    """What came of comparing f(t), as a number and, if so wanted, as a member of an array."""
    dual = potto.deriv(potto.compile(text).f)
    answer, rates = dual((t, 1.0)), Rates.of(rate, Fraction(t))
    context = f"at t = {t!r}:\n{text}\nis {float(value)!r}, {rates}\n"
    outcome = compare(answer, float(value), rates, context + answer.summary())
    if many:
        array = dual((np.array([t, 0.375, t]), np.ones(3)))
        context += f"as an array {array.value}, {array.error}, {array.tangent}, {array.tangent_error}"
        assert abs(array.value[2] - value) <= array.error[2] + rounding(float(value)), context
        if outcome == "compared":
            off = abs(array.tangent[2] - rates.forward)
            assert off <= array.tangent_error[2] + rounding(rates.forward), context
    return outcome


def compare(answer: Any, value: float, rates: Rates, context: str) -> str:
    """What came of a comparison; fails where an answer is wrong by more than it says."""
    assert abs(answer.value - value) <= answer.error + rounding(value), context
    assert answer.error < math.inf, context
    apart, size = max(rates.all) - min(rates.all), max(1.0, *map(abs, rates.all))
    if apart <= SAME * size:
        off = abs(answer.tangent - rates.forward) - answer.tangent_error
        assert off <= apart + rounding(rates.forward), context
        return "compared" if answer.converged else "not converged"
    # Where rounding of the parameters changes it, what is right without it, or on one side of that, is right.
    hidden = max(abs(rates.backward - rates.before), abs(rates.forward - rates.beyond)) > SAME * size
    if hidden and any(abs(answer.tangent - x) <= answer.tangent_error + SAME * size for x in rates.all):
        return "to rounding"
    if answer.notes:
        # a note is about one integral, to which others may add what has one derivative
        told = [float(note.forward) - float(note.backward) for note in answer.notes]
        steps = [f - b for b in (rates.backward, rates.before) for f in (rates.forward, rates.beyond)]
        assert any(math.isnan(x) or abs(x - step) <= NOTED * size for x in told for step in steps), context
        return "sides not known" if any(map(math.isnan, told)) else "two sides"
    assert not answer.converged or answer.tangent_error >= apart / 2, context
    return "not told"
