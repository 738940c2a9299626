"""Calls with numbers near those of before: from arguments to the answer with nothing in between but its rule.

Owns `AtOnce` and `at_once`, and for batches `Together` and `together`. Where a call is nothing but an integral, or
arithmetic with some, and all about them is settled in the region where its numbers lie (`proved_sums/settled`), the
general way has nothing left to find out. What it told once about such a call, it would tell again. A batch of numbers
goes from its arrays to the integral.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal

from msgspec import Struct
from msgspec.structs import asdict, replace

from potto.core.terms import Lam
from potto.diagnostics import PottoError
from potto.integrate.costs import wanted
from potto.kernels.cells import Cell, Value
from potto.projects.settings import Settings
from potto.python.arguments import LARGEST, LEAST, PATIENCE, Batch, with_axes, without_axes
from potto.python.arrays import is_batch, shape_together
from potto.runtime.answers.convergence import precise
from potto.runtime.answers.estimate import Estimate
from potto.runtime.evaluate import Clock, Program, bar, number, report, stats_of
from potto.runtime.evaluation.derivatives.duals import merge
from potto.runtime.evaluation.functions import Closure
from potto.runtime.evaluation.machine import WATCHING, Machine
from potto.runtime.evaluation.record import Record
from potto.runtime.integration.direct import Direct, SettledAround
from potto.runtime.integration.settled_calls import Batches, SettledCall, unused

# What is not the same when the same is asked again.
TIMES = {"seconds", "compile_seconds", "plan_seconds", "stats"}
NUMBERS = float, int


class Read(Struct, frozen=True, eq=False):
    """What an argument is like: a number, with these tangents; a dual, whose tangent is `part`; or a function, whose
    value is `part`."""

    name: str
    kind: Literal["number", "dual", "function"]
    t: tuple[Any, ...] = ()
    et: tuple[Any, ...] = ()
    part: Any = None

    def of(self, arg: Any) -> Any:
        """The argument as the integral takes it; None if it is of another kind."""
        if self.kind == "function":
            known = getattr(arg, "_value", None)
            value = None if known is None else known()
            if value is None or value is self.part:
                return value
            alike = type(value) is type(self.part) is Closure and value.lam is self.part.lam and not value.captured
            return value if alike else None
        if self.kind == "dual":
            if arg.__class__ is not tuple or len(arg) != 2 or arg[1].__class__ not in NUMBERS or arg[1] != self.part:
                return None
            arg = arg[0]
        if arg.__class__ is not float:
            if not isinstance(arg, float) and (arg.__class__ is not int or abs(arg) > LARGEST):
                return None
            arg = float(arg)
        return Cell(arg, None, self.t, self.et)


class PreparedCall(Struct, frozen=True, eq=False):
    """What is known of a call, or of its gradient: how its numbers are asked for, what its arguments are like, and how
    its estimate is made."""

    settings: Settings
    reads: tuple[Read, ...]
    made: Callable[..., Estimate]
    wrt: tuple[str, ...]
    dual: bool

    def asked(self, args: tuple[Any, ...], settings: Settings) -> bool:
        """Whether such a call is asked for, and no more than its answer."""
        same = settings is self.settings or settings == self.settings
        return same and len(args) == len(self.reads) and not _looked_at()

    def estimate(self, number: Sequence[Any], error: Sequence[Any], **told: Any) -> Estimate:
        """The estimate of a value and its tangents."""
        tangent: Any = None
        off: Any = None
        if self.dual or len(self.wrt) == 1:
            tangent, off = number[1], error[1]
        elif self.wrt:
            tangent, off = tuple(number[1:]), tuple(error[1:])
        if self.wrt and not self.dual:
            told["wrt"] = self.wrt
        return self.made(number[0], error[0], tangent, off, method="quadrature", **told)


class AtOnce(PreparedCall, frozen=True, eq=False):
    """What a call takes for numbers in a region."""

    settled: SettledCall | SettledAround
    stats: Mapping[str, Any]

    def answer(self, args: tuple[Any, ...], settings: Settings) -> Estimate | None:
        """The estimate; None where only the general way has it. Arrays of one member cost what numbers cost."""
        start = time.perf_counter()
        if not self.asked(args, settings):
            return None
        env, axes = self._env(args), 0
        if env is None:
            numbers, axes = without_axes(args)
            env = self._env(numbers) if axes else None
        found = None if env is None else self.settled.at(env)
        if found is None:
            return None
        number: Sequence[Any] = found.number
        error: Sequence[Any] = found.error
        rtol = settings.rtol
        for x, e in zip(number, error, strict=True):
            if not e <= rtol * abs(x) < math.inf:
                return None
        every: Any = None
        if axes:
            number, error, every = with_axes(number, axes), with_axes(error, axes), with_axes((True,), axes)[0]
        return self.estimate(number, error, evals=found.nodes, seconds=time.perf_counter() - start,
                             stats=dict(self.stats), member_converged=every)  # fmt: skip

    def _env(self, args: tuple[Any, ...]) -> dict[str, Cell] | None:
        """The numbers as the integral takes them; None where one is of another kind than those of before."""
        env: dict[str, Cell] = {}
        for read, arg in zip(self.reads, args, strict=True):
            if arg.__class__ is float and read.kind == "number":  # as most are
                env[read.name] = Cell(arg, None, read.t, read.et)
                continue
            value = read.of(arg)
            if value is None:
                return None
            env[read.name] = value
        return env


class Together(PreparedCall, frozen=True, eq=False):
    """What a call takes for a batch of numbers. most: members of one that is likely to be done soon."""

    batches: Batches
    most: int

    def answer(self, args: tuple[Any, ...], settings: Settings) -> Estimate | None:
        """As of `AtOnce`, for arrays that make a batch of several members that is not done in tiles."""
        shape = shape_together(args)
        if shape is None or not self.asked(args, settings):
            return None
        batch = Batch(shape)
        env = self._env(args, batch) if 1 < batch.size <= self.most else None
        if env is None:
            return None
        try:
            with Clock() as clock:
                value, machine = self.batches.at(env)
        except (PottoError, RecursionError):  # the general way says what is wrong, and where
            return None
        return self._told(value, machine, clock, batch) if isinstance(value, Cell) else None

    def _told(self, cell: Cell, machine: Machine, clock: Clock, batch: Batch) -> Estimate:
        """The estimate of an integral; whether it is what was asked for needs no thought where each number is."""
        record, parts = machine.record, list(zip((cell.v, *cell.t), (cell.e, *cell.et), strict=True))
        plain = not (machine.events or record.edges or record.shortfalls)
        if plain and all(precise(x, e, self.settings.rtol) for x, e in parts):
            numbers, errors = ([batch.restored(x) for x in side] for side in zip(*parts, strict=True))
            return self.estimate(
                numbers, errors, evals=record.evaluations, seconds=clock.seconds, compile_seconds=clock.spent,
                plan_seconds=clock.planning, stats=stats_of(record, clock),
                member_converged=batch.everybody,
            )  # fmt: skip
        found = report(cell, machine, clock)
        if not self.wrt:
            return batch.shaped(found)
        tangents = tuple(number(x) for x, _ in parts[1:]), tuple(number(bar(e)) for _, e in parts[1:])
        tangent, off = (side[0] if len(self.wrt) == 1 else side for side in tangents)
        found = replace(found, tangent=tangent, tangent_error=off)
        return self.made(**asdict(batch.shaped(found)), wrt=self.wrt)

    def _env(self, args: tuple[Any, ...], batch: Batch) -> dict[str, Value] | None:
        env: dict[str, Value] = {}
        for read, arg in zip(self.reads, args, strict=True):
            if is_batch(arg):
                if read.kind != "number" or arg.dtype.kind not in "fiu":
                    return None
                env[read.name] = Cell(batch.flat(arg.astype(float)), None, read.t, read.et)
                continue
            value = read.of(arg)
            if value is None:
                return None
            env[read.name] = value
        return env


def together(
    program: Program, term: Lam, values: Sequence[Value], machine: Machine, found: Estimate, wrt: tuple[str, ...]
) -> Together | None:
    """What a call over a batch takes that has just been answered; as of `at_once`."""
    direct = program.shortest(term.body)
    if not isinstance(direct, Direct) or _looked_at():
        return None
    reads = [_read(name, None, value, False) for name, value in zip(term.params, values, strict=True)]
    batches = direct.batches(unused(machine), dict(zip(term.params, values, strict=True)))
    if batches is None or None in reads:
        return None
    spent = max(found.seconds - found.compile_seconds, 1e-6)
    most = min(LEAST - 1, max(found.value.size, int(found.value.size * PATIENCE / spent)))
    known = tuple(read for read in reads if read is not None)
    return Together(machine.settings, known, type(found), wrt, False, batches, most)


def at_once(
    program: Program, term: Lam, args: tuple[Any, ...], values: Sequence[Value], machine: Machine, found: Estimate,
    wrt: tuple[str, ...],
) -> AtOnce | None:  # fmt: skip
    """What a call takes that has just been answered, for numbers near these; None where the general way is needed.

    args, values: the arguments, as they were given, and with their tangents. machine: that for this many tangents.
    found: the answer, by `wrt`; over a batch, if that has one member.
    """
    args, axes = without_axes(args)
    if axes:
        parts = without_axes((found.value, found.error, found.tangent, found.tangent_error))[0]
        value, error, tangent, tangent_error = parts
        found = replace(found, value=value, error=error, tangent=tangent, tangent_error=tangent_error,
                        member_converged=None)  # fmt: skip
    if not len(term.params) == len(values) == len(args) or not found.converged or _looked_at():
        return None
    direct = program.shortest(term.body)
    dual = isinstance(direct, Direct) and direct.dual
    plain = [Cell(value.v, value.e) if machine.taping and isinstance(value, Cell) else value for value in values]
    read = [_read(name, arg, value, dual) for name, arg, value in zip(term.params, args, plain, strict=True)]
    reads = tuple(each for each in read if each is not None)
    if direct is None or len(reads) != len(read):
        return None
    given = {each.name: each.of(arg) for each, arg in zip(reads, args, strict=True)}
    settled = direct.settled(unused(machine), dict(zip(term.params, values, strict=True)))
    if settled is None or any(value is None for value in given.values()):
        return None
    kept = AtOnce(machine.settings, reads, type(found), wrt, dual, settled, {})
    with Clock() as clock:
        again = kept.answer(args, machine.settings)
    if again is None or _told(again) != _told(found):
        return None
    return replace(kept, stats=stats_of(Record(evaluations=again.evals, integrals=found.stats["integrals"]), clock))


def _read(name: str, arg: Any, value: Value, dual: bool) -> Read | None:
    """What an argument is like; None if it is nothing of that kind."""
    if isinstance(value, Closure):
        known = getattr(arg, "_value", None)
        return None if known is None else Read(name, "function", part=known())
    moving = merge(value) if dual and not isinstance(value, list) else value
    if type(moving) is not Cell or moving.e is not None or any(moving.et) or Cell(0.0, None, moving.t).arrays():
        return None
    if isinstance(value, tuple):
        return Read(name, "dual", moving.t, moving.et, arg[1]) if arg.__class__ is tuple else None
    return Read(name, "number", moving.t, moving.et)


def _looked_at() -> bool:
    """Whether anyone wants to know more of a call than its answer."""
    return wanted() or WATCHING.get() is not None


def _told(found: Estimate) -> dict[str, Any]:
    return {name: part for name, part in asdict(found).items() if name not in TIMES}
