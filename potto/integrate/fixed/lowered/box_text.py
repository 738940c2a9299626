"""The text of a function that integrates over boxes which nothing cuts (`boxes`), as LLVM reads it.

Owns `Look` and `BoxText`. A function works out the bounds of each member, on which side of every surface its box lies,
and by a product rule what is integrated there; what is integrated may be a tuple of numbers. How far off the rule is is
worked out on the spot, as `tensor_product` and `gauss.truncation` do it by numpy.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from functools import reduce

from msgspec import Struct

from potto.core.terms import Lam, Term, Tuple, children, function_of
from potto.integrate.fixed.lowered.box_means import BoxMeans
from potto.integrate.fixed.lowered.formula_text import ParameterPlace, Symbol, still
from potto.integrate.fixed.straight import StraightIntegral
from potto.integrate.panels.roundoff import NODE_ROUNDING
from potto.integrate.pieces import Evaluator
from potto.integrate.rules.gauss import EPS, PEAK, gauss
from potto.integrate.rules.written_intervals import Names, WrittenInterval
from potto.kernels.native.operations import NotStraight

# How near to 0, of its size, a surface at a corner may be before it counts as crossing.
NEAR = 1e-9
# From how many nodes on `gauss.truncation` looks whether the decay slows down; then it is left to numpy.
SLOWING = 8


# What became of a member: a surface may cross it, nothing is there to be integrated, it is done (and known to half of
# what is asked of each of its numbers, or less so), or left to others.
CROSSED, DARK, DONE, ROUGH, LEFT = range(5)
# Behind the columns the frame tells how many members are done, crossed, left, and done less accurately; where lists of
# the crossed and the left are; then where the rows of results are.
COUNTS, LISTS, ROWS = 0, 4, 6


class Look(Struct, frozen=True):
    """What boxes are looked at for.

    bounds: of the variables, a tuple. flat: the surfaces that are affine in each variable, a tuple; curved: the others.
    deciding: of all of them, in this order, those on which it depends what is integrated. faces: what is integrated,
    each with its sides, as numbers with a bit for each of `deciding`. known: the sides of all boxes are those of
    the one face.
    """

    plan: StraightIntegral
    bounds: Lam
    flat: Lam
    curved: tuple[Term, ...]
    deciding: tuple[int, ...]
    faces: tuple[tuple[Term, tuple[int, ...]], ...]
    known: bool = False


class BoxText(BoxMeans):
    """Writes the function, for so many nodes of each variable, which are exact for a polynomial or not.

    Rows of results: the integrals of all numbers with their tangents, how far off these are, the most that is added up
    for values and for tangents, all of them 0 for members that are not done. The first two constants are the accuracy
    that is asked for.
    """

    reserved = 2

    def __init__(self, look: Look, machine: Evaluator, orders: Sequence[int], exact: Sequence[bool]) -> None:
        super().__init__(look.plan, look.faces[0][0] if look.faces else look.plan.body, machine)
        sizes = {numbers(face) for face, _ in look.faces} or {1}
        if len(sizes) > 1:
            raise NotStraight("tuples of several sizes")
        self.look, self.channels = look, sizes.pop() * self.k1
        self.orders, self.exact = orders, exact

    def text(self, places: Sequence[ParameterPlace]) -> str:
        at, each = self.at, self.channels
        self.begin()
        self.added = [at.room(n * each) for n in self.orders]
        self.most, self.own = ([at.room(1) for _ in range(each)] for _ in range(2))
        self.largest, self.peaks = ([at.room(1) for _ in range(each // self.k1)] for _ in range(2))
        self.tail, self.state = self.columns + sum(place.kind == "array" for place in places), at.room(1)
        here, _ = self.parameters(places, self.columns)
        ends = self.evaluated(self.look.bounds, here, self.machine)
        if any(end.e is not None or any(x is not None for x in end.t) for end in ends):
            raise NotStraight("bounds that move have boundary terms of their own")
        self.low, self.high = [end.v for end in ends[::2]], [end.v for end in ends[1::2]]
        self.sizes = [at.apply("sub", b, a) for a, b in zip(self.low, self.high, strict=True)]
        lit = self.told_sides() if self.look.known else self.sides(here)
        for row in range(rows_of(each)):
            at.store(self.zero, self.place(row))
        bounds = self.low, self.high, self.sizes  # what is made of them for a face is made where it is lit
        for (face, _), mask in zip(self.look.faces, lit, strict=True):
            at.begin("1", at.any(mask))
            self.low, self.high, self.sizes = (list(map(at.again, ends)) for ends in bounds)
            self.face = function_of(face)
            for added, n in zip(self.added, self.orders, strict=True):
                self.fill(added, str(n), each)
            for room in (*self.most, *self.own, *self.largest, *self.peaks):
                at.store(self.zero, room)
            means = [x or self.zero for x in self.mean(0, here, self.one)]
            standing = {name: still(symbol) for name, symbol in here.items()}
            even: list[str] = []
            if not all(self.exact):
                self.at_corners(0, standing)
                even = self.even(face, here, self.box)
            self.results(means, self.shares(standing), mask, even)
            at.end()
        self.list_members()
        return self.end()

    def list_members(self) -> None:
        """Count the members of a block that are done, and put the others on lists."""
        at, state, own = self.at, self.at.load(self.state), self.owners()
        fresh = at.apply("ge", own, self.spread(self.number))
        done, rough, *others = (at.apply("and", fresh, at.apply("eq", state, at.number(float(code))))
                                for code in (DONE, ROUGH, CROSSED, LEFT))  # fmt: skip
        for slot, mask in ((0, at.apply("or", done, rough)), (3, rough)):
            count = at.at("%frame", self.tail + COUNTS + slot, "i64")
            at.line(f"store i64 {at.whole('add', at.let(f'load i64, ptr {count}'), at.many(mask))}, ptr {count}")
        for number, mask in enumerate(others):
            place = at.address("%frame", self.tail + LISTS + number, "ptr")
            self.append(mask, [own], [place], at.at("%frame", self.tail + COUNTS + 1 + number, "i64"))

    def place(self, row: int | str) -> str:
        """Where the results of a block are in a row."""
        return self.at.at(self.at.address("%frame", self.tail + ROWS + int(row), "ptr"), self.first, "double")

    # Sides

    def told_sides(self) -> list[str]:
        """All members are those of the one face."""
        self.at.store(self.at.number(float(DONE)), self.state)
        return ["splat (i1 true)"]

    def sides(self, env: Mapping[str, Symbol]) -> list[str]:
        """For each face of which members it is the integrand; what became of the others is noted."""
        at, look = self.at, self.look
        here = {name: Symbol(symbol.v, symbol.e, (), ()) for name, symbol in env.items()}
        clear = [at.apply("and", at.apply("lt", size, at.number(float("inf"))), at.apply("gt", size, self.zero))
                 for size in self.sizes]  # fmt: skip
        known, sides = [], []
        for least, most, off in self.corners(here):
            near = at.apply("mul", at.number(NEAR), self.larger(least, most))
            near = near if off is None else at.apply("add", near, off)
            sides.append((at.apply("gt", least, near), at.apply("lt", most, at.apply("neg", near))))
        for least, most, nowhere, _ in self.enclosed(here):
            sides.append((at.apply("gt", least, self.zero), at.apply("lt", most, self.zero)))
            known.append(at.apply("lt", self.larger(least, most), at.number(float("inf"))))
            known += [] if nowhere is None else [at.apply("not", nowhere)]
        clear += [at.apply("or", above, below) for above, below in sides]
        decided = self.all(clear)
        lit = [self.among(decided, sides, codes) for _, codes in look.faces]
        dark = self.all([decided, *(at.apply("not", mask) for mask in lit)])
        state = at.apply("select", dark, at.number(float(DARK)), at.number(float(CROSSED)))
        if known:  # an enclosure that does not tell: numpy may know more
            state = at.apply("select", self.all(known), state, at.number(float(LEFT)))
        at.store(state, self.state)
        return lit

    def corners(self, here: Mapping[str, Symbol]) -> list[tuple[str, str, str | None]]:
        """The least and the most of surfaces that are affine in each variable, which they are at corners, and how far
        off they may be at any of these."""
        found: list[tuple[str, str, str | None]] = []
        if not children(self.look.flat.body):
            return found
        for ends in itertools.product(*zip(self.low, self.high, strict=True)):
            corner = {x: Symbol(end, None, (), ()) for x, end in zip(self.plan.variables, ends, strict=True)}
            cells = self.evaluated(self.look.flat, {**here, **corner}, self.machine.with_directions(0).tracking())
            before = found or [(cell.v, cell.v, cell.e) for cell in cells]
            found = [
                (self.at.apply("min", least, cell.v), self.at.apply("max", most, cell.v), self.greatest(off, cell.e))
                for (least, most, off), cell in zip(before, cells, strict=True)
            ]
        return found

    def greatest(self, x: str | None, y: str | None) -> str | None:
        """The greater of two errors; one that is missing is 0."""
        return x if y is None or x == y else y if x is None else self.at.apply("max", x, y)

    def enclosed(self, here: Mapping[str, Symbol]) -> list[Names]:
        """Bounds of the other surfaces."""
        box = {name: self.range(symbol) for name, symbol in here.items()} | self.box
        return WrittenInterval(self.at).walk(self.look.curved, box, {}) if self.look.curved else []

    @property
    def box(self) -> dict[str, Names]:
        """Where the variables are."""
        return dict(zip(self.plan.variables, map(Names, self.low, self.high), strict=True))

    def among(self, decided: str, sides: Sequence[tuple[str, str]], codes: Sequence[int]) -> str:
        """Whose sides are one of these."""
        at = self.at
        masks = []
        for code in codes:
            own = [sides[place][0 if code >> bit & 1 else 1] for bit, place in enumerate(self.look.deciding)]
            masks.append(self.all([decided, *own]))
        return reduce(lambda a, b: at.apply("or", a, b), masks)

    def all(self, masks: Sequence[str]) -> str:
        return reduce(lambda a, b: self.at.apply("and", a, b), masks)

    # What nodes amount to

    def results(
        self, means: Sequence[str], shares: Sequence[str | None], mask: str, even: Sequence[str]
    ) -> None:  # fmt: skip
        """Put the integrals of the members of a mask for whom the rule does. shares: what their own rounding is."""
        at, k1 = self.at, self.k1
        volume = self.sizes[0]
        for size in self.sizes[1:]:
            volume = at.apply("mul", volume, size)
        far = [
            at.apply("min", at.apply("mul", at.number(NODE_ROUNDING * EPS), at.apply("div", self.larger(a, b), size)),
                     self.one)
            for a, b, size in zip(self.low, self.high, self.sizes, strict=True)
        ]  # fmt: skip
        rtol, least = at.constant("%constants", 0), at.apply("div", at.constant("%constants", 1), volume)
        bounds, good, precise = [], None, mask
        for c, mean in enumerate(means):
            error, floor = self.zero, self.own_rounding(c, shares[c // k1])
            for i, n in enumerate(self.orders):
                sizes = [at.load(at.at(self.added[i], row * self.channels + c)) for row in range(n)]
                slope = self.total(*(at.apply("mul", at.number(float(s)), x)
                                     for s, x in zip(gauss(n).slopes, sizes, strict=True) if s))  # fmt: skip
                if slope is not None:
                    floor = at.apply("add", floor, at.apply("mul", slope, far[i]))
                if not self.exact[i]:
                    error = at.apply("add", error, self.truncation(sizes))
            asked = self.larger(at.apply("mul", rtol, at.apply("abs", mean)), least)
            fine = at.apply("le", error, self.larger(asked, at.apply("mul", at.number(8.0), floor)))
            good = fine if good is None else at.apply("and", good, fine)
            bound, size = at.apply("add", error, floor), at.apply("abs", mean)
            precise = self.all([precise, at.apply("le", bound, at.apply("mul", rtol, size)),
                                at.apply("lt", at.apply("mul", size, volume), at.number(float("inf")))])  # fmt: skip
            bounds.append(bound)
        assert good is not None
        for peak, room in zip(self.peaks, self.largest, strict=True):
            seen = at.apply("mul", at.number(PEAK), at.load(room))
            good = at.apply("and", good, at.apply("le", at.load(peak), seen))
        good = self.all([good, *even, *(at.apply("lt", part, self.one) for part in shares if part is not None)])
        most = [at.load(room) for room in self.most]
        gross = [most[::k1], [x for c, x in enumerate(most) if c % k1] or [self.zero]]
        rows = [*means, *bounds]
        for row in gross:
            largest = row[0]
            for other in row[1:]:
                largest = at.apply("max", largest, other)
            rows.append(largest)
        done = at.apply("and", mask, good)
        for number, value in enumerate(rows):
            self.keep(done, at.apply("mul", value, volume), self.place(number))
        state = at.apply("select", precise, at.number(float(DONE)), at.number(float(ROUGH)))
        state = at.apply("select", good, state, at.number(float(LEFT)))
        self.keep(mask, state, self.state)

    def own_rounding(self, c: int, share: str | None) -> str:
        """What the rounding of the integrand, and of parameters, comes to in a channel."""
        at, factor = self.at, self.at.number(4 * EPS)
        if share is not None:
            more = at.apply("select", at.apply("gt", share, factor), share, self.zero)
            factor = at.apply("add", factor, more)
        return at.apply("add", at.apply("mul", factor, at.load(self.most[c])), at.load(self.own[c]))

    def keep(self, mask: str, value: str, place: str) -> None:
        """Put a number for the members of a mask."""
        self.at.store(self.at.apply("select", mask, value, self.at.load(place)), place)

    def truncation(self, sizes: Sequence[str]) -> str:
        """`gauss.truncation` of the sizes of coefficients; infinite where the decay slows down."""
        at, n = self.at, len(sizes)
        middle = max(n // 2 - 2, 0)
        end, before, half = (at.apply("add", sizes[i], sizes[i + 1]) for i in (n - 2, n - 4, middle))
        last = at.apply("div", end, before)
        if n <= 4:
            ratios = at.apply("div", end, sizes[n - 3]), at.apply("div", sizes[n - 1], sizes[n - 2])
            last = self.greater(*ratios)
            last = at.apply("mul", last, last)
        mean = last
        if n >= SLOWING:
            mean = at.apply("div", end, half)
            for _ in range((n - 2 - middle).bit_length() - 2):
                mean = at.apply("sqrt", mean)
        decay = at.apply("min", self.greater(self.greater(last, mean), self.zero), self.one)
        power = at.apply("mul", decay, decay)
        if n >= SLOWING:
            power = at.apply("mul", power, power)
        slow = at.apply("div", at.apply("sub", decay, at.number(0.3)), at.number(0.3))
        share = at.apply("max", power, at.apply("min", self.one, slow))
        found = at.apply("mul", at.apply("mul", at.number(8.0), end), share)
        if n < SLOWING:
            return found
        slowing = at.apply("gt", last, at.apply("mul", at.number(1.15), mean))
        return at.apply("select", slowing, at.number(float("inf")), found)

    def larger(self, x: str, y: str) -> str:
        """The larger without regard to sign."""
        return self.at.apply("max", self.at.apply("abs", x), self.at.apply("abs", y))


def rows_of(channels: int) -> int:
    """How many rows of results there are of so many numbers."""
    return 2 * channels + 2


def numbers(face: Term) -> int:
    """How many numbers a term comes to."""
    return sum(map(numbers, children(face))) if isinstance(face, Tuple) else 1
