"""The sweep: which surfaces cut which variable of an iterated integral, innermost first.

Owns `sweep`. Integrating a variable out leaves, in the variables further out, the places where the inner integral
stops being smooth: where a section of a surface enters or leaves the bounds, where two sections cross, and where
roots appear or merge (there like a square root). Those are again surfaces, one variable lower: a cylindrical
decomposition in the manner of Collins, of the surfaces that a scene has, and of no more.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial

from msgspec import Struct
from msgspec.structs import replace

from potto.calculus.algebra.rational_form import settled
from potto.calculus.decomposition.conic_regions import Polynomial, conic_region, covering
from potto.calculus.decomposition.critical import Critical, Within
from potto.calculus.decomposition.lifts import Lift
from potto.calculus.decomposition.projection import Here, crossing, further_systems, shadows_of_cuts, shadows_of_roots
from potto.calculus.decomposition.side_polynomials import by_sides
from potto.calculus.decomposition.strata import Stratum, own
from potto.calculus.decomposition.surface_cuts import (
    MOST_CENTERS,
    ConicRegion,
    Cut,
    Jump,
    Placed,
    along,
    around_centers,
    cut_along,
    cut_of,
    face_of,
    factored,
    points_of,
)
from potto.calculus.differentiation.level_sets import LevelSet
from potto.calculus.surfaces.finding import Finding, Kind, Resolve
from potto.core.terms import ZERO, Integral, Term, substitute

MOST_EDGES = 24  # per variable, of densities further in, each of which has up to eight hints
MOST_CUTS = 1200  # per variable; refinement doesn't see every weak kink that is left out
Paths = Mapping[tuple[int, ...], tuple[Term, int]]
# Of surfaces by the paths of their jumps, with orientations: 1 or -1 for those of which one side has to hold.
Holds = Callable[[Paths], Mapping[Term, int]]


class Level(Struct, frozen=True):
    """One variable of the iteration, with everything that cuts it.

    critical: where what lies further in meets, appears or turns, if that has no closed form there. complete: whether
    all that the cuts leave further out was worked out. edges: where sections come to hints of variables further in."""

    variable: str
    lo: Term
    hi: Term
    hints: tuple[Term, ...]
    cuts: tuple[Cut, ...]
    critical: tuple[Critical, ...] = ()
    complete: bool = True
    edges: tuple[Term, ...] = ()


class _Pool(Struct):
    """Findings still to be placed: surfaces, the same ones merged, centers of peaks, critical places, and edges of
    densities further in."""

    variables: tuple[str, ...]
    surfaces: dict[Term, Placed] = {}
    centers: dict[Term, None] = {}
    critical: dict[Critical, None] = {}
    edges: dict[Term, None] = {}
    corners: list[ConicRegion] = []
    within: list[Within] = []  # the variables that were swept, with their bounds

    def find(self, finding: Finding) -> None:
        if finding.critical is not None:
            self.critical[finding.critical] = None
        elif finding.kind == "center":
            self.centers[finding.surface] = None
        elif finding.kind != "step":  # no variable takes part in it
            surface = settled(finding.surface, frozenset(self.variables))
            jump = (finding.path, finding.strict) if finding.kind == "jump" else None
            lifts = (Lift(frozenset((surface,))),)
            self.put(
                surface, jump, finding.kind == "edge", bends=finding.kind != "jump", strata=own(surface), lifts=lifts
            )

    def put(
        self, surface: Term, jump: tuple[tuple[int, ...], bool] | None, turning: bool, steps: bool = False,
        bends: bool = False, strata: tuple[Stratum, ...] = (), lifts: tuple[Lift, ...] = (),
    ) -> None:  # fmt: skip
        face, orientation = face_of(surface)
        if not face.key.free:
            return
        if face.key not in self.surfaces:
            self.surfaces[face.key] = Placed(face, *factored(surface, orientation))
        placed = self.surfaces[face.key]
        if jump is not None:
            placed.jumps.append(Jump(jump[0], orientation, jump[1]))
        placed.turning |= turning
        placed.steps |= steps
        placed.bends |= bends
        placed.strata.append(strata)
        placed.lifts.append(lifts)

    def hold(self, holds: Holds) -> None:
        """Note the sides outside of which nothing is integrated."""
        paths = {j.path: (key, j.orientation) for key, placed in self.surfaces.items() for j in placed.jumps}
        for key, side in holds(paths).items():
            self.surfaces[key].holds = side

    def take(self, variable: str) -> list[Placed]:
        """The surfaces that vary along a variable. What is a factor of one and does not stays, as a step."""
        taken = [placed for key, placed in self.surfaces.items() if variable in key.free]
        for placed in taken:
            del self.surfaces[placed.face.key]
        for placed in taken:
            for factor in placed.factors:
                if variable not in factor.key.free:
                    steps = bool(placed.jumps) or placed.steps
                    self.put(factor.form, None, placed.turning, steps, strata=own(factor.form))
        return taken

    def take_points(self, variable: str) -> tuple[list[Term], tuple[Critical, ...]]:
        """The centers and critical places that depend on a variable."""
        here = [c for c in self.centers if variable in c.free]
        systems = tuple(c for c in self.critical if variable in c.free)
        for center in here:
            del self.centers[center]
        for system in systems:
            del self.critical[system]
        return here, systems

    def take_edges(self, variable: str) -> tuple[Term, ...]:
        """Where along a variable the edges of densities further in are."""
        here = [edge for edge in self.edges if variable in edge.free]
        for edge in here:
            del self.edges[edge]
        return points_of(here, variable)[:MOST_EDGES]

    def left(self) -> tuple[Finding, ...]:
        return (
            *(Finding(_kind(placed), placed.face.form) for placed in self.surfaces.values()),
            *(Finding("center", surface) for surface in (*self.centers, *self.edges)),
            *(Finding("critical", c.equations[0], critical=c) for c in self.critical),
        )


class Sweep(Struct, frozen=True):
    """The levels of an integral, outermost first, and what is left over for the variables around it."""

    levels: tuple[Level, ...]
    outer: tuple[Finding, ...]


def sweep(
    term: Integral, found: Iterable[Finding], resolve: Resolve, findings: Callable[[Term], Iterable[Finding]],
    outermost: bool = False, over: LevelSet | None = None, holds: Holds | None = None,
) -> Sweep:  # fmt: skip
    """Place every surface of an integral's body at the variable that it cuts. `findings` finds those of its bounds.
    outermost: nobody asks for the rest.

    over: the level set over which the innermost variable is not integrated but summed. holds: the surfaces of which
    nothing is integrated on one side.
    """
    pool = _Pool(term.variables)
    for finding in found:
        pool.find(finding)
    polynomial = None
    if holds is not None and over is None:
        pool.hold(holds)
        polynomial = partial(by_sides, term.body, resolve=resolve)
    levels: list[Level] = []
    rows = list(zip(term.variables, term.bounds, term.hints, strict=True))
    for variable, bounds, hints in reversed(rows):
        last = outermost and variable == term.variables[0]
        levels.append(_level(pool, variable, bounds, hints, over if not levels else None, last, polynomial))
        for bound in bounds:
            for finding in findings(bound):
                if finding.kind == "jump":
                    pool.put(finding.surface, None, False, strata=own(finding.surface))
                elif finding.kind != "center":
                    pool.find(finding)
    return Sweep(tuple(reversed(levels)), pool.left())


def _level(
    pool: _Pool, variable: str, bounds: tuple[Term, Term], hints: tuple[Term, ...], over: LevelSet | None, last: bool,
    polynomial: Polynomial | None,
) -> Level:  # fmt: skip
    """One variable with what cuts it; what that leaves further out goes into the pool, unless nobody asks for it.
    polynomial: gives the integrand in the sides of surfaces."""
    cuts = tuple(cut_of(placed, variable) for placed in pool.take(variable))
    decisive, others = [c for c in cuts if c.decides], [c for c in cuts if not c.decides]
    outer = pool.variables[: pool.variables.index(variable)]
    further, nearest = frozenset(outer), outer[-1] if outer else ""
    within = Within(variable, *bounds)
    region, (lines, conics), covers = conic_region(decisive, within, further, polynomial)
    alone = [cut for cut in decisive if cut not in lines and cut not in conics]
    names = frozenset(pool.variables)
    complete = len(others) <= MOST_CUTS and crossing((*alone, *others), variable, further, names)[1]
    pool.within.append(within)
    here = Here(tuple(pool.within), further, nearest, names)
    cuts = (*decisive, *others[:MOST_CUTS])
    (centers, systems), edges = pool.take_points(variable), pool.take_edges(variable)
    along_own = None if over is None else cut_along(over.surface, variable)
    if not last:
        if over is None or along_own is None:
            shadows = shadows_of_cuts((*alone, *others[:MOST_CUTS]), (lines, conics), here)
        else:
            shadows = shadows_of_roots(along_own, cuts, here, len(over.shares) == 1)
        for shadow in shadows:
            if isinstance(shadow, Critical):
                pool.critical[shadow] = None
            else:
                pool.put(shadow.surface, None, shadow.turning, shadow.steps, strata=shadow.strata, lifts=shadow.lifts)
        pool.critical.update(dict.fromkeys(further_systems(systems, cuts, here)))
        pool.edges.update(dict.fromkeys(_edges(decisive, variable, hints, further)))
    else:
        cuts = (*cuts, *(Cut(ZERO, ZERO, (), False, (), corners=corners) for corners in pool.corners))
    if region is not None:
        pool.corners.append(region)
    elif polynomial is not None and len(outer) > 1:  # of one variable further out the region tells
        covers = covering(decisive, polynomial)
    if covers:
        cuts = tuple(replace(cut, covers=covers[cut]) if cut in covers else cut for cut in cuts)
    peaks = (*hints, *points_of(centers, variable)[:MOST_CENTERS])
    placed = (*cuts, *around_centers(centers, variable)) if along_own is None else (along_own,)
    return Level(variable, *bounds, peaks, placed, systems, complete, edges)


def _edges(cuts: Iterable[Cut], variable: str, hints: tuple[Term, ...], further: frozenset[str]) -> Iterator[Term]:
    """Where sections along a variable come to hints. What it amounts to changes about there: at the edge of a density,
    far out, by very little and within a narrow stretch."""
    for cut in cuts:
        for hint in hints:
            edge = substitute(along(cut), {variable: hint})
            if any(points_of((edge,), outer) for outer in edge.free & further):
                yield edge


def _kind(placed: Placed) -> Kind:
    if placed.steps:  # of [x*y > 0] the integral over y jumps at x = 0
        return "jump"
    return "edge" if placed.turning else "kink"
