"""Folds while a program runs: a state stepped from place to place.

Owns `fold`. The steps are a loop of one bare kernel, by machine code where that pays. What that says of no step
(derivatives, and how far off all is) is found for all steps at once afterwards: a step is nearly linear around the
states that were met, `linear` has its derivatives, and `steps` puts them together. States of many numbers are stepped
with samples of their errors (`signed`), and steps that integrate with all that they carry.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from potto.core.terms import Fold, Lam, lam
from potto.kernels.cells import Cell, Number, Value, all_arrays, map_cells, pad, pattern
from potto.kernels.native.stepping import Stepping
from potto.runtime.evaluation.linear import States, along, steps_at_once
from potto.runtime.evaluation.machine import Machine
from potto.runtime.evaluation.reduction import reduced
from potto.runtime.evaluation.selection import Pick, apart
from potto.runtime.evaluation.signed import can_be_sampled, stepped
from potto.runtime.evaluation.sums import bounds

STEPS = "steps"  # what a kernel's machine code for folds is kept under
LEAST = 4096  # steps that it pays to look at all at once where there are more

Env = dict[str, Value]


def fold(machine: Machine, term: Fold, lo: Value, hi: Value, start: Value, env: Env) -> Value:
    """The state after all steps, however many."""
    first, last = bounds(lo, "lower"), bounds(hi, "upper")
    if isinstance(first, np.ndarray) or isinstance(last, np.ndarray):
        return _grouped(machine, term, first, last, start, env)
    places = range(int(first), int(last) + 1)
    if not places:
        return start
    found = reduced(machine, term, places, start, env)
    if found is not None:
        return found
    body = lam(tuple(sorted(term.body.free | {term.variable, term.state})), term.body)
    while 0 < min(LEAST, len(places)) <= (most := steps_at_once(machine, term, start, env)):
        here = places[:most]
        states = _bare(machine, term, body, here, start, env)
        if states is None:
            break
        start, places = along(machine, term, body, here, states, start, env), places[most:]
    if not places:
        return start
    if can_be_sampled(machine, term, start):
        return stepped(machine, term, body, places, start, env)
    return _carrying(machine, term, body, places, start, env)


def _bare(machine: Machine, term: Fold, body: Lam, places: range, start: Value, env: Env) -> States | None:
    """All states, numbers only; None where they are not of one kind."""
    quiet = machine.changed(directions=0, taping=False, rounding=False)
    here = {name: map_cells(value, _plain) for name, value in env.items()}
    here[term.variable], here[term.state] = Cell(float(places.start)), map_cells(start, _plain)
    args = [here[name] for name in body.params]
    kernel = quiet.kernel(body, tuple([pattern(a, 0) for a in args]))
    at = body.params.index(term.variable) if term.variable in body.params else None
    own = body.params.index(term.state)
    if not kernel.plain or machine.backend == "numpy" or not _of_cells(args):
        return States.told(_one_by_one(quiet, body, places, args, own, at), start, env)
    found = kernel.native.get(STEPS)
    if found is None:
        found = kernel.native[STEPS] = Stepping(kernel, own, at)
    function = found.promotion.function(machine.backend, found.text)
    if function is not None:
        return States.counted(found.run(function, args, places), start, env)
    with found.promotion.by_numpy():
        return States.told(_one_by_one(quiet, body, places, args, own, at), start, env)


def _one_by_one(machine: Machine, body: Lam, places: range, args: list[Value], own: int, at: int | None) -> list[Value]:
    """All states, each by the kernel. own, at: which of its parameters are the state and the place."""
    states, found = [args[own]], None
    for place in places:
        if at is not None:
            args[at] = Cell(float(place))
        args[own] = states[-1]
        if found is None or len(states) < 3:  # from then on states are of one kind
            found = machine.kernel(body, tuple([pattern(a, 0) for a in args]))
        states.append(found.run(machine, None, *args))
    return states


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


def _grouped(machine: Machine, term: Fold, first: Number, last: Number, start: Value, env: Env) -> Value:
    """Bounds that differ over the batch: the members with equal bounds together."""
    whole = {**env, "": start}
    shape = np.broadcast_shapes(
        np.shape(first), np.shape(last), *(a.shape for value in whole.values() for a in all_arrays(value))
    )
    lo, hi = np.broadcast_to(first, shape), np.broadcast_to(last, shape)
    pairs = np.unique(np.stack([lo.ravel(), hi.ravel()]), axis=1).T
    whole[""] = pad(start, machine.directions)

    def evaluated(number: int, here: Env, _: Pick) -> Value:
        a, b = (Cell(float(end)) for end in pairs[number])
        return fold(machine, term, a, b, here.pop(""), here)

    return apart([(lo == a) & (hi == b) for a, b in pairs], whole, evaluated)


__all__ = ["fold"]
