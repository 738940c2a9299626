"""What crosses a surface as parameters move it, by points on the surface.

Owns `Surface`: the boundary term of one surface as means over unit cubes of one dimension less. In the coordinates u
of the chart, where the domain stands still, the boundary term of a surface phi(u, theta) = 0 is

    integral over the surface of [F] phi_theta / |grad phi| dS,      [F] the jump of the integrand times dx/du.

Its points are found along lines: for a variable j, the pivot, the other labels are drawn and phi = 0 is solved for u_j,
which turns dS into |grad phi|/|phi_j| du. Where the surface is parallel to the lines that weight has no variance.
Therefore, unless one pivot is known to be never nearly parallel, all variables of the surface are pivots, and a point
found along j counts with the weight phi_j^2/|grad phi|^2: these add up to 1 at each point of the surface, and

    sum over j of the mean over u without u_j of sum over roots of [F] phi_theta |phi_j| / |grad phi|^2

is the boundary term, with bounded weights.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from functools import cached_property
from itertools import zip_longest

import numpy as np
from msgspec import Struct

from potto.calculus.algebra.degree import plane
from potto.calculus.decomposition.surface_cuts import Product, WrittenSurface
from potto.core.terms import Term, const, function_of, mul, sub, var
from potto.integrate.decomposition.cuts import frame_rows
from potto.integrate.decomposition.meetings import Row, as_array
from potto.integrate.decomposition.sections import searched_rows
from potto.integrate.events import UNKNOWN_JUMP
from potto.integrate.levels import LevelPlan
from potto.integrate.montecarlo.cube_map import Chart, Point, label_of
from potto.integrate.montecarlo.lines import End, Line, label_name, leaving, line, offset
from potto.integrate.montecarlo.passages import ASIDE, Passage
from potto.integrate.montecarlo.pivot_choice import pivots
from potto.integrate.pieces import Evaluator, Sums, number_at, still
from potto.integrate.plan import Plan
from potto.integrate.rules.gauss import EPS
from potto.kernels.cells import Array, Cell, Ints, Mask, Value, pad

# A root that phi's own slope puts further away than this (in labels) is not one that phi passes through smoothly.
OFF = 1e-6
JUMPED = 16.0  # from how many times that on what phi is beside a root, measured by its slope, is not a power of it
ROUNDING = 16 * EPS  # of what crosses at one point
PLACED = 4 * EPS  # of the place of a point, going through its label
LINES = 1 << 11  # lines searched at once

Integrand = Callable[[Point, dict[int, Mask], int], Sums]


def factors(plan: Plan, drawn: int) -> list[tuple[Term, int, tuple[tuple[int, Term | None], ...]]]:
    """The surfaces of a plan as (term, level, what it decides), products taken apart.

    Where a factor of a product is 0 that decides nothing for itself, the product changes its side all the same. The
    sides of products that `drawn` variables don't reach are settled by whoever integrates those further in.
    """
    numbers = {group.cut.key: group.number for group in plan.groups}
    levels = {group: number for number, level in enumerate(plan.levels) for group in level.decided}
    found: dict[int, tuple[Term, int, list[tuple[int, Term | None]]]] = {}
    for group in plan.groups:
        product = group.cut.product
        term, way = (group.cut.surface, None) if product is None else (product.along, _rest(product, None))
        found[group.number] = (term, levels[group.number], [(group.number, way)])
    for group in plan.groups:
        product = group.cut.product
        for factor in () if product is None else product.outer:
            if product is None or factor.key not in numbers:
                continue
            _, level, forces = found[numbers[factor.key]]
            if level >= drawn or levels[group.number] < drawn:
                forces.append((group.number, _rest(product, factor)))
    return [(term, level, tuple(forces)) for term, level, forces in found.values()]


def _rest(product: Product, factor: WrittenSurface | None) -> Term:
    """A product without one of its outer factors, or without what varies along its variable."""
    rest = [f.form for f in product.outer if f != factor]
    return mul(const(product.sign), *rest, *(() if factor is None else (product.along,)))


class Surface(Struct, dict=True):
    """The boundary term of one surface.

    number: the level of its innermost variable. forces: the groups that it decides, and what tells which way round
    (None for the right way). stop: how many variables are drawn or solved for; those further in are left to the
    integrand. held: the first of the variables that parameters don't move.
    """

    chart: Chart
    term: Term
    number: int
    forces: tuple[tuple[int, Term | None], ...]
    stop: int
    held: int | None
    integrand: Integrand

    @property
    def machine(self) -> Evaluator:
        return self.chart.machine

    @cached_property
    def axes(self) -> tuple[int, ...]:
        """The numbers of the variables that the surface varies with."""
        levels = self.chart.plan.levels[: self.number + 1]
        return tuple(i for i, level in enumerate(levels) if level.variable in self.term.free)

    @cached_property
    def ends(self) -> tuple[End, ...]:
        """Which bound of each variable is infinite; one that depends on other variables is taken to be finite."""
        env = {name: still(value) for name, value in self.chart.env.items()}
        machine = self.machine.with_directions(0)
        names = {level.variable for level in self.chart.plan.levels}
        found: list[End] = []
        for level in self.chart.plan.levels[: self.number + 1]:
            values = [0.0, 0.0]
            for i, bound in enumerate((level.level.lo, level.level.hi)):
                if not bound.free & names:
                    values[i] = float(np.ravel(number_at(function_of(bound), machine, env).v)[0])
            infinite = [i for i in (0, 1) if np.isinf(values[i])]
            found.append((infinite[0], values[infinite[0]]) if len(infinite) == 1 else None)
        return tuple(found)

    @cached_property
    def pivots(self) -> tuple[int, ...]:
        """The variables that it is solved for."""
        return pivots(self.chart, self.term, self.axes, self.number)

    # Points on the surface

    def crossing(self, u: Array, pivot: int) -> Sums:
        """For n points of the other labels (n, stop - 1), the sum over the roots along the pivot."""
        n, k = u.shape[0], self.machine.directions
        nothing = Sums(np.zeros((1, n)), np.zeros((1, n)), np.zeros((1, k, n)), np.zeros((1, k, n)))
        along = line(self.chart.plan.term, self.term, pivot, self.number, self.ends)
        if along.plan is None:
            return nothing
        if n > LINES and along.plan.searched:
            return Sums.joined([self.crossing(u[i : i + LINES], pivot) for i in range(0, n, LINES)])
        labels: list[Array | None] = list(u.T)
        labels.insert(pivot, None)
        lo, hi, roots, weight = self.roots(labels, pivot, along, n)
        terms = [root for cut in along.plan.level.cuts for root in cut.roots or ()]
        t, et = nothing.t, nothing.et
        seen: list[Array] = []
        for row, term in zip_longest(roots, terms):
            root = as_array(row.x, n)
            inside = (root > np.minimum(lo.v, hi.v)) & (root < np.maximum(lo.v, hi.v))
            for other in seen:
                inside &= root != other
            seen.append(root)
            rows = np.flatnonzero(inside)
            if rows.size:
                label = as_array(label_of(lo, hi, root), n)
                off = (0.0 if row.e is None else row.e) + PLACED * _reach(lo, hi, root)
                here = [label if u is None else u for u in labels]
                found = self.at([u[rows] for u in here], pivot, as_array(off, n)[rows], term)
                t, et = (_with(whole, rows, part) for whole, part in zip((t, et), found, strict=True))
        if weight is not None:
            t, et = t * weight, et * weight
        return Sums(nothing.v, nothing.e, t, et)

    def roots(
        self, labels: list[Array | None], pivot: int, along: Line, n: int
    ) -> tuple[Cell, Cell, list[Row], Array | None]:
        """The bounds of the pivot and where the surface is crossed along it, nan for those that are not there.

        Closed forms come first, in the order of the line's cuts.
        Labels further out than the pivot are crowded, and that of the surface's innermost variable where the pivot is
        further out than it: they are put into `labels`, once for all that is asked at these points; with what weight,
        comes last.
        """
        machine = self.machine.with_directions(0)
        env = {name: still(value) for name, value in self.chart.env.items()}
        point, weight = Point(env, Cell(1.0)), None
        for number, level in enumerate(self.chart.plan.levels[: self.number + 1]):
            u = labels[number]
            if u is None:
                continue
            if number in along.follows:
                point.env[label_name(level.variable)] = Cell(offset(self.ends[number], u))
                continue
            ends: LevelPlan | None = level if number < pivot else None
            if number == self.number > pivot:
                ends = leaving(self.chart.plan.term, self.term, pivot, number)
            if ends is not None and point.env.keys() >= set(ends.frame.params):  # others follow the pivot
                labels[number], more = self.chart.crowded(ends, point.env, u)
                weight = more if weight is None else weight if more is None else weight * more
            point = self.chart.place(point, labels, number, number + 1, directions=0)
        assert along.plan is not None
        lo, hi, rows = frame_rows(along.plan, machine.tracking(), point.env)
        return lo, hi, rows + searched_rows(along.plan, point.env, lo, hi, n, machine, summed=True), weight

    def at(self, labels: list[Array], pivot: int, off: Array, root: Term | None) -> tuple[Array, Array]:
        """[F] phi_theta |phi_j|/|grad phi|^2 at points of the surface, and its error: (m, k, n) each.

        off: how far from the surface the points may be, by rounding. root: the pivot there, where it has a closed form.
        """
        k, n = self.machine.directions, off.size
        axes = self.pivots
        marked = {axis: k + i for i, axis in enumerate(axes)}
        wide = k + len(axes)
        point = self.placed(labels, pivot, marked, n)
        phi, slopes = self.slopes(self.term, point, wide, n)
        j = marked[pivot]
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            steep = np.abs(slopes[j])
            smooth = np.isfinite(slopes).all(axis=0) & (steep > 0) & (np.abs(phi) <= OFF * steep)
            rates = slopes[:k] / (steep * ((slopes[k:] / steep) ** 2).sum(axis=0))
            if self.passage is not None:  # at a pole its slope has the sign of neither side, where it touches of one
                along = point.env[self.chart.plan.levels[pivot].variable]
                assert isinstance(along, Cell)
                smooth &= self.passage.through(labels, pivot, slopes[j], along.t[j], smooth)
        odd = ~smooth
        if odd.any():
            rates = np.where(odd, self.beside(labels, pivot, marked, point, root), rates)
        unknown = np.isnan(rates).any(axis=0)
        if unknown.any():
            self.machine.note(UNKNOWN_JUMP)
        counts = (rates != 0).any(axis=0)
        costs = self.machine.costs
        if costs is not None:
            costs.sampled(self.term, rates)
        if not counts.any():  # nothing that is differentiated moves it here
            return np.zeros((1, k, n)), np.zeros((1, k, n))
        if self.chart.plan.hides:
            above, below = self.off_the_surface(labels, pivot, n)
        else:
            above, below = self.both_sides(point, pivot, off)
        with np.errstate(invalid="ignore", over="ignore"):  # where it counts for nothing
            jump, error = (above.v - below.v)[:, None, :], (above.e + below.e)[:, None, :]
            t, et = jump * rates, error * np.abs(rates)
            off = np.abs(t)
            off *= ROUNDING
            et += off
        if not counts.all():
            t, et = np.where(counts, t, 0.0), np.where(counts, et, 0.0)
        if unknown.any():
            t, et = np.where(unknown, 0.0, t), np.where(unknown, np.where(jump != 0, np.inf, 0.0), et)
        return t, et

    def both_sides(self, point: Point, pivot: int, off: Array) -> tuple[Sums, Sums]:
        """The integrand just above and just below the surface, at points that are `off` by so much along the pivot."""
        frozen = Point({name: still(v) for name, v in point.env.items()}, Cell(point.volume.v))
        name = self.chart.plan.levels[pivot].variable
        x = frozen.env[name]
        assert isinstance(x, Cell)
        frozen.env[name] = Cell(x.v, off)
        n, costs = off.size, self.machine.costs
        sides = self.sides(frozen, n)
        with nullcontext() if costs is None else costs.apart(1.0):
            above = self.integrand(frozen, sides, n)
            below = self.integrand(frozen, {g: np.logical_not(side) for g, side in sides.items()}, n)
        return above, below

    def off_the_surface(self, labels: Sequence[Array | None], pivot: int, n: int) -> tuple[Sums, Sums]:
        """The same where some sides can't be forced: from points so close to the surface that they fall on its sides.

        Two on each side tell by how much the integrand changes on the way to it.
        """
        costs, u = self.machine.costs, labels[pivot]
        assert u is not None
        found = []
        for way in (1.0, -1.0):
            near, far = (
                self.placed([*labels[:pivot], u + way * step, *labels[pivot + 1 :]], pivot, {}, n)
                for step in (ASIDE, 2 * ASIDE)
            )
            phi, _ = self.slopes(self.term, near, self.machine.directions, n)
            with nullcontext() if costs is None else costs.apart(0.5):
                one, two = (self.integrand(Point({x: still(v) for x, v in p.env.items()}, Cell(p.volume.v)), {}, n)
                            for p in (near, far))  # fmt: skip
            change = np.where(one.v == two.v, 0.0, two.v - one.v)
            found.append((phi, Sums(one.v - change, one.e + two.e + np.abs(change), one.t, one.et)))
        (phi, one), (_, other) = found
        up = phi >= 0
        above, below = (
            Sums(np.where(first, one.v, other.v), np.where(first, one.e, other.e), one.t, one.et) for first in (up, ~up)
        )
        return above, below

    def placed(self, labels: Sequence[Array | None], pivot: int, marked: dict[int, int], n: int) -> Point:
        """Points with every variable at its label, those of the axes moving. Cuts along the pivot's way are not known
        before it is; labels further out are crowded already (`roots`), those further in are here."""
        wide = self.machine.directions + len(marked)
        crowding = range(self.number + 1, self.stop)
        start = self.chart.start(n, wide)
        return self.chart.place(start, labels, 0, self.stop, marked, self.held, wide, crowding)

    def sides(self, point: Point, n: int) -> dict[int, Mask]:
        """The sides of what the surface decides, just above it."""
        sides: dict[int, Mask] = {}
        for group, way in self.forces:
            sides[group] = True if way is None else self.chart.above(way, point.env, n)
        return sides

    def beside(
        self, labels: Sequence[Array | None], pivot: int, marked: dict[int, int], point: Point, root: Term | None
    ) -> Array:
        """The same where phi has a pole, a kink, a jump or no slope: nothing if its sign does not change.

        Its root's formula, where there is one, tells how such a place moves; otherwise phi itself just beside it does,
        unless it jumps there from one finite value to another. nan where that is not known. In labels the formula moves
        with the bounds of variables that are held.
        """
        if root is not None and self.held is not None and root.free & {label_name(x) for x in self.term.free}:
            root = None
        wide = self.machine.directions + len(marked)
        below, above, slopes = self.around(labels, pivot, marked)
        change = (np.sign(above) - np.sign(below)) / 2
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            if root is None:
                far = np.maximum(np.abs(above), np.abs(below)) > JUMPED * ASIDE * np.abs(slopes[marked[pivot]])
            else:
                env = {**point.env, **self.labelled(labels, pivot, marked)}
                psi = sub(var(self.chart.plan.levels[pivot].variable), root)
                _, slopes = self.slopes(psi, Point(env, point.volume), wide, change.size)
                far = np.zeros(change.size, dtype=bool)
            steep = slopes[marked[pivot]]
            rates = slopes[: self.machine.directions] / (
                steep * ((slopes[self.machine.directions :] / steep) ** 2).sum(axis=0)
            )
        rates = np.where(far, np.nan, np.where(np.isfinite(rates), rates, 0.0))
        return np.where(change == 0, 0.0, rates * change)

    def around(self, labels: Sequence[Array | None], pivot: int, marked: dict[int, int]) -> tuple[Array, Array, Array]:
        """phi just below and just above points along the pivot, and its tangents just above."""
        u = labels[pivot]
        assert u is not None
        found = []
        for side in (-ASIDE, ASIDE):
            moved = self.placed([*labels[:pivot], u + side, *labels[pivot + 1 :]], pivot, marked, u.size)
            found.append(self.slopes(self.term, moved, self.machine.directions + len(marked), u.size))
        return found[0][0], found[1][0], found[1][1]

    @cached_property
    def passage(self) -> Passage | None:
        """What tells whether it is passed through at a point; None of a plane, which always is."""
        planar = plane(self.term, [level.variable for level in self.chart.plan.levels])
        return None if planar else Passage(self.chart, self.term, self.number)

    def labelled(self, labels: Sequence[Array | None], pivot: int, marked: dict[int, int]) -> dict[str, Value]:
        """What roots along the pivot are written in where bounds follow it."""
        wide = self.machine.directions + len(marked)
        env: dict[str, Value] = {}
        for number in range(pivot + 1, self.number + 1):
            u, end = labels[number], self.ends[number]
            if u is None:
                continue
            with np.errstate(divide="ignore"):
                slope = np.ones(u.size) if end is None else 1 / (1 - u) ** 2 if end[1] > 0 else -1 / u**2
            t = tuple(slope if marked.get(number) == d else None for d in range(wide))
            env[label_name(self.chart.plan.levels[number].variable)] = Cell(offset(end, u), None, t)
        return env

    def slopes(self, phi: Term, point: Point, wide: int, n: int) -> tuple[Array, Array]:
        """phi and its tangents: those of the parameters, then those of the labels; (wide, 1) where they are the same
        at all points."""
        function = function_of(phi)
        env = {name: pad(point.env[name], wide) for name in function.params}
        value = number_at(function, self.machine.with_directions(wide), env)
        t = np.broadcast_arrays(*(0.0 if x is None else x for x in value.t or (None,) * wide))
        return as_array(value.v, n), np.stack(t).reshape(wide, -1)


def _with(whole: Array, rows: Ints, part: Array) -> Array:
    """Rows (m, k, n) with what some of them bring added, which may have more components."""
    if len(whole) < len(part):
        whole = np.repeat(whole, len(part), axis=0)
    whole[..., rows] += part
    return whole


def _reach(lo: Cell, hi: Cell, x: Array) -> Array:
    """The largest number that a point's place is worked out from."""
    ends = [np.where(np.isfinite(end.v), np.abs(end.v), 0.0) for end in (lo, hi)]
    return np.maximum(np.maximum(*ends), np.abs(x))
