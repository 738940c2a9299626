"""What machine code adds to the sums of members is what numpy finds for their cells; they agree which are good enough.

Members have several cells next to each other, which are done at a time; cells are few, or no multiple of eight; what a
rule leaves out is known to be nothing, or proved to be something, which for some cells is too much.
"""

from __future__ import annotations

import numpy as np
import pytest
from msgspec.structs import replace

import potto
from potto.integrate.fixed.axes import MEAN, axis
from potto.integrate.fixed.cells.nodes import at_once
from potto.integrate.fixed.cells.product_rule import FEW, STRAIGHT, ProductRule

pytest.importorskip("llvmlite")

PROGRAMS = {
    "one variable": "def f(a, b, c) integral [0, 1] (x + c)*[x > a]*[x < b] d(x)",
    "lines": "def f(a, b, c) integral ([0, 1], [0, 1]) [x + y > a] + x*[x - 2*y > b]*[x > c] d(x, y)",
    "moving bounds": "def f(a, b, c) integral ([a, b + 2], [0, c + 2]) x*[y > x*a] d(x, y)",
    "a fraction": "def f(a, b, c) integral ([0, 1], [0, 1]) 1/(3 + x + y)^2*[x + y > c] d(x, y)",
    "three variables": "def f(a, b, c) integral ([0, 1], [0, 1], [0, 1]) [x + y + z > a]*[x > b] d(x, y, z)",
}


@pytest.mark.parametrize("count", [13, 40, 1003])
@pytest.mark.parametrize("program", list(PROGRAMS))
def test_totals_are_the_same(program: str, count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(1)
    asked, spoilt = [], 0
    added = ProductRule.added

    def both(rule: ProductRule, env, index, total):
        nonlocal spoilt
        if rule.beyond is not None and index.size > 8:  # more than may be left out of some cells
            rule = replace(rule, beyond=rule.beyond + random.choice([0.0, 1e-3], rule.beyond.shape[1]))
        before = total.copy()
        good = added(rule, env, index, total)
        if good is None:
            return None
        owners, between = rule.cell.members.take(index), rule.cell.between.take(index)
        axes = [axis(order, MEAN, STRAIGHT, rule._several(index)) for order in rule.orders]
        raw = at_once(rule.plan, rule.cell.face, rule.machine, env, owners, between, axes)
        found = rule._measured(raw, index, rule.orders)
        fine = rule.good(found, before[0].take(owners, 1) if index.size <= FEW else None)
        spoilt += (~fine).sum()
        for whole, part in zip(before, (found.number, found.rounding, found.gross, found.truncated), strict=True):
            np.add.at(whole.T, owners[fine], part.T[fine])
        asked.append((fine, good, before, total.copy()))
        return good

    monkeypatch.setattr(ProductRule, "added", both)
    f = potto.grad(potto.compile(PROGRAMS[program]).f, ("a", "c"))
    with potto.settings(backend="native"):
        f(*(random.random((3, count)) * 0.9))
    assert asked and (spoilt or program != "a fraction")
    for fine, good, (number, rounding, gross, left), own in asked:
        assert (fine == good).all()
        # Nodes are added up in another order: a few roundings of what is added up. Rounding itself is followed by the
        # same operations.
        assert (np.abs(own[0] - number) <= 16 * np.finfo(float).eps * gross).all()
        for known, mine in zip((rounding, gross, left), own[1:], strict=True):
            np.testing.assert_allclose(mine, known, rtol=1e-12)
