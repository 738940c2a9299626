"""What is known of an integral before any number: its levels, the kernels' terms, and the traces of its jumps.

Owns `Plan` and its cache. A plan is made once for an integral, the functions that it calls and the plain decisions
that were met on the way (which side of a recursion's condition, the bounds of a sum); it is used again as long as
those decisions come out the same.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from msgspec import Struct

from potto.calculus.algebra.degree import degree, plane
from potto.calculus.algebra.polytopes import Number
from potto.calculus.checking.solvability import monotone
from potto.calculus.decomposition.critical import MOST_EQUATIONS, slopes_of
from potto.calculus.decomposition.surface_cuts import Cut, along
from potto.calculus.decomposition.sweep import Level, sweep
from potto.calculus.differentiation.level_sets import LevelSet, placed_along
from potto.calculus.inlining.expand import expanded
from potto.calculus.inlining.unrolled import unrolled
from potto.calculus.solving.enclosable import slope_of
from potto.calculus.surfaces.branch_assignment import box_of as extents
from potto.calculus.surfaces.case_split import by_extremes
from potto.calculus.surfaces.discontinuities import Decide, Finding, Resolve, findings
from potto.calculus.surfaces.hoist import hidden, hoisted, split_at_bounds
from potto.calculus.surfaces.lifted import Lifted, lifted
from potto.calculus.surfaces.nested_brackets import has_nested, nested
from potto.core.terms import (
    App,
    Branch,
    Const,
    Deriv,
    If,
    Integral,
    Lam,
    Sum,
    Term,
    Tuple,
    Var,
    children,
    function_of,
    integral,
    neg,
    outside,
    postorder,
    prim,
    substitute,
    tuple_,
)  # fmt: skip
from potto.integrate.decomposition.vanishing import vanishing_of
from potto.integrate.fixed.boxes import Box, box_of
from potto.integrate.fixed.straight import Straight, straight
from potto.integrate.levels import HINT, RESTING, Group, LevelPlan
from potto.kernels.cells import Mask, Trace

NO_KINKS = function_of(tuple_(()))


class Plan(Struct, frozen=True, dict=True):
    """An integral, ready to be evaluated for any parameters.

    decisions: plain terms and the values that they had when the plan was made; it holds where they are the same.
    reaches: whether every jump is known of; if not, boundary terms may be missing.
    hides: whether there are jumps whose side can't be forced, though it is known where they are.
    surfaces: all that a box which nothing cuts has on one side. inlined: the integrand with calls carried out, where
    that can be done.
    doublings: how often its surfaces double what quadrature takes, about: up to three times each.
    straight: its terms where it can be integrated by rules that are proved to do, if the parameters let it.
    premise: what has to be positive for the plan to hold: for these parameters some cases are never met.
    confused: whether there are conditions inside of conditions that were not told apart.
    folds: whether a surface that is searched for may have folds where the variables further out can't be cut.
    degrees: of what is integrated over each variable between its cuts, where it is a polynomial in it.
    over: a level set, over whose roots the innermost variable is summed.
    kinks: what is 0 where builtins have kinks, as one tuple, without what is known to be 0 at single places alone;
    the last of them, so many as there are steps, where what parameters alone decide changes.
    """

    term: Integral
    levels: tuple[LevelPlan, ...]
    groups: tuple[Group, ...]
    body: Lam
    vanishing: Any
    decisions: tuple[tuple[Term, float | None], ...]
    reaches: bool = True
    hides: bool = False
    surfaces: tuple[Term, ...] = ()
    inlined: Term | None = None
    doublings: int = 0
    straight: Straight | None = None
    premise: Lam | None = None
    confused: bool = False
    folds: bool = False
    degrees: tuple[int | None, ...] = ()
    over: LevelSet | None = None
    kinks: Lam = NO_KINKS
    steps: int = 0

    @cached_property
    def box(self) -> Box | None:
        """How members of a batch are recognized that no surface cuts, where that can be told."""
        return None if self.inlined is None else box_of(self.term, self.surfaces, self.body, self.inlined)

    @cached_property
    def width(self) -> int:
        """How many numbers the integrand comes to, at the least: where it is 0 everywhere nothing else tells."""
        return _numbers(self.term.body if self.inlined is None else self.inlined)

    @cached_property
    def searches(self) -> int:
        """How many jumps are searched for, having no closed form in the variable that they cut; 0 where none would be.

        Each leaves, besides what it takes, unknown places further out where its roots merge.
        """
        return sum(cut.decides for level in self.levels for cut in level.searched)

    @property
    def mass(self) -> Term:
        """What tells how much of an infinite range matters."""
        return self.term.body if self.over is None else self.over.factor

    def trace(self, sides: Mapping[int, Mask]) -> Trace | None:
        """The trace that forces the groups to the sides given: a mask, true where the canonical surface is >= 0."""
        if not sides:
            return None
        trace: Trace = {}
        for group in self.groups:
            mask = sides.get(group.number)
            if mask is None:
                continue
            for jump in group.cut.jumps:
                if jump.path:
                    _force(trace, jump.path, mask if jump.orientation > 0 else np.logical_not(mask))
        return trace


def _numbers(body: Term) -> int:
    """How many numbers a term comes to, as far as it says so."""
    match body:
        case Tuple():
            return sum(map(_numbers, children(body)))
        case If() | Branch():
            return max(_numbers(body.then), _numbers(body.orelse))
        case _:
            return 1


def _force(trace: Trace, path: tuple[int, ...], mask: Mask) -> None:
    for at in path[:-1]:
        trace = trace.setdefault(at, {})
    trace[path[-1]] = mask


class _Asked:
    """What is asked of the surroundings while a plan is made: functions that are called, and plain decisions."""

    def __init__(self, resolve: Resolve, decide: Decide) -> None:
        self.resolve, self.decide = resolve, decide
        self.decisions: dict[Term, float | None] = {}
        self.unknown: set[Term] = set()

    def known(self, head: Term) -> Lam | Deriv | None:
        found = self.resolve(head)
        if found is None:
            self.unknown.add(head)
        return found

    def remember(self, plain: Term) -> float | None:
        if plain not in self.decisions:
            self.decisions[plain] = self.decide(plain)
        return self.decisions[plain]

    def findings(self, term: Term) -> Sequence[Finding]:
        """What an integrand jumps at, and where it bends; what is not known is what is met on the way."""
        self.unknown.clear()
        return findings(term, self.known, self.remember)


def make(term: Integral, resolve: Resolve, decide: Decide, inline: Resolve, number: Number) -> Plan:
    """The plan of an integral. `resolve` gives the functions that it calls, `decide` the values of plain terms.

    `inline` gives those of the functions that a call of them may be replaced by. `number` gives what a plain term is
    for some of the parameters, or nan.
    """
    asked = _Asked(resolve, decide)
    if placed_along(term) is not None:
        term = split_at_bounds(term, inline)  # while the level set still stands in it
    over = placed_along(term)
    term = by_extremes(term if over is None else integral(term.variables, term.bounds, over.weight, term.hints))
    found = asked.findings(term.body)
    premises: tuple[Term, ...] = ()
    confused = False
    if any(map(_may_be_mixed, found)) or any(has_nested(i.body) for i in _inner_integrals(term)):
        apart = _apart(term, inline, asked.remember, number)
        if apart is not None:
            term, premises = apart.term, apart.premises
            found = asked.findings(term.body)
        confused = apart is None or any(nested(f.surface) for f in found if f.kind == "jump")
    hides = hidden(term, found, resolve)
    if asked.unknown or hides:
        term = hoisted(term, inline)
        found = asked.findings(term.body)
        hides = hidden(term, found, resolve)
    reaches = not asked.unknown
    levels, groups = group_levels(sweep(term, found, resolve, asked.remember, True, over).levels)
    body = function_of(term.body)
    inlined = _inlined(term, inline) if reaches and not hides and over is None else None
    return Plan(
        term,
        levels,
        groups,
        body,
        vanishing_of(
            term.body, {j.path: (g.number, j.orientation) for g in groups for j in g.cut.jumps}, resolve=resolve
        ),
        tuple((t, v) for t, v in asked.decisions.items() if not isinstance(t, Const)),
        reaches,
        hides or over is not None,
        tuple(dict.fromkeys(f.surface for f in found if f.kind != "step")),
        inlined,
        _doublings(term, found),
        None if inlined is None else straight(term, inlined, levels),
        _premise(premises),
        confused,
        _may_fold(term, levels),
        () if inlined is None else _degrees(inlined, levels),
        over,
        *_kinks(term, found, asked),
    )


def _kinks(term: Integral, found: Iterable[Finding], asked: _Asked) -> tuple[Lam, int]:
    """Where an integrand, and what it is integrated over, have kinks that may lie along a stretch, and how many of
    these are steps of parameters alone."""
    box, names = extents(term), frozenset(term.variables)
    inside = (*found, *(f for pair in term.bounds for bound in pair for f in asked.findings(bound)))
    kinks = dict.fromkeys(f.surface for f in inside if f.kind == "kink")
    along = tuple(k for k in kinks if not any(monotone(k, v, box) for v in term.variables))
    jumps = dict.fromkeys(f.surface for f in inside if f.kind in ("jump", "step") and not f.surface.free & names)
    steps = tuple(step for step in jumps if step not in kinks)
    return function_of(tuple_((*along, *steps))), len(steps)


def _degrees(body: Term, levels: Sequence[LevelPlan]) -> tuple[int | None, ...]:
    """The degree of what is integrated over each variable: of a polynomial between planes it is one, of a degree that
    each variable raises by one."""
    found: list[int | None] = []
    variables = [level.variable for level in levels]
    for number in range(len(levels)):
        inner = levels[number + 1 :]
        own = degree(body, variables[number:])
        surfaces = (t for level in inner for t in (level.level.lo, level.level.hi, *map(along, level.level.cuts)))
        flat = all(level.level.complete for level in inner) and all(plane(t, variables[number:]) for t in surfaces)
        found.append(own + len(inner) if own is not None and flat else None)
    return tuple(found)


def _doublings(term: Integral, found: Sequence[Finding]) -> int:
    """How often the surfaces of an integral double what quadrature takes, about."""
    surfaces = {f.surface for f in found if f.kind not in ("center", "critical")}
    return sum(min(3, len(surface.free.intersection(term.variables))) for surface in surfaces)


def _inlined(term: Integral, inline: Resolve) -> Term:
    """The integrand with calls of known functions carried out."""
    passed = {n.name: f for n in postorder(term.body) if isinstance(n, Var) and (f := inline(n)) is not None}
    return expanded(substitute(term.body, passed), inline)


def _may_fold(term: Integral, levels: Sequence[LevelPlan]) -> bool:
    """Whether roots that are searched for may appear or merge where the variables further out can't be cut."""
    number = max((n for n, level in enumerate(levels) if any(cut.decides for cut in level.searched)), default=0)
    if not number:
        return False
    bounds = extents(term)
    inner = [(cut, level.variable) for level in levels[1:] for cut in level.searched if cut.decides]
    if all(monotone(cut.surface, variable, bounds) for cut, variable in inner):
        return False
    systems = [(system, level.variable) for level in levels[:number] for system in level.level.critical]
    return (
        number >= MOST_EQUATIONS
        or any(slope_of(along(cut), variable) is None for cut, variable in inner)
        or any(slopes_of(system, variable) is None for system, variable in systems)
    )


def _inner_integrals(term: Integral) -> Iterable[Integral]:
    """The integrals inside of an integrand: a condition of theirs jumps as the brackets in it fall, here as well."""
    return (node for node in postorder(term.body) if isinstance(node, Integral))


def _may_be_mixed(found: Finding) -> bool:
    """Whether a surface may be several, as conditions inside of it fall, or has a sum that is to be written out."""
    parts = outside(found.surface, (Integral, Sum, Lam)) if found.kind == "jump" else ()
    return any(isinstance(part, Branch | App | Sum | If) for part in parts)


def _apart(term: Integral, inline: Resolve, decide: Decide, number: Number) -> Lifted | None:
    """The integral with the conditions that stand in conditions taken out of them; None if there are too many cases."""
    body = unrolled(term.body, inline, decide)
    if body is None:
        return None
    return lifted(integral(term.variables, term.bounds, body, term.hints), number)


def _premise(premises: tuple[Term, ...]) -> Lam | None:
    """The least of what has to be positive."""
    if not premises:
        return None
    return function_of(premises[0] if len(premises) == 1 else prim("min", *premises))


def group_levels(levels: Sequence[Level]) -> tuple[tuple[LevelPlan, ...], tuple[Group, ...]]:
    """The terms of all variables, outermost first, and the surfaces with jumps that cut them."""
    groups: list[Group] = []
    plans: list[LevelPlan] = []
    for level in levels:
        decided = []
        for cut in level.cuts:
            if cut.decides:
                decided.append(len(groups))
                groups.append(Group(len(groups), cut))
        plans.append(level_plan(level, tuple(decided), groups))
    return tuple(plans), tuple(groups)


def level_plan(level: Level, decided: tuple[int, ...], groups: Sequence[Group]) -> LevelPlan:
    """The terms of one variable; `decided` are the numbers of the groups among its cuts."""
    terms: list[Term] = [level.lo, level.hi]
    rows: list[tuple[int, bool]] = []  # (which cut, HINT or RESTING; whether turning)
    families: list[tuple[int, Any]] = []
    searched: list[Cut] = []
    for number, cut in enumerate(level.cuts):
        if cut.roots is None:
            searched.append(cut)
            continue
        for root in cut.roots:
            terms.append(root)
            rows.append((number, cut.turning))
        families.extend((number, family) for family in cut.families)
    for kind, places in ((HINT, level.hints), (RESTING, level.edges)):
        terms.extend(places)
        rows.extend((kind, False) for _ in places)
    deciding, turned = _deciding(decided, groups)
    surfaces = function_of(tuple_(deciding))
    return LevelPlan(
        level,
        function_of(tuple_(tuple(terms))),
        tuple(rows),
        tuple(searched),
        tuple(families),
        decided,
        surfaces,
        turned,
    )


def _deciding(
    decided: tuple[int, ...], groups: Sequence[Group]
) -> tuple[tuple[Term, ...], tuple[tuple[int, ...], ...]]:
    """Per group what tells the side, and the groups further out whose lower sides turn it round.

    A factor that does not vary with the variable has its side decided where it does: at a node beside the place where
    it is 0, its own value may be rounding.
    """
    known = {g.cut.key: g.number for g in groups}
    terms: list[Term] = []
    turned: list[tuple[int, ...]] = []
    for number in decided:
        cut = groups[number].cut
        if cut.product is None:
            terms.append(cut.surface)
            turned.append(())
            continue
        rest = [f.form for f in cut.product.outer if f.key not in known]
        term = prim("mul", cut.product.along, *rest) if rest else cut.product.along
        terms.append(term if cut.product.sign > 0 else neg(term))
        turned.append(tuple(known[f.key] for f in cut.product.outer if f.key in known))
    return tuple(terms), tuple(turned)
