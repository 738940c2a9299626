"""Members of a batch cut by step functions: their cells as members of a larger batch, which nothing cuts.

Owns `by_cells`. Between two of its neighbours in order each cell is an integral of one function of the variable, with
the ends of the cell and the heights of step functions on it as parameters. All cells of all members are integrated
together, by rules that are measured at what they amount to for their member.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from potto.core.terms import Term, function_of, tuple_, var
from potto.integrate.fixed.steps.step_cells import StepCells, step_cells
from potto.integrate.fixed.steps.step_integral import StepIntegral
from potto.integrate.fixed.straight import StraightIntegral
from potto.integrate.pieces import INTO, OF, Evaluator, Shaped, Sums, gather
from potto.kernels.cells import Array, Cell, Ints, Value
from potto.kernels.whole import PAIRWISE

LOW, HIGH = "#low", "#high"
CELLS = 1 << 16  # that are worked out at once
NOTHING: Term = tuple_(())
Integrated = Callable[[StraightIntegral, dict[str, Value], int], Shaped | None]


def by_cells(
    plan: StepIntegral, machine: Evaluator, env: dict[str, Value], batch: int, integrated: Integrated
) -> Shaped | None:
    """What could be integrated of a batch; None if nothing was. integrated: gives the same of others by their terms."""
    (done, short), sums = np.zeros((2, batch), dtype=bool), Sums.zeros(1, machine.directions, batch)
    step = max(1, CELLS // plan.rows)
    for start in range(0, batch, step):
        index = np.arange(start, min(start + step, batch))
        found = _some(plan, machine, gather(env, index), index, integrated)
        done[index], short[index] = found.done, found.short
        sums = sums.with_members(index, found.sums)
    return Shaped(done, short, sums) if done.any() or short.any() else None


@np.errstate(all="ignore")
def _some(plan: StepIntegral, machine: Evaluator, env: dict[str, Value], index: Ints, integrated: Integrated) -> Shaped:
    cells = step_cells(plan, machine.tracking(), env, index.size)
    there = (np.arange(cells.width.shape[-1]) < cells.inside[:, None]) & cells.fine[:, None]
    if plan.dark:
        there &= np.any([number.any(axis=0) for number, _ in cells.heights], axis=0)
    members, places = np.nonzero(there)
    nothing, nobody = Sums.zeros(1, machine.directions, index.size), np.zeros(index.size, dtype=bool)
    if not members.size:
        return Shaped(np.asarray(cells.fine), nobody, nothing)
    here = _parameters(plan, cells.pick((members, places)), gather(_read(plan, env), members))
    here.setdefault(INTO, Cell(index.take(members).astype(float)))
    found = integrated(cell_plan(plan), here, members.size)
    if found is None:
        return Shaped(nobody, nobody, nothing)
    fine, short, parts = cells.fine.copy(), nobody.copy(), found.sums
    fine[members[~(found.done | found.short)]] = False
    short[members[found.short]] = True

    def total(rows: Array) -> Array:
        spread = np.zeros((*rows.shape[:-1], *there.shape))
        spread[..., members, places] = rows
        return np.asarray(spread.sum(axis=-1) * fine)

    assert parts.gross is not None
    gross = total(parts.gross)
    v, e, t, et = map(total, (parts.v, parts.e, parts.t, parts.et))
    whole = Sums(v, e + PAIRWISE * gross[0], t, et + PAIRWISE * gross[1], gross=gross)
    return Shaped(fine & ~short, fine & short, whole)


def _read(plan: StepIntegral, env: dict[str, Value]) -> dict[str, Value]:
    """What is asked for of the members: parameters of the integrand, and what they are added up to."""
    return {name: env[name] for name in (*plan.body.params, INTO, OF) if name in env}


def _parameters(plan: StepIntegral, cells: StepCells, env: dict[str, Value]) -> dict[str, Value]:
    """What a cell is integrated with: (N,) each. Of how far off its ends are only the sum counts."""
    half = 0.5 * cells.off
    ends = {LOW: cells.low, HIGH: cells.low + cells.width}
    found: dict[str, Value] = dict(env)
    for name, end in ends.items():
        t = tuple([row if moves else None for row, moves in zip(end[1:], cells.moving, strict=True)])
        et = tuple([row if moves else None for row, moves in zip(half[1:], cells.moving, strict=True)])
        found[name] = Cell(end[0], half[0], t, et)
    return found | dict(zip(plan.names, cells.levels(), strict=True))


@lru_cache(maxsize=256)
def cell_plan(plan: StepIntegral) -> StraightIntegral:
    """One cell as an integral."""
    none: tuple[frozenset[int], ...] = (frozenset(),)
    names = {*plan.body.params, LOW, HIGH} - {plan.variable}
    frame = function_of(tuple_((var(LOW), var(HIGH))))
    return StraightIntegral(
        (plan.variable,), (frame,), ((),), none, none, plan.body.body, function_of(NOTHING), tuple(sorted(names))
    )
