"""Cuts that lie on a bound, of an integral whose cuts are closed forms: on which side they come in, and what then.

Owns `OnBounds` and `Tied`. As the parameters move on, such a cut comes into the range or leaves it, as its tangent and
that of the bound say. What lies between it and the bound has the length 0 here, and a rate at which it grows: nodes in
it add nothing to the value, and to the derivative what the surface contributes on the side on which it is inside. Only
cuts and bounds that depend on nothing but parameters are dealt with, one to a bound: then the order of their tangents
is the same all along the variables further out.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
from msgspec import Struct

from potto.integrate.events import TwoSided
from potto.integrate.fixed.straight import CLEAR, StraightIntegral
from potto.integrate.pieces import Sums
from potto.kernels.cells import Cell, Number

Place = tuple[float, float, int]  # of a bound or cut: where it is, how far off that may be, its row in the frame
# How far beyond its bound the integrand on a stretch of length 0 is looked at, as a part of the stretch beside it, and
# how many times that every other cut must be away.
BEYOND, ALONE = 2.0**-20, 4.0


class Tied(Struct, frozen=True):
    """An integral with cuts on bounds; to either side of the parameters; the surfaces there."""

    whole: Sums
    backward: Sums
    forward: Sums
    causes: tuple[TwoSided, ...]


class OnBounds(Struct):
    """The cuts that lie on bounds, as they are met: variable and row -> the bound's row, how fast the cut comes
    in, and whether it lies within, by no more than its rounding.

    inside: those between which and their bounds there is a stretch; the others are left out.
    """

    met: dict[tuple[int, int], tuple[int, float, bool]] = {}
    inside: frozenset[tuple[int, int]] = frozenset()

    def towards(self, side: int) -> frozenset[tuple[int, int]]:
        """Those that are inside on a side of the parameters. Those that rest count as inside forward: they add nothing
        but their rounding."""
        return frozenset(at for at, (_, rate, _) in self.met.items() if side * rate > 0 or (rate == 0 and side > 0))

    def lie_backward(self) -> bool:
        """Whether all cuts that move lie, as computed, where they are before the parameters have come here."""
        return all(within == (rate < 0) for _, rate, within in self.met.values() if rate)

    def causes(self, plan: StraightIntegral) -> tuple[TwoSided, ...]:
        """The surfaces that jump there and move."""
        found = {
            TwoSided(plan.variables[i], surface): None
            for (i, row), (_, rate, _) in self.met.items()
            for surface, rows in plan.jumps[i]
            if rate and row in rows
        }
        return tuple(found)

    def put(self, i: int, frame: tuple[Cell, ...]) -> tuple[Cell, ...]:
        """A frame with such cuts on their bounds, as far off as they may be."""
        cells = list(frame)
        for (variable, row), (end, _, _) in self.met.items():
            if variable == i:
                cut, bound = frame[row], frame[end]
                off = np.abs(cut.v - bound.v) + _known(cut.e) + _known(bound.e)
                cells[row] = Cell(bound.v, off, cut.t, cut.et)
        return tuple(cells)

    def stretches(
        self, plan: StraightIntegral, i: int, values: Sequence[Cell], places: Sequence[Place], kept: Sequence[Place]
    ) -> list[tuple[int, int, float, float]] | None:
        """What a variable runs along, from bound to bound by the cuts that are inside: rows, middle, length. None where
        cuts lie on one another, or what lies on a bound is not plain."""
        ends, inner = [kept[0], kept[-1]], list(kept[1:-1])
        beyond: list[tuple[int, int, float]] = []
        for number, at in ((0, 0), (1, -1)):
            bound = ends[number]
            if not inner or abs(inner[at][0] - bound[0]) > inner[at][1] + bound[1]:
                continue
            cut = inner.pop(at)
            if not self._lies_on(plan, i, values, cut, bound):
                return None
            if (i, cut[2]) in self.inside:
                ends[number] = (bound[0], bound[1], cut[2])
                beyond.append((number, cut[2], bound[0]))
        row = [ends[0], *inner, ends[1]]
        if any(b[0] - a[0] <= a[1] + b[1] for a, b in itertools.pairwise(row)):
            return None
        found = [(a[2], b[2], 0.5 * (a[0] + b[0]), b[0] - a[0]) for a, b in itertools.pairwise(row)]
        beside = found[0][3], found[-1][3]
        for number, cut_row, x in beyond:
            step = BEYOND * beside[number]
            near = [place for place in places if place[2] not in (number, cut_row)]
            if any(abs(place[0] - x) <= ALONE * step + place[1] for place in near):
                return None
            found.append((cut_row, 1, x + step, 0.0) if number else (0, cut_row, x - step, 0.0))
        return found

    def _lies_on(self, plan: StraightIntegral, i: int, values: Sequence[Cell], cut: Place, bound: Place) -> bool:
        """Whether it is plain how a cut on a bound moves, the same for all of the variables further out; it is kept."""
        end, row = bound[2], cut[2]
        if end in plan.shared[i]:  # beyond it other surfaces have another side
            return False
        if not (plan.items[i][row].free | plan.items[i][end].free).isdisjoint(plan.variables):
            return False
        rate, off = 0.0, 0.0
        for sign, cell in ((1.0, values[row]), (-1.0, values[end])):
            for t, et in zip(cell.t, cell.et, strict=True):
                rate += sign * (0.0 if t is None else float(t))
                off += 0.0 if et is None else float(et)
        if rate and not (abs(rate) > CLEAR * off and math.isfinite(rate)):
            return False
        within = cut[0] < bound[0] if end else cut[0] > bound[0]
        self.met[i, row] = end, -rate if end else rate, within
        return True


def _known(e: Number | None) -> Number:
    return 0.0 if e is None else e
