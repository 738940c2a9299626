"""Who is told how far a call is: what `potto.settings(progress=…)` asks for.

Owns `followed` and `Advance`.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

from msgspec import Struct

from potto.evaluating.progress import shown
from potto.projects.settings import progress, unfollowed
from potto.runtime.evaluation.gauge import Gauge, watching

EVERY = 0.1  # seconds between two reports


class Advance(Struct, frozen=True):
    """How far a call has come.

    share: of the work that is done, from 0 to 1; None while nobody knows. evaluations: of integrands. seconds: since it
    began. left: the seconds that the rest may take; None while nobody knows. at_most: whether share and left are those
    of what `max_evals` or `samples` allow, of which less may be needed.
    """

    share: float | None
    evaluations: int
    seconds: float
    left: float | None
    at_most: bool


@contextmanager
def followed() -> Iterator[None]:
    """In this block is one call, of which is told how far it is; of what it is made of nothing is told."""
    asked = progress()
    if not asked:
        yield
        return
    with unfollowed():
        if asked is True:
            with shown(sys.stderr):
                yield
        else:
            with _reported(asked):
                yield


@contextmanager
def _reported(report: Callable[[Advance], object]) -> Iterator[None]:
    """In this block is told about the evaluation every now and then, and once more when it is over."""
    gauge, start = Gauge(), time.perf_counter()
    last = start

    def told() -> None:
        nonlocal last
        now = time.perf_counter()
        if now - last >= EVERY:
            last = now
            of_all = partial(Advance, evaluations=gauge.evaluations, seconds=now - start, at_most=gauge.limit)
            report(of_all(share=gauge.share if 0 < gauge.share <= 1 else None, left=gauge.left(now)))

    gauge.told = told
    with watching(gauge):
        yield
    if last > start:
        report(Advance(1.0, gauge.evaluations, time.perf_counter() - start, 0.0, False))
