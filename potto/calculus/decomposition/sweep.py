"""The sweep: which surfaces cut which variable of an iterated integral, innermost first.

Owns `sweep`. Integrating a variable out leaves, in the variables further out, the places where the inner integral
stops being smooth: where a section of a surface enters or leaves the bounds, where two sections cross, and where
roots appear or merge (there like a square root). Those are again surfaces, one variable lower: a cylindrical
decomposition in the manner of Collins, of the surfaces that a scene has, and of no more.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import islice

from potto.calculus.algebra.radicals import minus
from potto.calculus.algebra.ranges import positive
from potto.calculus.algebra.rational_form import settled
from potto.calculus.decomposition.critical import Critical, Within, folds, infinite, scattered, shadows
from potto.calculus.differentiation.level_sets import LevelSet
from potto.calculus.solving.enclosable import slope_of
from potto.calculus.solving.solve import Family, Sections, Unsolvable, sections
from potto.calculus.surfaces.case_split import cased
from potto.calculus.surfaces.discontinuities import Decide, Finding, Kind, Resolve, findings
from potto.core.simplify import normalized_surface, simplify
from potto.core.terms import Branch, Const, Integral, Prim, Term, postorder, prim, substitute

MOST_CUTS = 1200  # per variable; refinement doesn't see every weak kink that is left out
MOST_CENTERS = 6
MOST_PAIRS = 12  # surfaces whose crossings are worked out, if they are kinks: those of crossings come to hundreds
MOST_JUMPS = 48  # the same, if they are jumps
_RATIONAL = frozenset(("add", "neg", "mul", "div"))


@dataclass(frozen=True, slots=True)
class Jump:
    """A branch of the integrand: the path of its trace, and which side of its group's canonical surface it takes."""

    path: tuple[int, ...]
    orientation: int
    strict: bool


@dataclass(frozen=True, slots=True)
class Face:
    """A surface as it was written, and the canonical form, of the same sign, by which it is known."""

    form: Term
    key: Term


@dataclass(frozen=True, slots=True)
class Cut:
    """A surface that cuts one variable.

    surface: as it was written, on the side of its canonical form: multiplied out, (x - 1e8)^2 + (y - 1e8)^2 - t^2 would
        lose its t. key: the canonical form, so that the same condition met twice is one cut.
    jumps: the branches that it decides; none for a kink, an edge or a place where an inner section changes.
    steps: a branch that is decided further in jumps here all the same: of (x - t)*(y - s) >= 0 at x = t.
    turning: the integrand behaves like a square root there.
    roots: closed-form sections, or None where they are found by numbers.
    center: nothing happens at it but that a smooth integrand may be concentrated there.
    """

    surface: Term
    key: Term
    jumps: tuple[Jump, ...]
    turning: bool
    roots: tuple[Term, ...] | None
    families: tuple[Family, ...] = ()
    steps: bool = False
    product: Product | None = None
    center: bool = False

    @property
    def decides(self) -> bool:
        """Whether it matters on which side of it a stretch lies."""
        return bool(self.jumps) or self.steps


@dataclass(frozen=True, slots=True)
class Product:
    """A surface as a product: (sign) * along * outer factors, up to a positive scale.

    along: what varies with the variable that the surface cuts. outer: factors that do not.
    """

    along: Term
    outer: tuple[Face, ...]
    sign: int


@dataclass(frozen=True, slots=True)
class Level:
    """One variable of the iteration, with everything that cuts it.

    critical: where what lies further in meets, appears or turns, if that has no closed form there. complete: whether
    all that the cuts leave further out was worked out."""

    variable: str
    lo: Term
    hi: Term
    hints: tuple[Term, ...]
    cuts: tuple[Cut, ...]
    critical: tuple[Critical, ...] = ()
    complete: bool = True


@dataclass(slots=True)
class _Placed:
    """A surface, what it is a product of (up to `sign`), and what is known of it."""

    face: Face
    factors: tuple[Face, ...]
    sign: int
    jumps: list[Jump] = field(default_factory=list)
    turning: bool = False
    steps: bool = False


@dataclass(slots=True)
class _Pool:
    """Surfaces still to be placed, the same ones merged."""

    surfaces: dict[Term, _Placed] = field(default_factory=dict)

    def put(self, surface: Term, jump: tuple[tuple[int, ...], bool] | None, turning: bool, steps: bool = False) -> None:
        face, orientation = _face(surface)
        if not face.key.free:
            return
        if face.key not in self.surfaces:
            self.surfaces[face.key] = _Placed(face, *_factored(surface, orientation))
        placed = self.surfaces[face.key]
        if jump is not None:
            placed.jumps.append(Jump(jump[0], orientation, jump[1]))
        placed.turning |= turning
        placed.steps |= steps

    def take(self, variable: str) -> list[_Placed]:
        """The surfaces that vary along a variable. What is a factor of one and does not stays, as a step."""
        taken = [placed for key, placed in self.surfaces.items() if variable in key.free]
        for placed in taken:
            del self.surfaces[placed.face.key]
        for placed in taken:
            for factor in placed.factors:
                if variable not in factor.key.free:
                    self.put(factor.form, None, placed.turning, bool(placed.jumps) or placed.steps)
        return taken


@lru_cache(maxsize=8192)
def _face(surface: Term) -> tuple[Face, int]:
    """A surface on the side of its canonical form, and +1 or -1 for whether it was there already.

    Where variables cancel in the canonical form, that is the surface.
    """
    key, side = normalized_surface(surface)
    form = surface if side > 0 else minus(surface)
    return Face(form if form.free == key.free else key, key), side


@lru_cache(maxsize=8192)
def _sections(surface: Term, variable: str) -> Sections | Unsolvable:
    return sections(surface, variable)


@dataclass(frozen=True, slots=True)
class Sweep:
    """The levels of an integral, outermost first, and what is left over for the variables around it."""

    levels: tuple[Level, ...]
    outer: tuple[Finding, ...]


def sweep(
    term: Integral, found: Iterable[Finding], resolve: Resolve, decide: Decide, outermost: bool = False,
    over: LevelSet | None = None,
) -> Sweep:  # fmt: skip
    """Place every surface of an integral's body at the variable that it cuts. outermost: nobody asks for the rest.

    over: the level set over which the innermost variable is not integrated but summed.
    """
    pool = _Pool()
    centers: dict[Term, None] = {}
    critical: dict[Critical, None] = {}

    def place(f: Finding) -> None:
        if f.critical is not None:
            critical[f.critical] = None
        elif f.kind != "center":
            surface = settled(f.surface, frozenset(term.variables))
            pool.put(surface, (f.path, f.strict) if f.kind == "jump" else None, f.kind == "edge")

    for f in found:
        place(f)
        if f.kind == "center":
            centers[f.surface] = None
    levels: list[Level] = []
    rows = list(zip(term.variables, term.bounds, term.hints, strict=True))
    for variable, (lo, hi), hints in reversed(rows):
        cuts = tuple(_cut(placed, variable) for placed in pool.take(variable))
        decisive, others = [c for c in cuts if c.decides], [c for c in cuts if not c.decides]
        further = frozenset(term.variables[: term.variables.index(variable)])
        complete = len(others) <= MOST_CUTS and _meeting(cuts, variable, further)[1]
        cuts = (*decisive, *others[:MOST_CUTS])
        here = [c for c in centers if variable in c.free]
        centers = {c: None for c in centers if variable not in c.free}
        systems = tuple(c for c in critical if variable in c.free)
        critical = {c: None for c in critical if variable not in c.free}
        peaks = (*hints, *points_of(here, variable)[:MOST_CENTERS])
        own = cut_along(over.surface, variable) if over is not None and variable == term.variables[-1] else None
        placed = (*cuts, *_around(here, variable)) if own is None else (own,)
        levels.append(Level(variable, lo, hi, peaks, placed, systems, complete))
        if not (outermost and variable == term.variables[0]):
            within = Within(variable, lo, hi)
            if over is None or own is None:
                found_here = _shadows(cuts, within, further)
            else:
                found_here = _root_shadows(own, cuts, within, further, len(over.shares) == 1)
            for shadow in found_here:
                if isinstance(shadow, Critical):
                    critical[shadow] = None
                else:
                    pool.put(shadow[0], None, *shadow[1:])
            critical.update(dict.fromkeys(_further(systems, cuts, variable, lo, hi)))
        for bound in (lo, hi):
            for f in findings(bound, resolve, decide):
                if f.kind != "jump":
                    place(f)
                else:
                    pool.put(f.surface, None, False)
    outer = (
        *(Finding(_kind(placed), placed.face.form) for placed in pool.surfaces.values()),
        *(Finding("center", surface) for surface in centers),
        *(Finding("critical", c.equations[0], critical=c) for c in critical),
    )
    return Sweep(tuple(reversed(levels)), outer)


def _kind(placed: _Placed) -> Kind:
    if placed.steps:  # of [x*y > 0] the integral over y jumps at x = 0
        return "jump"
    return "edge" if placed.turning else "kink"


def outer_findings(term: Integral, resolve: Resolve, decide: Decide) -> tuple[Finding, ...]:
    """What the variables around an integral see of it: jumps that none of its variables take part in, and kinks."""
    term = cased(term)
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


def _cut(placed: _Placed, variable: str) -> Cut:
    jumps, turning, steps = tuple(placed.jumps), placed.turning, placed.steps
    here = tuple(f for f in placed.factors if variable in f.key.free)
    outer = tuple(f for f in placed.factors if variable not in f.key.free)
    product = Product(_product(tuple(f.form for f in here)), outer, placed.sign) if outer else None
    surface, key = placed.face.form, placed.face.key
    roots: dict[Term, None] = {}
    families: dict[Family, None] = {}
    for part in here:
        found = _roots(part, variable)
        if found is None:
            return Cut(surface, key, jumps, turning, None, (), steps, product)
        roots.update(dict.fromkeys((*found.roots, *found.poles)))
        families.update(dict.fromkeys((*found.families, *found.pole_families)))
    return Cut(surface, key, jumps, turning, tuple(roots), tuple(families), steps, product)


def _roots(part: Face, variable: str) -> Sections | None:
    """All the roots of a factor: of the form as written, which keeps digits, else of the canonical one."""
    for surface in (part.form, part.key):
        found = _sections(surface, variable)
        if isinstance(found, Sections) and found.complete:
            return found
    return None


def cut_along(surface: Term, variable: str) -> Cut:
    """A surface as a cut of one variable, whatever it decides."""
    return _cut(_Placed(Face(surface, surface), *_factored(surface, 1)), variable)


def _product(terms: tuple[Term, ...]) -> Term:
    return prim("mul", *terms) if len(terms) > 1 else terms[0]


def _factored(surface: Term, orientation: int) -> tuple[tuple[Face, ...], int]:
    """The factors of a surface written as a product, and the sign of its canonical form against theirs.

    A surface that is none, or in which a factor comes twice, is its own and only factor.
    """
    found: dict[Term, Face] = {}
    sign, waiting = orientation, [surface]
    while waiting:
        item = waiting.pop()
        match item:
            case Prim(op="mul" | "div", args=args):
                waiting.extend(args)
            case Prim(op="neg", args=(inner,)):
                sign = -sign
                waiting.append(inner)
            case Const(value=value):
                sign = -sign if value < 0 else sign
            case _ if positive(item):
                pass
            case _:
                face, turned = _face(item)
                if face.key in found or not face.key.free:
                    return (_face(surface)[0],), 1
                sign *= turned
                found[face.key] = face
    return (tuple(found.values()), sign) if len(found) > 1 else ((_face(surface)[0],), 1)


def points_of(centers: Iterable[Term], variable: str) -> tuple[Term, ...]:
    """Where the centers are, if that can be said in closed form."""
    found = (_sections(center, variable) for center in centers)
    return tuple(dict.fromkeys(root for s in found if isinstance(s, Sections) and not s.families for root in s.roots))


def _around(centers: Iterable[Term], variable: str) -> tuple[Cut, ...]:
    """The centers that are more than points in closed form, and can be found."""
    rest = (c for c in centers if not isinstance(found := _sections(c, variable), Sections) or found.families)
    cuts = (replace(cut_along(c, variable), center=True) for c in rest)
    known = (cut for cut in cuts if cut.roots is not None or slope_of(cut.surface, variable) is not None)
    return tuple(islice(known, MOST_CENTERS))


def along(cut: Cut) -> Term:
    """What of a cut's surface varies with the variable that it cuts."""
    return cut.surface if cut.product is None else cut.product.along


def _further(
    systems: tuple[Critical, ...], cuts: tuple[Cut, ...], variable: str, lo: Term, hi: Term
) -> Iterator[Critical]:
    """What the critical places along one variable leave in those further out."""
    if not systems:
        return
    roots = [root for cut in cuts if cut.decides for root in cut.roots or ()]
    searched = [cut.surface for cut in cuts if cut.decides and cut.roots is None]
    yield from shadows(systems[:MOST_PAIRS], variable, lo, hi, roots, searched)


# A surface, whether what is left is like a square root there, and whether it jumps; or a system.
_Shadow = tuple[Term, bool, bool] | Critical


def _shadows(cuts: tuple[Cut, ...], within: Within, further: frozenset[str]) -> Iterator[_Shadow]:
    """What the cuts of one variable leave in those further out."""
    for cut in cuts:
        yield from _at_bounds(cut, within, False)
        yield from _turning(cut, within, further)
    meeting, _ = _meeting(cuts, within.variable, further)
    for first in meeting:
        for second in meeting:
            if first is not second and first.key.digest < second.key.digest:
                yield from _crossings(first, second, within, further)


def _root_shadows(
    own: Cut, cuts: tuple[Cut, ...], within: Within, further: frozenset[str], alone: bool
) -> Iterator[_Shadow]:
    """What a sum over the roots of one surface leaves: it jumps where they meet a bound, or a jump of what is summed.

    alone: no other variable has a share, so that the sum is infinite where roots merge.
    """
    yield from _at_bounds(own, within, True)
    yield from _turning(own, within, further, alone)
    for cut in cuts:
        if cut.decides:
            yield from _crossings(own, cut, within, further, True)


def _at_bounds(cut: Cut, within: Within, steps: bool) -> Iterator[_Shadow]:
    for bound in (within.lo, within.hi):
        if not infinite(bound):
            yield substitute(along(cut), {within.variable: bound}), False, steps


def _turning(cut: Cut, within: Within, further: frozenset[str], steps: bool = False) -> Iterator[_Shadow]:
    """Where the roots of a cut appear, merge or turn.

    further: the variables further out. Formulas of formulas grow from one to the next; where there are two or more,
    systems in the surfaces as they are take the place of what is more than a radical.
    """
    surface, variable = along(cut), within.variable
    if cut.roots is None or (cut.families and _by_numbers(surface, variable, further)):
        yield from folds(surface, variable, within.lo, within.hi, steps)
        if cut.roots is not None:
            return
    found = _sections(surface, variable)
    if cut.product is None and not (isinstance(found, Sections) and found.complete):
        found = _sections(cut.key, variable)
    if isinstance(found, Sections):
        for turn in found.turning:
            yield turn, True, False
        for stop in dict.fromkeys(stop for family in found.families for stop in family.stops):
            yield substitute(surface, {variable: stop}), True, False


def _meeting(cuts: Sequence[Cut], variable: str, further: frozenset[str]) -> tuple[list[Cut], bool]:
    """The cuts whose crossings are worked out, and whether those are all that may cross."""
    meeting = [c for c in cuts if c.roots or c.families or c.roots is None]
    meeting = [c for c in meeting if not scattered(along(c), variable, further)]
    chosen = [c for n, c in enumerate(meeting) if n < (MOST_JUMPS if c.decides else MOST_PAIRS)]
    return chosen, chosen == meeting


def _by_numbers(surface: Term, variable: str, further: frozenset[str]) -> bool:
    """Whether what a surface leaves in variables further out is better searched for."""
    return len(surface.free & further) >= 2 and slope_of(surface, variable) is not None


def _crossings(
    first: Cut, second: Cut, within: Within, further: frozenset[str], steps: bool = False
) -> Iterator[_Shadow]:
    """Where two sections meet: the simpler one's roots put into the other's surface, where they are all known."""
    solved = [c for c in (first, second) if c.roots is not None and not c.families]
    a = min(solved, key=lambda c: (len(c.roots or ()), sum(_size(r) for r in c.roots or ())), default=None)
    searched = a is None or (
        any(_radical(root) for root in a.roots or ())
        and all(_by_numbers(along(c), within.variable, further) for c in (first, second))
    )
    if a is None or searched:
        yield Critical((along(first), along(second)), (within,), False, steps)
        return
    b = second if a is first else first
    for root in a.roots or ():
        meeting = simplify(substitute(b.surface, {within.variable: root}))
        if meeting.free:
            yield meeting, False, steps


def _radical(root: Term) -> bool:
    """Whether a root is more than a quotient of polynomials."""
    return any(isinstance(node, Branch) or (isinstance(node, Prim) and node.op not in _RATIONAL)
               for node in postorder(root))  # fmt: skip


@lru_cache(maxsize=8192)
def _size(term: Term) -> int:
    return len(postorder(term))
