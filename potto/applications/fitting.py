"""Fitting: the parameters that make a function of Potto least, or bring it to a target, found along its derivatives.

Owns `fit` and what it answers with, and `minimized`, which knows no Potto. The derivatives hold their boundary
terms, so a quasi-Newton method (L-BFGS-B of scipy) goes to the minimum as it would for a smooth function. Where it
stops short of one, the answer says why.
"""

from __future__ import annotations

import difflib
import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from potto.diagnostics import PottoError
from potto.kernels.cells import Array
from potto.kernels.errors import wrong_call
from potto.python.functions import Function
from potto.python.gradients import grad
from potto.runtime.answers.estimate import Estimate
from potto.runtime.answers.printing import format_digits

MOST_STEPS = 200
# The slope of a minimum, measured in the size of the values met and of the parameters.
SLOPE = 1e-8
FIRST = 0.25  # of the size of a parameter: how far the first step goes at most, before any curvature is known
MEMORY = 20  # steps that the curvature is learned from
CREEPING = 8  # steps by slopes alone, where values have no digits left to tell one place from another
ROUNDING = 1e-14
FAR = 1e9  # how far a parameter may run from where it started, in its own size, before we say that it runs away

STUCK = "no step along the derivative makes it smaller, though a slope is left: a kink, or the limit of accuracy"

Objective = Callable[[Array], "Seen"]


class Seen(Struct, frozen=True):
    """The value and the gradient at one place; `error` bounds that of the gradient, `value_error` that of the value."""

    value: float
    gradient: Array
    error: float = 0.0
    value_error: float = 0.0


class Step(Struct, frozen=True):
    """How far a minimization has come: the parameters, the value there, its steepest slope, evaluations so far."""

    number: int
    value: float
    parameters: tuple[float, ...]
    slope: float
    evaluations: int
    seconds: float


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
    steps: tuple[Step, ...]
    evaluations: int
    seconds: float
    error: float = 0.0
    held: frozenset[str] = frozenset()
    numbers: dict[str, float] = {}

    def __getitem__(self, name: str) -> Any:
        return self.parameters[name]

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


def fit(
    function: Function,
    start: Mapping[str, Any],
    *,
    given: Mapping[str, Any] | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    target: Any = None,
    steps: int = MOST_STEPS,
    progress: Callable[[Step], None] | None = None,
    watch: Callable[[Estimate], object] | None = None,
) -> Fit:
    """Make a function least over the parameters named in `start`, from there on: numbers, or arrays.

    given: the other parameters; arrays among them make the function an array. bounds: what a parameter, or each
    element of one, may be.
    target: where the function should come to instead of being least: then what is made least is the mean of the squared
    distances; numbers, tuples and arrays as the function's answer has them. progress: is told every step;
    watch: is given every answer of the function.

    Raises PottoError if the arguments do not fit the function or it has no value at the start.
    """
    given = dict(given or {})
    names = tuple(start)
    if not names:
        raise wrong_call("no parameter is named to fit")
    for name in bounds or {}:
        if name not in names:
            near = difflib.get_close_matches(name, names, 1)
            hint = f"did you mean `{near[0]}`?" if near else ""
            raise wrong_call(f"a bound is given for `{name}`, which is not fitted", hint)
    gradient = grad(function, names)
    begun = {name: _begun(name, value) for name, value in start.items()}

    def objective(x: Array) -> Seen:
        answer = gradient(**_named(begun, x), **given)
        if watch is not None:
            watch(answer)
        return _seen(answer, [np.ndim(value) for value in begun.values()], target)

    limits = [(bounds or {}).get(name, (-math.inf, math.inf)) for name, value in begun.items() for _ in _labels(value)]
    numbers = {
        f"{name}{label}": float(number)
        for name, value in begun.items()
        for label, number in zip(_labels(value), np.ravel(value), strict=True)
    }
    if not numbers:
        raise wrong_call("the arrays to fit have no elements")
    found = minimized(objective, numbers, limits, steps, progress)
    return replace(found, parameters=_named(begun, np.array(list(found.numbers.values()))))


def _begun(name: str, value: Any) -> Any:
    try:
        found = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise wrong_call(f"`{name}` starts at a Python {type(value).__name__}, not at numbers") from None
    return found if found.ndim else float(found)


def _labels(value: Any) -> list[str]:
    """What is behind a parameter's name for each of its numbers."""
    return [f"[{', '.join(map(str, place))}]" if place else "" for place in np.ndindex(np.shape(value))]


def _named(begun: Mapping[str, Any], x: Array) -> dict[str, Any]:
    """Numbers in a row as parameters, in the form in which they began."""
    found, at = {}, 0
    for name, value in begun.items():
        size = np.size(value)
        found[name] = x[at : at + size].reshape(np.shape(value)) if np.ndim(value) else float(x[at])
        at += size
    return found


def _seen(found: Any, axes: Sequence[int], target: Any) -> Seen:
    """What is to be least: the function itself, or the mean of its squared distances to the target.

    axes: how many each parameter has.
    """
    sides = (
        [_by_numbers(part, found, n) for part, n in zip(side if len(axes) > 1 else (side,), axes, strict=True)]
        for side in (found.tangent, found.tangent_error)
    )
    tangents, errors = (np.concatenate(parts) for parts in sides)
    value, bound = _flat(found.value), _flat(found.error)
    tangents = np.broadcast_to(tangents, (len(tangents), value.size))
    error = float(np.max(errors, initial=0.0))
    if target is None:
        if value.size != 1:
            raise wrong_call(
                f"the function gives {value.size} numbers, and only one number can be least",
                "say which numbers they should be: give a target",
            )
        return Seen(float(value[0]), tangents[:, 0], error, float(bound[0]))
    wanted = _flat(target)
    if wanted.size not in (1, value.size):
        raise wrong_call(f"the target has {wanted.size} numbers, the function's answer {value.size}")
    off = value - wanted
    scale = float(np.sqrt(np.mean(off**2)))
    value_error = float(np.mean((2 * np.abs(off) + bound) * bound))
    return Seen(float(np.mean(off**2)), 2 * np.mean(off * tangents, axis=1), 2 * scale * error, value_error)


def _by_numbers(slopes: Any, found: Any, axes: int) -> Array:
    """Derivatives by a parameter as rows, one for each of its numbers.

    Those by an array have the axes of the batch, of the array, and of the answer; parts of a tuple are the last one.
    """
    if not axes:
        return _flat(slopes)[None]
    batch = np.ndim(found.member_converged) if found.member_converged is not None else 0
    whole = np.moveaxis(np.asarray(slopes), range(batch, batch + axes), range(axes))
    if isinstance(found.value, tuple):
        whole = np.moveaxis(whole, -1, axes)
    return whole.reshape(int(np.prod(whole.shape[:axes])), -1)


def _flat(value: Any) -> Array:
    """The numbers of an answer, one after the other."""
    if isinstance(value, tuple | list):
        parts = [_flat(item) for item in value]
        width = max((part.size for part in parts), default=0)
        return np.concatenate([np.broadcast_to(part, (width,)) if part.size == 1 else part for part in parts])
    if value is None:
        raise wrong_call("the function gives a function, and only numbers can be least")
    return np.asarray(value, dtype=float).reshape(-1)


class _Done(Exception):
    """A minimum was reached, or there is nowhere to go."""


class _Walk:
    """A minimization under way: what was seen, the best place, and the steps.

    A place without a value (an error of the program, nan, infinity) is answered with a wall: a parabola around the best
    place that is higher than it everywhere else, so that a search along a line turns back.
    """

    def __init__(
        self, objective: Objective, names: tuple[str, ...], limits: Sequence[tuple[float, float]],
        progress: Callable[[Step], None] | None,
    ) -> None:  # fmt: skip
        self.objective, self.names, self.progress = objective, names, progress
        self.low, self.high = (np.array(side, dtype=float) for side in zip(*limits, strict=True))
        self.begun = time.perf_counter()
        self.evaluations = self.walls = 0
        self.steps: list[Step] = []
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
        self.steps.append(Step(len(self.steps), seen.value, tuple(map(float, x)), slope, self.evaluations, seconds))
        if self.progress is not None:
            self.progress(self.steps[-1])
        if slope <= SLOPE * max(abs(seen.value), self.size):
            self.converged, self.reason = True, "no slope is left"
            raise _Done
        if slope <= seen.error * max(1e-3, float(np.max(np.abs(x)))):
            self.converged, self.reason = True, "the slope is within the error of the derivative"
            raise _Done
        if float(np.max(np.abs(x) / np.maximum(1.0, np.abs(self.steps[0].parameters)))) > FAR:
            self.reason = "a parameter runs away: the value goes on falling without a minimum"
            raise _Done


def minimized(
    objective: Objective,
    start: Mapping[str, float],
    limits: Sequence[tuple[float, float]],
    most: int = MOST_STEPS,
    progress: Callable[[Step], None] | None = None,
) -> Fit:
    """Follow the gradient of `objective` from `start` to a minimum within `limits`.

    Raises what the objective raises at the start.
    """
    from scipy.optimize import minimize

    names = tuple(start)
    walk = _Walk(objective, names, limits, progress)
    x0 = np.clip(np.array([float(v) for v in start.values()]), walk.low, walk.high)
    unit = FIRST * np.maximum(np.abs(x0), 0.1)  # the method's first step is at most one of these

    def look(z: Array) -> tuple[float, Array]:
        value, slopes = walk.look(np.clip(x0 + unit * z, walk.low, walk.high))
        return value, slopes * unit

    try:
        walk.look(x0)
        walk.step()
        result = minimize(
            look, np.zeros_like(x0), jac=True, method="L-BFGS-B",
            bounds=list(zip((walk.low - x0) / unit, (walk.high - x0) / unit, strict=True)),
            callback=lambda _: walk.step(),
            options={"maxiter": most, "ftol": 0.0, "gtol": 0.0, "maxcor": MEMORY, "maxls": 40, "maxfun": 40 * most},
        )  # fmt: skip
        walk.reason = _reason(walk, str(result.message), most)
        if walk.reason == STUCK:
            _creep(walk, lambda slopes: unit * np.asarray(result.hess_inv @ (unit * slopes)))
    except _Done:
        pass
    assert walk.best is not None
    x, seen = walk.best
    parameters = {name: float(v) for name, v in zip(names, x, strict=True)}
    held = frozenset(name for name, stops in zip(names, walk.held(x, seen), strict=True) if stops)
    return Fit(parameters, seen.value, walk.slope(x, seen), walk.converged, walk.reason, tuple(walk.steps),
               walk.evaluations, time.perf_counter() - walk.begun, seen.value_error, held, parameters)  # fmt: skip


def _creep(walk: _Walk, newton: Callable[[Array], Array]) -> None:
    """Go on by the slopes: near a minimum they have all their digits, where the values have half of theirs.

    newton: the step for a slope, by the curvature that the method has learned.
    """
    for _ in range(CREEPING):
        assert walk.best is not None
        x, seen = walk.best
        if not walk.creep(np.clip(x - newton(seen.gradient), walk.low, walk.high)):
            return
        walk.step()


def _reason(walk: _Walk, message: str, most: int) -> str:
    """Why the method left without a minimum."""
    if len(walk.steps) > most or "LIMIT" in message.upper():
        return f"{most} steps are done and the value still falls"
    if walk.trouble is not None:
        return f"it ends where the program has no value: {walk.trouble.diagnostics[0].message}"
    if walk.walls:
        return "it ends beside places where the value is no number"
    return STUCK


def column(numbers: Sequence[float]) -> Array:
    """Numbers as an array, as `fit` takes those of a table."""
    return np.array(numbers, dtype=float)
