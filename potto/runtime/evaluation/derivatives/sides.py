"""What is made of parts that have one-sided derivatives, evaluated on both sides of the parameters.

Owns `as_a_whole`. The derivatives to one side of parts that are put together are those of the whole to that side: so
what differs in a part may be the same in the whole, as at t = 1 of abs(t - 1)^3.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import nullcontext
from typing import Any

import numpy as np

from potto.calculus.surfaces.trace import spine
from potto.core.terms import App, Hole, If, Integral, Lam, Term, postorder
from potto.diagnostics import PottoError
from potto.integrate.events import NO_SECOND_DERIVATIVE, OneSidedDerivatives, TwoSided
from potto.integrate.rules.gauss import EPS
from potto.kernels.cells import (
    Array,
    Bools,
    Cell,
    Ints,
    Number,
    Rows,
    Value,
    all_cells,
    map_arrays,
    map_cells,
    pad,
)
from potto.kernels.errors import Coincidence
from potto.runtime.answers.allowances import NOTHING, Allowed
from potto.runtime.answers.convergence import merged
from potto.runtime.evaluation.derivatives.beside import SAME as ALIKE
from potto.runtime.evaluation.derivatives.beside import Parts, approached, moved, one_direction, parameter_step
from potto.runtime.evaluation.linker import Linker
from potto.runtime.evaluation.machine import Machine

DEEPEST = 20  # definitions that a call may lead through
Run = Callable[[Machine, Value], Value]
Side = tuple[Array, Array]  # the tangents of all numbers, (numbers, directions, …), and how far off they may be
Sides = tuple[Side, Side]
ASKEW = 0.6180339887498949  # of the golden ratio: no multiple comes near a whole number
SAME = 1e-12  # how far apart the derivatives on both sides may be beside their errors, as a part of them


def as_a_whole(machine: Machine, term: Term, given: Value, run: Run, part: bool = False) -> Value:
    """What `run` gives for a machine and what is given, the value of a term or what the functions that it is give.
    Where parts have two derivatives, those of the whole on both sides are found: if they are the same, that is the
    derivative, else the nearer one is, and a note tells them. Raises PottoError (P0505) where a second derivative is
    asked for just where the first one jumps; in a batch only of such members nothing is known, unless it is `part` of
    something larger, of which members may be summands.
    """
    record = machine.record
    before = record.met, len(record.edges)
    try:
        value = run(machine, given)
    except Coincidence as coincide:
        if machine.side or machine.taping:
            raise
        del record.edges[before[1] :]
        return _across(machine, given, run, coincide, part)
    met = record.edges[before[1] :]
    within = all(edge.cause.variable for edge in met)  # what an integral has met, none of the numbers that it is given
    if not met or machine.side or machine.taping or (within and _one_integral(machine.linker, term)):
        return value
    value, batch = pad(value, machine.directions), _batch(given)
    members = _few(record.sided(*before), batch)
    there = (...,) if members is None else (..., members)
    v, e, slopes, off = _numbers(value, machine.directions, batch)
    here = v[there], e[there], slopes[there], off[there]
    jumps = any(edge.cause.jump or edge.endless for edge in met)
    del record.edges[before[1] :]  # what is noted is told of the whole
    try:
        sides = _both(machine, given, members, lambda m, own, side: _beside(m, own, side, run, here, jumps))
    except PottoError:  # a number that counts something: beside it there is nothing
        return value
    slopes, off = slopes.copy(), off.copy()
    slopes[there], off[there], two = _chosen(here, sides, jumps)
    if two is not None:
        record.edges.append(_note(met[0].cause, two, slopes.shape, there, sides))
    rows = iter(zip(slopes, off, strict=True))
    return map_cells(value, lambda cell: Cell(cell.v, cell.e, *map(tuple, next(rows))))


def _across(machine: Machine, given: Value, run: Run, coincide: Coincidence, part: bool) -> Value:
    """The value where a surface is met of which a second derivative depends. The branch that is taken has it, if in a
    direction that no surface runs along what lies beside the parameters leads to it on both sides: then nothing jumps,
    as across the cut of `atan2` right of the origin, or the surface stays where it is. Else those to the sides count.
    Of members for which one is infinite nothing is known; if it is so for all, or in a part, that is an error.
    """
    batch, known, aside = _batch(given), len(machine.record.edges), machine.changed(aside=True)
    value = pad(run(aside, given), machine.directions)
    v, e, slopes, off = _numbers(value, machine.directions, batch)
    met = machine.record.edges[known:]
    del machine.record.edges[known:]
    weights: Array = 0.5 + ASKEW * np.arange(1.0, machine.directions + 1.0) % 1

    def mixed(rows: Array) -> Array:
        return np.asarray(np.einsum("nd...,d->n...", rows, weights)[:, None])

    here, across = (v, e, slopes, off), (v, e, mixed(slopes), mixed(off))
    try:
        crossing = _both(
            aside.with_directions(1), map_cells(given, lambda cell: _mixed(cell, weights)), None,
            lambda own, moving, side: _led_to(own, moving, run, across, side),
        )  # fmt: skip
        if _agree(crossing, across, slopes).all():
            return value
        sides = _both(aside, given, None, lambda own, moving, side: _led_to(own, moving, run, here, side))
    except PottoError:
        raise coincide from None
    t, et, same = _chosen(here, sides, True)
    finite = [np.isfinite(t).all(axis=(0, 1)) for t, _ in (*crossing, *sides)]
    differs = bool(met) & ~np.asarray(True if same is None else same)
    exists = np.all(finite, axis=0) & (differs | _agree(crossing, (v, e, mixed(t), mixed(et)), t))
    if not exists.all():
        if part or not exists.any():
            raise coincide
        merged(machine.record.shortfalls, {NO_SECOND_DERIVATIVE: ~exists})
        t, et = np.where(exists, t, np.nan), np.where(exists, et, np.inf)
    if same is not None and met:
        machine.record.edges.append(_note(met[0].cause, same | ~exists, t.shape, (...,), sides))
    rows = iter(zip(t, et, strict=True))
    return map_cells(value, lambda cell: Cell(cell.v, cell.e, *map(tuple, next(rows))))


def _agree(sides: Sides, here: Parts, like: Array) -> Bools:
    """For which members both sides have the slopes that are here, in the size of others."""
    v, _, slopes, off = here
    size = ALIKE * np.maximum(np.max(np.abs(like), axis=(0, 1)), EPS * np.max(np.abs(v), axis=0))
    with np.errstate(invalid="ignore"):
        near = [(off + et <= size) & (np.abs(t - slopes) <= size) for t, et in sides]
    return np.asarray(np.all(near, axis=(0, 1, 2)))


def _mixed(cell: Cell, weights: Array) -> Cell:
    """A number that moves in one direction alone, made of all of its directions."""
    rows = [w * t for w, t in zip(weights, cell.t, strict=True) if t is not None] if cell.t else []
    return Cell(cell.v, cell.e, (sum(rows) if rows else None,), (None,))


def _few(met: Any, batch: tuple[int, ...]) -> Ints | None:
    """The members of a batch that have met something; None where that is told of all together."""
    return np.nonzero(met)[0] if len(batch) == 1 and np.shape(met) == batch else None


def _both(machine: Machine, given: Value, members: Ints | None, beside: Callable[[Machine, Value, int], Side]) -> Sides:
    """What `beside` finds on either side for some members by themselves. The record is left as it was, but that what is
    added up there counts for how much may be off."""
    record, batch = machine.record, _batch(given)
    allowed: Allowed = NOTHING
    kept = record.shortfalls, record.edges, record.allowed
    try:
        with nullcontext(machine.apart()) if members is None else machine.among(members) as apart:
            given = given if members is None else map_arrays(given, lambda a: a[members])
            sides = []
            for side in (-1, 1):
                record.shortfalls, record.edges, record.allowed = {}, [], NOTHING
                sides.append(beside(apart, given, side))
                allowed = allowed.and_of(record.allowed)
    finally:
        record.shortfalls, record.edges, record.allowed = kept
    if members is not None:
        allowed = allowed.put(members, int(np.prod(batch)), batch)
    record.allowed = record.allowed.and_of(allowed)
    return sides[0], sides[1]


def _beside(machine: Machine, given: Value, side: int, run: Run, here: Parts, jumps: bool) -> Side:
    """The tangents to a side, and how far off they may be: as that side has them, or where something jumps, as the
    values there lead to them."""
    if jumps:
        return _led_to(machine, given, run, here, side)
    value = run(machine.apart().changed(side=side), given)
    return _numbers(value, machine.directions, _batch(given))[2:]


def _chosen(here: Parts, sides: Sides, jumps: bool) -> tuple[Array, Array, Bools | None]:
    """The tangents and how far off they may be: that of both sides where these are the same, else the nearer one. And
    where all of them are the same, if there are two anywhere."""
    (backward, before), (forward, beyond), (_, _, slopes, off) = *sides, here
    with np.errstate(invalid="ignore"):
        near = np.abs(forward - backward) <= SAME * (np.abs(forward) + np.abs(backward)) + before + beyond
        same = np.where(np.isfinite(forward) & np.isfinite(backward), near, forward == backward)
        nearer = np.abs(slopes - backward) < np.abs(slopes - forward)
        t = np.where(same, 0.5 * (backward + forward), np.where(nearer, backward, forward))
        et = np.where(same, np.maximum(before, beyond), np.where(nearer, before, beyond))
        if jumps:  # what is found beside the parameters has fewer digits: enough to know which side it is, or none
            near = (np.abs(slopes - t) <= off + et + ALIKE * np.abs(t)) & (et <= ALIKE * np.abs(slopes))
            holds, endless = near | ~np.isfinite(t), np.isinf(backward) & np.isinf(forward)
            t, et = np.where(holds, slopes, t), np.where(endless, np.inf, np.where(holds, off, et))
    if same.all():
        return t, et, None
    return t, et, np.asarray(same.all(axis=(0, 1)) if same.ndim > 2 else False)


def _one_integral(linker: Linker, term: Term) -> bool:
    """Whether a term is nothing but one integral, through the calls around it: then it has told its own derivatives.
    Of two by a condition that no integral takes part in (a range, and what to do where it is none) one is taken."""
    for _ in range(DEEPEST):
        while isinstance(term, Lam):
            term = term.body
        if isinstance(term, If):
            whole = not any(isinstance(node, App | Integral) for node in postorder(term.condition))
            sides = (term.then, term.orelse)
            return whole and all(isinstance(side, Hole) or _one_integral(linker, side) for side in sides)
        if not isinstance(term, App):
            break
        head, _ = spine(term)
        function = linker.function(head)
        if not isinstance(function, Lam):
            break
        term = function
    return isinstance(term, Integral)


def _note(cause: TwoSided, same: Bools, shape: tuple[int, ...], there: Any, sides: Sides) -> OneSidedDerivatives:
    """The derivatives on both sides, of those members for which they differ. shape, there: of the whole batch's
    tangents, and which of these were looked at."""

    def of_all(side: Array) -> Array:
        whole = np.full(shape, np.nan)
        whole[there] = np.where(same, np.nan, side)
        return whole.reshape(-1, *shape[2:])

    (backward, before), (forward, beyond) = sides
    return OneSidedDerivatives(cause, *map(of_all, (backward, forward, before, beyond)))


def _led_to(machine: Machine, given: Value, run: Run, here: Parts, side: int) -> tuple[Array, Array]:
    """The tangents of all numbers of a value to a side, (numbers, directions, …), and how far off they may be, as
    those beside what is given lead to them. here: the numbers themselves, and their tangents."""
    batch, (v, e, t, et) = _batch(given), here
    t, et = t.copy(), et.copy()
    for d in range(machine.directions):
        step = parameter_step((given,), d)
        if step is None:
            continue

        def at(h: float, d: int = d) -> Parts:
            beside = run(machine.apart().with_directions(1), moved(one_direction(given, d), h, 0))
            w, off, slopes, unsure = _numbers(beside, 1, batch)
            return w, off, slopes[:, 0], unsure[:, 0]

        t[:, d], et[:, d] = approached(at, side * step, (v, e), machine.rtol)
    return t, et


def _batch(given: Value) -> tuple[int, ...]:
    """The shape of all that is evaluated at once; what is the same for all of it may have none."""
    return np.broadcast_shapes(*_shapes(given, 0))


def _shapes(given: Value, inside: int) -> Iterator[tuple[int, ...]]:
    """The shapes of numbers, without the first axes, those of the arrays that they are in."""
    if isinstance(given, Rows):
        yield from _shapes(given.item, inside + 1)
    elif isinstance(given, tuple | list):
        for item in given:
            yield from _shapes(item, inside)
    elif isinstance(given, Cell):
        for shape in (np.shape(x) for x in (given.v, *given.t) if x is not None):
            yield shape[inside:]


def _numbers(value: Value, directions: int, batch: tuple[int, ...]) -> Parts:
    """All numbers of a value, how far off they are, their tangents, (numbers, directions, …), and how far off those
    are."""
    cells = all_cells(pad(value, directions))
    shape = np.broadcast_shapes(batch, *(np.shape(cell.v) for cell in cells))

    def rows(of: Callable[[Cell], Iterable[Number | None]]) -> Array:
        found = [[np.broadcast_to(0.0 if x is None else x, shape) for x in of(cell)] for cell in cells]
        return np.array(found, dtype=float)

    v, e = rows(lambda cell: (cell.v,)), rows(lambda cell: (cell.e,))
    return v[:, 0], e[:, 0], rows(lambda cell: cell.t), rows(lambda cell: cell.et)
