"""What is known of an integral before any number: its levels, the kernels' terms, and the traces of its jumps.

Owns `Plan`, `make` and `numbers_in`. A plan is made once for an integral, the functions that it calls and the plain
decisions that were met on the way (which side of a recursion's condition, the bounds of a sum); it is used again as
long as those decisions come out the same.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from msgspec import Struct

from potto.calculus.algebra.degree import degree, plane
from potto.calculus.algebra.polytopes import Number
from potto.calculus.decomposition.surface_cuts import along
from potto.calculus.differentiation.level_sets import LevelSet, placed_along
from potto.calculus.inlining.expand import expanded
from potto.calculus.inlining.unrolled import loops_unrolled, unrolled
from potto.calculus.surfaces.discontinuities import findings, surfaces_below
from potto.calculus.surfaces.finding import Decide, Finding, Resolve
from potto.calculus.surfaces.hoist import hidden, hoisted, split_at_bounds
from potto.calculus.surfaces.lifted import Lifted, lifted
from potto.calculus.surfaces.nested_brackets import has_nested, nested
from potto.core.packing import packed, unpacked
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
    children,
    function_of,
    integral,
    outside,
    postorder,
    prim,
    substitute,
    var,
    with_integrand,
)  # fmt: skip
from potto.integrate.decomposition.dips import singular_at
from potto.integrate.decomposition.layers import exponents_of
from potto.integrate.decomposition.lines import Watched, watched
from potto.integrate.decomposition.vanishing import Vanishing
from potto.integrate.fixed.straight import StraightIntegral, straight
from potto.integrate.levels import Group, LevelPlan
from potto.integrate.outline import Outline, Outlines, outlined
from potto.kernels.cells import Mask, Trace

if TYPE_CHECKING:
    from potto.integrate.fixed.boxes.sides import Box


class Plan(Struct, frozen=True, dict=True):
    """An integral, ready to be evaluated for any parameters.

    decisions: plain terms and the values that they had when the plan was made; it holds where they are the same.
    reaches: whether every jump is known of; if not, boundary terms may be missing.
    inlined: the integrand with calls carried out and sums that jump written out, where that can be done.
    straight: its terms where it can be integrated by rules that are proved to do, if the parameters let it.
    premise: what has to be positive for the plan to hold: for these parameters some cases are never met.
    confused: whether there are conditions inside of conditions that were not told apart.
    degrees: of what is integrated over each variable between its cuts, where it is a polynomial in it.
    over: a level set, over whose roots the innermost variable is summed.
    """

    outline: Outline
    decisions: tuple[tuple[Term, float | None], ...] = ()
    reaches: bool = True
    inlined: Term | None = None
    straight: StraightIntegral | None = None
    premise: Lam | None = None
    confused: bool = False
    degrees: tuple[int | None, ...] = ()
    over: LevelSet | None = None

    def packed(self) -> bytes:
        """As bytes; those of the outline are made once. Of the integrand with calls carried out they tell whether there
        is one: it is made in the time in which it is read, and so are its straight terms. Raises TypeError where
        something in it is not data."""
        apart = ("outline", "inlined", "straight")
        own = {name: getattr(self, name) for name in self.__struct_fields__ if name not in apart}
        return packed([self.outline.packed, self.inlined is not None, own])

    @property
    def term(self) -> Integral:
        return self.outline.term

    @property
    def levels(self) -> tuple[LevelPlan, ...]:
        return self.outline.levels

    @property
    def groups(self) -> tuple[Group, ...]:
        return self.outline.groups

    @property
    def body(self) -> Lam:
        return self.outline.body

    @property
    def vanishing(self) -> Vanishing:
        return self.outline.vanishing

    @property
    def hides(self) -> bool:
        return self.outline.hides

    @property
    def surfaces(self) -> tuple[Term, ...]:
        return self.outline.surfaces

    @property
    def doublings(self) -> int:
        return self.outline.doublings

    @property
    def folds(self) -> bool:
        return self.outline.folds

    @property
    def kinks(self) -> Lam:
        return self.outline.kinks

    @property
    def steps(self) -> int:
        return self.outline.steps

    @cached_property
    def line(self) -> StraightIntegral | None:
        """The integral over the innermost variable alone, those further out being parameters, where its cuts are closed
        forms."""
        *_, last = self.levels
        if self.inlined is None or last.peaks:
            return None
        return straight(integral((last.variable,), self.term.bounds[-1:], self.term.body), self.inlined, (last,))

    @cached_property
    def exponents(self) -> tuple[Watched | None, ...]:
        """By variable what says where exponentials in the integrand have layers."""
        if self.over is not None:
            return (None,) * len(self.levels)
        names = frozenset(self.body.params)
        return tuple(exponents_of(self.mass, level.variable, names) for level in self.levels)

    @cached_property
    def singular(self) -> tuple[Watched | None, ...]:
        """By variable what the integrand is singular at 0 of, or nearly so beside it."""
        if self.over is not None:
            return (None,) * len(self.levels)
        names = frozenset(self.body.params)
        return tuple(watched(singular_at(self.mass), level.variable, names) for level in self.levels)

    @cached_property
    def box(self) -> Box | None:
        """How members of a batch are recognized that no surface cuts, where that can be told."""
        from potto.integrate.fixed.boxes.sides import box_of  # loaded for large batches

        return None if self.inlined is None else box_of(self.term, self.surfaces, self.body, self.inlined)

    @cached_property
    def width(self) -> int:
        """How many numbers the integrand comes to, at the least: where it is 0 everywhere nothing else tells."""
        return numbers_in(self.term.body if self.inlined is None else self.inlined)

    @cached_property
    def searches(self) -> int:
        """How many jumps are searched for, having no closed form in the variable that they cut; 0 where none would be.

        Each leaves, besides what it takes, unknown places further out where its roots merge.
        """
        return sum(cut.decides for level in self.levels for cut in level.searched)

    @property
    def mass(self) -> Term:
        """What tells how much of an infinite range matters; what stands behind a call does so as well."""
        if self.over is not None:
            return self.over.factor
        return self.term.body if self.inlined is None else self.inlined

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


def numbers_in(body: Term) -> int:
    """How many numbers a term comes to, as far as it says so."""
    match body:
        case Tuple():
            return sum(map(numbers_in, children(body)))
        case If() | Branch():
            return max(numbers_in(body.then), numbers_in(body.orelse))
        case _:
            return 1


def _force(trace: Trace, path: tuple[int, ...], mask: Mask) -> None:
    for at in path[:-1]:
        trace = trace.setdefault(at, {})
    trace[path[-1]] = mask


def unpacked_plan(data: bytes, inline: Resolve) -> Plan:
    """The plan that bytes were made of. `inline`: see `make`. Raises ValueError where they were not of a plan."""
    whole, carried_out, own = unpacked(data)
    outline: Outline = unpacked(whole)
    body = inlined(outline.term, inline, dict(own["decisions"])) if carried_out else None
    return Plan(outline, inlined=body, straight=_straight(outline, body), **own)


def _straight(outline: Outline, body: Term | None) -> StraightIntegral | None:
    """What rules can be proved of, with the integrand that has calls carried out."""
    return None if body is None else straight(outline.term, body, outline.levels)


class _Asked:
    """What is asked of the surroundings while a plan is made: functions that are called, and plain decisions."""

    def __init__(self, resolve: Resolve, decide: Decide) -> None:
        self._resolve, self._decide = resolve, decide
        self.times = 0
        self.decisions: dict[Term, float | None] = {}
        self.unknown: set[Term] = set()

    def resolve(self, head: Term) -> Lam | Deriv | None:
        self.times += 1
        return self._resolve(head)

    def known(self, head: Term) -> Lam | Deriv | None:
        found = self.resolve(head)
        if found is None:
            self.unknown.add(head)
        return found

    def remember(self, plain: Term) -> float | None:
        self.times += 1
        if plain not in self.decisions:
            self.decisions[plain] = self._decide(plain)
        return self.decisions[plain]

    def findings(self, term: Term) -> tuple[Finding, ...]:
        """What an integrand jumps at, and where it bends; what is not known is what is met on the way."""
        self.unknown.clear()
        return findings(term, self.known, self.remember)

    def below(self, terms: Iterable[Term]) -> tuple[Finding, ...]:
        """What these jump at, and where they bend, also within what they call."""
        return surfaces_below(terms, self.known, self.remember)


def make(
    term: Integral, resolve: Resolve, decide: Decide, inline: Resolve, number: Number, outlines: Outlines
) -> Plan:  # fmt: skip
    """The plan of an integral. `resolve` gives the functions that it calls, `decide` the values of plain terms.

    `inline` gives those of the functions that a call of them may be replaced by. `number` gives what a plain term is
    for some of the parameters, or nan. `outlines`: of the program; they grow.
    """
    asked = _Asked(resolve, decide)
    if placed_along(term) is not None:  # while the level set still stands in it
        term = with_integrand(term, unrolled(term.body, inline, asked.remember) or term.body)
        term = split_at_bounds(term, inline)
    over = placed_along(term)
    if over is not None:
        term = integral(term.variables, term.bounds, over.weight, term.hints)
    term = outlines.by_extremes(term)
    found = asked.findings(term.body)
    reaches, confused = not asked.unknown, False
    premises: tuple[Term, ...] = ()
    outline = outlines.get(term, found) if reaches and over is None else None
    if outline is None:
        outline, reaches, premises, confused = _outlined(term, asked, found, inline, number, over, outlines)
    term = outline.term
    body = inlined(term, inline, asked.decisions) if reaches and not outline.hides else None
    return Plan(
        outline,
        tuple((t, v) for t, v in asked.decisions.items() if not isinstance(t, Const)),
        reaches,
        body,
        _straight(outline, body),
        _premise(premises),
        confused,
        () if body is None else _degrees(body, outline.levels),
        over,
    )


def _outlined(
    term: Integral, asked: _Asked, found: tuple[Finding, ...], inline: Resolve, number: Number, over: LevelSet | None,
    outlines: Outlines,
) -> tuple[Outline, bool, tuple[Term, ...], bool]:  # fmt: skip
    """The outline of an integral, or of one that is equal; whether all surfaces are known, what has to be positive for
    it, and whether there are conditions in conditions."""
    whole, times = term, asked.times
    premises: tuple[Term, ...] = ()
    confused = False
    several = tuple(f.surface for f in found if _may_be_mixed(f))
    mixed = bool(several) or any(has_nested(i.body) for i in _inner_integrals(term))
    if mixed:
        apart = _apart(term, inline, asked.remember, number)
        if apart is not None:
            term, premises = apart.term, apart.premises
            found = asked.findings(term.body)
        confused = apart is None or any(nested(f.surface) for f in found if f.kind == "jump")
    hides = hidden(term, found, asked.resolve)
    if asked.unknown or hides:
        term = hoisted(term, inline)
        found = asked.findings(term.body)
        hides = hidden(term, found, asked.resolve)
    reaches = not asked.unknown
    outline = outlined(term, found, hides, asked.resolve, over, asked.findings, asked.below(several))
    if term is whole and asked.times == times and reaches and over is None and not mixed:
        outlines.put(found, outline)
    return outline, reaches, premises, confused


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


def inlined(term: Integral, inline: Resolve, decisions: Mapping[Term, float | None]) -> Term:
    """The integrand with calls of known functions carried out, and sums that jump written out as far as these
    decisions tell their summands."""
    passed = {name: f for name in sorted(term.body.free) if (f := inline(var(name))) is not None}
    return loops_unrolled(expanded(substitute(term.body, passed), inline), decisions)


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
