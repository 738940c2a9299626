"""Folds over states of many numbers: how far off they are, by samples of errors that are stepped along.

Owns `stepped`. Where a state has too many numbers for the matrices of its steps (`linear`), some
errors that it may have are carried as further tangents: to each, every step adds what it rounds off, with signs of its
own. Two add up what all steps round off in one direction, the others have random signs. A multiple of the largest is
the bound: not proved, but errors with regard to sign do not grow where the state does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import Any

import numpy as np

from potto.core.terms import Fold, Lam
from potto.kernels.cells import Cell, Env, Rows, Value, all_cells, map_cells, pad
from potto.kernels.whole import looked_through
from potto.runtime.evaluation.machine import Machine

SAMPLES = 6  # of errors: one rounded up always, one away from 0 always, the others at random
SAFE, SAFE_RANDOM = 2.0, 6.0  # times the largest of the first two, and the mean of the others
MOST_TANGENTS = 4  # with samples of their own


def can_be_sampled(machine: Machine, term: Fold, start: Value) -> bool:
    """Whether errors are wanted, of numbers, and steps do not integrate."""
    wanted = machine.rounding and not machine.taping
    return wanted and _of_numbers(start) and not machine.linker.inexact(term.body)


def _of_numbers(value: Value) -> bool:
    if isinstance(value, tuple):
        return all(map(_of_numbers, value))
    return _of_numbers(value.item) if isinstance(value, Rows) else isinstance(value, Cell)


def stepped(machine: Machine, term: Fold, body: Lam, places: range, start: Value, env: Env) -> Value:
    """The last state with its tangents and errors."""
    return _Stepped(machine, term, body, env).through(places, start)


class _Stepped:
    """One fold on its way. k: tangents that are asked for; sampled: those of them that have samples."""

    def __init__(self, machine: Machine, term: Fold, body: Lam, env: Env) -> None:
        self.term, self.body, self.k = term, body, machine.directions
        self.sampled = self.k if self.k <= MOST_TANGENTS else 0
        self.total = self.k + SAMPLES * (1 + self.sampled)
        record = machine.record
        if not self.k and record.second:  # no derivative is asked for: surfaces that are met say nothing
            record = copy(record)
            record.second = False
        self.plain = machine
        self.wide = machine.changed(directions=self.total, record=record)
        self.env = env
        self.wide_env = {name: pad(value, self.total) for name, value in env.items()}
        self.random = np.random.default_rng(0)

    def through(self, places: range, start: Value) -> Value:
        begun = pad(start, self.k)
        state = map_cells(begun, lambda cell: self.next(Cell(cell.v, cell.e, (*cell.t, *self.still()), cell.et), cell))
        for place in places:
            state = self.step(float(place), state)
        return map_cells(state, self.ended)

    def still(self) -> tuple[None, ...]:
        return (None,) * (self.total - self.k)

    def step(self, place: float, state: Value) -> Value:
        exact = map_cells(state, lambda cell: Cell(cell.v, None, cell.t))
        found = self.run(self.wide, self.wide_env, place, exact)
        if not self.k:
            return map_cells(found, lambda cell: self.next(cell, cell))
        off = self.run(self.plain, self.env, place, map_cells(state, self.off))
        others = iter(all_cells(off))
        return map_cells(found, lambda cell: self.next(cell, next(others)))

    def run(self, machine: Machine, env: Env, place: float, state: Value) -> Value:
        here = {**env, self.term.state: state, self.term.variable: Cell(place, None, (None,) * machine.directions)}
        with looked_through():
            return pad(machine.run(self.body, [here[name] for name in self.body.params], None), machine.directions)

    def off(self, cell: Cell) -> Cell:
        """A number that is off by as much as its samples say."""
        kept = (None,) * self.k if self.sampled else cell.et[: self.k]
        return Cell(cell.v, self.bound(cell, 0), cell.t[: self.k], kept)

    def next(self, cell: Cell, off: Cell) -> Cell:
        """A number whose samples have what its step rounded off in them: that of its value, and those of tangents."""
        t = list(cell.t)
        errors = [(cell.e, cell.v), *zip(off.et, cell.t, strict=False)][: 1 + self.sampled]
        for group, (error, size) in enumerate(errors):
            if error is None:
                continue
            for number, sign in enumerate(self.signs(error, 0.0 if size is None else size)):
                at = self.k + group * SAMPLES + number
                own = t[at]
                t[at] = sign * error if own is None else own + sign * error
        et = (None,) * self.k if self.sampled else off.et[: self.k]
        return Cell(cell.v, None, tuple(t), (*et, *self.still()))

    def signs(self, error: Any, size: Any) -> Sequence[Any]:
        shape = np.shape(error)
        random = np.where(self.random.random((SAMPLES - 2, *shape)) < 0.5, -1.0, 1.0)
        return [1.0, np.where(np.asarray(size) < 0, -1.0, 1.0), *(random if shape else map(float, random))]

    def bound(self, cell: Cell, group: int) -> Any:
        """How far off a number, or one of its tangents, is by its samples; None where there are none."""
        first = self.k + group * SAMPLES
        samples: list[Any] = [x for x in cell.t[first : first + SAMPLES] if x is not None]
        if not samples:
            return None
        steady = np.maximum(abs(samples[0]), abs(samples[1]))
        mean = np.sqrt(sum(x * x for x in samples[2:]) / (SAMPLES - 2))
        found = np.maximum(SAFE * steady, SAFE_RANDOM * mean)
        found = np.where(np.isnan(found), np.inf, found)
        return found if found.ndim else float(found)

    def ended(self, cell: Cell) -> Cell:
        et = cell.et[: self.k]
        if self.sampled:
            et = tuple(None if cell.t[d] is None else self.bound(cell, 1 + d) for d in range(self.k))
        return Cell(cell.v, self.bound(cell, 0), cell.t[: self.k], et)
