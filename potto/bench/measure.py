"""Measuring: each method up its ladder on each problem, until a rung takes too long.

Owns `BenchRun`, `measure` and `slope`. Times are warm: everything is made ready and run once before the clock counts.
What a method says of its error is kept beside the true error.
"""

from __future__ import annotations

import itertools
import math
import statistics
import time
from collections.abc import Iterable, Iterator, Sequence

from msgspec import Struct

from potto.bench.adapter import Adapter, MethodAnswer, Solve
from potto.bench.problems import BenchProblem, Quantity

SEEDS = 6  # for methods that draw random numbers: errors are root mean squares over these
REPEATS = 3
SPARE = 0.02  # seconds that repeats may take in all
FLOOR, CEILING = 1e-13, 0.5  # errors below are rounding, above no answers: they say nothing about convergence


class BenchRun(Struct, frozen=True):
    """One method at one setting on one problem.

    seconds: the least time of an answer. error: relative; of a random method the root mean square over seeds.
    reported: the error that the method gave itself, relative likewise; None if it gives none. failure: what went wrong
    instead of an answer.
    """

    problem: str
    quantity: Quantity
    method: str
    dial: str
    setting: float
    seconds: float
    evaluations: int
    value: float
    error: float
    reported: float | None
    failure: str = ""


def measure(
    problems: Iterable[BenchProblem], adapters: Sequence[Adapter], quantities: Sequence[Quantity], seconds: float,
    rungs: int | None = None,
) -> Iterator[BenchRun]:  # fmt: skip
    """Runs as they are done. A ladder ends after `rungs`, or at the first answer that takes longer than `seconds`."""
    for problem, quantity, adapter in itertools.product(problems, quantities, adapters):
        ladder = adapter.ladder(problem)[:rungs]
        if ladder and adapter.missing() is None:
            yield from climb(problem, quantity, adapter, ladder, seconds)


def climb(
    problem: BenchProblem, quantity: Quantity, adapter: Adapter, ladder: Sequence[float], seconds: float
) -> Iterator[BenchRun]:
    """One method on one problem, rung by rung."""
    solve = adapter.prepare(problem, quantity)
    for number, rung in enumerate(ladder):
        try:
            if number == 0:
                solve(rung, 0)
            run = timed(problem, quantity, adapter, solve, rung)
        except Exception as error:  # a peer may raise what it likes; the report says so
            said, nan = f"{type(error).__name__}: {error}".partition("\n")[0], math.nan
            yield BenchRun(problem.id, quantity, adapter.name, adapter.dial, rung, nan, 0, nan, nan, None, said)
            return
        yield run
        if run.seconds > seconds:
            return


def timed(problem: BenchProblem, quantity: Quantity, adapter: Adapter, solve: Solve, rung: float) -> BenchRun:
    """One rung: a few repeats, or a few seeds."""
    answers: list[MethodAnswer] = []
    times: list[float] = []
    for turn in range(SEEDS if adapter.random else REPEATS):
        start = time.perf_counter()
        answers.append(solve(rung, turn if adapter.random else 0))
        times.append(time.perf_counter() - start)
        if not adapter.random and sum(times) > SPARE:
            break
    errors = [problem.error(quantity, answer.value) for answer in answers]
    exact = abs(problem.exact[quantity])
    reports = [answer.reported / exact for answer in answers if answer.reported is not None]
    return BenchRun(
        problem.id, quantity, adapter.name, adapter.dial, rung, min(times),
        round(statistics.fmean(answer.evaluations for answer in answers)), answers[0].value, rms(errors),
        rms(reports) if reports else None,
    )  # fmt: skip


def rms(numbers: Sequence[float]) -> float:
    """The root of the mean square."""
    return math.sqrt(statistics.fmean(x * x for x in numbers))


def slope(runs: Iterable[BenchRun]) -> float | None:
    """The slope of log(error) over log(evaluations) through runs, by least squares; None for fewer than four points."""
    points = [(math.log(r.evaluations), math.log(r.error)) for r in runs
              if r.evaluations > 0 and FLOOR < r.error < CEILING]  # fmt: skip
    if len(points) < 4:
        return None
    return statistics.linear_regression(*zip(*points, strict=True)).slope
