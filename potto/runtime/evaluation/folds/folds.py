"""Folds while a program runs: a state stepped from place to place.

Owns `fold`. The steps are a loop of one bare kernel, by machine code where that pays. What that says of no step
(derivatives, and how far off all is) is found for all steps at once afterwards: a step is nearly linear around the
states that were met, `linear` has its derivatives, and `steps` puts them together. States of many numbers are stepped
with samples of their errors (`signed`), and steps that integrate with all that they carry.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from potto.calculus.inlining.reads import beside
from potto.core.terms import Fold, Lam, Term, function_of, lam
from potto.diagnostics import PottoError
from potto.kernels.cells import Cell, Env, Value, batch_shape, map_cells, pad, pattern
from potto.kernels.native.stepping import Stepping
from potto.kernels.whole import looked_through
from potto.runtime.evaluation.folds.linear import States, along, steps_at_once
from potto.runtime.evaluation.folds.reduction import reduced
from potto.runtime.evaluation.folds.signed import can_be_sampled, stepped
from potto.runtime.evaluation.machine import Machine
from potto.runtime.evaluation.selection import by_bounds
from potto.runtime.evaluation.sums import bounds

STEPS = "steps"  # what a kernel's machine code for folds is kept under
LEAST = 4096  # steps that it pays to look at all at once where there are more


def fold(machine: Machine, term: Fold, lo: Value, hi: Value, start: Value, env: Env) -> Value:
    """The state after all steps, however many."""
    first, last = bounds(lo, "lower"), bounds(hi, "upper")
    if isinstance(first, np.ndarray) or isinstance(last, np.ndarray):
        whole = {**env, "": pad(start, machine.directions)}
        return by_bounds(first, last, whole, lambda a, b, here: fold(machine, term, a, b, here.pop(""), here))
    places = range(int(first), int(last) + 1)
    if not places:
        return start
    found = reduced(machine, term, places, start, env)
    if found is not None:
        return found
    while 0 < min(LEAST, len(places)) <= (most := steps_at_once(machine, term, start, env)):
        here = places[:most]
        step, known, read = _read(machine, term, here, start, env)
        body, known = _function(term, step), {**env, **known}
        states = _bare(machine, term, body, here, start, known, read)
        if states is None:
            break
        start, places = along(machine, term, body, here, states, start, {**known, **read}), places[most:]
    if not places:
        return start
    body = _function(term, term.body)
    if can_be_sampled(machine, term, start):
        return stepped(machine, term, body, places, start, env)
    return _carrying(machine, term, body, places, start, env)


def _function(term: Fold, step: Term) -> Lam:
    return lam(tuple(sorted(step.free | {term.variable, term.state})), step)


def _read(machine: Machine, term: Fold, places: range, start: Value, env: Env) -> tuple[Term, Env, Env]:
    """What a step does with what it reads of arrays, whatever the state is; what it reads in all steps, and in each:
    numbers with the steps as first axis."""
    step, accesses = beside(term.body, frozenset((term.state,)))
    shape = batch_shape((start, *env.values()))
    index = np.arange(places.start, places.stop, dtype=float).reshape(-1, *(1,) * len(shape))
    here = {**env, term.variable: Cell(index, None, (None,) * machine.directions)}
    known: Env = {}
    read: Env = {}
    try:
        with looked_through():
            for access in accesses:
                value = machine.evaluate(function_of(access.term), here, None)
                if not isinstance(value, Cell):
                    return term.body, {}, {}
                (read if term.variable in access.term.free else known)[access.name] = value
    except PottoError:  # step by step it is said where
        return term.body, {}, {}
    return step, known, read


def _bare(machine: Machine, term: Fold, body: Lam, places: range, start: Value, env: Env, read: Env) -> States | None:
    """All states, numbers only; None where they are not of one kind. read: as by `_read`."""
    quiet = machine.changed(directions=0, taping=False, rounding=False)
    here = {name: map_cells(value, _plain) for name, value in (env | read).items()}
    here[term.variable], here[term.state] = Cell(float(places.start)), map_cells(start, _plain)
    args = [here[name] for name in body.params]
    number = {name: at for at, name in enumerate(body.params)}
    own, at = number[term.state], number.get(term.variable)
    rows = frozenset(number[name] for name in read)
    if machine.backend != "numpy" and _of_cells(args):
        kernel = quiet.kernel(body, tuple([pattern(a, 0) for a in args]))
        key = STEPS, rows
        if kernel.plain and key not in kernel.native:
            kernel.native[key] = Stepping(kernel, own, at, rows)
        if kernel.plain:
            found: Stepping = kernel.native[key]
            function = found.promotion.function(machine.backend, found.text)
            if function is not None:
                return States.counted(found.run(function, args, places), start, env)
            with found.promotion.by_numpy():
                return States.told(_one_by_one(quiet, body, places, args, own, at, rows), start, env)
    return States.told(_one_by_one(quiet, body, places, args, own, at, rows), start, env)


def _one_by_one(
    machine: Machine, body: Lam, places: range, given: Sequence[Value], own: int, at: int | None, rows: frozenset[int]
) -> list[Value]:
    """All states, each by the kernel. own, at: which of its parameters are the state and the place; rows: which have a
    value of their own for every step."""
    args = list(given)
    states, found = [args[own]], None
    many = [(row, _each(args[row], len(places))) for row in rows]
    for number, place in enumerate(places):
        if at is not None:
            args[at] = Cell(float(place))
        for row, cells in many:
            args[row] = cells[number]
        args[own] = states[-1]
        if found is None or len(states) < 3:  # from then on states are of one kind
            found = machine.kernel(body, tuple([pattern(a, 0) for a in args]))
        states.append(found.run(machine, None, *args))
    return states


def _each(value: Value, count: int) -> list[Cell]:
    """A number of every step, one by one."""
    assert isinstance(value, Cell)
    v = np.asarray(value.v)
    if v.ndim < 2:
        return [Cell(x) for x in np.broadcast_to(v, (count,)).tolist()]
    return [Cell(x) for x in np.broadcast_to(v, (count, *v.shape[1:]))]


def _of_cells(args: Sequence[Value]) -> bool:
    """Whether arguments are numbers, and tuples of them."""
    return all(isinstance(arg, Cell) or (isinstance(arg, tuple) and _of_cells(arg)) for arg in args)


def _plain(cell: Cell) -> Cell:
    return Cell(cell.v)


def _carrying(machine: Machine, term: Fold, body: Lam, places: range, start: Value, env: Env) -> Value:
    """The state, stepped with all that it carries."""
    here, still = {**env, term.state: start}, (None,) * machine.directions
    for place in places:
        here[term.variable] = Cell(float(place), None, still)
        here[term.state] = machine.run(body, [here[name] for name in body.params], None)
    return here[term.state]
