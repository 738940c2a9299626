"""One integral between known cuts, straight through: no pieces, no refinement, as many nodes as were proved enough.

Owns `certain`, `beside_bounds`, `proved_sum`, `proved_gradient` and `Crowded`. Where all cuts are closed forms and on
every cell between them the integrand is one analytic formula, `proved_orders` says beforehand how many nodes do. What
is left is a short program: bounds and cuts as formulas of the variables further out, the nodes between them, the
formula at the nodes, weighted sums. Its derivative is that of the program, whose nodes move with the parameters
(Reynolds' transport theorem: a surface that moves takes its nodes along, so that no boundary term is left). Its
rounding is kept track of as everywhere outside of integrals, by a running error analysis from the bounds to the sums.
Whatever is not plain here is left to `levels`.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from potto.calculus.differentiation.loops import vanishes
from potto.core.terms import children
from potto.integrate.fixed.moving_sums import MovingTotals, summed
from potto.integrate.fixed.proved_sums.alone import machine_code, promotion, summed_alone
from potto.integrate.fixed.proved_sums.on_bounds import OnBounds, Place, Tied
from potto.integrate.fixed.proved_sums.settled import SettledRegion, accurate
from potto.integrate.fixed.proved_sums.sum_text import RepeatedSum
from potto.integrate.fixed.regions import LOOSEST, Path, Places, Settlement, known, region_of, settle
from potto.integrate.fixed.steps.stays import Stay
from potto.integrate.fixed.steps.step_cells import step_cells
from potto.integrate.fixed.steps.step_gradients import step_gradient
from potto.integrate.fixed.steps.step_sums import SteppedCall
from potto.integrate.fixed.straight import CLEAR, MOST_CHOICES, StraightIntegral
from potto.integrate.pieces import Evaluator, Sums, numbers_at
from potto.integrate.rules.proved_orders import FrameCell as Stretch
from potto.integrate.rules.proved_orders import Region
from potto.kernels.cells import Cell, Value
from potto.kernels.making import making

MOST_CELLS, MOST_NODES = 24, 60_000

# Where the cells are


class _NotPlain(Exception):
    """Something that this way does not provide for: a turning point, a surface that is 0 in a cell's middle."""


class Crowded(_NotPlain):
    """Cuts that are one another, or a bound, to rounding, as where a surface runs along the variable that it cuts; in
    another order of the variables they may be far apart."""


def _cells(
    plan: StraightIntegral, machine: Evaluator, env: dict[str, Value], frame: tuple[Cell, ...],
    ties: OnBounds | None = None,
) -> tuple[tuple[Stretch, ...], float]:  # fmt: skip
    """The cells between the cuts, with the integrand on each; those on which it is 0 left out. And the least length.

    frame: the bounds and cuts of the outermost variable. ties: what to do with cuts that lie on bounds.
    """
    moves = machine.costs is not None or ties is not None
    tracked = machine.with_directions(machine.directions if moves else 0).tracking()
    cells: list[Stretch] = []
    here, shortest = dict(env), math.inf
    for path, least in _paths(plan, tracked, here, frame, ties, ()):
        shortest = min(shortest, least)
        face = plan.face(_sides(plan, tracked, here))
        dark = vanishes(face)
        if machine.costs is not None:
            machine.costs.stretches(1, 0 if dark else 1)
        if not dark:
            cells.append(Stretch(path, face))
    return tuple(cells), shortest


def _paths(
    plan: StraightIntegral, machine: Evaluator, here: dict[str, Value], frame: tuple[Cell, ...],
    ties: OnBounds | None, path: Path,
) -> Iterator[tuple[Path, float]]:  # fmt: skip
    """Between which rows each cell within a path lies, while the variables are in its middle, and the least length of
    its stretches."""
    i = len(path)
    if i == len(plan.variables):
        yield path, math.inf
        return
    values = numbers_at(plan.frames[i], machine, here) if i else frame
    for low, high, middle, length in _stretches(plan, i, machine, values, ties):
        here[plan.variables[i]] = Cell(middle)
        for found, least in _paths(plan, machine, here, frame, ties, (*path, (low, high))):
            yield found, min(least, length or math.inf)


def _stretches(
    plan: StraightIntegral, i: int, machine: Evaluator, values: tuple[Cell, ...], ties: OnBounds | None
) -> list[tuple[int, int, float, float]]:
    """Between which rows of the frame one variable runs, the middles and the lengths, which are 0 between a bound and
    a cut that lies on it."""
    if machine.costs is not None:
        for surface, rows in plan.jumps[i]:
            roots = [(values[row].v, values[row].t) for row in rows]
            machine.costs.saw(surface, roots, values[0].v, values[1].v, machine.directions > 0)
    places = []
    for row, cell in enumerate(values):
        x, e = float(cell.v), float(cell.e or 0.0)
        if row > 1 and math.isnan(x):  # a root that is not there
            continue
        if not math.isfinite(x) or not math.isfinite(e):
            raise _NotPlain
        places.append((x, CLEAR * e, row))
    lo, hi, rest = places[0], places[1], places[2:]
    kept = [lo, *sorted(place for place in rest if not _outside(place, lo, hi))]
    if not plan.turning[i].isdisjoint(row for _, _, row in kept):
        raise _NotPlain
    if hi[0] - lo[0] <= lo[1] + hi[1]:
        raise _NotPlain
    kept.append(hi)
    if ties is not None:
        found = ties.stretches(plan, i, values, places, kept)
        if found is None:
            raise Crowded
        return found
    if any(b[0] - a[0] <= a[1] + b[1] for a, b in itertools.pairwise(kept)):
        raise Crowded
    return [(a[2], b[2], 0.5 * (a[0] + b[0]), b[0] - a[0]) for a, b in itertools.pairwise(kept)]


def _outside(place: Place, lo: Place, hi: Place) -> bool:
    """Whether a cut is beyond the bounds with all that it may be off.

    That of a surface all but parallel to the variable is far away, and as uncertain as it is far: a quotient whose
    divisor is hardly more than its rounding. Its reciprocal is known.
    """
    if place[0] < lo[0] - lo[1] - place[1] or place[0] > hi[0] + hi[1] + place[1]:
        return True
    away, half = abs(place[0] - 0.5 * (lo[0] + hi[0])), 0.5 * (hi[0] - lo[0]) + lo[1] + hi[1]
    return half * (away + place[1]) < away * away


def _sides(plan: StraightIntegral, machine: Evaluator, env: dict[str, Value]) -> tuple[bool, ...]:
    if not children(plan.surfaces.body):
        return ()
    sides = []
    for cell in numbers_at(plan.surfaces, machine, env):
        x = float(cell.v)
        if not abs(x) > CLEAR * float(cell.e or 0.0):
            raise _NotPlain
        sides.append(x > 0)
    return tuple(sides)


# The integral


def certain(plan: StraightIntegral, machine: Evaluator, env: dict[str, Value]) -> Sums | None:
    """The integral for one set of parameters; None where something about it is not plain. Raises Crowded."""
    try:
        found = _summed(plan, machine, env)
    except Crowded:
        raise
    except _NotPlain:
        return None
    return None if found is None else _sums(found)


def beside_bounds(plan: StraightIntegral, machine: Evaluator, env: dict[str, Value]) -> Tied | None:
    """The integral for one set of parameters at which cuts lie on bounds, to either side, and just there, where it has
    the derivative of one of them. None where something else about it is not plain.

    What lies between such a cut and its bound has the length 0, whether it is counted or not; how far off the value
    may be is the most that it is with it and without, since rounding hides which of them is right.
    """
    plan, values = _decided(plan, machine, env)
    if values is None or machine.frozen or machine.side or machine.costs is not None or machine.directions > 1:
        return None
    frame = numbers_at(plan.frames[0], machine.tracking(), env)
    ties = OnBounds()

    def total(inside: frozenset[Any]) -> MovingTotals:
        ties.inside = inside
        if (found := _between(plan, machine, env, frame, values, ties)) is None:
            raise _NotPlain
        return found

    try:
        _cells(plan, machine, env, frame, ties)  # meets them
        sides = [ties.towards(side) for side in (-1, 1)]
        backward, forward = map(total, sides)
    except _NotPlain:
        return None
    if sides != [ties.towards(side) for side in (-1, 1)]:  # more were met on the way
        return None
    near = backward if ties.lie_backward() else forward
    error = max(one.error[0] for one in (backward, forward))
    whole = MovingTotals(near.number, [error, *near.error[1:]], near.gross)
    return Tied(_sums(whole), _sums(backward), _sums(forward), ties.causes(plan))


def _between(
    plan: StraightIntegral, machine: Evaluator, env: dict[str, Value], frame: tuple[Cell, ...], values: dict[str,
    float], ties: OnBounds, ) -> MovingTotals | None:  # fmt: skip
    """The sum over the cells that there are where such cuts have come in as `ties` says."""
    reach, rtol = float(frame[1].v - frame[0].v), min(machine.rtol, LOOSEST)
    cells, shortest = _cells(plan, machine, env, frame, ties)
    if not cells:
        nothing = [0.0] * (1 + machine.directions)
        return MovingTotals(nothing, nothing, nothing)
    proof = _proved(plan, cells, values, reach, shortest, rtol)
    if proof is None:
        return None
    totals = summed(plan.variables, plan.frames, proof[0], machine, env, frame, ties.put)
    if totals is None:
        return None
    machine.count(totals.nodes)
    return accurate(totals, _truncation(plan, proof[0], machine.directions, env), machine.rtol, machine.atol)


def _proved(
    plan: StraightIntegral,
    cells: tuple[Stretch, ...],
    values: dict[str, float],
    reach: float,
    shortest: float,
    rtol: float,
) -> tuple[Region, Places] | None:
    """As `region_of`; None, too, where there are more cells or nodes than can be afforded."""
    proof = region_of(plan, cells, values, reach, shortest, rtol) if len(cells) <= MOST_CELLS else None
    few = proof is not None and sum(proof[0].outer) * math.prod(proof[0].inner) <= MOST_NODES
    return proof if few else None


def _sums(found: MovingTotals) -> Sums:
    block = np.array((found.number, found.error))[:, None, :, None]
    added = np.array([[found.gross[0]], [max(found.gross[1:], default=0.0)]])
    return Sums(block[0, :, 0], block[1, :, 0], block[0, :, 1:], block[1, :, 1:], gross=added)


def proved_sum(plan: StraightIntegral, machine: Evaluator, env: dict[str, Value]) -> MovingTotals | None:
    """The same as plain numbers, errors with what rules leave out; None where cuts are crowded, too."""
    try:
        return _summed(plan, machine, env)
    except _NotPlain:
        return None


def proved_gradient(
    plan: StraightIntegral, machine: Evaluator, env: Mapping[str, Cell], moving: Sequence[str]
) -> MovingTotals | None:
    """The value and its derivatives by the parameters in `moving`, swept back; None where the integral is not one of
    step functions, or something about it is not plain. machine: one without directions."""
    if plan.steps is None or _numbers(plan, env) is None or not _exact(plan, env):
        return None
    if machine.frozen or machine.side or machine.costs is not None:
        return None
    found = step_gradient(plan.steps, machine.tracking(), env, moving, min(machine.rtol, LOOSEST))
    whole = None if found is None else accurate(found, [0.0] * len(found.number), machine.rtol, machine.atol)
    if whole is not None:
        machine.count(whole.nodes)
    return whole


def _summed(plan: StraightIntegral, machine: Evaluator, env: dict[str, Value]) -> MovingTotals | None:
    if _numbers(plan, env) is None or machine.frozen or machine.side:
        return None
    if plan.steps is None or machine.costs is not None or not _exact(plan, env):
        return _by_region(plan, machine, env)
    if plan.stay is not None and (found := _staying(plan, plan.stay, machine, env)):
        return found
    if stepped := SteppedCall(plan.steps, machine.tracking()).at(env):
        machine.count(stepped.nodes)
        return stepped
    if step_cells(plan.steps, machine.tracking(), env).fine:
        return None  # one cell after the other would take the square of that, and leave as much
    return _by_region(plan, machine, env)


def _staying(plan: StraightIntegral, stay: Stay, machine: Evaluator, env: dict[str, Value]) -> MovingTotals | None:
    """The integral in a region that is settled, or is to be; None where step functions are to do it."""
    due = stay.due(env)
    if not due and _known(plan, machine, env) is None:
        return None
    if due:
        stay.paid()
    try:
        return _by_region(plan, machine, env)
    except _NotPlain:
        return None


def _by_region(plan: StraightIntegral, machine: Evaluator, env: dict[str, Value]) -> MovingTotals | None:
    """The sums over the cells that there are all over a region. Raises _NotPlain."""
    certain = machine.costs is None and _exact(plan, env)
    plan, values = _decided(plan, machine, env)
    if values is None:
        return None
    frame = numbers_at(plan.frames[0], machine.tracking(), env)
    reach, rtol = float(frame[1].v - frame[0].v), min(machine.rtol, LOOSEST)
    region = found.region if certain and (found := known(plan, values, reach, rtol)) else None
    if region is None:
        cells, shortest = _cells(plan, machine, env, frame)
        if not cells:
            nothing = [0.0] * (1 + machine.directions)
            return MovingTotals(nothing, nothing, nothing)
        proof = _proved(plan, cells, values, reach, shortest, rtol)
        if proof is None:
            return None
        region = proof[0]
        if certain:
            with making:
                settle(plan, *proof, values, reach, rtol)
    totals = summed_alone(plan, region, machine, env, frame)
    if totals is None:
        return None
    machine.count(totals.nodes)
    return accurate(totals, _truncation(plan, region, machine.directions, env), machine.rtol, machine.atol)


def _known(
    plan: StraightIntegral, machine: Evaluator, env: dict[str, Value]
) -> tuple[StraightIntegral, Settlement] | None:
    """The plan that these parameters decide on, and what is settled about them."""
    plan, values = _decided(plan, machine, env)
    if values is None or not plan.settled:
        return None
    low, high, *_ = numbers_at(plan.frames[0], machine.tracking(), env)
    found = known(plan, values, float(high.v - low.v), min(machine.rtol, LOOSEST))
    return None if found is None else (plan, found)


@np.errstate(all="ignore")
def settled(plan: StraightIntegral, machine: Evaluator, env: dict[str, Value]) -> SettledRegion | SteppedCall | None:
    """What is known of the integral for all parameters near these; None where that is not settled, or not yet."""
    if _numbers(plan, env) is None or machine.frozen or machine.side or machine.costs is not None:
        return None
    if not _exact(plan, env):
        return None
    by_steps = None if plan.steps is None else SteppedCall(plan.steps, machine.tracking(), plan.stay)
    if by_steps is not None and plan.stay is None:
        return by_steps
    settlement = _known(plan, machine, env)
    if settlement is None:
        return by_steps
    plan, found = settlement
    region = found.region
    faces = machine_code(plan, region, machine, env)
    awaited = promotion(plan, region, machine, env) if faces is None else None
    if awaited is not None and awaited.due:
        return None
    truncation = _truncation(plan, region, machine.directions, env)
    sums = RepeatedSum.of(plan, region, machine, env)
    return SettledRegion.of(plan, region, machine, found.box, truncation, faces, awaited, sums)


def _decided(
    plan: StraightIntegral, machine: Evaluator, env: dict[str, Value]
) -> tuple[StraightIntegral, dict[str, float] | None]:
    """The plan as these parameters decide its choices, and the parameters, if each is one finite number; None, too,
    where there are more choices than plans are made for."""
    values = _numbers(plan, env)
    if values is not None and plan.choices is not None:
        if len(children(plan.choices.body)) > MOST_CHOICES:
            return plan, None
        met = [float(cell.v) for cell in numbers_at(plan.choices, machine, env)]
        if not all(x in (0.0, 1.0) for x in met):
            return plan, None
        plan = plan.decided(tuple(x == 1.0 for x in met))
        values = {name: values[name] for name in plan.names}
    return plan, values


def _numbers(plan: StraightIntegral, env: Mapping[str, Value]) -> dict[str, float] | None:
    """The parameters, if each is one finite number."""
    values: dict[str, float] = {}
    for name in plan.names:
        cell = env.get(name)
        if not isinstance(cell, Cell):
            return None
        plain = cell.v.__class__ is float and cell.e is None and not cell.t  # as most are
        if (not plain and cell.arrays()) or not math.isfinite(cell.v):
            return None
        values[name] = float(cell.v)
    return values


def _exact(plan: StraightIntegral, env: Mapping[str, Any]) -> bool:
    """Whether nothing puts the parameters off."""
    return all(env[name].e is None for name in plan.names)


def _truncation(plan: StraightIntegral, region: Region, directions: int, env: Mapping[str, Any]) -> list[float]:
    """Bounds of what the rule leaves out of the value and of its tangents."""
    bounds = [region.error]
    for d in range(directions):
        speeds = {}
        for name, place in zip(region.radius, plan.names, strict=True):
            tangents = env[place].t
            t = tangents[d] if d < len(tangents) else None
            speeds[name] = 0.0 if t is None else float(t)
        bounds.append(region.rate(speeds))
    return bounds
