"""Evaluating a program: from a term (or a function and numbers) to an `Estimate`.

Owns `evaluate` and `Program`. A program keeps its linker, so that definitions are looked up and constants computed
once; every evaluation has books of its own.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from potto.calculus.branch_cuts import opened
from potto.calculus.surfaces import TooDeep
from potto.core.printer import format_term
from potto.core.terms import Term
from potto.diagnostics import PottoError
from potto.kernels import compile as compiling
from potto.kernels import errors
from potto.kernels.cells import Cell, Value
from potto.runtime.advice import INFINITE, NO_VALUE, ROUGH, TOO_FEW
from potto.runtime.estimate import Estimate, OneSided
from potto.runtime.functions import Closure, Derivative
from potto.runtime.inherited import rough, widened
from potto.runtime.machine import Books, Linker, Machine
from potto.settings import DEFAULTS, Settings

Lookup = Callable[[str, str], Term]


class Program:
    """The definitions that terms refer to, for any number of evaluations; those `held` have their values already."""

    def __init__(self, lookup: Lookup, held: Mapping[tuple[str, str], Value] | None = None) -> None:
        self.linker = Linker(lookup, held)

    def machine(self, settings: Settings) -> Machine:
        return Machine(self.linker, settings, Books())

    def value(self, machine: Machine, term: Term, env: Mapping[str, Value] | None = None) -> Value:
        """The value of a term, with every internal limit turned into a PottoError."""

        def found(machine: Machine) -> Value:
            return guarded(lambda: machine.term(opened(term), dict(env or {})))

        value = found(machine)
        return widened(value, machine, found) if machine.books.used and not machine.directions else value

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
            value = guarded(lambda: machine.call(function, tuple(tuple(g) for g in groups), None))
        return report(value, machine, clock)


def evaluate(term: Term, lookup: Lookup, settings: Settings = DEFAULTS) -> Estimate:
    """The estimate of a closed term whose definitions `lookup` gives. Raises PottoError."""
    return Program(lookup).evaluate(term, settings)


def guarded(action: Callable[[], Value]) -> Value:
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
        self.start = time.perf_counter()
        self.compiled = compiling.counts.compiled
        self.reused = compiling.counts.reused
        self.spent = compiling.counts.seconds
        return self

    def __exit__(self, *exc: object) -> None:
        self.seconds = time.perf_counter() - self.start
        self.compiled = compiling.counts.compiled - self.compiled
        self.reused = compiling.counts.reused - self.reused
        self.spent = compiling.counts.seconds - self.spent


def report(value: Value, machine: Machine, clock: Clock) -> Estimate:
    books, settings = machine.books, machine.settings
    method = "exact" if not books.methods else "+".join(sorted(books.methods))
    stats: dict[str, Any] = {
        "kernels compiled": clock.compiled,
        "kernels reused": clock.reused,
        "integrals": books.integrals,
        "evaluations": books.evaluations,
    }
    if books.costs is not None:
        stats |= books.costs.told()
    notes = tuple(_notes(books))
    common = {
        "evals": books.evaluations,
        "seconds": clock.seconds,
        "compile_seconds": clock.spent,
        "method": method,
        "notes": notes,
        "stats": stats,
    }
    if isinstance(value, Closure):
        kind = "derivative of a function" if isinstance(value, Derivative) else "function"
        return Estimate(None, None, text=f"<{kind}>", **common)  # type: ignore[arg-type]
    if isinstance(value, list):
        parts = [report(item, machine, clock) for item in value]
        return Estimate([p.value for p in parts], [p.error for p in parts], **common)  # type: ignore[arg-type]
    numbers, bounds = numbers_of(value), bounds_of(value)
    tangents, tangent_bounds = tangents_of(value)
    reasons = list(books.unfinished)
    flat = [*_flat(numbers, bounds), *_flat(tangents, tangent_bounds)]
    scale = max((_largest(v) for v, _ in flat), default=0.0)
    drawn = not books.methods.isdisjoint(("mc", "qmc"))
    gross = books.gross if books.methods else 1.0
    missed = next((m for v, e in flat if (m := _missed(v, e, scale, gross, settings, drawn))), None)
    if missed == INFINITE and not books.methods:
        missed = None  # of 1/0 no integral is to blame
    if not reasons and missed is not None:
        used = any(rough(value, settings.rtol, settings.atol) for value in books.used.values())
        reasons.append(ROUGH if used else missed)
    return Estimate(
        numbers,
        bounds,
        tangents,
        tangent_bounds,
        converged=not reasons,
        reasons=tuple(reasons),
        **common,  # type: ignore[arg-type]
    )


def _notes(books: Books) -> list[OneSided]:
    out: list[OneSided] = []
    for what, backward, forward in books.edges:
        other = None if what.other is None else f"{format_term(what.other)} = 0"
        surface = None if what.surface is None else f"{format_term(what.surface)} = 0"
        note = OneSided(what.variable, surface, np.squeeze(backward), np.squeeze(forward), other, what.fold)
        if not any((o.surface, o.variable, o.other) == (surface, what.variable, other) for o in out):
            out.append(note)
    return out


def numbers_of(value: Value) -> Any:
    if isinstance(value, Cell):
        return value.v if isinstance(value.v, np.ndarray) else float(value.v)
    if isinstance(value, tuple | list):
        return type(value)(map(numbers_of, value))
    raise errors.not_a_number(value)


def bounds_of(value: Value) -> Any:
    if isinstance(value, Cell):
        e = value.e
        return 0.0 if e is None else (e if isinstance(e, np.ndarray) else float(e))
    if isinstance(value, tuple | list):
        return type(value)(map(bounds_of, value))
    raise errors.not_a_number(value)


def tangents_of(value: Value) -> tuple[Any, Any]:
    """The tangents in the one direction that a cell carries; None, None for a plain value."""
    if isinstance(value, Cell):
        if not value.t:
            return None, None
        t, et = value.t[0], value.et[0]
        return (0.0 if t is None else t), (0.0 if et is None else et)
    if isinstance(value, tuple):
        pairs = [tangents_of(v) for v in value]
        if all(p[0] is None for p in pairs):
            return None, None
        return tuple(p[0] for p in pairs), tuple(p[1] for p in pairs)
    return None, None


def _flat(numbers: Any, bounds: Any) -> list[tuple[Any, Any]]:
    if numbers is None:
        return []
    if isinstance(numbers, tuple | list):
        return [pair for n, b in zip(numbers, bounds, strict=True) for pair in _flat(n, b)]
    return [(numbers, bounds)]


def _largest(value: Any) -> float:
    """The largest finite magnitude."""
    if isinstance(value, float):
        return abs(value) if math.isfinite(value) else 0.0
    return float(np.max(np.abs(value), initial=0.0, where=np.isfinite(value)))


def _missed(value: Any, error: Any, scale: float, gross: float, settings: Settings, drawn: bool) -> str | None:
    """Why an answer is not as accurate as was asked, or None. `drawn`: it is made of samples.

    `scale` is the size of the whole answer: a small tangent beside a large value, or a pixel of a picture that is all
    but zero by cancellation, is measured against its neighbours. `gross` is what integrals add up to without regard to
    sign: nobody can know more digits of 0 than that has.
    """
    if isinstance(value, float) and isinstance(error, float) and error <= settings.rtol * abs(value) < np.inf:
        return None
    v, e = np.abs(np.asarray(value, dtype=float)), np.asarray(error, dtype=float)
    if np.isnan(v).any():
        return NO_VALUE if np.isinf(e).any() else "the value is not a number"
    if (np.isinf(v) & np.isinf(e)).any():
        return INFINITE
    if np.isnan(e).any() or (np.isinf(e) & ~np.isinf(v)).any():
        return "the error is not known"
    bad = ~(e <= np.maximum(settings.atol, settings.rtol * v)) & ~np.isinf(v)
    bad &= e > max(1e-12, settings.rtol) * max(scale, 1e-300)
    bad &= (v > 1e3 * e) | (e > 1e-10 * gross)
    if bad.any():
        if drawn:
            return TOO_FEW
        if (e[bad] > 0.1 * v[bad]).any():
            return "no accuracy was reached: the integral diverges, its integrand is too rough, or rounding hides it"
        return "rounding limits the accuracy" if (e[bad] < 1e-6 * v[bad]).all() else "the error estimate is too large"
    return None
