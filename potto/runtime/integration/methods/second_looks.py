"""Integrals looked at a second time: with less or more asked for, with other nodes, with another variable innermost.

Owns the improvers `by_less`, `by_more`, `beside_another` and `in_another_order`.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
from msgspec.structs import replace

from potto.core.terms import Integral
from potto.integrate.events import Degenerate, Shortfall, SurfaceFold, TwoSided, Unsearched
from potto.integrate.pieces import Sums
from potto.integrate.precision import imprecise
from potto.kernels.cells import Array, Bools
from potto.runtime.answers.convergence import ONLY_ROUNDED, missing
from potto.runtime.integration.methods.attempts import attempted, uncertainty
from potto.runtime.integration.methods.choices import orders
from potto.runtime.integration.methods.quadrature import in_parts, iterated
from potto.runtime.integration.problem import Problem

ENOUGH = 1e-3  # a relative error from which on it is tried with less
TOLERANCES = (1e-6, 1e-3)  # that are asked for instead, one after the other, until one is reached
EXTRA = 0.125  # the part of the budget that each may take beyond it, and that is little
MORE = 1 / 32  # the part that is asked for where errors further in are all that is missing
LOOK = 12_000  # evaluations that may go into another order
OTHER_NODES = 14  # in other places than those of the first time
# From how many errors of the value on an error of a derivative is looked at again from another side, and for how many
# members at most.
STEEP = 1e3
MOST_SPOILT = 256


def by_less(problem: Problem, order: Integral, sums: Sums) -> Sums:
    """The sums, or better ones that were found by asking for less, where the budget ran out with few digits.

    Refinement that runs out of evaluations has spent them where it then stood, and left the rest as it was. Asked for
    less accuracy it does reach the end, at a small part of the cost. So asking for more never gives less.
    Not where the integrand calls for integrals, or has so many cuts, that it would go far beyond any budget once more;
    and not where it is not known what to cut at, of which a second time knows no more.
    """
    machine, plan = problem.machine, problem.plan(order)
    if plan.confused or (machine.directions and not plan.reaches):
        return sums
    if not machine.exhausted() or machine.overdrawn() or uncertainty(sums) <= ENOUGH or machine.inexact(plan.term.body):
        return sums
    beyond = machine.record.spent > (1 + EXTRA) * machine.settings.max_evals
    for rtol in TOLERANCES[-1:] if beyond else TOLERANCES:
        most = math.ceil(machine.record.spent + EXTRA * machine.settings.max_evals)
        settings = replace(machine.settings, rtol=max(rtol, machine.rtol), max_evals=most)
        loose = machine.apart().changed(settings=settings)
        other = in_parts(plan, loose, problem.env, problem.batch)
        met = loose.events.touched(problem.batch, TwoSided, SurfaceFold, Degenerate).any()
        if uncertainty(other) < uncertainty(sums) and not met:
            sums = other
        if uncertainty(sums) <= rtol:
            break
    return sums


def by_more(problem: Problem, order: Integral, sums: Sums) -> Sums:
    """The sums, or what is known better by asking for more, where they ended a little above what was asked for.

    What integrals further in may be off by is measured by the largest of them. Derivatives that cancel further out, or
    many nodes whose bounds add up, leave more than was asked for, though evaluations are left; where rounding is what
    limits them the bounds stay what they are, as of a polynomial between planes, for which rules are exact. Not where
    that would take long: it may take twice as many evaluations.
    """
    machine, plan = problem.machine, problem.plan(order)
    if plan.degrees and None not in plan.degrees:
        return sums
    if len(plan.levels) < 2 or plan.confused or (machine.directions and not plan.reaches):
        return sums
    if machine.record.spent > EXTRA * machine.settings.max_evals or uncertainty(sums) > ONLY_ROUNDED:
        return sums
    if machine.inexact(plan.term.body) or problem.events.every(Shortfall):
        return sums
    if not missing(problem.term, sums, machine.settings, problem.env).any():
        return sums
    strict = machine.changed(settings=replace(machine.settings, rtol=MORE * machine.rtol))
    found = attempted(problem.changed(machine=strict), order, math.ceil(2 * machine.record.spent))
    if found.stopped or found.events.touched(problem.batch, TwoSided, SurfaceFold, Degenerate).any():
        return sums
    other, value, rate = found.sums, found.sums.e < sums.e, found.sums.et < sums.et
    return replace(
        sums,
        v=np.where(value, other.v, sums.v),
        e=np.where(value, other.e, sums.e),
        t=np.where(rate, other.t, sums.t),
        et=np.where(rate, other.et, sums.et),
    )


def beside_another(problem: Problem, order: Integral, sums: Sums) -> Sums:
    """The sums with errors as wide as another order of the variables, or other nodes, lead elsewhere.

    Where a surface that is searched for folds, or could not be searched for, the variables further out are not cut
    there, and refinement may miss it.
    """
    plan = problem.plan(order)
    if not plan.folds and not problem.events.every(Unsearched):
        return sums
    other = _within_a_look(problem, order)
    if other is None:
        other = iterated(plan, problem.machine.apart(), problem.env, problem.batch, OTHER_NODES)
    return replace(
        sums,
        e=_covering(sums.v - other.v, sums.e, other.e),
        et=_covering(sums.t - other.t, sums.et, other.et),
    )


def _covering(gap: Array, own: Array, others: Array) -> Array:
    """Errors that cover what two answers differ by more than they admit."""
    gap = np.abs(gap)
    return np.where(gap > own + others, np.maximum(own, 2 * gap), own)


def _within_a_look(problem: Problem, order: Integral) -> Sums | None:
    """The sums with another variable innermost; None where that tells nothing, or costs too much, as it does where the
    first order has taken more already."""
    if problem.machine.record.spent > LOOK:
        return None
    for turned in itertools.islice(orders(order), 1, None):
        other = attempted(problem, turned, LOOK)
        known = np.isfinite(other.sums.e).all() and np.isfinite(other.sums.et).all()
        if known and not other.stopped and not other.events.every(Degenerate):
            return other.sums
    return None


def in_another_order(problem: Problem, order: Integral, sums: Sums) -> Sums:
    """The better, member by member, of sums and of those with another variable innermost, where rounding spoilt a few.

    A surface that is all but parallel to the innermost variable has a section in it that is steep, so that a rounded
    node further out misplaces it; along another variable it is flat.
    """
    machine = problem.machine
    rough = imprecise(sums.t, sums.et, machine.rtol)
    if not rough.size or problem.events.every(Shortfall):
        return sums
    steep = _steep(sums.pick(rough))
    if not steep.any():
        return sums
    index = rough[steep]
    index = index[missing(problem.term, sums, machine.settings, problem.env)[index]]
    if not 0 < index.size <= MOST_SPOILT:
        return sums
    few = problem.picked(index)
    for other in itertools.islice(orders(order), 1, None):
        part = few.apart()
        found = iterated(problem.plan(other), part.machine, part.env, index.size)
        better = (found.et < sums.et[:, :, index]) & ~part.events.uncounted(index.size)
        sums.t[:, :, index] = np.where(better, found.t, sums.t[:, :, index])
        sums.et[:, :, index] = np.where(better, found.et, sums.et[:, :, index])
    return sums


def _steep(sums: Sums) -> Bools:
    """For which members rounding puts a derivative far more off than the value, also as a part of what it is: of the
    tip of a sliver, which has hardly any of both, it leaves as little in any order."""
    value, error, size = np.abs(sums.v[:, None]), sums.e[:, None], np.abs(sums.t)
    worse = (sums.et > STEEP * error) & ((sums.et * value > STEEP * error * size) | (value == 0))
    return np.asarray(worse.any(axis=(0, 1)) & ~np.isinf(sums.et).any(axis=(0, 1)))
