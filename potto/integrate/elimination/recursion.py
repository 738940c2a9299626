"""Integrals over many variables as integrals over one, each of a table of the one before.

Owns `one_by_one`, the numbers of what `step_plans` says. What each step leaves in the number that it depends on, the
places where a surface enters or leaves the bounds, are the pieces of its table, and the cuts of the next step.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache

import numpy as np
from msgspec.structs import replace

from potto.calculus.algebra.affine import affine
from potto.calculus.algebra.ranges import ValueRange, range_of
from potto.calculus.decomposition.distributions import ends_of, extremes, hints_of
from potto.calculus.decomposition.elimination import Distribution, EliminationStep
from potto.core.simplify import simplify
from potto.core.terms import ZERO, Lam, Term, add, function_of, if_, mul, prim, substitute, var
from potto.integrate.adaptive.iterated import Iteration
from potto.integrate.decomposition.cuts import Cuts
from potto.integrate.decomposition.effective_range import reaches
from potto.integrate.degenerate.degeneracies import beside, jumps
from potto.integrate.elimination.interpolants import InterpolantTable, concentration, tabulated
from potto.integrate.elimination.step_plans import HIGH, LOW, Eliminated
from potto.integrate.events import SurfaceFold, TwoSided
from potto.integrate.levels import LevelPlan
from potto.integrate.pieces import Evaluator, Sums, box_of_numbers, still
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

# How much wider than the range of an extreme, as a part of it, its density is integrated over: it jumps at the ends,
# and a jump that lies on a bound can't be told from one that moves past it.
MARGIN = 2.0**-10

# Where rules look at a density, in deviations, as at a normal one; farther out it may fall more slowly.
WIDE = (-8.0, -3.0, 0.0, 3.0, 8.0, 24.0, 72.0)

Ranges = Mapping[str, tuple[float, float]]
Tables = tuple[InterpolantTable, ...]  # whose sum a density is


class _Tabled(Iteration):
    """The integral of one step: weight times what is further in, by its table, or the number that it is, and times
    densities, each the sum of some tables at a place."""

    further: InterpolantTable | Cell | None = None
    densities: tuple[Tables, ...] = ()

    def body(self, env: dict[str, Value], sides: dict[int, Mask], machine: Evaluator) -> Value:
        tracking, k, wide = machine.tracking(), self.machine.directions, machine.directions
        found = super().body(env, sides, tracking)
        weight, *places = found if isinstance(found, tuple) else (found,)
        given: dict[str, Value] = {"weight": weight}
        if self.further is not None:
            passed = places.pop(0) if isinstance(self.further, InterpolantTable) else None
            given["further"] = _at(self.further, passed, k, wide)
        for number, (tables, place) in enumerate(zip(self.densities, places, strict=True)):
            for part, table in enumerate(tables):
                given[_summand(number, part)] = _at(table, place, k, wide)
        form = _weighted(self.further is not None, tuple(map(len, self.densities)))
        return tracking.evaluate(form, given, None) if len(given) > 1 else weight


def _summand(density: int, part: int) -> str:
    return f"density{density}.{part}"


def _at(further: InterpolantTable | Cell, place: Value | None, k: int, wide: int) -> Value:
    """What a table holds for numbers, or the number that it is."""
    if isinstance(further, InterpolantTable):
        assert isinstance(place, Cell)
        further = further.at(place, k, wide)
    return pad(further, wide)


@lru_cache(maxsize=64)
def _weighted(further: bool, counts: tuple[int, ...]) -> Lam:
    """The weight times what is further in, and densities, of so many parts each: 0 where one of them is, whatever the
    others are."""
    below = [var("further")] if further else []
    densities = [add(*(var(_summand(i, part)) for part in range(count))) for i, count in enumerate(counts)]
    value = mul(var("weight"), *below, *densities)
    for factor in (var("weight"), *densities):
        value = if_(prim("eq", factor, ZERO), ZERO, value)
    return function_of(value)


def one_by_one(
    known: Eliminated, plan: Plan, machine: Evaluator, env: dict[str, Value], affordable: int = AFFORDABLE
) -> Sums | None:  # fmt: skip
    """The integral, each step from the table of the next; None where one can't be made, or it takes more evaluations
    than can be afforded. plan: of the integral as a whole, which tells how much of an infinite range matters."""
    found, left_out = reaches(plan, env, range(len(plan.levels)))
    ranges = {name: (float(low[0]), float(high[0])) for name, (low, high) in found.items()}
    settings, best, least = machine.settings, None, math.inf
    most = min(settings.max_evals, int(machine.spent) + affordable)
    for share in SHARES:
        finer = replace(settings, rtol=max(share * settings.rtol, FINEST), atol=0.0, max_evals=most)
        sums = _passed_on(known, machine.changed(settings=finer), env, ranges, {})
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
    known: Eliminated,
    fine: Evaluator,
    env: dict[str, Value],
    ranges: Ranges,
    tables: dict[str, Tables],
    first: tuple[float, float] | None = None,
) -> Sums | InterpolantTable | None:
    """The integral by tables that are as accurate, as a part of their largest values, as `fine` asks for; None where
    one can't be made. A table of it, where the first step has a state, which is in the range `first`.

    ranges: of variables whose range is infinite, what matters of it. tables: of the densities that were needed so far,
    by the names of the numbers.
    """
    spans, own = _spans(known.steps, env, ranges, first)
    env = {**env, **own}
    further: InterpolantTable | Cell | None = None
    sums: Sums | None = None
    rows = zip(known.steps, known.plans, known.states, known.densities, spans, strict=True)
    for step, plan, state, densities, span in reversed(list(rows)):
        for (distribution, _), summands in zip(step.densities, densities, strict=True):
            if not _density(distribution.variable, summands, fine, env, ranges, tables):
                return None
        beside = tuple(tables[distribution.variable] for distribution, _ in step.densities)
        below = [further] if isinstance(further, InterpolantTable) else []
        most = math.prod(sum(table.largest for table in parts) for parts in (below, *beside) if parts)
        alone = _Tabled(plan, fine, START_ORDER, tracked=True, further_in=most, further=further, densities=beside)
        if state is None:
            sums = alone.run(0, env, 1, {}, fine)
            (further,) = sums.cells(())
        else:  # as one inside another: how much each may err is measured by the largest of all
            inside = replace(plan, outline=replace(plan.outline, levels=(state, *plan.levels)))
            further = _table(replace(alone, plan=inside, first=1), state, span, fine, env, even=not ranges)
            if further is None or fine.exhausted():
                return None
        if not all(table.seen for parts in (below, *beside) for table in parts):
            return None
    return further if isinstance(further, InterpolantTable) else sums


def _density(
    variable: str,
    summands: Sequence[Eliminated],
    fine: Evaluator,
    env: dict[str, Value],
    ranges: Ranges,
    tables: dict[str, Tables],
) -> bool:
    """Whether there are tables whose sum is the density of a number, made here where there were none; with them it is
    known where rules look at it."""
    if variable not in tables:
        found: list[InterpolantTable] = []
        low, high = (float(np.ravel(end.v)[0]) for name in ends_of(variable) if isinstance(end := env[name], Cell))
        for known in summands:
            table = _passed_on(known, fine, env, ranges, tables, (low, high))
            if not isinstance(table, InterpolantTable):
                return False
            found.append(table)
        tables[variable] = tuple(found)
    for name, parts in tables.items():  # also of numbers that this one is made of: they have left places
        env.update(zip(hints_of(name), _hints(parts), strict=True))
    return True


def _hints(tables: Sequence[InterpolantTable]) -> Iterator[Cell]:
    """Where rules look at a number of whose density some tables are the sum."""
    mean, deviation = concentration(tables)
    return (Cell(mean + many * deviation) for many in WIDE)


def _table(
    iteration: Iteration, state: LevelPlan, span: tuple[float, float], machine: Evaluator, env: dict[str, Value],
    even: bool,
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
        together = np.zeros(x.size, dtype=np.int64)  # what single nodes meet does not matter
        apart = wide.apart()
        sums = iteration.run(1, {**here, state.variable: Cell(x, None, tuple(speeds))}, x.size, {}, apart, together)
        if not len(speeds):  # at the ends of pieces: derivatives are not asked for
            apart.events.forget(SurfaceFold, TwoSided)
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
    places = beside(ends)
    values = function(places, np.zeros((0, places.size))).v
    return bool(jumps(values.reshape(values.shape[0], -1, ends.size)).any())


def _spans(
    steps: Sequence[EliminationStep], env: dict[str, Value], ranges: Ranges, first: tuple[float, float] | None
) -> tuple[list[tuple[float, float]], dict[str, Value]]:
    """Between which numbers the state of each step is, as far as it matters; and the ends of the ranges of variables
    that have densities, under their names."""
    box = box_of_numbers(env)
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
        for distribution, _ in step.densities:
            _find_ends(distribution, box, ranges, own)
        box[step.variable] = ranges.get(step.variable) or _hull(range_of(step.lo, box), range_of(step.hi, box))
        before = step
    return spans, own


def _find_ends(
    distribution: Distribution, box: dict[str, tuple[float, float]], ranges: Ranges, own: dict[str, Value]
) -> None:
    """Puts the ends of the range of a number where they are looked for, those of numbers that it is made of first."""
    low, high = ends_of(distribution.variable)
    if low in box:
        return
    for _, steps in distribution.densities:
        for inner in (inner for step in steps for inner, _ in step.densities):
            _find_ends(inner, box, ranges, own)
    for name, end in zip((low, high), _reached(distribution, box, ranges), strict=True):
        box[name], own[name] = (end, end), Cell(end)


def _reached(density: Distribution, box: Mapping[str, tuple[float, float]], ranges: Ranges) -> tuple[float, float]:
    """Between which numbers one is that others make up, as far as it matters."""
    inside = dict(box)
    for variable, (lo, hi) in zip(density.over.variables, density.over.bounds, strict=True):
        inside[variable] = ranges.get(variable) or _hull(range_of(lo, inside), range_of(hi, inside))
    found = range_of(density.number, inside)
    margin = MARGIN * (found.hi - found.lo) if extremes(density.number) else 0.0
    return found.lo - margin, found.hi + margin


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
