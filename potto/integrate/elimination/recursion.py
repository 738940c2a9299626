"""Integrals over many variables as integrals over one, each of a table of the one before.

Owns `Eliminated`, `eliminated` (what is known of the steps before any number) and `one_by_one` (the numbers). What each
step leaves in the number that it depends on, the places where a surface enters or leaves the bounds, are the pieces of
its table, and the cuts of the next step.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import lru_cache, partial
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from potto.calculus.algebra.affine import affine
from potto.calculus.algebra.ranges import ValueRange, range_of
from potto.calculus.decomposition.distributions import ends_of, hints_of
from potto.calculus.decomposition.elimination import Distribution, EliminationStep, eliminate
from potto.calculus.decomposition.surface_cuts import MOST_CENTERS, cut_along, points_of
from potto.calculus.decomposition.sweep import Level, sweep
from potto.calculus.surfaces.case_split import cased
from potto.calculus.surfaces.discontinuities import TooDeep, findings
from potto.calculus.surfaces.finding import Finding, Kind, Resolve
from potto.core.simplify import simplify
from potto.core.terms import (
    ZERO,
    Deriv,
    Integral,
    Lam,
    Term,
    Tuple,
    add,
    function_of,
    if_,
    integral,
    mul,
    prim,
    substitute,
    tuple_,
    var,
)
from potto.integrate.adaptive.iterated import Iteration
from potto.integrate.decomposition.cuts import Cuts
from potto.integrate.decomposition.effective_range import reaches
from potto.integrate.decomposition.vanishing import vanishing_of
from potto.integrate.degenerate.degeneracies import BESIDE, does_jump
from potto.integrate.elimination.interpolants import InterpolantTable, concentration, tabulated
from potto.integrate.events import Fold, TwoSided
from potto.integrate.levels import LevelPlan, group_levels, level_plan
from potto.integrate.outline import Outline
from potto.integrate.pieces import Evaluator, Sums, still
from potto.integrate.plan import Plan
from potto.integrate.rules.gauss import EPS
from potto.kernels.cells import Array, Cell, Mask, Value, pad

START_ORDER = 16
# The accuracy of each step as a part of what is asked for, and where that does not do: what a step leaves may be far
# larger where it hardly counts, as the greater one of two numbers is far out.
SHARES = (0.02, 0.001)
MOST_LACKING = 50  # times what is asked for, up to which a smaller share is enough
FINEST = 1e-14
AFFORDABLE = 3_000_000  # evaluations, a few seconds: more than that is no good use of one number, and not waited for
FARTHEST = np.finfo(float).max
SLIVER = 16  # roundings of its ends, that a piece of a table is longer than
MOST_PLACES = 64  # where the integral over one variable is not smooth in the number that it depends on

# Where rules look at a density, in deviations, as at a normal one; farther out it may fall more slowly.
WIDE = (-8.0, -3.0, 0.0, 3.0, 8.0, 24.0, 72.0)

# The names of the least and the largest that a state may be.
LOW, HIGH = "#low", "#high"
# A place in the state of a step, as a surface, and what is there.
Place = tuple[Term, Kind]
Ranges = Mapping[str, tuple[float, float]]


class Eliminated(Struct, frozen=True):
    """The steps, outermost first: the plan of each, and the state that it depends on as a variable from LOW to HIGH,
    cut where its integral is not smooth, with hints where it has a peak; None where it depends on none. densities: of
    each the steps of the summands of its density, if it has one."""

    steps: tuple[EliminationStep, ...]
    plans: tuple[Plan, ...]
    states: tuple[LevelPlan | None, ...]
    densities: tuple[tuple[Eliminated, ...], ...]


def eliminated(term: Integral, resolve: Resolve) -> Eliminated | None:
    """What is known of an integral's steps; None where it has none."""
    steps = eliminate(term)
    found = None if steps is None else _known(term, steps, resolve)
    return None if found is None else found[0]


def _known(
    term: Integral, steps: Sequence[EliminationStep], resolve: Resolve
) -> tuple[Eliminated, tuple[Place, ...]] | None:
    """What is known of steps, and where what they come to is not smooth in the state that the first one begins with."""
    rows: list[tuple[Plan, LevelPlan | None, tuple[Eliminated, ...]]] = []
    further: tuple[Place, ...] = ()
    state = ""
    for step in reversed(steps):
        chains = () if step.density is None else step.density.densities
        densities = [_known(own, below, resolve) for own, below in chains]
        known = [density for density in densities if density is not None]
        passed = () if step.passed is None else ((substitute(at, {state: step.passed}), kind) for at, kind in further)
        beside = [*passed, *(place for _, places in known for place in places)]
        try:
            found = _planned(step, beside, resolve, _centers(term, step.variable, resolve))
        except TooDeep:
            return None
        if found is None or len(known) < len(densities) or len(found[1]) > MOST_PLACES:
            return None
        plan, further = found
        state = step.state or ""
        rows.append((plan, _state(state, further) if state else None, tuple(own for own, _ in known)))
    plans, states, inner = zip(*reversed(rows), strict=True)
    return Eliminated(tuple(steps), plans, states, inner), further


def _state(name: str, places: Sequence[Place]) -> LevelPlan:
    """The number that a step depends on as a variable, cut at places."""
    cuts = tuple(replace(cut_along(at, name), turning=kind == "edge", steps=kind == "jump")
                 for at, kind in places if kind != "center")  # fmt: skip
    hints = points_of((at for at, kind in places if kind == "center"), name)[:MOST_CENTERS]
    return level_plan(Level(name, var(LOW), var(HIGH), hints, cuts), (), ())


def _planned(
    step: EliminationStep, beside: Sequence[Place], resolve: Resolve, centers: Iterable[Finding]
) -> tuple[Plan, tuple[Place, ...]] | None:
    """The plan of one step, and where its integral is not smooth in its state.

    beside: where its factors are not that come from tables. centers: further ones that the variable has.
    """
    body = step.weight if step.passed is None else tuple_((step.weight, step.passed))
    hints = () if step.density is None else tuple(map(var, hints_of(step.variable)))
    term = cased(integral((step.variable,), ((step.lo, step.hi),), body, (hints,)))
    body = term.body
    weight = body.items[0] if step.passed is not None and isinstance(body, Tuple) else body
    unknown: set[Term] = set()

    def known(head: Term) -> Lam | Deriv | None:
        function = resolve(head)
        if function is None:
            unknown.add(head)
        return function

    found = [*(f for f in findings(body, known) if f.kind != "step"), *centers]
    if unknown or any(f.kind == "jump" and step.variable in f.surface.free and not f.path for f in found):
        return None
    found += (Finding(kind, surface) for surface, kind in beside)
    hides = any(kind == "jump" for _, kind in beside)  # a table can't be told which side to take
    steps = [f for f in found if f.kind == "jump" and step.variable not in f.surface.free]
    swept = sweep(term, (f for f in found if f not in steps), known, partial(findings, resolve=known))
    for cut in swept.levels[0].cuts:
        if cut.decides and cut.product:
            steps += (Finding("jump", factor.form) for factor in cut.product.outer)
    levels, groups = group_levels(swept.levels)
    numbers = {j.path: (g.number, j.orientation) for g in groups for j in g.cut.jumps}
    vanishing = vanishing_of(body, numbers, weight)
    plan = Plan(Outline(term, levels, groups, function_of(body), vanishing, hides), inlined=step.weight)
    places = (f for f in (*steps, *swept.outer) if f.critical is None)
    return plan, tuple((f.surface, f.kind) for f in places if step.state in f.surface.free)


def _centers(term: Integral, variable: str, resolve: Resolve) -> list[Finding]:
    """The centers that the integrand has in one variable, whatever the others are."""
    names = set(term.variables)
    return [f for f in findings(term.body, resolve) if f.kind == "center" and f.surface.free & names == {variable}]


class _Tabled(Iteration):
    """The integral of one step: weight times what is further in, by its table, or the number that it is, and times the
    density of the variable."""

    further: InterpolantTable | Cell | None = None
    densities: tuple[InterpolantTable, ...] = ()

    def body(self, env: dict[str, Value], sides: dict[int, Mask], machine: Evaluator) -> Value:
        tracking, k = machine.tracking(), self.machine.directions
        weight, passed = super().body(env, sides, tracking), None
        if isinstance(self.further, InterpolantTable):
            assert isinstance(weight, tuple)
            weight, passed = weight
        given: dict[str, Value] = {"weight": weight}
        if self.further is not None:
            given["further"] = _at(self.further, passed, k, machine.directions)
        for number, density in enumerate(self.densities):
            given[f"density{number}"] = _at(density, env[self.plan.levels[-1].level.variable], k, machine.directions)
        return tracking.evaluate(_weighted(tuple(given)[1:]), given, None) if len(given) > 1 else weight


def _at(further: InterpolantTable | Cell, passed: Value | None, k: int, wide: int) -> Value:
    """What a table holds for numbers, or the number that it is."""
    if isinstance(further, InterpolantTable):
        assert isinstance(passed, Cell)
        further = further.at(passed, k, wide)
    return pad(further, wide)


@lru_cache(maxsize=64)
def _weighted(names: tuple[str, ...]) -> Lam:
    """The weight times what is further in, and the sum of densities: 0 where the weight is, whatever these are."""
    further = [var(name) for name in names if name == "further"]
    densities = [add(*(var(name) for name in names if name != "further"))] if len(names) > len(further) else []
    return function_of(if_(prim("eq", var("weight"), ZERO), ZERO, mul(var("weight"), *further, *densities)))


def one_by_one(
    known: Eliminated, plan: Plan, machine: Any, env: dict[str, Value], affordable: int = AFFORDABLE
) -> Sums | None:  # fmt: skip
    """The integral, each step from the table of the next; None where one can't be made, or it takes more evaluations
    than can be afforded. plan: of the integral as a whole, which tells how much of an infinite range matters."""
    found, left_out = reaches(plan, env, range(len(plan.levels)))
    ranges = {name: (float(low[0]), float(high[0])) for name, (low, high) in found.items()}
    settings, best, least = machine.settings, None, math.inf
    most = min(settings.max_evals, int(machine.record.spent) + affordable)
    for share in SHARES:
        finer = replace(settings, rtol=max(share * settings.rtol, FINEST), atol=0.0, max_evals=most)
        sums = _passed_on(known, machine.changed(settings=finer), env, ranges)
        if not isinstance(sums, Sums):
            break
        sums.e += left_out
        sums.et += left_out
        lacking = _lacking(sums, settings.rtol, settings.atol)
        if best is None or lacking < least:
            best, least = sums, lacking
        if not 1 < lacking <= MOST_LACKING:
            break
    return best


def _lacking(sums: Sums, rtol: float, atol: float) -> float:
    """How many times larger errors are than was asked for."""
    with np.errstate(divide="ignore", invalid="ignore"):
        parts = [off / np.maximum(atol, rtol * np.abs(x)) for x, off in ((sums.v, sums.e), (sums.t, sums.et))]
    return max(float(np.nan_to_num(part, nan=0.0).max(initial=0.0)) for part in parts)


def _passed_on(
    known: Eliminated, fine: Any, env: dict[str, Value], ranges: Ranges, first: tuple[float, float] | None = None
) -> Sums | InterpolantTable | None:
    """The integral by tables that are as accurate, as a part of their largest values, as `fine` asks for; None where
    one can't be made. A table of it, where the first step has a state, which is in the range `first`.

    ranges: of variables whose range is infinite, what matters of it.
    """
    spans, own = _spans(known.steps, env, ranges, first)
    env = {**env, **own}
    further: InterpolantTable | Cell | None = None
    sums: Sums | None = None
    rows = zip(known.steps, known.plans, known.states, known.densities, spans, strict=True)
    for step, plan, state, summands, span in reversed(list(rows)):
        tables = _density(step, summands, fine, env, ranges)
        if tables is None:
            return None
        if tables:
            env.update(zip(hints_of(step.variable), _hints(tables), strict=True))
        below = [*tables, *([further] if isinstance(further, InterpolantTable) else [])]
        most = math.prod(table.largest for table in below)
        alone = _Tabled(plan, fine, START_ORDER, tracked=True, further_in=most, further=further, densities=tables)
        if state is None:
            sums = alone.run(0, env, 1, {}, fine)
            (further,) = sums.cells(())
        else:  # as one inside another: how much each may err is measured by the largest of all
            inside = replace(plan, outline=replace(plan.outline, levels=(state, *plan.levels)))
            further = _table(replace(alone, plan=inside, first=1), state, span, fine, env, even=not ranges)
            if further is None or fine.exhausted():
                return None
        if not all(table.seen for table in below):
            return None
    return further if isinstance(further, InterpolantTable) else sums


def _density(
    step: EliminationStep, summands: Sequence[Eliminated], fine: Any, env: dict[str, Value], ranges: Ranges
) -> tuple[InterpolantTable, ...] | None:
    """The tables whose sum is the density of the variable of a step; None where one can't be made."""
    low, high = ends_of(step.variable)
    found: list[InterpolantTable] = []
    for known in summands:
        ends = [float(np.ravel(end.v)[0]) for name in (low, high) if isinstance(end := env[name], Cell)]
        table = _passed_on(known, fine, env, ranges, (ends[0], ends[1]))
        if not isinstance(table, InterpolantTable):
            return None
        found.append(table)
    return tuple(found)


def _hints(tables: Sequence[InterpolantTable]) -> Iterator[Cell]:
    """Where rules look at a number of whose density some tables are the sum."""
    mean, deviation = concentration(tables)
    return (Cell(mean + many * deviation) for many in WIDE)


def _table(
    iteration: Iteration, state: LevelPlan, span: tuple[float, float], machine: Any, env: dict[str, Value], even: bool
) -> InterpolantTable | None:  # fmt: skip
    env = {**env, LOW: Cell(span[0]), HIGH: Cell(span[1])}
    found, _ = iteration.cut(state, env, 1, machine, np.zeros(1, dtype=np.int64))
    segments = found.segments
    size = np.fmin(np.maximum(np.abs(segments.a), np.abs(segments.b)), FARTHEST)
    segments = segments.pick(segments.b - segments.a > SLIVER * EPS * size)  # a span is rounded outwards

    def function(x: Array, speeds: Array) -> Sums:
        """Without speeds values alone."""
        wide = machine.with_directions(len(speeds))
        here = {name: pad(value, wide.directions) if len(speeds) else still(value) for name, value in env.items()}
        together = np.zeros(x.size, dtype=np.int64)  # what single nodes meet is no matter
        apart = wide.apart()
        sums = iteration.run(1, {**here, state.variable: Cell(x, None, tuple(speeds))}, x.size, {}, apart, together)
        if not len(speeds):  # at the ends of pieces: derivatives are not asked for
            apart.events.forget(Fold, TwoSided)
        machine.events.take(apart.events, None)
        return sums

    if found.conflict or not segments.a.size or (machine.directions and _jumps_at_an_end(found, function)):
        return None
    return tabulated(segments, machine.directions, function, machine.rtol, machine.exhausted, even)


def _jumps_at_an_end(found: Cuts, function: Callable[[Array, Array], Sums]) -> bool:
    """Whether what is further in jumps at an end of its range, where something moves past it: what comes in there has
    no place in a table."""
    ends = np.unique(np.concatenate([np.zeros(0), *(edge.x for edge in (*found.edges, *found.brushes))]))
    if not ends.size:
        return False
    aside = np.array(BESIDE)[:, None] * (1 + np.abs(ends))
    places = np.concatenate([ends + sign * a for a in aside for sign in (1.0, -1.0)])
    values = function(places, np.zeros((0, places.size))).v
    values = values.reshape(values.shape[0], -1, ends.size)
    above, below = values[:, 0::2], values[:, 1::2]
    return bool(does_jump(np.abs(above - below), np.abs(above[:, 1]) + np.abs(below[:, 1])).any())


def _spans(
    steps: Sequence[EliminationStep], env: dict[str, Value], ranges: Ranges, first: tuple[float, float] | None
) -> tuple[list[tuple[float, float]], dict[str, Value]]:
    """Between which numbers the state of each step is, as far as it matters; and the ends of the ranges of variables
    that have densities, under their names."""
    box: dict[str, tuple[float, float]] = {}
    for name, value in env.items():
        if isinstance(value, Cell):
            box[name] = (float(np.ravel(value.v)[0]),) * 2
    spans: list[tuple[float, float]] = []
    own: dict[str, Value] = {}
    before: EliminationStep | None = None
    for step in steps:
        span = (-np.inf, np.inf) if first is None or before is not None else first
        if step.state is not None and before is not None and before.passed is not None:
            span = _span(before, before.passed, box)
        if step.state is not None:
            box[step.state] = span
        spans.append(span)
        if step.density is not None:
            ends = _reached(step.density, box, ranges)
            for name, end in zip(ends_of(step.variable), ends, strict=True):
                box[name], own[name] = (end, end), Cell(end)
        box[step.variable] = ranges.get(step.variable) or _hull(range_of(step.lo, box), range_of(step.hi, box))
        before = step
    return spans, own


def _reached(density: Distribution, box: Mapping[str, tuple[float, float]], ranges: Ranges) -> tuple[float, float]:
    """Between which numbers one is that others make up, as far as it matters."""
    inside = dict(box)
    for variable, (lo, hi) in zip(density.over.variables, density.over.bounds, strict=True):
        inside[variable] = ranges.get(variable) or _hull(range_of(lo, inside), range_of(hi, inside))
    found = range_of(density.number, inside)
    return found.lo, found.hi


def _hull(a: ValueRange, b: ValueRange) -> tuple[float, float]:
    return min(a.lo, b.lo), max(a.hi, b.hi)


def _span(step: EliminationStep, passed: Term, box: dict[str, tuple[float, float]]) -> tuple[float, float]:
    """Between which numbers is what a step passes on: what is affine in the variable has its extremes at the bounds."""
    found, at_bounds = range_of(passed, box), _at_bounds(step, passed)
    if not at_bounds:
        return found.lo, found.hi
    ends = [range_of(end, box) for end in at_bounds]
    return max(found.lo, min(end.lo for end in ends)), min(found.hi, max(end.hi for end in ends))


@lru_cache(maxsize=1024)
def _at_bounds(step: EliminationStep, passed: Term) -> tuple[Term, ...]:
    """What is passed on at both bounds, where it is affine in the variable; else nothing."""
    if affine(passed, (step.variable,)) is None:
        return ()
    return tuple(simplify(substitute(passed, {step.variable: end})) for end in (step.lo, step.hi))
