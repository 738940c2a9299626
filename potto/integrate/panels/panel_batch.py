"""The panels of a batch of integrals over one variable: nodes, values, estimates.

Owns `PanelBatch`. Each panel is integrated by a Gauss rule; what the next variable in gives at the nodes
comes from the same procedure one level down (`Iterated`). Refinement is not its business (`adaptive/refining`).
"""

from __future__ import annotations

from contextlib import nullcontext
from functools import cached_property

import numpy as np
from msgspec import Struct

from potto.integrate.columns import distinct
from potto.integrate.decomposition.cuts import NARROW, ONE_PLACE
from potto.integrate.events import BUDGET_SPENT, TwoSided, Unsearched
from potto.integrate.levels import LevelPlan
from potto.integrate.panels.iterated import Iterated
from potto.integrate.panels.mending import mend
from potto.integrate.panels.roundoff import (
    ASIDE,
    LOOKED_AT,
    WITHIN,
    coarse,
    few_doubles,
    misplaced,
    noise,
    note_ends,
    part_of,
    shake,
    share,
    together,
    worst_part,
)
from potto.integrate.pieces import Crossing, Ends, Evaluator, Pieces, Sums, all_of, column, dense, gather, still, take
from potto.integrate.rules import substitution
from potto.integrate.rules.gauss import EPS, GaussRule, gauss, truncation
from potto.integrate.rules.substitution import Segments
from potto.kernels.cells import Array, Bools, Cell, Ints, Mask, Number, Value, pad

CHUNK = 1 << 15  # points per kernel call: a few buffers of this length fit the second-level cache
MOST_SLACK = 1e6  # how many times the error of a node may be larger that hardly counts
UNSURE = 1e-9  # how far off cuts may be, in parts of a segment, until it matters that integrands bend beside them
# From which part of it on rounding at both ends may be what is left where an integrand vanishes: places within tell.
HIDDEN = 2.0**-40
# Up to which part of an integrand its rounding within is no more than what is counted for its variable.
CLEAR = 16 * EPS
# By which power of the distance from a turning point integrands, and their derivatives, grow at most, nearly; how close
# to it they are looked at, in the coordinate that a segment is run through by, and how many times as large as in the
# middle those are there that grow.
POWER, OF_DERIVATIVES, CLOSE, STEEP = 1.0, 1.5, 1e-3, 30.0
BESIDE = 1e-9  # how far from the ends of a segment, in parts of it, it is looked at just inside


class PanelBatch(Struct, dict=True):
    """The integrals of one batch over one variable."""

    parent: Iterated
    number: int
    level: LevelPlan
    env: dict[str, Value]
    seg: Segments
    sides: dict[int, Mask]
    machine: Evaluator
    moving: bool
    batch: int
    root: Ints | None = None
    slack: Array | None = None
    conflict: bool = False
    paired: bool = False
    rested: bool = False
    looks: bool = False
    width: int = 1
    ends: Ends | None = None
    endless: Array | None = None  # (k, B) the tangents that are infinite, with their signs; 0 for others
    filled: Array | None = None  # (B,) which part of the range integrands take up, where that is known
    steps: Crossing | None = None  # what crosses faces at which cuts only bends were expected
    misplaced: Array | None = None  # (m, k, S) what the rounding of the ends of segments means for the fixed form
    at_ends: Array | None = None  # (2, m, 2, S) the integrand and its slope at the ends of segments
    exact: int | None = None  # how many nodes do, where that is known

    def __post_init__(self) -> None:
        self.k = self.machine.directions
        # How many times what it comes to an integral further in adds up: for values, for tangents.
        self.cancels: Array = np.ones((2, self.batch))
        # What is added up further in, on the average, where it comes to nothing.
        self.hidden: Array = np.zeros((2, self.batch))
        self.last = self.number + 1 == len(self.parent.plan.levels)
        self.tracked = self.parent.tracked  # whether the integrand brings its rounding along at every node
        # Without forced sides there are no values on a surface: only the moving form does without them.
        self.both = self.moving and not self.parent.plan.hides
        self.inner = self.machine.with_directions(self.k + 1) if self.moving else self.machine
        with np.errstate(divide="ignore", invalid="ignore"):
            off = np.maximum(self.seg.ea, self.seg.eb) / (self.seg.b - self.seg.a)
        hints = (level.peaks for level in self.parent.plan.levels[self.number :])
        self.hinted = self.number in self.parent.peaked or any(hints)
        # Whether places are not known at which sections further in cross, appear or turn.
        unsearched = any(event.variable == self.level.variable for event, _ in self.machine.events.every(Unsearched))
        self.blind = unsearched or not all(own.level.complete for own in self.parent.plan.levels[self.number + 1 :])
        self.bends = not self.last and bool((off > UNSURE).any())  # beside cuts, by more than nothing

    # Channels: per component the value, then per direction the moving form, then (if both) the fixed form

    def enough(self) -> int | None:
        """How many nodes do for an integrand that is a polynomial between its cuts: so many that it is 0 where it is 0
        at all of them, since they also tell its size; where nodes round, one more, for the slope that mends it. Not
        where doubles are coarse, nor where surfaces coincide: the faster one binds, and that changes uncut."""
        binds = self.k and (self.machine.side or self.machine.events.every(TwoSided))
        if not self.last and (binds or coarse(self.seg)):
            return None
        degree = self.parent.degrees[self.number] if self.parent.degrees and not self.seg.kind.any() else None
        few = not self.last and few_doubles(self.seg, (self.seg.b - self.seg.a)[:, None])
        return None if degree is None or degree >= self.parent.order else degree + (2 if few else 1)

    def measure(self, p: Pieces, order: int, whole: bool = False) -> Pieces:
        """Integrals, errors and rounding floors of pieces, chunk by chunk, by the rule with `order` nodes.

        `whole`: the pieces are the segments.
        """
        rows = max(1, min(CHUNK, self.machine.settings.max_evals) // order)  # by so much a budget may be overrun
        if p.segment.size > rows:
            return self.in_chunks(p, order, rows)
        rule = gauss(order)
        if whole:
            seg = self.seg
            x, weight, label = substitution.points(seg, rule.nodes[None])
        else:
            seg = self.seg.pick(p.segment)
            u, rest, du = substitution.grade(p.u0, p.u1, p.end, rule.nodes)
            x, dx, label = substitution.points(seg, u, rest)
            weight = dx * du
        if seg.kind.any() or p.end.any():
            x = substitution.off_the_ends(seg, x)
        off = None
        if weight.shape[1] == 1 and few_doubles(seg, weight):
            off, label = substitution.displaced(seg, x, label)
        h, inner = self.values(seg, p.segment, x, label, weight)
        if not whole:
            mend(self.values, seg, p.segment, u, du, h, inner)
        if off is not None:
            part = off * (seg.b - seg.a)[:, None] / weight
            slope = h @ rule.derivative
            h = np.where(np.isfinite(slope) & (np.abs(part) < 0.1), h - part * slope, h)
        self.estimate(p, seg, h, rule, shake(p, seg, x, weight, off is not None))
        if seg.kind.any():
            power = OF_DERIVATIVES if self.k else POWER
            blur = None if self.radicands is None else self.radicands[:, p.segment]
            p.floor = p.floor + (np.abs(h) * substitution.trembling(seg, x, power, blur)) @ rule.weights
        if inner is not None:
            p.floor = p.floor + np.abs(inner) @ rule.weights
        return p

    def in_chunks(self, p: Pieces, order: int, rows: int) -> Pieces:
        """So many pieces at a time; what is left when far more is spent than there was is not known."""
        parts: list[Pieces] = []
        for start in range(0, p.segment.size, rows):
            if parts and self.machine.overdrawn():
                rest = p.places(slice(start, None))
                self.machine.note(BUDGET_SPENT, self.below(distinct(self.seg.owner[rest.segment])))
                parts.append(rest.unmeasured(parts[0]))
                break
            parts.append(self.measure(p.places(slice(start, start + rows)), order))
        return all_of(parts)

    def estimate(self, p: Pieces, seg: Segments, h: Array, rule: GaussRule, shake: Array) -> None:
        """Integrals of pieces from the values of their channels (C, P, n), their errors and rounding floors."""
        coefficients = h @ rule.transform
        size, height = np.abs(coefficients), np.abs(h)
        p.integral = coefficients[..., 0]
        if self.exact is None or rule.nodes.size < self.exact:
            p.error = truncation(size, (seg.kind != substitution.LINEAR) & ((p.u0 == 0) | (p.u1 == 1)))
        else:
            p.error = np.zeros(size.shape[:-1])
        p.coefficients, p.heights = coefficients, height
        p.size = height @ rule.weights
        p.rest, led = size[..., -2:].sum(axis=-1), np.moveaxis(coefficients @ rule.ends, -1, 0)
        p.led = led.reshape(-1, p.u0.size)
        if self.ends is not None:
            stride = height.shape[0] // self.width
            p.most = height[::stride].max(axis=-1)
            p.ends, p.tail = np.concatenate(led[:, ::stride]), p.rest[::stride]
        else:
            p.most = p.ends = p.tail = np.empty((0, p.u0.size))
        p.floor = 4 * EPS * p.size + (size @ rule.slopes) * shake
        if self.ends is not None and self.last and not self.tracked:
            p.floor += noise(self.ends, self.width, p, seg)
        if self.both or self.bends or self.rested:
            if self.at_ends is None:
                self.at_ends = np.zeros((2, self.width, 2, self.seg.a.size))
            note_ends(self.at_ends, p, seg, coefficients[:: height.shape[0] // self.width], rule)
        if self.k:
            # speeds are rounded too, and so are the places of the cuts, which matters where they are close together
            place = np.maximum(seg.ea, seg.eb) / (seg.b - seg.a)
            place = np.where(np.isfinite(place), place, 0.0)
            tangents = p.floor.reshape(self.width, -1, p.u0.size)[:, 1:]
            tangents *= 4
            tangents += place * p.size.reshape(self.width, -1, p.u0.size)[:, 1:]
            if self.both and not self.last:
                at_ends = (coefficients @ rule.ends).reshape(self.width, -1, p.u0.size, 2)[:, 1 + self.k :]
                index, lost = misplaced(p, seg, at_ends)
                if self.misplaced is None:
                    self.misplaced = np.zeros((self.width, self.k, self.seg.a.size))
                self.misplaced[:, :, p.segment[index]] = lost
        broken = ~np.isfinite(p.integral)
        if broken.any():
            p.error = np.where(broken, np.inf, p.error)

    def values(self, seg: Segments, index: Ints, x: Array, label: Array, weight: Array) -> tuple[Array, Array | None]:
        """The channels at the nodes, times the weight: (C, P, n), and the errors that came with them."""
        numbers, errors, common = self.integrand(index, x, weight)
        k, self.width = self.k, numbers.shape[0]
        fixed = [*range(1 + k), *(range(1, 1 + k) if self.both else ())]
        h, bound = numbers[:, fixed], None if errors is None else errors[:, fixed]
        for d in range(k) if self.moving else ():
            v, dv = substitution.velocity(seg, label, d)
            h[:, 1 + d] += numbers[:, 1 + k] * v
            h[:, 1 + d] += numbers[:, 0] * dv
            if bound is not None and errors is not None:
                bound[:, 1 + d] += np.abs(v) * errors[:, 1 + k] + np.abs(dv) * errors[:, 0]
                if common is not None:
                    bound[:, 1 + d] -= together(common, numbers[:, 1:], v, d)
        h *= weight
        if bound is not None:
            bound = (bound * np.abs(weight)).reshape(-1, *x.shape)
        return h.reshape(-1, *x.shape), bound

    def integrand(self, index: Ints, x: Array, weight: Array | None = None) -> tuple[Array, Array | None, Array | None]:
        """F, D_theta F and, if nodes move, dF/dx at nodes, (m, 1 + k or more, P, n); their error bounds; and the part
        of the tangents' that is one factor of all of them.

        weight: (P, n) or (P, 1), how much the nodes of a rule count, but for its own weights.
        """
        owner = self.seg.owner[index]
        k, name = self.k, self.level.variable
        tangent: tuple[Number | None, ...] = (None,) * k + ((1.0,) if self.moving else ())
        names = self.parent.reads if self.last else self.env
        here = {n: pad(v, self.inner.directions) for n, v in self.env.items() if n in names}
        if self.last:
            env = column(gather(here, owner))
            env[name] = Cell(x, None, tangent)
            masks = {g: m[index][:, None] if isinstance(m, np.ndarray) else m for g, m in self.sides.items()}
            self.machine.count(x.size)
            return *dense(self.parent.body(env, masks, self.inner), k + self.moving, x.shape), None
        n = x.shape[1]
        flat = np.repeat(np.arange(index.size), n)
        env = gather(here, owner[flat])
        env[name] = Cell(x.reshape(-1), None, tangent)
        masks = {g: m[index[flat]] if isinstance(m, np.ndarray) else m for g, m in self.sides.items()}
        less = self.spared(index, n, None if weight is None else np.broadcast_to(np.abs(weight), x.shape))
        further = self.number + 1, env, x.size, masks, self.inner, self.below(owner[flat]), less, self.looks
        sums = self.parent.run(*further).widened(self.width)
        if sums.gross is not None:
            self.count_cancelling(sums, sums.gross, owner[flat])
        numbers, errors = (part.reshape(*part.shape[:2], *x.shape) for part in sums.channels())
        return numbers, errors, None if sums.common is None else sums.common.reshape(sums.v.shape[0], -1, *x.shape)

    def of_rounding(self) -> Bools:
        """The segments that rounding leaves between two places that are one, beside others that it is not part of."""
        seg, size = self.seg, self.seg.b - self.seg.a
        few: Bools = size < NARROW * np.maximum(np.abs(seg.a), np.abs(seg.b))
        return few & (size < ONE_PLACE * np.bincount(seg.owner, size)[seg.owner]) if few.any() else few

    def spared(self, index: Ints, n: int, weight: Array | None) -> Array | None:
        """How many times the error of integrals further in may be larger at n nodes each of segments whose members have
        less weight than others, and by itself less than the mean; without end where a segment is but rounding."""
        seg, owner = self.seg, self.seg.owner[index]
        own = None if self.slack is None else np.repeat(self.slack[owner], n)
        if (nothing := self.of_rounding()[index]).any():
            own = np.where(np.repeat(nothing, n), np.inf, 1.0 if own is None else own)
        if weight is None or self.filled is None:
            return own
        nodes = np.bincount(owner, minlength=self.batch) * n
        reach = self.filled * np.bincount(seg.owner, seg.b - seg.a, minlength=self.batch)
        mean = (np.where(np.isfinite(reach), reach, 0.0) / np.maximum(nodes, 1))[owner]  # far out what counts is small
        with np.errstate(divide="ignore", invalid="ignore"):
            times: Array = np.fmax(1.0, np.fmin(mean[:, None] / weight, MOST_SLACK)).ravel()
        return times if own is None else times * own

    def count_cancelling(self, inner: Sums, added: Array, owner: Ints) -> None:
        """Keep how many times what they come to integrals further in add up, on the whole, for each of the batch.

        added: (2, N) what they add up; owner: (N,) whose they are.
        """
        most = np.abs(inner.v).max(axis=0), np.abs(inner.t).max(axis=(0, 1), initial=0.0)
        for row, (gross, size) in enumerate(zip(added, most, strict=True)):
            fine = np.isfinite(gross) & np.isfinite(size)
            up, down = (np.bincount(owner[fine], x[fine], minlength=self.batch) for x in (gross, size))
            times = np.divide(up, down, out=np.ones(self.batch), where=down > 0)
            self.cancels[row] = np.maximum(self.cancels[row], times)
            if (nothing := (down == 0) & (up > 0)).any():
                mean = up / np.maximum(np.bincount(owner, minlength=self.batch), 1)
                self.hidden[row] = np.maximum(self.hidden[row], np.where(nothing, mean, 0.0))

    def below(self, owner: Ints) -> Ints | None:
        """For members of the next batch, the members of the outermost one."""
        if self.number == 0:
            return owner if self.batch > 1 else None
        return None if self.root is None else self.root[owner]

    def end_values(self) -> Ends | None:
        """F at both ends of every segment, sides as on the segment; None where it is not needed."""
        if not self.last and not self.hinted and not (self.moving and self.sweeps()):
            return None
        seg = self.seg
        owner = np.concatenate((seg.owner, seg.owner))
        sides = {g: np.concatenate((m, m)) if isinstance(m, np.ndarray) else m for g, m in self.sides.items()}
        costs, count = self.machine.costs, seg.a.size
        with nullcontext() if costs is None else costs.ends(seg.ta, seg.tb, self.parent.machine.directions):
            f, e = self.still_at(np.concatenate(self.just_inside()), owner, sides)
        part = np.minimum(share(f[:, :count], e[:, :count]), share(f[:, count:], e[:, count:]))
        if self.last and not self.tracked:
            part = self.seen_within(part)
            if (part >= 1).any():  # a part of nothing says nothing
                self.inner, self.tracked = self.inner.tracking(), True
        return Ends(f[:, :count], f[:, count:], e[:, :count], e[:, count:], part)

    @cached_property
    def radicands(self) -> Array | None:
        """How far from turning points, at the left and right ends of segments, the integrand's rounding puts them:
        (2, S). As seen close by, where values grow like the inverse of a square root of the distance; else 0."""
        seg = self.seg
        if not self.last or not seg.turning.any():
            return None
        found = np.zeros((2, seg.a.size))
        ends = (substitution.LEFT, CLOSE, seg.left), (substitution.RIGHT, 1 - CLOSE, seg.right)
        for row, (kind, u, turn) in enumerate(ends):
            index = np.flatnonzero(np.isin(seg.kind, (kind, substitution.BOTH)))
            if index.size:
                place = np.full((index.size, 1), u)
                near, off = (each[..., 0] for each in self.seen(index, place))
                inside = self.seen(index, np.full((index.size, 1), 0.5))[0][..., 0]
                part = np.where(near > STEEP * inside, part_of(near, off), 0.0).max(axis=0)
                x, _, _ = substitution.points(seg.pick(index), place)
                found[row, index] = (
                    2 * np.where(part > CLEAR, np.minimum(part, 1.0), 0.0) * np.abs(x[:, 0] - turn[index])
                )
        return found

    def seen_within(self, at_ends: Array) -> Array:
        """Which part of F its rounding is on segments, (m, S): that at their ends, which are often whole numbers, where
        sums are exact, unless it is more within. Of many segments some are looked at, and all if these say so."""
        hidden: Bools = np.any(at_ends > HIDDEN, axis=0)
        count = at_ends.shape[1]
        index = np.union1d(np.linspace(0, count - 1, min(count, LOOKED_AT)).astype(np.int64), np.flatnonzero(hidden))
        clear = np.maximum(at_ends, CLEAR)
        within = self.share_within(index)
        if index.size < count and (within > clear[:, index])[:, ~hidden[index]].any():
            index = np.arange(count)
            within = self.share_within(index)
        part = at_ends.copy()
        part[:, index] = np.where(hidden[index] | (within > clear[:, index]), within, at_ends[:, index])
        return part

    def share_within(self, index: Ints) -> Array:
        """Which part of F its rounding is within segments: (m, I)."""
        return worst_part(*self.seen(index, np.tile((*WITHIN, *ASIDE), (index.size, 1))))

    def seen(self, index: Ints, u: Array) -> tuple[Array, Array]:
        """The size of F, and its rounding, at places u (I, n) of segments, not counted as evaluations: (m, I, n)."""
        x, _, _ = substitution.points(self.seg.pick(index), u)
        rows = np.repeat(index, u.shape[1])
        sides = take(self.sides, rows)
        here = self.standing(x.ravel(), self.seg.owner[rows])
        numbers, errors = dense(
            self.parent.body(here, sides, self.machine.with_directions(0).tracking()), 0, rows.shape
        )
        off = np.zeros(numbers.shape) if errors is None else np.where(np.isfinite(errors), errors, 0.0)
        size, lost = (np.abs(row[:, 0]).reshape(-1, *x.shape) for row in (numbers, off))
        return size, lost

    def still_at(self, x: Array, owner: Ints, sides: dict[int, Mask]) -> tuple[Array, Array]:
        """F at places of members, without tangents, and its rounding, where F is finite: (m, N) each."""
        here, frozen = self.standing(x, owner), self.machine.with_directions(0)
        f, e = self.parent.inside(self.number, here, x.size, sides, frozen, self.below(owner))
        return f, np.where(np.isfinite(e), e, 0.0)

    def standing(self, x: Array, owner: Ints) -> dict[str, Value]:
        """The environments of places of members, in which nothing moves."""
        names = self.parent.reads if self.last else self.env
        here = gather({n: still(v) for n, v in self.env.items() if n in names}, owner)
        return {**here, self.level.variable: Cell(x)}

    def just_inside(self) -> tuple[Array, Array]:
        """The ends of segments; points next to them where on the ends themselves it is not known what is further in."""
        seg = self.seg
        if self.parent.plan.hides:
            width = np.where(np.isfinite(seg.b - seg.a), seg.b - seg.a, 0.0)
            return seg.a + BESIDE * width, seg.b - BESIDE * width
        if self.last or not seg.blur.any():
            return seg.a, seg.b
        aside = np.where((seg.kind == substitution.LINEAR) & (seg.blur < BESIDE * (seg.b - seg.a)), seg.blur, 0.0)
        return seg.a + aside[0], seg.b - aside[1]

    def sweeps(self) -> bool:
        """Whether an end moves at which the integrand may jump: not where only something further in changes."""
        seg = self.seg
        follows = np.zeros(seg.a.size + 1, dtype=bool)
        follows[1:-1] = (seg.owner[1:] == seg.owner[:-1]) & (seg.a[1:] == seg.b[:-1])
        return bool(seg.ta[:, ~(follows[:-1] & (seg.rank == 1))].any() or seg.tb[:, ~follows[1:]].any())
