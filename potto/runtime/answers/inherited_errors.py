"""Errors that new answers inherit from earlier ones.

Owns `rough` and `widened`. The rules of errors follow a number through arithmetic and integrands; to how fast a jump
moves that an answer places, they do not. So what is made of an answer that is less accurate than is asked for now is
evaluated once more at both ends of its error.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator

import numpy as np

from potto.diagnostics import PottoError
from potto.kernels.cells import Cell, Number, Value
from potto.runtime.evaluation.machine import Machine


def rough(value: Value, rtol: float, atol: float) -> bool:
    """Whether an answer is less accurate than is asked for."""
    if isinstance(value, tuple | list):
        return any(rough(item, rtol, atol) for item in value)
    return isinstance(value, Cell) and bool(value.e) and not value.e <= max(atol, rtol * abs(value.v))  # type: ignore[operator]


def widened(value: Value, machine: Machine, again: Callable[[Machine], Value]) -> Value:
    """The value with errors as large as it is apart from those at both ends of each rough answer that it is made of."""
    settings = machine.settings
    for key, held in list(machine.record.used.items()):
        if rough(held, settings.rtol, settings.atol):
            for ends in _ends(held):
                value = _covering(value, [_at(machine, key, end, again) for end in ends])
    return value


def _ends(value: Value) -> Iterator[tuple[Value, Value]]:
    """The answer with one of its numbers at the two ends of its error, number by number."""
    if isinstance(value, Cell):
        if value.e:
            yield Cell(value.v - value.e, value.e), Cell(value.v + value.e, value.e)
    elif isinstance(value, tuple | list):
        for place, item in enumerate(value):
            for low, high in _ends(item):
                before, after = value[:place], value[place + 1 :]
                yield (type(value)([*before, low, *after]), type(value)([*before, high, *after]))


def _at(machine: Machine, key: tuple[str, str], held: Value, again: Callable[[Machine], Value]) -> Value | None:
    """The value if the answer were another one; None where it has none then."""
    linker = copy.copy(machine.linker)
    linker.held, linker.constants = {**linker.held, key: held}, {}
    with machine.unrecorded(linker=linker) as other:
        try:
            return again(other)
        except PottoError:
            return None


def _covering(value: Value, others: list[Value | None]) -> Value:
    """The value with errors that reach to the others, on top of what they were before for other answers' sake."""
    if isinstance(value, tuple | list):
        rows = [list(other) if isinstance(other, tuple | list) and len(other) == len(value) else [None] * len(value)
                for other in others]  # fmt: skip
        return type(value)(_covering(item, list(found)) for item, *found in zip(value, *rows, strict=True))
    if not isinstance(value, Cell):
        return value
    error = 0.0 if value.e is None else float(value.e)
    for other in others:
        error = max(error, _largest(other.v - value.v) if isinstance(other, Cell) else float("inf"))
    return Cell(value.v, error, value.t, value.et)


def _largest(number: Number) -> float:
    return float(np.max(np.abs(number)))
