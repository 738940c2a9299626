"""What an integral and its derivative come to, interior and boundary apart.

Owns `IntegralNumbers` and `numbers`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from msgspec import Struct

from potto.checking.regions import DrawnIntegral
from potto.core.terms import Const, Lam
from potto.python.terms import TermFunction
from potto.runtime.answers.estimate import Estimate

STEP = 1e-3  # of the parameter, or of 1 where that is more
TINY = 1e-13

Compile = Callable[[Lam], TermFunction]


class IntegralNumbers(Struct, frozen=True):
    """An integral and its derivative by the parameter that moves, each with its error. interior: what the derivative is
    while surfaces and bounds stand still; boundary: the rest. difference: the central difference over `step` to both
    sides, a ghost to hold the derivative against, and how far errors of values may move it; None if nobody asked."""

    value: float
    error: float
    tangent: float
    tangent_error: float
    interior: float
    interior_error: float
    boundary: float
    boundary_error: float
    difference: float | None
    difference_error: float
    step: float
    converged: bool
    evals: int


def numbers(
    region: DrawnIntegral, compile: Compile, given: Mapping[str, float], wrt: str, step: float | None = None,
    quick: bool = False,
) -> IntegralNumbers:  # fmt: skip
    """The integral and its derivative by `wrt`, and a difference over `step`; if it is to be quick, that only where a
    step is named. Raises PottoError where there is none."""
    whole = compile(region.whole)
    at = [given[name] for name in region.whole.params]
    both = whole.gradient(wrt, *at)
    still = constant(region.interior)
    inner = compile(region.interior)(*at) if still is None else Estimate(still, 0.0)
    rest, error = both.tangent - inner.value, both.tangent_error + inner.error
    if abs(rest) <= max(error, TINY * max(abs(both.tangent), abs(inner.value))):
        rest, error = 0.0, error if rest else 0.0
    difference, off, evals = None, 0.0, both.evals + inner.evals
    wanted = step is not None or not quick
    step = STEP * max(1.0, abs(given[wrt])) if step is None else step
    if wanted:
        sides = {**given, wrt: given[wrt] + step * np.array([-1.0, 1.0])}
        beside = whole(*(sides[name] for name in region.whole.params))
        difference, off = float(np.diff(beside.value)[0]) / (2 * step), float(np.sum(beside.error)) / (2 * step)
        evals += beside.evals
    return IntegralNumbers(
        float(both.value), float(both.error), float(both.tangent), float(both.tangent_error),
        float(inner.value), float(inner.error), float(rest), float(error), difference, off, step,
        bool(both.converged and inner.converged), evals,
    )  # fmt: skip


def constant(term: Lam) -> float | None:
    """The number that a function gives everywhere, if that is what it is."""
    return term.body.value if isinstance(term.body, Const) else None
