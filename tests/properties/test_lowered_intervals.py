"""Bounds by machine code hold every value of a term, and are those that numpy finds.

Values are found in fractions at points of the boxes, corners included. Both kinds of bounds are rounded outwards, so
they may differ by a few units in the last place of what was added up on the way, which is bounded by the size of the
largest number that comes up.
"""

from __future__ import annotations

import math
import random
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from how_many import examples

from potto.core import terms as core
from potto.core.terms import Const, Prim, Term, Var, postorder
from potto.integrate.rules.intervals import enclosure
from potto.integrate.rules.lowered_intervals import enclosures
from potto.kernels.making import counts

pytest.importorskip("llvmlite")

COUNT = 300
NAMES = ("x", "y", "t")

VALUES: dict[str, Any] = {
    "add": lambda *args: sum(args),
    "mul": lambda *args: math.prod(args),
    "neg": lambda a: -a,
    "div": lambda a, b: a / b,
    "pow": lambda a, b: a ** int(b),
    "abs": abs,
    "min": min,
    "max": max,
}


def written(pick: random.Random, depth: int) -> Term:
    if not depth or pick.random() < 0.1:
        return pick.choice([*map(core.var, NAMES), core.const(pick.choice((0.5, -2.0, 1e-8, 1e8, 3.0)))])
    a, b, at = written(pick, depth - 1), written(pick, depth - 1), pick.random()
    if at < 0.5:
        return core.prim(pick.choice(("add", "mul")), a, b)
    if at < 0.65:
        return core.div(a, b)
    if at < 0.8:
        return core.pow_(a, core.const(pick.choice((2.0, 3.0))))
    if at < 0.9:
        return core.prim(pick.choice(("abs", "neg")), a)
    return core.prim(pick.choice(("min", "max")), a, b)


def boxes(pick: random.Random) -> dict[str, Any]:
    """Ranges: some of length zero, some that a constant is, some far away or tiny."""
    generator = np.random.default_rng(pick.randrange(1 << 30))
    found: dict[str, Any] = {}
    for name in NAMES:
        scale = pick.choice((1.0, 1e-8, 1e8))
        low = generator.normal(size=COUNT) * scale
        kind = pick.random()
        if kind < 0.2:
            found[name] = (float(low[0]), float(low[0]))
        elif kind < 0.4:
            found[name] = (low, low)
        else:
            found[name] = (low, low + generator.exponential(size=COUNT) * scale * pick.choice((1.0, 1e-9)))
    return found


def exact(term: Term, at: dict[str, Fraction]) -> tuple[Fraction | None, Fraction]:
    """The value, None where there is none, and the largest number that comes up."""
    known: dict[Term, Fraction] = {}
    for node in postorder(term):
        if isinstance(node, Const):
            known[node] = Fraction(node.value)
        elif isinstance(node, Var):
            known[node] = at[node.name]
        else:
            assert isinstance(node, Prim)
            args = [known[arg] for arg in node.args]
            if node.op == "div" and args[1] == 0:
                return None, Fraction(0)
            known[node] = VALUES[node.op](*args)
    return known[term], max(map(abs, known.values()))


@pytest.mark.parametrize("seed", range(examples(30)))
def test_bounds_hold_every_value_and_are_those_of_numpy(seed: int) -> None:
    pick = random.Random(seed)
    term, box = written(pick, 4), boxes(pick)
    if not term.free:
        return
    before = counts.native_points
    ((low, high),) = enclosures((term,), box, COUNT, "native")
    assert counts.native_points == before + COUNT
    ((least, most),) = enclosure((term,), box)
    least, most = np.broadcast_to(least, COUNT), np.broadcast_to(most, COUNT)
    assert (np.isnan(low) == np.isnan(least)).all()
    for i in range(0, COUNT, 10):
        largest = Fraction(0)
        for share in (Fraction(0), Fraction(1, 3), Fraction(1)):
            at = {}
            for name, ends in box.items():
                a, b = (Fraction(float(end[i] if np.ndim(end) else end)) for end in ends)
                at[name] = a + (b - a) * share
            value, size = exact(term, at)
            largest = max(largest, size)
            if value is not None and not np.isnan(low[i]):
                assert low[i] == -np.inf or Fraction(float(low[i])) <= value
                assert high[i] == np.inf or value <= Fraction(float(high[i]))
        if np.isfinite(low[i]) and np.isfinite(high[i]) and np.isfinite([least[i], most[i]]).all():
            width = max(float(most[i] - least[i]), abs(float(most[i])), abs(float(least[i])))
            room = 1e-12 * max(float(largest), width)
            assert abs(low[i] - least[i]) <= room and abs(high[i] - most[i]) <= room
