"""The cells between the cuts of a `StepIntegral`, and how high its step functions are on them.

Owns `StepCells`, `step_cells` and, of what is known of them, `cells_between` and `levels_of`. The cuts are put in order
once; all else follows from that order: ends of cells are neighbours in it, heights are sums along it. That it is sure
is seen by comparing neighbours. Cuts that rounding does not tell apart, or one from a bound, are left to others.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from msgspec import Struct

from potto.core.terms import Const, children
from potto.integrate.fixed.moving_sums import any_moves, columns_of
from potto.integrate.fixed.steps.step_integral import StepIntegral
from potto.integrate.fixed.steps.step_sides import StepPlaces, StepSides, layout, same_leads, sides_of, taken
from potto.integrate.fixed.straight import CLEAR
from potto.integrate.pieces import Evaluator, numbers_at
from potto.integrate.rules.gauss import EPS
from potto.kernels.cells import Array, Bools, Cell, Ints, Value

# What the sums along the cuts are in, and what that rounds off.
WIDE = np.longdouble
WIDE_EPS = float(np.finfo(WIDE).eps)
WHOLE = 2.0**53  # below which sums of whole numbers are exact
Height = tuple[Array, Array | None]


class StepArrangement(Struct, frozen=True):
    """What follows from the order of the rows of a frame, and from signs that are asked for, of one member or of B.

    rows: from bound to bound ([B,] C + 1), so many of which count. passed, sides, taken: as of `StepCells`. resting:
    the heights of step functions that are made of numbers, None for others. order, absent: of one member all rows that
    there are, those beyond the bounds too, and roots that are not there.
    """

    rows: Ints
    count: Ints
    passed: StepPlaces
    sides: StepSides
    taken: tuple[tuple[Ints, ...], ...]
    resting: tuple[Height | None, ...]
    order: Ints
    absent: Ints


class StepCells(Struct, frozen=True):
    """The cells of one member, or of B, as many for each: behind the last one of a member come some of the width 0.

    low, width, off: (1 + k, [B,] C), with tangents: lower ends, widths, and how far both ends may be off. heights: of
    each step function its numbers on the cells and their errors, of that shape too, or (1, [B,] C) without tangents;
    None for errors of 0. moving: the directions in which ends move. fine: for whom all this is sure. inside: how many
    are cells. lower, upper: ([B,] C), the rows of the frame that are the ends. passed, sides: where cuts come among the
    cells, and surfaces change their signs. taken: of each step function which values of its choices are taken, ([B,] C)
    each.
    """

    low: Array
    width: Array
    off: Array
    heights: tuple[Height, ...]
    moving: tuple[bool, ...]
    fine: Bools
    inside: Ints
    lower: Ints
    upper: Ints
    passed: StepPlaces
    sides: StepSides
    taken: tuple[tuple[Ints, ...], ...]

    def pick(self, cells: Any) -> StepCells:
        """Those at some places of the last axis, or of the last two."""
        low, width, off = (block[..., *cells] for block in (self.low, self.width, self.off))
        heights = tuple([(x[..., *cells], None if e is None else e[..., *cells]) for x, e in self.heights])
        lower, upper = self.lower[..., *cells], self.upper[..., *cells]
        taken = tuple([tuple([number[..., *cells] for number in own]) for own in self.taken])
        return StepCells(
            low, width, off, heights, self.moving, self.fine, self.inside, lower, upper, self.passed, self.sides, taken
        )

    def levels(self) -> list[Cell]:
        """The step functions."""
        return [_cell(number, error, len(self.moving)) for number, error in self.heights]


def step_cells(plan: StepIntegral, machine: Evaluator, env: dict[str, Value], batch: int | None = None) -> StepCells:
    """The cells of one member, or of a batch. machine: one that keeps track of rounding."""
    frame = numbers_at(plan.frame, machine, env)
    levels = levels_of(plan, machine, env)
    return cells_between(plan, frame, levels, machine, env, machine.directions, () if batch is None else (batch,))


def cells_between(
    plan: StepIntegral, frame: Sequence[Cell], heights: Sequence[Sequence[Cell]], machine: Evaluator,
    env: Mapping[str, Value], k: int, shape: tuple[int, ...] = (),
) -> StepCells:  # fmt: skip
    """The cells between the rows of a frame, with tangents in k directions. heights: as of `levels_of`. shape: of the
    batch."""
    places, errors = _rows(frame, k, shape)
    found = None if shape else _still_so(plan, places[0], errors[0], machine, env)
    if found is None:
        found = _arranged(plan, places[0], errors[0], machine, env)
    rows = found.rows
    ends, slack = _along(places, rows), _along(errors, rows)
    width, doubt = ends[..., 1:] - ends[..., :-1], slack[..., 1:] + slack[..., :-1]
    fine = _apart(width[0], doubt[0], found.count) & found.sides.sure
    if not shape and fine and not found.sides.between:
        plan.arrangements[0] = found
    along = tuple([found.resting[own] or _height(plan, own, *_rows(levels, k, shape), found.sides, found.passed,
                                                 found.taken[own]) for own, levels in enumerate(heights)])  # fmt: skip
    return StepCells(
        ends[..., :-1], width, doubt + EPS * (np.abs(ends[..., 1:]) + np.abs(ends[..., :-1])), along,
        tuple([any_moves(frame, d) for d in range(k)]), fine, found.count - 1, rows[..., :-1], rows[..., 1:],
        found.passed, found.sides, found.taken,
    )  # fmt: skip


def _still_so(
    plan: StepIntegral, places: Array, errors: Array, machine: Evaluator, env: Mapping[str, Value]
) -> StepArrangement | None:
    """The arrangement that one member had last, if it is that of another one, too: as many comparisons as cuts."""
    found: StepArrangement | None = plan.arrangements.get(0)
    if found is None:
        return None
    at, off = places[found.order], CLEAR * errors[found.order]
    if not (at[1:] - at[:-1] > off[1:] + off[:-1]).all():
        return None
    if found.absent.size and not np.isnan(places[found.absent]).all():
        return None
    return found if not layout(plan).leads.size or same_leads(plan, found.sides, machine, env) else None


def _arranged(
    plan: StepIntegral, places: Array, errors: Array, machine: Evaluator, env: Mapping[str, Value]
) -> StepArrangement:
    """The arrangement of places and errors ([B,] R)."""
    sides = sides_of(plan, places, machine, env)
    _absent(places, errors)
    rows, count = _in_order(places, errors)
    passed = _passed(rows, count, plan.rows)
    chosen = tuple([tuple([taken(plan, choice, sides, passed) for choice in step.choices]) for step in plan.steps])
    numbers = [_numbers(plan, own) for own in range(len(plan.steps))]
    resting = tuple([
        None if known is None else _height(plan, own, *known, sides, passed, chosen[own])
        for own, known in enumerate(numbers)
    ])  # fmt: skip
    order, there = places.argsort(axis=-1), int((~np.isnan(places)).sum())
    return StepArrangement(rows, count, passed, sides, chosen, resting, order[..., :there], order[..., there:])


def levels_of(plan: StepIntegral, machine: Evaluator, env: Mapping[str, Value]) -> list[tuple[Cell, ...]]:
    """What each step function is added up from, where that is not all numbers."""
    if all(plan.resting):
        return [()] * len(plan.steps)
    levels = numbers_at(plan.heights, machine, env)
    ends = _ends(plan)
    return [levels[start:stop] for start, stop in itertools.pairwise(ends)]


def _ends(plan: StepIntegral) -> list[int]:
    """Where the heights of each step function begin and end."""
    return list(itertools.accumulate([step.heights for step in plan.steps], initial=0))


@lru_cache(maxsize=512)
def _numbers(plan: StepIntegral, own: int) -> tuple[Array, Array] | None:
    """What a step function is made of as numbers that have no error and do not move, (1, L) each; None where they are
    no such."""
    if not plan.resting[own]:
        return None
    levels = children(plan.heights.body)[slice(*_ends(plan)[own : own + 2])]
    numbers = np.array([[level.value for level in levels if isinstance(level, Const)]])
    return numbers, np.zeros(numbers.shape)


@lru_cache(maxsize=512)
def _whole(plan: StepIntegral, own: int) -> bool:
    """Whether sums of what a resting step function is made of are exact."""
    found = _numbers(plan, own)
    return found is not None and _are_whole(*found)


def _are_whole(numbers: Array, errors: Array) -> bool:
    whole = not errors.any() and bool((numbers == np.rint(numbers)).all())
    return whole and bool(np.abs(numbers).sum(axis=-1).max() < WHOLE)


def _rows(cells: Sequence[Cell], k: int, shape: tuple[int, ...]) -> tuple[Array, Array]:
    """Cells and their errors with tangents as rows, (1 + k, [B,] R) each."""
    if not shape:
        numbers, errors = columns_of(cells, k)
        return numbers, errors
    out = np.zeros((2, 1 + k, len(cells), *shape))
    for row, cell in enumerate(cells):
        for part, numbers in enumerate(((cell.v, *cell.t), (cell.e, *cell.et))):
            for d, number in enumerate(numbers):
                if number is not None:
                    out[part, d, row] = number
    both = np.ascontiguousarray(out.swapaxes(-1, -2))
    return both[0], both[1]


def _absent(places: Array, errors: Array) -> None:
    """Of places ([B,] R) those at infinity of which it is not known how far they may be off: a quotient whose divisor
    is 0. That is no root (nan) if the surface is clear of its rounding in the middle between its others: one that a
    divisor of the size of its rounding has leaves no more there than that size times the farther bound, where both are
    on one side of 0 at most twice the middle. Elsewhere it may be anywhere."""
    unknown = np.isnan(errors)
    if unknown.any():
        unknown &= ~np.isnan(places)
        low, high = places[..., :1], places[..., 1:2]
        places[unknown & np.isinf(places) & ((low >= 0) | (high <= 0))] = np.nan
        errors[unknown & ~np.isnan(places)] = np.inf


def _in_order(places: Array, errors: Array) -> tuple[Ints, Ints]:
    """The rows from one bound to the other in order, and how many there are: of one member these, of several ([B,] R),
    the upper bound again and again where cuts lie beyond these."""
    near = CLEAR * errors
    away = np.isnan(places)
    away |= places < places[..., :1] - near[..., :1] - near
    away |= places > places[..., 1:2] + near[..., 1:2] + near
    key = np.where(away, np.inf, places)
    key[..., 0], key[..., 1] = -np.inf, np.finfo(float).max  # what lies next to a bound counts as within
    order, beyond = key.argsort(axis=-1), away[..., 2:].sum(axis=-1)
    count = order.shape[-1] - beyond
    if order.ndim == 1:
        return order[: int(count)], count
    if beyond.any():
        order = np.where(np.arange(order.shape[-1]) < count[..., None], order, 1)
    return order, count


def _apart(width: Array, doubt: Array, count: Ints) -> Bools:
    """For whom bounds and cuts, so many as there are, are clear of each other; what is not finite is not."""
    apart = width > CLEAR * doubt
    if (count <= width.shape[-1]).any():
        apart |= np.arange(1, 1 + width.shape[-1]) >= count[..., None]
    return np.asarray(apart.all(axis=-1) & np.isfinite(width.sum(axis=-1) + doubt.sum(axis=-1)))


def _along(block: Array, rows: Ints) -> Array:
    """Rows of a block (1 + k, [B,] R) in an order ([B,] C)."""
    return block.take(rows, axis=-1) if rows.ndim == 1 else np.take_along_axis(block, rows[None], -1)


def _passed(rows: Ints, count: Ints, number: int) -> StepPlaces:
    """Where the rows of a frame, so many, come in their order ([B,] C + 1), of which so many count."""
    cells = rows.shape[-1] - 1
    place = np.full((*rows.shape[:-1], number + 1), cells)
    if rows.ndim == 1:
        place[rows[1:-1]] = np.arange(1, cells)
    else:
        at = np.broadcast_to(np.arange(1, cells), (len(rows), cells - 1))
        cut = at < count[:, None] - 1
        np.put_along_axis(place, np.where(cut, rows[:, 1:-1], number), np.where(cut, at, cells), -1)
    return StepPlaces(place, cells)


def _height(
    plan: StepIntegral, own: int, numbers: Array, errors: Array, sides: StepSides, passed: StepPlaces,
    chosen: Sequence[Ints],
) -> Height:  # fmt: skip
    """A step function on the cells, and how far that is off, with tangents if it has any: its height on the first one,
    and what it changes at the cuts that are passed, further and further up; then the values of choices."""
    step = plan.steps[own]
    exact = _whole(plan, own) if plan.resting[own] else _are_whole(numbers, errors)
    kind: Any = float if exact else WIDE
    if numbers.ndim == sides.sure.ndim + 1:
        numbers = numbers[:, None]  # the same for all members
    alone, level = list(step.alone), 1 + len(step.alone)
    change = numbers[..., level : level + len(alone)].astype(kind)
    first = numbers[..., :level].sum(axis=-1, dtype=kind) + (change * sides.first[..., alone]).sum(axis=-1)
    rows, moves = layout(plan).rows[alone], change[..., None] * sides.change[..., alone, :]
    found = passed.along(rows.reshape(-1), moves.reshape(*moves.shape[:-2], -1), first)
    start = level + len(alone)
    for choice, which in zip(step.choices, chosen, strict=True):
        values = numbers[..., start : start + len(choice.values)]
        found = found + np.take_along_axis(
            np.broadcast_to(values, (*found.shape[:-1], values.shape[-1])), which[None], -1
        )
        start += len(choice.values)
    if exact:
        return found, None
    found = found.astype(float)
    most = np.abs(numbers).sum(axis=-1, keepdims=True)
    rounded = 3 * plan.rows * WIDE_EPS * most + errors.sum(axis=-1, keepdims=True)
    return found, EPS * np.abs(found) + rounded


def _cell(number: Array, error: Array | None, k: int) -> Cell:
    """Numbers (1 + k, ...), or (1, ...), and their errors; tangents that are 0 everywhere are None."""
    e = None if error is None else error[0]
    if len(number) == 1:
        return Cell(number[0], e, (None,) * k)
    t = tuple([row if row.any() else None for row in number[1:]])
    if error is None:
        return Cell(number[0], None, t)
    return Cell(number[0], e, t, tuple([None if x is None else off for x, off in zip(t, error[1:], strict=True)]))
