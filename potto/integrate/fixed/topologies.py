"""Which members of a batch are cut alike: the cells between their cuts, gathered by what bounds them.

Owns `Uniform` and `topologies`. Where all cuts are closed forms, the cells of a member are told by the order of its
cuts along the outermost variable, by that of the cuts further in at the middle of each stretch, and by the sides of the
surfaces at the middle of each cell. Cells of the same rows and the same integrand are of one shape, whoever's they are,
and are integrated by one rule. A member with cuts that rounding does not tell apart, or with a surface that is 0 in the
middle of a cell, is not plain, and is left to the general way.
"""

from __future__ import annotations

import itertools

import numpy as np
from msgspec import Struct

from potto.core.terms import Const, Term, children
from potto.integrate.columns import distinct
from potto.integrate.fixed.a_priori import CLEAR, Path, Straight
from potto.integrate.fixed.moving_sums import evaluated
from potto.integrate.pieces import Evaluator, gather
from potto.kernels.cells import Array, Bools, Cell, Ints, Number, Value

MOST_SHAPES = 64


class Uniform(Struct, frozen=True):
    """Cells of one shape: per variable the rows of the frame between which they lie, the integrand, whose they are."""

    path: Path
    face: Term
    members: Ints


class _Search(Struct):
    """The cells found so far, and which members are plain."""

    plan: Straight
    machine: Evaluator
    plain: Bools
    cells: list[Uniform]

    def over(self, i: int, env: dict[str, Value], members: Ints, path: Path) -> None:
        """The cells of some members on one stretch of each variable further out, which stand at its middle."""
        if len(self.cells) > MOST_SHAPES:
            return
        if i == len(self.plan.variables):
            self.sided(env, members, path)
            return
        values = evaluated(self.plan.frames[i], self.machine, _for(self.plan.frames[i].params, env))
        places, off = _rows(values, members.size)
        if self.machine.costs is not None:
            for surface, rows in self.plan.jumps[i]:
                roots = [(values[row].v, values[row].t) for row in rows]
                self.machine.costs.saw(surface, roots, places[0], places[1], self.machine.directions > 0)
        codes, fine = in_order(places, off)
        self.plain[members[~fine]] = False
        for code in distinct(codes[fine]):
            index, rows = np.nonzero(fine & (codes == code))[0], rows_of(int(code), len(places))
            here = gather(env, index)
            ends = places[:, index]
            for low, high in itertools.pairwise(rows):
                here[self.plan.variables[i]] = Cell(0.5 * (ends[low] + ends[high]))
                self.over(i + 1, here, members[index], (*path, (low, high)))

    def sided(self, env: dict[str, Value], members: Ints, path: Path) -> None:
        """The cells of one path, by the sides of the surfaces on them."""
        surfaces = self.plan.surfaces
        codes = np.zeros(members.size, dtype=np.int64)
        if children(surfaces.body):
            for bit, cell in enumerate(evaluated(surfaces, self.machine, _for(surfaces.params, env))):
                unclear = ~(np.abs(cell.v) > CLEAR * (0.0 if cell.e is None else cell.e))
                self.plain[members[np.broadcast_to(unclear, members.shape)]] = False
                codes |= np.broadcast_to(np.asarray(cell.v) > 0, members.shape).astype(np.int64) << bit
        for code in distinct(codes):
            sides = tuple(bool(code >> bit & 1) for bit in range(len(children(surfaces.body))))
            face = self.plan.face(sides)
            whose = members[codes == code]
            dark = isinstance(face, Const) and face.value == 0
            if self.machine.costs is not None:
                self.machine.costs.stretches(whose.size, 0 if dark else whose.size)
            if not dark:
                self.cells.append(Uniform(path, face, whose))


def topologies(plan: Straight, machine: Evaluator, env: dict[str, Value], batch: int) -> tuple[Bools, list[Uniform]]:
    """Which members are plain, and all cells of these, by shape."""
    moving = machine.costs is not None  # then it is told how surfaces move
    tracking = (machine if moving else machine.with_directions(0)).tracking()
    search = _Search(plan, tracking, np.ones(batch, dtype=bool), [])
    here = {n: _spread(env[n], batch, moving) for n in plan.names}
    search.over(0, here, np.arange(batch), ())
    if len(search.cells) > MOST_SHAPES:
        return np.zeros(batch, dtype=bool), []
    kept = (Uniform(c.path, c.face, c.members[search.plain[c.members]]) for c in search.cells)
    return search.plain, [cell for cell in kept if cell.members.size]


def _spread(value: Value, batch: int, moving: bool) -> Value:
    """A number of every member, with its error if it has one."""
    assert isinstance(value, Cell)

    def every(part: Number | None) -> Array | None:
        return None if part is None else np.broadcast_to(part, (batch,))

    v, e = np.broadcast_to(value.v, (batch,)), every(value.e)
    return Cell(v, e, tuple(map(every, value.t)), tuple(map(every, value.et))) if moving else Cell(v, e)


def _for(names: tuple[str, ...], env: dict[str, Value]) -> dict[str, Value]:
    return {name: env[name] for name in names}


def _rows(values: tuple[Cell, ...], count: int) -> tuple[Array, Array]:
    """The places of bounds and cuts, and how far they may be off, (R, M) each."""
    places, off = np.empty((2, len(values), count))
    for row, cell in enumerate(values):
        places[row], off[row] = cell.v, 0.0 if cell.e is None else cell.e
    return places, off


def in_order(places: Array, off: Array) -> tuple[Array, Bools]:
    """Per member a number that tells which rows lie between the bounds, in which order; and for whom that is sure.

    A row that is no number is a root that is not there. See `rows_of` for the numbers.
    """
    count, near = len(places), CLEAR * off
    lying = (places >= places[0] - near[0] - near) & (places <= places[1] + near[1] + near)
    lying[:2] = True
    key = np.where(lying, places, np.inf)
    key[0], key[1] = -np.inf, np.finfo(float).max  # whatever rounding says, between the bounds
    order = np.argsort(key, axis=0, kind="stable")
    at, width = np.take_along_axis(places, order, 0), np.take_along_axis(near, order, 0)
    part = np.arange(1, count)[:, None] < lying.sum(axis=0)
    fine: Bools = np.asarray((~part | (at[1:] - at[:-1] > width[1:] + width[:-1])).all(axis=0))
    fine &= np.isfinite(places[:2]).all(axis=0)
    digits = np.where(np.vstack([np.ones_like(part[:1]), part]), order, 0)
    return ((count ** np.arange(count))[:, None] * digits).sum(axis=0), fine


def rows_of(code: int, count: int) -> tuple[int, ...]:
    """The rows that a number stands for, from the lower bound (row 0) to the upper (row 1)."""
    rows = [0]
    while rows[-1] != 1:
        code //= count
        rows.append(code % count)
    return tuple(rows)
