"""Derivatives where nothing at the parameters tells them: what those beside the parameters lead to.

Owns `approached`, `led_to`, and values that are `moved`.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from functools import cache

import numpy as np

from potto.diagnostics import PottoError
from potto.kernels.cells import Array, Cell, Value, all_cells, map_cells

APART = 2.0**-8
CLOSER = 2.0**-8  # each step by this part of the one before
NEARER = CLOSER ** np.arange(3.0)  # the steps that are taken, as parts of the first one
# What successive differences may be of the one before where there is a limit, and what is no difference at all.
SETTLING, SAME = 0.75, 1e-6
MISSED = 1 / 16  # the least part of what is extrapolated that may be wrong
LEAP = 1e-9  # the part of a value that is not a jump of it
# How many places a smooth derivative is extrapolated from, each half as far as the one before, and the fewest of them:
# from twelve that are 1/4 to 1/8192 away what is analytic as far as 1 has 12 digits, with what rounding leaves there.
FINE, FEWEST = 12, 3
POWERS = 1.0, 1 / 2, 1 / 3, 1 / 4  # of the step, in which derivatives are smooth: beside folds of so many roots
UNNOTICED = 1e-8  # the part of derivatives by which those close by may be wrong with no word, where rounding hides it

# Values, how far off they may be, their derivatives in a direction, and how far off those may be.
Parts = tuple[Array, Array, Array, Array]


def parameter_step(values: Iterable[Value], d: int) -> float | None:
    """A small part of the parameters that move in a direction; None where none does."""
    sizes = [float(np.max(np.abs(cell.v))) for value in values for cell in moving(value, d)]
    return APART**2 * max([1.0, *sizes]) if sizes else None


def approached(
    at: Callable[[float], Parts], step: float, here: tuple[Array, Array], rtol: float | None
) -> tuple[Array, Array]:
    """The derivatives on the side of the parameters on which a step is, and how far off they may be.

    at: what there is after a step. here: the values at the parameters, and how far off they may be. Where those beside
    them lead to another one the derivative is infinite. rtol: as accurate as that where derivatives are smooth on that
    side; else what three steps tell is enough.
    """
    near = step * NEARER
    limit, missed = led_to([at(float(h)) for h in near], here, near[-1])
    if rtol is None or (np.isfinite(limit) & (missed <= rtol * np.abs(limit))).all():
        return limit, missed
    finer = [step * APART**-1.75 * 0.5**i for i in range(FINE)]
    try:
        found = [at(h) for h in finer]
    except PottoError:  # so far away there may be no value
        return limit, missed
    return _smooth(found, np.array(finer), here, limit, missed)


def led_to(found: Sequence[Parts], here: tuple[Array, Array], step: float) -> tuple[Array, Array]:
    """What three steps towards the parameters, of which `step` is the last, lead to, and how far off that may be."""
    slopes = [np.where(np.isfinite(et), t, np.nan) for _, _, t, et in found]
    noise = np.sum([et for *_, et in found], axis=0)
    flat = zip(*(x.ravel().tolist() for x in (*slopes, noise)), strict=True)
    limits, missed = (np.reshape(x, noise.shape) for x in zip(*(_limit(*four) for four in flat), strict=True))
    v, e, *_ = found[-1]
    # Nearer by rounding is no less, even where nothing shows: sin(x*t)/t is x just beside t = 0, to the last digit.
    missed = np.where(np.isfinite(limits), missed + np.max([et for *_, et in found], axis=0), 0.0)
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
        if t is None:
            return cell
        way = step * t
        v = cell.v
        if 0 < np.ndim(v) < np.ndim(way):  # the numbers of an array that move as members of a batch do
            v = np.reshape(v, np.shape(v) + (1,) * (np.ndim(way) - np.ndim(v)))
        return Cell(v + way, cell.e, cell.t, cell.et)

    return map_cells(value, after)


def one_direction(value: Value, d: int) -> Value:
    """A value that moves in direction d alone, as its only one."""
    return map_cells(value, lambda cell: Cell(cell.v, cell.e, cell.t[d : d + 1], cell.et[d : d + 1]))


def _smooth(
    found: Sequence[Parts], places: Array, here: tuple[Array, Array], limit: Array, missed: Array
) -> tuple[Array, Array]:
    """The limit of derivatives at places that shrink, and how far off it may be, where these are smooth in the step, or
    in its root, as beside a fold: by polynomials through neighbours among them, of which the one counts that changes
    the least when either end is left out. The limit known before stays where nothing better is found, or another
    limit, which something nearer by has. One that is not a number may come of rounding, which grows towards the
    parameters: it gives way to one that hardly changes, unless what is at the parameters is another value."""
    slopes = np.array([np.where(np.isfinite(et), t, np.nan) for _, _, t, et in found])
    known = np.isfinite(limit)
    # What is guarded cancels: of what is divided by a step rounding leaves eps/step, and of its derivative eps/step^2.
    cancelled = [np.finfo(float).eps * np.abs(v) / h**2 for h, (v, *_) in zip(places, found, strict=True)]
    noise = np.array([et + np.where(known, 0.0, more) for more, (*_, et) in zip(cancelled, found, strict=True)])

    @cache  # each row is asked for by itself, and as the longer ones without an end
    def through(power: float, first: int, end: int) -> tuple[Array, Array]:
        near = np.abs(places[first:end]) ** power
        weights = np.array([np.prod([h / (h - own) for h in near if h != own]) for own in near])
        return np.tensordot(weights, slopes[first:end], 1), np.tensordot(np.abs(weights), noise[first:end], 1)

    best, off = limit, np.where(known, missed, np.inf)
    size = np.fmax.reduce(np.abs(slopes))
    v, e, *_ = found[-1]
    leap, sure = np.abs(v - here[0]), e + here[1] + LEAP * (np.abs(here[0]) + np.abs(v))
    for power, (first, end) in itertools.product(POWERS, itertools.combinations(range(FINE + 1), 2)):
        if end - first < FEWEST:
            continue
        value, rounding = through(power, first, end)
        fewer = (through(power, *row)[0] for row in ((first + 1, end), (first, end - 1)))
        change = np.fmax(*(np.abs(value - other) for other in fewer))
        apart = np.where(known, np.abs(value - limit), 0.0)
        less = change + rounding + np.where(apart <= missed + change + rounding, 0.0, apart)
        small = less <= SAME * size  # in the root of a step what is not smooth hardly changes from place to place
        near = (small | (power == 1)) & (apart <= missed + change + rounding + UNNOTICED * size)
        steady = small & (leap <= 2 * np.abs(places[-1]) * (np.abs(value) + less) + sure)
        better = np.where(known, near, steady) & (less < off)
        best, off = np.where(better, value, best), np.where(better, less, off)
    return best, np.where(np.isfinite(best), off, missed)


def _limit(far: float, nearer: float, nearest: float, noise: float) -> tuple[float, float]:
    """Where three values at steps that shrink lead to, a number, an infinity, or nan where that does not show, and how
    far off it may be: what is still to come, or what extrapolation may have missed of it."""
    if not (math.isfinite(far) and math.isfinite(nearer) and math.isfinite(nearest)):
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
