"""Random programs: the symbolic derivative of an integral against differences of its value.

The value comes from the tests' evaluator, which cuts where branches change and integrates the pieces to 12 digits; a
central difference with h = 1e-5 of it is good to about 1e-6 where the value is smooth. Where the two one-sided
differences disagree, the program has a kink at this very parameter and nothing is compared.
"""

from __future__ import annotations

import random

import mpmath as mp
import pytest
from calculus_terms import value
from how_many import examples

from potto.calculus.differentiation.dual import dual
from potto.core import terms as t
from potto.core.printer import format_term
from potto.core.terms import ONE, ZERO, Term

X, T = t.var("x"), t.var("t")
LEAVES = (X, X, T, t.const(0.5), t.const(2.0), t.const(0.3))
BOUNDS = ((ZERO, ONE), (t.const(-1.0), ONE), (ZERO, T), (ONE, t.const(-1.0)), (t.neg(T), t.mul(T, T)))


class Programs:
    """A source of random integrals over x with brackets that move with t."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)

    def term(self, depth: int, builtins: tuple[str, ...]) -> Term:
        pick = self.random
        if depth == 0:
            return pick.choice(LEAVES)
        kind = pick.random()
        a, b = self.term(depth - 1, builtins), self.term(depth - 1, builtins)
        if kind < 0.5:
            return pick.choice((t.add, t.sub))(a, b)
        if kind < 0.7:
            return t.mul(a, b)
        if kind < 0.8:
            return t.pow_(a, t.const(2.0))
        op = pick.choice(builtins)
        return t.prim(op, a, b) if op in ("hypot", "min", "max") else t.prim(op, a)

    def smooth(self, depth: int) -> Term:
        return self.term(depth, ("sin", "cos", "exp"))

    def surface(self, depth: int) -> Term:
        """No sqrt and no log: where those are not defined, neither is the program."""
        return self.term(depth, ("sin", "cos", "exp", "abs", "tanh", "atan", "hypot", "min", "max"))

    def bracket(self, surface: Term) -> Term:
        return t.branch((surface,), self.random.random() < 0.5, ONE, ZERO)

    def integral(self) -> Term:
        first = self.surface(self.random.choice((1, 2, 2, 3)))
        factor = self.smooth(self.random.choice((1, 2)))
        turned = self.bracket(t.mul(t.const(-2.0), first))
        body = self.random.choice(
            (
                t.mul(factor, self.bracket(first)),
                t.mul(self.bracket(first), t.add(factor, self.bracket(self.surface(1)))),
                t.branch((first,), False, self.smooth(2), factor),
                t.prim("sin", t.add(t.mul(t.const(3.0), self.bracket(first)), turned, factor)),
            )
        )
        return t.integral(("x",), (self.random.choice(BOUNDS),), body)


def compare(seed: int) -> None:
    programs = Programs(seed)
    whole = programs.integral()
    at, h = programs.random.uniform(0.2, 1.5), 1e-5
    tangent = dual(whole, {"t": ONE})[1]
    if any(isinstance(node, t.Delta) for node in t.postorder(tangent)):
        return  # over a level set, which has no closed form: only numbers integrate it
    here, up, down = (float(value(whole, {"t": s})) for s in (at, at + h, at - h))
    with mp.workdps(60):  # in which products of doubles are exact: x*x + x - (x*x + x) is 0, and not its rounding
        derived = float(value(tangent, {"t": at}))
    if any(v != v for v in (up, down, derived)):
        return
    central, right, left = (up - down) / (2 * h), (up - here) / h, (here - down) / h
    size = 1 + abs(central)
    if abs(right - left) < 1e-3 * size:
        assert abs(central - derived) < 1e-5 * size, (format_term(whole), at, central, derived)


@pytest.mark.parametrize("seed", range(60))
def test_the_derivative_of_a_random_integral(seed: int) -> None:
    compare(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(1000, 1000 + examples(60, 500), 10))
def test_the_derivatives_of_many_random_integrals(seed: int) -> None:
    for each in range(seed, seed + 10):
        compare(each)
