"""Integrals as kernels meet them: over whatever batch they stand in.

Owns `integrate`: makes the batch one axis, asks for the plan (`plans`), chooses the method, and gives the result the
shape of the batch again.
"""

from __future__ import annotations

import itertools
import math
import operator
from collections.abc import Iterable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from potto.calculus.surfaces.discontinuities import TooDeep
from potto.core.terms import Integral
from potto.diagnostics import PottoError
from potto.integrate.fixed.a_priori import certain
from potto.integrate.pieces import Sums, still
from potto.integrate.plan import Plan
from potto.kernels import errors
from potto.kernels.cells import Array, Cell, Ints, Number, Value, all_arrays, map_arrays
from potto.runtime.answers.convergence import allowance, missing, widest
from potto.runtime.integration.choices import many, orders, preferred, too_many, trials
from potto.runtime.integration.coarser import by_less
from potto.runtime.integration.differences import by_differences
from potto.runtime.integration.elimination import ACCURATE, WORTH, step_by_step
from potto.runtime.integration.folds import beside_another
from potto.runtime.integration.members import Ways, Whole, by_members
from potto.runtime.integration.one_sided import beside_axes, beside_folds, from_both_sides, one_direction
from potto.runtime.integration.plans import Linked, Mixed, link, plan_for, split_by_decisions
from potto.runtime.integration.quadrature import in_parts, iterated, within

if TYPE_CHECKING:
    from potto.runtime.evaluation.machine import Machine

# From how many errors of the value on an error of a derivative is looked at again from another side, and for how many
# members at most.
STEEP = 1e3
MOST_SPOILT = 256


def integrate(machine: Machine, term: Integral, env: dict[str, Value]) -> Value:
    """The value of an integral in an environment whose numbers may be batches of any shape."""
    machine.enter()
    try:
        return _integrate(machine.inside(), term, env, machine.root)
    except TooDeep:
        raise PottoError([errors.TOO_DEEP(
            errors.NOWHERE, "the recursion under this integral does not end for these parameters",
            help="the condition that ends it must be decided by parameters alone",
        )]) from None  # fmt: skip
    finally:
        machine.books.depth = max(0, machine.books.depth - 1)


def _integrate(machine: Machine, term: Integral, env: dict[str, Value], outermost: bool) -> Value:
    arrays = [a for value in env.values() for a in all_arrays(value)]
    shape = np.broadcast_shapes(*(a.shape for a in arrays))
    batch = int(np.prod(shape)) if shape else 1
    if batch == 0:
        return Cell(np.zeros(shape))
    flat = {n: map_arrays(v, lambda a: np.ascontiguousarray(np.broadcast_to(a, shape)).reshape(-1))
            for n, v in env.items()}  # fmt: skip
    if batch == 1 and shape:
        flat = {n: map_arrays(v, lambda a: float(a[0])) for n, v in flat.items()}
    machine.books.integrals += 1
    if machine.overdrawn() and not outermost:
        return given_up(machine, shape)
    linked = link(flat)
    with machine.books.apart() as met:
        sums = poisoned(_grouped(machine, term, linked, flat, batch, outermost), linked.env)
        if outermost:
            within = allowance(term, sums, machine.rtol)
    if outermost:
        machine.books.tell(met, batch, shape)
        if not isinstance(within, float):
            within = within.reshape(shape) if np.ndim(within) and shape else float(np.max(within))
        machine.books.within = widest(machine.books.within, within)
    else:
        machine.books.met.take(met, None)
    return _shaped(sums, shape)


def _grouped(
    machine: Machine, term: Integral, linked: Linked, flat: dict[str, Value], batch: int, outermost: bool
) -> Sums:
    """What an integral amounts to; members for which recursions take different courses apart from one another."""
    groups = split_by_decisions(machine, term, linked, batch)
    if groups is None:
        return _in_cases(machine, term, linked, flat, batch, outermost)
    return _in_groups(machine, term, flat, batch, groups, outermost)


def _in_groups(
    machine: Machine, term: Integral, flat: dict[str, Value], batch: int, groups: Iterable[Ints], outermost: bool
) -> Sums:
    """The integrals of a batch, group by group."""
    found = Whole(batch)
    for index in groups:
        here = {n: map_arrays(v, operator.itemgetter(index)) for n, v in flat.items()}
        with machine.books.among(index) as met:
            found.put(index, _in_cases(machine, term, link(here), here, index.size, outermost))
        machine.books.met.take(met, index)
    return found.sums


def _in_cases(
    machine: Machine, term: Integral, linked: Linked, flat: dict[str, Value], batch: int, outermost: bool
) -> Sums:
    """The integrals of a batch, those together that meet the same cases of conditions inside of conditions."""
    if batch == 1:
        return _vouched(machine, term, linked, batch, outermost)
    try:
        with machine.books.apart() as met:
            sums = _vouched(machine, term, linked, batch, outermost)
        machine.books.met.take(met, np.arange(batch))
        return sums
    except Mixed as mixed:
        fits = np.asarray(mixed.fits)
    if fits.shape != (batch,):  # it was found out about a part of them
        fits = np.arange(batch) < batch // 2
    fits[0] = True  # the plan was made for it
    groups = (np.nonzero(fits)[0], np.nonzero(~fits)[0]) if not fits.all() else np.array_split(np.arange(batch), 2)
    return _in_groups(machine, term, flat, batch, groups, outermost)


def _vouched(machine: Machine, term: Integral, linked: Linked, batch: int, outermost: bool) -> Sums:
    """What an integral amounts to. Rules on pieces that should have been cut further are good for nothing."""
    sums = solve(machine, term, linked, linked.env, batch, outermost)
    if outermost and "quadrature" in machine.books.methods:
        left = _left_out(machine, batch)
        sums.e[:, left], sums.et[:, :, left] = np.inf, np.inf
    return sums


def _left_out(machine: Machine, batch: int) -> Ints:
    """The members whose roots were left out, because they are too many."""
    reasons = machine.books.met.unfinished.items()
    found = [np.arange(batch) if members is None else members for why, members in reasons if "too many roots" in why]
    return np.unique(np.concatenate(found)) if found else np.zeros(0, dtype=np.int64)


def given_up(machine: Machine, shape: tuple[int, ...]) -> Value:
    """No number, where finding one would take far more than the budget."""
    machine.note_unfinished("the budget of evaluations is spent")
    nan, k = np.full(shape, np.nan), machine.directions
    return Cell(nan, np.full(shape, np.inf), (nan,) * k, (np.full(shape, np.inf),) * k)


def poisoned(sums: Sums, env: dict[str, Value]) -> Sums:
    """A parameter that is not a number makes the integral not a number, whatever the cuts made of it."""
    bad: Any = False
    for value in env.values():
        for cell in (value,) if isinstance(value, Cell) else value if isinstance(value, tuple) else ():
            if isinstance(cell, Cell):
                bad = bad | np.isnan(cell.v)
    if np.any(bad):
        where = np.broadcast_to(bad, sums.v.shape[-1:])
        sums.v[:, where] = np.nan
    if sums.v.size == 1 and math.isfinite(sums.v[0, 0]):  # numpy takes its time over a single number
        return sums
    undefined = np.isnan(sums.v)
    if undefined.any():  # nor is its derivative one
        sums.t = np.where(undefined[:, None], np.nan, sums.t)
        sums.e, sums.et = np.where(undefined, np.inf, sums.e), np.where(undefined[:, None], np.inf, sums.et)
    return sums


def solve(machine: Machine, term: Integral, linked: Linked, env: dict[str, Value], batch: int, outermost: bool) -> Sums:
    """What an integral amounts to, by the method that suits it and in an order of its variables that does."""
    if outermost:
        found = _by_other_means(machine, term, linked, env, batch)
        if found is not None:
            return found
    machine.books.methods.add("quadrature")
    met = machine.books.met
    for order, most in trials(machine, term, linked, outermost):
        met.degenerate.clear()
        plan = plan_for(machine, order, linked)
        if batch == 1 and plan.straight is not None:
            plain = certain(plan.straight, machine, linked.env)
            if plain is not None:
                return plain
        found = within(most, plan, machine, plan.environment(env, linked.env), batch)
        if found is not None:
            sums = counted(found, plan, machine)
            if not met.degenerate:
                return _looked_into(machine, term, order, plan, linked, batch, sums, outermost)
    if outermost and machine.directions > 1:
        return one_by_one(machine, term, linked, batch)
    if outermost:
        variable = min(met.degenerate)
        resting = link({n: still(v) for n, v in linked.env.items()})
        values = solve(machine.with_directions(0), term, resting, resting.env, batch, False)
        sums.v, sums.e = values.v, values.e
        if beside_axes(machine, plan, linked, batch, sums, variable, partial(_beside, machine, term)):
            return sums
    machine.note_unfinished(
        "surfaces run along the axes of several variables of integration at once: "
        "their boundary terms are not all counted"
    )
    sums.et = np.full_like(sums.et, np.inf)
    return sums


def _by_other_means(
    machine: Machine, term: Integral, linked: Linked, env: dict[str, Value], batch: int
) -> Sums | None:
    """An integral by elimination, by samples, or as a batch; None where it is one for iterated quadrature."""
    machine.books.members = max(machine.books.members, batch)
    sampled = machine.settings.method in ("mc", "qmc")
    if not sampled and many(machine, term, linked):
        sampled = machine.settings.method == "auto" and too_many(machine, term, linked)
        found = step_by_step(machine, term, linked, batch, WORTH if sampled else ACCURATE)
        if found is not None:
            return found
    elif machine.settings.method == "auto":
        sampled = too_many(machine, term, linked)
    if sampled:
        return _sampled(machine, term, linked, env, batch)
    return _batch(machine, term, linked, batch) if batch > 1 else None


def _looked_into(
    machine: Machine, term: Integral, order: Integral, plan: Plan, linked: Linked, batch: int, sums: Sums,
    outermost: bool,
) -> Sums:  # fmt: skip
    """The sums of an iterated quadrature, with what was met on the way looked into, and another side where it helps."""
    met, env = machine.books.met, linked.env
    if outermost:
        sums = by_less(machine, plan, plan.environment(env, env), batch, sums)
    if plan.folds or met.incomplete:
        beside_another(machine, order, linked, env, batch, sums)
    if outermost and met.sided and not machine.side:
        from_both_sides(machine, plan, plan.environment(env, env), batch, sums, iterated)
    if outermost and met.folds:
        beside_folds(machine, plan, linked, batch, sums, partial(_beside, machine, term))
    if not outermost:
        met.forget_places_of_folds()
        return sums
    sums = turned_round(machine, order, linked, env, batch, sums)
    if machine.directions and not (met.edges or machine.side):
        by_differences(machine, linked, batch, sums, partial(_beside, machine.with_directions(0), term))
    return sums


def _batch(machine: Machine, term: Integral, linked: Linked, batch: int) -> Sums:
    """The sums of a batch, member by member where they meet something."""

    def whole(order: Integral, here: Linked, size: int) -> Sums:
        plan = plan_for(machine, order, here)
        return in_parts(plan, machine, plan.environment(here.env, here.env), size)

    def settled(order: Integral, here: Linked, size: int, sums: Sums) -> Sums:
        plan = plan_for(machine, order, here)
        sums = counted(sums, plan, machine)
        if plan.folds:
            beside_another(machine, order, here, here.env, size, sums)
        if machine.books.met.sided and not machine.side:
            from_both_sides(machine, plan, plan.environment(here.env, here.env), size, sums, iterated)
        return turned_round(machine, order, here, here.env, size, sums)

    machine.books.methods.add("quadrature")
    ways = Ways(
        lambda: preferred(machine, term, linked),
        whole,
        settled,
        partial(one_by_one, machine, term),
        lambda one: solve(machine, term, one, one.env, 1, True),
    )
    return by_members(machine, linked, batch, ways, lambda sums: missing(term, sums, machine.settings))


def _sampled(machine: Machine, term: Integral, linked: Linked, env: dict[str, Value], batch: int) -> Sums:
    """The sums from samples of all variables at once."""
    from potto.integrate.montecarlo.sampling import sample

    plan, method = plan_for(machine, term, linked), machine.settings.method
    sums = counted(sample(plan, machine, plan.environment(env, linked.env), batch, method), plan, machine)
    machine.books.methods.add("mc" if method == "mc" else "qmc")
    sums.et[:, :, _left_out(machine, batch)] = np.inf  # what crosses those that were left out is not known
    return sums


def one_by_one(machine: Machine, term: Integral, linked: Linked, batch: int) -> Sums:
    """The sums with each direction by itself: what runs along one variable may not move in it."""
    parts = []
    for d in range(machine.directions):
        alone = link({n: one_direction(v, d) for n, v in linked.env.items()})
        parts.append(solve(machine.with_directions(1), term, alone, alone.env, batch, True))
    t, et = (np.concatenate([getattr(part, name) for part in parts], axis=1) for name in ("t", "et"))
    return Sums(parts[0].v, parts[0].e, t, et)


def _beside(machine: Machine, term: Integral, linked: Linked) -> Sums:
    return solve(machine, term, linked, linked.env, 1, False)


def turned_round(
    machine: Machine, term: Integral, linked: Linked, env: dict[str, Value], batch: int, sums: Sums
) -> Sums:
    """The better, member by member, of sums and of those with another variable innermost, where rounding spoilt a few.

    A surface that is all but parallel to the innermost variable has a section in it that is steep, so that a rounded
    node further out misplaces it; along another variable it is flat.
    """
    spoilt = ((sums.et > machine.rtol * np.abs(sums.t)) & (sums.et > STEEP * sums.e[:, None])).any(axis=(0, 1))
    spoilt &= ~np.isinf(sums.et).any(axis=(0, 1))
    if machine.books.met.unfinished or not spoilt.any() or spoilt.sum() > MOST_SPOILT:
        return sums
    index = np.nonzero(spoilt)[0]
    here = {n: map_arrays(v, operator.itemgetter(index)) for n, v in env.items()}
    for order in itertools.islice(orders(term), 1, None):
        plan = plan_for(machine, order, linked)
        with machine.books.apart() as met:
            other = iterated(plan, machine, plan.environment(here, linked.env), index.size)
        better = (other.et < sums.et[:, :, index]) & met.nothing(index.size)
        sums.t[:, :, index] = np.where(better, other.t, sums.t[:, :, index])
        sums.et[:, :, index] = np.where(better, other.et, sums.et[:, :, index])
    return sums


def counted(sums: Sums, plan: Plan, machine: Machine) -> Sums:
    """The sums, with derivatives that no one vouches for where not all jumps could be taken account of, and of values
    by quadrature where it is not known where they are."""
    if plan.confused:
        machine.note_unfinished("conditions inside of conditions make more cases than can be told apart")
        sums.et = np.full_like(sums.et, np.inf)
        if "quadrature" in machine.books.methods:
            sums.e = np.full_like(sums.e, np.inf)
    elif machine.directions and not plan.reaches:
        machine.note_unfinished("a condition jumps inside an inner integral where its boundary term is not counted")
        sums.et = np.full_like(sums.et, np.inf)
    return sums


def _shaped(sums: Sums, shape: tuple[int, ...]) -> Value:
    def part(x: Array) -> Number:
        return x.reshape(shape) if shape else float(x[0])

    def cell(c: int) -> Cell:
        t = tuple(part(sums.t[c, d]) for d in range(sums.t.shape[1]))
        et = tuple(part(sums.et[c, d]) for d in range(sums.et.shape[1]))
        return Cell(part(sums.v[c]), part(sums.e[c]), t, et)

    if sums.v.shape[0] == 1:
        return cell(0)
    return tuple(cell(c) for c in range(sums.v.shape[0]))
