"""Evaluating a program: from a term (or a function and numbers) to an `Estimate`.

Owns `evaluate` and `Program`. A program keeps its linker, so that definitions are looked up and constants computed
once; every evaluation has record of its own.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from msgspec.structs import replace

from potto.calculus.surfaces.discontinuities import TooDeep
from potto.core.printer import format_equation, shortened
from potto.core.terms import Data, Fold, Integral, Sum, Term
from potto.diagnostics import PottoError, Related
from potto.integrate.events import BOUNDLESS, INFINITE, NO_VALUE, NOT_A_NUMBER, ROUGH, STEEP, Shortfall
from potto.kernels import errors
from potto.kernels.cells import Cell, Number, Rows, Value, all_cells
from potto.kernels.making import counts
from potto.projects.settings import DEFAULTS, SAMPLERS, Settings
from potto.runtime.answers.convergence import (
    Rough,
    Shortfalls,
    converged_members,
    members_of,
    merged,
    missed,
    rough_of,
    steep,
)
from potto.runtime.answers.estimate import Estimate, OneSided
from potto.runtime.answers.inherited_errors import rough, widened
from potto.runtime.evaluation.arrays import array, element, length
from potto.runtime.evaluation.derivatives.duals import call_derivative, call_paired
from potto.runtime.evaluation.derivatives.kinks import note_kink
from potto.runtime.evaluation.few_members import told_alone
from potto.runtime.evaluation.functions import Closure, Derivative
from potto.runtime.evaluation.linker import Linker, Named
from potto.runtime.evaluation.machine import Machine, Semantics
from potto.runtime.evaluation.record import BOXES_FOR_EVALUATIONS, Record
from potto.runtime.evaluation.selection import chosen, lazy
from potto.runtime.evaluation.sums import total

if TYPE_CHECKING:
    from potto.runtime.integration.direct import Around, Direct

Lookup = Callable[[str, str], Term]
# Where in one of these definitions something was met that was evaluated, innermost first.
Places = Callable[[Sequence[object], Mapping[tuple[str, str], Term]], Related | None]
V = TypeVar("V")


def _integral(machine: Machine, term: Integral, env: dict[str, Value]) -> Value:
    from potto.runtime.integration.driver import integral  # loaded with the first integral: a prompt is there before

    return integral(machine, term, env)


def _loaded(term: Data) -> Value:
    from potto.runtime.evaluation.loading import loaded

    return loaded(term)


def _fold(machine: Machine, term: Fold, lo: Value, hi: Value, start: Value, env: dict[str, Value]) -> Value:
    from potto.runtime.evaluation.folds.folds import fold

    return fold(machine, term, lo, hi, start, env)


def _culled(machine: Machine, term: Sum, first: int, last: int, env: dict[str, Value]) -> Value | None:
    from potto.runtime.integration.preparation.culling import culled

    return culled(machine, term, first, last, env)


def _added(machine: Machine, terms: tuple[Term, ...], env: dict[str, Value]) -> Value:
    from potto.runtime.integration.methods.summands import added

    return added(machine, terms, env)


SEMANTICS = Semantics(
    call_derivative, call_paired, chosen, lazy, _added, total, _culled, array, element, length, _loaded, _fold,
    _integral, note_kink,
)  # fmt: skip


class Program:
    """The definitions that terms refer to, for any number of evaluations; those `held` have their values already."""

    def __init__(
        self, lookup: Lookup, held: Mapping[tuple[str, str], Value] | None = None, places: Places | None = None,
        named: Named | None = None,
    ) -> None:  # fmt: skip
        self.linker, self.places = Linker(lookup, held, named), places
        self._direct: dict[Term, Direct | Around | None] = {}

    def machine(self, settings: Settings) -> Machine:
        record = Record(most_boxes=settings.max_evals // BOXES_FOR_EVALUATIONS)
        if record.gauge is not None:
            record.gauge.most = settings.max_evals
        return Machine(self.linker, SEMANTICS, settings, record)

    def value(self, machine: Machine, term: Term, env: Mapping[str, Value] | None = None) -> Value:
        """The value of a term, with every internal limit turned into a PottoError."""
        given = env or {}

        def found(machine: Machine, given: Mapping[str, Value] = given) -> Value:
            short = self.shortest(term) if given else None
            value = None if short is None else guarded(lambda: short.value(machine, given))
            machine.record.fresh = value is not None and short is not None and short.fresh
            return guarded(lambda: machine.term(self.linker.ready(term), dict(given))) if value is None else value

        try:
            value = told_alone(found(machine), machine, given, found)
        except PottoError as error:
            raise self.placed(error) from None
        return widened(value, machine, found) if machine.record.used and not machine.directions else value

    def placed(self, error: PottoError) -> PottoError:
        """An error of evaluation with the place in a definition where it was met, if it is known."""
        if not error.met or self.places is None or type(error) not in (PottoError, errors.Coincidence):  # they know it
            return error
        related = self.places(error.met, self.linker.terms)
        return error if related is None else error.beside(related)

    def shortest(self, term: Term) -> Direct | Around | None:
        """The one integral that a call is, or the arithmetic with some, if it is nothing else; found out once."""
        if term not in self._direct:
            from potto.runtime.integration.direct import direct

            self._direct[term] = direct(self.linker.ready(term), self.linker)
        return self._direct[term]

    def evaluate(self, term: Term, settings: Settings = DEFAULTS, env: Mapping[str, Value] | None = None) -> Estimate:
        """The estimate of a term. Raises PottoError where the program has no value."""
        machine = self.machine(settings)
        with Clock() as clock:
            value = self.value(machine, term, env)
        return report(value, machine, clock)

    def call(self, function: Value, groups: Sequence[Sequence[Value]], settings: Settings = DEFAULTS) -> Estimate:
        """The estimate of a function's value for arguments; `groups` as the function is curried."""
        machine = self.machine(settings)
        with Clock() as clock:
            try:
                value = guarded(lambda: machine.call(function, tuple(tuple(g) for g in groups), None))
            except PottoError as error:
                raise self.placed(error) from None
        return report(value, machine, clock)


def evaluate(term: Term, lookup: Lookup, settings: Settings = DEFAULTS) -> Estimate:
    """The estimate of a closed term whose definitions `lookup` gives. Raises PottoError."""
    return Program(lookup).evaluate(term, settings)


def guarded(action: Callable[[], V]) -> V:
    try:
        with np.errstate(all="ignore"):
            return action()
    except (RecursionError, TooDeep):
        raise PottoError([errors.TOO_DEEP(
            errors.NOWHERE, "calls inside each other are nested too deeply",
            help="make sure that the condition that ends the recursion becomes true",
        )]) from None  # fmt: skip


class Clock:
    """Wall time, and kernels made meanwhile."""

    seconds = 0.0

    def __enter__(self) -> Clock:
        self.before = counts.so_far()
        self.start = time.perf_counter()
        return self

    def __exit__(self, *exc: object) -> None:
        linked, compiled, reused, recalled, spent, kernels, native, kept, points = self.before
        self.seconds = time.perf_counter() - self.start
        self.linked = counts.linked - linked
        self.compiled, self.reused = counts.compiled - compiled, counts.reused - reused
        self.recalled = counts.recalled - recalled
        self.spent = counts.seconds - spent
        self.planning = max(self.spent - (counts.kernel_seconds - kernels), 0.0)
        self.native, self.kept = counts.native - native, counts.kept - kept
        self.native_points = counts.native_points - points


_TANGENTS = "tangent", "tangent_error"


def report(value: Value, machine: Machine, clock: Clock) -> Estimate:
    """The estimate of a value; of its tangents the first is told, and all count for whether it converged."""
    record = machine.record
    method = "exact" if not record.methods else "+".join(sorted(record.methods))
    stats = stats_of(record, clock)
    if record.costs is not None:
        stats |= record.costs.told(lambda surface: shortened(format_equation(_as_named(surface, machine))))
    answer = partial(
        Estimate, evals=record.evaluations, seconds=clock.seconds, compile_seconds=clock.spent,
        plan_seconds=clock.planning, method=method, notes=tuple(_notes(machine)), stats=stats,
    )  # fmt: skip
    if isinstance(value, Closure):
        kind = "derivative of a function" if isinstance(value, Derivative) else "function"
        return answer(None, None, text=f"<{kind}>")
    if isinstance(value, list):
        parts = [report(item, machine, clock) for item in value]
        missing: Shortfalls = {}
        for part in parts:
            merged(missing, part.shortfalls)
        values, off = [p.value for p in parts], [p.error for p in parts]
        moving = any(p.tangent is not None for p in parts)
        tangent, tangent_error = ([getattr(p, side) for p in parts] if moving else None for side in _TANGENTS)
        return answer(values, off, tangent, tangent_error, converged=not missing, shortfalls=missing)
    rtol, numbers = machine.settings.asked(_drawn(record)), told(value, lambda cell: cell.v)
    shown = _flat(numbers, told(value, lambda cell: cell.e))  # nan of nan is another reason than inf of nan
    precise = None if _drawn(record) else record.precise
    rough, slopes = rough_of(shown, rtol, precise), rough_of(_slopes(value), rtol, precise)
    error_of = bar if any(each.unknown for each in (*rough, *slopes)) else number
    bounds = told(value, lambda cell: error_of(cell.e))
    tangents = tangent_bounds = None
    if any(cell.t for cell in all_cells(_without_functions(value))):
        tangents = told(value, lambda cell: cell.t[0] if cell.t else None)
        tangent_bounds = told(value, lambda cell: error_of(cell.et[0]) if cell.t else None)
    missing = _missing(rough, [replace(each, error=number(error_of(each.error))) for each in slopes], machine)
    merged(missing, steep([each.number for each in slopes], missing))
    shape = np.broadcast_shapes(*(number.shape for number, _ in shown if isinstance(number, np.ndarray)))
    return answer(
        numbers, bounds, tangents, tangent_bounds, converged=not missing,
        shortfalls={why: members_of(where, shape) if shape else True for why, where in missing.items()},
        member_converged=converged_members(missing, shape) if shape else None,
    )  # fmt: skip


def stats_of(record: Record, clock: Clock) -> dict[str, Any]:
    """What an evaluation was spent on, as its estimate tells."""
    stats: dict[str, Any] = {
        "definitions linked": clock.linked,
        "kernels compiled": clock.compiled,
        "kernels from disk": clock.recalled,
        "kernels reused": clock.reused,
        "machine code compiled": clock.native,
        "machine code from the cache": clock.kept,
        "points by machine code": clock.native_points,
        "integrals": record.integrals,
        "evaluations": record.evaluations,
    }
    if record.seen:
        stats["integrals without a plan"] = record.seen
    if record.culled:
        stats["integrals culled"] = record.culled
    return stats


def _without_functions(value: Value) -> Value:
    """What of a value is numbers: what its functions have captured is not told."""
    if isinstance(value, tuple):
        return tuple([_without_functions(item) for item in value])
    return () if isinstance(value, Closure) else value


def _slopes(value: Value) -> list[tuple[Any, Any]]:
    """All tangents with their errors."""
    if isinstance(value, Rows):
        return [pair for row in value.rows() for pair in _slopes(row)] if any(c.t for c in all_cells(value)) else []
    if isinstance(value, tuple | list):
        return [pair for item in value for pair in _slopes(item)]
    if isinstance(value, Closure):
        return []
    return [(number(t), number(et)) for c in all_cells(value) for t, et in zip(c.t, c.et, strict=True)]


def _missing(numbers: Sequence[Rough], slopes: Sequence[Rough], machine: Machine) -> Shortfalls:
    """Why numbers that are not precise are not as accurate as was asked for: as was noted, and for other members by
    their errors."""
    record, settings = machine.record, machine.settings
    reasons = {**record.shortfalls, **{why: True for why, _ in machine.events.every(Shortfall)}}
    before, drawn = dict(reasons), _drawn(record)
    every = ((each, why) for why, those in ((BOUNDLESS, numbers), (STEEP, slopes)) for each in those)
    for each, infinite in every:
        found = missed(each, record.allowed, settings, drawn)
        if not found or any(where is True for where in before.values()):
            continue
        shape = np.shape(each.number)
        found = _blamed(found, record, shape, infinite)
        if found and any(rough(answer, settings.rtol, settings.atol) for answer in record.used.values()):
            found = {ROUGH: np.logical_or.reduce(list(found.values()))}
        told = converged_members(before, shape)
        merged(reasons, {why: where & told if np.ndim(where) else where for why, where in found.items()})
    return {why: where for why, where in reasons.items() if np.any(where)}


def _drawn(record: Record) -> bool:
    """Whether what was found is made of samples."""
    return not record.methods.isdisjoint(SAMPLERS)


def _blamed(found: Shortfalls, record: Record, shape: tuple[int, ...], infinite: Shortfall) -> Shortfalls:
    """The reasons, in which no integral is to blame for 1/0, exp(3000), and infinity times 0, where all of them are
    finite.

    infinite: what is said instead.
    """
    others: Shortfalls = {}
    for why, instead in ((INFINITE, infinite), (NO_VALUE, NOT_A_NUMBER)):
        if why not in found:
            continue
        where, finite = found.pop(why), record.allowed.over(shape).finite
        for here, told in (
            (np.logical_and(where, np.logical_not(finite)), why),
            (np.logical_and(where, finite), instead),
        ):
            if np.any(here):
                merged(others, {told: here if np.ndim(where) else True})
    merged(others, found)
    return others


def _as_named(term: Term, machine: Machine) -> Term:
    """A term of an integral as the program would write it."""
    from potto.runtime.integration.preparation.arrays import (
        in_places,  # loaded with the first integral: most answers have no notes
    )

    return machine.linker.named(in_places(term))


def _notes(machine: Machine) -> list[OneSided]:
    out: list[OneSided] = []
    for edge in machine.record.edges:
        what = edge.cause
        surface, other = (None if x is None else format_equation(_as_named(x, machine), (what.variable,))
                          for x in (what.surface, what.other))  # fmt: skip
        backward, forward, before, beyond = map(np.squeeze, edge.sides)
        note = OneSided(
            what.variable, surface, backward, forward, other, what.fold, before, beyond, what.kink, what.along
        )
        if not any((o.surface, o.variable, o.other) == (surface, what.variable, other) for o in out):
            out.append(note)
    return out


def told(value: Value, part: Callable[[Cell], Number | None]) -> Any:
    """One part of all numbers, in the form of the value; 0 where it is missing, None for a function."""
    if isinstance(value, Cell):
        return number(part(value))
    if isinstance(value, tuple | list):
        return type(value)([told(item, part) for item in value])
    if isinstance(value, Rows):
        return told_rows(value, part)
    if isinstance(value, Closure):
        return None
    raise errors.not_a_number(value)


def told_rows(rows: Rows, part: Callable[[Cell], Number | None]) -> list[Any]:
    """One part of all numbers of an array, as lists."""
    if isinstance(rows.item, Cell):
        found = number(part(rows.item))
        if not isinstance(found, np.ndarray):
            return [found] * rows.size
        return found.tolist() if found.ndim == 1 else list(found)
    if isinstance(rows.item, tuple):
        columns = [told_rows(Rows(item, rows.size), part) for item in rows.item]
        return list(zip(*columns, strict=True))
    return [told(row, part) for row in rows.rows()]


def number(part: Number | None) -> Number:
    """A part of a number; 0 where it is missing."""
    return part if isinstance(part, np.ndarray) else 0.0 if part is None else float(part)


def bar(error: Number | None) -> Number | None:
    """How far off a number may be: by anything, where rules of errors come to no number, as for `inf*0`."""
    if isinstance(error, np.ndarray):  # a sum tells in a third of the time of a look at each
        return np.where(np.isnan(error), np.inf, error) if np.isnan(error.sum()) else error
    return np.inf if error is not None and error != error else error


def _flat(numbers: Any, bounds: Any) -> list[tuple[Any, Any]]:
    if numbers is None:
        return []
    if isinstance(numbers, tuple | list):
        return [pair for n, b in zip(numbers, bounds, strict=True) for pair in _flat(n, b)]
    return [(numbers, bounds)]
