"""What sits at an end of a segment of a variable that is not the innermost one, too narrow for any node.

Owns `peaks_at_ends`. At the ends of segments of the innermost variable integrands are looked at anyway. Further out
that takes an integral each, so it is done only where the integrand itself, along a few lines that lead to such an end,
does not go on as it does beside it: the end may be one of the range, or a cut of any kind.

Along a line the sides of all surfaces are held: what a bracket does there is none of the integrand's. What is smooth
has fourth differences that hardly change from one step to the next, powers of the distance to the end such that fall
by no more than FALL; a layer that is narrower than a third of a step falls faster.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache

import numpy as np

from potto.integrate.degenerate.scene import decided, surfaces_at
from potto.integrate.levels import LevelPlan
from potto.integrate.panels.iterated import Iterated
from potto.integrate.pieces import Evaluator, dense, gather, numbers_at, still, take
from potto.integrate.rules import substitution
from potto.integrate.rules.gauss import EPS
from potto.integrate.rules.substitution import Segments
from potto.kernels.cells import Array, Bools, Cell, Ints, Mask, Value

# A step, in parts of a segment: a fifth of the way to the first of eleven nodes. How many of them there are from an
# end on, and which of the places it is at that lines lie on the sides that they are told by.
STEP, STEPS, ASIDE = 2.0**-9, 5, 2
DIFFERENCE = np.array([1.0, -4.0, 6.0, -4.0, 1.0])
FALL = 20.0  # those of square roots at the end fall by 15.5
LEAST = 1e-10  # the part of the integrand from which on a difference is more than rounding
# Where lines are on the stretches between the cuts of variables further in, of which so many are told apart.
PARTS, MANY_CUTS = (0.0, 0.5, 1.0), 8
MOST_LINES = 36
# Of segments at nodes of variables further out, one in so many is looked at.
EVERY = 5
POINTS = 1 << 16  # that are evaluated at once


def peaks_at_ends(
    parent: Iterated, number: int, env: dict[str, Value], seg: Segments, sides: dict[int, Mask], machine: Evaluator
) -> bool:
    """Whether the integrand has a layer at an end of some segment of variable `number`, on these sides."""
    levels = parent.plan.levels
    degrees = parent.degrees
    if number + 1 == len(levels) or parent.plan.over is not None or (degrees and degrees[number] is not None):
        return False
    machine = machine.with_directions(0)
    inner = levels[number + 1 :]
    lines = _lines(tuple(_stretches(level) for level in inner))
    index = np.arange(0, seg.a.size, EVERY if number else 1)
    index = index[~seg.turning[index]]  # roots further in begin there, which no difference tells from layers
    step = max(1, POINTS // (2 * (STEPS + 1) * len(lines)))
    for start in range(0, index.size, step):
        some = index[start : start + step]
        here = gather({name: still(value) for name, value in env.items()}, seg.owner[some])
        own = take(sides, some)
        if _peaked(parent, number, here, seg.pick(some), own, machine, lines):
            return True
    return False


def _peaked(
    parent: Iterated, number: int, env: dict[str, Value], seg: Segments, sides: dict[int, Mask], machine: Evaluator,
    lines: Ints,
) -> bool:  # fmt: skip
    """The same of segments, each with an environment of its own."""
    near = STEP * np.arange(STEPS + 1)
    u = np.tile(np.concatenate((near, 1.0 - near)), (seg.a.size, 1))
    with np.errstate(all="ignore"):
        x, _, _ = substitution.points(seg, u)
    level, shape = parent.plan.levels[number], (seg.a.size, len(lines), u.shape[1])
    here = gather(env, np.repeat(np.arange(seg.a.size), len(lines) * u.shape[1]))
    here[level.variable] = Cell(np.broadcast_to(x[:, None], shape).ravel())
    held = _held(parent, number, here, shape, lines, sides, machine)
    for variable, place in _along(parent.plan.levels[number + 1 :], here, shape, lines, machine):
        here[variable] = place
    count = x.size * len(lines)
    with np.errstate(all="ignore"):
        values, errors = dense(parent.body(here, held, machine.tracking()), 0, (count,))
    clear = (seg.b - seg.a) * STEP > EPS / LEAST * np.maximum(np.abs(seg.a), np.abs(seg.b))
    ends = np.stack((clear & np.isfinite(seg.a), clear & np.isfinite(seg.b)), axis=1)
    off = np.zeros(values.shape) if errors is None else errors
    return any(_layered(v.reshape(shape), e.reshape(shape), ends) for v, e in zip(values[:, 0], off[:, 0], strict=True))


def _layered(values: Array, off: Array, ends: Bools) -> bool:
    """Whether values (S, L, 2 * (STEPS + 1)), from both ends on, have a layer at one of those ends (S, 2), by more
    than they are off."""
    rows, errors = (part.reshape(*part.shape[:2], 2, -1) for part in (values, off))
    with np.errstate(all="ignore"):
        at_end, beside = np.abs(rows[..., :-1] @ DIFFERENCE), np.abs(rows[..., 1:] @ DIFFERENCE)
        size = np.nanmax(np.where(np.isfinite(rows), np.abs(rows), 0.0), initial=0.0, axis=(1, 2, 3))
        least = FALL * (beside + errors[..., :-1] @ np.abs(DIFFERENCE)) + LEAST * size[:, None, None]
        falls: Bools = (at_end > least) & ends[:, None] & np.isfinite(at_end)
    return bool(falls.any())


def _held(
    parent: Iterated, number: int, here: dict[str, Value], shape: tuple[int, ...], lines: Ints,
    sides: Mapping[int, Mask], machine: Evaluator,
) -> dict[int, Mask]:  # fmt: skip
    """The sides of all surfaces on lines (S, L, places): those of variables further in as they are in the middle of
    their stretches, a little way from the end."""
    held: dict[int, Mask] = {g: np.repeat(np.broadcast_to(m, shape[:1]), shape[1] * shape[2]) for g, m in sides.items()}
    plan = parent.plan
    inner = plan.levels[number + 1 :]
    if plan.hides or not any(level.decided for level in inner):
        return held
    aside = np.arange(shape[2]) // (STEPS + 1) * (STEPS + 1) + ASIDE
    rows = np.arange(shape[0] * shape[1])[:, None] * shape[2] + aside
    places = gather(here, rows.ravel())
    middle = lines.copy()
    middle[:, :, 1] = PARTS.index(0.5)
    cells = dict(_along(inner, places, shape, middle, machine))
    for level in inner:
        places[level.variable] = cells[level.variable]
        if level.decided:
            values, _ = surfaces_at(level, places, rows.size, machine)
            up = [v >= 0 if plan.groups[g].up_at_zero else v > 0 for g, v in zip(level.decided, values, strict=True)]
            held = decided(level, held, up)
    return held


def _along(
    inner: Sequence[LevelPlan], env: Mapping[str, Value], shape: tuple[int, ...], lines: Ints, machine: Evaluator
) -> Iterator[tuple[str, Cell]]:
    """Where lines (L, variables, 2) lie in each of the variables further in, which all depend on those before them."""
    here = dict(env)
    count = shape[0] * shape[1] * shape[2]
    for level, line in zip(inner, np.moveaxis(lines, 1, 0), strict=True):
        stretch, part = (np.tile(np.repeat(own, shape[2]), shape[0]) for own in line.T)
        low, high, *roots = numbers_at(level.frame if _stretches(level) > 1 else level.bounds, machine, here)
        with np.errstate(all="ignore"):
            ends = [np.broadcast_to(cell.v, count) for cell in (low, high)]
            cuts = [np.where(np.isnan(r.v), ends[1], np.clip(r.v, *np.sort(ends, axis=0))) for r in roots]
            places = np.sort(np.stack((ends[0], *cuts, ends[1])), axis=0)
            at = np.arange(count)
            x = _within(places[stretch, at], places[stretch + 1, at], np.asarray(PARTS)[part])
        here[level.variable] = cell = Cell(x)
        yield level.variable, cell


def _stretches(level: LevelPlan) -> int:
    """Between how many cuts of a variable lines are laid."""
    return 1 + (len(level.rows) if len(level.rows) <= MANY_CUTS else 0)


@lru_cache(maxsize=64)
def _lines(stretches: tuple[int, ...]) -> Ints:
    """On which stretch of each variable lines lie, and at which of PARTS: (L, variables, 2). All that there are, or
    such that each variable is at all of its own."""
    own = [list(itertools.product(range(count), range(len(PARTS)))) for count in stretches]
    whole = int(np.prod([len(places) for places in own]))
    if whole <= MOST_LINES:
        return np.array(list(itertools.product(*own)))
    most = max(MOST_LINES, *map(len, own))
    turns = [(np.arange(most) + np.arange(most) // len(places) * n) % len(places) for n, places in enumerate(own)]
    return np.stack([np.array(places)[turn] for places, turn in zip(own, turns, strict=True)], axis=1)


def _within(low: Array, high: Array, part: Array) -> Array:
    """Places at parts of stretches; without an end, at the other, one beyond it, and nearly there."""
    far = part / np.maximum(1.0 - part, EPS)
    x = low + part * (high - low)
    x = np.where(np.isinf(high) & np.isfinite(low), low + far, x)
    x = np.where(np.isinf(low) & np.isfinite(high), high - 1.0 / np.maximum(far, EPS), x)
    return np.where(np.isinf(low) & np.isinf(high), 2.0 * part - 1.0, x)
