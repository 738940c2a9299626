"""Members of a batch that nothing cuts, by machine code: `boxes.uncut` as one function.

Owns `LoweredBoxes` and `Passed`. Eight members at a time the function works out bounds and sides, and applies the rule
of the integrand that is found there; where all eight are dark, that is all.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from msgspec import Struct, field

from potto.integrate.fixed.axes import axis
from potto.integrate.fixed.lowered.box_text import CROSSED, DARK, DONE, LEFT, BoxText, Look, numbers, rows_of
from potto.integrate.fixed.lowered.cells import frame_of, given, parts, whole
from potto.integrate.fixed.lowered.formula_text import ParameterPlace
from potto.integrate.fixed.lowered.rule_text import NAME
from potto.integrate.pieces import Evaluator, Sums
from potto.kernels.cells import Array, Bools, Ints, Value
from potto.kernels.making import counts
from potto.kernels.memory import room
from potto.kernels.native.objects import Loaded
from potto.kernels.native.points import address
from potto.kernels.native.promotion import Promotion
from potto.kernels.native.vectors import LANES

# Members at once: few enough that an interruption is not kept waiting.
AT_ONCE = 1 << 15


class Passed(Struct, frozen=True):
    """What a function made of members: their sums, 0 for those that are not done, and what became of each."""

    sums: Sums
    state: Array

    @property
    def done(self) -> Bools:
        return np.asarray((self.state == DONE) | (self.state == DARK))

    @property
    def crossed(self) -> Bools:
        return np.asarray(self.state == CROSSED)

    @property
    def left(self) -> Ints:
        """Those that nothing crosses, as far as is known, and that are not done."""
        found: Ints = np.nonzero(self.state == LEFT)[0]
        return found


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

    def run(
        self, function: Loaded, machine: Evaluator, env: Mapping[str, Value], batch: int, sides: Sequence[Array]
    ) -> Passed:  # fmt: skip
        """The integrals of a batch; sides: a column of them, if they are told."""
        m, k1 = numbers(self.look.faces[0][0]) if self.look.faces else 1, 1 + machine.directions
        constants, arrays = given(self.places, env)
        constants = np.concatenate(([0.5 * machine.rtol, 0.5 * machine.atol], constants))
        axes = [axis(order, tuple(range(order)), (False, False), True) for order in self.orders]
        least = max(batch, LANES)
        out = room(rows_of(m * k1), least)
        columns = [whole(column, least) for column in (*arrays, *sides)]
        for start, stop in parts(least, AT_ONCE):
            frame = frame_of(out[:, start:stop], axes, [column[start:stop] for column in columns])
            function.call(address(frame), address(constants))
        found = out[:, :batch]
        state = found[-1]
        evaluations = int(np.count_nonzero(state >= DONE)) * math.prod(self.orders)
        machine.count(evaluations)
        counts.native_points += evaluations
        total, bound = found[: 2 * m * k1].reshape(2, m, k1, batch)
        return Passed(Sums(total[:, 0], bound[:, 0], total[:, 1:], bound[:, 1:], gross=found[-3:-1]), state)
