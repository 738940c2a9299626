"""Integrals as kernels meet them: over whatever batch they stand in.

Owns `integral`: makes the batch one axis, tells members apart for which there are different plans, has each part
solved (`solving`), and gives the result the shape of the batch again.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from msgspec.structs import replace

from potto.calculus.decomposition.independent import in_factors
from potto.calculus.decomposition.normal_combinations import combined
from potto.calculus.surfaces.discontinuities import TooDeep
from potto.core.terms import Integral
from potto.diagnostics import PottoError
from potto.integrate.events import BUDGET_SPENT
from potto.integrate.pieces import INTO, OF, Sums, gather, still
from potto.kernels import errors
from potto.kernels.cells import Cell, Ints, Value, all_cells, batch_shape, map_arrays, pad
from potto.kernels.making import making
from potto.runtime.answers.allowances import left_by
from potto.runtime.evaluation.functions import Chosen, choices, settled
from potto.runtime.evaluation.local import locally
from potto.runtime.evaluation.machine import Machine
from potto.runtime.evaluation.selection import Pick, by_numbers
from potto.runtime.integration.derivatives.rims import note_rims
from potto.runtime.integration.methods.members import Whole
from potto.runtime.integration.preparation.arrays import Differ, Read, as_written, in_numbers, met, without_arrays
from potto.runtime.integration.preparation.found_once import finds_once, with_found_once
from potto.runtime.integration.preparation.prepared import filled, held, placed, prepared
from potto.runtime.integration.preparation.recursions import in_sight
from potto.runtime.integration.preparation.taken_apart import together
from potto.runtime.integration.preparation.unions import in_parts
from potto.runtime.integration.problem import Mixed, Problem, linked
from potto.runtime.integration.solving import solve


def integral(machine: Machine, term: Integral, env: dict[str, Value]) -> Value:
    """The value of an integral in an environment whose numbers may be batches of any shape: what it reads of arrays is
    found beside it, and it is solved in as few directions as there have to be."""
    linker, read = machine.linker, Read()
    term, env = filled(term, env, linker.reach)
    if finds_once(machine, term, env):
        term, env, read = with_found_once(machine, term, env)
    if met(term, env, linker.reach):
        try:
            ready, env, reads = without_arrays(machine, term, env)
        except Differ as differ:
            return by_numbers(differ.ends, env, lambda _, here, __: integral(machine, term, here))
        if not isinstance(ready, Integral):
            return together(machine, ready, env)
        term, read = ready, read | reads
    different = next((each for name in term.free for each in choices(env[name])), None)
    if different is not None:
        return _by_choice(machine, term, env, different)
    term, env = in_numbers(term, env)
    try:
        term = in_sight(machine, term, env)
    except Differ as differ:
        return by_numbers(differ.ends, env, lambda _, here, __: integral(machine, term, here))
    known = machine.record.surfaces()
    value = locally(machine, env, lambda own, here: _of_numbers(own, term, here))
    as_written(machine.record, known, read)
    return value


def _of_numbers(machine: Machine, term: Integral, env: dict[str, Value]) -> Value:
    """The value of an integral that reads no arrays: made ready, and solved."""
    linker = machine.linker
    derived = linker.reach.deltas(term.body)
    with making:
        term = placed(term, machine.directions > 0, linker.reach)
    if machine.frozen:
        term, stopped = held(term)
        env = {**env, **{new: pad(still(env[old]), machine.directions) for old, new in stopped}}
    with making:
        sampled = machine.settings.sampled
        fewer = term if sampled else combined(term)  # before deltas take a variable's density apart
        ready = prepared(term, linker.reach) if fewer is term else fewer
        if ready is term and not sampled:
            ready = in_factors(term)
            if ready is not term:  # sums of products are not products of sums
                machine = machine.changed(into=None, of=None)
    if ready is term:
        ready = in_parts(machine, term, env)
    if ready is not term:
        if derived and not machine.directions:
            note_rims(machine, term, env)
        return together(machine, ready, env)
    return integrate(machine, term, env)


def _by_choice(machine: Machine, term: Integral, env: dict[str, Value], different: Chosen) -> Value:
    """The members for which one function is the same together: what it does is part of what is integrated."""

    def evaluated(_: float, here: dict[str, Value], __: Pick) -> Value:
        return integral(machine, term, {name: settled(value) for name, value in here.items()})

    return by_numbers(different.places.v, env, evaluated)


def integrate(machine: Machine, term: Integral, env: dict[str, Value]) -> Value:
    """The value of an integral that is ready."""
    machine.enter()
    try:
        return _integrate(machine.inside(), term, env, machine.root)
    except TooDeep:
        raise PottoError([errors.TOO_DEEP(
            errors.NOWHERE, "the recursion under this integral does not end for these parameters",
            help="the condition that ends it must be decided by parameters alone",
        )]) from None  # fmt: skip
    finally:
        machine.record.depth = max(0, machine.record.depth - 1)


def _integrate(machine: Machine, term: Integral, env: dict[str, Value], outermost: bool) -> Value:
    shape = batch_shape(env.values())
    batch = math.prod(shape)
    if batch == 0:
        return Cell(np.zeros(shape))
    flat = env
    if shape:
        flat = {n: map_arrays(v, lambda a: np.ascontiguousarray(np.broadcast_to(a, shape)).reshape(-1))
                for n, v in env.items()}  # fmt: skip
    if batch == 1 and shape:
        flat = {n: map_arrays(v, lambda a: float(a[0])) for n, v in flat.items()}
    if outermost and machine.into is not None and shape == machine.into.shape != (1,):
        for name, numbers in ((INTO, machine.into), (OF, machine.of)):
            if numbers is not None:
                flat[name] = pad(Cell(numbers.astype(float)), machine.directions)
    record = machine.record
    record.integrals += 1
    if machine.overdrawn() and not outermost:
        return given_up(machine, shape)
    problem = Problem(machine.apart(), term, *linked(flat), solve, batch, outermost)
    sums = poisoned(_grouped(problem, flat), problem.env)
    if sums.v.shape[0] == 1 and not sums.v.any():  # where nothing is integrated it is not known how many numbers it is
        alone = problem if problem.batch == 1 else problem.member(0)  # one plan need not be for all of them
        sums = sums.widened(alone.width())
    if not outermost:
        for event, _ in problem.events:
            machine.note(event.outside())
        return _shaped(sums, shape)
    record.tell(problem.events, batch, shape)
    record.allowed = record.allowed.and_of(left_by(term, sums, machine.rtol, shape))
    value = _shaped(sums, shape)
    if record.precise is not None:
        record.precise = record.precise.shown(sums, all_cells(value))
    return value


def _grouped(problem: Problem, flat: dict[str, Value]) -> Sums:
    """What an integral amounts to; members for which recursions take different courses apart from one another."""
    parts = problem.on_known_sides()
    if parts:
        return _by_sides(problem, flat, parts)
    groups = problem.courses() if problem.batch > 1 else []
    return _in_groups(problem, flat, groups) if len(groups) > 1 else _in_cases(problem, flat)


def _by_sides(problem: Problem, flat: dict[str, Value], parts: list[tuple[Ints, Integral]]) -> Sums:
    """The integrals of a batch, of some of which it is known what is left of them."""
    if problem.batch == 1:
        return solve(problem.changed(term=parts[0][1]))
    rest = np.setdiff1d(np.arange(problem.batch), np.concatenate([index for index, _ in parts]))
    found = Whole()
    for index, term in (*parts, *([(rest, problem.term)] if rest.size else [])):
        here = gather(flat, index)
        with problem.among(index, here) as part:
            own = part if term is problem.term else part.changed(term=term)
            found.put(index, _in_groups(own, here, own.courses() or [np.arange(index.size)]))
        problem.events.take(part.events, index)
    return found.sums


def _in_groups(problem: Problem, flat: dict[str, Value], groups: Iterable[Ints]) -> Sums:
    """The integrals of a batch, group by group."""
    found = Whole()
    for index in groups:
        here = gather(flat, index)
        with problem.among(index, here) as part:
            found.put(index, _in_cases(part, here))
        problem.events.take(part.events, index)
    return found.sums


def _in_cases(problem: Problem, flat: dict[str, Value]) -> Sums:
    """The integrals of a batch, those together that meet the same cases of conditions inside of conditions."""
    batch = problem.batch
    if batch == 1:
        return solve(problem)
    apart = problem.apart()
    try:
        sums = solve(apart)
        if apart.events:
            problem.events.take(apart.events, np.arange(batch))
        return sums
    except Mixed as mixed:
        fits = np.asarray(mixed.fits)
    if fits.shape != (batch,):  # it was found out about a part of them
        fits = np.arange(batch) < batch // 2
    fits[0] = True  # the plan was made for it
    groups = (np.nonzero(fits)[0], np.nonzero(~fits)[0]) if not fits.all() else np.array_split(np.arange(batch), 2)
    return _in_groups(problem, flat, groups)


def given_up(machine: Machine, shape: tuple[int, ...]) -> Value:
    """No number, where finding one would take far more than the budget."""
    machine.note(BUDGET_SPENT)
    nan, k = np.full(shape, np.nan), machine.directions
    return Cell(nan, np.full(shape, np.inf), (nan,) * k, (np.full(shape, np.inf),) * k)


def poisoned(sums: Sums, env: dict[str, Value]) -> Sums:
    """A parameter that is not a number makes the integral not a number, whatever the cuts made of it."""
    bad = False
    for value in env.values():
        for cell in (value,) if isinstance(value, Cell) else value if isinstance(value, tuple) else ():
            if isinstance(cell, Cell) and np.isnan(np.sum(cell.v)):  # in a third of the time of a look at each
                bad = bad | (cell.v != cell.v)
    if bad is not False and np.any(bad):
        where = np.broadcast_to(bad, sums.v.shape[-1:])
        sums.v[:, where] = np.nan
    if sums.v.size == 1 and math.isfinite(sums.v[0, 0]):  # numpy takes its time over a single number
        return sums
    if not np.isnan(sums.v.sum()):
        return sums
    undefined = np.isnan(sums.v)
    if not undefined.any():
        return sums
    t = np.where(undefined[:, None], np.nan, sums.t)  # nor is its derivative one
    return replace(sums, t=t, e=np.where(undefined, np.inf, sums.e), et=np.where(undefined[:, None], np.inf, sums.et))


def _shaped(sums: Sums, shape: tuple[int, ...]) -> Value:
    cells = sums.cells(shape)
    return cells[0] if len(cells) == 1 else tuple(cells)
