"""Deltas of derivatives that lie on the rim of their domain.

Owns `note_rims`. Of a delta that stands on a bound nothing counts, since it is not inside; as soon as it moves inside,
all of it does. What the integral of the derivative is on either side is noted, with the surface.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from potto.calculus.differentiation.between import scaled
from potto.calculus.differentiation.derivative import total, zero_like
from potto.calculus.differentiation.level_sets import coefficient, deltas_over
from potto.core.simplify import normalized_surface
from potto.core.terms import Delta, Integral, Term, add, const, delta, function_of, substitute, with_integrand
from potto.integrate.events import OneSidedDerivatives, TwoSided
from potto.kernels.cells import Array, Cell, Value
from potto.runtime.evaluation.machine import Machine

BESIDE = 2.0**-50  # how far beside the rim the sides are taken, in units of the surface


@lru_cache(maxsize=4096)
def _rims(term: Integral) -> tuple[tuple[TwoSided, Term, Integral, Integral], ...]:
    """The deltas that parameters alone put on a bound, where a term is 0; the integral with each before and beyond."""
    found = []
    for what in deltas_over(term):
        surface, sign = normalized_surface(what.coordinates[0])
        for name, bounds in zip(term.variables, term.bounds, strict=True):
            for bound in bounds if name in surface.free else ():
                there, parts = substitute(surface, {name: bound}), coefficient(term.body, what)
                if there.free <= term.free and parts is not None:
                    backward, forward = (_moved(term, what, parts, side * sign * BESIDE) for side in (-1, 1))
                    found.append((TwoSided(name, surface), there, backward, forward))
    return tuple(found)


def _moved(term: Integral, what: Delta, parts: tuple[Term, Term], step: float) -> Integral:
    """The integral with a delta, of which the integrand has these parts, moved by a step."""
    factor, rest = parts
    beside = delta((add(what.coordinates[0], const(step)), *what.coordinates[1:]))
    body = total([scaled(factor, beside), rest], zero_like(factor))
    return with_integrand(term, body)


def note_rims(machine: Machine, term: Integral, env: dict[str, Value]) -> None:
    """Note the deltas of an integral that lie on a bound, for numbers, not batches."""
    for cause, there, *sides in _rims(term):
        if _number(machine, there, env) == 0.0:
            backward, forward = (np.atleast_1d(_number(machine, side, env)) for side in sides)
            if not np.array_equal(backward, forward):
                off = np.zeros_like(forward)
                machine.record.meet(OneSidedDerivatives(cause, backward, forward, off, off))


def _number(machine: Machine, term: Term, env: dict[str, Value]) -> float | Array:
    """What a term is; nan for a tuple or a batch."""
    value = machine.with_directions(0).evaluate(function_of(term), env, None)
    return value.v if isinstance(value, Cell) and np.ndim(value.v) == 0 else np.nan
