"""Sections of surfaces that have no closed form: periodic families, and roots found by numbers.

Owns `searched_rows`. A family is a root for each integer in a range that the bounds give. Where nothing is known but
the surface itself, cells with one root each are told apart by enclosures (`brackets`); where these are not to be had (a
call, a conditional) sign changes are looked for on a grid that is refined where the surface comes close to zero without
crossing it. Each is polished; how a root moves follows from the surface's own derivatives.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from potto.calculus.solving.enclosable import slope_of
from potto.calculus.solving.solve import Family
from potto.core.terms import Lam, Term, function_of
from potto.integrate.columns import side_by_side
from potto.integrate.decomposition.meetings import SEARCHED, Row, as_array
from potto.integrate.decomposition.root_isolation import at_label, between, isolated
from potto.integrate.events import BUDGET_SPENT, ROOTS_NOT_SEPARATED, TOO_MANY_ROOTS, Unsearched
from potto.integrate.levels import LevelPlan
from potto.integrate.pieces import Evaluator, gather, number_at, still
from potto.integrate.rules.gauss import EPS
from potto.kernels.cells import Array, Bools, Cell, Ints, Number, Value, pad

GRID = 64  # cells of a range along which nothing but values is known
MOST_IN_FAMILY = 100_000  # roots of a periodic surface for one member
BISECTIONS = 64  # halvings at most: what they leave of a range is less than the rounding of its ends
# Kinks that are cut at, for each member: next to x = 0 those of sin(1/x) < y beside y < x are without number, and what
# lies there is refined like all else that is not smooth. 256 of them take as long as 0.3 s.
MOST_KINKS = 256
JUMP = 8.0  # a surface that is so many times its rounding, and that of the place, where its sign changes jumps there
LEVEL = 1e-9  # a slope that is such a part of that beside it is none
BESIDE = 2.0**-27  # how far from a pole, as a part of where it is, it is asked how it moves


def searched_rows(
    level: LevelPlan, env: dict[str, Value], lo: Cell, hi: Cell, batch: int, machine: Evaluator, summed: bool = False
) -> list[Row]:
    """The candidate cuts of one variable beyond the closed-form ones. summed: what is integrated is a sum over them, so
    that each counts as those do at which something jumps."""
    rows: list[Row] = []
    for number, family in level.families:
        rows += _family(level, number, family, env, lo, hi, batch, machine)
    low, high = as_array(np.minimum(lo.v, hi.v), batch), as_array(np.maximum(lo.v, hi.v), batch)
    for cut in level.searched:
        along = _Along(level.level.cuts.index(cut), cut.decides or summed, cut.surface, level.variable, env, machine)
        rows += along.searched(low, high)
    return rows


def _at(term: Term, variable: str, x: Number, env: dict[str, Value], machine: Evaluator) -> Number:
    """A term's value with the variable at x, by a machine without directions."""
    function = function_of(term)
    here = {n: still(v) for n, v in env.items() if n in function.params}
    here[variable] = Cell(x)
    return number_at(function, machine.with_directions(0), here).v


def _family(
    level: LevelPlan,
    cut: int,
    family: Family,
    env: dict[str, Value],
    lo: Cell,
    hi: Cell,
    batch: int,
    machine: Evaluator,
) -> list[Row]:
    ends = [as_array(_at(family.inner, level.variable, x.v, env, machine), batch) for x in (lo, hi)]
    low, high = as_array(np.minimum(lo.v, hi.v), batch), as_array(np.maximum(lo.v, hi.v), batch)
    for stop in family.stops:
        at = as_array(_at(stop, level.variable, lo.v, env, machine), batch)
        inside = (at > low) & (at < high)
        ends.append(np.where(inside, as_array(_at(family.inner, level.variable, at, env, machine), batch), np.nan))
    stack = np.stack(ends)  # nan where an end or a stop does not count
    known = ~np.isnan(stack)
    first = np.ceil(np.where(known, stack, np.inf).min(axis=0) - 1e-6)
    last = np.floor(np.where(known, stack, -np.inf).max(axis=0) + 1e-6)
    spans = np.where(np.isfinite(first) & np.isfinite(last), last - first + 1, 0.0)
    count = float(spans.max(initial=0.0))
    # At a node at infinity of a variable further out nothing counts.
    outer = [env[name] for name in family.inner.free - {level.variable}]
    far = np.any([np.isinf(as_array(cell.v, batch)) for cell in outer if isinstance(cell, Cell)], axis=0)
    if (np.isinf(stack).any(axis=0) & ~far).any() or count > MOST_IN_FAMILY:
        machine.note(TOO_MANY_ROOTS)
        count = 0.0  # whatever was cut at some of them would be no better known
    function = function_of(family.root)
    turning = level.level.cuts[cut].turning
    rows = []
    for j in range(int(count)):
        here = dict(env)
        here[family.index] = pad(Cell(first + j), machine.directions)
        root = number_at(function, machine.tracking(), here)
        rows.append(Row(np.where(first + j <= last, root.v, np.nan), root.t, cut, turning, root.e, root.et))
    return rows


class _Along(Struct, frozen=True, dict=True):
    """A surface along one variable, for a batch: the number of its cut, and whether something jumps there.

    Places are (B,), or (r, B) for several of each member.
    """

    cut: int
    decides: bool
    surface: Term
    variable: str
    env: dict[str, Value]
    machine: Evaluator

    @cached_property
    def function(self) -> Lam:
        return function_of(self.surface)

    @cached_property
    def still(self) -> dict[str, Value]:
        """The values that the surface takes, without tangents: duals in tuples, too."""
        return {n: still(v) for n, v in self.env.items() if n in self.function.params}

    def value(self, x: Array) -> Array:
        found = number_at(self.function, self.machine.with_directions(0), {**self.still, self.variable: Cell(x)})
        return np.broadcast_to(found.v, x.shape)

    def searched(self, low: Array, high: Array) -> list[Row]:
        """Its roots between bounds, which may be infinite."""
        slope, batch = slope_of(self.surface, self.variable), low.size
        hidden: list[Row] = []
        if slope is None:
            a, b = in_rows(*self.on_a_grid(low, high), batch)
        else:
            brackets = isolated(
                self.surface, slope, self.variable, self.env, low, high, self.decides, self.machine.backend,
                self.machine.isolates, self.machine.isolated,
            )  # fmt: skip
            most = brackets.owner.size if self.decides else MOST_KINKS * batch
            if not brackets.complete and self.machine.overdrawn():  # more of it might help
                self.machine.note(BUDGET_SPENT)
            if self.decides and not brackets.complete:
                self.machine.note(ROOTS_NOT_SEPARATED)
            elif not brackets.complete or brackets.owner.size > most:
                self.machine.note(Unsearched(self.variable))
            few = slice(most)  # those that are farthest apart are found first
            a, b = in_rows(brackets.owner[few], brackets.a[few], brackets.b[few], batch)
            for start, end in zip(*in_rows(*brackets.hidden, batch), strict=True):
                row = self.moving(0.5 * (start + end), end - start)
                hidden.append(replace(row, e=row.e + (end - start), hides=end - start))
        rows = [self.moving(root, wide) for root, wide in zip(*self.polished(a, b), strict=True)]
        return rows + hidden + self.at_places(low, low == high)

    def at_places(self, x: Array, empty: Any) -> list[Row]:
        """The places that empty ranges are, where the surface is 0 there: nothing else can be searched for in them."""
        if not empty.any():
            return []
        tracked = self.machine.tracking().with_directions(0)
        at = number_at(self.function, tracked, {**self.still, self.variable: Cell(x)})
        on = empty & (np.abs(at.v) <= (0.0 if at.e is None else at.e))
        return [self.moving(np.where(on, x, np.nan), np.zeros(x.size))] if on.any() else []

    def on_a_grid(self, low: Array, high: Array) -> tuple[Ints, Array, Array]:
        """Stretches with a sign change, where nothing but values is known of the surface: whose, from where, to where.

        Dips towards zero are looked at closer.
        """
        x = at_label(low, high, np.linspace(0.0, 1.0, GRID + 1)[:, None])
        x = np.where(np.isfinite(x), x, np.nan)
        y = self.value(x)
        for _ in range(3):
            inner = np.abs(y[1:-1])
            signs = np.sign(y)
            same: Bools = (signs[:-2] == signs[2:]) & (signs[1:-1] == signs[2:])
            dip: Bools = same & (inner < np.abs(y[:-2])) & (inner <= np.abs(y[2:]))
            at = np.nonzero(dip.any(axis=1))[0] + 1
            if not at.size:
                break
            extra = [x]
            for s in (0.25, 0.5, 0.75):
                extra += [x[at - 1] + s * (x[at] - x[at - 1]), x[at] + s * (x[at + 1] - x[at])]
            x = np.sort(np.concatenate(extra), axis=0)
            y = self.value(x)
        x, y = self.to_the_edges(x, y)
        owner, at = np.nonzero(((y[:-1] * np.sign(y[1:]) < 0) | ((y[:-1] == 0) & (y[1:] != 0))).T)
        return owner, x[at, owner], x[at + 1, owner]

    def to_the_edges(self, x: Array, y: Array) -> tuple[Array, Array]:
        """With the last places before those where it has no value: between these and the grid a sign may change."""
        defined = ~np.isnan(y)
        at = np.nonzero((defined[1:] != defined[:-1]).any(axis=1))[0]
        if not at.size:
            return x, y
        there = np.where(defined[at], x[at], x[at + 1])
        beyond = np.where(defined[at], x[at + 1], x[at])
        for _ in range(BISECTIONS):
            middle = between(there, beyond)
            inside = ~np.isnan(self.value(middle))
            there, beyond = np.where(inside, middle, there), np.where(inside, beyond, middle)
        x = np.sort(np.concatenate((x, there)), axis=0)
        return x, self.value(x)

    def polished(self, a: Array, b: Array) -> tuple[Array, Array]:
        """The roots in brackets (r, B): Newton's steps where they stay inside and shrink, halves elsewhere. And how
        wide the brackets are in the end, which is all that is known where the sign changes by a jump."""
        if not a.shape[0]:
            return a, a
        env, one = {n: pad(v, 1) for n, v in self.still.items()}, self.machine.with_directions(1)
        shape, owner = a.shape, np.broadcast_to(np.arange(a.shape[-1]), a.shape).ravel()

        def psi(x: Array, of: Ints) -> tuple[Array, Array]:
            here = {**gather(env, of), self.variable: Cell(x, None, (1.0,))}
            value = number_at(self.function, one, here)
            slope = 0.0 if value.t[0] is None else value.t[0]
            return np.broadcast_to(value.v, x.shape), np.broadcast_to(slope, x.shape)

        with np.errstate(all="ignore"):
            a, b = a.ravel().copy(), b.ravel().copy()
            left = np.sign(psi(a, owner)[0])
            right = np.sign(psi(b, owner)[0])
            left = np.where((left == 0) | np.isnan(left), -right, left)
            x, going = between(a, b), np.arange(a.size)
            for turn in range(BISECTIONS):
                at, low, high = x[going], a[going], b[going]
                f, slope = psi(at, owner[going])
                below = left[going] * f > 0
                low, high = np.where(below, at, low), np.where(below, high, at)
                step = at - f / slope
                good = (step > low) & (step < high) & (turn % 3 < 2)
                new = np.where(f == 0, at, np.where(good, step, between(low, high)))
                small = EPS * np.abs(at)
                rests = (np.abs(new - at) <= small) | np.isnan(at) | (np.abs(high - low) <= small)
                x[going], a[going], b[going] = new, low, high
                going = going[~rests]
                if not going.size:
                    break
            x, a, b = (part.reshape(shape) for part in (x, a, b))
        return x, b - a

    def with_slopes(self, x: Array, tracking: bool = False) -> Cell:
        """The surface at places, with its slope along the variable as the last of its tangents."""
        k = self.machine.directions
        machine = self.machine.tracking() if tracking else self.machine
        here = {n: pad(v, k + 1) for n, v in self.env.items() if n in self.function.params}
        here[self.variable] = Cell(x, None, (None,) * k + (1.0,))
        return number_at(self.function, machine.with_directions(k + 1), here)

    def moving(self, root: Array, within: Array) -> Row:
        """The root as a candidate cut: dx = -psi_theta / psi_x; how far it is off is psi's own rounding over psi_x.

        Where psi changes its sign by a jump, or a pole, it is off by no more than the bracket is wide.
        """
        k, value = self.machine.directions, self.with_slopes(root, True)
        slope = value.t[k]
        slope = 0.0 if slope is None else slope
        with np.errstate(all="ignore"):
            rounding, step = 0.0 if value.e is None else value.e, SEARCHED * EPS * np.abs(root)
            off = (np.abs(value.v) + rounding) / np.abs(slope)
            jumps = np.abs(value.v) > JUMP * (rounding + step * np.abs(slope))
            off = np.where(jumps, np.minimum(off, within), off)
            off = np.where(np.isfinite(off), off, 0.0) + step
            still = [x is not None and (np.asarray(x) == 0) for x in value.t[:k]]
            flat = self.flat(root, slope) if any(np.any(part) for part in still) else False
            t = tuple(None if x is None else np.where(part, np.where(flat, np.nan, 0.0), -np.asarray(x) / slope)
                      for x, part in zip(value.t, still, strict=False))  # fmt: skip
        et = self.doubt(root + off, t, value) if k else ()
        poles = np.isfinite(root) & ~np.isfinite(np.broadcast_to(value.v, root.shape))
        if k and poles.any():
            near = self.beside_poles(root)
            t = tuple(np.where(poles, x, 0.0 if y is None else y) for x, y in zip(near, t, strict=True))
        return Row(root, t, self.cut, False, off, et)

    def flat(self, root: Array, slope: Any) -> Any:
        """Whether the surface is flat at its root: what stands still there may move all the same, as the root of
        x^3 + t^2*x - t^3 at t = 0 does, where both its derivatives are 0."""
        if not np.any(np.abs(slope) < LEVEL):
            return False
        steep = self.with_slopes(root + BESIDE * (1 + np.abs(root))).t[self.machine.directions]
        return np.abs(slope) <= LEVEL * np.abs(0.0 if steep is None else steep)

    def doubt(self, beside: Array, t: tuple[Any, ...], value: Cell) -> tuple[Any, ...]:
        """How far off speeds may be, by the rounding of the derivatives that they are made of (`value`), and as the
        root is not where it should be, but anywhere as far away as `beside`."""
        k, off = len(t), self.with_slopes(beside)
        slope, steep = (0.0 if cell.t[k] is None else np.asarray(cell.t[k]) for cell in (value, off))
        found: list[Any] = []
        with np.errstate(all="ignore"):
            for speed, x, rounded in zip(t, off.t, value.et, strict=False):
                there = 0.0 if x is None else -np.asarray(x) / steep
                if speed is None:
                    found.append(None)
                    continue
                part = sum(0.0 if r is None else r * w for r, w in ((rounded, 1.0), (value.et[k], np.abs(speed))))
                doubt = np.abs(there - speed) + part / np.abs(slope)
                unknown = np.isnan(part) & np.isfinite(speed)
                found.append(np.where(np.isfinite(doubt), doubt, np.where(unknown, np.inf, 0.0)))
        return tuple(found)

    def beside_poles(self, root: Array) -> list[Array]:
        """How poles move: like the lines along which psi is constant beside them, in the mean of their two sides."""
        k = self.machine.directions
        found = np.zeros((k, *root.shape))
        for side in (-BESIDE, BESIDE):
            value = self.with_slopes(root + side * np.maximum(np.abs(root), BESIDE))
            slope = 0.0 if value.t[k] is None else value.t[k]
            for d, x in enumerate(value.t[:k]):
                with np.errstate(all="ignore"):
                    speed = 0.0 if x is None else -np.asarray(x) / slope
                found[d] += np.where(np.isfinite(speed), speed, 0.0) / 2
        return list(found)


def in_rows(owner: Ints, a: Array, b: Array, batch: int) -> Array:
    """Stretches of members in order, as rows with one for each, padded with nan: (2, rows, batch)."""
    order = np.lexsort((a, owner))
    return side_by_side(owner[order], np.stack((a, b))[:, order], batch)
