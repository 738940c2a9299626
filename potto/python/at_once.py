"""Calls with numbers near those of before: from arguments to the answer with nothing in between but its rule.

Owns `AtOnce` and `at_once`. Where a call is nothing but an integral, or arithmetic with some, and all about them is
settled in the region where its numbers lie (`integrate/fixed/a_priori.Settled`), the general way has nothing left to
find out. What it told once about such a call, it would tell again.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal

from msgspec import Struct
from msgspec.structs import asdict, replace

from potto.core.terms import Lam
from potto.integrate.costs import wanted
from potto.kernels.cells import Cell, Value
from potto.projects.settings import Settings
from potto.python.arguments import LARGEST, with_axes, without_axes
from potto.runtime.answers.estimate import Estimate
from potto.runtime.evaluate import Clock, Program, stats_of
from potto.runtime.evaluation.duals import merge
from potto.runtime.evaluation.functions import Closure
from potto.runtime.evaluation.machine import WATCHING, Machine
from potto.runtime.evaluation.record import Record, watched
from potto.runtime.integration.direct import Direct, SettledAround, SettledCall

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


class AtOnce(Struct, frozen=True, eq=False):
    """What a call, or its gradient, takes for numbers in a region."""

    settings: Settings
    settled: SettledCall | SettledAround
    reads: tuple[Read, ...]
    stats: Mapping[str, Any]
    made: Callable[..., Estimate]
    wrt: tuple[str, ...]
    dual: bool

    def answer(self, args: tuple[Any, ...], settings: Settings) -> Estimate | None:
        """The estimate; None where only the general way has it. Arrays of one member cost what numbers cost."""
        start = time.perf_counter()
        if len(args) != len(self.reads) or settings != self.settings or _looked_at():
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
            if not e <= rtol * abs(x):
                return None
        every: Any = None
        if axes:
            number, error, every = with_axes(number, axes), with_axes(error, axes), with_axes((True,), axes)[0]
        more: dict[str, Any] = {}
        if self.dual or self.wrt:
            one = self.dual or len(self.wrt) == 1
            tangent, off = (number[1], error[1]) if one else (tuple(number[1:]), tuple(error[1:]))
            more = {"tangent": tangent, "tangent_error": off}
        if self.wrt and not self.dual:
            more["wrt"] = self.wrt
        return self.made(
            number[0], error[0], evals=found.nodes, seconds=time.perf_counter() - start, method="quadrature",
            stats=dict(self.stats), member_converged=every, **more,
        )  # fmt: skip

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
    read = [_read(name, arg, value, dual) for name, arg, value in zip(term.params, args, values, strict=True)]
    reads = tuple(each for each in read if each is not None)
    if direct is None or len(reads) != len(read):
        return None
    given = {each.name: each.of(arg) for each, arg in zip(reads, args, strict=True)}
    settled = direct.settled(_clean(machine), dict(zip(term.params, values, strict=True)))
    if settled is None or any(value is None for value in given.values()):
        return None
    with Clock() as clock:
        totals = settled.at(given)
    if totals is None:
        return None
    stats = stats_of(Record(evaluations=totals.nodes, integrals=found.stats["integrals"]), clock)
    kept = AtOnce(machine.settings, settled, reads, stats, type(found), wrt, dual)
    again = kept.answer(args, machine.settings)
    return kept if again is not None and _told(again) == _told(found) else None


def _read(name: str, arg: Any, value: Value, dual: bool) -> Read | None:
    """What an argument is like; None if it is nothing of that kind."""
    if isinstance(value, Closure):
        known = getattr(arg, "_value", None)
        return None if known is None else Read(name, "function", part=known())
    moving = merge(value) if dual and not isinstance(value, list) else value
    if type(moving) is not Cell or moving.v.__class__ is not float or moving.e is not None or any(moving.et):
        return None
    if isinstance(value, tuple):
        return Read(name, "dual", moving.t, moving.et, arg[1]) if arg.__class__ is tuple else None
    return Read(name, "number", moving.t, moving.et)


def _clean(machine: Machine) -> Machine:
    """The machine without what a call has left in it."""
    return machine.apart().changed(record=Record())


def _looked_at() -> bool:
    """Whether anyone wants to know more of a call than its answer."""
    return watched() or wanted() or WATCHING.get() is not None


def _told(found: Estimate) -> dict[str, Any]:
    return {name: part for name, part in asdict(found).items() if name not in TIMES}
