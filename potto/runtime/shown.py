"""Values as text and as plain data: what `print` shows and what machines get.

Owns the forms of values of every kind, and how a pair becomes a dual; the digits are chosen in `printing`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np

from potto.core.terms import App, Deriv, Global, If, Lam, Term, Var
from potto.kernels.cells import Cell, Value
from potto.runtime.estimate import Estimate
from potto.runtime.functions import Derivative
from potto.runtime.machine import Linker
from potto.runtime.printing import format_error, format_number, format_tuple

NOTHING: Mapping[str, Value] = MappingProxyType({})
MOST_ITEMS = 12  # of an array that are shown


def format_value(value: Value) -> str:
    """A value as `print` shows it: numbers to the digits that their errors support."""
    if isinstance(value, Cell):
        return _numbers(value.v, 0.0 if value.e is None else value.e)
    if isinstance(value, tuple):
        return format_tuple([format_value(item) for item in value])
    if isinstance(value, list):
        return f"[{', '.join(format_value(item) for item in value)}]"
    return "<derivative>" if isinstance(value, Derivative) else "<function>"


def format_estimate(estimate: Estimate) -> str:
    """The answer of an estimate, a dual as `(value, tangent)`."""
    if estimate.text is not None:
        return estimate.text
    value = format_numbers(estimate.value, estimate.error)
    if estimate.tangent is None:
        return value
    return format_tuple([value, format_numbers(estimate.tangent, estimate.tangent_error)])


def format_numbers(value: Any, error: Any) -> str:
    """A number, or a tuple, list or array of them, with errors of the same form."""
    if isinstance(value, tuple):
        return format_tuple([format_numbers(v, e) for v, e in zip(value, error, strict=True)])
    if isinstance(value, list):
        return f"[{', '.join(format_numbers(v, e) for v, e in zip(value, error, strict=True))}]"
    return "<function>" if value is None else _numbers(value, error)


def format_bounds(error: Any) -> str:
    """Error estimates to two digits, in the form of the value."""
    if isinstance(error, tuple | list):
        return format_tuple([format_bounds(item) for item in error])
    if isinstance(error, np.ndarray) and error.ndim:
        return f"at most {format_error(float(np.max(error, initial=0.0)))}"
    return format_error(float(error))


def with_error(value: Any, error: Any) -> str:
    """`0.3 ± 4e-16`; without the error where it is zero."""
    return format_numbers(value, error) + error_bar(error)


def error_bar(error: Any) -> str:
    """` ± 4e-16`; nothing where the error is zero or not known."""
    return f" ± {format_bounds(error)}" if 0 < largest(error) < math.inf else ""


def largest(error: Any) -> float:
    """The largest of the errors of a value."""
    if isinstance(error, np.ndarray):
        return float(np.max(error, initial=0.0))
    if isinstance(error, tuple | list):
        return max((largest(item) for item in error), default=0.0)
    return float(error) if error is not None and error == error else math.inf


def _numbers(value: Any, error: Any) -> str:
    if isinstance(value, np.ndarray) and value.ndim:
        flat, bounds = value.ravel(), np.broadcast_to(error, value.shape).ravel()
        shown = [format_number(float(v), float(e)) for v, e in zip(flat[:MOST_ITEMS], bounds[:MOST_ITEMS], strict=True)]
        return f"[{', '.join(shown)}{', ...' if flat.size > MOST_ITEMS else ''}]"
    return format_number(float(value), float(error))


# For machines


def json_number(value: Any) -> Any:
    """A number for JSON: all its digits; nan and infinities as strings. Tuples, lists and arrays as arrays."""
    if value is None:
        return None
    if isinstance(value, tuple | list):
        return [json_number(item) for item in value]
    if isinstance(value, np.ndarray) and value.ndim:
        return [json_number(item) for item in value]
    number = float(value)
    if math.isfinite(number):
        return number
    return "nan" if math.isnan(number) else ("inf" if number > 0 else "-inf")


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


def as_dual(estimate: Estimate) -> Estimate:
    """The estimate of a pair `(value, tangent)` with the tangent in its own place."""
    if not (isinstance(estimate.value, tuple) and len(estimate.value) == 2) or estimate.tangent is not None:
        return estimate
    (value, tangent), (error, tangent_error) = estimate.value, estimate.error
    return replace(estimate, value=value, error=error, tangent=tangent, tangent_error=tangent_error)
