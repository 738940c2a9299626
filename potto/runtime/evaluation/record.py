"""The record of one evaluation: what it has done so far, which `gauge` tells whoever watches.

Owns `Record`.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from msgspec import Struct, field

from potto.core.terms import Term
from potto.integrate import costs
from potto.integrate.costs import Costs
from potto.integrate.decomposition.root_isolation import Isolated
from potto.integrate.events import Events, OneSidedDerivatives, Shortfall, TwoSided, mask_of
from potto.kernels.cells import Array, Value
from potto.kernels.tape import Node
from potto.runtime.answers.allowances import NOTHING, Allowed
from potto.runtime.answers.convergence import Precise, Shortfalls, merged
from potto.runtime.evaluation.gauge import Gauge, begun

# A box takes as long as 1 to 5 evaluations. Of the catalogue's regions in three variables one takes 157,000 boxes, the
# others less; where several waves cross it may be tens of millions.
BOXES_FOR_EVALUATIONS = 8
MOST_BOXES = 20_000_000 // BOXES_FOR_EVALUATIONS


class Record(Struct):
    """What one evaluation has done so far. used: answers of before that it is made of.

    shortfalls, edges: why answers are not what was asked for, and where they are one-sided, as masks and numbers over
    the whole of what was asked for, or True and numbers for one.
    met: how often something was met that has two derivatives; taped: what it moves with on a tape, if there is one, as
    nodes and the members of these.
    allowed: what may be off of what cancels, of all or of each of the batch.
    culled: integrals that are 0 for certain, and were not evaluated. seen: such as were answered without a plan.
    cells: on how many stretches roots have been looked for; each counts as an evaluation where a budget is asked.
    isolated: the roots that were found.
    precise: the last batch of which it is known that most of its numbers are precise.
    fresh: whether the arrays of what was found are in nobody else's hands.
    start, members: how much had been done before what counts, and for how many members this is.
    boxes, most_boxes: in how many boxes places have been searched for, and in how many they may be for each member.
    """

    evaluations: int = 0
    depth: int = 0
    shortfalls: Shortfalls = {}
    edges: list[OneSidedDerivatives] = []
    met: int = 0
    taped: list[tuple[Node, Any]] = []
    methods: set[str] = set()
    second: bool = False
    allowed: Allowed = NOTHING
    precise: Precise | None = None
    fresh: bool = False
    start: int = 0
    members: int = 1
    cells: int = 0
    isolated: Isolated = field(default_factory=Isolated)
    boxes: int = 0
    most_boxes: int = MOST_BOXES
    integrals: int = 0
    culled: int = 0
    seen: int = 0
    used: dict[tuple[str, str], Value] = {}
    costs: Costs | None = field(default_factory=costs.if_wanted)
    gauge: Gauge | None = field(default_factory=begun)

    def follow(self) -> None:
        """Tell whoever has begun to watch since this record was begun."""
        self.gauge = self.gauge or begun()

    @property
    def spent(self) -> float:
        """The evaluations that count, of one member, and what roots took that were searched for."""
        return (self.effort - self.start) / self.members

    @property
    def effort(self) -> int:
        return self.evaluations + self.cells

    def surfaces(self) -> tuple[int, frozenset[Term]]:
        """Those met so far: how many have two derivatives, and which are told of in `costs`."""
        return len(self.edges), frozenset(() if self.costs is None else self.costs.surfaces)

    def meet(self, edge: OneSidedDerivatives) -> None:
        """Note something that has two derivatives."""
        self.met += 1
        self.edges.append(edge)

    def again(self, cause: TwoSided) -> bool:
        """Whether this was met before, and what it says is noted: it is met once more."""
        known = any(edge.cause == cause for edge in self.edges)
        self.met += known
        return known

    def spread(self, met: int) -> None:
        """What was met since `met` is told of terms or of elements, and of no member alone."""
        self.met += self.met != met

    def sided(self, met: int, known: int) -> Any:
        """Which members have met something with two derivatives since `met` and this many edges: all, where that is
        not told."""
        edges = self.edges[known:]
        if self.met == met:
            return False
        if self.met - met > len(edges) or any(edge.cause.jump for edge in edges):
            return True
        told = (np.any(~np.isnan(side), axis=0) for edge in edges for side in edge.sides)
        return np.any(np.broadcast_arrays(*told), axis=0)

    def tell(self, events: Events, batch: int, shape: tuple[int, ...]) -> None:
        """Add what the integrals of a whole batch have met to what the answer says, in the batch's shape."""
        for why, members in events.every(Shortfall):
            merged(self.shortfalls, {why: mask_of(members, batch).reshape(shape) if shape else True})
        edges: dict[TwoSided, list[Array]] = {}
        for edge, members in events.every(OneSidedDerivatives):
            count = batch if members is None else members.size
            for number, side in enumerate(edge.sides):
                rows = side.reshape(-1, count)
                unknown = [np.full((rows.shape[0], batch), np.nan) for _ in edge.sides]
                known = edges.setdefault(edge.cause, unknown)[number]
                if known.shape[0] == rows.shape[0]:
                    known[:, slice(None) if members is None else members] = rows
        for cause, found in edges.items():
            self.meet(OneSidedDerivatives(cause, *(side.reshape(-1, *shape) for side in found)))

    @contextmanager
    def among(self, members: int) -> Iterator[None]:
        """In this block so many members of the batch are all that there are, with a budget of their own."""
        kept, boxes = (self.start, self.members, self.effort), self.boxes
        self.boxes, self.start, self.members = 0, self.effort - round(self.spent * members), members
        try:
            yield
        finally:
            self.start, self.members = kept[0] + self.effort - kept[2], kept[1]
            self.boxes += boxes

    def search(self, boxes: int) -> bool:
        """Note that places are searched for in so many boxes more. Whether that may be."""
        self.boxes += boxes
        return self.boxes <= self.most_boxes * self.members

    def count(self, evaluations: int, most: int) -> None:
        """Note evaluations of integrands, of which so many are allowed for each member of the batch."""
        self.evaluations += evaluations
        if self.costs is not None:
            self.costs.add(evaluations)
        if self.gauge is not None:
            self.gauge.spent(self.evaluations, max(most, self.gauge.most) * self.members)
