"""Iterated integration over segments between cuts, for a whole batch at once.

Owns `Iteration`: at each variable it cuts the bounds, settles on which side of every surface each segment lies,
leaves out the segments on which the integrand vanishes, and hands the rest to `work`.
"""

from __future__ import annotations

import numpy as np
from msgspec import Struct, field
from msgspec.structs import replace

from potto.core.terms import Term
from potto.integrate.adaptive.corner_peaks import peaks_at_ends
from potto.integrate.adaptive.refining import integrated
from potto.integrate.adaptive.root_sums import Rows, over_roots
from potto.integrate.columns import distinct
from potto.integrate.decomposition.corners import corner_rows, within_walls
from potto.integrate.decomposition.covered import uncovered
from potto.integrate.decomposition.critical_places import critical_rows
from potto.integrate.decomposition.cuts import Cuts, at_rest, finite_speeds, frame_rows, on_bounds, segments, standing
from potto.integrate.decomposition.dips import dip_rows
from potto.integrate.decomposition.effective_range import Ranges, pulled_in, reaches
from potto.integrate.decomposition.layers import layer_rows
from potto.integrate.decomposition.lifted_rows import counting
from potto.integrate.decomposition.meetings import Row, as_array
from potto.integrate.decomposition.sections import searched_rows
from potto.integrate.decomposition.shells import shells
from potto.integrate.decomposition.vanishing import zero_on
from potto.integrate.degenerate.coincidences import count_places, count_slivers, note_folds
from potto.integrate.degenerate.degeneracies import beneath, brush
from potto.integrate.degenerate.empty_ranges import Collapsed, collapsed_ranges, count_collapsed
from potto.integrate.degenerate.faces import Face
from potto.integrate.degenerate.kinks import note_flat
from potto.integrate.degenerate.narrow_panels import count_narrow
from potto.integrate.degenerate.scene import IteratedVariable
from potto.integrate.degenerate.undefined import lost_members, sides_at
from potto.integrate.degenerate.unplaced import unplaced
from potto.integrate.events import UNSEEN_MEETING, sides_hidden
from potto.integrate.levels import LevelPlan
from potto.integrate.panels.magnitude import Extent
from potto.integrate.panels.panel_batch import PanelBatch
from potto.integrate.pieces import Evaluator, Sums, dense, take
from potto.integrate.plan import Plan
from potto.integrate.rules.substitution import Segments
from potto.kernels.cells import Array, Bools, Cell, Ints, Mask, Value

NARROW = 1e-4  # the part of the range of a variable up to which a stretch may lie on either side of a surface


class Settled(Struct, frozen=True):
    """The sides of surfaces, per segment, and by group the segments on which a surface is not defined, so that it has
    none. unsure: the members, if any, of which that is rounding for a stretch that matters. doubtful: by group, the
    narrow stretches of which it is."""

    sides: dict[int, Mask]
    undefined: dict[int, Bools] = {}
    unsure: Ints | None = None
    doubtful: dict[int, Bools] = {}


class Iteration(Struct):
    """One plan being evaluated by one machine. `order` is the number of nodes per piece to start with.

    still: surfaces that don't move here, since someone else counts what their motion does. tracked: whether the
    integrand brings its rounding along at every node. face: what is integrated instead of the integrand, if anything.
    peaked: the variables at ends of whose segments the integrand has peaks.
    """

    plan: Plan
    machine: Evaluator
    order: int
    still: frozenset[Term] = frozenset()
    tracked: bool = False
    extent: Extent | None = None
    face: Face | None = None
    first: int = 0
    further_in: float = 1.0
    peaked: set[int] = field(default_factory=set)

    @property
    def degrees(self) -> tuple[int | None, ...]:
        """By variable the degree of what is integrated: what crosses a face has speeds, which are not polynomials."""
        return self.plan.degrees if self.face is None else ()

    @property
    def reads(self) -> frozenset[str]:
        """The names that what is integrated asks for: those of the integrand, and of the surface that a face lies on,
        which may be what a function that is passed has captured."""
        names = frozenset(self.plan.body.params)
        return names if self.face is None else names.union(self.face.psi.params)

    def whole(self, env: dict[str, Value], batch: int) -> Sums:
        """The integrals of a batch over all variables, with what they could come to at most counted as added up."""
        self.extent = Extent(len(self.plan.levels), self.machine.directions, batch)
        self.peaked = set()
        sums = self.run(0, env, batch, {}, self.machine, None, None, True)
        self.extent.count(sums)
        return sums

    def run(
        self, number: int, env: dict[str, Value], batch: int, sides: dict[int, Mask], machine: Evaluator,
        root: Ints | None = None, slack: Array | None = None, looks: bool = False,
    ) -> Sums:  # fmt: skip
        """Integrate over variable `number` and those further in, for a batch of environments.

        `root` says, of a batch of nodes, which member of the outermost batch each belongs to; None if there is one.
        `slack` says how many times the error may be larger of nodes that have less weight than others. `looks`: whether
        peaks are looked for at ends of segments, as they are once, at the first nodes of variables further out.
        """
        level = self.plan.levels[number]
        if self.plan.over is not None and number + 1 == len(self.plan.levels):
            return over_roots(self.plan, self.rows(level, env, batch, machine), env, batch, sides, machine)
        kin = None if not number else np.zeros(batch, dtype=np.int64) if root is None else root
        cuts, collapsed = self.cut(level, env, batch, machine, kin)
        seg = cuts.segments
        if self.extent is not None:
            self.extent.saw_range(number, seg, batch, root)
        scene = IteratedVariable(self, number, level, env, sides, machine, batch, root, slack)
        settled = self.sides_of(scene, seg)
        keep, lost = self.kept(scene, seg, settled)
        if machine.costs is not None and number + 1 == len(self.plan.levels):
            machine.costs.stretches(seg.a.size, seg.a.size if keep is None else keep.size)
        here, sides = (seg, settled.sides) if keep is None else (seg.pick(keep), take(settled.sides, keep))
        moving = cuts.moving and machine.directions > 0
        if looks and number not in self.peaked and peaks_at_ends(self, number, env, here, sides, machine):
            self.peaked.add(number)
        work = PanelBatch(self, number, level, env, here, sides, machine, moving, batch, root, slack,
                          cuts.conflict, cuts.paired, cuts.rested, looks)  # fmt: skip
        sums = integrated(work)
        if number == self.first and (lost_far_out := sums.undefined(batch)).size:
            self.nearer(work, sums, lost_far_out)
        if collapsed:
            sums = count_collapsed(scene, collapsed, sums)
        self.count_events(scene, cuts, sums)
        if settled.doubtful and not self.plan.hides:
            count_narrow(scene, seg, settled.sides, settled.doubtful, sums)
        for hidden in (settled.unsure, cuts.unplaced) if not number else ():  # single nodes further in may lie so
            if hidden is not None and hidden.size:
                machine.note(sides_hidden(level.variable), work.below(hidden))
                sums.unknown(hidden)
        if cuts.lost is not None:
            sums.e += cuts.lost
            sums.et += cuts.lost
        sums.v *= cuts.sign
        sums.t *= cuts.sign
        for gone in (cuts.bound_nan, lost):
            if gone is not None:
                sums.lose(gone)
        return sums

    def nearer(self, work: PanelBatch, sums: Sums, members: Ints) -> None:
        """Integrate again, for members that have come to no number, without what is so far out that it is next to
        nothing: a density is 0 there to rounding, and what it weighs overflows."""
        rows = np.nonzero(np.isin(work.seg.owner, members))[0]
        seg = work.seg.pick(rows)
        left_out = pulled_in(self.plan, work.number, work.env, seg, work.batch)
        if left_out is None:
            return
        sides = take(work.sides, rows)
        again = integrated(PanelBatch(
            self, work.number, work.level, work.env, seg, sides, work.machine, work.moving, work.batch, work.root,
            work.slack, work.conflict, work.paired, work.rested,
        ))  # fmt: skip
        again.e += self.further_in * left_out
        again.et += self.further_in * left_out
        sums.put(members, again.pick(members))

    def count_events(self, scene: IteratedVariable, cuts: Cuts, sums: Sums) -> None:
        """Add, or say, what cuts matter that lie on a bound or on one another, and surfaces that fold here."""
        machine = scene.machine
        if machine.directions and (cuts.meetings or cuts.edges):
            if self.plan.hides:
                places = [*(place.owner for place in cuts.meetings), *(place.owner for place in cuts.edges)]
                met = distinct(np.concatenate(places))
                machine.note(UNSEEN_MEETING, scene.below(met))
                sums.et[:, :, met] = np.inf
            else:
                count_places(scene, cuts, sums)
        if machine.directions and cuts.brushes and scene.number + 1 < len(self.plan.levels):
            brush(scene, cuts)
        if machine.directions and cuts.conflict and scene.number + 1 < len(self.plan.levels):
            beneath(scene, cuts)
        if cuts.slivers and not machine.frozen and not self.plan.hides:
            count_slivers(scene, cuts, sums)
        if machine.directions and cuts.folds:
            note_folds(scene, cuts)

    def kept(self, scene: IteratedVariable, seg: Segments, settled: Settled) -> tuple[Ints | None, Ints | None]:
        """The segments to integrate over, None for all; and the members that have no value."""
        keep = self.alive(settled.sides, seg, settled.undefined)
        if not settled.undefined:
            return keep, None
        lost = lost_members(scene, seg, settled.undefined, keep)
        rest = np.nonzero(~np.isin(seg.owner, lost))[0]
        return (rest if keep is None else np.intersect1d(keep, rest)), lost

    def cut(
        self, level: LevelPlan, env: dict[str, Value], batch: int, machine: Evaluator, kin: Ints | None
    ) -> tuple[Cuts, list[Collapsed]]:
        """Where the members are cut, and which of them have a range of length zero. kin: as `segments` takes it."""
        lo, hi, rows, lost = self.rows(level, env, batch, machine)
        if self.face is not None:  # its sections are nowhere, or anywhere
            rows = [row for row in rows if row.cut < 0 or level.level.cuts[row.cut].surface is not self.face.surface]
        if machine.costs is not None:
            asked = self.machine.directions > 0 and not machine.frozen  # others are by variables further out
            for number, cut in enumerate(level.level.cuts):
                if cut.jumps:
                    roots = [(row.x, row.t[: self.machine.directions]) for row in rows if row.cut == number]
                    machine.costs.saw(cut.surface, roots, lo.v, hi.v, asked)
        for row in rows if self.still else ():
            if row.cut >= 0 and level.level.cuts[row.cut].surface in self.still:
                row.t = ()
        if machine.side and machine.directions:
            rows = on_bounds(level, lo, hi, rows, batch, machine.directions, kin)
        cuts = segments(level, lo, hi, rows, batch, machine.directions, kin)
        if kin is None and level.decided:
            cuts.unplaced = unplaced(level, env, (lo, hi), rows, batch, machine)
        if not any(c.decides for c in level.level.cuts):
            cuts = at_rest(cuts) if self.resting(level, lo, hi, cuts.segments) else finite_speeds(cuts)
        cuts.lost = lost
        collapsed = collapsed_ranges(level, lo, hi, rows, batch, machine.directions)
        if machine.frozen:
            return standing(cuts), [ranges.at_rest() for ranges in collapsed]
        return cuts, collapsed

    def rows(self, level: LevelPlan, env: dict[str, Value], batch: int, machine: Evaluator) -> Rows:
        """The bounds of a variable, all candidate cuts, and the most that those matter which were not looked for."""
        lo, hi, rows = frame_rows(level, machine.tracking(), env)
        face = None if self.face is None else self.face.surface
        if level.walls:
            rows = within_walls(level, rows, env, batch, machine, face)
        if level.covers:
            rows = uncovered(level, rows, env, batch, machine, face)
        number = next(n for n, own in enumerate(self.plan.levels) if own is level)
        if (groups := self.plan.outline.lifted[number]) and (arrangement := self.plan.outline.arrangement):
            rows = counting(groups, level, rows, env, (lo, hi), batch, machine, arrangement, face)
        corners = corner_rows(level, env, lo, hi, batch, machine) if level.corners else []
        found, lost = self.searched(level, env, lo, hi, batch, machine)
        rows = rows + corners + found
        if self.extent is not None or self.face is not None:  # no line of a sample
            exponents, singular = self.plan.exponents[number], self.plan.singular[number]
            inner = self.plan.levels[number + 1 :]
            if exponents is not None:
                rows += layer_rows(
                    exponents, inner, level.variable, env, lo, hi, rows, batch, machine,
                    lambda: self.mattering(level, env, lo, hi, batch),
                )  # fmt: skip
            if singular is not None:
                rows += dip_rows(singular, inner, level.variable, env, lo, hi, batch, machine)
        return lo, hi, rows + shells(lo, hi, rows, batch), lost

    def resting(self, level: LevelPlan, lo: Cell, hi: Cell, seg: Segments) -> bool:
        """Whether no nodes are to move with the cuts of a variable along which what is integrated is continuous.

        Then the derivative along it, which nodes that move would need, is best left alone: near critical places it is
        the hardest of all. Where there is but one variable further in it costs little, and serves as a check, unless
        roots merge just here, and so move infinitely fast. Where bounds move, nodes have to.
        """
        if any(np.any(t) for bound in (lo, hi) for t in bound.t if t is not None):
            return False
        levels = self.plan.levels
        return (len(levels) > 2 and not any(own is level for own in levels[-2:])) or not np.isfinite(seg.ta).all()

    def searched(
        self, level: LevelPlan, env: dict[str, Value], lo: Cell, hi: Cell, batch: int, machine: Evaluator
    ) -> tuple[list[Row], Array | None]:
        """The cuts that numbers find, and the most that those may matter which lie where a density leaves nothing."""
        critical = level.level.critical
        if not (level.families or level.searched or critical):
            return [], None
        near, lost = self.ranges(level, env, lo, hi, batch)
        if level.level.variable in near:
            lo, hi = map(Cell, near[level.level.variable])
        summed = self.plan.over is not None and level is self.plan.levels[-1]
        rows = searched_rows(level, env, lo, hi, batch, machine, summed)
        if critical:
            face = None if self.face is None else self.face.surface
            arrangement = self.plan.outline.arrangement
            rows += critical_rows(critical, level.variable, env, lo, hi, near, batch, machine, arrangement, face)
        return rows, None if lost is None else self.further_in * lost

    def ranges(
        self, level: LevelPlan, env: dict[str, Value], lo: Cell, hi: Cell, batch: int
    ) -> tuple[Ranges, Array | None]:
        """How much of infinite ranges matters, of a variable and of those further in on which its critical places
        depend, and what is left out of it at most: (B,)."""
        number = next((n for n, own in enumerate(self.plan.levels) if own is level), None)
        if number is None:
            return {}, None
        low, high = (as_array(pick(lo.v, hi.v), batch) for pick in (np.minimum, np.maximum))
        further = range(number + 1, len(self.plan.levels)) if level.level.critical else ()
        if not (np.isinf(low).any() or np.isinf(high).any() or any(self.plan.levels[n].endless for n in further)):
            return {}, None
        return reaches(self.plan, env, (number, *further), (low, high), batch)

    def mattering(self, level: LevelPlan, env: dict[str, Value], lo: Cell, hi: Cell, batch: int) -> tuple[Array, Array]:
        """How much of the ranges of a variable matters, of infinite ones all where that is not known."""
        known = self.ranges(level, env, lo, hi, batch)[0].get(level.variable)
        return known or (as_array(lo.v, batch), as_array(hi.v, batch))

    def sides_of(self, scene: IteratedVariable, seg: Segments) -> Settled:
        """The sides of all surfaces decided so far: those of this variable from the segments' middles."""
        level = scene.level
        sides = take(scene.sides, seg.owner)
        if not level.decided:
            return Settled(sides)
        unsure: dict[int, Bools] = {}
        undefined: dict[int, Bools] = {}
        flat: dict[int, Bools] = {}
        at_middle, off = sides_at(level, scene.env, seg, scene.machine)
        up: Bools = at_middle > 0
        on_it: Bools = at_middle == 0
        hidden, unknown = np.abs(at_middle) < off, np.isnan(at_middle)
        told = ((undefined, unknown), (unsure, hidden), (flat, on_it & ~hidden))
        met = [(found, of, np.any(of, axis=1).tolist()) for found, of in told if of.any()]
        for number, (group, turned) in enumerate(zip(level.decided, level.turned, strict=True)):
            if any(outer not in sides for outer in turned) or (self.face is not None and group == self.face.group):
                continue  # one that is not defined, or has both
            side = up[number] | on_it[number] if self.plan.groups[group].up_at_zero else up[number]
            for outer in turned:
                side = side ^ np.logical_not(sides[outer])
            sides[group] = side
            for found, of, there in met:
                if there[number]:
                    found[group] = of[number]
        if flat and scene.machine.directions and not (scene.machine.side or scene.machine.frozen):
            note_flat(scene, seg, flat)
        if not unsure:
            return Settled(sides, undefined)
        wide = seg.b - seg.a > NARROW * np.bincount(seg.owner, seg.b - seg.a)[seg.owner]
        members = np.unique(seg.owner[wide & np.any(list(unsure.values()), axis=0)])
        doubtful = {group: hidden & ~wide for group, hidden in unsure.items() if (hidden & ~wide).any()}
        return Settled(sides, undefined, members if members.size else None, doubtful)

    def alive(self, sides: dict[int, Mask], seg: Segments, undefined: dict[int, Bools]) -> Ints | None:
        """The segments on which the integrand is not known to vanish; None for all of them."""
        zero = zero_on(self.plan.vanishing, sides)
        if zero is False:
            return None
        mask = np.broadcast_to(np.asarray(zero), seg.a.shape)
        if undefined:  # there it vanishes only if it does on both sides
            either = zero_on(self.plan.vanishing, {g: m for g, m in sides.items() if g not in undefined})
            mask = np.where(np.any(list(undefined.values()), axis=0), either, mask)
        return np.nonzero(~mask)[0] if mask.any() else None

    def across(self, face: Face) -> Iteration:
        """The same for what crosses a face."""
        return replace(self, face=face, extent=None)

    def body(self, env: dict[str, Value], sides: dict[int, Mask], machine: Evaluator) -> Value:
        """The integrand itself, on the sides given; or what crosses a face of it."""
        if self.face is not None:
            return self.face.crossed(self.plan, env, sides, machine)
        body = self.plan.body
        return machine.evaluate(body, env, self.plan.trace(sides))

    def inside(
        self, number: int, env: dict[str, Value], batch: int, sides: dict[int, Mask], machine: Evaluator,
        root: Ints | None = None,
    ) -> tuple[Array, Array]:  # fmt: skip
        """The integrand of variable `number` (with the variables further in integrated out) and its errors: (m, B)."""
        if number + 1 < len(self.plan.levels):
            sums = self.run(number + 1, env, batch, sides, machine, root)
            return sums.v, sums.e
        machine.count(batch)
        numbers, errors = dense(self.body(env, sides, machine.tracking()), 0, (batch,))
        return numbers[:, 0], np.zeros((numbers.shape[0], batch)) if errors is None else errors[:, 0]
