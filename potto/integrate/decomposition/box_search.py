"""All solutions of a system of equations in boxes, for a whole batch at once.

Owns `Search` and `inverses`. Boxes over which the enclosure of an equation leaves out 0 hold no solution. On the others
one step of Krawczyk's operator either leaves nothing, or shows that there is just one solution and closes in on it, or
leaves a smaller box, which is halved (Krawczyk 1969; Neumaier, Interval Methods for Systems of Equations, 1990). Where
that never settles, since surfaces touch, boxes are told as places as soon as rounding hides what is in them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from msgspec import Struct

from potto.core.terms import Term
from potto.integrate.decomposition.effective_range import Ranges
from potto.integrate.decomposition.root_isolation import between
from potto.integrate.rules.gauss import EPS
from potto.integrate.rules.intervals import Interval, enclosure
from potto.kernels.cells import Array, Bools, Ints

ROUNDS = 120  # halvings of one side or all of them
BOXES, BOXES_EACH = 1 << 14, 1 << 8  # at most so many open at once, or so many for each member
FEW = 256  # boxes up to which all sides of one are halved at once
FINEST = 2.0**-40  # of the range: a box so narrow along the variable that is cut is not looked at more closely
INFLATED = 0.1  # by how much a box is larger on which a solution is looked for: it may lie on the edge of one
ROUNDED = 64 * EPS  # the same of the size of its place: a side that shrank to rounding holds no step of the operator
SHRINKS = 0.5  # what a step leaves of a box on which it closes in on a solution, as it does quadratically
FLAT = 2.0**-20  # of its place: how long a box is in which what touches is 0 to rounding, at the most
POLISH, STUCK = 12, 0.9  # steps at most; the part of each of its sides that the last one leaves of a box


class Search(Struct):
    """A search for all solutions, over boxes (n, 2, P): the variable that is cut, then those further in.

    count: of systems, which have as many members each, in order. lost: those whose solutions are not all known. open:
    the members of these, and the boxes in which there may be others. single: boxes with one solution each.
    reach: how far from 0 what is searched goes, (n, members); 1 where it goes farther. sifted: which boxes, of which
    members, may hold solutions that are asked for.
    """

    names: tuple[str, ...]
    fixed: dict[str, Array]
    equations: Sequence[Term]
    slopes: Sequence[Term]
    ends: Sequence[Term]
    near: Ranges
    count: int
    reach: Array
    found: list[tuple[Ints, Array, Array]] = []
    lost: set[int] = set()
    open: list[tuple[Ints, Array]] = []
    sifted: Callable[[Ints, Array], Bools] | None = None
    single: list[tuple[Ints, Array]] = []

    def solved(self, low: Array, high: Array, within: Callable[[int], bool]) -> tuple[Ints, Array, Array]:
        """Whose the solutions are, where they are, and how far off, (n, P) both; not all of systems with too many
        boxes. within: whether so many more of them are within the budget."""
        owner, box = self.whole(low, high)
        self.reach[:, owner] = np.minimum(1.0, np.abs(box).max(axis=1))
        each = low.size // self.count
        most = max(BOXES, BOXES_EACH * each)
        tiny = FINEST * (high - low)
        for _ in range(ROUNDS):
            if not owner.size:
                break
            boxes = np.bincount(owner // each, minlength=self.count)
            many = (boxes > 0) if not within(owner.size) else (boxes > most)
            if many.any():
                self.lost.update(np.nonzero(many)[0].tolist())
                fine = ~many[owner // each]
                self.open.append((owner[~fine], box[:, :, ~fine]))
                owner, box = owner[fine], box[:, :, fine]
                continue
            owner, box, before, blurred = self.narrowed(owner, box)
            side = box[0, 1] - box[0, 0]
            narrow = ~(side > np.maximum(tiny[owner], 4 * EPS * np.abs(box[0]).max(axis=0)))
            narrow &= ~(side <= SHRINKS * before)  # what closes in on a solution is on the way to be told
            self.leave(owner[narrow], box[:, :, narrow])
            owner, box = self.told(owner[~narrow], box[:, :, ~narrow], blurred[~narrow])
            owner, box = self.halved(owner, box)
        self.leave(owner, box)
        if self.single:
            self.polished(*(np.concatenate(parts, axis=-1) for parts in zip(*self.single, strict=True)))
        if not self.found:
            return _none(len(self.names))
        return tuple(np.concatenate(parts, axis=-1) for parts in zip(*self.found, strict=True))  # type: ignore[return-value]

    def leave(self, owner: Ints, box: Array) -> None:
        """Both ends of boxes that may hold solutions, as such."""
        wide = box[:, 1] - box[:, 0]
        wide[0] = 0.0
        for end in (box[:, 0], box[:, 1]):
            self.found.append((owner, end, wide))

    def told(self, owner: Ints, box: Array, blurred: Bools) -> tuple[Ints, Array]:
        """The boxes in which rounding tells places from one another; the others are left, as places that are so far
        off: parts of them would say nothing more. blurred: those in which solutions may be anywhere by rounding."""
        size = (box[:, 1] - box[:, 0]) / self.place(owner, box)
        gone = (size[0] <= FLAT) & blurred
        short = np.nonzero((size[0] <= FLAT) & (size[1:] <= ROUNDED).all(axis=0) & ~blurred)[0]
        if short.size:
            here = box[:, :, short]
            thin = here.copy()
            thin[0] = 0.5 * (here[0, 0] + here[0, 1])
            whole, part = (self.enclosed(self.equations, owner[short], of) for of in (here, thin))
            gone[short] = (whole[:, 1] - whole[:, 0] <= 2 * (part[:, 1] - part[:, 0])).all(axis=0)
        if not gone.any():
            return owner, box
        there = box[:, :, gone]
        self.found.append((owner[gone], 0.5 * (there[:, 0] + there[:, 1]), 0.5 * (there[:, 1] - there[:, 0])))
        return owner[~gone], box[:, :, ~gone]

    def whole(self, low: Array, high: Array) -> tuple[Ints, Array]:
        """The box of each member that has one: of the variables further in what their bounds allow."""
        box = {n: (v, v) for n, v in self.fixed.items()} | {self.names[0]: (low, high)}
        there = low < high
        rows = {self.names[0]: (low, high)}
        for i in reversed(range(1, len(self.names))):  # the outermost of those within comes last in them
            both = enclosure(tuple(self.ends[2 * i - 2 : 2 * i]), box)
            # an infinite bound has no enclosure, as nothing has that is infinite all over
            least, most = ([np.where(np.isnan(end), far, end) for end in side]
                           for side, far in zip(zip(*both, strict=True), (-np.inf, np.inf), strict=True))  # fmt: skip
            near = self.near.get(self.names[i], (-np.inf, np.inf))
            ends = np.maximum(np.minimum(*least), near[0]), np.minimum(np.maximum(*most), near[1])
            ends = np.broadcast_to(ends[0], low.shape), np.broadcast_to(ends[1], low.shape)
            box[self.names[i]] = rows[self.names[i]] = ends
            there = there & (ends[0] < ends[1])
        owner = np.nonzero(there)[0]
        return owner, np.stack([np.stack([end[owner] for end in rows[name]]) for name in self.names])

    def enclosed(self, terms: Sequence[Term], owner: Ints, box: Array) -> Array:
        """Enclosures of terms: (terms, 2, P)."""
        at: dict[str, Interval] = {n: (v[owner], v[owner]) for n, v in self.fixed.items()}
        at |= {name: (side[0], side[1]) for name, side in zip(self.names, box, strict=True)}
        found = enclosure(tuple(terms), at)
        return np.stack([np.stack([np.broadcast_to(end, owner.shape) for end in ends]) for ends in found])

    def narrowed(self, owner: Ints, box: Array) -> tuple[Ints, Array, Array, Bools]:
        """What is left of boxes by one step, how long they were before along what is cut, and in which of them rounding
        moves solutions by more than that; those with one solution are solved, and gone."""
        f = self.enclosed(self.equations, owner, box)
        may = ((f[:, 0] <= 0) & (f[:, 1] >= 0)).all(axis=0)
        owner, box = owner[may], box[:, :, may]
        if self.sifted is not None and owner.size:
            asked = self.sifted(owner, box)
            owner, box = owner[asked], box[:, :, asked]
        side = box[:, 1] - box[:, 0]
        if not owner.size:
            return owner, box, side[0], np.zeros(0, dtype=bool)
        with np.errstate(all="ignore"):
            more = INFLATED * side + ROUNDED * self.place(owner, box)
            wide = np.stack((box[:, 0] - more, box[:, 1] + more), axis=1)
            step, rounded = self.step(owner, wide)
            known = np.isfinite(step).all(axis=(0, 1)) & np.isfinite(wide).all(axis=(0, 1))
            one = known & ((step[:, 0] > wide[:, 0]) & (step[:, 1] < wide[:, 1])).all(axis=0)
            lo = np.where(known, np.maximum(box[:, 0], step[:, 0]), box[:, 0])
            hi = np.where(known, np.minimum(box[:, 1], step[:, 1]), box[:, 1])
        gone = known & (lo > hi).any(axis=0)
        self.single.append((owner[one & ~gone], step[:, :, one & ~gone]))
        rest = ~(one | gone)
        blurred = known & (2 * rounded[0] >= side[0])
        return owner[rest], np.stack((lo, hi), axis=1)[:, :, rest], side[0, rest], blurred[rest]

    def step(self, owner: Ints, box: Array) -> tuple[Array, Array]:
        """Krawczyk's operator: m - C f(m) + (1 - C J(box)) (box - m); not finite where it can't be had. And by how much
        the rounding of f moves that."""
        n = len(self.names)
        slopes = self.enclosed(self.slopes, owner, box)
        middle, radius = 0.5 * (box[:, 0] + box[:, 1]), 0.5 * (box[:, 1] - box[:, 0])
        f = self.enclosed(self.equations, owner, np.stack((middle, middle), axis=1))
        mid = np.moveaxis(0.5 * (slopes[:, 0] + slopes[:, 1]), -1, 0).reshape(-1, n, n)
        rad = np.moveaxis(0.5 * (slopes[:, 1] - slopes[:, 0]), -1, 0).reshape(-1, n, n)
        inverse = inverses(mid)
        size = np.abs(inverse)
        off = np.abs(np.eye(n) - inverse @ mid) + size @ rad + 8 * n * EPS * (size @ np.abs(mid))
        reach = np.einsum("pij,jp->ip", off, radius)
        value, spread = 0.5 * (f[:, 0] + f[:, 1]), 0.5 * (f[:, 1] - f[:, 0])
        place = middle - np.einsum("pij,jp->ip", inverse, value)
        rounded = np.einsum("pij,jp->ip", size, spread)
        reach += rounded + 4 * EPS * np.abs(place)
        return np.stack((place - reach, place + reach), axis=1), rounded

    def polished(self, owner: Ints, box: Array) -> None:
        """Note boxes with one solution each, as small as they get."""
        if not owner.size:
            return
        waiting = np.arange(owner.size)
        with np.errstate(all="ignore"):
            for _ in range(POLISH):
                here = box[:, :, waiting]
                step, _ = self.step(owner[waiting], here)
                lo, hi = np.maximum(here[:, 0], step[:, 0]), np.minimum(here[:, 1], step[:, 1])
                fine = np.isfinite(step).all(axis=(0, 1)) & (lo <= hi).all(axis=0)
                better = np.where(fine, np.stack((lo, hi), axis=1), here)
                box[:, :, waiting] = better
                shrinks = (better[:, 1] - better[:, 0] < STUCK * (here[:, 1] - here[:, 0])).any(axis=0)
                waiting = waiting[shrinks]
                if not waiting.size:
                    break
        self.found.append((owner, 0.5 * (box[:, 0] + box[:, 1]), 0.5 * (box[:, 1] - box[:, 0])))

    def place(self, owner: Ints, box: Array) -> Array:
        """How far from 0 boxes are, (n, P), or what is searched where they lie about it: rounding is a part of it."""
        place: Array = np.maximum(self.reach[:, owner], np.abs(box).max(axis=1))
        return place

    def halved(self, owner: Ints, box: Array) -> tuple[Ints, Array]:
        """Boxes halved along all sides that rounding leaves while they are few, else each along its longest."""
        n = box.shape[0]
        every = owner.size <= FEW * self.count
        size = (box[:, 1] - box[:, 0]) / self.place(owner, box)
        sides = ~(size <= ROUNDED)
        longest = np.where(np.isnan(size), np.inf, size).argmax(axis=0)
        for i in range(n):
            cut = sides[i] if every else longest == i
            if not cut.any():
                continue
            left, right = box.copy(), box[:, :, cut].copy()
            middle = between(box[i, 0], box[i, 1])
            left[i, 1] = np.where(cut, middle, box[i, 1])
            right[i, 0] = middle[cut]
            owner, box = np.concatenate((owner, owner[cut])), np.concatenate((left, right), axis=2)
            sides = np.concatenate((sides, sides[:, cut]), axis=1)
            longest = np.concatenate((longest, np.full(int(cut.sum()), -1)))
        return owner, box


def _none(n: int) -> tuple[Ints, Array, Array]:
    return np.zeros(0, dtype=np.int64), np.zeros((n, 0)), np.zeros((n, 0))


def inverses(matrices: Array) -> Array:
    """The inverse of each matrix (P, n, n); not finite where there is none."""
    n = matrices.shape[-1]
    fine: Any = np.isfinite(matrices).all(axis=(1, 2))
    fine[fine] = np.linalg.det(matrices[fine]) != 0
    found = np.full(matrices.shape, np.nan)
    found[fine] = np.linalg.inv(matrices[fine]) if fine.any() else np.zeros((0, n, n))
    return found
