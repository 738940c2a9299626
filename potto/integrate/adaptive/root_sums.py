"""Sums over the roots of a surface along the innermost variable: integrals over level sets.

Owns `over_roots`. Each root moves as its cut does, by the implicit function theorem; what is added up there is
evaluated with the root as a number that carries its tangents and its error.
"""

from __future__ import annotations

import numpy as np

from potto.calculus.differentiation.derivative import partial
from potto.calculus.differentiation.level_sets import LevelSet
from potto.core.terms import function_of, tuple_
from potto.integrate.columns import distinct
from potto.integrate.decomposition.meetings import SEARCHED, Row, as_array, tangents
from potto.integrate.events import at_a_fold, root_on_a_bound
from potto.integrate.pieces import Evaluator, Sums, components, gather, numbers_at, resting, take
from potto.integrate.plan import Plan
from potto.integrate.rules.gauss import EPS
from potto.kernels.cells import Array, Bools, Cell, Ints, Mask, Value

CLEAR = 64.0  # times what the rounding of a surface and of its place comes to; where it is larger it jumps


Rows = tuple[Cell, Cell, list[Row], Array | None]  # bounds, cuts, and what those matter at most that were left out


def over_roots(
    plan: Plan, found: Rows, env: dict[str, Value], batch: int, sides: dict[int, Mask], machine: Evaluator
) -> Sums:
    """The sums of a batch over the roots of its level set between the bounds, reversed ones counted negative."""
    level, over, k = plan.levels[-1], plan.over, machine.directions
    assert over is not None
    lo, hi, rows, lost = found
    low, high = as_array(np.minimum(lo.v, hi.v), batch), as_array(np.maximum(lo.v, hi.v), batch)
    owner, root = _near([row for row in rows if row.cut >= 0], low, high, batch, k, machine.frozen)
    machine.count(owner.size)
    here = gather(env, owner)
    here[level.variable] = root
    root_x, off = np.asarray(root.v), np.asarray(root.e)
    counts, folded = _roots(over, here, machine)
    inside = (root_x > low[owner]) & (root_x < high[owner]) & counts
    unsure = counts & ((np.abs(root_x - low[owner]) <= off) | (np.abs(root_x - high[owner]) <= off))
    trace = plan.trace(take(sides, owner))
    value = machine.tracking().evaluate(plan.body, here, trace)
    sums = _added(components(value), owner, inside, unsure, batch, k)
    sums.v *= np.where(as_array(hi.v, batch) < as_array(lo.v, batch), -1.0, 1.0)
    sums.t *= np.where(as_array(hi.v, batch) < as_array(lo.v, batch), -1.0, 1.0)
    if lost is not None:
        sums.e += lost
        sums.et += lost
    bad = np.isnan(low) | np.isnan(high)
    if len(plan.levels) == 1 and len(over.shares) == 1:
        _note(over, level.variable, owner, inside & folded, unsure, batch, machine)
        bad[owner[inside & folded]] = True
    if bad.any():
        sums.unknown(bad)
    return sums


def _near(rows: list[Row], low: Array, high: Array, batch: int, k: int, frozen: bool) -> tuple[Ints, Cell]:
    """Whose the roots are that lie between the bounds, or on one for all that is known, each once; and where."""
    if not rows:
        empty = np.zeros(0)
        return np.zeros(0, dtype=np.int64), Cell(empty, empty, (empty,) * k, (empty,) * k)
    x = np.stack([as_array(row.x, batch) for row in rows])
    e = np.stack([as_array(0.0 if row.e is None else row.e, batch) for row in rows])
    e = np.maximum(e, SEARCHED * EPS * np.abs(x))
    with np.errstate(invalid="ignore"):
        which, owner = np.nonzero((x >= low - e) & (x <= high + e))
    order = np.lexsort((x[which, owner], owner))
    which, owner = which[order], owner[order]
    x, e = x[which, owner], e[which, owner]
    same: Bools = np.zeros(owner.size, dtype=bool)
    same[1:] = (owner[1:] == owner[:-1]) & (x[1:] - x[:-1] <= e[1:] + e[:-1])
    keep = ~same
    t, et = (
        np.stack([tangents(() if frozen else speeds, batch, k) for speeds in of])[which, :, owner].T[:, keep]
        for of in ([row.t for row in rows], [row.et for row in rows])
    )
    return owner[keep], Cell(x[keep], e[keep], tuple(t), tuple(et))


def _roots(over: LevelSet, here: dict[str, Value], machine: Evaluator) -> tuple[Bools, Bools]:
    """Which places are roots, and not poles or jumps; and where the level set folds, as far as rounding tells."""
    face = function_of(tuple_((over.surface, partial(over.surface, over.shares[0]))))
    still = machine.with_directions(0).tracking()
    found = numbers_at(face, still, {n: resting(here[n]) for n in face.params})
    (value, off), (slope, rounding) = ((cell.v, 0.0 if cell.e is None else cell.e) for cell in found)
    size = np.asarray(here[over.shares[0]].v).shape  # type: ignore[union-attr]
    zero = np.isfinite(value) & ~(np.abs(value) > CLEAR * off)
    return np.broadcast_to(zero, size), np.broadcast_to(np.abs(slope) <= rounding, size)


def _added(cells: list[Cell], owner: Ints, inside: Bools, unsure: Bools, batch: int, k: int) -> Sums:
    """What is summed, added up for each member; what may as well not count is an error."""

    def each(parts: list[Array]) -> Array:
        return np.stack([np.bincount(owner, part, minlength=batch) + 0.0 for part in parts])

    def full(part: object, where: Bools) -> Array:
        return np.where(where, 0.0 if part is None else np.asarray(part), 0.0)

    either = inside | unsure
    sums = Sums.zeros(len(cells), k, batch)
    sums.v[:] = each([full(c.v, inside) for c in cells])
    sums.e[:] = each([full(c.e, either) + np.abs(full(c.v, unsure)) for c in cells])
    assert sums.gross is not None
    sums.gross[0] = each([np.abs(full(c.v, inside)) for c in cells]).max(axis=0)
    for d in range(k):
        sums.t[:, d] = each([full(c.t[d], inside) for c in cells])
        sums.et[:, d] = each([full(c.et[d], either) + np.abs(full(c.t[d], unsure)) for c in cells])
        sums.gross[1] = np.maximum(sums.gross[1], each([np.abs(full(c.t[d], inside)) for c in cells]).max(axis=0))
    return sums


def _note(
    over: LevelSet, variable: str, owner: Ints, folded: Bools, unsure: Bools, batch: int, machine: Evaluator
) -> None:
    for where, what in ((folded, at_a_fold), (unsure, root_on_a_bound)):
        if where.any():
            machine.note(what(over.surface, variable), distinct(owner[where]) if batch > 1 else None)
