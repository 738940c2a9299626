"""The text of a product rule over boxes (`tensor_product`), as LLVM reads it.

Owns `BoxText`. Bounds are columns of numbers that stand still, there are no cuts, and what is integrated may be a tuple
of numbers. How far off the rule is is worked out on the spot, as `tensor_product` and `gauss.truncation` do it by
numpy.
"""

from __future__ import annotations

from collections.abc import Sequence

from potto.core.terms import Term, Tuple, children
from potto.integrate.fixed.rule_text import Place, RuleText, Symbol
from potto.integrate.fixed.straight import Straight
from potto.integrate.pieces import Evaluator
from potto.integrate.rules.gauss import EPS, gauss
from potto.kernels.native.straight import NotStraight

NODE_ROUNDING = 0.5
# From how many nodes on `gauss.truncation` looks whether the decay slows down; then it is left to numpy.
SLOWING = 8


class BoxText(RuleText):
    """Writes the function, for so many nodes of each variable, which are exact for a polynomial or not.

    Rows of results: the integrals of all numbers with their tangents, how far off these are, the most that is added up
    for values and for tangents, and whether the rule does. The first two constants are the accuracy that is asked for.
    """

    reserved = 2

    def __init__(
        self, plan: Straight, face: Term, machine: Evaluator, orders: Sequence[int], exact: Sequence[bool]
    ) -> None:
        super().__init__(plan, face, machine)
        self.channels = numbers(face) * self.k1
        self.orders, self.exact = orders, exact

    def text(self, places: Sequence[Place]) -> str:
        at, each = self.at, self.channels
        self.begin(places)
        self.added = [at.room(n * each) for n in self.orders]
        self.most = [at.room(1) for _ in range(each)]
        here, columns = self.parameters(places, 2 * len(self.plan.variables))
        self.low, self.high = columns[::2], columns[1::2]
        self.sizes = [at.apply("sub", b, a) for a, b in zip(self.low, self.high, strict=True)]
        for added, n in zip(self.added, self.orders, strict=True):
            self.fill(added, str(n), each)
        for room in self.most:
            at.store(self.zero, room)
        self.results([x or self.zero for x in self.mean(0, here, self.one)])
        return self.end()

    # Nodes

    def mean(self, i: int, env: dict[str, Symbol], outer: str) -> list[str | None]:
        """The mean values over variable i and those further in. outer: the weight of the node of those further out."""
        at, each, sums = self.at, self.channels, self.sums[i]
        n, rows, _, nodes, _, weights, transform, _, _ = self.tables[i]
        self.fill(sums, rows, each)
        j = at.begin(n)
        weight = at.apply("mul", outer, at.constant(weights, j))
        node = at.apply("add", self.low[i], at.apply("mul", self.sizes[i], at.constant(nodes, j)))
        inner = {**env, self.plan.variables[i]: Symbol(node, None, (None,) * (self.k1 - 1), ())}
        values = self.values(inner, weight) if i + 1 == len(self.sizes) else self.mean(i + 1, inner, weight)
        row = at.begin(rows)
        factor = at.constant(transform, at.whole("add", at.whole("mul", j, rows), row))
        base = at.whole("mul", row, each)
        for c, value in enumerate(values):
            if value is not None:
                place = at.at(sums, at.whole("add", base, c))
                at.store(at.apply("add", at.load(place), at.apply("mul", factor, value)), place)
        at.end()
        at.end()
        moving = [c for c, value in enumerate(values) if value is not None]
        row = at.begin(rows)
        base = at.whole("mul", row, each)
        for c in moving:
            where = at.whole("add", base, c)
            size, place = at.apply("abs", at.load(at.at(sums, where))), at.at(self.added[i], where)
            at.store(at.apply("add", at.load(place), at.apply("mul", outer, size)), place)
        at.end()
        return [at.load(at.at(sums, c)) if c in moving else None for c in range(each)]

    def values(self, env: dict[str, Symbol], weight: str) -> list[str | None]:
        """The integrand's numbers at a node, each with its tangents; their sizes are added up."""
        at = self.at
        cells = self.evaluated(self.face, env, self.machine)
        found = [self.plain(x) for cell in cells for x in (cell.v, *(cell.t or (None,) * (self.k1 - 1)))]
        if len(found) != self.channels:
            raise NotStraight("a tuple of another size")
        for value, room in zip(found, self.most, strict=True):
            if value is not None:
                at.store(at.apply("add", at.load(room), at.apply("mul", weight, at.apply("abs", value))), room)
        return found

    # What they amount to

    def results(self, means: Sequence[str]) -> None:
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
        bounds, good = [], None
        for c, mean in enumerate(means):
            error, floor = self.zero, at.apply("mul", at.number(4 * EPS), at.load(self.most[c]))
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
            bounds.append(at.apply("add", error, floor))
        assert good is not None
        most = [at.load(room) for room in self.most]
        gross = [most[::k1], [x for c, x in enumerate(most) if c % k1] or [self.zero]]
        rows = [*means, *bounds]
        for row in gross:
            largest = row[0]
            for other in row[1:]:
                largest = at.apply("max", largest, other)
            rows.append(largest)
        for number, value in enumerate(rows):
            at.store(at.apply("mul", value, volume), self.place(number))
        at.store(at.apply("select", good, self.one, self.zero), self.place(len(rows)))

    def truncation(self, sizes: Sequence[str]) -> str:
        """`gauss.truncation` of the sizes of coefficients; infinite where the decay slows down."""
        at, n = self.at, len(sizes)
        middle = max(n // 2 - 2, 0)
        end, before, half = (at.apply("add", sizes[i], sizes[i + 1]) for i in (n - 2, n - 4, middle))
        last = at.apply("div", end, before)
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

    def greater(self, x: str, y: str) -> str:
        """The greater one; of a number and what is none, the number."""
        at = self.at
        return at.apply("select", at.apply("gt", x, y), x, at.apply("select", at.apply("eq", y, y), y, x))


def numbers(face: Term) -> int:
    """How many numbers a term comes to."""
    return sum(map(numbers, children(face))) if isinstance(face, Tuple) else 1
