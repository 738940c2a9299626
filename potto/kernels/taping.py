"""Lines of kernels whose tangents are written on a tape: for each builtin its slopes, and how far off these are.

Owns `TapeLines`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from potto.kernels.emit import ONE, Bend, Lines, Losses, Scalar, Tangents, exact_slopes
from potto.kernels.slopes import EXACT
from potto.kernels.whole import UNIT_ROUNDOFF


class TapeLines(Lines):
    """Lines that carry one tangent, a node; of its errors the tape keeps account."""

    def __init__(self, rounding: bool) -> None:
        super().__init__(1, rounding)

    def tangents(
        self, op: str, args: Sequence[Scalar], slopes: Mapping[int, str], bend: Bend, lost: Losses
    ) -> Tangents:
        edges = []
        for i, slope in slopes.items():
            if args[i].t[0]:
                bends = [(found, e) for j in slopes if (e := args[j].e) and (found := bend(i, j))]
                own = lost.get(i, EXACT)
                more = [own.rest] if own.rest else []
                if own.part > 1:  # one rounding of a slope is that of every edge which is not kept
                    more.append(f"{(own.part - 1) * UNIT_ROUNDOFF!r}*abs({slope})")
                off = self.total([f"abs({self.product(found, e)})" for found, e in bends] + more)
                edges.append((slope, args[i].t[0], off))
        still = op == "mul" and len(edges) == 1
        return self.linear(edges, "scaled" if still else "linear" if exact_slopes(op, args, 0) is None else "multiples")

    def added(self, args: Sequence[Scalar]) -> Tangents:
        return self.linear([(ONE, x.t[0], None) for x in args if x.t[0]], "multiples")

    def negated(self, x: Scalar) -> Tangents:
        return self.linear([("-1.0", x.t[0], None)] if x.t[0] else [], "multiples")

    def linear(self, edges: Sequence[tuple[str, str | None, str | None]], kind: str) -> Tangents:
        if not edges:
            return self.none, self.none
        text = ", ".join(f"({slope}, {tangent}, {off})" for slope, tangent, off in edges)
        return (self.let(f"{self.ufunc('tape.' + kind)}({text})", "t"),), self.none
