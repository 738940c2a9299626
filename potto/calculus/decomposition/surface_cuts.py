"""Surfaces as cuts of one variable: what they decide, what they are a product of, and where their roots are.

Owns `Cut`, `WrittenSurface`, `Product` and `ConicRegion`.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from itertools import islice

from msgspec import Struct
from msgspec.structs import replace

from potto.calculus.algebra.radicals import minus
from potto.calculus.algebra.ranges import positive
from potto.calculus.decomposition.critical import Within
from potto.calculus.decomposition.lifts import Lift, told
from potto.calculus.decomposition.strata import MOST as MOST_STRATA
from potto.calculus.decomposition.strata import Stratum
from potto.calculus.solving.enclosable import slope_of
from potto.calculus.solving.solve import Family, Sections, Unsolvable, sections, shared_factors
from potto.core.simplify import normalized_surface
from potto.core.terms import ONE, Const, Prim, Term, prim

RATIONAL = frozenset(("add", "neg", "mul", "div"))
MOST_CENTERS = 6


class Jump(Struct, frozen=True):
    """A branch of the integrand: the path of its trace, and which side of its group's canonical surface it takes."""

    path: tuple[int, ...]
    orientation: int
    strict: bool


class WrittenSurface(Struct, frozen=True):
    """A surface as it was written, and the canonical form, of the same sign, by which it is known."""

    form: Term
    key: Term


class Cut(Struct, frozen=True):
    """A surface that cuts one variable.

    surface: as it was written, on the side of its canonical form: multiplied out, (x - 1e8)^2 + (y - 1e8)^2 - t^2 would
        lose its t. key: the canonical form, so that the same condition met twice is one cut.
    jumps: the branches that it decides; none for a kink, an edge or a place where an inner section changes.
    steps: a branch that is decided further in jumps here all the same: of (x - t)*(y - s) >= 0 at x = t.
    turning: the integrand behaves like a square root there.
    roots: closed-form sections, or None where they are found by numbers.
    center: nothing happens at it but that a smooth integrand may be concentrated there.
    holds: 1 or -1 where nothing is integrated but on that side of the canonical form, else 0.
    bends: the integrand bends there as well, or is defined on one side alone, whatever its branches do.
    covers: 1 or -1 where on that side of the canonical form nothing jumps at any cut that has this, 0 for one that is
        but covered by others.
    corners: the region whose corners it stands for, instead of a surface.
    strata: where in space it comes from; none where that is not known.
    lifts: the places there that it may come from; none where these are not known.
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
    holds: int = 0
    bends: bool = False
    covers: int | None = None
    corners: ConicRegion | None = None
    strata: tuple[Stratum, ...] = ()
    lifts: tuple[Lift, ...] = ()

    @property
    def decides(self) -> bool:
        """Whether it matters on which side of it a stretch lies."""
        return bool(self.jumps) or self.steps


class Product(Struct, frozen=True):
    """A surface as a product: (sign) * along * outer factors, up to a positive scale.

    along: what varies with the variable that the surface cuts. outer: factors that do not.
    """

    along: Term
    outer: tuple[WrittenSurface, ...]
    sign: int


class ConicRegion(Struct, frozen=True):
    """What half planes a*x + b*y + c >= 0 and one side of conics a*x^2 + b*x*y + c*y^2 + d*x + e*y + f >= 0 bound
    together, x the variable that is cut, y the next one further in.

    lines: a, b and c of each; the last two are those above the lower and below the upper bound of y. conics: a to f.
    within: y and its bounds. surfaces: of conics, then of lines, as they were written: multiplied out they lose digits.
    polynomial: what is integrated as a polynomial in the `sides` of conics, then of lines; None for an intersection.
    covers: of each of these the side, 1 or -1, on which it leaves nothing to the others, 0 where there is none.
    """

    lines: tuple[tuple[Term, ...], ...]
    conics: tuple[tuple[Term, ...], ...]
    within: Within
    surfaces: tuple[Term, ...]
    polynomial: Term | None = None
    covers: tuple[int, ...] = ()


def side(number: int) -> str:
    """The name of 1 where a conic or line of a region is >= 0, and else of 0."""
    return f"side_{number}"


class Placed(Struct):
    """A surface, what it is a product of (up to `sign`), and what is known of it. holds, bends: as a cut has them.
    strata, lifts: where it comes from, of each way in which it was met; nothing in one of them is not known.
    """

    face: WrittenSurface
    factors: tuple[WrittenSurface, ...]
    sign: int
    jumps: list[Jump] = []
    turning: bool = False
    steps: bool = False
    holds: int = 0
    bends: bool = False
    strata: list[tuple[Stratum, ...]] = []
    lifts: list[tuple[Lift, ...]] = []

    @property
    def origin(self) -> tuple[Stratum, ...]:
        """All strata that it comes from; none where that is not known, or they are many."""
        found = dict.fromkeys(stratum for strata in self.strata for stratum in strata)
        return tuple(found) if all(self.strata) and len(found) <= MOST_STRATA else ()

    @property
    def places(self) -> tuple[Lift, ...]:
        """All places that it comes from; none where they are not known, or many."""
        return told(lift for lifts in self.lifts for lift in lifts) if all(self.lifts) else ()


@lru_cache(maxsize=8192)
def face_of(surface: Term) -> tuple[WrittenSurface, int]:
    """A surface on the side of its canonical form, and +1 or -1 for whether it was there already.

    Where variables cancel in the canonical form, that is the surface.
    """
    key, side = normalized_surface(surface)
    form = surface if side > 0 else minus(surface)
    return WrittenSurface(form if form.free == key.free else key, key), side


@lru_cache(maxsize=8192)
def sections_in(surface: Term, variable: str) -> Sections | Unsolvable:
    return sections(surface, variable)


def cut_of(placed: Placed, variable: str) -> Cut:
    jumps, turning, steps = tuple(placed.jumps), placed.turning, placed.steps
    here = tuple(f for f in placed.factors if variable in f.key.free)
    outer = tuple(f for f in placed.factors if variable not in f.key.free)
    product = Product(_product(tuple(f.form for f in here)), outer, placed.sign) if outer else None
    surface, key = placed.face.form, placed.face.key
    roots: dict[Term, None] = {}
    families: dict[Family, None] = {}
    for part in here:
        found = all_sections(part, variable)
        if found is None:
            return Cut(surface, key, jumps, turning, None, (), steps, product, holds=placed.holds, bends=placed.bends,
                       strata=placed.origin, lifts=placed.places)  # fmt: skip
        roots.update(dict.fromkeys((*found.roots, *found.poles)))
        families.update(dict.fromkeys((*found.families, *found.pole_families)))
    sections = tuple(roots), tuple(families)
    return Cut(surface, key, jumps, turning, *sections, steps, product, holds=placed.holds, bends=placed.bends,
               strata=placed.origin, lifts=placed.places)  # fmt: skip


def all_sections(part: WrittenSurface, variable: str) -> Sections | None:
    """All the roots of a factor: of the form as written, which keeps digits, else of the canonical one."""
    for surface in (part.form, part.key):
        found = sections_in(surface, variable)
        if isinstance(found, Sections) and found.complete:
            return found
    return None


def cut_along(surface: Term, variable: str) -> Cut:
    """A surface as a cut of one variable, whatever it decides."""
    return cut_of(Placed(WrittenSurface(surface, surface), *factored(surface, 1)), variable)


def _product(terms: tuple[Term, ...]) -> Term:
    return prim("mul", *terms) if len(terms) > 1 else terms[0] if terms else ONE


def factored(surface: Term, orientation: int) -> tuple[tuple[WrittenSurface, ...], int]:
    """The factors of a surface written as a product, or whose summands have factors in common, and the sign of its
    canonical form against theirs.

    A surface that is none, or in which a factor comes twice, is its own and only factor.
    """
    found: dict[Term, WrittenSurface] = {}
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
            case Prim(op="add") if common := shared_factors(item):
                waiting.extend(common)
            case _ if positive(item):
                pass
            case _:
                face, turned = face_of(item)
                if face.key in found or not face.key.free:
                    return (face_of(surface)[0],), 1
                sign *= turned
                found[face.key] = face
    return (tuple(found.values()), sign) if len(found) > 1 else ((face_of(surface)[0],), 1)


def points_of(centers: Iterable[Term], variable: str) -> tuple[Term, ...]:
    """Where the centers are, if that can be said in closed form."""
    found = (sections_in(center, variable) for center in centers)
    return tuple(dict.fromkeys(root for s in found if isinstance(s, Sections) and not s.families for root in s.roots))


def around_centers(centers: Iterable[Term], variable: str) -> tuple[Cut, ...]:
    """The centers that are more than points in closed form, and can be found."""
    rest = (c for c in centers if not isinstance(found := sections_in(c, variable), Sections) or found.families)
    cuts = (replace(cut_along(c, variable), center=True) for c in rest)
    known = (cut for cut in cuts if cut.roots is not None or slope_of(cut.surface, variable) is not None)
    return tuple(islice(known, MOST_CENTERS))


def along(cut: Cut) -> Term:
    """What of a cut's surface varies with the variable that it cuts."""
    return cut.surface if cut.product is None else cut.product.along
