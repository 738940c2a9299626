"""What references are made of: roots without derivatives, pieces between them, differences of values.

Nothing here knows a boundary term. A region is cut where roots are found by signs and by counting, what lies between
is integrated with some thirty digits, and derivatives are differences of such values: so a mistake in the theory that
is tested cannot be in the references as well.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

import mpmath as mp
import numpy as np

Value = Callable[[Any], Any]
Truth = tuple[Any, Any]  # the value and the derivative by the parameter
NODES = 600  # of the grid on which sign changes and turns are looked for
STEPS = 300  # of the iteration for roots of polynomials
APART = mp.mpc(1e-12, 1e-12)  # so that no two of them start alike
ENOUGH = 1e-16  # of an area
MOST = 8  # changes of order between two places that are looked at
# The weights of the central difference of order 8
WEIGHTS = (Fraction(4, 5), Fraction(-1, 5), Fraction(4, 105), Fraction(-1, 280))
SECOND = (Fraction(8, 5), Fraction(-1, 5), Fraction(8, 315), Fraction(-1, 560))
SECOND_MIDDLE = Fraction(-205, 72)


def rational(x: Fraction) -> Any:
    return mp.mpf(x.numerator) / x.denominator


def differenced(value: Value, step: float = 1e-4) -> Callable[[Any], Truth]:
    """The value, and its derivative by central differences of order 8.

    They err by some 600 (step/r)^8/r where the nearest place at which the value is not analytic is r away.
    """

    def truth(t: Any) -> Truth:
        h = mp.mpf(step)
        parts = (rational(w) * (value(t + k * h) - value(t - k * h)) for k, w in enumerate(WEIGHTS, 1))
        return value(t), mp.fsum(parts) / h

    return truth


def second(value: Value, step: float = 1e-4) -> Value:
    """The second derivative by central differences of order 8."""

    def at(t: Any) -> Any:
        h = mp.mpf(step)
        parts = [rational(w) * (value(t + k * h) + value(t - k * h)) for k, w in enumerate(SECOND, 1)]
        return (mp.fsum(parts) + rational(SECOND_MIDDLE) * value(t)) / h**2

    return at


# Roots in one variable


def between(f: Value, a: Any, b: Any) -> Any:
    """The root between two signs."""
    return mp.findroot(f, (a, b), solver="anderson", tol=mp.eps**1.8, maxsteps=200, verify=False)


def roots(
    f: Value, lo: Any, hi: Any, nodes: int = NODES, refined: Callable[[Value, Any, Any], Any] = between
) -> list[Any]:
    """Where f changes sign. Between two nodes it may do so twice: then it has a turn there with another sign.

    refined: what finds the root between two signs.
    """
    lo, hi = mp.mpf(lo), mp.mpf(hi)
    xs = [lo + (hi - lo) * k / nodes for k in range(nodes + 1)]
    ys = [f(x) for x in xs]
    found = []
    for k in range(nodes):
        if ys[k] * ys[k + 1] < 0:
            found.append(refined(f, xs[k], xs[k + 1]))
        elif k > 0 and abs(ys[k]) < min(abs(ys[k - 1]), abs(ys[k + 1])) and ys[k] * ys[k - 1] > 0:
            turn = lowest(lambda x, y=ys[k]: mp.sign(y) * f(x), xs[k - 1], xs[k + 1])
            if f(turn) * ys[k] < 0:
                found += [refined(f, xs[k - 1], turn), refined(f, turn, xs[k + 1])]
    return found


def lowest(f: Value, a: Any, b: Any) -> Any:
    """By the golden section."""
    ratio = (mp.sqrt(5) - 1) / 2
    for _ in range(140):
        c, d = b - ratio * (b - a), a + ratio * (b - a)
        a, b = (a, d) if f(c) < f(d) else (c, b)
    return (a + b) / 2


def line(integrand: Value, surfaces: Sequence[Value], lo: Any, hi: Any, nodes: int = NODES) -> Any:
    """The integral of what is smooth between the roots of `surfaces`, by Gauss rules."""
    cuts = sorted(itertools.chain.from_iterable(roots(f, lo, hi, nodes) for f in surfaces))
    return pieces(integrand, [mp.mpf(lo), *cuts, mp.mpf(hi)])


def pieces(integrand: Value, cuts: Sequence[Any], parts: int = 1) -> Any:
    """Between neighbours by Gauss rules, each stretch in `parts`."""
    total = mp.mpf(0)
    for a, b in itertools.pairwise(cuts):
        if b > a:
            total += mp.quad(integrand, mp.linspace(a, b, parts + 1), method="gauss-legendre")
    return total


def length(holds: Callable[[Any], bool], surfaces: Sequence[Value], lo: Any, hi: Any, weight: Value | None = None,
           nodes: int = NODES) -> Any:  # fmt: skip
    """How long a condition holds between the roots of `surfaces`; `weight` is an antiderivative of what counts."""
    cuts = sorted(itertools.chain.from_iterable(roots(f, lo, hi, nodes) for f in surfaces))
    return covered(holds, [mp.mpf(lo), *cuts, mp.mpf(hi)], weight or (lambda x: x))


def covered(holds: Callable[[Any], bool], cuts: Sequence[Any], weight: Value) -> Any:
    """The increments of `weight` over the stretches at whose middle a condition holds."""
    stretches = ((a, b) for a, b in itertools.pairwise(cuts) if b > a and holds((a + b) / 2))
    return mp.fsum(weight(b) - weight(a) for a, b in stretches)


# Two variables: the places in y of each surface over x, and where their order changes


def real_roots(coefficients: Sequence[Any]) -> list[Any]:
    """Of a polynomial, the highest power first: those whose imaginary parts are below half of the digits."""
    while coefficients and abs(coefficients[0]) < mp.eps:
        coefficients = coefficients[1:]
    if len(coefficients) < 2:
        return []
    enough = mp.eps / 1024
    with mp.extraprec(mp.mp.prec):
        found = all_roots([mp.mpf(c) / coefficients[0] for c in coefficients], enough)
    return [mp.re(r) for r in found if abs(mp.im(r)) < mp.sqrt(mp.eps)]


def all_roots(monic: Sequence[Any], enough: Any) -> list[Any]:
    """By the simultaneous iteration of Durand and Kerner, from what doubles give."""
    found = [mp.mpc(r) + k * APART for k, r in enumerate(np.roots([float(c) for c in monic]))]
    for _ in range(STEPS):
        most = mp.mpf(0)
        for i, r in enumerate(found):
            gap = mp.fprod(r - q for j, q in enumerate(found) if j != i)
            step = mp.polyval(list(monic), r) / gap if gap else APART
            found[i] = r - step
            most = max(most, abs(step))
        if most < enough:
            break
    return found


class Region:
    """A part of a box in two variables, by the places in y of its surfaces over each x.

    places: for each surface its roots in y. holds: whether a point counts. weight: an antiderivative in y of what is
    integrated (by default of 1). grid: how many x are looked at for changes of the order of the places.
    """

    def __init__(
        self, places: Callable[[Any], list[list[Any]]], holds: Callable[[Any, Any], bool], xs: Sequence[Any],
        ys: Sequence[Any], weight: Callable[[Any, Any], Any] | None = None, grid: int = 120,
    ) -> None:  # fmt: skip
        self.places, self.holds, self.grid = places, holds, grid
        self.xs, self.ys = [mp.mpf(x) for x in xs], [mp.mpf(y) for y in ys]
        self.weight = weight or (lambda x, y: y)

    def cuts(self, x: Any) -> list[tuple[Any, int]]:
        """The places within the box, each with the number of its surface."""
        return sorted((y, k) for k, ys in enumerate(self.places(x)) for y in ys if self.ys[0] < y < self.ys[1])

    def order(self, x: Any) -> tuple[Any, ...]:
        """Which surfaces lie one above the other, and between which the points count."""
        cuts = self.cuts(x)
        ends = [self.ys[0], *(y for y, _ in cuts), self.ys[1]]
        return (*(k for _, k in cuts), *(self.holds(x, (a + b) / 2) for a, b in itertools.pairwise(ends)))

    def over(self, x: Any) -> Any:
        """The integral over y."""
        cuts = [self.ys[0], *(y for y, _ in self.cuts(x)), self.ys[1]]
        return covered(lambda y: self.holds(x, y), cuts, lambda y: self.weight(x, y))

    def changes(self) -> list[Any]:
        """The x at which the order changes, by halving; between two places that are looked at it may do so twice."""
        lo, hi = self.xs[0], self.xs[-1]
        grid = [lo + (hi - lo) * (k + mp.mpf(1) / 3) / self.grid for k in range(self.grid)]
        found = []
        for a, b in itertools.pairwise([lo, *grid, hi]):
            before, after = self.order(a), self.order(b)
            for _ in range(MOST):
                if before == after:
                    break
                found.append(a := self.change(a, b, before))
                before = self.order(a)
        return found

    def change(self, a: Any, b: Any, before: tuple[Any, ...]) -> Any:
        """A place behind a at which the order is another one."""
        while b - a > mp.eps:
            middle = (a + b) / 2
            a, b = (middle, b) if self.order(middle) == before else (a, middle)
        return b

    def area(self) -> Any:
        """By double-exponential rules: heights are like roots at the ends of pieces."""
        ends = sorted({*self.xs, *self.changes()})
        far = [(a, b) for a, b in itertools.pairwise(ends) if b - a > mp.mpf(10) ** -20]
        return mp.fsum(self.piece(a, b) for a, b in far)

    def piece(self, a: Any, b: Any) -> Any:
        """Halved where the rule itself says that it is off: a fold may be near without being met."""
        value, error = mp.quad(self.over, [a, b], error=True)
        if error <= ENOUGH:
            return value
        return self.piece(a, (a + b) / 2) + self.piece((a + b) / 2, b)


# Polytopes, exactly


def polytope(rows: Sequence[Sequence[Fraction]], bounds: Sequence[Fraction]) -> Fraction:
    """The volume where `rows` times x is at most `bounds`, by Lasserre's recursion over the faces (1983)."""
    if any(b < 0 and not any(row) for row, b in zip(rows, bounds)):
        return Fraction(0)
    if len(rows[0]) == 1:
        up = [b / a for (a,), b in zip(rows, bounds) if a > 0]
        down = [b / a for (a,), b in zip(rows, bounds) if a < 0]
        return max(Fraction(0), min(up) - max(down))
    different = {_scaled(row, b) for row, b in zip(rows, bounds) if any(row)}  # equal faces would count twice
    total = Fraction(0)
    for row, bound in different:
        pivot = max(range(len(row)), key=lambda j: abs(row[j]))
        if bound:
            face = [_on_face(*other, row, bound, pivot) for other in different if other != (row, bound)]
            total += bound / abs(row[pivot]) * polytope([r for r, _ in face], [b for _, b in face])
    return total / len(rows[0])


def _scaled(row: Sequence[Fraction], bound: Fraction) -> tuple[tuple[Fraction, ...], Fraction]:
    """A half-space with the largest of its coefficients at 1."""
    size = max(map(abs, row))
    return tuple(x / size for x in row), bound / size


def _on_face(
    other: Sequence[Fraction], b: Fraction, row: Sequence[Fraction], bound: Fraction, pivot: int
) -> tuple[list[Fraction], Fraction]:
    """A half-space in the variables that are left where row times x is the bound."""
    share = other[pivot] / row[pivot]
    return [o - share * r for j, (o, r) in enumerate(zip(other, row)) if j != pivot], b - share * bound


def cube(n: int) -> tuple[list[list[Fraction]], list[Fraction]]:
    """The half-spaces of the unit cube."""
    unit = [[Fraction(int(i == j)) for j in range(n)] for i in range(n)]
    return unit + [[-x for x in row] for row in unit], [Fraction(1)] * n + [Fraction(0)] * n
