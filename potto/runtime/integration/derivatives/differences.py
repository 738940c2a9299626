"""Derivatives by differences of values, where no other way to them has digits.

Owns `by_differences`. The boundary term of a curved surface in three variables is infinite at its own boundary, so that
a second derivative by boundary terms keeps few digits; the first derivative has nearly all. Central differences of
order 8 at two steps say what the next derivative is, and by how much they differ how well; the noise of the values and
a gap between the sides that does not shrink with the step (a kink) speak against them. So does a derivative that is
known, if to few digits: `sin(x + 1e10*t)` turns so often between the points that they look like those of a slow wave.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from potto.core.terms import Integral
from potto.integrate.events import OneSidedDerivatives
from potto.integrate.pieces import Sums, still
from potto.kernels.cells import Array, Value
from potto.runtime.evaluation.derivatives.beside import moved, moving
from potto.runtime.integration.problem import Problem

ROUGH = 1e-6  # from which relative error on another way is looked for, unless no more was asked for
FEW = 4  # members of a batch for which that is done
REACH = 1 / 16  # the farthest point, as a part of the parameters
SHRINKS = 0.6  # what a gap may be of itself when the step is halved
WEIGHTS = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280])  # of v(ih) - v(-ih), over h, exact up to degree 8
LOWER = np.array([3 / 4, -3 / 20, 1 / 60, 0.0])  # up to degree 6
SURE = 4.0  # times what two estimates differ by
FAR = 0.5  # by which part of it a derivative may differ from what the two nearest points tell
CANCELLED = 1e-9  # the part of what was added up that a derivative may be uncertain by: a zero that is known for one


def by_differences(problem: Problem, order: Integral, sums: Sums) -> Sums:
    """The sums with derivatives by differences where their own have no digits and values have many."""
    machine = problem.machine
    if problem.batch > FEW or machine.exhausted() or machine.side or problem.events.every(OneSidedDerivatives):
        return sums
    rough = (
        ~(sums.et <= max(ROUGH, machine.rtol) * np.abs(sums.t))
        & np.isfinite(sums.v)[:, None]
        & ~(sums.et <= machine.atol)
    )
    if sums.gross is not None:
        rough &= ~(sums.et <= CANCELLED * np.where(np.isfinite(sums.gross[1]), sums.gross[1], 0.0))
    for member in map(int, np.nonzero(rough.any(axis=(0, 1)))[0]):
        one = problem.changed(machine=machine.with_directions(0)).member(member)
        for d in np.nonzero(rough[:, :, member].any(axis=0))[0]:
            step = min(_reaches(one.env, int(d)), default=0.0) * REACH / 4
            if not 0 < step < np.inf:
                continue
            noise = 2 * np.abs(WEIGHTS).sum() / (step / 2) * sums.e[:, member]
            if (sums.et[:, d, member] <= noise).all():
                continue  # differences of values have no more digits
            t, et = sums.t[:, d, member], sums.et[:, d, member]
            found = _derivative(one.env, int(d), step, one.beside, (t, et))
            if found is None:
                continue
            value, off = found
            better = np.isfinite(off) & ~(et <= off) & np.isfinite(value) & ~(np.abs(value - t) > et + off)
            t[:], et[:] = np.where(better, value, t), np.where(better, off, et)
    return sums


def _reaches(env: dict[str, Value], d: int) -> Iterator[float]:
    """Of each number that moves, the step after which it is twice as large."""
    for value in env.values():
        for cell in moving(value, d):
            if cell.v != 0:
                yield abs(float(cell.v) / float(cell.t[d] or 0.0))


def _derivative(
    env: dict[str, Value], d: int, step: float, evaluated: Callable[[dict[str, Value]], Sums],
    known: tuple[Array, Array],
) -> tuple[Array, Array] | None:  # fmt: skip
    """The derivative of all components, and how far off it may be; None where values are missing or there is a kink,
    and where already the nearest ones tell of another derivative.

    evaluated: the integral at other parameters. known: the derivative to few digits, and its error.
    """
    values: dict[float, tuple[Array, Array]] = {}

    def at(h: float) -> tuple[Array, Array]:
        if h not in values:
            found = evaluated({n: still(moved(v, h, d)) for n, v in env.items()})
            values[h] = found.v[:, 0], found.e[:, 0]
        return values[h]

    (up, off), (down, below) = at(step / 2), at(-step / 2)
    t, et = known
    if (np.abs((up - down) / step - t) > FAR * np.abs(t) + et + (off + below) / step).any():
        return None
    middle, noise = at(0.0)
    estimates, gaps = [], []
    for h in (step, step / 2):
        points = [(at(i * h), at(-i * h)) for i in (1, 2, 3, 4)]
        differences = np.array([up[0] - down[0] for up, down in points]) / h
        errors = np.array([up[1] + down[1] for up, down in points]) / h
        estimates.append((WEIGHTS @ differences, LOWER @ differences, np.abs(WEIGHTS) @ errors))
        gaps.append(np.abs(points[0][0][0] - 2 * middle + points[0][1][0]) / h)
    (wide, _, _), (value, lower, rounding) = estimates
    if not (np.isfinite(value).all() and np.isfinite(wide).all()):
        return None
    if (gaps[1] > SHRINKS * gaps[0] + 8 * noise / step + 1e-9 * np.abs(value)).any():
        return None
    return value, SURE * (np.abs(value - wide) + np.abs(value - lower)) + rounding
