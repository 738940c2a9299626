"""Second derivatives held against the first derivative.

Owns `compared`. Inside of a second derivative the first one is a formula (`calculus/differentiation/dual`);
asked for by itself it is found by numbers, along the cuts. The two are ways to one number. Where they disagree the
formula misses a part, and nothing is known of its derivative.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from potto.diagnostics import PottoError
from potto.integrate.events import DISAGREE
from potto.integrate.pieces import still
from potto.kernels.cells import Cell, Value, map_cells
from potto.runtime.evaluation.functions import Closure, Derivative
from potto.runtime.evaluation.machine import Groups, Machine

SLACK = 1e-8  # of the largest number of the first derivative, beyond what both ways admit


class _ByHand(Exception):
    """A function on duals is given, of which nobody knows the function."""


def compared(machine: Machine, inner: Derivative, groups: Groups, value: Value) -> Value:
    """What the derivative of a derivative gives for duals of duals, with the first derivative put right where it is
    wrong, and the error of the second one without bound then."""
    if not (isinstance(value, tuple) and len(value) == 2) or machine.frozen or not machine.root:
        return value
    first = _disagreeing(machine, inner, groups, _value, value[0])
    return value if first is None else (first, _unknown(value[1]))


def held(machine: Machine, first: Derivative, groups: Groups, value: Value) -> Value:
    """What the formula of a first derivative gives, with its tangents without bound where its value is wrong."""
    if machine.frozen or machine.taping or not machine.root or not machine.directions:
        return value
    found = _disagreeing(machine.with_directions(0), first, groups, still, value)
    return value if found is None else map_cells(value, _with_unknown_tangents)


def _disagreeing(
    machine: Machine, first: Derivative, groups: Groups, plain: Callable[[Value], Value], formula: Value
) -> Value | None:
    """The first derivative as numbers find it, where a formula gives another one, which is noted; else None."""
    with machine.unrecorded() as other:
        try:
            found = other.call(first, tuple(tuple(map(plain, group)) for group in groups), None)
        except (PottoError, _ByHand):
            return None
    if other.record.shortfalls or _agree(formula, found, SLACK * _largest(found)):
        return None
    machine.note(DISAGREE)
    return found


def _value(dual: Value) -> Value:
    """The value of a dual."""
    if isinstance(dual, Derivative):
        return dual.primal
    if isinstance(dual, Closure):
        raise _ByHand
    return dual[0] if isinstance(dual, tuple) else dual


def _agree(a: Value, b: Value, slack: float) -> bool:
    if isinstance(a, Cell) and isinstance(b, Cell):
        off = np.abs(np.asarray(a.v) - np.asarray(b.v))
        admitted = (0.0 if a.e is None else a.e) + (0.0 if b.e is None else b.e)
        return not np.any(off > admitted + slack)  # what is not a number is known not to be one
    if isinstance(a, tuple) and isinstance(b, tuple) and len(a) == len(b):
        return all(_agree(x, y, slack) for x, y in zip(a, b, strict=True))
    return True  # functions, which are compared when they are called


def _largest(value: Value) -> float:
    if isinstance(value, Cell):
        return float(np.max(np.abs(value.v), initial=0.0, where=np.isfinite(value.v)))
    return max(map(_largest, value), default=0.0) if isinstance(value, tuple) else 0.0


def _unknown(value: Value) -> Value:
    if isinstance(value, Cell):
        return Cell(value.v, value.v * 0.0 + np.inf)
    return tuple(map(_unknown, value)) if isinstance(value, tuple) else value


def _with_unknown_tangents(cell: Cell) -> Cell:
    tangents = tuple([0.0 if t is None else t for t in cell.t])
    return Cell(cell.v, cell.e, tangents, tuple([t * 0.0 + np.inf for t in tangents]))
