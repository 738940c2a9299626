"""Values as text and as plain data: what `print` shows and what machines get.

Owns the forms of values of every kind, and how a pair becomes a dual; the digits are chosen in `printing`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from msgspec.structs import replace

from potto.core.terms import App, Deriv, Global, If, Lam, Term, Var
from potto.integrate.events import BOUNDLESS
from potto.kernels.cells import Cell, Rows, Value
from potto.runtime.answers.convergence import converged_members, steep
from potto.runtime.answers.estimate import Estimate
from potto.runtime.answers.printing import (
    MOST_ITEMS,
    format_bounds,
    format_list,
    format_numbers,
    led,
    not_finite,
    together,
    with_error,
)
from potto.runtime.evaluation.functions import Derivative
from potto.runtime.evaluation.linker import Linker

NOTHING: Mapping[str, Value] = MappingProxyType({})


def format_value(value: Value) -> str:
    """A value as `print` shows it: numbers to the digits that their errors support."""
    if isinstance(value, Cell):
        return format_numbers(value.v, 0.0 if value.e is None else value.e)
    if isinstance(value, tuple):
        return together(value, [format_value(item) for item in value])
    if isinstance(value, list | Rows):
        size = len(value) if isinstance(value, list) else value.size
        first = [value[i] if isinstance(value, list) else value.at(i) for i in range(min(size, MOST_ITEMS))]
        return format_list([format_value(item) for item in first], size)
    return "<derivative>" if isinstance(value, Derivative) else "<function>"


def format_answer(estimate: Estimate) -> str:
    """An answer as it stands on a line: see `answer_text`."""
    if estimate.text is not None:
        return estimate.text
    return answer_text(*pair(estimate), estimate.converged)


def answer_text(value: Any, error: Any, converged: bool) -> str:
    """The digits of an answer that hold; of one that missed its tolerance that, and all digits beside the error."""
    return format_numbers(value, error) if converged else led(with_error(value, error), False)


def interval(estimate: Estimate) -> str:
    """The answer with its error bars; what missed its tolerance says so."""
    if estimate.text is not None:
        return estimate.text
    return led(with_error(*pair(estimate)), estimate.converged)


def bounds(estimate: Estimate) -> str:
    """The errors alone, in the form of the answer."""
    return format_bounds(pair(estimate)[1])


def tangent_of(dual: Estimate) -> Estimate:
    """The tangent of a dual as an answer of its own."""
    return replace(dual, value=dual.tangent, error=dual.tangent_error, tangent=None, tangent_error=None)


def pair(estimate: Estimate) -> tuple[Any, Any]:
    """The numbers of an answer and their errors, in the form in which they are shown: a dual is a pair."""
    if estimate.tangent is None:
        return estimate.value, estimate.error
    return (estimate.value, estimate.tangent), (estimate.error, estimate.tangent_error)


def format_estimate(estimate: Estimate) -> str:
    """The digits of an answer that hold, a dual as `(value, tangent)`: as a program may write them."""
    return estimate.text if estimate.text is not None else format_numbers(*pair(estimate))


# For machines


def json_number(value: Any) -> Any:
    """A number for JSON: all its digits; nan and infinities as strings. Tuples, lists and arrays as arrays, and so
    are records, whose parts have their places."""
    if value is None:
        return None
    if isinstance(value, Mapping):
        value = tuple(value.values())
    if isinstance(value, tuple | list):
        return [json_number(item) for item in value]
    if isinstance(value, np.ndarray) and value.ndim:
        return [json_number(item) for item in value]
    number = float(value)
    return number if math.isfinite(number) else not_finite(number)


def estimate_json(estimate: Estimate, type: str | None = None) -> dict[str, Any]:
    """The object that `potto eval --json` promises."""
    answer: dict[str, Any] = {
        "value": json_number(estimate.value),
        "error": json_number(estimate.error),
        "tangent": json_number(estimate.tangent),
        "tangent_error": json_number(estimate.tangent_error),
        "converged": estimate.converged,
        "evals": estimate.evals,
        "seconds": round(estimate.seconds, 7),
        "compile_seconds": round(estimate.compile_seconds, 7),
        "plan_seconds": round(estimate.plan_seconds, 7),
        "method": estimate.method,
        "type": type,
    }
    if estimate.reasons:
        answer["reasons"] = list(estimate.reasons)
    if estimate.notes:
        answer["notes"] = [str(note) for note in estimate.notes]
    if estimate.text is not None:
        answer["text"] = estimate.text
    return answer


# Duals


def gives_dual(term: Term, linker: Linker, env: Mapping[str, Value] = NOTHING) -> bool:
    """Whether the value of a term is that of a derivative, and so a dual: found by following what is called. `env` has
    what its free names stand for."""
    groups = 0
    for _ in range(1000):
        match term:
            case App():
                term, groups = term.function, groups + 1
            case Global():
                term = linker.term(term.module, term.name)
            case Lam() if groups:
                term, groups = term.body, groups - 1
            case If():
                term = term.then
            case Deriv():
                return groups > 0
            case Var(name=name):
                return groups > 0 and isinstance(env.get(name), Derivative)
            case _:
                return False
    return False


def holds_functions(value: Any) -> bool:
    """Whether there are functions in an answer, of which it has the places alone."""
    return value is None or (isinstance(value, tuple | list) and any(map(holds_functions, value)))


def as_dual(estimate: Estimate) -> Estimate:
    """The estimate of a pair `(value, tangent)` with the tangent in its own place; duals side by side, as there are
    where one is a function, stay as they are."""
    if not (isinstance(estimate.value, tuple) and len(estimate.value) == 2) or estimate.tangent is not None:
        return estimate
    if holds_functions(estimate.value):
        return estimate
    (value, tangent), (error, tangent_error) = estimate.value, estimate.error
    dual = replace(estimate, value=value, error=error, tangent=tangent, tangent_error=tangent_error)
    missing = steep(_numbers(tangent), estimate.shortfalls)
    if not missing:
        return dual
    every = estimate.member_converged
    known = {
        why: where
        for why, where in estimate.shortfalls.items()
        if why is not BOUNDLESS or any(np.any(np.isinf(number)) for number in _numbers(value))
    }
    return replace(
        dual, converged=False, shortfalls={**known, **missing},
        member_converged=None if every is None else every & converged_members(missing, np.shape(every)),
    )  # fmt: skip


def _numbers(value: Any) -> list[Any]:
    """The numbers of a value of tuples and lists, or arrays of them."""
    return [number for item in value for number in _numbers(item)] if isinstance(value, tuple | list) else [value]
