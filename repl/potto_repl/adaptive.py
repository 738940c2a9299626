"""Curves sampled where it matters: more points where a curve bends, jumps told from steep slopes, poles from peaks.

Owns `followed`. Points are asked for in batches, and a new one halves the distance of two old ones, so that a curve
that runs steeply gets flatter from one step to the next; one that jumps does not.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from msgspec import Struct

from potto.applications.pictures import Curve

FIRST = 65  # points at equal distances to begin with
FINE = 12  # how often the first distances may be halved
MOST = 3000  # points of one curve
BENT = 1 / 600  # of the height: how far the middle of two points may lie off their chord
STEEP = 1 / 25  # of the height: the largest step between neighbours
JUMP = 1 / 200  # of the height: the smallest step that counts as a jump
GROWTH = 3.0  # how much larger a value gets on the way to a pole, from 16 times to one time the finest distance

Point = tuple[tuple[float, float], ...]  # per component its value and its error
Evaluate = Callable[[Sequence[float]], list[Point]]


def followed(evaluate: Evaluate, lo: float, hi: float) -> list[Curve]:
    """The components of a function of one number, each as a curve with its jumps and poles."""
    work = _Work(evaluate, lo, hi)
    work.run()
    return work.curves()


class _Work(Struct):
    """Points so far, by their place: whole numbers of the finest distance, so that none is asked for twice."""

    evaluate: Evaluate
    lo: float
    hi: float
    known: dict[int, Point] | None = None

    @property
    def last(self) -> int:
        return (FIRST - 1) << FINE

    def at(self, place: int) -> float:
        share = place / self.last
        return self.hi if share == 1 else self.lo + (self.hi - self.lo) * share

    def run(self) -> None:
        self.known = {}
        self.ask([number << FINE for number in range(FIRST)])
        for _ in range(FINE + 4):
            wanted = self.wanted()[: max(MOST - len(self.known), 0)]
            if not wanted:
                return
            self.ask(wanted)

    def ask(self, places: Sequence[int]) -> None:
        assert self.known is not None
        self.known.update(zip(places, self.evaluate([self.at(p) for p in places]), strict=True))

    def wanted(self) -> list[int]:
        """The middles of the stretches to look at more closely, the widest first."""
        assert self.known is not None
        places = sorted(self.known)
        found: set[tuple[int, int]] = set()
        for component in range(len(self.known[0])):
            values = [self.known[p][component][0] for p in places]
            (low, high), _ = self.seen(component)
            found |= {pair for pair in _uneven(places, values, max(high - low, 1e-300))
                      if not _out_of_sight(pair, self.known, component, low, high)}  # fmt: skip
        stretches = sorted((a for a in found if a[1] - a[0] > 1), key=lambda pair: pair[0] - pair[1])
        return [(a + b) // 2 for a, b in stretches]

    def bulk(self, component: int) -> tuple[float, float]:
        """Between which heights nearly all of the points at equal distances lie."""
        assert self.known is not None
        even = sorted(v for n in range(FIRST) if math.isfinite(v := self.known[n << FINE][component][0]))
        few = len(even) // 20
        return (even[few], even[-1 - few]) if even else (0.0, 0.0)

    def seen(self, component: int) -> tuple[tuple[float, float], set[int]]:
        """The heights to be seen, all of them but for the way to poles; and the points next to poles."""
        assert self.known is not None
        places = sorted(self.known)
        values = [self.known[p][component][0] for p in places]
        finite = [v for v in values if math.isfinite(v)]
        lowest, highest = min(finite, default=0.0), max(finite, default=1.0)
        low, high = self.bulk(component)
        poles = _poles(places, values, max(abs(low), abs(high)))
        room = (high - low) / 2
        if not poles or not room:
            return (lowest, highest), poles
        return (max(lowest, low - room), min(highest, high + room)), poles

    def curves(self) -> list[Curve]:
        assert self.known is not None
        places = sorted(self.known)
        xs = tuple(self.at(p) for p in places)
        found = []
        for component in range(len(self.known[0])):
            values = [self.known[p][component][0] for p in places]
            errors = tuple(self.known[p][component][1] for p in places)
            (low, high), poles = self.seen(component)
            breaks = [
                i for i in range(len(places) - 1)
                if places[i + 1] - places[i] == 1 and abs(values[i + 1] - values[i]) > JUMP * (high - low)
                and (_stays(places, values, i) or i in poles or i + 1 in poles)
            ]  # fmt: skip
            found.append(Curve(xs, tuple(values), errors, tuple(breaks), (low, high)))
        return found


def _out_of_sight(pair: tuple[int, int], known: Mapping[int, Point], component: int, low: float, high: float) -> bool:
    """Whether both ends lie above, or both below, what is to be seen, and neither is the utmost point."""
    a, b = (known[place][component][0] for place in pair)
    values = [point[component][0] for point in known.values()]
    if min(a, b) > high:
        return max(a, b) < max(v for v in values if v == v)
    return max(a, b) < low and min(a, b) > min(v for v in values if v == v)


def _uneven(places: Sequence[int], values: Sequence[float], height: float) -> list[tuple[int, int]]:
    """The stretches where the curve bends, steps, or begins to have values."""
    found = []
    for i in range(len(places) - 1):
        a, b = values[i], values[i + 1]
        if math.isfinite(a) != math.isfinite(b) or (math.isfinite(a) and abs(b - a) > STEEP * height):
            found.append((places[i], places[i + 1]))
    for i in range(1, len(places) - 1):
        if _off_chord(places[i - 1 : i + 2], values[i - 1 : i + 2]) > BENT * height:
            found += [(places[i - 1], places[i]), (places[i], places[i + 1])]
    return found


def _off_chord(places: Sequence[int], values: Sequence[float]) -> float:
    """How far the middle one of three points lies off the line through the others; 0 where it has no value."""
    (p, q, r), (a, b, c) = places, values
    if not (math.isfinite(a) and math.isfinite(b) and math.isfinite(c)):
        return 0.0
    return abs(a + (c - a) * (q - p) / (r - p) - b)


def _stays(places: Sequence[int], values: Sequence[float], at: int) -> bool:
    """Whether the step after a point is most of the step over sixteen times the distance: it does not get smaller."""
    left, right = _beside(places, at, -8), _beside(places, at + 1, 8)
    if left == at or right == at + 1:
        return False  # nothing is known of its neighbourhood
    wide, narrow = values[right] - values[left], values[at + 1] - values[at]
    return math.isfinite(wide) and abs(narrow) > 0.6 * abs(wide)


def _poles(places: Sequence[int], values: Sequence[float], sight: float) -> set[int]:
    """Points next to which the curve goes beyond all bounds: it grows the nearer one comes, at the finest distance."""
    found = set()
    for i, value in enumerate(values):
        if not math.isfinite(value):
            continue
        for step in (-1, 1):
            beside = i - step
            if not 0 <= beside < len(places) or abs(places[beside] - places[i]) > 2:
                continue
            away = values[_beside(places, i, 16 * step)]
            if math.isfinite(away) and abs(value) > max(GROWTH * abs(away), sight):
                found.add(i)
    return found


def _beside(places: Sequence[int], at: int, distance: int) -> int:
    """The point nearest to a place so far from another, on its side."""
    step, want = (1 if distance > 0 else -1), places[at] + distance
    while 0 <= at + step < len(places) and (places[at + step] - want) * step <= 0:
        at += step
    return at
