"""What a reader of a number should know, as diagnostics."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from potto.diagnostics import Diagnostic, declare
from potto.integrate.events import DIVERGENT, ROUGH, UNDEFINED
from potto.runtime.answers.estimate import Estimate
from potto.source import Span

NOT_CONVERGED = declare("P0501", "an estimate that is not as accurate as was asked", "warning")
NO_NUMBER = declare("P0524", "an answer that is not a number", "warning")
ONE_SIDED = declare("P0522", "a derivative that differs on the two sides of the parameters", "info")


def remarks(estimate: Estimate, place: Span) -> Iterator[Diagnostic]:
    """That a number is not accurate enough or none at all, that its derivative is one-sided."""
    if (_has_nan(estimate.value) or _has_nan(estimate.tangent)) and DIVERGENT.isdisjoint(estimate.shortfalls):
        why = [shortfall for shortfall in estimate.shortfalls if shortfall.alike == UNDEFINED]
        yield NO_NUMBER(
            place,
            f"this is not a number: {'; '.join(map(str, why))}" if why else "this is not a number",
            help=why[0].advice
            if why
            else "a builtin was used where it is not defined, or a parameter is not a number itself",
        )
    elif not estimate.converged and {*estimate.shortfalls} != {ROUGH}:
        reason = "; ".join(estimate.reasons)
        yield NOT_CONVERGED(
            place,
            f"this estimate did not reach the accuracy asked for: {reason}",
            help=estimate.options,
        )
    for note in estimate.notes:
        yield ONE_SIDED(place, str(note))


def _has_nan(value: Any) -> bool:
    if isinstance(value, tuple | list):
        return any(map(_has_nan, value))
    return value is not None and math.isnan(value)
