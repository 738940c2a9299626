"""Derivatives where nothing at the parameters tells them: what those beside the parameters lead to.

Owns `led_to`, the `steps` that lead there, and values that are `moved`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from potto.kernels.cells import Array, Cell, Value, all_cells, map_cells

APART = 2.0**-8
CLOSER = 2.0**-8  # each step by this part of the one before
# What successive differences may be of the one before where there is a limit, and what is no difference at all.
SETTLING, SAME = 0.75, 1e-6
MISSED = 1 / 16  # the least part of what is extrapolated that may be wrong
LEAP = 1e-9  # the part of a value that is no jump of it

# Values, how far off they may be, their derivatives in a direction, and how far off those may be.
Parts = tuple[Array, Array, Array, Array]


def parameter_step(values: Iterable[Value], d: int) -> float | None:
    """A small part of the parameters that move in a direction; None where none does."""
    sizes = [float(np.max(np.abs(cell.v))) for value in values for cell in moving(value, d)]
    return APART**2 * max([1.0, *sizes]) if sizes else None


def steps(step: float) -> list[float]:
    """Three steps towards the parameters."""
    return [step * CLOSER**i for i in range(3)]


def led_to(found: Sequence[Parts], here: tuple[Array, Array], step: float) -> tuple[Array, Array]:
    """The derivatives on the side of the parameters on which a step is, and how far off they may be.

    found: what there is after three steps, of which this is the last. here: the values at the parameters, and how far
    off they may be. Where those beside them lead to another one the derivative is infinite.
    """
    slopes = [np.where(np.isfinite(et), t, np.nan) for _, _, t, et in found]
    noise = np.sum([et for *_, et in found], axis=0)
    flat = zip(*(x.ravel() for x in (*slopes, noise)), strict=True)
    limits, missed = (np.reshape(x, noise.shape) for x in zip(*(_limit(*four) for four in flat), strict=True))
    v, e, _, et = found[-1]
    missed = np.where(np.isfinite(limits), missed + et, 0.0)
    rough = np.abs(slopes[0] - slopes[1]) + found[0][3] + found[1][3]  # nearer by there may be nothing but rounding
    limits, missed = np.where(rough < missed, slopes[0], limits), np.where(rough < missed, rough, missed)
    with np.errstate(invalid="ignore"):
        leap, change = v - here[0], np.abs(step) * (np.abs(limits) + missed)
        sure = e + here[1] + LEAP * (np.abs(here[0]) + np.abs(v))
        jumps = np.isfinite(limits) & (np.abs(leap) > 2 * change + sure)
    return np.where(jumps, np.copysign(np.inf, leap * step), limits), np.where(jumps, 0.0, missed)


def moving(value: Value, d: int) -> list[Cell]:
    """The numbers in a value that move in a direction."""
    return [c for c in all_cells(value) if d < len(c.t) and (t := c.t[d]) is not None and np.any(t)]


def moved(value: Value, step: float | Array, d: int) -> Value:
    """A value after so large a step along its tangents in direction d, which it keeps."""

    def after(cell: Cell) -> Cell:
        t = cell.t[d] if d < len(cell.t) else None
        return cell if t is None else Cell(cell.v + step * t, cell.e, cell.t, cell.et)

    return map_cells(value, after)


def one_direction(value: Value, d: int) -> Value:
    """A value that moves in direction d alone, as its only one."""
    return map_cells(value, lambda cell: Cell(cell.v, cell.e, cell.t[d : d + 1], cell.et[d : d + 1]))


def _limit(far: float, nearer: float, nearest: float, noise: float) -> tuple[float, float]:
    """Where three values at steps that shrink lead to, a number, an infinity, or nan where that does not show, and how
    far off it may be: what is still to come, or what extrapolation may have missed of it."""
    if not np.isfinite([far, nearer, nearest]).all():
        return math.nan, 0.0
    first, second = nearer - far, nearest - nearer
    rate = min(max(abs(second / first), CLOSER), SETTLING) if first else CLOSER
    coming = 2 * abs(second) * rate / (1 - rate)
    if abs(second) <= max(SAME * abs(nearest), noise):
        return nearest, coming
    if abs(second) <= SETTLING * abs(first):
        limit = nearest + second * second / (first - second)
        zero = abs(limit) <= SAME * (abs(far) + abs(nearer))
        return (0.0, abs(limit) + coming) if zero else (limit, coming * max(rate, MISSED))
    grows = first * second > 0 and nearest * second > 0 and abs(first) > SAME * abs(nearest)
    return (math.copysign(math.inf, nearest) if grows else math.nan), 0.0
