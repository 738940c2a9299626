"""Minimization along derivatives, of any function of a row of numbers: knows no programs.

Owns `minimized` and what it answers with (`Fit`). The derivatives hold their boundary terms, so a quasi-Newton method
(L-BFGS-B of scipy) goes to the minimum as it would for a smooth function; Gauss-Newton and Adam are in `descending`.
Where it stops short of a minimum, the answer says why.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct

from potto.applications.descending import adam, gauss_newton
from potto.applications.minimization import Done, Iterate, Minimization, Objective
from potto.kernels.cells import Array
from potto.kernels.errors import wrong_call
from potto.runtime.answers.printing import (
    format_count,
    format_error,
    format_number,
    format_seconds,
    with_error,
)

MOST_STEPS = 200
FIRST = 0.25  # of the size of a parameter: how far the first step goes at most, before any curvature is known
MEMORY = 20  # steps that the curvature is learned from
CREEPING = 8  # steps by slopes alone, where values have no digits left to tell one place from another

STUCK = "no step along the derivative makes it smaller, though a slope is left: a kink, or the limit of accuracy"

NOISE = (
    "noise limits it: the value is known to ± {}, and what is left to gain is less; "
    "more samples or a smaller tolerance take it further"
)
MOST_TOLD, MOST_DRAWN = 12, 5  # parameters
METHODS = ("lbfgs", "gauss-newton", "adam")

Way = Callable[[Minimization, Array, Array, int], str]
"""From a walk, where it starts, how far a first step goes, and how many steps there may be, to why it ended."""


class Fit(Struct, frozen=True):
    """Where a minimization ended.

    parameters, value, slope: the best place met, what is to be least there, and the steepest slope there, measured for
    each parameter in its own size and left out where a bound stops it. error: a bound of the value's error. converged:
    whether this is a minimum; `reason` says why it was left. steps: the way there, from the start. evaluations: calls
    of the function with its derivatives. held: the parameters that a bound stops. numbers: all parameters one by
    one, the elements of arrays as `xs[0]`.
    """

    parameters: dict[str, Any]
    value: float
    slope: float
    converged: bool
    reason: str
    steps: tuple[Iterate, ...]
    evaluations: int
    seconds: float
    error: float = 0.0
    held: frozenset[str] = frozenset()
    numbers: dict[str, float] = {}

    def __getitem__(self, name: str) -> Any:
        return self.parameters[name]

    def __repr__(self) -> str:
        return self.told("value")

    @property
    def _course(self) -> str:
        return f"{format_count(len(self.steps) - 1, 'step')}, {format_count(self.evaluations, 'evaluation')}"

    def told(self, what: str) -> str:
        """The parameters to the digits that are known, `what` was made least, and why it ended: a line each."""
        doubts, shown = self.doubts(), list(self.numbers.items())[:MOST_TOLD]
        lines = [f"{name} = {format_number(value, doubts[name])}" for name, value in shown]
        if len(shown) < len(self.numbers):
            lines.append(f"… {len(self.numbers) - len(shown):,} more")
        cost = f"slope {format_error(self.slope)}, {self._course}"
        verdict = f"{'' if self.converged else 'not '}converged: {self.reason}"
        if self.held:
            verdict += f"; stopped by a bound: {', '.join(sorted(self.held)[:MOST_TOLD])}"
        end = f"{verdict} ({cost}, {format_seconds(self.seconds)})"
        return "\n".join([*lines, f"{what} = {with_error(self.value, self.error)}", end])

    def plot(self, path: str, what: str = "value") -> None:
        """Draw the way there into a file: what was made least, from step to step, and how the parameters went. An
        `.svg`, or by matplotlib a `.png` or `.pdf`.

        Raises OSError, and PottoError where it takes matplotlib and that is not installed.
        """
        from potto.applications.figures import complaint, save
        from potto.applications.pictures import Curve, Plot, course

        wrong = complaint(path)
        if wrong is not None:
            raise wrong_call(wrong)
        last = len(self.steps) - 1
        ends = f"{what} = {with_error(self.value, self.error)} after {self._course}"
        values = course(what, [step.value for step in self.steps], ends)
        names = tuple(self.numbers)[:MOST_DRAWN]
        ways = tuple(Curve.even([step.parameters[i] for step in self.steps], 0, last) for i in range(len(names)))
        save(path, [values, Plot(names, ways, 0, last, "step", ends, True)], caption=ends)

    def doubts(self) -> dict[str, float]:
        """How far each parameter may be off the minimum; digits beyond that say nothing.

        A slope that is left says so, and so does an error of the value: on a parabola through the last step at which
        the value was larger by more than its error, this is how far away the value rises by its error.
        """
        step = next((step for step in reversed(self.steps) if step.value - self.value > self.error), None)
        share = 0.0 if step is None else math.sqrt(self.error / (step.value - self.value))
        away = dict.fromkeys(self.numbers, 0.0)
        if step is not None:
            away = {n: abs(v - p) for (n, v), p in zip(self.numbers.items(), step.parameters, strict=True)}
        doubts = {n: max(1e-9 * abs(v), min(1e-3 * self.slope, 1e-3 * abs(v)), 1e-12, share * away[n])
                  for n, v in self.numbers.items()}  # fmt: skip
        return doubts | dict.fromkeys(self.held, 0.0)


def minimized(
    objective: Objective,
    start: Mapping[str, float],
    limits: Sequence[tuple[float, float]],
    most: int = MOST_STEPS,
    progress: Callable[[Iterate], None] | None = None,
    method: str = METHODS[0],
) -> Fit:
    """Follow the gradient of `objective` from `start` to a minimum within `limits`.

    Raises what the objective raises at the start.
    """
    names = tuple(start)
    walk = Minimization(objective, names, limits, progress)
    x0 = np.clip(np.array([float(v) for v in start.values()]), walk.low, walk.high)
    unit = FIRST * np.maximum(np.abs(x0), 0.1)  # the method's first step is at most one of these

    try:
        walk.look(x0)
        walk.step()
        ways: dict[str, Way] = {"lbfgs": _lbfgs, "gauss-newton": gauss_newton, "adam": adam}
        walk.reason = ways[method](walk, x0, unit, most) or _reason(walk)
        if walk.limited():
            walk.reason = NOISE.format(format_error(walk.seen.value_error))
    except Done:
        pass
    assert walk.best is not None
    x, seen = walk.best
    parameters = {name: float(v) for name, v in zip(names, x, strict=True)}
    held = frozenset(name for name, stops in zip(names, walk.held(x, seen), strict=True) if stops)
    return Fit(parameters, seen.value, walk.slope(x, seen), walk.converged, walk.reason, tuple(walk.steps),
               walk.evaluations, time.perf_counter() - walk.begun, seen.value_error, held, parameters)  # fmt: skip


def _lbfgs(walk: Minimization, x0: Array, unit: Array, most: int) -> str:
    """A quasi-Newton method, in units of first steps. Why it ends."""
    from scipy.optimize import minimize

    def look(z: Array) -> tuple[float, Array]:
        value, slopes = walk.look(np.clip(x0 + unit * z, walk.low, walk.high))
        return value, slopes * unit

    result = minimize(
        look, np.zeros_like(x0), jac=True, method="L-BFGS-B",
        bounds=list(zip((walk.low - x0) / unit, (walk.high - x0) / unit, strict=True)),
        callback=lambda _: walk.step(),
        options={"maxiter": most, "ftol": 0.0, "gtol": 0.0, "maxcor": MEMORY, "maxls": 40, "maxfun": 40 * most},
    )  # fmt: skip
    limit = len(walk.steps) > most or "LIMIT" in str(result.message).upper()
    reason = f"{most} steps are done and the value still falls" if limit else _reason(walk)
    if reason == STUCK:
        _creep(walk, lambda slopes: unit * np.asarray(result.hess_inv @ (unit * slopes)))
    return reason


def _creep(walk: Minimization, newton: Callable[[Array], Array]) -> None:
    """Go on by the slopes: near a minimum they have all their digits, where the values have half of theirs.

    newton: the step for a slope, by the curvature that the method has learned.
    """
    for _ in range(CREEPING):
        assert walk.best is not None
        x, seen = walk.best
        if not walk.creep(np.clip(x - newton(seen.gradient), walk.low, walk.high)):
            return
        walk.step()


def _reason(walk: Minimization) -> str:
    """Why a method finds no step that makes it smaller."""
    if walk.trouble is not None:
        return f"it ends where the program has no value: {walk.trouble.diagnostics[0].message}"
    if walk.walls:
        return "it ends beside places where the value is not a number"
    return STUCK
