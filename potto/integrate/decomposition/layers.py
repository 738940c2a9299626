"""Where ranges are cut beside the places at which an exponential, or what is like it, changes within a short stretch.

Owns `layer_rows` and `exponents_of`. What falls like exp(-k x) from an end or a cut on is gone before the first node if
k is large, and may be 0 at the end itself: x exp(-k x). So it is around a place within the range at which an exponent
turns, or is 0: tanh(k x), 1/(1 + exp(k x)) and x exp(-k x^2) do all that they do beside 0. How far a layer reaches is
where its exponent has changed by DEPTH. There the range is cut, and nodes are where the layer is, in whatever it is
multiplied with and in each derivative.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct

from potto.core.terms import Term
from potto.integrate.decomposition.lines import Watched, apart, box_of, extent, on_lines, watched
from potto.integrate.decomposition.meetings import Row, as_array
from potto.integrate.decomposition.turns import Matters, Span, cells_of, span_of, turns
from potto.integrate.levels import HINT, LevelPlan
from potto.integrate.pieces import Evaluator
from potto.integrate.rules.intervals import Interval, enclosure
from potto.integrate.rules.steepness import STEEPEST, change, exponents_in
from potto.kernels.cells import Array, Bools, Cell, Ints, Value

# By how much an exponent has changed where nothing is left to doubles, of a root neither, and up to where few nodes see
# all that there is; and beyond which exponentials are 0 or infinite, and what saturates has done so.
DEPTH, CORE, GONE = 80.0, 4.0, 745.0
# How far from a place it is looked, in parts of the range; between two of these exponents change as a power of the
# distance, unless that is above so much.
DISTANCES = np.concatenate((4.0 ** -np.arange(20.0, 1.0, -1.0), [0.125]))
POWER = 4.5
OWN = 0.25  # the part of how far a layer reaches up to which another place is its own
EVEN = 12.0  # by how much an exponent may change on a cell of an infinite range


def exponents_of(body: Term, variable: str, known: frozenset[str]) -> Watched | None:
    """The exponents in an integrand that vary with a variable; None if there are none. known: the names that have
    values."""
    return watched(exponents_in(body), variable, known)


def layer_rows(
    exponents: Watched, inner: Sequence[LevelPlan], variable: str, env: Mapping[str, Value], lo: Cell, hi: Cell,
    rows: Sequence[Row], batch: int, machine: Evaluator, matters: Matters,
) -> list[Row]:  # fmt: skip
    """Rows beside both bounds, the places of other rows, and those at which exponents turn, for members on whose ranges
    an exponent changes much.

    inner: the variables further in. matters: finds how much of the ranges, some infinite, does."""
    low, high, there = extent(lo, hi, batch)
    if not there.size or not _steep_somewhere(exponents, inner, variable, env, (low[there].min(), high[there].max())):
        return []
    hints = [as_array(row.x, batch)[there] for row in rows if row.cut == HINT]
    span = span_of(low[there], high[there], hints, lambda: tuple(end[there] for end in matters()))
    lines = _Lines(exponents, inner, variable, env, machine, there, span)
    lines = lines.pick(np.flatnonzero(lines.steep()))
    if not lines.members.size:
        return []
    beside = [(lo.v, lo.t), (hi.v, hi.t), *((row.x, row.t) for row in rows)]  # a layer moves with what it lies beside
    places = np.stack([as_array(x, batch)[lines.members] for x, _ in beside])
    within = np.isfinite(places) & (places >= lines.span.low) & (places <= lines.span.high)
    within[:2] &= np.isfinite(low + high)[lines.members]  # how fast an infinite range is run through has to be found
    places = np.where(within, places, np.nan)
    found = []
    for away in lines.reaches(places):
        for place, (_, speed) in zip(places + away, beside, strict=True):
            found += lines.rows(np.arange(lines.members.size), place, batch, speed)
    resting = (None,) * machine.directions
    for known, place in lines.turning(places):
        found += lines.rows(known, place, batch, resting)
    return found


def _steep_somewhere(
    exponents: Watched, inner: Sequence[LevelPlan], variable: str, env: Mapping[str, Value], ends: Interval
) -> bool:
    """Whether an exponent may be steep for some member, as far as an enclosure over all of them tells."""
    box = box_of(exponents, inner, variable, env, ends)
    if box is None:
        return True
    if np.isfinite(ends).all():
        return not change(exponents.terms, box) <= STEEPEST
    box[variable] = cells_of(ends)
    with np.errstate(all="ignore"):
        for least, most in enclosure(exponents.terms, box):
            if np.any(~(most - least <= EVEN) & ~(least > DEPTH) & ~(most < -DEPTH)):
                return True
    return False


class _Lines(Struct, frozen=True):
    """The exponents of members on whose ranges they may be steep: (B,) of a batch."""

    exponents: Watched
    inner: Sequence[LevelPlan]
    variable: str
    env: Mapping[str, Value]
    machine: Evaluator
    members: Ints
    span: Span

    def pick(self, some: Ints) -> _Lines:
        return _Lines(
            self.exponents, self.inner, self.variable, self.env, self.machine, self.members[some], self.span.pick(some)
        )

    def at(self, parts: Array, known: Ints, places: Array) -> Array:
        """Exponents (E, L, ...) of some members at places (..., N), on lines through parts (L,) of the ranges of the
        variables further in; nan where they are infinite, as they are beside no layer."""
        wide = np.broadcast_to(places, (parts.size, *places.shape))
        members = self.members[np.broadcast_to(known, wide.shape)]
        part = parts.reshape(-1, *(1,) * places.ndim)
        values = on_lines(self.exponents, self.inner, self.variable, self.env, members, part, wide, self.machine)
        return np.where(np.isfinite(values), values, np.nan)

    def steep(self) -> Bools:
        """On whose ranges an exponent changes much; all infinite ones may be such."""
        places = np.stack((self.span.low, 0.5 * (self.span.low + self.span.high), self.span.high))
        endless = ~np.isfinite(places[1])
        values = self.at(self.exponents.parts(self.inner), self.every, np.where(endless, 0.0, places))
        change = np.fmax.reduce(values, axis=2) - np.fmin.reduce(values, axis=2)
        steep: Bools = endless | (change > STEEPEST).any(axis=(0, 1))
        return steep

    @property
    def every(self) -> Ints:
        return np.arange(self.members.size)

    def reaches(self, places: Array) -> Iterator[Array]:
        """How far from places (S, B) layers reach, to either side: (S, B), nan where there are none."""
        parts = self.exponents.parts(self.inner)

        def numbers(places: Array) -> Array:
            return self.at(parts, self.every, places)

        length = self.span.lengths(places)
        for way in (1.0, -1.0):
            yield from _reached(numbers, places, way * length, (DEPTH,))[0]

    def turning(self, beside: Array) -> Iterator[tuple[Ints, Array]]:
        """The places of members at which exponents turn, and those beside them at which they have changed by CORE and
        by DEPTH, as far as no place (S, B) is known there: each member once at a time."""
        parts = self.exponents.parts(self.inner)
        parts = parts if parts.size == 1 else parts[[0, -1]]  # where ranges further in end, something happens at all

        def numbers(known: Ints, places: Array) -> Array:
            values = self.at(parts, known, places)
            return values.reshape(-1, *values.shape[2:])

        found = turns(numbers, self.span)
        if not found.number.size:
            return
        number, known, place = found.number, found.member, found.place

        def own(places: Array) -> Array:
            values = numbers(np.broadcast_to(known, places.shape), places)
            return np.take_along_axis(values, np.broadcast_to(number, (1, *places.shape)), axis=0)[None]

        length = self.span.pick(known).lengths(place)
        away = [far[0] for way in (1.0, -1.0) for far in _reached(own, place, way * length, (CORE, DEPTH))]
        core = np.fmin(away[0], -away[2])
        other = np.abs(beside[:, known] - place) <= OWN * core
        keep = np.flatnonzero(np.isfinite(core) & ~other.any(axis=0))
        order = keep[np.lexsort((place[keep], known[keep]))]
        same = (known[order][1:] == known[order][:-1]) & (np.diff(place[order]) <= OWN * core[order][1:])
        order = order[np.concatenate(([True], ~same))[: order.size]]
        for some in apart(known[order]):
            those = order[some]
            for far in (0.0, *away):
                yield known[those], (place + far)[those]

    def rows(self, known: Ints, place: Array, batch: int, speed: tuple[Any, ...]) -> list[Row]:
        """A row of some members at places, if there are any within their ranges."""
        inside = (place > self.span.low[known]) & (place < self.span.high[known])
        if not inside.any():
            return []
        x = np.full(batch, np.nan)
        x[self.members[known[inside]]] = place[inside]
        return [Row(x, speed, HINT, False)]


def _reached(numbers: Callable[[Array], Array], places: Array, length: Array, depths: Sequence[float]) -> list[Array]:
    """How far from places (...) exponents (E, L, ...) have changed by each depth on some line: (E, ...) each, nan where
    they don't. length: of ranges, below 0 towards their lower ends."""
    distances = DISTANCES.reshape(-1, *(1,) * places.ndim)
    change = _changes(numbers(places)[:, :, None], numbers(places + distances * length)).max(axis=1)
    found = []
    for depth in depths:
        beyond = change >= depth
        at = np.maximum(beyond.argmax(axis=1), 1)[:, None]
        near, far = (np.take_along_axis(change, own, 1)[:, 0] for own in (at - 1, at))
        start, end = DISTANCES[at - 1][:, 0], DISTANCES[at][:, 0]
        with np.errstate(all="ignore"):
            part = np.clip(np.log(depth / near) / np.log(far / near), 0.0, 1.0)
            part = np.where(far <= near * (end / start) ** POWER, part, 1.0)
            found.append(np.where(beyond.any(axis=1), start * (end / start) ** part, np.nan) * length)
    return found


def _changes(here: Array, beyond: Array) -> Array:
    """By how much exponents change; not at all where nothing comes of it."""
    with np.errstate(invalid="ignore"):
        gone = (np.abs(here) > GONE) & (np.abs(beyond) > GONE) & (here * beyond > 0)
        return np.nan_to_num(np.where(gone, 0.0, np.abs(beyond - here)))
