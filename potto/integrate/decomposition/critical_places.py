"""Where systems of equations have solutions: the critical places of integrals further in, found by numbers.

Owns `critical_rows`. Boxes over which the enclosure of an equation leaves out 0 hold no solution. On the others one
step of Krawczyk's operator either leaves nothing, or shows that there is just one solution and closes in on it, or
leaves a smaller box, which is halved (Krawczyk 1969; Neumaier, Interval Methods for Systems of Equations, 1990). Where
that never settles, since surfaces touch, both ends of what is left are cuts. Such cuts need not move where what is
integrated is continuous there; where it is not, they do as the implicit function theorem says.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from msgspec import Struct

from potto.calculus.decomposition.critical import Critical, Within, slopes_of
from potto.calculus.inlining.alike import Leaf, SameShape, alike
from potto.core.terms import Const, Term, Tuple, function_of, tuple_, var
from potto.integrate.columns import side_by_side
from potto.integrate.decomposition.effective_range import Ranges
from potto.integrate.decomposition.meetings import SEARCHED, Row, as_array, tangents
from potto.integrate.decomposition.root_isolation import between, flat
from potto.integrate.events import Unsearched
from potto.integrate.pieces import gather
from potto.integrate.rules.gauss import EPS
from potto.integrate.rules.intervals import Interval, enclosure
from potto.kernels.cells import Array, Cell, Ints, Value, pad

ROUNDS = 120  # halvings of one side or all of them
BOXES, BOXES_EACH = 1 << 14, 1 << 8  # at most so many open at once, or so many for each member
FEW = 256  # boxes up to which all sides of one are halved at once
FINEST = 2.0**-40  # of the range: a box so narrow along the variable that is cut is not looked at more closely
INFLATED = 0.1  # by how much a box is larger on which a solution is looked for: it may lie on the edge of one
ROUNDED = 64 * EPS  # the same of the size of its place: a side that shrank to rounding holds no step of the operator
SHRINKS = 0.5  # what a step leaves of a box on which it closes in on a solution, as it does quadratically
SAME = 2.0**-44  # of the range: solutions no farther apart are one
FLAT = 2.0**-20  # of its place: how long a box is in which what touches is 0 to rounding, at the most
POLISH, STUCK = 12, 0.9  # steps at most; the part of each of its sides that the last one leaves of a box
BEYOND = 0.125  # how far beyond its range a turning place is looked for, which the map of nodes takes care of


def critical_rows(
    systems: Sequence[Critical], variable: str, env: dict[str, Value], lo: Cell, hi: Cell, near: Ranges, batch: int,
    machine: Any,
) -> list[Row]:  # fmt: skip
    """The cuts of one variable at places where what lies further in meets, appears, merges or turns.

    near: of variables whose range is infinite, what matters of it.
    """
    low, high = as_array(np.minimum(lo.v, hi.v), batch), as_array(np.maximum(lo.v, hi.v), batch)
    around = BEYOND * np.where(np.isfinite(high - low), high - low, 0.0)
    reach = np.minimum(1.0, np.maximum(np.abs(low), np.abs(high)))
    rows: list[Row] = []
    same = SAME * np.where(np.isfinite(high - low), high - low, 1.0)
    systems, env = _in_numbers(systems, env)
    numbers = frozenset(name for name, value in env.items() if isinstance(value, Cell))
    groups, unsearched = _groups(systems, variable, numbers)
    lost = [unsearched]
    for group in groups:
        wide = [around if system.turning else 0.0 * around for system in group.systems]
        ends = low - np.stack(wide), high + np.stack(wide)
        count = len(group.systems)
        ones = np.ones((len(group.names), batch * count))
        search = _Search(group.names, group.fixed(env, batch), *group.parts(), near, count, ones)
        owner, places, width = search.solved(ends[0].ravel(), ends[1].ravel(), machine.search)
        lost.append(len(search.lost))
        for number, system in enumerate(group.systems):
            if number in search.lost:
                continue
            own = np.nonzero(owner // batch == number)[0]
            whose, there, off = owner[own] % batch, places[:, own], width[own]
            t, et = np.zeros((2, machine.directions if system.steps else 0, own.size))
            if t.size:
                doubt = 8 * EPS + off / np.maximum(reach[whose], np.abs(there[0]))
                t, et = _speeds(system, variable, env, whose, there, doubt, machine)
            rows += _as_rows(system, whose, there[0], off, same, batch, (t, et))
    for _ in range(sum(lost)):
        machine.note(Unsearched(variable))
    return rows


class _Alike(Struct, frozen=True):
    """Systems that are the same but for their numbers, and are searched as one batch: of five balls ten pairs meet.

    names: what they are solved for, the variable that is cut first. terms: equations, slopes row by row, and ends of
    ranges. columns: what each of their further names is in each system, or the one name that it is in all.
    """

    systems: tuple[Critical, ...]
    names: tuple[str, ...]
    terms: tuple[Term, ...]
    columns: tuple[tuple[str, tuple[Leaf, ...] | str], ...]

    def parts(self) -> tuple[Sequence[Term], Sequence[Term], Sequence[Term]]:
        """Equations, slopes and ends."""
        n = len(self.names)
        return self.terms[:n], self.terms[n : n + n * n], self.terms[n + n * n :]

    def fixed(self, env: dict[str, Value], batch: int) -> dict[str, Array]:
        """What does not vary, of all members of the first system, then of all of the second."""

        def of(leaf: Leaf) -> Array:
            value = leaf.value if isinstance(leaf, Const) else env[leaf.name].v  # type: ignore[union-attr]
            return as_array(value, batch)

        rows = {name: [var(column)] * len(self.systems) if isinstance(column, str) else column
                for name, column in self.columns}  # fmt: skip
        return {name: np.concatenate([of(leaf) for leaf in row]) for name, row in rows.items()}


def _in_numbers(systems: Sequence[Critical], env: dict[str, Value]) -> tuple[tuple[Critical, ...], dict[str, Value]]:
    """Systems with a name of its own for each component of a tuple, and their values."""
    if not any(isinstance(env.get(name), tuple) for system in systems for name in system.free):
        return tuple(systems), env
    waiting, env = flat(tuple(term for system in systems for term in _terms(system)), env)
    found = []
    for system in systems:
        n = len(system.equations)
        equations, ends, waiting = waiting[:n], waiting[n : 3 * n - 2], waiting[3 * n - 2 :]
        bounds = zip(system.within, ends[::2], ends[1::2], strict=True)
        within = tuple(Within(w.variable, lo, hi) for w, lo, hi in bounds)
        found.append(Critical(tuple(equations), within, system.turning, system.steps))
    return tuple(found), env


def _terms(system: Critical) -> tuple[Term, ...]:
    """The equations of a system, and the bounds of what is within."""
    return (*system.equations, *(end for w in system.within for end in (w.lo, w.hi)))


@lru_cache(maxsize=256)
def _groups(systems: tuple[Critical, ...], variable: str, numbers: frozenset[str]) -> tuple[tuple[_Alike, ...], int]:
    """Systems by what they are but for their numbers, and how many can't be searched. Those that parameters alone
    decide are left out: they are solved everywhere, or nowhere."""
    posed: dict[tuple[str, ...], list[tuple[Critical, Term]]] = {}
    unsearched = 0
    once = {(frozenset(s.equations), s.within, s.turning, s.steps): s for s in systems}  # whichever two met first
    for system in once.values():
        slopes = slopes_of(system, variable)
        names = (variable, *(w.variable for w in system.within))
        n = len(names)
        terms = _terms(system)
        terms = (*terms[:n], *(slopes or ()), *terms[n:])
        if slopes is None or not frozenset().union(*(term.free for term in terms)) <= numbers.union(names):
            unsearched += 1
        elif all(equation.free.intersection(names) for equation in terms[:n]):
            posed.setdefault(names, []).append((system, tuple_(terms)))
    found: list[_Alike] = []
    for names, members in posed.items():
        kinds = dict.fromkeys(numbers.difference(names))
        groups, alone = alike([whole for _, whole in members], kinds, lambda _: None)
        shapes = [*groups, *(_by_itself(members[place][1], place) for place in alone)]
        for shape in shapes:
            pairs = zip(shape.function.params, shape.columns, strict=True)
            columns = tuple((name, column) for name, column in pairs if name not in names)
            together = tuple(members[place][0] for place in shape.places)
            whole = shape.function.body
            assert isinstance(whole, Tuple)
            found.append(_Alike(together, names, whole.items, columns))
    return tuple(found), unsearched


def _by_itself(term: Term, place: int) -> SameShape:
    """One that is like no other."""
    function = function_of(term)
    return SameShape(function, function.params, (place,))


def _speeds(
    system: Critical, variable: str, env: dict[str, Value], owner: Ints, places: Array, doubt: Array, machine: Any
) -> tuple[Array, Array]:
    """How solutions move along the variable that is cut, (k, P), and by how much that may be off: `doubt` as a part."""
    names = (variable, *(w.variable for w in system.within))
    k, n = machine.directions, len(names)
    here = {name: pad(value, k + n) for name, value in gather(env, owner).items()}
    for i, name in enumerate(names):
        unit = tuple(1.0 if i == j else None for j in range(n))
        here[name] = Cell(places[i], None, (None,) * k + unit)
    function = function_of(tuple_(system.equations))
    found = machine.with_directions(k + n).evaluate(function, {name: here[name] for name in function.params}, None)
    slopes = np.stack([tangents(cell.t, owner.size, k + n) for cell in found])  # (n, k + n, P)
    slopes = np.moveaxis(slopes, -1, 0)
    rates, matrices = slopes[:, :, :k], slopes[:, :, k:]
    inverse = _inverse(matrices)
    moves = -inverse @ rates
    sizes = np.abs(inverse) @ (np.abs(rates) + np.abs(matrices) @ np.abs(moves))
    return moves[:, 0].T, sizes[:, 0].T * doubt


def _none(n: int) -> tuple[Ints, Array, Array]:
    return np.zeros(0, dtype=np.int64), np.zeros((n, 0)), np.zeros(0)


class _Search(Struct):
    """A search for all solutions, over boxes (n, 2, P): the variable that is cut, then those further in.

    count: of systems, which have as many members each, in order. lost: those whose solutions are not all known.
    reach: how far from 0 what is searched goes, (n, members); 1 where it goes farther.
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

    def solved(self, low: Array, high: Array, within: Callable[[int], bool]) -> tuple[Ints, Array, Array]:
        """Whose the solutions are, where they are, and how far off along the variable that is cut; not all of systems
        with too many boxes. within: whether so many more of them are within the budget."""
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
                owner, box = owner[fine], box[:, :, fine]
                continue
            owner, box, before = self.narrowed(owner, box)
            side = box[0, 1] - box[0, 0]
            narrow = ~(side > np.maximum(tiny[owner], 4 * EPS * np.abs(box[0]).max(axis=0)))
            narrow &= ~(side <= SHRINKS * before)  # what closes in on a solution is on the way to be told
            self.leave(owner[narrow], box[:, :, narrow])
            owner, box = self.told(owner[~narrow], box[:, :, ~narrow])
            owner, box = self.halved(owner, box)
        self.leave(owner, box)
        if not self.found:
            return _none(len(self.names))
        return tuple(np.concatenate(parts, axis=-1) for parts in zip(*self.found, strict=True))  # type: ignore[return-value]

    def leave(self, owner: Ints, box: Array) -> None:
        """Both ends of boxes that may hold solutions, as such."""
        for end in (box[:, 0], box[:, 1]):
            self.found.append((owner, end, np.zeros(owner.size)))

    def told(self, owner: Ints, box: Array) -> tuple[Ints, Array]:
        """The boxes in which rounding tells places from one another; the others are left, as places that are so far
        off: parts of them would say nothing more."""
        size = (box[:, 1] - box[:, 0]) / self.place(owner, box)
        short = np.nonzero((size[0] <= FLAT) & (size[1:] <= ROUNDED).all(axis=0))[0]
        if not short.size:
            return owner, box
        here = box[:, :, short]
        thin = here.copy()
        thin[0] = 0.5 * (here[0, 0] + here[0, 1])
        whole, part = (self.enclosed(self.equations, owner[short], of) for of in (here, thin))
        rounded = (whole[:, 1] - whole[:, 0] <= 2 * (part[:, 1] - part[:, 0])).all(axis=0)
        gone = short[rounded]
        middle, radius = 0.5 * (here[:, 0] + here[:, 1]), 0.5 * (here[0, 1] - here[0, 0])
        self.found.append((owner[gone], middle[:, rounded], radius[rounded]))
        rest = np.ones(owner.size, dtype=bool)
        rest[gone] = False
        return owner[rest], box[:, :, rest]

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

    def narrowed(self, owner: Ints, box: Array) -> tuple[Ints, Array, Array]:
        """What is left of boxes by one step, and how long they were before along what is cut; those with one solution
        are solved, and gone."""
        f = self.enclosed(self.equations, owner, box)
        may = ((f[:, 0] <= 0) & (f[:, 1] >= 0)).all(axis=0)
        owner, box = owner[may], box[:, :, may]
        side = box[:, 1] - box[:, 0]
        if not owner.size:
            return owner, box, side[0]
        with np.errstate(all="ignore"):
            more = INFLATED * side + ROUNDED * self.place(owner, box)
            wide = np.stack((box[:, 0] - more, box[:, 1] + more), axis=1)
            step = self.step(owner, wide)
            known = np.isfinite(step).all(axis=(0, 1)) & np.isfinite(wide).all(axis=(0, 1))
            one = known & ((step[:, 0] > wide[:, 0]) & (step[:, 1] < wide[:, 1])).all(axis=0)
            lo = np.where(known, np.maximum(box[:, 0], step[:, 0]), box[:, 0])
            hi = np.where(known, np.minimum(box[:, 1], step[:, 1]), box[:, 1])
        gone = known & (lo > hi).any(axis=0)
        self.polished(owner[one & ~gone], step[:, :, one & ~gone])
        rest = ~(one | gone)
        return owner[rest], np.stack((lo, hi), axis=1)[:, :, rest], side[0, rest]

    def step(self, owner: Ints, box: Array) -> Array:
        """Krawczyk's operator: m - C f(m) + (1 - C J(box)) (box - m); not finite where it can't be had."""
        n = len(self.names)
        slopes = self.enclosed(self.slopes, owner, box)
        middle, radius = 0.5 * (box[:, 0] + box[:, 1]), 0.5 * (box[:, 1] - box[:, 0])
        f = self.enclosed(self.equations, owner, np.stack((middle, middle), axis=1))
        mid = np.moveaxis(0.5 * (slopes[:, 0] + slopes[:, 1]), -1, 0).reshape(-1, n, n)
        rad = np.moveaxis(0.5 * (slopes[:, 1] - slopes[:, 0]), -1, 0).reshape(-1, n, n)
        inverse = _inverse(mid)
        size = np.abs(inverse)
        off = np.abs(np.eye(n) - inverse @ mid) + size @ rad + 8 * n * EPS * (size @ np.abs(mid))
        reach = np.einsum("pij,jp->ip", off, radius)
        value, spread = 0.5 * (f[:, 0] + f[:, 1]), 0.5 * (f[:, 1] - f[:, 0])
        place = middle - np.einsum("pij,jp->ip", inverse, value)
        reach += np.einsum("pij,jp->ip", size, spread) + 4 * EPS * np.abs(place)
        return np.stack((place - reach, place + reach), axis=1)

    def polished(self, owner: Ints, box: Array) -> None:
        """Note boxes with one solution each, as small as they get."""
        if not owner.size:
            return
        with np.errstate(all="ignore"):
            for _ in range(POLISH):
                step = self.step(owner, box)
                lo, hi = np.maximum(box[:, 0], step[:, 0]), np.minimum(box[:, 1], step[:, 1])
                fine = np.isfinite(step).all(axis=(0, 1)) & (lo <= hi).all(axis=0)
                better = np.where(fine, np.stack((lo, hi), axis=1), box)
                done = (better[:, 1] - better[:, 0] >= STUCK * (box[:, 1] - box[:, 0])).all()
                box = better
                if done:
                    break
        self.found.append((owner, 0.5 * (box[:, 0] + box[:, 1]), 0.5 * (box[0, 1] - box[0, 0])))

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


def _inverse(matrices: Array) -> Array:
    """The inverse of each matrix (P, n, n); not finite where there is none."""
    n = matrices.shape[-1]
    fine: Any = np.isfinite(matrices).all(axis=(1, 2))
    fine[fine] = np.linalg.det(matrices[fine]) != 0
    found = np.full(matrices.shape, np.nan)
    found[fine] = np.linalg.inv(matrices[fine]) if fine.any() else np.zeros((0, n, n))
    return found


def _as_rows(
    system: Critical, owner: Ints, places: Array, width: Array, same: Array, batch: int, speeds: tuple[Array, Array]
) -> list[Row]:
    """Places in order, one of those at one place for each member, as rows padded with nan."""
    order = np.lexsort((places, owner))
    owner, places, width = owner[order], places[order], width[order]
    apart = places[1:] - places[:-1] > width[1:] + width[:-1] + same[owner[1:]] + 8 * EPS * np.abs(places[1:])
    new: Any = np.ones(owner.size, dtype=bool)
    new[1:] = (owner[1:] != owner[:-1]) | apart
    owner, places, width = owner[new], places[new], width[new]
    off = width + SEARCHED * EPS * np.abs(places)
    x, off = side_by_side(owner, np.stack((places, off)), batch)
    t, et = (side_by_side(owner, of[:, order][:, new], batch, 0.0) for of in speeds)
    return [Row(x[i], tuple(t[:, i]), -1, system.turning, off[i], tuple(et[:, i])) for i in range(x.shape[0])]
