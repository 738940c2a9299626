"""Whether a surface is passed through where it has a root along a line, or only touches 0 there: then nothing jumps.

Owns `Passage`.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from msgspec import Struct

from potto.core.terms import App, Branch, Const, If, Prim, Term, function_of, postorder
from potto.integrate.decomposition.meetings import as_array
from potto.integrate.montecarlo.cube_map import Chart
from potto.integrate.pieces import number_at, still
from potto.kernels.cells import Array, Bools, Ints, Number
from potto.primitives import PRIMITIVES

# How far from a root, in labels, a surface has the signs that it goes from and to; where they are one sign, nearer.
ASIDE = 1e-7
PASSING = (ASIDE, 1e-9, 1e-11, 1e-13)
# Of the largest slope on a surface. Where roots are nearer to one another than rounding, the slope is its square root.
TOUCHING = 1e-3


class Passage(Struct, dict=True):
    """A surface phi = 0 whose innermost variable is `number`, in the coordinates of a chart."""

    chart: Chart
    term: Term
    number: int

    def through(
        self, labels: Sequence[Array | None], pivot: int, slope: Array, speed: Number | None, asked: Bools
    ) -> Bools:
        """Whether phi goes through 0, the way its slope says, at points along the pivot: (n,), of those asked for.

        speed: of the pivot by its label; where the pivot has no end, slopes by labels have none either.
        Where phi has one sign on either side it only touches 0, unless another root is nearer than that. Where it is
        smooth its slope is next to nothing there, so that others are looked at only if the steepest touches.
        """
        way, found, rows = np.broadcast_to(np.sign(slope), asked.shape), asked.copy(), np.nonzero(asked)[0]
        if self.smooth and rows.size:
            steep = np.abs(np.broadcast_to(slope if speed is None else slope / speed, asked.shape)[rows])
            steep[np.isnan(steep)] = 0.0
            top = rows[steep.argmax()]
            few = np.append(rows[steep < TOUCHING * steep.max()], top)
            found[few] = self.changes(labels, pivot, way, few)
            if found[top]:
                return found
        found[rows] = self.changes(labels, pivot, way, rows)
        return found

    def changes(self, labels: Sequence[Array | None], pivot: int, way: Array, rows: Ints) -> Bools:
        """Whether phi changes its sign at some of the points, that way."""
        found, left = np.zeros(rows.size, dtype=bool), np.arange(rows.size)
        for step in PASSING:
            if not left.size:
                break
            here = [None if label is None else label[rows[left]] for label in labels]
            below, above = (self.sign(here, pivot, side) for side in (-step, step))
            found[left] = above - below == 2 * way[rows[left]]
            left = left[(above * below >= 0) & ~found[left]]
        return found

    def sign(self, labels: Sequence[Array | None], pivot: int, side: float) -> Array:
        """The sign of phi so far along the pivot from points, 0 where rounding hides it: (n,)."""
        u = labels[pivot]
        assert u is not None
        moved = [*labels[:pivot], u + side, *labels[pivot + 1 :]]
        start = self.chart.start(u.size, 0)
        point = self.chart.place(start, moved, 0, self.number + 1, directions=0)
        function = function_of(self.term)
        machine = self.chart.machine.with_directions(0).tracking()
        value = number_at(function, machine, {name: still(point.env[name]) for name in function.params})
        error = 0.0 if value.e is None else value.e
        return np.where(np.abs(value.v) > error, np.sign(as_array(value.v, u.size)), 0.0)

    @cached_property
    def smooth(self) -> bool:
        """Whether it has a slope everywhere, and no poles, kinks or jumps of its own."""
        for node in postorder(self.term):
            match node:
                case Prim(op="pow", args=(_, Const(value=value))) if value >= 1 and value.is_integer():
                    continue
                case Prim(op="div", args=(_, below)) if not below.free:
                    continue
                case App() | Branch() | If():
                    return False
                case Prim(op=op, args=args):
                    entry = PRIMITIVES[op]
                    if entry.broken or entry.kinks(*args) or entry.edges(*args):
                        return False
        return True
