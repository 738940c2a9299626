"""Holding random programs against brute force: values, derivatives to both sides, and what is reported of them.

Owns `Point`, `where` and `check`. The value of a program comes from `plain_quadrature`, to about 1e-12. Its derivative
is extrapolated from differences with steps 0.004, 0.002 and 0.001: to about 1e-9, and the last two extrapolations say
how well; where those of the two sides differ, from one-sided ones. Where quotients do not settle nothing is compared.
"""

from __future__ import annotations

import math
import random
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from plain_quadrature import GRID, Program, TooHard, books, estimate
from program_source import random_program

import potto
from potto.diagnostics import PottoError

BUDGET = 2_000_000  # enough for what these programs are; one whose budget runs out must say so
STEPS = (0.004, 0.002, 0.001)
POOR = 1e-7  # of a size of 1: a reference that is no better is none
OTHER = 3  # a spelling that nothing else has
SLOW = 20.0  # seconds
ENOUGH = 2_000_000  # points of a reference whose differences are not asked for: some 2 s of them
MEANINGLESS = ("P0505",)  # a delta where its factor jumps
AWKWARD = (0.0, 1.0, 0.5, -0.5, 1e-8, 2.0, -1.0, 1e-15)


class Wrong(AssertionError):
    """What a program does not keep. kind: which promise."""

    def __init__(self, kind: str, context: str) -> None:
        super().__init__(f"{kind}\n{context}")
        self.kind = kind


@dataclass(frozen=True)
class Point:
    """Where a program is evaluated, and the direction of its derivative."""

    t: float
    s: float
    dt: float
    ds: float

    @property
    def beside(self) -> bool:
        """Whether a kink may be so near that differences take it for one here."""
        return any(0 < abs(x) < 1e-6 for x in (self.t, self.s, self.t - self.s, self.t + self.s - 1))

    def moved(self, h: float) -> dict[str, float]:
        return {"t": self.t + h * self.dt, "s": self.s + h * self.ds}


def where(number: int) -> Point:
    pick = random.Random(number)
    return Point(pick.uniform(0.2, 1.3), pick.uniform(0.2, 1.3), *pick.choice([(1.0, 0.0), (0.0, 1.0), (1.0, -0.5)]))


def awkward(number: int) -> Point:
    """Where surfaces meet bounds, corners and one another, or ranges have no length."""
    pick = random.Random(number)
    t = pick.choice((*AWKWARD, pick.uniform(0.2, 1.3)))
    s = pick.choice((*AWKWARD, t, t, -t, 1 - t, t + 1e-8))
    return Point(t, s, *pick.choice([(1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, -0.5)]))


@dataclass(frozen=True)
class Slope:
    """A derivative by differences: backward, forward and how far off these are (infinite, if they don't settle)."""

    backward: float
    forward: float
    error: float

    @property
    def known(self) -> bool:
        return self.error < math.inf

    @property
    def one(self) -> bool:
        """Whether that is one derivative."""
        return self.known and abs(self.forward - self.backward) <= self.error


UNKNOWN = Slope(math.nan, math.nan, math.inf)


def slope(program: Program, point: Point, value: float) -> Slope:
    """Central where the two sides agree, else one-sided."""
    both, off = [], 0.0
    for h in STEPS:
        (up, off_up), (down, off_down) = estimate(program, **point.moved(h)), estimate(program, **point.moved(-h))
        both.append(((up - value) / h, (value - down) / h))
        off = max(off, off_up, off_down)
    noise = (1e-12 * max(1.0, abs(value)) + 10 * off) / STEPS[-1]
    gaps, central = [abs(f - b) for f, b in both], [(f + b) / 2 for f, b in both]
    first, second = (4 * central[1] - central[0]) / 3, (4 * central[2] - central[1]) / 3
    best = (16 * second - first) / 15
    # A kink's gap stays when the step is halved, that of a smooth function is halved too.
    if gaps[2] <= 0.6 * gaps[1] + 1e-7 * max(1.0, abs(best)):
        return _settled(best, best, 10 * abs(best - second) + noise)
    sides, errors = [], []
    for side in (1, 0):
        q = [pair[side] for pair in both]
        first, second = 2 * q[1] - q[0], 2 * q[2] - q[1]
        sides.append((4 * second - first) / 3)
        errors.append(10 * abs(sides[-1] - second))
    return _settled(*sides, max(errors) + 4 * noise)


def _settled(backward: float, forward: float, error: float) -> Slope:
    size = max(1.0, abs(backward), abs(forward))
    return Slope(backward, forward, error if error < 1e-3 * size else math.inf)


Source = Callable[[int, bool, int, float], tuple[str, Program]]


@dataclass(frozen=True)
class Asked:
    """How a program is spelled, where it is evaluated, and what it is asked for."""

    number: int
    point: Point
    spelling: int = 0
    flat: bool = False
    settings: tuple[tuple[str, Any], ...] = ()
    unit: float = 1.0  # in which t is given: parameters may be large, or small
    source: Source = random_program  # what writes the program

    @property
    def method(self) -> str:
        return str(dict(self.settings).get("method", "auto"))


def asked(number: int) -> Asked:
    """Everything drawn from a number."""
    pick = random.Random(number * 7 + 1)
    tolerance = pick.choice(((), (), (), (("rtol", 1e-4),), (("rtol", 1e-7),), (("rtol", 1e-13),)))
    method = pick.choice(((),) * 18 + ((("method", "mc"), ("samples", 4000)), (("method", "qmc"), ("samples", 4096))))
    point = awkward(number) if pick.random() < 0.35 else where(number)
    flat, spelling = pick.random() < 0.3, pick.choice((0, 1, 2))
    return Asked(number, point, spelling, flat, method or tolerance, pick.choice((*(1.0,) * 8, 2.0**27, 2.0**-20)))


def tame(number: int) -> Asked:
    """A program of one variable or several as it stands, at no special place."""
    return Asked(number, where(number), flat=number % 2 == 0)


def check(number: int) -> str:
    return held(asked(number))


def held(ask: Asked) -> str:
    """What came of one program. Raises Wrong."""
    text, program = ask.source(ask.number, ask.flat, ask.spelling, ask.unit)
    context = f"{ask}\n{text}"
    try:
        value, off = estimate(program, **ask.point.moved(0.0))
        sides = slope(program, ask.point, value) if books.points < ENOUGH else UNKNOWN
    except TooHard:
        value = off = math.nan
        sides = UNKNOWN
    if not off < POOR * max(1.0, abs(value)):
        value = math.nan  # compared with nothing
    began = time.process_time()
    try:
        with potto.settings(max_evals=BUDGET, **dict(ask.settings)):
            answer = _answer(ask, context)
    except PottoError as refused:
        if refused.diagnostics[0].code in MEANINGLESS:
            return "no meaning"
        raise Wrong(f"refused {refused.diagnostics[0].code}", f"{context}{refused}") from refused
    except Wrong:
        raise
    except Exception as crash:
        raise Wrong(f"crash {type(crash).__name__}", context) from crash
    took = time.process_time() - began
    context += f"{answer}\nwith {answer.error} {answer.tangent_error}; is {value}, {off} {sides}"
    context += f"\n{answer.reasons} {answer.notes}"
    if took > SLOW:
        raise Wrong("slow", f"{took:.0f} s: {context}")
    if math.isnan(value) and ask.method == "auto" and ask.spelling != OTHER:
        with potto.settings(max_evals=BUDGET, **dict(ask.settings)):
            other = _answer(replace(ask, spelling=OTHER), context)
        agree("spelling", context, answer, other.value, other.error, other.tangent, other.tangent_error)
        return "like another spelling"
    try:
        return compared(ask, answer, value, off, sides, context)
    except Wrong as wrong:
        if "value" in wrong.kind and missed(program, ask.point, value):
            return "no reference"
        raise


def missed(program: Program, point: Point, value: float) -> bool:
    """Whether a grid that is three times as fine sees what that of the reference did not."""
    try:
        finer, _ = estimate(program, 3 * GRID, **point.moved(0.0))
    except TooHard:
        return False
    return not abs(finer - value) <= 1e-11 * max(1.0, abs(value))


def _function(ask: Asked) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", potto.ProgramWarning)  # where only `f` is broken
        return potto.compile(ask.source(ask.number, ask.flat, ask.spelling, ask.unit)[0]).f


def _answer(ask: Asked, context: str) -> Any:
    """The dual; as a number and, now and then, as a member of an array and by `grad`: these must agree."""
    p, f = ask.point, _function(ask)
    p = replace(p, t=p.t * ask.unit, dt=p.dt * ask.unit)
    dual = potto.deriv(f)((p.t, p.dt), (p.s, p.ds))
    pick = random.Random(ask.number + 5)
    if pick.random() < 0.2 and ask.method == "auto":
        t, s = np.array([0.375, p.t, p.t]), np.array([p.s, p.s, 0.8])
        array = potto.deriv(f)((t, np.full(3, p.dt)), (s, np.full(3, p.ds)))
        agree("array", context, dual, array.value[1], array.error[1], array.tangent[1], array.tangent_error[1])
    elif pick.random() < 0.2 and ask.method == "auto":
        g = potto.grad(f, wrt=["t", "s"])(p.t, p.s)
        rate = p.dt * g.tangent[0] + p.ds * g.tangent[1]
        error = abs(p.dt) * g.tangent_error[0] + abs(p.ds) * g.tangent_error[1]
        agree("gradient", context, dual, g.value, g.error, rate, error)
    return dual


def agree(what: str, context: str, dual: Any, value: float, error: float, rate: float, rate_error: float) -> None:
    if math.isnan(dual.value) or math.isnan(value):
        return
    context += f"{dual} with {dual.error} {dual.tangent_error}\n{value} {error} {rate} {rate_error}"
    size = max(1.0, abs(dual.value), abs(dual.tangent))
    if not (abs(value - dual.value) <= error + dual.error + 1e-13 * size):
        raise Wrong(f"{what} value", context)
    if dual.notes or math.isnan(rate) or math.isnan(dual.tangent):
        return
    if not (abs(rate - dual.tangent) <= rate_error + dual.tangent_error + 1e-12 * size):
        raise Wrong(f"{what} slope", context)


def compared(ask: Asked, answer: Any, value: float, off: float, sides: Slope, context: str) -> str:
    """Whether an answer is right within what it reports, and reports something."""
    size, sampled = max(1.0, abs(value)), ask.method in ("mc", "qmc")
    wider = 1.6 if sampled else 1.0  # 4 to 6 standard deviations
    if math.isnan(value):
        return "no reference"
    if math.isnan(answer.value):
        raise Wrong("nan value", context)
    if not abs(answer.value - value) <= wider * answer.error + 1e-11 * size + 3 * off:
        raise Wrong("silent value" if answer.converged else "value beyond its bar", context)
    if answer.error == math.inf and not sampled:
        raise Wrong("value without a bar", context)
    if not answer.converged and not answer.reasons:
        raise Wrong("no reason", context)
    if not sides.known or (sampled and not answer.converged and not answer.tangent_error < math.inf):
        return "not differentiable"
    allowed = wider * answer.tangent_error + 2 * sides.error
    near = [abs(answer.tangent - side) <= allowed for side in (sides.backward, sides.forward)]
    if sides.one:
        if (math.isnan(answer.tangent) or answer.tangent_error == math.inf) and not sampled:
            raise Wrong("slope without a bar", context)
        if not any(near):
            if ask.point.beside:
                return "to rounding"
            raise Wrong("silent slope" if answer.converged else "slope beyond its bar", context)
        return "compared" if answer.converged else "not converged"
    apart = abs(sides.forward - sides.backward)
    if answer.notes or not answer.converged or answer.tangent_error >= 0.4 * apart:
        return "two sides"
    if any(near) and ask.point.beside:
        return "to rounding"
    raise Wrong(("sampled " if sampled else "") + "one side without a note" if any(near) else "silent side", context)
