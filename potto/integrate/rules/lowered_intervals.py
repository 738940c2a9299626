"""Enclosures of many boxes by machine code, as `intervals` finds them by numpy.

Owns `enclosures`. The bounds are the same but for how they are rounded outwards, which neither promises to the bit. A
box on which something overflows is left to numpy, which knows what follows from that.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from msgspec import Struct, field

from potto.core.terms import Term, postorder
from potto.integrate.rules.intervals import Interval, enclosure
from potto.integrate.rules.written_intervals import Names, WrittenInterval
from potto.kernels.cells import Array, Ints
from potto.kernels.making import counts
from potto.kernels.native.elementary import module
from potto.kernels.native.objects import Loaded
from potto.kernels.native.points import address
from potto.kernels.native.promotion import Promotion
from potto.kernels.native.vectors import LANES, Vectors

NAME = "enclose"
# Boxes, and parts of terms, of which one is there at least: a call takes as long as numpy with two or three parts.
BOXES, PARTS = 256, 16
NOWHERE, TAME, WILD = 0.0, 1.0, 2.0  # what is said of bounds: that there is no value, or whether they may be infinite


class _Enclosing(Struct, frozen=True):
    """The function for some terms. places: per number its name, and of which ends there are columns of their own."""

    terms: tuple[Term, ...]
    places: tuple[tuple[str, str], ...]
    promotion: Promotion = field(default_factory=lambda: Promotion(NAME))

    def text(self) -> str:
        """A function of a frame (how many, where columns are, where those of the results are) and of constants."""
        at, box, columns, constants = Vectors(), dict[str, Names](), 1, 0
        last = at.whole("sub", at.address("%frame", 0), LANES)
        vectors = at.whole("udiv", at.whole("add", at.address("%frame", 0), LANES - 1), LANES)
        first = at.whole("mul", at.begin(vectors), LANES)
        k = at.once(f"call i64 @llvm.umin.i64(i64 {first}, i64 {last})", first)  # the last ones are done twice

        def place(column: int) -> str:
            return at.at(at.address("%frame", column, "ptr"), k, "double")

        for name, kind in self.places:
            ends = []
            for _ in range(_ends(kind)):
                if kind in ("columns", "column"):
                    ends.append(at.load(place(columns)))
                    columns += 1
                else:
                    ends.append(at.constant("%constants", constants))
                    constants += 1
            box[name] = Names(ends[0], ends[-1])
        domain = WrittenInterval(at)
        results = [name for own in domain.walk(self.terms, box, {}) for name in (*own[:2], _told(domain, own))]
        for column, name in enumerate(results, columns):
            at.store(name, place(column))
        at.end()
        return module(at, NAME, "ptr %frame, ptr %constants")

    def run(self, function: Loaded, given: Sequence[Any], count: int) -> Array:
        """Lower bounds, upper bounds and what is said of them, (3 * terms, count)."""
        many = max(count, LANES)  # it does eight at once
        columns = [np.ascontiguousarray(x if many == count else np.resize(x, many), dtype=float)
                   for x in given if isinstance(x, np.ndarray)]  # fmt: skip
        constants = np.array([x for x in given if not isinstance(x, np.ndarray)], dtype=float)
        out = np.empty((3 * len(self.terms), many))
        frame = np.array([many, *map(address, columns), *map(address, out)], dtype=np.int64)
        function.call(address(frame), address(constants))
        counts.native_points += count
        return out[:, :count]


def _told(domain: WrittenInterval, found: Names) -> str:
    """What is said of bounds beside them."""
    told = domain.number(WILD if found.wild else TAME)
    return told if found.nowhere is None else domain.op("select", found.nowhere, domain.number(NOWHERE), told)


def _ends(kind: str) -> int:
    return 2 if kind in ("columns", "numbers") else 1


@lru_cache(maxsize=1024)
def _enclosing(terms: tuple[Term, ...], places: tuple[tuple[str, str], ...]) -> _Enclosing:
    return _Enclosing(terms, places)


def enclosures(terms: tuple[Term, ...], box: Mapping[str, Interval], count: int, backend: str) -> list[Interval]:
    """Bounds of the values of terms, which are `enclosable`, for variables in each of so many boxes."""
    if not terms or not count or backend == "numpy" or (count < BOXES and len(postorder(*terms)) < PARTS):
        return enclosure(terms, box)
    free = frozenset().union(*(term.free for term in terms))
    places: list[tuple[str, str]] = []
    given: list[Any] = []
    for name in sorted(free & box.keys()):
        ends = box[name][:1] if box[name][0] is box[name][1] else box[name]
        wide = any(isinstance(end, np.ndarray) for end in ends)
        places.append((name, ("column" if wide else "number") + "s" * (len(ends) - 1)))
        given += [np.broadcast_to(end, (count,)) if wide else float(end) for end in ends]
    way = _enclosing(terms, tuple(places))
    function = way.promotion.function(backend, way.text)
    if function is None:
        with way.promotion.by_numpy():
            return enclosure(terms, box)
    found = way.run(function, given, count)
    low, high, told = found[0::3], found[1::3], found[2::3]
    nowhere = told == NOWHERE
    low[nowhere] = high[nowhere] = np.nan
    known = np.isfinite(low) & np.isfinite(high) | nowhere
    if not known.all():
        known |= (told == WILD) & (low < np.inf) & (high > -np.inf)
        rest = np.nonzero(~known.all(axis=0))[0]
        some = {name: (_some(least, rest), _some(most, rest)) for name, (least, most) in box.items()}
        for row, (least, most) in enumerate(enclosure(terms, some) if rest.size else ()):
            low[row, rest], high[row, rest] = least, most
    return list(zip(low, high, strict=True))


def _some(end: Any, index: Ints) -> Any:
    return end[index] if np.ndim(end) else end
