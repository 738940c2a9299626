"""What a line of the benchmark of abilities is, and how two costs are compared.

Owns `Line`, `Finding` and helpers that measure. The lines are in `ability_costs` and `ability_regions`.
"""

from __future__ import annotations

import math
import time
import timeit
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

TESTS = Path(__file__).resolve().parent.parent / "tests"
CATALOGUES = [str(TESTS / folder) for folder in ("catalogue", "integrate", ".")]
TURNS = 3  # of which the fastest counts
SETTLING = 0.5  # seconds of calls before the first that counts: machine code takes over meanwhile, in its own time
CLOCK = time.process_time  # what others do on the machine is no part of it
LONG = 10.0  # seconds of a first call after which there is no second one


@dataclass(frozen=True)
class Finding:
    """What came of a line.

    value, error: an answer, with the bound that it gives itself. off: its true error, relative; that of its derivative
    where it is larger. seconds: of the processor for one call, warm; not a number where there was no answer. ratio: the
    one that the line is about. note: what else there is to say, or why there is no answer.
    """

    value: float | None = None
    error: float | None = None
    off: float | None = None
    evals: int = 0
    seconds: float = math.nan
    ratio: float | None = None
    met: bool = False
    note: str = ""


@dataclass(frozen=True)
class Line:
    """One ability: what is asked, what should come of it, and how that is found out."""

    name: str
    asked: str
    goal: str
    run: Callable[[], Finding]


def warm(run: Callable[[], Any]) -> float:
    """Seconds of one call after the first ones. The processor's clock may tick slowly: many short calls are taken."""
    settled = time.perf_counter() + SETTLING
    while time.perf_counter() < settled:
        run()
    timer = timeit.Timer(run, timer=CLOCK)
    number, spent = timer.autorange()
    return min([spent, *timer.repeat(TURNS - 1, number)] if spent < LONG / TURNS else [spent]) / number


def once(run: Callable[[], Any]) -> tuple[Any, float]:
    """An answer, and the seconds of one warm call; of the first and only one where that took very long."""
    start = CLOCK()
    answer = run()
    first = CLOCK() - start
    return answer, (first if first > LONG else warm(run))


def relative(found: float, exact: float) -> float:
    return abs(found - exact) / abs(exact) if exact else abs(found)


def covered(answer: Any, value: float, derivative: float | None = None) -> bool:
    """Whether the bounds that an answer gives hold, and are numbers at all; a few ulp of the truth are its own."""
    pairs = [(answer.value, answer.error, value)]
    if derivative is not None:
        pairs.append((answer.tangent, answer.tangent_error, derivative))
    return all(math.isfinite(e) and abs(v - x) <= e + 2.0**-50 * abs(x) for v, e, x in pairs)


def doubling(seconds: dict[int, float]) -> float:
    """The worst ratio of costs at 2n and n."""
    return max(seconds[2 * n] / s for n, s in seconds.items() if 2 * n in seconds)


def listed(seconds: dict[int, float]) -> str:
    return ", ".join(f"{n}: {s * 1e3:.2f} ms" for n, s in seconds.items())
