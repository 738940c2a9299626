"""Bounds by machine code hold every value of a term, and are those that numpy finds.

Values are found in fractions at points of the boxes, corners included, those of functions in 40 digits. Both kinds of
bounds are rounded outwards, so they may differ by a few units in the last place of what was added up on the way, which
is bounded by the size of the largest number that comes up.
"""

from __future__ import annotations

import math
import random
from fractions import Fraction
from typing import Any

import mpmath as mp
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


FUNCTIONS: dict[str, Any] = {
    "sqrt": mp.sqrt,
    "log": mp.log,
    "exp": mp.exp,
    "sin": mp.sin,
    "cos": mp.cos,
    "tanh": mp.tanh,
    "atan": mp.atan,
    "hypot": mp.hypot,
    "branch": lambda side, a, b: a if side >= 0 else b,
}


def with_functions(pick: random.Random, depth: int) -> Term:
    """Of what `written` makes, with functions, quotients and brackets in it."""
    if not depth:
        return written(pick, 1)
    a, b, at = with_functions(pick, depth - 1), with_functions(pick, depth - 1), pick.random()
    if at < 0.5:
        return core.prim(pick.choice(("sqrt", "log", "exp", "sin", "cos", "tanh", "atan")), a)
    if at < 0.6:
        return core.branch((a,), False, b, core.var("t"))
    if at < 0.7:
        return core.pow_(a, core.const(pick.choice((-1.0, -2.0, 0.5, 1.5))))
    return core.prim("hypot", a, b) if at < 0.75 else core.div(a, b) if at < 0.85 else core.prim("add", a, b)


@mp.workdps(40)
def precise(term: Term, at: dict[str, Any]) -> Any:
    """The value in 40 digits; None where there is none, or one that is too large or small for a double."""
    known: dict[Term, Any] = {}
    for node in postorder(term):
        if isinstance(node, Const):
            known[node] = mp.mpf(node.value)
        elif isinstance(node, Var):
            known[node] = at[node.name]
        else:
            parts = core.children(node)
            args = [known[arg] for arg in parts]
            op = node.op if isinstance(node, Prim) else "branch"
            if op == "branch":
                known[node] = FUNCTIONS[op](*args) if args[0] is not None else None
                continue
            if None in args:
                known[node] = None
                continue
            narrow = (op in ("sqrt", "log") or (op == "pow" and args[1] % 1)) and args[0] < 0
            pole = (op == "log" and not args[0]) or (op == "div" and not args[1])
            pole = pole or (op == "pow" and args[1] < 0 and not args[0])
            if narrow or pole or (op == "exp" and abs(args[0]) > 700):
                known[node] = None
            else:
                known[node] = (FUNCTIONS.get(op) or (mp.power if op == "pow" else VALUES[op]))(*args)
                if abs(known[node]) > 1e300:
                    known[node] = None
    return known[term]


@pytest.mark.parametrize("seed", range(examples(24)))
def test_bounds_of_functions_hold_every_value(seed: int) -> None:
    """What neither is infinite nor without a value has to lie within the bounds, to the last digit."""
    pick = random.Random(f"functions {seed}")
    terms, box = (with_functions(pick, 2), with_functions(pick, 3)), boxes(pick)
    if not terms[0].free or not terms[1].free:
        return
    before = counts.native_points
    found = enclosures(terms, box, COUNT, "native")
    assert counts.native_points == before + COUNT
    for term, (low, high), (least, most) in zip(terms, found, enclosure(terms, box), strict=True):
        assert (~np.isnan(low) | np.isnan(least)).all() and (np.isnan(low) == np.isnan(high)).all()
        del most
        for i in range(0, COUNT, 20):
            for share in (0.0, 0.3, 0.7, 1.0):
                with mp.workdps(40):
                    ends = {
                        name: [mp.mpf(float(np.broadcast_to(end, COUNT)[i])) for end in own]
                        for name, own in box.items()
                    }
                    at = {name: a + (b - a) * mp.mpf(share) for name, (a, b) in ends.items()}
                value = precise(term, at)
                if value is not None:
                    assert low[i] <= value <= high[i], (term, at)
