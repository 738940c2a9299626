"""The cells of many members by machine code: what `topologies` does by numpy, as one function.

Owns `LoweredTopologies`, `Found` and `lowered_topologies`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property

import numpy as np
from msgspec import Struct, field

from potto.core.terms import postorder
from potto.integrate.fixed.lowered.cells import given, parts, places_of, whole
from potto.integrate.fixed.lowered.formula_text import ParameterPlace
from potto.integrate.fixed.lowered.topology_text import FOUND, NAME, TopologyText
from potto.integrate.fixed.straight import StraightIntegral, in_rows
from potto.integrate.pieces import Evaluator
from potto.kernels.cells import Bools, Ints, Value
from potto.kernels.native.objects import Loaded
from potto.kernels.native.points import address
from potto.kernels.native.promotion import Promotion
from potto.kernels.native.vectors import LANES

# Members at once, and cells for which there is room: few enough to stay in the cache.
AT_ONCE, ROOM = 1 << 13, 1 << 16
# Terms from which on a row may have as many operations as are worth a branch (`row_text.WORTH`), with its tangents and
# rounding about six for each.
DEAR = 8


class Found(Struct, frozen=True):
    """Which members are plain (B,), and the cells of these: the rows between which they lie, as numbers (N,), whose
    they are (N,), and the sides of the surfaces in their middles, as numbers with a bit for each (N,). Where nothing is
    to be integrated, cells may be left out."""

    plain: Bools
    between: Ints
    members: Ints
    sides: Ints

    def with_others(self, others: Found, members: Ints) -> Found:
        """The same with what was found of members who were not plain."""
        plain = self.plain.copy()
        plain[members] = others.plain
        between, owners, sides = (np.concatenate(pair) for pair in (
            (self.between, others.between), (self.members, members.take(others.members)), (self.sides, others.sides)
        ))  # fmt: skip
        return Found(plain, between, owners, sides)


class LoweredTopologies(Struct, frozen=True, dict=True, eq=False):
    """The function for parameters with these parts. merging: cuts of the outermost variable that are one and move as
    one count once."""

    plan: StraightIntegral
    places: tuple[ParameterPlace, ...]
    merging: bool = False
    promotion: Promotion = field(default_factory=lambda: Promotion(NAME))

    def function(self, machine: Evaluator) -> Loaded | None:
        """The function, if it is to be used now. machine: one that keeps track of rounding, with directions only where
        cuts are merged."""
        return self.promotion.function(
            machine.backend, lambda: TopologyText(self.plan, machine, self.merging).text(self.places)
        )

    @cached_property
    def most(self) -> int:
        """How many cells a member may have."""
        return math.prod(len(items) - 1 for items in self.plan.items)

    @cached_property
    def dear(self) -> bool:
        """Whether a rule goes through rows one by one: then cells between the same ones had better be neighbours."""
        return any(len(postorder(item)) >= DEAR for items in self.plan.items for item in items)

    def run(self, function: Loaded, env: Mapping[str, Value], batch: int) -> Found:
        """The cells of a batch."""
        constants, arrays = given(self.places, env)
        count = max(batch, LANES)
        columns, plain = [whole(column, count) for column in arrays], np.empty(count)
        step, found = max(LANES, min(AT_ONCE, ROOM // self.most // LANES * LANES)), []
        room = np.empty((3, self.most * (step + 2 * LANES) + 1), dtype=np.int64)
        for start, stop in parts(count, step):
            into = (plain[start:stop], *room, *(column[start:stop] for column in columns))
            frame = np.array([stop - start, min(stop, batch) - start, 0, *map(address, into)], dtype=np.int64)
            function.call(address(frame), address(constants))
            cells = room[:, : frame[FOUND]]
            cells[0] += start
            found.append(cells.take(in_rows(cells[1], len(self.plan.variables)), 1) if self.dear else cells.copy())
        members, between, sides = np.concatenate(found, axis=1)
        fine: Bools = np.asarray(plain[:batch] > 0)
        if not fine.all():
            kept = np.flatnonzero(fine.take(members))
            members, between, sides = members.take(kept), between.take(kept), sides.take(kept)
        return Found(fine, between, members, sides)


def lowered_topologies(plan: StraightIntegral, env: Mapping[str, Value], merging: bool = False) -> LoweredTopologies:
    """The function for an environment whose numbers have these parts."""
    key = places_of(plan.names, env), merging
    found: LoweredTopologies | None = plan.lowered.get(key)
    if found is None:
        found = plan.lowered[key] = LoweredTopologies(plan, *key)
    return found
