"""The cells of many members that machine code finds are those that numpy finds, where something is to be integrated.

Both compare, subtract and bound the rounding of the same doubles, so that they agree about every cell and about who is
plain; cuts repeat, lie on bounds, were divided by 0, or are no numbers (roots that are not there). Where one may be
anywhere nothing is sure.
"""

from __future__ import annotations

import numpy as np
import pytest

import potto
from potto.calculus.differentiation.loops import vanishes
from potto.core.terms import children
from potto.integrate.fixed.cells import topologies as module
from potto.integrate.fixed.cells.topologies import in_order
from potto.integrate.fixed.lowered.topologies import Found, LoweredTopologies
from potto.integrate.fixed.straight import StraightIntegral
from potto.kernels.cells import Cell

pytest.importorskip("llvmlite")

PROGRAMS = {
    "one variable": "def f(a, b, c) integral [0, 1] (x + c)*[x > a]*[x < b] d(x)",
    "lines": "def f(a, b, c) integral ([0, 1], [0, 1]) [x + y > a] + [x - 2*y > b]*[x > c] d(x, y)",
    "a circle": "def f(a, b, c) integral ([a, 1], [b, 1]) [x^2 + y^2 < c^2 + 0.25] d(x, y)",
    "moving bounds": "def f(a, b, c) integral ([a, b + 2], [0, c + 2]) x*[y > x*a] d(x, y)",
    "coefficients": "def f(a, b, c) integral ([0, 1], [0, 1]) [(a - b)*x + y > c] + [x > (c - a)*y] d(x, y)",
    "three variables": "def f(a, b, c) integral ([0, 1], [0, 1], [0, 1]) [x + y + z > a]*[x > b] d(x, y, z)",
}


Asked = tuple[LoweredTopologies, Found, Found]


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[Asked]:
    """What is found from now on, by numpy and by machine code."""
    found, machines = list[Asked](), []
    run, function = LoweredTopologies.run, LoweredTopologies.function

    def both(way: LoweredTopologies, function, env, batch):
        here = {name: module._spread(env[name], batch, way.merging) for name in way.plan.names}
        own = run(way, function, env, batch)
        found.append((way, module._found(way.plan, machines[-1], here, batch, way.merging), own))
        return own

    def noted(way: LoweredTopologies, machine):
        machines.append(machine)
        return function(way, machine)

    monkeypatch.setattr(LoweredTopologies, "run", both)
    monkeypatch.setattr(LoweredTopologies, "function", noted)
    return found


@pytest.mark.parametrize("program", list(PROGRAMS))
def test_cells_are_the_same(program: str, asked: list[Asked]) -> None:
    random = np.random.default_rng(1)
    count = 1000 if program == "three variables" else 5003  # no multiple of eight
    given = random.integers(-4, 7, (3, count)) / 4 + random.choice([0.0, 0.0, 1e-15, 1e-3], (3, count))
    f = potto.compile(PROGRAMS[program]).f
    with potto.settings(backend="native"):
        f(*given)
    assert asked
    _same(asked)
    assert any(len(found.members) for *_, found in asked)
    assert not all(found.plain.all() for *_, found in asked) or program == "one variable"


def test_cuts_that_are_one_count_once(asked: list[Asked]) -> None:
    """Left and right of its centre a disc turns on a border of pixels, where its sections leave them."""
    text = "def f(a, b, r) integral ([a, a + 1/16], [b, b + 1/16]) [(x - 0.5)^2 + (y - 0.5)^2 < r] d(x, y)"
    a, b = (z.ravel() for z in np.meshgrid(np.arange(16) / 16, np.arange(16) / 16))
    with potto.settings(backend="native"):
        potto.grad(potto.compile(text).f, ("r", "b"))(a, b, 0.1)
    _same(asked)
    (before, all_of_them), (merged, those) = ((way, found) for way, _, found in asked)
    assert (before.merging, merged.merging) == (False, True)
    assert those.plain.size == 4 == (~all_of_them.plain).sum() and those.plain.all()


def _same(asked: list[Asked]) -> None:
    for way, by_numpy, found in asked:
        assert (by_numpy.plain == found.plain).all()
        assert _lit(way.plan, by_numpy) == _lit(way.plan, found)
        assert len(found.members) == len(_lit(way.plan, found))  # of these few surfaces all sides are known


def _lit(plan: StraightIntegral, found: Found) -> list[tuple[int, ...]]:
    """The cells in which something is to be integrated, in order."""
    columns = (found.members, found.between, found.sides)
    cells = sorted(zip(*(column.tolist() for column in columns), strict=True))
    count = len(children(plan.surfaces.body))
    return [cell for cell in cells if not vanishes(plan.face(tuple(bool(cell[-1] >> bit & 1) for bit in range(count))))]


def test_what_may_be_anywhere_has_no_order() -> None:
    random = np.random.default_rng(0)
    places = random.random((5, 2000))
    places[:2].sort(axis=0)
    places[2:][random.random((3, 2000)) < 0.2] = np.nan
    off = np.abs(places) * 1e-16
    off[np.isnan(off)] = 0.0
    anywhere = random.random((3, 2000)) < 0.05  # at infinity, and as far off
    places[2:][anywhere], off[2:][anywhere] = random.choice([-np.inf, np.inf], anywhere.sum()), np.inf
    order, count, fine = in_order(places, off)
    assert 0 < fine.sum() < fine.size and not fine[anywhere.any(axis=0)].any()
    for member in np.flatnonzero(fine):
        own = order[: count[member], member]
        assert (np.diff(places[own, member]) > 0).all() and {own[0], own[-1]} == {0, 1}


@pytest.mark.parametrize("low", [0.0, -1.0])
def test_what_was_divided_by_0_is_nowhere_on_one_side_of_0(low: float) -> None:
    """On both sides the surface may be clear of its rounding at 0 and have a root beside it."""
    root = Cell(np.array([np.inf, 0.5]), np.array([np.nan, 1e-16]))
    places, off = module._rows((Cell(np.full(2, low)), Cell(np.ones(2)), root), 2)
    assert (np.isnan(places[2, 0]), np.isinf(off[2, 0])) == ((True, False) if low == 0 else (False, True))
    assert in_order(places, off)[2].tolist() == [low == 0, True]
