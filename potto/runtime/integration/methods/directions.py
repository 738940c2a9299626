"""Integrals with each direction by itself, since what runs along one variable may not move in it.

Owns `by_directions`. A surface that runs along every variable keeps derivatives from being known in whichever order,
but only in directions that move it. A single member is looked at in one direction after the other, to all digits that
it has there; members of a batch together, as a batch of members and directions.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from potto.integrate.pieces import INTO, OF, Sums
from potto.kernels.cells import Bools, Cell, Ints, Number, Value, map_cells
from potto.runtime.evaluation.derivatives.beside import moving, one_direction
from potto.runtime.integration.problem import Problem


def by_directions(problem: Problem) -> Sums:
    """The sums of members, looked at in the directions in which something of them moves, and in the first one, which
    tells their values."""
    directions = problem.machine.directions
    found = [_moved((one_direction(v, d) for v in problem.env.values()), problem.batch) for d in range(directions)]
    found[0][:] = True
    moved = [np.flatnonzero(mask) for mask in found]
    if problem.batch == 1:
        return _joined([_along(problem, d) if members.size else None for d, members in enumerate(moved)])
    number = np.repeat(np.arange(directions), [members.size for members in moved])
    with problem.among(np.concatenate(moved)) as pairs:
        sums = _of_pairs(pairs, number)
    whole = _resting(sums.pick(np.arange(problem.batch)), directions)
    for d, members in enumerate(moved):
        at = np.flatnonzero(number == d)
        whole.t[:, d, members], whole.et[:, d, members] = sums.t[:, 0, at], sums.et[:, 0, at]
        problem.events.take(pairs.events.of(at), members)
    return whole


def _along(problem: Problem, d: int) -> Sums:
    """The sums with this direction alone."""
    env = {name: one_direction(value, d) for name, value in problem.env.items()}
    own = problem.at(env, machine=problem.machine.with_directions(1), outermost=True)
    return own.solver(own)


def _joined(parts: Sequence[Sums | None]) -> Sums:
    """The sums of directions as one; None: nothing moves in it."""
    first = parts[0]
    assert first is not None
    known = [_resting(first, 1) if part is None else part for part in parts]
    t, et = (np.concatenate([getattr(part, name) for part in known], axis=1) for name in ("t", "et"))
    return Sums(first.v, first.e, t, et)


def _of_pairs(pairs: Problem, number: Ints) -> Sums:
    """The sums of a batch in which each member has a direction of its own, of this number."""
    env = {name: map_cells(value, lambda cell: _towards(cell, number)) for name, value in pairs.env.items()}
    for name in (INTO, OF):
        into = env.get(name)
        if isinstance(into, Cell):  # what goes into one sum does so in each direction
            env[name] = Cell(into.v + number * (np.max(into.v) + 1.0))
    own = pairs.at(env, machine=pairs.machine.with_directions(1), outermost=True)
    return own.solver(own)


def _towards(cell: Cell, number: Ints) -> Cell:
    """A number of each member, with the one tangent that is along its direction."""

    def chosen(parts: Sequence[Number | None]) -> tuple[Number | None, ...]:
        found: Number | None = None
        for d, part in enumerate(parts):
            if part is not None:
                found = np.where(number == d, part, 0.0 if found is None else found)
        return (found,) if parts else ()

    return Cell(cell.v, cell.e, chosen(cell.t), chosen(cell.et))


def _resting(sums: Sums, directions: int) -> Sums:
    """The same values, which do not change in so many directions where there are any."""
    known, shape = np.isfinite(sums.v)[:, None], (sums.v.shape[0], directions, sums.v.shape[1])
    t, et = (np.broadcast_to(np.where(known, 0.0, other), shape).copy() for other in (np.nan, np.inf))
    return Sums(sums.v.copy(), sums.e.copy(), t, et)


def _moved(values: Iterable[Value], size: int) -> Bools:
    """The members of which something moves in the only direction."""
    found = np.zeros(size, dtype=bool)
    for cell in (cell for value in values for cell in moving(value, 0)):
        found |= np.asarray(cell.t[0]) != 0
    return found
