"""Which members of a batch are cut alike: the cells between their cuts, gathered by what is integrated over them.

Owns `Alike` and `topologies`. Where all cuts are closed forms, the cells of a member are told by the order of its cuts
along the outermost variable, by that of the cuts further in at the middle of each stretch, and by the sides of the
surfaces at the middle of each cell. Cells of the same integrand, whoever's they are and whichever cuts they lie
between, are integrated by one rule. A member with cuts that rounding does not tell apart, or with a surface that is 0
in the middle of a cell, is not plain, and is left to the general way.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from msgspec import Struct

from potto.calculus.differentiation.loops import vanishes
from potto.core.terms import Term, children
from potto.integrate.columns import distinct
from potto.integrate.fixed.lowered.topologies import Found, lowered_topologies
from potto.integrate.fixed.lowered.topology_text import FARTHEST
from potto.integrate.fixed.straight import CLEAR, ROW_BITS, StraightIntegral, rows_between
from potto.integrate.pieces import Evaluator, gather, numbers_at
from potto.kernels.cells import Array, Bools, Cell, Ints, Number, Value

LEAST = 2  # members, below which numbers are not columns for machine code
FEW = 16  # numbers, up to which comparing with each of them takes less time than looking them up
Turning = tuple[tuple[bool, bool], ...]


class Alike(Struct, frozen=True):
    """Cells of one integrand.

    turning: per variable whether the ends of their stretches are like square roots. between: (N,), the rows of the
    frames between which they lie, as numbers (`rows_between`). members: (N,), whose they are; a member may have
    several.
    """

    face: Term
    turning: Turning
    between: Ints
    members: Ints


class _Cells(Struct):
    """Stretches of the variables so far, (N,) each: their rows, whose they are, and numbers, variables at middles."""

    between: Ints
    members: Ints
    env: dict[str, Value]

    def pick(self, index: Ints, names: Collection[str]) -> _Cells:
        """Some of the cells, with those numbers that are still asked for."""
        env = {name: value for name, value in self.env.items() if name in names}
        return _Cells(self.between.take(index), self.members.take(index), gather(env, index))


def topologies(
    plan: StraightIntegral, machine: Evaluator, env: dict[str, Value], batch: int
) -> tuple[Bools, list[Alike]]:
    """Which members are plain, and all cells of these, by what is integrated over them."""
    moving = machine.costs is not None  # then it is told how surfaces move
    tracking = (machine if moving else machine.with_directions(0)).tracking()
    here = {name: _spread(env[name], batch, moving) for name in plan.names}
    if moving or batch < LEAST:
        found = _found(plan, tracking, here, batch)
    else:
        found = _by_either(plan, tracking, env, here, batch)
    left = np.flatnonzero(~found.plain)
    if not moving and 0 < left.size <= FEW:
        here = gather({name: env[name] for name in plan.names}, left)
        there = {name: _spread(value, left.size, True) for name, value in here.items()}
        found = found.with_others(_by_either(plan, machine.tracking(), here, there, left.size, True), left)
    return found.plain, _gathered(plan, machine, found)


def _by_either(
    plan: StraightIntegral, machine: Evaluator, env: dict[str, Value], here: dict[str, Value], batch: int,
    merging: bool = False,
) -> Found:  # fmt: skip
    """By machine code, if that is to be used now, or by numpy."""
    cells = {name: cell for name, cell in env.items() if isinstance(cell, Cell)}
    parts = cells if merging else {name: Cell(cell.v, cell.e) for name, cell in cells.items()}
    way = lowered_topologies(plan, parts, merging)
    function = way.function(machine)
    if function is not None:
        return way.run(function, env, batch)
    with way.promotion.by_numpy():
        return _found(plan, machine, here, batch, merging)


def _found(
    plan: StraightIntegral, machine: Evaluator, here: dict[str, Value], batch: int, merging: bool = False
) -> Found:
    """All cells of plain members, by numpy: for one variable after the other, those of all members at once.

    merging: cuts of the outermost variable that are one and move as one count once.
    """
    plain = np.ones(batch, dtype=bool)
    cells = _Cells(np.zeros(batch, dtype=np.int64), np.arange(batch), here)
    for i in range(len(plan.variables)):
        cells = _along(plan, i, machine, cells, plain, merging and not i)
    sides = _sides(plan, machine, cells, plain)
    kept = np.flatnonzero(plain.take(cells.members))
    return Found(plain, cells.between.take(kept), cells.members.take(kept), sides.take(kept))


def _along(
    plan: StraightIntegral, i: int, machine: Evaluator, cells: _Cells, plain: Bools, merging: bool
) -> _Cells:  # fmt: skip
    """The stretches of one variable more, within those so far."""
    frame = plan.frames[i]
    values = numbers_at(frame, machine, cells.env)
    places, off = _rows(values, cells.members.size)
    if merging:
        places[_again(plan, i, values, places)] = np.nan
    if machine.costs is not None:
        for surface, rows in plan.jumps[i]:
            roots = [(values[row].v, values[row].t) for row in rows]
            machine.costs.saw(surface, roots, places[0], places[1], machine.directions > 0)
    order, count, fine = in_order(places, off)
    plain[cells.members[~fine]] = False
    size, flat = places.shape[1], places.reshape(-1)
    found = [np.flatnonzero((at < count) & fine) for at in range(1, len(places))]
    index = np.concatenate(found)
    low, high = (np.concatenate([row.take(at) for row, at in zip(rows, found, strict=True)])
                 for rows in (order[:-1], order[1:]))  # fmt: skip
    later = (*plan.frames[i + 1 :], plan.surfaces)
    inner = cells.pick(index, {name for function in later for name in function.params})
    inner.between = (inner.between << ROW_BITS | low) << ROW_BITS | high
    inner.env[plan.variables[i]] = Cell(0.5 * (flat.take(low * size + index) + flat.take(high * size + index)))
    return inner


def _sides(plan: StraightIntegral, machine: Evaluator, cells: _Cells, plain: Bools) -> Ints:
    """A number per cell whose bits are the sides of the surfaces in its middle."""
    surfaces, codes = plan.surfaces, np.zeros(cells.members.size, dtype=np.int64)
    if children(surfaces.body):
        here = {name: cells.env[name] for name in surfaces.params}
        for bit, cell in enumerate(numbers_at(surfaces, machine, here)):
            unclear = ~(np.abs(cell.v) > CLEAR * (0.0 if cell.e is None else cell.e))
            plain[cells.members[np.broadcast_to(unclear, codes.shape)]] = False
            codes |= np.broadcast_to(np.asarray(cell.v) > 0, codes.shape).astype(np.int64) << bit
    return codes


def _gathered(plan: StraightIntegral, machine: Evaluator, cells: Found) -> list[Alike]:
    """The cells by what is integrated over them, which several combinations of sides may lead to (of a union each but
    one), and by which ends of their stretches are like square roots."""
    count, found, sides = len(plan.variables), [], cells.sides
    turns = np.zeros(cells.members.size, dtype=np.int64)
    rows = rows_between(cells.between if any(plan.turning) else cells.between[:0], count)
    for i, turning in enumerate(plan.turning):
        if turning:
            ends = np.isin(rows[i], list(turning))
            turns |= (ends[0].astype(np.int64) << 2 * i) | (ends[1].astype(np.int64) << 2 * i + 1)
    codes: dict[Term, list[int]] = {}
    for code in distinct(sides).tolist():
        face = plan.face(tuple(bool(code >> bit & 1) for bit in range(len(children(plan.surfaces.body)))))
        codes.setdefault(face, []).append(code)
    for face, those in codes.items():
        own = None  # all of them, as mostly
        if len(codes) > 1:
            own = np.any([sides == code for code in those], axis=0) if len(those) < FEW else np.isin(sides, those)
        dark, lit = vanishes(face), sides.size if own is None else int(own.sum())
        if machine.costs is not None:
            machine.costs.stretches(lit, 0 if dark else lit)
        for turn in () if dark else distinct(turns if own is None else turns[own]):
            there = turns == turn if own is None else own & (turns == turn)
            turning_ends = tuple((bool(turn >> 2 * i & 1), bool(turn >> 2 * i + 1 & 1)) for i in range(count))
            places = (cells.between, cells.members)
            if not there.all():
                index = np.flatnonzero(there)
                places = cells.between.take(index), cells.members.take(index)
            found.append(Alike(face, turning_ends, *places))
    return found


def _spread(value: Value, batch: int, moving: bool) -> Value:
    """A number of every member, with its error if it has one."""
    assert isinstance(value, Cell)

    def every(part: Number | None) -> Array | None:
        return None if part is None else np.broadcast_to(part, (batch,))

    v, e = np.broadcast_to(value.v, (batch,)), every(value.e)
    return Cell(v, e, tuple(map(every, value.t)), tuple(map(every, value.et))) if moving else Cell(v, e)


def _rows(values: tuple[Cell, ...], count: int) -> tuple[Array, Array]:
    """The places of bounds and cuts, and how far they may be off, (R, M) each.

    What was divided by a difference that is 0 is at infinity, with nan for what it may be off. That is not a root, if
    the surface is clear of its rounding in the middle of each cell: one that a divisor of the size of its rounding has
    in a cell leaves no more there than that size times the farther end, on one side of 0 at most twice the middle.
    """
    places, off = np.empty((2, len(values), count))
    for row, cell in enumerate(values):
        places[row], off[row] = cell.v, 0.0 if cell.e is None else cell.e
    unknown = np.isnan(off)
    if unknown.any():
        one_sided = (places[:2] >= 0).all(axis=0) | (places[:2] <= 0).all(axis=0)
        places[unknown & np.isinf(places) & one_sided] = np.nan
        off[unknown & ~np.isnan(places)] = np.inf  # roots that merge just here: they are there, and nothing is known
    return places, off


def _again(plan: StraightIntegral, i: int, values: tuple[Cell, ...], places: Array) -> Bools:
    """Which rows (R, M) are another cut once more (`StraightIntegral.going_on`): in the same place, to the last bit,
    with the same speeds."""
    speeds = [[0.0 if t is None else t for t in cell.t] for cell in values]
    numbers = np.array([[place, *(np.broadcast_to(t, place.shape) for t in own)]
                        for place, own in zip(places, speeds, strict=True)])  # fmt: skip
    same = (numbers[:, None] == numbers).all(axis=2)
    rows, again = plan.going_on(i), np.zeros(places.shape, dtype=bool)
    for n, row in enumerate(rows):
        again[row] = same[row, rows[:n]].any(axis=0)
    return again


def in_order(places: Array, off: Array) -> tuple[Ints, Ints, Bools]:
    """Per member its rows in order, (R, M), how many of them lie between the bounds, these included, and for whom that
    is sure. A row that is not a number is a root that is not there.
    """
    near = CLEAR * off
    lying = (places >= places[0] - near[0] - near) & (places <= places[1] + near[1] + near)
    lying[:2] = True
    key = np.where(lying, np.minimum(places, FARTHEST), np.inf)
    key[0], key[1] = -np.inf, np.finfo(float).max  # what lies next to a bound counts as within
    order = np.argsort(key, axis=0, kind="stable")
    at, width = np.take_along_axis(places, order, 0), np.take_along_axis(near, order, 0)
    count = lying.sum(axis=0)
    with np.errstate(invalid="ignore"):
        apart = at[1:] - at[:-1] > width[1:] + width[:-1]
    fine: Bools = np.asarray((apart | (np.arange(1, len(places))[:, None] >= count)).all(axis=0))
    fine &= np.isfinite(places[:2]).all(axis=0)
    return order, count, fine
