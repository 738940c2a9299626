"""How far an evaluation has come, for whoever watches it, and who gives it up when it takes too long.

Owns `Gauge`, `watching`, `advancing`, `patient` and `Overtime`. Without a watcher no gauge is kept.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from msgspec import Struct

SURE = 0.01  # the smallest share of the work from which the rest is told


class Overtime(BaseException):
    """An evaluation was given up by who had set a time for it. As an interrupt it is nothing that went wrong."""


class Gauge(Struct):
    """How far the evaluation that goes on has come. Another thread may look at any time.

    start: when it began, by `time.perf_counter`. evaluations: of integrands so far. share: how much of the work is
    done, 0 while nobody knows, as it was told at the time `at`. limit: whether that is a share of the most that is
    allowed, so that it may be over sooner. most: the evaluations of one member that are allowed in all; what is tried
    first is given fewer. samplings: integrals that are sampled; of the second one on, nobody knows how many are to
    come. told: is called whenever there is something new, by the thread that evaluates.
    """

    start: float = 0.0
    evaluations: int = 0
    share: float = 0.0
    at: float = 0.0
    limit: bool = True
    most: int = 0
    samplings: int = 0
    told: Callable[[], None] | None = None

    def begin(self) -> None:
        """Another evaluation begins."""
        self.start, self.evaluations, self.samplings = time.perf_counter(), 0, 0
        self._set(0.0, True)

    def spent(self, evaluations: int, most: int) -> None:
        """So many evaluations are done, of so many that are allowed."""
        self.evaluations = evaluations
        if not self.samplings:
            self._set(evaluations / most, self.limit)
        self.tell()

    def sampled(self, share: float, limit: bool) -> None:
        """So much of the integral that is sampled is done; 0 begins it."""
        self.samplings += share == 0
        self._set(*((share, limit) if self.samplings == 1 else (0.0, True)))
        self.tell()

    def of_parts(self, share: float, evaluations: int) -> None:
        """So much of what is evaluated in parts is done."""
        self.evaluations = evaluations
        self._set(share, False)
        self.tell()

    def tell(self) -> None:
        """Tell whoever wants to know."""
        if self.told is not None:
            self.told()

    def left(self, now: float) -> float | None:
        """The seconds that the rest may take, or takes at most; None while nobody knows."""
        if not SURE < self.share <= 1:
            return None
        return max((self.at - self.start) * (1 - self.share) / self.share - (now - self.at), 0.0)

    def _set(self, share: float, limit: bool) -> None:
        self.share, self.limit, self.at = share, limit, time.perf_counter()


_gauge: ContextVar[Gauge | None] = ContextVar("potto_gauge", default=None)


def begun() -> Gauge | None:
    """The gauge of an evaluation that begins, if anyone watches."""
    gauge = _gauge.get()
    if gauge is not None:
        gauge.begin()
    return gauge


@contextmanager
def watching(gauge: Gauge) -> Iterator[Gauge]:
    """In this block evaluations of this thread or task say how far they have come."""
    token = _gauge.set(gauge)
    try:
        yield gauge
    finally:
        _gauge.reset(token)


@contextmanager
def advancing() -> Iterator[Callable[[float, int], None]]:
    """In this block a batch is evaluated in parts, and how far it is as a whole is told by who does that: the share of
    its members, and the evaluations. Those of the part that is being evaluated are added to these."""
    whole = begun()
    if whole is None:
        with _unwatched():
            yield lambda share, evaluations: None
        return
    part, done = Gauge(), 0

    def within() -> None:
        whole.evaluations = done + part.evaluations
        whole.tell()

    def told(share: float, evaluations: int) -> None:
        nonlocal done
        done, part.evaluations = evaluations, 0
        whole.of_parts(share, evaluations)

    part.told = within
    with watching(part):
        yield told


@contextmanager
def _unwatched() -> Iterator[None]:
    token = _gauge.set(None)
    try:
        yield
    finally:
        _gauge.reset(token)


@contextmanager
def patient(late: Callable[[], bool]) -> Iterator[None]:
    """In this block what is evaluated is given up as soon as it is late. Raises Overtime."""
    gauge = _gauge.get() or Gauge()
    before = gauge.told

    def told() -> None:
        if late():
            raise Overtime
        if before is not None:
            before()

    gauge.told = told
    with watching(gauge):
        try:
            yield
        finally:
            gauge.told = before
