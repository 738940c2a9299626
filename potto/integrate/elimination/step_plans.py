"""What is known of the steps by which variables are eliminated, before any number.

Owns `Eliminated` and `eliminated`: the plan of each step, and the places where what it comes to is not smooth in the
number that it depends on. What its factors that are tables hide, their kinks and peaks, is handed on to it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import partial

from msgspec import Struct
from msgspec.structs import replace

from potto.calculus.decomposition.distributions import extremes, hints_of
from potto.calculus.decomposition.elimination import Distribution, EliminationStep, eliminate
from potto.calculus.decomposition.surface_cuts import MOST_CENTERS, cut_along, points_of
from potto.calculus.decomposition.sweep import Level, sweep
from potto.calculus.surfaces.case_split import cased
from potto.calculus.surfaces.discontinuities import TooDeep, findings
from potto.calculus.surfaces.finding import Finding, Kind, Resolve
from potto.core.terms import (
    Deriv,
    Integral,
    Lam,
    Term,
    Tuple,
    function_of,
    integral,
    replaced,
    sub,
    substitute,
    tuple_,
    var,
)
from potto.integrate.decomposition.vanishing import vanishing_of
from potto.integrate.levels import LevelPlan, group_levels, level_plan
from potto.integrate.outline import Outline
from potto.integrate.plan import Plan
from potto.primitives import PRIMITIVES

MOST_PLACES = 64  # where the integral over one variable is not smooth in the number that it depends on

# The names of the least and the largest that a state may be.
LOW, HIGH = "#low", "#high"
# A place in the state of a step, as a surface, and what is there.
Place = tuple[Term, Kind]


class Eliminated(Struct, frozen=True):
    """The steps, outermost first: the plan of each, and the state that it depends on as a variable from LOW to HIGH,
    cut where its integral is not smooth, with hints where it has a peak; None where it depends on none. densities: of
    each, for every density that it has as a factor, the steps of its summands."""

    steps: tuple[EliminationStep, ...]
    plans: tuple[Plan, ...]
    states: tuple[LevelPlan | None, ...]
    densities: tuple[tuple[tuple[Eliminated, ...], ...], ...]


def eliminated(term: Integral, resolve: Resolve) -> Eliminated | None:
    """What is known of an integral's steps; None where it has none."""
    steps = eliminate(term)
    found = None if steps is None else _known(term, steps, resolve)
    return None if found is None else found[0]


def _known(
    term: Integral, steps: Sequence[EliminationStep], resolve: Resolve
) -> tuple[Eliminated, tuple[Place, ...]] | None:
    """What is known of steps, and where what they come to is not smooth in the state that the first one begins with."""
    rows: list[tuple[Plan, LevelPlan | None, tuple[tuple[Eliminated, ...], ...]]] = []
    further: tuple[Place, ...] = ()
    state = ""
    for step in reversed(steps):
        beside = [] if step.passed is None else [*_put(further, state, step.passed)]
        densities: list[tuple[Eliminated, ...]] = []
        for distribution, at in step.densities:
            known = [_known(own, chain, resolve) for own, chain in distribution.densities]
            found = [density for density in known if density is not None]
            if len(found) < len(known):
                return None
            densities.append(tuple(own for own, _ in found))
            places = dict.fromkeys(place for _, own in found for place in own)
            beside += _put((*places, *_peaks(distribution, step)), distribution.variable, at)
        try:
            planned = _planned(step, beside, resolve, _centers(term, step.variable, resolve))
        except TooDeep:
            return None
        if planned is None or len(planned[1]) > MOST_PLACES:
            return None
        plan, further = planned
        state = step.state or ""
        rows.append((plan, _state(state, further) if state else None, tuple(densities)))
    plans, states, inner = zip(*reversed(rows), strict=True)
    return Eliminated(tuple(steps), plans, states, inner), further


def _peaks(distribution: Distribution, step: EliminationStep) -> Iterator[Place]:
    """Where a number may be concentrated, where a step is not over this number itself, which has hints of its own."""
    if not step.over(distribution):
        for hint in hints_of(distribution.variable):
            yield sub(var(distribution.variable), var(hint)), "center"


def _put(places: Iterable[Place], state: str, passed: Term) -> Iterator[Place]:
    """Where a number comes to a place that is handed on: of a greatest or a least, where one of those does that it is
    of. Where two of them are the same is a kink of its own; as one surface all would be crossed with one another."""
    for at, kind in places:
        waiting = [substitute(at, {state: passed})]
        while waiting:
            surface = waiting.pop()
            if not (chosen := extremes(surface)):
                yield surface, kind
            else:
                bent = chosen[0]
                _, *values = PRIMITIVES[bent.op].cases(*bent.args)  # type: ignore[misc]
                waiting += (replaced(surface, {bent: value}) for value in values)


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
    parts = [step.weight, *([] if step.passed is None else [step.passed]), *(at for _, at in step.densities)]
    body = tuple_(tuple(parts)) if len(parts) > 1 else step.weight
    own = any(step.over(distribution) for distribution, _ in step.densities)
    hints = tuple(map(var, hints_of(step.variable))) if own else ()
    term = cased(integral((step.variable,), ((step.lo, step.hi),), body, (hints,)))
    body = term.body
    weight = body.items[0] if len(parts) > 1 and isinstance(body, Tuple) else body
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
