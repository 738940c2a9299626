"""Calls with numbers near those of before: from arguments to the answer with nothing in between but its rule.

Owns `AtOnce` and `at_once`. Where a call is nothing but an integral, and all about it is settled in the region where
its numbers lie (`integrate/fixed/a_priori.Settled`), the general way has nothing left to find out. What it told once
about such a call, it would tell again.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from msgspec import Struct
from msgspec.structs import asdict

from potto.core.terms import Lam, Term
from potto.integrate.costs import wanted
from potto.integrate.fixed.a_priori import Settled
from potto.kernels.cells import Cell, Value
from potto.projects.settings import Settings
from potto.runtime.answers.estimate import Estimate
from potto.runtime.evaluate import Clock, Program, stats_of
from potto.runtime.evaluation.machine import WATCHING, Machine
from potto.runtime.evaluation.record import Record, watched

# What is not the same when the same is asked again.
TIMES = {"seconds", "compile_seconds", "stats"}


class AtOnce(Struct, frozen=True, eq=False):
    """What a call, or its gradient, takes for numbers in a region.

    fixed: parameters of the integral that are no arguments. moving: for the others the argument, and tangents.
    """

    settings: Settings
    settled: Settled
    fixed: Mapping[str, Cell]
    moving: tuple[tuple[str, int, tuple[Any, ...], tuple[Any, ...]], ...]
    count: int
    stats: Mapping[str, Any]
    made: Callable[..., Estimate]
    wrt: tuple[str, ...]

    def answer(self, args: tuple[Any, ...], settings: Settings) -> Estimate | None:
        """The estimate; None where only the general way has it."""
        start = time.perf_counter()
        if len(args) != self.count or settings != self.settings or _looked_at():
            return None
        for arg in args:
            if arg.__class__ is not float:
                return None
        env = dict(self.fixed)
        for name, place, t, et in self.moving:
            env[name] = Cell(args[place], None, t, et)
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
    if direct is None or settled is None:
        return None
    fixed = {name: place for name, place in direct.places if isinstance(place, Cell)}
    own = [(name, place) for name, place in direct.places if isinstance(place, str)]
    moving = tuple((name, term.params.index(place), env[place].t, env[place].et) for name, place in own)
    k = machine.directions
    fixed = {name: Cell(cell.v, None, (None,) * k, (None,) * k) for name, cell in fixed.items()}
    with Clock() as clock:
        totals = settled.at({**fixed, **{name: env[place] for name, place in own}})
    if totals is None:
        return None
    stats = stats_of(Record(evaluations=totals.nodes, integrals=1), clock)
    kept = AtOnce(machine.settings, settled, fixed, moving, len(values), stats, type(found), wrt)
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
