"""Calls with numbers near those of before: from arguments to the answer with nothing in between but its rule.

Owns `AtOnce` and `at_once`. Where a call is nothing but an integral, or arithmetic with some, and all about them is
settled in the region where its numbers lie (`integrate/fixed/a_priori.Settled`), the general way has nothing left to
find out. What it told once about such a call, it would tell again.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from msgspec import Struct
from msgspec.structs import asdict

from potto.core.terms import Lam, Term
from potto.integrate.costs import wanted
from potto.kernels.cells import Cell, Value
from potto.projects.settings import Settings
from potto.python.arguments import LARGEST
from potto.runtime.answers.estimate import Estimate
from potto.runtime.evaluate import Clock, Program, stats_of
from potto.runtime.evaluation.machine import WATCHING, Machine
from potto.runtime.evaluation.record import Record, watched
from potto.runtime.integration.direct import SettledAround, SettledCall

# What is not the same when the same is asked again.
TIMES = {"seconds", "compile_seconds", "stats"}


class AtOnce(Struct, frozen=True, eq=False):
    """What a call, or its gradient, takes for numbers in a region. tangents: of each argument, and their errors."""

    settings: Settings
    settled: SettledCall | SettledAround
    tangents: tuple[tuple[str, tuple[Any, ...], tuple[Any, ...]], ...]
    stats: Mapping[str, Any]
    made: Callable[..., Estimate]
    wrt: tuple[str, ...]

    def answer(self, args: tuple[Any, ...], settings: Settings) -> Estimate | None:
        """The estimate; None where only the general way has it."""
        start = time.perf_counter()
        if len(args) != len(self.tangents) or settings != self.settings or _looked_at():
            return None
        env: dict[str, Cell] = {}
        for (name, t, et), arg in zip(self.tangents, args, strict=True):
            if arg.__class__ is not float:
                if not isinstance(arg, float) and (arg.__class__ is not int or abs(arg) > LARGEST):
                    return None
                arg = float(arg)
            env[name] = Cell(arg, None, t, et)
        found = self.settled.at(env)
        if found is None:
            return None
        number, error, rtol = found.number, found.error, settings.rtol
        for x, e in zip(number, error, strict=True):
            if not e <= rtol * abs(x):
                return None
        first: tuple[Any, ...] = (None, None)
        rest: tuple[Any, ...] = ()
        if self.wrt:
            one = len(self.wrt) == 1
            first = (number[1], error[1]) if one else (tuple(number[1:]), tuple(error[1:]))
            rest = (self.wrt,)
        seconds = time.perf_counter() - start
        return self.made(number[0], error[0], *first, True, found.nodes, seconds, 0.0, "quadrature", (),
                         dict(self.stats), None, None, {}, *rest)  # fmt: skip


def at_once(
    program: Program, term: Term, values: Sequence[Value], machine: Machine, found: Estimate, wrt: tuple[str, ...]
) -> AtOnce | None:
    """What a call takes that has just been answered, for numbers near these; None where the general way is needed.

    values: of the arguments, with their tangents. machine: that for this many tangents. found: the answer, by `wrt`.
    """
    assert isinstance(term, Lam)
    cells = [value for value in values if type(value) is Cell and value.v.__class__ is float and value.e is None]
    if len(cells) != len(values) or len(term.params) != len(values) or not found.converged or _looked_at():
        return None
    env = dict(zip(term.params, cells, strict=True))
    direct = program.shortest(term.body)
    settled = None if direct is None else direct.settled(_clean(machine), env)
    if settled is None:
        return None
    with Clock() as clock:
        totals = settled.at(env)
    if totals is None:
        return None
    integrals = found.stats["integrals"]
    stats = stats_of(Record(evaluations=totals.nodes, integrals=integrals), clock)
    tangents = tuple((name, cell.t, cell.et) for name, cell in env.items())
    kept = AtOnce(machine.settings, settled, tangents, stats, type(found), wrt)
    again = kept.answer(tuple([cell.v for cell in cells]), machine.settings)
    return kept if again is not None and _told(again) == _told(found) else None


def _clean(machine: Machine) -> Machine:
    """The machine without what a call has left in it."""
    return machine.apart().changed(record=Record())


def _looked_at() -> bool:
    """Whether anyone wants to know more of a call than its answer."""
    return watched() or wanted() or WATCHING.get() is not None


def _told(found: Estimate) -> dict[str, Any]:
    return {name: part for name, part in asdict(found).items() if name not in TIMES}
