"""A minimization under way: what was seen of the places met, the best of them, and when to leave.

Owns `Minimization`, what it is told of a place (`Seen`) and what it writes down of a step (`Iterate`). The ways down
ask it for values and tell it their steps.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from msgspec import Struct

from potto.diagnostics import PottoError
from potto.kernels.cells import Array
from potto.kernels.errors import wrong_call
from potto.runtime.answers.printing import format_digits, format_error

# The slope of a minimum, measured in the size of the values met and of the parameters.
SLOPE = 1e-8
NOISY = 1e-4  # a slope that is known no better than this, in the same measure, is one of samples
ROUNDING = 1e-14
FAR = 1e9  # how far a parameter may run from where it started, in its own size, before we say that it runs away


class Seen(Struct, frozen=True):
    """The value and the gradient at one place; `error` bounds that of the gradient, `value_error` that of the value.

    Of a mean of squares `error` takes the residuals as they are: what all samples have in common is no reason to stop.
    residuals, slopes: of a mean of squares, what is squared, and the derivatives of each: (residuals, parameters).
    """

    value: float
    gradient: Array
    error: float = 0.0
    value_error: float = 0.0
    residuals: Array | None = None
    slopes: Array | None = None


class Iterate(Struct, frozen=True):
    """How far a minimization has come: the parameters, the value there, its steepest slope, evaluations so far."""

    number: int
    value: float
    parameters: tuple[float, ...]
    slope: float
    evaluations: int
    seconds: float


Objective = Callable[[Array], Seen]


class Done(Exception):
    """A minimum was reached, or there is nowhere to go."""


class Minimization:
    """A minimization under way: what was seen, the best place, and the steps.

    A place without a value (an error of the program, nan, infinity) is answered with a wall: a parabola around the best
    place that is higher than it everywhere else, so that a search along a line turns back.
    """

    def __init__(
        self, objective: Objective, names: tuple[str, ...], limits: Sequence[tuple[float, float]],
        progress: Callable[[Iterate], None] | None,
    ) -> None:  # fmt: skip
        self.objective, self.names, self.progress = objective, names, progress
        self.low, self.high = (np.array(side, dtype=float) for side in zip(*limits, strict=True))
        self.begun = time.perf_counter()
        self.evaluations = self.walls = 0
        self.steps: list[Iterate] = []
        self.size = 0.0  # of the values met
        self.best: tuple[Array, Seen] | None = None
        self.trouble: PottoError | None = None
        self.converged, self.reason = False, ""

    def look(self, x: Array) -> tuple[float, Array]:
        """The value and the gradient for the method."""
        self.evaluations += 1
        try:
            seen = self.objective(x)
        except PottoError as error:
            if self.best is None:
                raise
            self.trouble = error
            return self._wall(x)
        if not (math.isfinite(seen.value) and np.isfinite(seen.gradient).all()):
            if self.best is None:
                at = ", ".join(f"{n} = {format_digits(v)}" for n, v in zip(self.names, x, strict=True))
                value, slopes = format_digits(seen.value), ", ".join(map(format_digits, seen.gradient))
                message = f"at the start, {at}, the value is {value} with the slopes {slopes}"
                raise wrong_call(message, "start where these are numbers")
            return self._wall(x)
        self.size = max(self.size, abs(seen.value)) if self.evaluations == 1 else self.size
        if self.best is None or seen.value < self.best[1].value:
            self.best = x.copy(), seen
        return seen.value, seen.gradient

    def _wall(self, x: Array) -> tuple[float, Array]:
        assert self.best is not None
        self.walls += 1
        place, seen = self.best
        away = x - place
        steep = (1 + abs(seen.value) + float(np.abs(seen.gradient @ away))) / max(float(away @ away), 1e-300)
        return seen.value + steep * float(away @ away), 2 * steep * away

    def creep(self, x: Array) -> bool:
        """Take a place as the best if its slope is less than half and its value the same but for rounding."""
        assert self.best is not None
        place, best = self.best
        self.evaluations += 1
        try:
            seen = self.objective(x)
        except PottoError:
            return False
        close = seen.value - best.value <= seen.value_error + best.value_error + ROUNDING * abs(best.value)
        if not (close and self.slope(x, seen) < self.slope(place, best) / 2):
            return False
        self.best = x.copy(), seen
        return True

    @property
    def seen(self) -> Seen:
        """What was seen at the best place."""
        assert self.best is not None
        return self.best[1]

    def limited(self) -> bool:
        """Whether the errors of values hide what the last step gained, so that going on follows noise."""
        if len(self.steps) < 2 or self.converged:
            return False
        gained = self.steps[-2].value - self.steps[-1].value
        return self.seen.value_error > max(gained, ROUNDING * max(abs(self.seen.value), self.size))

    def held(self, x: Array, seen: Seen) -> Any:
        """Whether a bound stops a parameter."""
        return ((x <= self.low) & (seen.gradient > 0)) | ((x >= self.high) & (seen.gradient < 0))

    def slope(self, x: Array, seen: Seen) -> float:
        """The steepest slope for which no bound is in the way, each parameter measured in its own size."""
        free = ~self.held(x, seen)
        return float(np.max(np.abs(seen.gradient) * np.maximum(np.abs(x), 1e-3) * free, initial=0.0))

    def step(self) -> None:
        """Write down the best place so far; leave when it is a minimum."""
        assert self.best is not None
        x, seen = self.best
        slope, seconds = self.slope(x, seen), time.perf_counter() - self.begun
        self.steps.append(Iterate(len(self.steps), seen.value, tuple(map(float, x)), slope, self.evaluations, seconds))
        if self.progress is not None:
            self.progress(self.steps[-1])
        if slope <= SLOPE * max(abs(seen.value), self.size):
            self.converged, self.reason = True, "no slope is left"
            raise Done
        if slope <= seen.error * max(1e-3, float(np.max(np.abs(x)))):
            self.converged, self.reason = True, "the slope is within the error of the derivative"
            if seen.error * max(1e-3, float(np.max(np.abs(x)))) > NOISY * max(abs(seen.value), self.size):
                known = f"noise limits it: {self.reason}, ± {format_error(seen.error)}"
                self.reason = f"{known}; more samples or a smaller tolerance take it further"
            raise Done
        if float(np.max(np.abs(x) / np.maximum(1.0, np.abs(self.steps[0].parameters)))) > FAR:
            self.reason = "a parameter runs away: the value goes on falling without a minimum"
            raise Done
