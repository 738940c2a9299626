"""Members of a batch that nothing cuts, by machine code: `boxes.uncut` as one function.

Owns `LoweredBoxes` and `Passed`. Eight members at a time the function works out bounds and sides, and applies the rule
of the integrand that is found there; where all eight are dark, that is all. It puts what it finds where the sums of the
batch are to be, and who is left on lists, so that nobody goes through all members again.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from msgspec import Struct, field

from potto.integrate.fixed.axes import axis
from potto.integrate.fixed.lowered.box_text import LISTS, BoxText, Look, numbers
from potto.integrate.fixed.lowered.cells import frame_of, given, parts, whole
from potto.integrate.fixed.lowered.formula_text import ParameterPlace
from potto.integrate.fixed.lowered.rule_text import NAME
from potto.integrate.pieces import Evaluator, Sums
from potto.kernels.cells import Array, Ints, Value
from potto.kernels.making import counts
from potto.kernels.memory import room
from potto.kernels.native.objects import Loaded
from potto.kernels.native.points import address
from potto.kernels.native.promotion import Promotion
from potto.kernels.native.vectors import LANES

# Members at once: few enough that an interruption is not kept waiting.
AT_ONCE = 1 << 15
WORD = 8  # bytes


class Passed(Struct):
    """What a function made of members: their sums, 0 for those that are not done; those that a surface may cross; and
    those that nothing crosses, as far as is known, and that are not done. precise: whether all that are done are known
    to half of what is asked of each of their numbers."""

    sums: Sums
    crossed: Ints
    left: Ints
    precise: bool


class LoweredBoxes(Struct, frozen=True):
    """The function for parameters with these parts, with so many nodes for each variable; exact: for a polynomial."""

    look: Look
    places: tuple[ParameterPlace, ...]
    orders: tuple[int, ...]
    exact: tuple[bool, ...]
    promotion: Promotion = field(default_factory=lambda: Promotion(NAME))

    def function(self, machine: Evaluator) -> Loaded | None:
        """The function, if it is to be used now."""

        def text() -> str:
            return BoxText(self.look, machine, self.orders, self.exact).text(self.places)

        return self.promotion.function(machine.backend, text)

    def run(self, function: Loaded, machine: Evaluator, env: Mapping[str, Value], batch: int) -> Passed:
        """The integrals of a batch."""
        constants, arrays = given(self.places, env)
        constants = np.concatenate(([0.5 * machine.rtol, 0.5 * machine.atol], constants))
        axes = [axis(order, tuple(range(order)), (False, False), True) for order in self.orders]
        least = max(batch, LANES)
        m = numbers(self.look.faces[0][0]) if self.look.faces else 1
        sums, rows = _sums_of(m, machine.directions, least)
        columns, lists = [whole(column, least) for column in arrays], np.empty((2, AT_ONCE + 3 * LANES), dtype=np.int64)
        head = frame_of(rows[0][None], axes, [])
        tail = head.size + len(columns)
        frame = np.array([*head, *map(address, columns), *[0] * LISTS, *map(address, (*lists, *rows))], dtype=np.int64)
        steps = np.zeros_like(frame)  # of where things are, from member to member
        steps[head.size : tail] = steps[frame.size - len(rows) :] = WORD
        done, rough, found = 0, 0, ([np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)])
        for start, stop in parts(least, AT_ONCE):
            here = frame + steps * start
            here[0] = stop - start
            function.call(address(here), address(constants))
            own, *others, less = here[tail : tail + LISTS].tolist()
            done, rough = done + own, rough + less
            for known, members, count in zip(found, lists, others, strict=True):
                known.append(members[:count] + start)
        machine.count(done * math.prod(self.orders))
        counts.native_points += done * math.prod(self.orders)
        crossed, left = (np.concatenate(known) for known in found)
        if batch < least:
            sums, crossed, left = sums.pick(slice(batch)), crossed[crossed < batch], left[left < batch]
        return Passed(sums, crossed, left, not rough)


def _sums_of(m: int, k: int, batch: int) -> tuple[Sums, list[Array]]:
    """Sums that are yet to be written, and their rows in the order of a function: numbers with their tangents, errors
    of these, and what is added up. Each part has memory of its own, as some live longer than others."""
    v, e, t, et = (room(*shape, batch) for shape in ((m,), (m,), (m, k), (m, k)))
    gross = room(2, batch)
    rows = [row for number, slopes in ((v, t), (e, et)) for i in range(m) for row in (number[i], *slopes[i])]
    return Sums(v, e, t, et, gross=gross), [*rows, *gross]
