"""Intervals with one root each: of a surface along one variable, for a whole batch at once.

Owns `isolated`, `Isolated`, `touched`, `flat`, `between` and `at_label`. A cell over which the enclosure of the
surface leaves out 0 has no root; one over which that of its slope does has at most one, and the signs at its ends tell.
All others are halved. So no root is missed, however narrow what brings it forth; what is given up on, once there are
too many cells, is told.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from msgspec import Struct

from potto.core.terms import Branch, Proj, Term, Var, children, postorder, rebuild, var
from potto.digests import blake2b
from potto.integrate.rules.intervals import Interval, everywhere
from potto.integrate.rules.lowered_intervals import enclosures
from potto.kernels.cells import Array, Bools, Cell, Ints, Number, Value

FINEST = 48  # halvings of the whole
WIDE = 2.0**20  # ranges of which the smallest cells are larger than roots are apart: 4e-9
FAR = (2.0**100, 2.0**30, 2.0**9)  # where signs are looked at that infinity does not tell
OUTSIDE = 64  # how many of the smallest cells away from one a sign is asked for
CELLS, CELLS_EACH = 1 << 16, 1 << 9  # at most so many open at once, or so many for each member
# Up to how many widths of its enclosure at a point a surface may vary over a cell that is not looked at more closely:
# halves of it would say no more. Of x - sin(x) that is settled after 40 cells, and never without.
SHALLOW = 2.0
KEPT, LEAST = 1 << 18, 64  # numbers: 2 MB; what one search counts as beside its own

_Stretches = tuple[Ints, Array, Array]  # whose, from where, to where


class Brackets(Struct):
    """owner: (r,) whose; a, b: (r,) ends of cells with a sign change each. complete: whether these are all.

    hidden: whose, and from where to where, the surface is 0 to rounding, so that there may be any number of them.
    """

    owner: Ints
    a: Array
    b: Array
    complete: bool
    hidden: _Stretches


class Isolated(Struct):
    """What was found in one evaluation: other orders of the variables, the sides of a kink, differences and second
    looks ask for the same roots again. numbers: how many are kept."""

    found: dict[tuple[Term, str, bool, bytes], Brackets] = {}
    numbers: int = 0

    def keep(self, key: tuple[Term, str, bool, bytes], brackets: Brackets) -> None:
        size = LEAST + sum(part.size for part in (brackets.owner, brackets.a, brackets.b, *brackets.hidden))
        if brackets.complete and self.numbers + size <= KEPT:
            self.found[key] = brackets
            self.numbers += size


def isolated(
    surface: Term, slope: Term, variable: str, env: dict[str, Value], low: Array, high: Array, jumps: bool = True,
    backend: str = "numpy", within: Callable[[int], bool] = lambda cells: True, known: Isolated | None = None,
) -> Brackets:  # fmt: skip
    """The sign changes of a surface between bounds (B,), which may be infinite.

    jumps: whether something jumps there, so that what hides roots is left as it is; a kink is wanted to the last digit.
    within: whether so many more cells are within the budget. known: what was found before in this evaluation.
    """
    (surface, slope), env = flat((surface, slope), env)
    fixed: dict[str, Interval] = {}
    for name in sorted(surface.free - {variable}):
        value = env[name]
        assert isinstance(value, Cell)
        fixed[name] = value.v, value.v
    if known is None:
        return _searched(_Cells(surface, slope, variable, fixed, low, high, backend), jumps, within)
    key = surface, variable, jumps, _digest([low, high, *(value for value, _ in fixed.values())])
    if key not in known.found:
        brackets = _searched(_Cells(surface, slope, variable, fixed, low, high, backend), jumps, within)
        known.keep(key, brackets)
        return brackets
    return known.found[key]


def _digest(numbers: Sequence[Number]) -> bytes:
    text = blake2b(digest_size=16)
    for number in numbers:
        text.update(np.asarray(number, dtype=float).tobytes() + b"|")
    return text.digest()


def _searched(cells: _Cells, jumps: bool, within: Callable[[int], bool]) -> Brackets:
    low, high = cells.low, cells.high
    there = np.nonzero(low < high)[0]
    owner, s0, s1 = there, np.zeros(there.size), np.ones(there.size)
    found: list[_Stretches] = []
    hidden: list[_Stretches] = [(there[:0], s0[:0], s1[:0])]
    most = max(CELLS, CELLS_EACH * there.size)
    complete = True
    for _ in range(FINEST):
        if not owner.size:
            break
        if owner.size > most or not within(owner.size):
            complete = False
            break
        settled, crossed, open_, shallow = cells.judged(owner, s0, s1)
        if not jumps:
            open_, shallow = np.union1d(open_, shallow), shallow[:0]
        hidden.append((owner[shallow], s0[shallow], s1[shallow]))
        found.append((owner[settled][crossed], s0[settled][crossed], s1[settled][crossed]))
        owner, s0, s1 = owner[open_], s0[open_], s1[open_]
        middle = 0.5 * (s0 + s1)
        owner, s0, s1 = np.concatenate((owner, owner)), np.concatenate((s0, middle)), np.concatenate((middle, s1))
    crossed = cells.crossed(owner, s0, s1)
    found.append((owner[crossed], s0[crossed], s1[crossed]))
    if complete and owner.size:
        found.append(_around_poles(cells, owner[~crossed], s0[~crossed], s1[~crossed], found))
    sure, unsure = cells.places(*_together(found)), cells.places(*adjoining(*_together(hidden)))
    return Brackets(*sure, complete, unsure)


def _together(parts: list[_Stretches]) -> _Stretches:
    owner, s0, s1 = (np.concatenate(part) for part in zip(*parts, strict=True))
    return owner, s0, s1


def _around_poles(cells: _Cells, owner: Ints, s0: Array, s1: Array, found: list[_Stretches]) -> _Stretches:
    """Places with a sign change among the smallest cells, next to each other, that say nothing by themselves.

    So close to a pole no enclosure has a sign: it is asked for a little outside. What was found there already is left.
    """
    owner, s0, s1 = adjoining(owner, s0, s1)
    width = 2.0**-FINEST
    s0, s1 = np.maximum(s0 - OUTSIDE * width, 0.0), np.minimum(s1 + OUTSIDE * width, 1.0)
    new = cells.crossed(owner, s0, s1)
    new[new] = ~touched((owner[new], s0[new], s1[new]), _together(found))
    return owner[new], s0[new], s1[new]


def touched(stretches: _Stretches, others: _Stretches) -> Bools:
    """Which stretches have a place with one of the others in common: where of those that begin before its end the one
    that goes furthest does not end before its beginning."""
    owner, s0, s1 = stretches
    o, a, b = (part[np.lexsort((others[2], others[0]))] for part in others)  # so that later goes further
    if not o.size:
        return np.zeros(owner.size, dtype=bool)
    furthest: Ints = np.maximum.accumulate(np.lexsort((a, o)))
    asked = np.repeat((False, True), (o.size, owner.size))
    order = np.lexsort((asked, np.concatenate((a, s1)), np.concatenate((o, owner))))
    before = np.cumsum(~asked[order])[np.argsort(order)[o.size :]]
    last = furthest[np.maximum(before, 1) - 1]
    found: Bools = (before > 0) & (o[last] == owner) & (b[last] >= s0)
    return found


def adjoining(owner: Ints, s0: Array, s1: Array) -> _Stretches:
    """Cells put together with those next to them."""
    order = np.lexsort((s0, owner))
    owner, s0, s1 = owner[order], s0[order], s1[order]
    first = np.ones(owner.size, dtype=bool)
    first[1:] = (owner[1:] != owner[:-1]) | (s0[1:] > s1[:-1] + 2.0**-FINEST)
    starts = np.nonzero(first)[0]
    return owner[starts], s0[starts], np.maximum.reduceat(s1, starts) if starts.size else s1


def flat(terms: tuple[Term, ...], env: dict[str, Value]) -> tuple[list[Term], dict[str, Value]]:
    """Terms with a name of its own for each component of a tuple, and their values."""
    parts: dict[Term, Value] = {}
    memo: dict[Term, Term] = {}
    for node in postorder(*terms):
        if isinstance(node, Var) and isinstance(env.get(node.name), tuple):
            parts[node] = env[node.name]
        if isinstance(node, Proj) and node.term in parts:
            parts[node] = parts[node.term][node.index]  # type: ignore[index]
            memo[node] = var(f"component {len(parts)}")
        else:
            memo[node] = rebuild(node, tuple(memo[c] for c in children(node)))
    named = {new.name: parts[old] for old, new in memo.items() if old in parts and isinstance(new, Var)}
    return [memo[term] for term in terms], {**env, **named}


def between(a: Array, b: Array) -> Array:
    """A point between the ends, also of what is not finite; wide ranges are halved by their digits."""
    middle = 0.5 * (a + b)
    if (b - a > WIDE).any():
        middle = np.where(b - a > WIDE, np.sinh(0.5 * (np.arcsinh(a) + np.arcsinh(b))), middle)
    up, down = np.maximum(2 * np.abs(a), 1.0), -np.maximum(2 * np.abs(b), 1.0)
    far = np.where(np.isinf(b), up, np.where(np.isinf(a), down, middle))
    return np.where(np.isinf(a) & np.isinf(b), 0.0, far)


def at_label(low: Array, high: Array, s: Array) -> Array:
    """The places of labels in [0, 1] between bounds that may be infinite.

    Equal steps of labels are so many digits of places far out, and as many near 0, where bounds are far away.
    """
    with np.errstate(all="ignore"):
        x = low + (high - low) * s
        wide = high - low > WIDE
        if wide.any():
            start, end = np.arcsinh(low), np.arcsinh(high)
            x = np.where(wide & np.isfinite(high - low), np.clip(np.sinh(start + (end - start) * s), low, high), x)
        if np.isfinite(x).all():
            return np.where(s == 1, high, x)
        up, down = low + s / (1 - s), high - (1 - s) / s
        whole = (2 * s - 1) / (4 * s * (1 - s))
    x = np.where(np.isinf(high), np.where(np.isinf(low), whole, up), np.where(np.isinf(low), down, x))
    return np.where(s == 0, low, np.where(s == 1, high, x))


class _Cells(Struct, dict=True):
    surface: Term
    slope: Term
    variable: str
    fixed: dict[str, Interval]
    low: Array
    high: Array
    backend: str

    def __post_init__(self) -> None:
        self.total = everywhere(self.surface)
        self.branches = tuple(node.surface for node in postorder(self.surface) if isinstance(node, Branch))

    def x(self, owner: Ints, s: Array) -> Array:
        """The places of labels in [0, 1], also where a bound is infinite."""
        return at_label(self.low[owner], self.high[owner], s)

    def places(self, owner: Ints, s0: Array, s1: Array) -> _Stretches:
        return owner, self.x(owner, s0), self.x(owner, s1)

    def at(self, owner: Ints) -> dict[str, Interval]:
        return {n: (v[0][owner], v[1][owner]) if isinstance(v[0], np.ndarray) else v for n, v in self.fixed.items()}

    def judged(self, owner: Ints, s0: Array, s1: Array) -> tuple[Ints, Bools, Ints, Ints]:
        """The cells with at most one root, whether they have one, the cells that are to be halved, and those on all of
        which the surface is 0 to rounding."""
        middle, a, b = (self.x(owner, s) for s in (0.5 * (s0 + s1), s0, s1))
        box = {**self.at(owner), self.variable: (a, b)}
        (lo, hi), (least, most), *branches = self.enclosed((self.surface, self.slope, *self.branches), box, a.shape)
        # A slope says nothing across the edge of where the surface has a value, which is looked for at the ends.
        here, *ends = self.at_points(owner, (middle, a, b) if not self.total else (middle,))
        reach = np.maximum(b - middle, middle - a)
        with np.errstate(invalid="ignore", over="ignore"):  # mean values: closer than the enclosure in small cells
            far = np.maximum(np.abs(least), np.abs(most)) * reach
            apart = (here[0] - far > 0) | (here[1] + far < 0)
            steady = (least >= 0) | (most <= 0)
            width = here[1] - here[0]  # infinite where nothing is known, as on a pole
            shallow = ~steady & (here[0] <= 0) & (here[1] >= 0) & (far <= SHALLOW * width) & (width < np.inf)
        for end in ends:
            known = ~np.isnan(end[0])
            apart, steady = apart & known, steady & known
        for low, high in branches:  # nor does it across a jump
            one = (low > 0) | (high < 0)
            apart, steady = apart & one, steady & one
        free = (lo > 0) | (hi < 0) | np.isnan(lo) | apart
        settled, shallow = ~free & steady, ~free & shallow
        index = np.nonzero(settled)[0]
        known_ends = tuple((low[index], high[index]) for low, high in ends)
        left, right = self.at_ends(owner[index], s0[index], s1[index], known_ends)
        signed = ~np.isnan(left) & ~np.isnan(right)  # nor has it a sign where its value is more than numbers can hold
        settled[index] = signed
        crossed = _changes(left[signed], right[signed], s1[index][signed])
        return index[signed], crossed, np.nonzero(~free & ~settled & ~shallow)[0], np.nonzero(shallow)[0]

    def enclosed(self, terms: tuple[Term, ...], box: dict[str, Interval], shape: tuple[int, ...]) -> list[Interval]:
        found = enclosures(terms, box, shape[0], self.backend)
        return [(np.broadcast_to(lo, shape), np.broadcast_to(hi, shape)) for lo, hi in found]

    def at_points(self, owner: Ints, places: tuple[Array, ...]) -> list[Interval]:
        """The surface at several places of each cell, all by one enclosure: most batches are small."""
        x = np.concatenate(places)
        box = {**self.at(np.tile(owner, len(places))), self.variable: (x, x)}
        (low, high), parts = self.enclosed((self.surface,), box, x.shape)[0], len(places)
        return list(zip(np.split(low, parts), np.split(high, parts), strict=True))

    def crossed(self, owner: Ints, s0: Array, s1: Array) -> Bools:
        """Whether the surface's sign changes over cells."""
        return _changes(*self.at_ends(owner, s0, s1), s1)

    def at_ends(self, owner: Ints, s0: Array, s1: Array, known: tuple[Interval, ...] = ()) -> tuple[Array, Array]:
        """The surface at both ends of cells, nan where it has no value. known: where that is known already."""
        ends = self.x(owner, s0), self.x(owner, s1)
        values = [_middle_of(at) for at in known or self.at_points(owner, ends)]
        for number, x in enumerate(ends):
            for size in FAR:  # at infinity the terms of a sum may have no sum
                lost = np.isnan(values[number]) & np.isinf(x)
                if not lost.any():
                    break
                again = self.at_points(owner, (np.where(lost, np.copysign(size, x), x),))[0]
                values[number] = np.where(lost, _middle_of(again), values[number])
        return values[0], values[1]


def _changes(left: Array, right: Array, s1: Array) -> Bools:
    """Whether a sign changes over cells that end at s1. A root on an end belongs to the cell on its right."""
    return np.asarray((left * np.sign(right) < 0) | ((left == 0) & (right != 0)) | ((right == 0) & (s1 == 1)))


def _middle_of(value: Interval) -> Array:
    """nan where nothing is known."""
    lo, hi = value
    with np.errstate(invalid="ignore"):
        return np.where((lo == -np.inf) & (hi == np.inf), np.nan, 0.5 * (lo + hi))
