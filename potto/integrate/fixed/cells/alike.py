"""Members of a batch whose cells are alike, by one product rule for all cells of a shape.

Owns `by_shapes`. What `a_priori` does for one member, with orders that are proved, is done here for many at once, with
orders that are proved for regions of parameters (`proved_shapes`), or that the Legendre coefficients at the nodes show
to be enough. Nodes move with the ends of their cells (Reynolds' transport theorem), so that the tangents of the sums
are the derivatives and no boundary term is left. Rounding is kept track of, as everywhere outside of integrals, at a
few nodes of each cell, spread over it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
from msgspec.structs import replace

from potto.core.terms import children
from potto.integrate.fixed.cells.product_rule import CALL, CANCELS, FEW, ProductRule, added_together, way_of
from potto.integrate.fixed.cells.proved_shapes import proved_rules
from potto.integrate.fixed.cells.topologies import Alike, topologies
from potto.integrate.fixed.steps.step_batches import by_cells
from potto.integrate.fixed.straight import MOST_CHOICES, StraightIntegral, in_rows
from potto.integrate.pieces import Evaluator, Shaped, Sums, added_up, gather, numbers_at, together
from potto.integrate.precision import imprecise
from potto.kernels.cells import Array, Bools, Cell, Ints, Value

# Nodes per variable that are tried, one after the other.
ORDERS = (6, 8, 12, 14, 20, 28)
MOST_NODES = 4096
# How many members are cut, and numbers kept at nodes, at once.
MEMBERS, POINTS = 1 << 16, 1 << 15
# How many members tell the order for all, where there are many, and for how many of them it must do.
PILOTS = 16
ENOUGH = 0.9
# How many nodes rules for a few cells that are left may have, beside those for all, to do for them in one go.
BESIDE = 0.25
# The one whose coefficients tell of those before as well, and the first one that few cells get.
PROBE = 2
# What rounding may leave where what is added up cancels, as a part of that, in the end (`convergence`): of 18,233 pairs
# of a triangle and a pixel 1,082 would be done again for less, at a hundred times the cost.
ROUNDED = 1e-12


def by_shapes(
    plan: StraightIntegral, degrees: Sequence[int | None], machine: Evaluator, env: dict[str, Value], batch: int,
    tight: bool,
) -> Shaped | None:  # fmt: skip
    """What could be integrated here; None if nothing was: members for which cuts have the same formulas together.

    degrees: of what is integrated over each variable, where it is a polynomial. tight: whether all digits are wanted.
    """
    if machine.frozen or machine.side or not all(isinstance(env.get(name), Cell) for name in plan.names):
        return None
    if plan.steps is not None and machine.costs is None:
        degree = (plan.steps.degree,)
        return by_cells(
            plan.steps, machine, env, batch,
            lambda cell, parts, count: by_shapes(cell, degree, machine, parts, count, tight),
        )  # fmt: skip
    if plan.choices is None:
        return _of_one_form(plan, degrees, machine, env, batch, tight)
    if len(children(plan.choices.body)) > MOST_CHOICES:
        return None
    (done, short), sums = np.zeros((2, batch), dtype=bool), Sums.zeros(1, machine.directions, batch)
    met = np.array([np.broadcast_to(cell.v, batch) for cell in numbers_at(plan.choices, machine, env)])
    for sides in itertools.product((False, True), repeat=len(met)):  # what is not known is neither
        here = np.flatnonzero(np.all([row == side for row, side in zip(met, sides, strict=True)], axis=0))
        own = plan.decided(sides) if here.size else plan
        part = env if here.size == batch else gather(env, here)
        found = _of_one_form(own, degrees, machine, part, here.size, tight) if here.size else None
        if found is not None:
            done[here], short[here] = found.done, found.short
            sums = sums.with_members(here, found.sums)
    return Shaped(done, short, sums) if done.any() or short.any() else None


def _of_one_form(
    plan: StraightIntegral, degrees: Sequence[int | None], machine: Evaluator, env: dict[str, Value], batch: int,
    tight: bool,
) -> Shaped | None:  # fmt: skip
    """The same where cuts of all have the same formulas."""
    here = {name: env[name] for name in plan.names}
    done = np.zeros(batch, dtype=bool)
    total = np.zeros((4, 1 + machine.directions, batch))
    for start in range(0, batch, MEMBERS):
        stop = min(start + MEMBERS, batch)
        some = here if stop - start == batch else gather(here, np.arange(start, stop))
        sums = total[..., start:stop]
        done[start:stop], cells = topologies(plan, machine, some, stop - start)
        for cell in cells:
            fine = _settled(plan, degrees, machine, some, cell, sums, tight)
            done[start + cell.members[~fine]] = False
            if batch == 1 and not done[0]:
                return None
    if not done.any():
        return None
    number, rounding, gross, truncated = total
    error = truncated + rounding
    known, enough = _fine(machine, env, total, error)
    short = done & enough & ~known & (batch > 1)  # for one there are other ways
    done &= known & enough
    settled = done | short
    if not settled.any():
        return None
    added = np.stack((gross[0], gross[1:].max(axis=0, initial=0.0)))
    if not settled.all():
        left = np.flatnonzero(~settled)
        for part in (number, error, added):
            part[:, left] = 0.0
    found = Sums(number[None, 0], error[None, 0], number[None, 1:], error[None, 1:], gross=added)
    return Shaped(done, short, found)


def _fine(machine: Evaluator, env: dict[str, Value], total: Array, error: Array) -> tuple[Bools, Bools]:
    """Which members are known as accurately as was asked for despite rounding, and for which the rule has nodes enough,
    by what was found for each, (4, 1 + k, B), and how far off that is. Over large batches it is memory that takes time:
    what does for most is asked first."""
    number, rounding, gross, truncated = total
    known, enough = np.ones((2, number.shape[1]), dtype=bool)
    value = number[0]
    whole = together(env, value)
    alone = whole is value
    rest = imprecise(number, error, 0.5 * machine.rtol) if alone else np.arange(value.size)
    if not rest.size:
        return known, enough
    size, cut, off = (part.take(rest, 1) for part in (number, truncated, rounding))
    size[0] = whole.take(rest)
    asked = np.maximum(machine.atol, machine.rtol * np.abs(size))
    added = gross.take(rest, 1).max(axis=0) if alone else together(env, gross.max(axis=0))
    if number.shape[1] == 1:  # for one there are other ways
        added[:] = 0.0
    most, left = CANCELS * added, min(machine.rtol, ROUNDED) * np.minimum(added, 1.0)
    accurate = off <= np.maximum(asked, left) - cut
    accurate[1:] |= added_up(env, number[1:], rounding[1:], 0.5 * machine.rtol).take(rest, 1)
    known[rest] = accurate.all(axis=0)
    enough[rest] = (cut <= np.maximum(0.5 * asked, most)).all(axis=0)
    return known, enough


def _settled(
    plan: StraightIntegral, degrees: Sequence[int | None], machine: Evaluator, env: dict[str, Value], cell: Alike,
    total: Array, tight: bool,
) -> Bools:  # fmt: skip
    """Add the integrals over cells of one shape to those of their members; for which of them that could be done."""
    fine = np.zeros(cell.members.size, dtype=bool)
    todo = np.arange(cell.members.size)
    exact = [None if d is None else d // 2 + 1 for d in degrees] or [None] * len(plan.variables)
    if None in exact:
        rules, todo = proved_rules(plan, exact, machine, env, cell, tight)
        todo = np.concatenate((_applied(rules, env, total, fine), todo)) if rules else todo
        if not todo.size:
            return fine
    tried, most = _tried(plan, exact, machine, env, cell, todo, tight), 0.0
    while tried and todo.size:
        number = _last_worth(tried, todo.size, most)
        rule = _after(tried, number)
        most = max(most, BESIDE * rule.nodes * todo.size)
        todo, tried = _applied([(rule, todo)], env, total, fine), tried[number + 1 :]
    return fine


def _after(rules: Sequence[ProductRule], number: int) -> ProductRule:
    """One of some rules, where those before it are skipped."""
    rule = rules[number]
    return replace(rule, skipped=(*rule.skipped, *[own.orders for own in rules[:number]])) if number else rule


def _last_worth(rules: Sequence[ProductRule], cells: int, most: float) -> int:
    """The place of the rule by which so many cells, that are left by others, are most likely done without one more: the
    first one, or a later one that takes fewer nodes more than another call is worth, and at most so many."""
    least = rules[0].nodes
    later = (n for n, rule in enumerate(rules) if (rule.nodes - least) * cells < CALL and rule.nodes * cells <= most)
    return max(later, default=0)


def _applied(
    rules: Sequence[tuple[ProductRule, Ints]], env: dict[str, Value], total: Array, fine: Bools
) -> Ints:  # fmt: skip
    """Add what rules give for their cells, where it is good enough, and note that; those for which it isn't."""
    found = added_together(rules, env, total)
    if found is None:
        return np.concatenate([_in_parts(rule, env, todo, total, fine) for rule, todo in rules])
    index, good = found
    fine[index] = good
    return index[~good]


def _in_parts(rule: ProductRule, env: dict[str, Value], todo: Ints, total: Array, fine: Bools) -> Ints:
    """The same for one rule by numpy, as many cells at a time as stay in the cache."""
    step, left = max(1, POINTS // rule.nodes), []
    todo = todo[in_rows(rule.cell.between.take(todo), len(rule.orders))]
    for start in range(0, todo.size, step):
        index = todo[start : start + step]
        found, owners = rule.applied(env, index), rule.cell.members.take(index)
        good = rule.good(found, total[0].take(owners, 1) if todo.size <= FEW else None)
        parts = [found.number, found.rounding, found.gross, found.truncated]
        if not good.all():
            left.append(index[~good])
            for part in parts:
                part[:, ~good] = 0.0
        fine[index] = good
        first, last = int(owners.min()), int(owners.max()) + 1
        owners -= first
        for whole, part in zip(total, parts, strict=True):
            for row, numbers in zip(whole[:, first:last], part, strict=True):
                if numbers.any():
                    row += np.bincount(owners, numbers, row.size)
    return np.concatenate(left) if left else todo[:0]


def _tried(
    plan: StraightIntegral,
    exact: Sequence[int | None],
    machine: Evaluator,
    env: dict[str, Value],
    cell: Alike,
    todo: Ints,
    tight: bool,
) -> list[ProductRule]:
    """Rules with ever more nodes: the one that does for a polynomial, or from the one on that does for most cells."""
    known = tuple(n is not None for n in exact)
    way = way_of(plan, cell, known, machine, env)
    tried = [
        ProductRule(plan, cell, orders, known, machine, way, tight)
        for order in ORDERS
        if math.prod(orders := tuple(order if n is None else n for n in exact)) <= MOST_NODES
    ]
    if all(known):
        return tried[:1]
    if todo.size <= FEW:
        return [_after(tried, PROBE), *tried[PROBE + 1 :]] if tight else tried
    few = todo[:: max(1, todo.size // PILOTS)]
    first = tried[: PROBE + 1]
    foreseen = first[-1].foreseen(env, few, first)
    later = (fine for rule in tried[PROBE + 1 : -1] for fine in rule.foreseen(env, few, [rule]))
    good = (number for number, fine in enumerate(itertools.chain(foreseen, later)) if fine.mean() >= ENOUGH)
    number = next(good, len(tried) - 1)
    return [_after(tried, number), *tried[number + 1 :]]
