"""Where along a range numbers cross 0, or turn from rising to falling or back, on a stretch too short for nodes.

Owns `Span`, `span_of`, `cells_of`, `Turns` and `turns`. tanh(u) and exp(-u^2) change where u is 0, over a stretch on
which u changes by 1: where u changes by a thousand over the range no node need be there. u itself is seen from afar, so
its places are looked for between few samples of it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from msgspec import Struct

from potto.kernels.cells import Array, Bools, Ints

# Samples of a range, of few members and of many, between which a number is taken to turn once.
SAMPLES, MANY = 33, 128
# Up to so many turns samples are trusted; of what turns more often twice as many are taken, up to MOST, as long as
# these show more. By which part of their distance samples are uneven, and how close to the ends the first ones are.
FEW, MOST = 4, 2048
GOLDEN, UNEVEN, CLOSE = 0.5 * (5.0**0.5 - 1.0), 0.5, 2.0**-20
SECTIONS, ROUNDS = 8, 18  # of a stretch around a place, and how often it is cut into those
SETTLED = 0.25  # by how much a number changes over a stretch on which its place is found
SEEN = 1.0  # and over one between samples on which nodes see what it does
TINY = 2.0**-900  # what 0 is taken for, so that it has a sign
TELLING = 3  # hints are those of a measure, by which it says where it is
PACE = 8.0  # how long an infinite range is taken to be at a place, in distances from -1 or 1: that of a finite one

Matters = Callable[[], tuple[Array, ...]]  # of each member, the lower and the upper end
Values = Callable[[Ints, Array], Array]  # all numbers (E, ...) of members at places


# Cells of infinite ranges, an eighth of the distance from -1 or 1 long.
CELLS = np.expm1(0.125 * np.arange(200.0))


class Span(Struct, frozen=True):
    """The ranges of a batch: (B,) each, low <= high, either end infinite. spread: how long an infinite one is, where a
    measure says so, else 0. matters: finds the ends of the part beyond which there is next to nothing, where these are
    known."""

    low: Array
    high: Array
    spread: Array
    matters: Matters | None = None

    def places(self, u: Array) -> Array:
        """Places at parts u (..., B) of ranges; of an infinite one they thin out to its end."""
        low, high = self.low, self.high
        with np.errstate(all="ignore"):
            x = low + u * (high - low)
            x = np.where(np.isinf(high), low + u / (1.0 - u), x)
            x = np.where(np.isinf(low), high - (1.0 - u) / u, x)
            v = 2.0 * u - 1.0
            return np.where(np.isinf(low) & np.isinf(high), v / (1.0 - v * v), x)

    @property
    def endless(self) -> Bools:
        return np.isinf(self.low) | np.isinf(self.high)

    def lengths(self, x: Array) -> Array:
        """How long ranges are, for what lies at places (..., B)."""
        length = self.high - self.low
        endless = np.where(self.spread > 0, self.spread, PACE * (1.0 + np.abs(x)))
        return np.where(np.isfinite(length), length, endless)

    def pick(self, members: Ints) -> Span:
        matters = self.matters
        own = matters and (lambda: tuple(end[members] for end in matters()))
        return Span(self.low[members], self.high[members], self.spread[members], own)


class Turns(Struct, frozen=True):
    """What was found: of which number, and of which member, at which place: (N,) each."""

    number: Ints
    member: Ints
    place: Array


def span_of(low: Array, high: Array, hints: Sequence[Array], matters: Matters | None = None) -> Span:
    """Ranges, along which there are hints (B,)."""
    spread = np.zeros(low.size)
    if len(hints) >= TELLING:
        spread = np.fmax.reduce(hints) - np.fmin.reduce(hints)
    return Span(low, high, spread, matters)


def cells_of(ends: tuple[float, float]) -> tuple[Array, Array]:
    """An infinite range, in cells on which what is narrow shows: where these begin and end."""
    edges = np.clip(np.concatenate((-CELLS[:0:-1], CELLS)), *ends)
    return edges[:-1], edges[1:]


class _Between(Struct, frozen=True):
    """Between which places numbers of members cross 0, or have a highest (1) or lowest (-1) value: (N,) each."""

    number: Ints
    member: Ints
    left: Array
    right: Array
    crosses: Bools
    highest: Array


def turns(values: Values, span: Span) -> Turns:
    """Places at which numbers cross 0, or have an extremum, and change by more than SEEN between samples."""
    found = _found(values, span)
    number, member, crosses, highest = found.number, found.member, found.crosses, found.highest
    left, right = found.left, found.right
    middle = left
    steps = np.linspace(0.0, 1.0, SECTIONS + 1)[:, None]
    for _ in range(ROUNDS if number.size else 0):
        grid = left + steps * (right - left)
        own = values(np.broadcast_to(member, grid.shape), grid)
        own = np.take_along_axis(own, np.broadcast_to(number, (1, *grid.shape)), axis=0)[0]
        left, middle, right, open_ = _closer(grid, own, crosses, highest)
        if not open_.any():
            break
    return Turns(number, member, middle)


def _found(values: Values, span: Span) -> _Between:
    """Where turns are, with so many samples that twice as many show no more of them."""
    members = np.arange(span.low.size)
    count = SAMPLES if members.size <= MANY else (SAMPLES + 1) // 2
    seen = np.full(members.size, FEW)
    parts = []
    while members.size:
        x = _sampled(span.pick(members), count)
        found = values(np.broadcast_to(members, x.shape), x)
        zeros, peaks = _between(found, min(SAMPLES / count, 1.0))
        now = (zeros.sum(axis=1) + peaks.sum(axis=1)).max(axis=0)
        more = (now > seen) & (count < MOST)
        parts.append(_places(found, x, zeros & ~more, peaks & ~more, members))
        members, seen, count = members[more], now[more], 2 * count
    return _Between(*(np.concatenate([getattr(part, name) for part in parts]) for name in _Between.__struct_fields__))


def _sampled(span: Span, count: int) -> Array:
    """Samples (P, B) of ranges, at uneven distances, so that no period is taken for another, and close beside the ends,
    where numbers may turn before the first one. Of an infinite range also of the part that matters."""
    steps = np.arange(1.0, count - 1.0)
    inside = (steps + UNEVEN * (steps * GOLDEN % 1.0 - 0.5)) / (count - 1)
    u = np.concatenate(([0.0, CLOSE], inside, [1.0 - CLOSE, 1.0]))
    x = span.places(u[:, None])
    if count > SAMPLES and span.matters is not None and span.endless.any():
        low, high = (np.where(span.endless & np.isfinite(end), end, np.nan) for end in span.matters())
        x = np.sort(np.concatenate((x, low + u[:, None] * (high - low))), axis=0)
    return x


def _places(found: Array, x: Array, zeros: Bools, peaks: Bools, members: Ints) -> _Between:
    number, at, member = (np.concatenate(both) for both in zip(np.nonzero(zeros), np.nonzero(peaks), strict=True))
    crosses = np.arange(number.size) < np.count_nonzero(zeros)
    left, right = x[at, member], x[at + np.where(crosses, 1, 2), member]
    highest = np.where(crosses, 1.0, np.sign(found[number, at + 1, member] - found[number, at, member]))
    return _Between(number, members[member], left, right, crosses, highest)


def _between(found: Array, distance: float) -> tuple[Bools, Bools]:
    """After which samples numbers (E, P, B) cross 0, and after which they turn, the next but one being beyond.

    distance: of samples, in terms of that at which SEEN is told."""
    with np.errstate(invalid="ignore"):
        found = np.where(found == 0.0, TINY, found)
        step = found[:, 1:] - found[:, :-1]
        step = np.where(step == 0.0, TINY, step)
        zeros = (found[:, 1:] * found[:, :-1] < 0) & (np.abs(step) > SEEN * distance)
        much = np.abs(step) > SEEN * distance**2
        turn = (step[:, 1:] * step[:, :-1] < 0) & (much[:, 1:] | much[:, :-1])
    peaks = np.zeros_like(zeros)
    peaks[:, :-1] = turn
    return zeros, peaks


def _closer(grid: Array, own: Array, crosses: Bools, highest: Array) -> tuple[Array, Array, Array, Bools]:
    """The ends and the middle of a shorter stretch around each place, by numbers (SECTIONS + 1, N) on a longer one, and
    whether these still change much on it."""
    own = np.where(np.isfinite(own), own, -np.inf * highest)
    first = np.argmax(np.sign(own) != np.sign(own[:1]), axis=0)
    before, after = (np.abs(_picked(own, at)) for at in (first - 1, first))
    nearest = np.where(after < before, first, first - 1)
    best = np.where(crosses, nearest, (own * highest).argmax(axis=0))
    low = np.where(crosses, first - 1, best - 1)
    high = np.where(crosses, first, best + 1)
    left, middle, right = (_picked(own, at) for at in (low, best, high))
    with np.errstate(invalid="ignore"):
        change = np.where(crosses, np.abs(middle), np.maximum(np.abs(middle - left), np.abs(middle - right)))
    return _picked(grid, low), _picked(grid, best), _picked(grid, high), change > SETTLED


def _picked(rows: Array, at: Ints) -> Array:
    """Of rows (SECTIONS + 1, N) the ones asked for, (N,), the nearest there is."""
    found: Array = np.take_along_axis(rows, np.clip(at, 0, SECTIONS)[None], axis=0)[0]
    return found
