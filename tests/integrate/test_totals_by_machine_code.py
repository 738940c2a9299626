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
from potto.integrate.fixed.cells import alike
from potto.integrate.fixed.cells.nodes import at_once
from potto.integrate.fixed.cells.product_rule import FEW, STRAIGHT, ProductRule
from potto.kernels.cells import Ints

pytest.importorskip("llvmlite")

PROGRAMS = {
    "one variable": "def f(a, b, c) integral [0, 1] (x + c)*[x > a]*[x < b] d(x)",
    "lines": "def f(a, b, c) integral ([0, 1], [0, 1]) [x + y > a] + x*[x - 2*y > b]*[x > c] d(x, y)",
    "moving bounds": "def f(a, b, c) integral ([a, b + 2], [0, c + 2]) x*[y > x*a] d(x, y)",
    "a fraction": "def f(a, b, c) integral ([0, 1], [0, 1]) 1/(3 + x + y)^2*[x + y > c] d(x, y)",
    "three variables": "def f(a, b, c) integral ([0, 1], [0, 1], [0, 1]) [x + y + z > a]*[x > b] d(x, y, z)",
}

STEEP = "def f(k) integral ([0, 1], [0, 1]) (3 + exp(k*x*y - k*y))*[x + y < 0.9] d(x, y)"


@pytest.mark.parametrize("count", [13, 40, 1003])
@pytest.mark.parametrize("program", list(PROGRAMS))
def test_totals_are_the_same(program: str, count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(1)
    asked, spoilt = [], 0
    added = alike.added_together

    def both(rules: list[tuple[ProductRule, Ints]], env, total):
        nonlocal spoilt
        beyond, count = rules[0][0].beyond, sum(own.size for _, own in rules)
        if beyond is not None and count > 8:  # more than may be left out of some cells
            beyond = beyond + random.choice([0.0, 1e-3], beyond.shape[1])
            rules = [(replace(rule, beyond=beyond), own) for rule, own in rules]
        before = total.copy()
        answer = added(rules, env, total)
        if answer is None:
            return None
        known, several = before[0].copy(), []
        for rule, own in rules:
            owners, between = rule.cell.members.take(own), rule.cell.between.take(own)
            axes = [axis(order, MEAN, STRAIGHT, rule._several(own)) for order in rule.orders]
            raw = at_once(rule.plan, rule.cell.face, rule.machine, env, owners, between, axes)
            found = rule._measured(raw, own, rule.orders)
            fine = rule.good(found, known.take(owners, 1) if count <= FEW else None)
            several.append(fine)
            for whole, part in zip(before, (found.number, found.rounding, found.gross, found.truncated), strict=True):
                np.add.at(whole.T, owners[fine], part.T[fine])
        spoilt += (~np.concatenate(several)).sum()
        assert (answer[0] == np.concatenate([own for _, own in rules])).all()
        asked.append((np.concatenate(several), answer[1], before, total.copy(), len(rules)))
        return answer

    monkeypatch.setattr(alike, "added_together", both)
    f = potto.grad(potto.compile(PROGRAMS[program]).f, ("a", "c"))
    with potto.settings(backend="native"):
        f(*(random.random((3, count)) * 0.9))
    assert asked and (spoilt or program != "a fraction")
    assert program != "a fraction" or count < 1000 or max(runs for *_, runs in asked) > 1
    for fine, good, (number, rounding, gross, left), own, _ in asked:
        assert (fine == good).all()
        # Nodes are added up in another order: a few roundings of what is added up. Rounding itself is followed by the
        # same operations.
        assert (np.abs(own[0] - number) <= 16 * np.finfo(float).eps * gross).all()
        for known, mine in zip((rounding, gross, left), own[1:], strict=True):
            np.testing.assert_allclose(mine, known, rtol=1e-12)


def test_where_exponents_are_steep_both_backends_leave_the_same_cells_alone() -> None:
    """Over a cell k (x y - y) changes by less than its enclosure tells, by which both go."""
    f, k, found = potto.compile(STEEP).f, np.linspace(20, 120, 100), []
    for backend in ("numpy", "native"):
        with potto.settings(backend=backend):
            found.append(f(k))
    assert found[0].evals == found[1].evals
    assert (np.abs(found[0].value - found[1].value) <= found[0].error + found[1].error).all()
