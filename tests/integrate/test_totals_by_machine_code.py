"""What machine code adds to the sums of members is what numpy finds for their cells; they agree which are good enough.

Members have several cells next to each other, which are done at a time; cells are few, or no multiple of eight; what a
rule leaves out is known to be nothing, or proved to be something, which for some cells is too much, or told by its
coefficients.
"""

from __future__ import annotations

import numpy as np
import pytest
from msgspec.structs import replace

import potto
from potto.integrate.fixed.cells import alike
from potto.integrate.fixed.cells.product_rule import FEW, Measured, ProductRule
from potto.kernels.cells import Bools, Ints
from potto.kernels.native.vectors import LANES
from potto.projects.settings import Settings

pytest.importorskip("llvmlite")

PROGRAMS = {
    "one variable": "def f(a, b, c) integral [0, 1] (x + c)*[x > a]*[x < b] d(x)",
    "lines": "def f(a, b, c) integral ([0, 1], [0, 1]) [x + y > a] + x*[x - 2*y > b]*[x > c] d(x, y)",
    "moving bounds": "def f(a, b, c) integral ([a, b + 2], [0, c + 2]) x*[y > x*a] d(x, y)",
    "a fraction": "def f(a, b, c) integral ([0, 1], [0, 1]) 1/(3 + x + y)^2*[x + y > c] d(x, y)",
    "a disc": "def f(a, b, c) integral ([0, 1], [0, 1]) [(x - a)^2 + (y - b)^2 < 0.1 + c] d(x, y)",
    "exponents": "def f(a, b, c) integral ([0, 1], [0, 1]) exp((3 + b)*x*y)*[x + 2*y > a]*[x - y < c] d(x, y)",
    "three variables": "def f(a, b, c) integral ([0, 1], [0, 1], [0, 1]) [x + y + z > a]*[x > b] d(x, y, z)",
}

SPOILT = "a fraction", "a disc"  # some of whose cells need more nodes
# Whose coefficients tell what rules leave out.
JUDGED = "a disc", "exponents"
# What rounding makes of their last ones, eight times a few of which are left out, as a part of what is added up.
NOISE = 1e-14
STEEP = "def f(k) integral ([0, 1], [0, 1]) (3 + exp(k*x*y - k*y))*[x + y < 0.9] d(x, y)"


def by_numpy(rules: list[tuple[ProductRule, Ints]], env, total, good: Bools, few: bool) -> None:
    """Add by numpy what machine code found good, which must be that for numpy, too, but for the rounding of the last
    coefficients: a block of cells after the other, as of those in it a block does not know."""
    first = 0
    for rule, own in rules:
        found = rule.applied(env, own)
        for start in range(0, own.size, LANES):
            owners = rule.cell.members.take(own[start : start + LANES])
            parts = [getattr(found, name)[:, start : start + LANES] for name in found.__struct_fields__]
            *others, gross, truncated = parts
            noise, known = 0.0 if all(rule.exact) else NOISE * gross, total[0].take(owners, 1) if few else None
            strict, loose = (rule.good(Measured(*others, gross, truncated + way * noise), known) for way in (1, -1))
            fine = good[first : first + owners.size]
            assert (strict <= fine).all() and (fine <= loose).all()
            for whole, part in zip(total, parts, strict=True):
                np.add.at(whole.T, owners[fine], part.T[fine])
            first += owners.size


@pytest.mark.parametrize("count", [13, 40, 1003])
@pytest.mark.parametrize("program", list(PROGRAMS))
def test_totals_are_the_same(program: str, count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    random, asked = np.random.default_rng(1), []
    added = alike.added_together

    def both(rules: list[tuple[ProductRule, Ints]], env, total):
        beyond, count = rules[0][0].beyond, sum(own.size for _, own in rules)
        if beyond is not None and count > 8:  # more than may be left out of some cells
            beyond = beyond + random.choice([0.0, 1e-3], beyond.shape[1])
            rules = [(replace(rule, beyond=beyond), own) for rule, own in rules]
        before = total.copy()
        answer = added(rules, env, total)
        if answer is None:
            return None
        by_numpy(rules, env, before, answer[1], count <= FEW)
        assert (answer[0] == np.concatenate([own for _, own in rules])).all()
        asked.append((answer[1], before, total.copy(), len(rules)))
        return answer

    monkeypatch.setattr(alike, "added_together", both)
    f = potto.grad(potto.compile(PROGRAMS[program]).f, ("a", "c"))
    with potto.settings(backend="native"):
        f(*(random.random((3, count)) * 0.9))
    assert asked and (program not in SPOILT or not all(good.all() for good, *_ in asked))
    assert program != "a fraction" or count < 1000 or max(runs for *_, runs in asked) > 1
    for _, (number, rounding, gross, left), own, _ in asked:
        # Nodes are added up in another order: a few roundings of what is added up. Rounding itself is followed by the
        # same operations.
        assert (np.abs(own[0] - number) <= 16 * np.finfo(float).eps * gross).all()
        for known, mine in zip((rounding, gross), own[1:3], strict=True):
            np.testing.assert_allclose(mine, known, rtol=1e-12)
        assert (np.abs(own[3] - left) <= 1e-12 * left + (NOISE * gross if program in JUDGED else 0.0)).all()


@pytest.mark.parametrize("program", JUDGED)
def test_both_backends_foresee_the_same_of_a_few_cells(program: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """By the coefficients of many nodes it is told for which cells fewer would do."""
    told, looks = ProductRule.foreseen, []

    def both(rule: ProductRule, env, index: Ints, others: list[ProductRule]):
        own = list(told(rule, env, index, others))
        plain = rule.machine.changed(settings=Settings(backend="numpy"))
        looks.extend(zip(own, told(replace(rule, machine=plain), env, index, others), strict=True))
        return iter(own)

    monkeypatch.setattr(ProductRule, "foreseen", both)
    with potto.settings(backend="native"):
        potto.grad(potto.compile(PROGRAMS[program]).f, "a")(*np.random.default_rng(2).random((3, 200)))
    assert looks and not all(own.all() for own, _ in looks)
    assert all((own == known).all() for own, known in looks)


def test_where_exponents_are_steep_both_backends_leave_the_same_cells_alone() -> None:
    """Over a cell k (x y - y) changes by less than its enclosure tells, by which both go."""
    f, k, found = potto.compile(STEEP).f, np.linspace(20, 120, 100), []
    for backend in ("numpy", "native"):
        with potto.settings(backend=backend):
            found.append(f(k))
    assert found[0].evals == found[1].evals
    assert (np.abs(found[0].value - found[1].value) <= found[0].error + found[1].error).all()
