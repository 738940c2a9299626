"""Derivatives of integrals with a kink, or a surface, all along a stretch, just at the parameters: those to both sides.

Owns `at_kinks`. They are what the derivatives beside the parameters lead to, where there is a place to cut at.
"""

from __future__ import annotations

import numpy as np
from msgspec.structs import replace

from potto.core.terms import children
from potto.integrate.degenerate.kinks import lying_along
from potto.integrate.events import BOUNDLESS, Along, OneSidedDerivatives, SurfaceFold, TwoSided, mask_of
from potto.integrate.pieces import Sums
from potto.kernels.cells import Ints
from potto.runtime.evaluation.derivatives.beside import parameter_step
from potto.runtime.integration.derivatives.one_sided import beside
from potto.runtime.integration.problem import Problem

SAME = 1e-6  # how far apart both derivatives may be beside their errors, as a part of them, if there is but one
MOST_VARIABLES = 3  # with more, what is found beside the parameters takes too long


def at_kinks(problem: Problem, sums: Sums) -> Sums:
    """Sums, with a note of both derivatives where they differ, and the one that there is where they are the same.
    Integrals further out are told that there may be two."""
    machine = problem.machine
    if not machine.directions or machine.frozen:
        return sums
    found = _surfaces(problem)
    if children(problem.plan().kinks.body) and not machine.exhausted():
        found += _kinks(problem)
    for cause, members in found:
        if problem.outermost:
            sums = _noted(problem, sums, cause, members)
        else:
            machine.note(SurfaceFold(cause), members)
    return sums


def _surfaces(problem: Problem) -> list[tuple[TwoSided, Ints]]:
    """The surfaces that lie along a stretch, as quadrature has met them, each for members that none before it has."""
    met, found = np.zeros(problem.batch, dtype=bool), []
    for event, members in problem.events.every(Along):
        mask = mask_of(members, problem.batch)
        if (fresh := np.nonzero(mask & ~met)[0]).size:
            found.append((TwoSided(event.variable, event.surface, along=not event.bound), fresh))
        met |= mask
    problem.events.forget(Along)
    return found


def _kinks(problem: Problem) -> list[tuple[TwoSided, Ints]]:
    plan, found = problem.plan(), []
    for number, members in lying_along(plan, problem.env, problem.batch, problem.machine):
        kink = children(plan.kinks.body)[number]
        variable = next((v for v in reversed(problem.term.variables) if v in kink.free), problem.term.variables[-1])
        bends = number < len(children(plan.kinks.body)) - plan.steps
        found.append((TwoSided(variable, kink, kink=bends, along=True), members))
    return found


def _noted(problem: Problem, sums: Sums, cause: TwoSided, members: Ints) -> Sums:
    t, et = sums.t.copy(), sums.et.copy()
    sides = np.full((4, sums.t.shape[0], sums.t.shape[1], members.size), np.nan)
    for d in range(problem.machine.directions):
        with problem.among(members) as some:
            step = parameter_step(some.env.values(), d)
            if step is None or len(problem.term.variables) > MOST_VARIABLES:
                sides[:, :, d] = 0.0 if step is None else np.nan
                continue
            here = sums.pick(members)
            both = (beside(some, d, sign * step, here, problem.machine.rtol) for sign in (-1.0, 1.0))
            (backward, before), (forward, beyond) = both
        sides[:, :, d] = backward, forward, before, beyond
    backward, forward, before, beyond = sides
    if problem.machine.side:
        t[..., members], off = (forward, beyond) if problem.machine.side > 0 else (backward, before)
        et[..., members] = np.where(np.isfinite(t[..., members]), off, np.inf)
        return replace(sums, t=t, et=et)
    with np.errstate(invalid="ignore"):
        same = np.abs(forward - backward) <= SAME * (np.abs(forward) + np.abs(backward)) + before + beyond
        same &= np.isfinite(forward) & np.isfinite(backward)
        wrong = same & ~(np.abs(t[..., members] - forward) <= SAME * np.abs(forward) + beyond + et[..., members])
    differ = np.nonzero(~same.all(axis=(0, 1)))[0]
    if differ.size:
        problem.events.note(OneSidedDerivatives(cause, *sides[..., differ]), members[differ])
    endless = np.isinf(forward) & np.isinf(backward)
    if endless.any():
        problem.machine.note(BOUNDLESS, members[endless.any(axis=(0, 1))])
    et[..., members] = np.where(endless, np.inf, et[..., members])
    t[..., members] = np.where(wrong, forward, t[..., members])
    et[..., members] = np.where(wrong, before + beyond, et[..., members])
    return replace(sums, t=t, et=et)
