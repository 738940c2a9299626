"""Our own methods as adapters: quadrature, Monte Carlo, quasi-Monte Carlo.

Owns `OURS`. A program is compiled before the clock starts; a rung is the accuracy asked for, or the number of points.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from msgspec import Struct

from potto.bench.adapter import MethodAnswer, Solve
from potto.bench.problems import BenchProblem, Quantity
from potto.projects.settings import settings
from potto.python.api import Workspace
from potto.python.functions import deriv
from potto.runtime.answers.estimate import Estimate

TOLERANCES = (1e-1, 1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
POINTS = tuple(2.0**k for k in range(7, 21))
MOST_EVALUATIONS = 5_000_000


class Ours(Struct, frozen=True):
    """One of our methods. `dial` is the name of the setting that is turned."""

    method: str
    dial: str
    random: bool
    package: str | None = None

    @property
    def name(self) -> str:
        return f"potto {self.method}"

    def missing(self) -> str | None:
        return None

    def ladder(self, problem: BenchProblem) -> Sequence[float]:
        if self.method == "qmc" and problem.dimensions == 1:
            return ()  # the innermost variable is integrated exactly: nothing is left to sample
        if self.random:
            return POINTS
        return TOLERANCES

    def prepare(self, problem: BenchProblem, quantity: Quantity) -> Solve:
        f = Workspace().compile(problem.program).f
        derived = deriv(f)

        def solve(rung: float, seed: int) -> MethodAnswer:
            turned = {"samples": int(rung)} if self.dial == "samples" else {"rtol": rung}
            with settings(method=self.method, seed=seed, max_evals=MOST_EVALUATIONS, **turned):
                if quantity == "value":
                    found = f(problem.at)
                    return MethodAnswer(found.value, found.evals, _reported(found, found.value, found.error))
                found = derived((problem.at, 1.0))
                return MethodAnswer(found.tangent, found.evals, _reported(found, found.tangent, found.tangent_error))

        return solve


def _reported(found: Estimate, number: float, error: float) -> float:
    """The error that an estimate admits: unknown where no sample fell on anything, which it says."""
    return math.inf if number == error == 0 and not found.converged else error


OURS = (Ours("quadrature", "rtol", False), Ours("qmc", "samples", True), Ours("mc", "samples", True))
