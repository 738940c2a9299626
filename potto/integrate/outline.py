"""What of a plan follows from the surfaces of an integrand alone, whatever functions are called between them.

Owns `Outline`, `outlined`, and `Outlines`, which keeps them with a program: where one shader takes another's place,
bounds, cuts and sides stay as they are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

from msgspec import Struct

from potto.calculus.checking.solvability import monotone
from potto.calculus.decomposition.critical import MOST_EQUATIONS, slopes_of
from potto.calculus.decomposition.surface_cuts import along
from potto.calculus.decomposition.sweep import Paths, sweep
from potto.calculus.differentiation.level_sets import LevelSet
from potto.calculus.solving.enclosable import slope_of
from potto.calculus.surfaces.branch_assignment import box_of as extents
from potto.calculus.surfaces.case_split import by_extremes
from potto.calculus.surfaces.finding import Finding, Resolve
from potto.core.packing import packed
from potto.core.terms import Integral, Lam, Term, function_of, tuple_
from potto.integrate.decomposition.arrangements import Arrangement, arrangement_of
from potto.integrate.decomposition.lifted_rows import LiftedRows, lifted
from potto.integrate.decomposition.vanishing import Vanishing, held, vanishing_of
from potto.integrate.levels import Group, LevelPlan, group_levels

NO_KINKS = function_of(tuple_(()))
MOST_OUTLINES = 256  # of one program


class Outline(Struct, frozen=True, dict=True):
    """The levels of an integral, the surfaces that decide in it, and what its integrand is between them.

    hides: whether there are jumps whose side can't be forced, though it is known where they are.
    surfaces: all that a box which nothing cuts has on one side.
    doublings: how often they double what quadrature takes, about: up to three times each.
    folds: whether a surface that is searched for may have folds where the variables further out can't be cut.
    kinks: what is 0 where builtins have kinks, as one tuple, without what is known to be 0 at single places alone;
    the last of them, so many as there are steps, where what parameters alone decide changes.
    arrangement: of the surfaces that decide, where it is to be told at which places they leave something.
    """

    term: Integral
    levels: tuple[LevelPlan, ...]
    groups: tuple[Group, ...]
    body: Lam
    vanishing: Vanishing
    hides: bool = False
    surfaces: tuple[Term, ...] = ()
    doublings: int = 0
    folds: bool = False
    kinks: Lam = NO_KINKS
    steps: int = 0
    arrangement: Arrangement | None = None

    @cached_property
    def lifted(self) -> tuple[tuple[LiftedRows, ...], ...]:
        """By variable the cuts of which it is known from which places in space they come."""
        return lifted(self.levels, self.arrangement)

    @cached_property
    def packed(self) -> bytes:
        """As bytes. Raises TypeError where something in it is not data."""
        return packed(self)


class Outlines:
    """The outlines of a program's integrals whose making asked for no function and no plain value."""

    def __init__(self) -> None:
        self.settled: dict[Integral, Integral] = {}
        self.known: dict[tuple[Integral, tuple[Finding, ...]], Outline] = {}

    def by_extremes(self, term: Integral) -> Integral:
        """See there."""
        found = self.settled.get(term)
        if found is None:
            self._room(self.settled)
            found = self.settled[term] = by_extremes(term)
        return found

    def get(self, term: Integral, found: tuple[Finding, ...]) -> Outline | None:
        """The outline of an integral with these surfaces."""
        return self.known.get((term, found))

    def put(self, found: tuple[Finding, ...], outline: Outline) -> None:
        self._room(self.known)
        self.known[outline.term, found] = outline

    def _room(self, table: dict[Any, Any]) -> None:
        if len(table) >= MOST_OUTLINES:
            table.clear()


def outlined(
    term: Integral, found: Sequence[Finding], hides: bool, resolve: Resolve, over: LevelSet | None,
    findings: Callable[[Term], Iterable[Finding]], mixed: Iterable[Finding],
) -> Outline:  # fmt: skip
    """The outline of an integral whose integrand has these surfaces; `findings` gives those of a bound. mixed: those
    of surfaces with conditions inside, as they were written: these may be decided in what is integrated."""

    def holds(paths: Paths) -> Mapping[Term, int]:
        return held(vanishing_of(term.body, paths, resolve=resolve))

    levels, groups = group_levels(sweep(term, found, resolve, findings, True, over, holds).levels)
    told = any(own.level.critical for own in levels) or len(levels) > 2
    numbers = {j.path: (g.number, j.orientation) for g in groups for j in g.cut.jumps}
    return Outline(
        term,
        levels,
        groups,
        function_of(term.body),
        vanishing_of(term.body, numbers, resolve=resolve),
        hides or over is not None,
        tuple(dict.fromkeys(f.surface for f in found if f.kind != "step")),
        _doublings(term, found),
        _may_fold(term, levels),
        *_kinks(term, found, findings, mixed),
        arrangement_of(term.body, groups, resolve) if over is None and told else None,
    )


def _kinks(
    term: Integral, found: Iterable[Finding], findings: Callable[[Term], Iterable[Finding]], mixed: Iterable[Finding]
) -> tuple[Lam, int]:
    """Where an integrand, and what it is integrated over, have kinks that may lie along a stretch, and how many of
    these are steps of parameters alone, those within surfaces counted."""
    box, names = extents(term), frozenset(term.variables)
    inside = (*found, *(f for pair in term.bounds for bound in pair for f in findings(bound)))
    kinks = dict.fromkeys(f.surface for f in inside if f.kind == "kink")
    lying = tuple(k for k in kinks if not any(monotone(k, v, box) for v in term.variables))
    jumps = dict.fromkeys(
        f.surface for f in (*inside, *mixed) if f.kind in ("jump", "step") and not f.surface.free & names
    )
    steps = tuple(step for step in jumps if step not in kinks)
    return function_of(tuple_((*lying, *steps))), len(steps)


def _doublings(term: Integral, found: Sequence[Finding]) -> int:
    """How often the surfaces of an integral double what quadrature takes, about."""
    surfaces = {f.surface for f in found if f.kind not in ("center", "critical")}
    return sum(min(3, len(surface.free.intersection(term.variables))) for surface in surfaces)


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
