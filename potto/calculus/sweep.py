"""The sweep: which surfaces cut which variable of an iterated integral, innermost first.

Owns `sweep`. Integrating a variable out leaves, in the variables further out, the places where the inner integral
stops being smooth: where a section of a surface enters or leaves the bounds, where two sections cross, and where
roots appear or merge (there like a square root). Those are again surfaces, one variable lower: a cylindrical
decomposition in the manner of Collins, of the surfaces that a scene has, and of no more.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import lru_cache

from potto.calculus.solve import Family, Sections, Unsolvable, sections
from potto.calculus.surfaces import Decide, Finding, Resolve, findings
from potto.core.simplify import normalized_surface, simplify
from potto.core.terms import Const, Integral, Term, postorder, substitute

MOST_CUTS = 48  # per variable; what is beyond it only costs adaptive refinement
MOST_CENTERS = 6
MOST_PAIRS = 12  # surfaces whose crossings are worked out


@dataclass(frozen=True, slots=True)
class Jump:
    """A branch of the integrand: the path of its trace, and which side of its group's canonical surface it takes."""

    path: tuple[int, ...]
    orientation: int
    strict: bool


@dataclass(frozen=True, slots=True)
class Cut:
    """A surface that cuts one variable.

    surface: canonical, up to positive scale and sign, so that the same condition met twice is one cut.
    jumps: the branches that it decides; none for a kink, an edge or a place where an inner section changes.
    turning: the integrand behaves like a square root there.
    roots: closed-form sections, or None where they are found by numbers.
    """

    surface: Term
    jumps: tuple[Jump, ...]
    turning: bool
    roots: tuple[Term, ...] | None
    families: tuple[Family, ...] = ()


@dataclass(frozen=True, slots=True)
class Level:
    """One variable of the iteration, with everything that cuts it."""

    variable: str
    lo: Term
    hi: Term
    hints: tuple[Term, ...]
    cuts: tuple[Cut, ...]


@dataclass(slots=True)
class _Pool:
    """Surfaces still to be placed, the same ones merged."""

    surfaces: dict[Term, tuple[list[Jump], bool]] = field(default_factory=dict)

    def put(self, surface: Term, jump: tuple[tuple[int, ...], bool] | None, turning: bool) -> None:
        canonical, orientation = _canonical(surface)
        if not canonical.free:
            return
        jumps, turns = self.surfaces.setdefault(canonical, ([], False))
        if jump is not None:
            jumps.append(Jump(jump[0], orientation, jump[1]))
        self.surfaces[canonical] = (jumps, turns or turning)

    def take(self, variable: str) -> list[tuple[Term, list[Jump], bool]]:
        taken = [(s, *rest) for s, rest in self.surfaces.items() if variable in s.free]
        for surface, _, _ in taken:
            del self.surfaces[surface]
        return taken


@lru_cache(maxsize=8192)
def _canonical(surface: Term) -> tuple[Term, int]:
    return normalized_surface(surface)


@lru_cache(maxsize=8192)
def _sections(surface: Term, variable: str) -> Sections | Unsolvable:
    return sections(surface, variable)


@dataclass(frozen=True, slots=True)
class Sweep:
    """The levels of an integral, outermost first, and what is left over for the variables around it."""

    levels: tuple[Level, ...]
    outer: tuple[Finding, ...]


def sweep(term: Integral, found: Iterable[Finding], resolve: Resolve, decide: Decide) -> Sweep:
    """Place every surface of an integral's body at the variable that it cuts."""
    pool = _Pool()
    centers: dict[Term, None] = {}
    for f in found:
        if f.kind == "center":
            centers[f.surface] = None
            continue
        pool.put(f.surface, (f.path, f.strict) if f.kind == "jump" else None, f.kind == "edge")
    levels: list[Level] = []
    rows = list(zip(term.variables, term.bounds, term.hints, strict=True))
    for variable, (lo, hi), hints in reversed(rows):
        cuts = tuple(_cut(s, tuple(jumps), turning, variable) for s, jumps, turning in pool.take(variable))
        cuts = (*(c for c in cuts if c.jumps), *[c for c in cuts if not c.jumps][:MOST_CUTS])
        here = [c for c in centers if variable in c.free]
        centers = {c: None for c in centers if variable not in c.free}
        levels.append(Level(variable, lo, hi, (*hints, *_points(here, variable)[:MOST_CENTERS]), cuts))
        for surface, turning in _shadows(cuts, variable, lo, hi):
            pool.put(surface, None, turning)
        for bound in (lo, hi):
            for f in findings(bound, resolve, decide):
                if f.kind != "center":
                    pool.put(f.surface, None, f.kind == "edge")
    outer = (
        *(Finding("edge" if turning else "kink", surface) for surface, (_, turning) in pool.surfaces.items()),
        *(Finding("center", surface) for surface in centers),
    )
    return Sweep(tuple(reversed(levels)), outer)


def outer_findings(term: Integral, resolve: Resolve, decide: Decide) -> tuple[Finding, ...]:
    """What the variables around an integral see of it: jumps that none of its variables take part in, and kinks."""
    found = findings(term.body, resolve, decide)
    inner = set(term.variables)
    bounds = (f for pair in term.bounds for bound in pair for f in findings(bound, resolve, decide))
    jumps = tuple(
        Finding("jump", f.surface, (), f.strict, f.coordinates, f.calls)
        for f in (*found, *bounds)
        if f.kind == "jump" and not f.surface.free & inner
    )
    swept = sweep(term, (f for f in found if f.kind != "jump" or f.surface.free & inner), resolve, decide)
    return (*jumps, *swept.outer)


def _cut(surface: Term, jumps: tuple[Jump, ...], turning: bool, variable: str) -> Cut:
    found = _sections(surface, variable)
    if isinstance(found, Unsolvable) or not found.complete:
        return Cut(surface, jumps, turning, None)
    roots = (*found.roots, *found.poles)
    return Cut(surface, jumps, turning, roots, (*found.families, *found.pole_families))


def _points(centers: list[Term], variable: str) -> tuple[Term, ...]:
    """Where the centers are, if that can be said in closed form."""
    points: dict[Term, None] = {}
    for center in centers:
        found = _sections(center, variable)
        if isinstance(found, Sections):
            points.update(dict.fromkeys(found.roots))
    return tuple(points)


def _shadows(cuts: tuple[Cut, ...], variable: str, lo: Term, hi: Term) -> Iterable[tuple[Term, bool]]:
    """What the cuts of one variable leave in those further out: (surface, whether like a square root)."""
    for cut in cuts:
        for bound in (lo, hi):
            if not (isinstance(bound, Const) and bound.value in (float("inf"), float("-inf"))):
                yield substitute(cut.surface, {variable: bound}), False
        found = _sections(cut.surface, variable)
        if isinstance(found, Sections):
            for turn in found.turning:
                yield turn, True
    solved = [c for c in cuts if c.roots][:MOST_PAIRS]
    for first in solved:
        for second in solved:
            if first is not second and first.surface.digest < second.surface.digest:
                yield from _crossings(first, second, variable)


def _crossings(first: Cut, second: Cut, variable: str) -> Iterable[tuple[Term, bool]]:
    """Where two sections meet: the simpler one's roots put into the other's surface."""
    a, b = sorted((first, second), key=lambda c: (len(c.roots or ()), sum(_size(r) for r in c.roots or ())))
    for root in a.roots or ():
        meeting = simplify(substitute(b.surface, {variable: root}))
        if meeting.free:
            yield meeting, False


@lru_cache(maxsize=8192)
def _size(term: Term) -> int:
    return len(postorder(term))
