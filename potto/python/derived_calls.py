"""Calls of functions with derivatives: in reverse by many parameters, forward by few, both with their errors.

Owns `DerivedCall` and `gradient`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from msgspec.structs import asdict, replace

from potto.integrate.pieces import resting
from potto.kernels.cells import Cell, Value, all_cells, map_cells, pad
from potto.kernels.chunks import POINTS
from potto.kernels.errors import wrong_call
from potto.kernels.sweeps import Swept, swept
from potto.kernels.tape import Node, Untaped
from potto.projects.settings import current
from potto.python.arguments import LEAST, Batch, value_of
from potto.python.arrays import with_axes
from potto.python.calls import Call
from potto.python.derivative_forms import by_name, in_lists, must_match, weighted
from potto.python.following import followed
from potto.python.moving import each_moving, own, size, with_own, with_places
from potto.python.sided import with_sides
from potto.python.slopes import Gradient
from potto.runtime.answers.estimate import Estimate
from potto.runtime.answers.records import named
from potto.runtime.evaluate import Clock, bar, number, report, told
from potto.runtime.evaluation.derivatives.sides import as_a_whole
from potto.runtime.evaluation.machine import Machine
from potto.runtime.evaluation.record import Record
from potto.types.types import REAL

# Parameters, from which on a tape is swept back instead of carrying a tangent for each: it costs 2.5 to 3.4 values
# whatever their number, tangents 1.6 at 4 and, where all depends on all, 2.7 at 12 and 4.8 at 64; the first call costs
# half as much from 8 on (`benchmarks/gradients.py ways`). What integrals carry is the same either way.
MANY = 12
SWEEP = 6  # tangents that cost what a sweep does, of which each number of an answer takes one
NOTHING: Swept = (None, None)


def gradient(call: Call, arguments: Sequence[tuple[str, Value]], wrt: tuple[str, ...], batch: Batch) -> Gradient:
    """The estimate of a call with its derivatives by the arguments named in `wrt`, for all of a batch at once."""
    run = DerivedCall(call, arguments, batch, {})
    value = run.along_each(wrt)
    found = run.gradient(value, value, wrt)
    if batch.size < LEAST:
        run.keep(found, wrt)
    return found


class DerivedCall:
    """A call of a function on its way to derivatives. extra: values that broadcast with the arguments."""

    def __init__(
        self, call: Call, arguments: Sequence[tuple[str, Value]], batch: Batch, extra: Mapping[str, Any]
    ) -> None:
        self.call, self.arguments, self.batch = call, arguments, batch
        self.given = dict(arguments)
        self.extra = {name: value_of(name, item, batch, lambda _: None) for name, item in extra.items()}
        self.machine = self._machine()
        self.clock = Clock()
        self.moved: tuple[Sequence[Value], Machine] = (), self.machine  # what was evaluated last, and by what
        self.whole = False  # whether derivatives by all elements of an array are one array, as a tape gives them

    def _machine(self) -> Machine:
        world = self.call.world
        return world.program.machine(current(world.settings(self.call.file)))

    def along_each(self, wrt: tuple[str, ...]) -> Value:
        """The value, with a tangent for each number of the parameters named."""

        directions = sum(size(name, value) for name, value in self.own(*wrt).items())

        def swept_back(value: Value, seeds: Sequence[Node]) -> Value:
            if len(all_cells(value)) * SWEEP > max(directions, SWEEP):
                raise Untaped
            return map_cells(value, lambda cell: Cell(cell.v, cell.e, *_swept([(cell, 1.0)], seeds)))

        return self._differentiated(wrt, swept_back, lambda value: value)

    def along_each_together(self, wrt: tuple[str, ...], weights: Value) -> tuple[Value, Value]:
        """The value, and the sum of its numbers, each times its weight, with such tangents."""

        def swept_back(value: Value, seeds: Sequence[Node]) -> Value:
            must_match(value, weights)
            pairs = zip(all_cells(value), (weight.v for weight in all_cells(weights)), strict=True)
            return resting(value), Cell(0.0, None, *_swept(list(pairs), seeds))

        def forward(value: Value) -> Value:
            must_match(value, weights)
            return value, weighted(value, weights)

        found = self._differentiated(wrt, swept_back, forward)
        assert isinstance(found, tuple)
        return found[0], found[1]

    def _differentiated(
        self, wrt: tuple[str, ...], swept_back: Callable[[Value, Sequence[Node]], Value],
        forward: Callable[[Value], Value],
    ) -> Value:  # fmt: skip
        """What one of these makes of the value: of a tape with its seeds, or of tangents."""
        own = self.own(*wrt)
        directions = sum(size(name, value) for name, value in own.items())
        shape = () if self.batch.shape is None else (max(1, int(np.prod(self.batch.shape))),)
        small = np.prod(shape) <= POINTS  # a tape keeps arrays for all operations
        if directions >= MANY and small:
            try:
                return self._taped(own, shape, swept_back, forward)
            except Untaped:
                self.machine, self.whole = self._machine(), False
        numbers = iter(range(directions))
        moving = {name: each_moving(value, numbers, directions) for name, value in own.items()}
        found = self.evaluated(moving, self.machine.with_directions(directions), forward)
        if directions == len(own) or directions >= MANY or not small or not _nowhere(found):
            return found
        # Elements that stand still where a slope is infinite: of infinity times 0 a tape knows nothing.
        machine, self.machine = self.machine, self._machine()
        try:
            return self._taped(own, shape, swept_back, forward)
        except Untaped:
            self.machine, self.whole = machine, False
            return found

    def _taped(
        self, own: dict[str, Value], shape: tuple[int, ...], swept_back: Callable[[Value, Sequence[Node]], Value],
        forward: Callable[[Value], Value],
    ) -> Value:  # fmt: skip
        """The value with what its tape, swept back, has for each number. Raises Untaped."""
        seeds: list[Any] = []

        def seeded(cell: Cell, places: tuple[int, ...]) -> Cell:
            seeds.append(Node((), (*places, *shape)))
            return Cell(cell.v, cell.e, (seeds[-1],))

        moving = {name: with_places(value, (), seeded) for name, value in own.items()}
        self.whole = True
        found = self.evaluated(moving, self.machine.taped(), lambda value: swept_back(value, seeds))
        return found if not self.machine.record.edges else self._with_sides(found, own, seeds, forward)

    def _with_sides(
        self, found: Value, own: dict[str, Value], seeds: Sequence[Node], forward: Callable[[Value], Value]
    ) -> Value:
        def run(moving: dict[str, Value], directions: int) -> tuple[Value, Record]:
            machine = self._machine().with_directions(directions)
            return self.evaluated(moving, machine, forward), machine.record

        return with_sides(found, self.machine.record, own, seeds, run)

    def evaluated(self, moving: Mapping[str, Value], machine: Machine, ended: Callable[[Value], Value]) -> Value:
        """What `ended` makes of the value that this machine finds where these parameters move."""
        k = machine.directions
        values = [pad(with_own(name, value, moving), k) for name, value in self.arguments]
        self.moved = values, machine
        with followed(), self.clock:
            machine.record.follow()
            value = in_lists(as_a_whole(machine, self.call.elaborated, tuple(values), self.called))
            if not _numbers(value):
                raise wrong_call("only a number or a tuple of numbers has a gradient")
            with np.errstate(all="ignore"):
                return ended(pad(value, k))

    def called(self, machine: Machine, values: Value) -> Value:
        assert isinstance(values, tuple)
        return self.call.value(values, machine)

    def own(self, *names: str) -> dict[str, Value]:
        """What is differentiated by, as it is given. Raises PottoError if that is nothing."""
        return {name: own(name, self.given) for name in names}

    def keep(self, found: Estimate, wrt: tuple[str, ...]) -> None:
        """Keep what answers a call of this kind at once, if anything does."""
        values, machine = self.moved
        if all(isinstance(value, Cell) for value in values) and not (self.whole and self.batch.shape is not None):
            args: list[Any] = [value.v for value in values]  # type: ignore[union-attr]
            if self.batch.shape is not None and self.batch.size == 1:  # as they were given, and as what was found is
                args = with_axes(args, len(self.batch.shape))
            self.call.keep(args, values, found, wrt, machine)

    def answer(self, value: Value, tangents: Any, bounds: Any) -> Estimate:
        return self._with(report(value, self.machine, self.clock), tangents, bounds)

    def _with(self, found: Estimate, tangents: Any, bounds: Any, own: bool = False) -> Estimate:
        shaped = self.batch.shaped(replace(found, tangent=tangents, tangent_error=bounds), own)
        return replace(shaped, value=named(shaped.value, self.call.result))

    def one_by_one(self, slopes: list[Any], names: tuple[str, ...]) -> tuple[Any, ...]:
        """The derivatives by each number of the parameters, those of an array element by element."""

        def flat(form: Any) -> list[Any]:
            return [x for item in form for x in flat(item)] if isinstance(form, tuple | list) else [form]

        return tuple(flat(by_name(slopes, self.own(*names), self.whole)))

    def gradient(self, value: Value, moving: Value, wrt: tuple[str, ...]) -> Gradient:
        """The estimate of a value, with the derivatives of `moving` in the form of the parameters."""
        own = self.own(*wrt)
        directions = range(len(all_cells(tuple(own.values()))) if self.whole
                           else sum(size(name, value) for name, value in own.items()))  # fmt: skip
        form = self.call.result if moving is value else REAL
        found = report(value, self.machine, self.clock)
        known = number if moving is value and found.converged else bar  # of what has converged no error is nan
        tangents = [named(told(moving, lambda cell, d=d: cell.t[d]), form) for d in directions]  # type: ignore[misc]
        bounds = [told(moving, lambda cell, d=d: known(cell.et[d])) for d in directions]  # type: ignore[misc]
        forms = (by_name(part, own, self.whole) for part in (tangents, bounds))
        tangent, off = (form[0] if len(wrt) == 1 else form for form in forms)
        found = self._with(found, tangent, off, moving is value and self.machine.record.fresh)
        return Gradient(**asdict(found), wrt=wrt)


def _swept(answers: Sequence[tuple[Cell, Any]], seeds: Sequence[Node]) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """The derivatives by the seeds of a sum of answers, each times a weight, and how far off they may be."""
    nodes: list[tuple[Any, Any]] = [(cell.t[0], weight) for cell, weight in answers]
    found = swept([(node, weight) for node, weight in nodes if isinstance(node, Node)])
    return tuple(found.get(seed, NOTHING)[0] for seed in seeds), tuple(found.get(seed, NOTHING)[1] for seed in seeds)


def _nowhere(value: Value) -> bool:
    """Whether a number has derivatives that are none."""
    return any(np.any(np.isfinite(cell.v) & np.isnan(x)) for cell in all_cells(value) for x in cell.t if x is not None)


def _numbers(value: Value) -> bool:
    return isinstance(value, Cell) or (isinstance(value, tuple | list) and all(map(_numbers, value)))
