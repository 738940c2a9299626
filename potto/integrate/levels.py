"""The variables of an integral before any number: for each its frame, and the surfaces that cut it.

Owns `LevelPlan` and `Group`, and `group_levels` and `level_plan`, which make them.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

from msgspec import Struct

from potto.calculus.decomposition.conic_regions import polynomial
from potto.calculus.decomposition.critical import Within
from potto.calculus.decomposition.surface_cuts import ConicRegion, Cut
from potto.calculus.decomposition.sweep import Level
from potto.calculus.solving.solve import Family
from potto.core.terms import INF, Lam, Term, function_of, neg, postorder, prim, tuple_

# What the places are that are not cuts, of which none has a number below 0: hints, and such with which no nodes move.
HINT, RESTING = -1, -2
NOTHING = function_of(tuple_(()))
MANY_WALLS = 4  # from which on it is found out between which two of them something is integrated


class LevelPlan(Struct, frozen=True, dict=True):
    """One variable: its frame (bounds, then candidate cuts, as one tuple term) and what the cuts are.

    corners: cuts that are corners of regions.
    walls: rows of the frame, bounds not counted, beyond which nothing is integrated, on the side that the signs of
    `slopes` tell: above those with a slope below 0, below the others. Two roots of a surface are a wall on either side,
    where its square has a coefficient below 0.
    covers: the same of surfaces on one side of which no row of `covered` matters, and whose own those are.
    """

    level: Level
    frame: Lam
    rows: tuple[tuple[int, bool], ...]
    searched: tuple[Cut, ...]
    families: tuple[tuple[int, Family], ...]
    decided: tuple[int, ...]
    surfaces: Lam
    turned: tuple[tuple[int, ...], ...]
    corners: tuple[Corners, ...] = ()
    walls: tuple[tuple[int, ...], ...] = ()
    slopes: Lam = NOTHING
    covers: tuple[tuple[int, ...], ...] = ()
    covering: Lam = NOTHING
    covered: tuple[int, ...] = ()

    @property
    def variable(self) -> str:
        return self.level.variable

    def decides(self, cut: int) -> bool:
        """Whether what is integrated jumps at a candidate cut of this number, which is below 0 where it is none of a
        surface."""
        return cut >= 0 and self.level.cuts[cut].decides

    @cached_property
    def peaks(self) -> bool:
        """Whether it is known of places at which the integrand may be concentrated."""
        return bool(self.level.hints) or any(cut.center for cut in self.level.cuts)

    @cached_property
    def found(self) -> bool:
        """Whether numbers have to find what decides, or bends, along the variable."""
        families = any(not self.level.cuts[number].center for number, _ in self.families)
        return families or any(not cut.center for cut in self.searched)

    @cached_property
    def endless(self) -> bool:
        """Whether its range is written as an infinite one."""
        return any(node is INF for node in postorder(self.level.lo, self.level.hi))

    @cached_property
    def bounds(self) -> Lam:
        """The bounds alone, as a pair."""
        return function_of(tuple_((self.level.lo, self.level.hi)))


class Corners(Struct, frozen=True):
    """The corners of a region as a cut: its number, how many lines there are, the numbers of these and of conics, the
    variable further in with its bounds, and the surfaces of conics and lines; the rest as a `ConicRegion` has it."""

    cut: int
    lines: int
    numbers: Lam
    within: Within
    surfaces: Lam
    polynomial: Lam | None
    covers: tuple[int, ...]


class Group(Struct, frozen=True):
    """A surface with jumps: which branches it decides, and along which traces."""

    number: int
    cut: Cut

    @property
    def up_at_zero(self) -> bool:
        """On which side a stretch lies along which the canonical surface is 0: that of max(x, 0) > 0 where x < 0."""
        if not self.cut.jumps:
            return True
        jump = self.cut.jumps[0]
        return jump.strict != (jump.orientation > 0)


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
    families: list[tuple[int, Family]] = []
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
    covers, covering, covered = _covers(level, rows)
    deciding, turned = _deciding(decided, groups)
    surfaces = function_of(tuple_(deciding))
    corners = tuple(_corners(number, cut.corners) for number, cut in enumerate(level.cuts) if cut.corners)
    return LevelPlan(
        level,
        function_of(tuple_(tuple(terms))),
        tuple(rows),
        tuple(searched),
        tuple(families),
        decided,
        surfaces,
        turned,
        corners,
        *_walls(level, rows),
        covers=covers,
        covering=covering,
        covered=covered,
    )


def _corners(cut: int, region: ConicRegion) -> Corners:
    numbers = (number for edge in (*region.lines, *region.conics) for number in edge)
    surfaces = function_of(tuple_(region.surfaces))
    polynomial = None if region.polynomial is None else function_of(region.polynomial)
    rows = function_of(tuple_(tuple(numbers)))
    return Corners(cut, len(region.lines), rows, region.within, surfaces, polynomial, region.covers)


def _walls(level: Level, rows: Sequence[tuple[int, bool]]) -> tuple[tuple[tuple[int, ...], ...], Lam]:
    """The rows beyond which nothing is integrated, and what tells on which side of them something is."""
    walls, slopes = _ends(level, rows, [cut.holds for cut in level.cuts])
    return (walls, slopes) if len(walls) >= MANY_WALLS else ((), NOTHING)


def _covers(level: Level, rows: Sequence[tuple[int, bool]]) -> tuple[tuple[tuple[int, ...], ...], Lam, tuple[int, ...]]:
    """The rows between which, or beyond which, others don't matter, what tells on which side, and those others."""
    covers, slopes = _ends(level, rows, [cut.covers or 0 for cut in level.cuts])
    return covers, slopes, tuple(row for row, (n, _) in enumerate(rows) if n >= 0 and level.cuts[n].covers is not None)


def _ends(
    level: Level, rows: Sequence[tuple[int, bool]], sides: Sequence[int]
) -> tuple[tuple[tuple[int, ...], ...], Lam]:
    """The one or two rows of each cut that has a side, 1 or -1, and the coefficients of its highest power as it is
    positive there."""
    own: dict[int, list[int]] = {}
    for row, (number, _) in enumerate(rows):
        own.setdefault(number, []).append(row)
    ends: list[tuple[int, ...]] = []
    slopes: list[Term] = []
    for number, (cut, side) in enumerate(zip(level.cuts, sides, strict=True)):
        if side and cut.product is None and not cut.families and 1 <= len(own.get(number, ())) <= 2:
            found = polynomial(cut.surface, level.variable)
            if found is not None and len(found) == 1 + len(own[number]):
                ends.append(tuple(own[number]))
                slopes.append(found[0] if side > 0 else neg(found[0]))
    return tuple(ends), function_of(tuple_(tuple(slopes)))


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
