"""Enclosures of many boxes by machine code, as `intervals` finds them by numpy.

Owns `enclosures`, and `Written` for who encloses as a part of something else. The bounds are the same but for how they
are rounded outwards, which neither promises to the bit. A box on which something divides by what may be 0, or
overflows, is left to numpy, which knows what follows from that.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from msgspec import Struct, field

from potto.core.terms import Const, Prim, Term
from potto.integrate.rules.gauss import EPS
from potto.integrate.rules.intervals import ROUNDING, Interval, enclosure
from potto.kernels.cells import Array, Ints
from potto.kernels.making import counts
from potto.kernels.native.elementary import module
from potto.kernels.native.objects import Loaded
from potto.kernels.native.points import address
from potto.kernels.native.promotion import Promotion
from potto.kernels.native.straight import NotStraight
from potto.kernels.native.vectors import LANES, Vectors
from potto.primitives import Primitive
from potto.primitives.walking import Domain, Rule

NAME = "enclose"
LEAST = 256  # boxes, below which a call of machine code takes longer than numpy
MOST_POWER = 8

Names = tuple[str, str]


class Written(Domain[Names]):
    """Intervals whose bounds are names of vectors, written down in a text."""

    def __init__(self, at: Vectors) -> None:
        self.at = at

    def constant(self, node: Const) -> Names:
        return self.number(node.value), self.number(node.value)

    def number(self, value: float) -> str:
        return self.at.number(value)

    def rule(self, entry: Primitive) -> Rule[Names] | None:
        return None

    def unknown(self) -> Names:
        raise NotStraight("nothing is known")

    def builtin(self, node: Prim, known: Mapping[Term, Names]) -> Names:
        args = [known[arg] for arg in node.args]
        match node.op:
            case "add":
                found = args[0]
                for arg in args[1:]:
                    found = self.sum(found, arg)
            case "neg":
                return self.turned(args[0])
            case "mul":
                powers = [self.power(known[arg], node.args.count(arg)) for arg in dict.fromkeys(node.args)]
                found = powers[0]
                for power in powers[1:]:
                    found = self.product(found, power)
            case "div":
                found = self.product(args[0], self.inverse(args[1]))
            case "pow" if isinstance(node.args[1], Const) and node.args[1].value in range(1, MOST_POWER + 1):
                found = self.power(args[0], int(node.args[1].value))
            case "abs":
                low, high = args[0]
                return self.op("max", self.op("max", low, self.op("neg", high)), self.number(0.0)), self.size(args[0])
            case "min" | "max":
                low, high = args[0]
                for arg in args[1:]:
                    low, high = self.op(node.op, low, arg[0]), self.op(node.op, high, arg[1])
                return low, high
            case _:
                return self.apply(node.op, args)
        return self.outwards(found)

    def op(self, code: str, *args: str) -> str:
        return self.at.apply(code, *args)

    def size(self, a: Names) -> str:
        return self.op("max", self.op("abs", a[0]), self.op("abs", a[1]))

    def turned(self, a: Names) -> Names:
        return self.op("neg", a[1]), self.op("neg", a[0])

    def outwards(self, a: Names) -> Names:
        room = self.number(ROUNDING)
        low, high = (self.op("mul", room, self.op("abs", end)) for end in a)
        return self.op("sub", a[0], low), self.op("add", a[1], high)

    def sum(self, a: Names, b: Names) -> Names:
        """With room for what is lost of operands that cancel."""
        low, high = self.op("add", a[0], b[0]), self.op("add", a[1], b[1])
        slack = self.op("mul", self.number(EPS), self.op("add", self.size((low, high)), self.size(b)))
        return self.op("sub", low, slack), self.op("add", high, slack)

    def product(self, a: Names, b: Names) -> Names:
        if a[0] == a[1] or b[0] == b[1]:
            corners = list(dict.fromkeys(self.op("mul", x, y) for x in dict.fromkeys(a) for y in dict.fromkeys(b)))
        else:
            corners = [self.op("mul", x, y) for x in a for y in b]
        low = high = corners[0]
        for corner in corners[1:]:
            low, high = self.op("min", low, corner), self.op("max", high, corner)
        return low, high

    def inverse(self, a: Names) -> Names:
        """Of what has 0 in it, or is infinite all over, nothing that counts."""
        zero, one, nan = self.number(0.0), self.number(1.0), self.number(np.nan)
        above = self.op("and", self.op("gt", a[0], zero), self.op("lt", a[0], self.number(np.inf)))
        below = self.op("and", self.op("lt", a[1], zero), self.op("gt", a[1], self.number(-np.inf)))
        fine = self.op("or", above, below)
        low, high = (self.op("select", fine, self.op("div", one, end), nan) for end in (a[1], a[0]))
        return low, high

    def power(self, a: Names, n: int) -> Names:
        if n > MOST_POWER:
            raise NotStraight("a high power")
        low, high = a
        for _ in range(n - 1):
            low, high = self.op("mul", low, a[0]), self.op("mul", high, a[1])
        if n % 2:
            return low, high
        zero = self.number(0.0)
        inside = self.op("and", self.op("le", a[0], zero), self.op("ge", a[1], zero))
        return self.op("select", inside, zero, self.op("min", low, high)), self.op("max", low, high)


class _Enclosing(Struct, frozen=True):
    """The function for some terms. places: per number its name, and of which ends there are columns of their own."""

    terms: tuple[Term, ...]
    places: tuple[tuple[str, str], ...]
    promotion: Promotion = field(default_factory=lambda: Promotion(NAME))

    def text(self) -> str:
        """A function of a frame (how many, where columns are, where those of the results are) and of constants."""
        domain = Written(Vectors())
        at, box, columns, constants = domain.at, dict[str, Names](), 1, 0
        last = at.whole("sub", at.address("%frame", 0), LANES)
        vectors = at.whole("udiv", at.whole("add", at.address("%frame", 0), LANES - 1), LANES)
        first = at.whole("mul", at.begin(vectors), LANES)
        k = at.once(f"call i64 @llvm.umin.i64(i64 {first}, i64 {last})", first)  # the last ones are done twice

        def place(column: int) -> str:
            return at.at(at.address("%frame", column, "ptr"), k, "double")

        for name, kind in self.places:
            ends = []
            for _ in range(2 if kind in ("columns", "numbers") else 1):
                if kind in ("columns", "column"):
                    ends.append(at.load(place(columns)))
                    columns += 1
                else:
                    ends.append(at.constant("%constants", constants))
                    constants += 1
            box[name] = (ends[0], ends[-1])
        found = domain.walk(self.terms, box, {})
        for column, end in enumerate((end for ends in found for end in ends), columns):
            at.store(end, place(column))
        at.end()
        return module(at, NAME, "ptr %frame, ptr %constants")

    def run(self, function: Loaded, given: Sequence[Any], count: int) -> Array:
        """Lower and upper bounds, (2 * terms, count)."""
        columns = [np.ascontiguousarray(x, dtype=float) for x in given if isinstance(x, np.ndarray)]
        constants = np.array([x for x in given if not isinstance(x, np.ndarray)], dtype=float)
        out = np.empty((2 * len(self.terms), count))
        frame = np.array([count, *map(address, columns), *map(address, out)], dtype=np.int64)
        function.call(address(frame), address(constants))
        counts.native_points += count
        return out


@lru_cache(maxsize=1024)
def _enclosing(terms: tuple[Term, ...], places: tuple[tuple[str, str], ...]) -> _Enclosing:
    return _Enclosing(terms, places)


def enclosures(terms: tuple[Term, ...], box: Mapping[str, Interval], count: int, backend: str) -> list[Interval]:
    """Bounds of the values of terms, which are `enclosable`, for variables in each of so many boxes."""
    if not terms or count < LEAST or backend == "numpy":
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
    open_ended = np.nonzero(~np.isfinite(found).all(axis=0))[0]
    if open_ended.size:
        some = {name: (_some(low, open_ended), _some(high, open_ended)) for name, (low, high) in box.items()}
        for row, (low, high) in enumerate(enclosure(terms, some)):
            found[2 * row, open_ended], found[2 * row + 1, open_ended] = low, high
    return [(found[2 * row], found[2 * row + 1]) for row in range(len(terms))]


def _some(end: Any, index: Ints) -> Any:
    return end[index] if np.ndim(end) else end
