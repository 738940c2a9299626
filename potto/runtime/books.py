"""The books of one evaluation: what it has done so far, and how far it has come, for whoever watches.

Owns `Books`, `Gauge` and `watching`. Without a watcher no gauge is kept.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field

from potto.integrate import costs
from potto.integrate.costs import Costs
from potto.integrate.pieces import INNER, Folded, Sided
from potto.kernels.cells import Array, Value


@dataclass(slots=True)
class Gauge:
    """How far the evaluation that goes on has come. Another thread may look at any time.

    start: when it began, by `time.perf_counter`. evaluations: of integrands so far. share: how much of the work is
    done, 0 while nobody knows. limit: whether that is a share of the most that is allowed, so that it may be over
    sooner. samplings: integrals that are sampled; of the second one on, nobody knows how many are to come.
    """

    start: float = 0.0
    evaluations: int = 0
    share: float = 0.0
    limit: bool = True
    samplings: int = 0

    def begin(self) -> None:
        """Another evaluation begins."""
        self.start, self.evaluations, self.share, self.limit, self.samplings = time.perf_counter(), 0, 0.0, True, 0

    def spent(self, evaluations: int, most: int) -> None:
        """So many evaluations are done, of so many that are allowed."""
        self.evaluations = evaluations
        if not self.samplings:
            self.share = evaluations / most

    def sampled(self, share: float, limit: bool) -> None:
        """So much of the integral that is sampled is done."""
        self.share, self.limit = (share, limit) if self.samplings == 1 else (0.0, True)


_gauge: ContextVar[Gauge | None] = ContextVar("potto_gauge", default=None)


@contextmanager
def watching(gauge: Gauge) -> Iterator[Gauge]:
    """In this block evaluations of this thread or task say how far they have come."""
    token = _gauge.set(gauge)
    try:
        yield gauge
    finally:
        _gauge.reset(token)


def _begun() -> Gauge | None:
    gauge = _gauge.get()
    if gauge is not None:
        gauge.begin()
    return gauge


@dataclass
class Books:
    """What one evaluation has done so far. used: answers of before that it is made of.

    gross: the largest that an integral, or its derivative, adds up to without regard to sign.
    """

    evaluations: int = 0
    depth: int = 0
    unfinished: list[str] = field(default_factory=list)
    edges: list[tuple[Sided, Array, Array]] = field(default_factory=list)
    sided: dict[Sided, None] = field(default_factory=dict)
    folds: dict[Sided, Folded] = field(default_factory=dict)
    methods: set[str] = field(default_factory=set)
    degenerate: set[str] = field(default_factory=set)
    second: bool = False
    gross: float = 0.0
    members: int = 1
    integrals: int = 0
    used: dict[tuple[str, str], Value] = field(default_factory=dict)
    costs: Costs | None = field(default_factory=costs.books)
    gauge: Gauge | None = field(default_factory=_begun)

    def forget_places_of_folds(self) -> None:
        """Of folds that an inner integral met, keep that there are any."""
        for what in self.folds:
            self.folds[what] = Folded(INNER, 0, 0.0, None)

    def count(self, evaluations: int, most: int) -> None:
        """Note evaluations of integrands, of which so many are allowed for each member of the batch."""
        self.evaluations += evaluations
        if self.costs is not None:
            self.costs.add(evaluations)
        if self.gauge is not None:
            self.gauge.spent(self.evaluations, most * self.members)
