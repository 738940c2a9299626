"""Calls with numbers near those of before: from arguments to the answer with nothing in between but its rule.

Owns `AtOnce` and `at_once`, and for batches `Together` and `together`. Where a call is nothing but an integral, or
arithmetic with some, and all about them is settled in the region where its numbers lie (`proved_sums/settled`), the
general way has nothing left to find out. What it told once about such a call, it would tell again. A batch of numbers
goes from its arrays to the integral, or to the kernel where there is none.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal

from msgspec import Struct
from msgspec.structs import asdict, replace

from potto.core.terms import Lam, Term
from potto.diagnostics import PottoError
from potto.integrate.costs import wanted
from potto.kernels.cells import Cell, Value, pad
from potto.projects.settings import Settings
from potto.python.arguments import LARGEST, LEAST, PATIENCE, Batch
from potto.python.arrays import is_batch, is_one, shape_together, with_axes, without_axes
from potto.python.following import followed
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
# Members of a batch without integrals that are done as one, if that takes no longer than so many seconds.
MOST_AT_ONCE, AT_ONCE = 1 << 18, 0.1


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

    def estimate(self, number: Sequence[Any], error: Sequence[Any], method: str, **told: Any) -> Estimate:
        """The estimate of a value and its tangents."""
        tangent: Any = None
        off: Any = None
        if self.dual or len(self.wrt) == 1:
            tangent, off = number[1], error[1]
        elif self.wrt:
            tangent, off = tuple(number[1:]), tuple(error[1:])
        if self.wrt and not self.dual:
            told["wrt"] = self.wrt
        return self.made(number[0], error[0], tangent, off, method=method, **told)


class AtOnce(PreparedCall, frozen=True, eq=False):
    """What a call takes for numbers in a region."""

    settled: SettledCall | SettledAround
    stats: Mapping[str, Any]

    def answer(self, args: tuple[Any, ...], settings: Settings) -> Estimate | None:
        """The estimate; None where only the general way has it. Arrays of one member cost what numbers cost."""
        start = time.perf_counter()
        if not self.asked(args, settings):
            return None
        env, axes = self._env(args)
        if env is None:
            numbers, axes = without_axes(args)
            env = self._env(numbers)[0] if axes else None
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
            parts, every = with_axes((*number, *error), axes), with_axes((True,), axes)[0]
            number, error = parts[: len(number)], parts[len(number) :]
        return self.estimate(number, error, "quadrature", evals=found.nodes, seconds=time.perf_counter() - start,
                             stats=dict(self.stats), member_converged=every)  # fmt: skip

    def _env(self, args: tuple[Any, ...]) -> tuple[dict[str, Cell] | None, int]:
        """The numbers as the integral takes them, and how many axes they have; None where one is of another kind than
        those of before."""
        env: dict[str, Cell] = {}
        axes = 0
        for read, arg in zip(self.reads, args, strict=True):
            if arg.__class__ is float and read.kind == "number":  # as most are
                env[read.name] = Cell(arg, None, read.t, read.et)
                continue
            if read.kind == "number" and is_one(arg):
                axes, arg = max(axes, arg.ndim), arg.item()
            value = read.of(arg)
            if value is None:
                return None, 0
            env[read.name] = value
        return env, axes


class Kernels(Struct, frozen=True, eq=False):
    """A call that is no integral, nor computed of some, for numbers and batches of them."""

    program: Program
    body: Term
    machine: Machine

    def at(self, env: dict[str, Value]) -> tuple[Value | None, Machine]:
        """The value with its tangents, None where it has two derivatives; and the machine that knows what was met.
        Raises PottoError."""
        machine = unused(self.machine)
        value = self.program.value(machine, self.body, env)
        return None if machine.record.edges else pad(value, machine.directions), machine


class Together(PreparedCall, frozen=True, eq=False):
    """What a call takes for a batch of numbers, or for some. most: members that are likely to be done soon."""

    batches: Batches | Kernels
    least: int
    most: int

    def answer(self, args: tuple[Any, ...], settings: Settings) -> Estimate | None:
        """As of `AtOnce`, for arrays that make a batch that is not done in tiles, of several members where these are
        integrals."""
        batch = Batch(shape_together(args))
        if not self.least <= batch.size <= self.most or not self.asked(args, settings):
            return None
        env = self._env(args, batch)
        if env is None:
            return None
        try:
            with followed(), Clock() as clock:
                value, machine = self.batches.at(env)
        except (PottoError, RecursionError):  # the general way says what is wrong, and where
            return None
        return self._told(value, machine, clock, batch) if isinstance(value, Cell) else None

    def _told(self, cell: Cell, machine: Machine, clock: Clock, batch: Batch) -> Estimate:
        """The estimate of an integral; whether it is what was asked for needs no thought where each number is."""
        record, sides = machine.record, ((cell.v, *cell.t), (cell.e, *cell.et))
        parts = [(number(x), number(e)) for x, e in zip(*sides, strict=True)]
        plain = not (machine.events or record.edges or record.shortfalls)
        if plain and all(precise(x, e, self.settings.rtol) for x, e in parts):
            numbers, errors = ([batch.restored(x) for x in side] for side in zip(*parts, strict=True))
            return self.estimate(
                numbers, errors, "+".join(sorted(record.methods)) or "exact", evals=record.evaluations,
                seconds=clock.seconds, compile_seconds=clock.spent, plan_seconds=clock.planning,
                stats=stats_of(record, clock), member_converged=None if batch.shape is None else batch.everybody,
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
                if batch.shape is None or read.kind != "number" or arg.dtype.kind not in "fiu":
                    return None
                env[read.name] = Cell(batch.row(arg), None, read.t, read.et)
                continue
            value = read.of(arg)
            if value is None:
                return None
            env[read.name] = value
        return env


def together(
    program: Program, term: Lam, values: Sequence[Value], machine: Machine, found: Estimate, wrt: tuple[str, ...]
) -> Together | None:
    """What a call over a batch takes that has just been answered, or with numbers if it is no integral; as of
    `at_once`."""
    if _looked_at() or machine.taping or found.notes or (found.tangent is not None and not wrt):
        return None
    reads = [_read(name, None, value, False) for name, value in zip(term.params, values, strict=True)]
    direct, size = program.shortest(term.body), getattr(found.value, "size", 1)
    batches: Batches | Kernels | None = None
    if isinstance(direct, Direct) and size > 1:
        batches = direct.batches(unused(machine), dict(zip(term.params, values, strict=True)))
    elif direct is None and (size > 1 or found.value.__class__ is float or is_one(found.value)):
        batches = Kernels(program, term.body, machine)
    if batches is None or None in reads:
        return None
    soon, largest = (PATIENCE, LEAST - 1) if found.stats["integrals"] else (AT_ONCE, MOST_AT_ONCE)
    most = min(largest, int(size * soon / max(found.seconds - found.compile_seconds, 1e-6)))
    known = tuple(read for read in reads if read is not None)
    return Together(machine.settings, known, type(found), wrt, False, batches, 2 if direct else 1, most)


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
