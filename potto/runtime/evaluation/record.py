"""The books of one evaluation: what it has done so far, and how far it has come, for whoever watches.

Owns `Books`, `Met`, `Gauge` and `watching`. Without a watcher no gauge is kept.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from potto.integrate import costs
from potto.integrate.adaptive.undefined import UNDEFINED
from potto.integrate.costs import Costs
from potto.integrate.pieces import INNER, Folded, Sided
from potto.kernels.cells import Array, Bools, Ints, Value
from potto.runtime.answers.convergence import merged

# The derivatives backward and forward, and how far off each may be.
Sides = tuple[Array, Array, Array, Array]


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
class Met:
    """What integrals have met, and which members of the batch did; None: nobody knows which, so any of them may have.

    edges: one-sided derivatives and their errors, (..., members) each. sided, folds, degenerate: what is still
    to be looked into. incomplete: searches for places to cut at that were given up.
    """

    unfinished: dict[str, Ints | None] = field(default_factory=dict)
    edges: list[tuple[Sided, Sides, Ints | None]] = field(default_factory=list)
    sided: dict[Sided, Ints | None] = field(default_factory=dict)
    folds: dict[Sided, tuple[Folded, Ints | None]] = field(default_factory=dict)
    degenerate: dict[str, Ints | None] = field(default_factory=dict)
    incomplete: dict[str, Ints | None] = field(default_factory=dict)

    def nothing(self, size: int) -> Bools:
        """The members of a batch that have met nothing."""
        mask = np.ones(size, dtype=bool)
        folds = {what: members for what, (_, members) in self.folds.items()}
        for event in (self.unfinished, self.degenerate, self.incomplete, self.sided, folds):
            for members in event.values():
                mask[slice(None) if members is None else members] = False
        return mask

    def note_unfinished(self, reason: str, members: Ints | None, once: str) -> None:
        """Add a reason; of those that begin with `once`, the first will do."""
        same = (said for said in self.unfinished if once and said.startswith(once))
        note(self.unfinished, next(same, reason), members)

    def forget_places_of_folds(self) -> None:
        """Of folds that an inner integral met, keep that there are any."""
        for what, (_, members) in self.folds.items():
            self.folds[what] = Folded(INNER, 0, 0.0, None), members

    def note_fold(self, what: Sided, where: Folded, members: Ints | None) -> None:
        """Add a fold; where it is for the first member that has it stands for all."""
        known = {what: self.folds[what][1]} if what in self.folds else {}
        note(known, what, members)
        self.folds[what] = self.folds.get(what, (where, members))[0], known[what]

    def take(self, other: Met, index: Ints | None) -> None:
        """Add what a part of the batch has met, whose members are those of `index` here."""

        def here(members: Ints | None) -> Ints | None:
            return index if members is None or index is None else index[members]

        for name, members in other.degenerate.items():
            note(self.degenerate, name, here(members))
        for search, members in other.incomplete.items():
            note(self.incomplete, search, here(members))
        for reason, members in other.unfinished.items():
            self.note_unfinished(reason, here(members), UNDEFINED if reason.startswith(UNDEFINED) else "")
        for what, members in other.sided.items():
            note(self.sided, what, here(members))
        for what, (fold, members) in other.folds.items():
            self.note_fold(what, fold, here(members))
        self.edges += [(what, sides, here(members)) for what, sides, members in other.edges]


    def of(self, index: Ints) -> Met:
        """What some members have met, who are numbered anew; what is known of nobody is true of all."""
        found = Met()

        def own(members: Ints | None) -> Ints | None:
            return None if members is None else np.searchsorted(index, members[np.isin(members, index)])

        for name, members in self.unfinished.items():
            there = own(members)
            if there is None or there.size:
                found.unfinished[name] = there
        for what, (backward, forward, back, forth), members in self.edges:
            if members is None:
                found.edges.append((what, (backward, forward, back, forth), None))
            elif (kept := np.isin(members, index)).any():
                sides = backward[..., kept], forward[..., kept], back[..., kept], forth[..., kept]
                found.edges.append((what, sides, own(members)))
        return found


def note(where: dict[Any, Ints | None], what: Any, members: Ints | None) -> None:
    """Add the members that something is true of."""
    if what not in where:
        where[what] = members
    elif where[what] is not None:
        before = where[what]
        where[what] = None if members is None or before is None else np.union1d(before, members)


@dataclass
class Books:
    """What one evaluation has done so far. used: answers of before that it is made of.

    met: what the integrals of the present batch have met. reasons, edges: why answers are not what was asked for, and
    where they are one-sided, as masks and numbers over the whole of what was asked for, or True and numbers for one.
    within: the error up to which what cancels is 0 as accurately as asked for, of all or of each of the batch.
    start, members: how many evaluations had been done before those that count, and for how many members these are.
    """

    evaluations: int = 0
    depth: int = 0
    met: Met = field(default_factory=Met)
    reasons: dict[str, Any] = field(default_factory=dict)
    edges: list[tuple[Sided, Sides]] = field(default_factory=list)
    methods: set[str] = field(default_factory=set)
    second: bool = False
    within: Any = 0.0
    start: int = 0
    members: int = 1
    integrals: int = 0
    used: dict[tuple[str, str], Value] = field(default_factory=dict)
    costs: Costs | None = field(default_factory=costs.books)
    gauge: Gauge | None = field(default_factory=_begun)

    @property
    def spent(self) -> float:
        """The evaluations that count, of one member."""
        return (self.evaluations - self.start) / self.members

    def tell(self, met: Met, batch: int, shape: tuple[int, ...]) -> None:
        """Add what the integrals of a whole batch have met to what the answer says, in the batch's shape."""
        for reason, members in met.unfinished.items():
            where: Any = True
            if shape:
                where = np.full(batch, members is None)
                where[[] if members is None else members] = True
                where = where.reshape(shape)
            merged(self.reasons, {reason: where})
        edges: dict[Sided, list[Array]] = {}
        for what, sides, members in met.edges:
            count = batch if members is None else members.size
            for number, side in enumerate(sides):
                rows = side.reshape(-1, count)
                known = edges.setdefault(what, [np.full((rows.shape[0], batch), np.nan) for _ in sides])[number]
                if known.shape[0] == rows.shape[0]:
                    known[:, slice(None) if members is None else members] = rows
        for what, found in edges.items():
            backward, forward, back, forth = (side.reshape(-1, *shape) for side in found)
            self.edges.append((what, (backward, forward, back, forth)))

    @contextmanager
    def apart(self) -> Iterator[Met]:
        """What is met in this block is noted by itself, and forgotten unless somebody takes it."""
        kept, self.met = self.met, Met()
        try:
            yield self.met
        finally:
            self.met = kept

    @contextmanager
    def among(self, index: Ints) -> Iterator[Met]:
        """In this block these members of the batch are all that there are, with a budget of their own."""
        kept = self.start, self.members, self.evaluations
        self.start, self.members = self.evaluations - round(self.spent * index.size), index.size
        try:
            with self.apart() as met:
                yield met
        finally:
            self.start, self.members = kept[0] + self.evaluations - kept[2], kept[1]

    def count(self, evaluations: int, most: int) -> None:
        """Note evaluations of integrands, of which so many are allowed for each member of the batch."""
        self.evaluations += evaluations
        if self.costs is not None:
            self.costs.add(evaluations)
        if self.gauge is not None:
            self.gauge.spent(self.evaluations, most * self.members)
