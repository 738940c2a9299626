"""Live expressions: comments `#> e` that are evaluated, and `#= v` that say what comes out.

Owns whether a value holds: each number may be off by its error estimate and by half a unit of the last digit that was
written. Who shows the outcome is left to the faces.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from msgspec import Struct

from potto.diagnostics import declare
from potto.evaluating.world import World
from potto.reports.render import ProgramError
from potto.runtime.answers.estimate import Estimate
from potto.runtime.answers.named import Named
from potto.runtime.answers.printing import holds, written_tolerance
from potto.runtime.answers.shown import format_answer, interval
from potto.syntax import live_expressions, nodes

DOES_NOT_HOLD = declare("P0530", "a live expression that does not give what is written below it")


class Outcome(Struct, frozen=True):
    """What became of one live expression; `line` counts from 1. `message` says why it does not hold."""

    file: str
    line: int
    expression: str
    expected: str | None
    value: str | None
    passed: bool
    message: str = ""


def outcomes_of(world: World, file: str) -> list[Outcome]:
    """Evaluate the live expressions of a file; those that lead to a definition with an error do not hold."""
    source = world.source(file)
    if source is None:
        return []
    found = []
    for live in live_expressions(source.text):
        line = source.position(live.span.start).line + 1
        found.append(_outcome(world, file, line, live.text, live.expected))
    return found


def _outcome(world: World, file: str, line: int, text: str, expected: str | None) -> Outcome:
    value, shown = None, " ".join(text.split())
    try:
        estimate = world.evaluate(file, text).estimate
        value = format_answer(estimate)
        if expected is None:
            return Outcome(file, line, shown, expected, value, True)
        wanted = world.evaluate(file, expected).estimate
        good = agrees(estimate, wanted, world.parse(expected))
    except ProgramError as error:
        message = "; ".join(diagnostic.message for diagnostic in error.diagnostics)
        return Outcome(file, line, shown, expected, value, False, message)
    message = "" if good else f"expected {expected}, got {interval(estimate)}"
    return Outcome(file, line, shown, expected, value, good, message)


def agrees(estimate: Estimate, wanted: Estimate, written: nodes.Expr) -> bool:
    """Whether an answer is what was written down, given the digits that were written."""
    if estimate.text is not None or wanted.text is not None:
        return False
    found, expected = list(_numbers(estimate)), list(_numbers(wanted))
    if any(value is None for value, _ in found):  # a function, which is not compared
        return False
    tolerances = list(_tolerances(written, wanted.value))
    if len(tolerances) != len(expected):  # no tuple of numbers but an expression: exact
        tolerances = [0.0] * len(expected)
    return _form(estimate) == _form(wanted) and all(
        holds(value, error + other_error, other, tolerance)
        for (value, error), (other, other_error), tolerance in zip(found, expected, tolerances, strict=True)
    )


def _numbers(estimate: Estimate) -> Iterator[tuple[Any, Any]]:
    yield from _flat(estimate.value, estimate.error)
    if estimate.tangent is not None:
        yield from _flat(estimate.tangent, estimate.tangent_error)


def _flat(value: Any, error: Any) -> Iterator[tuple[Any, Any]]:
    if isinstance(value, tuple | list):
        for part, bound in zip(value, error, strict=True):
            yield from _flat(part, bound)
    else:
        yield value, error


def _form(estimate: Estimate) -> Any:
    """How the numbers of an answer are put together; a dual is a pair."""
    if estimate.tangent is None:
        return _shape(estimate.value)
    return (_shape(estimate.value), _shape(estimate.tangent))


def _shape(value: Any) -> Any:
    return tuple(map(_shape, value)) if isinstance(value, tuple | list) else None


def _tolerances(written: nodes.Expr, value: Any) -> Iterator[float]:
    """By how much each number that was written may be off; `value` is what it comes to."""
    match written:
        case nodes.Number(text=text):
            yield written_tolerance(text)
        case nodes.Unary(operand=inner) | nodes.Paren(inner=inner):
            yield from _tolerances(inner, value)
        case nodes.Tuple(items=items) | nodes.ListLiteral(items=items) if isinstance(value, tuple | list):
            for item, part in zip(items, value, strict=False):
                yield from _tolerances(item, part)
        case nodes.Apply(arguments=arguments) if isinstance(value, Named) and len(arguments) == len(value):
            given = {value.fields[i] if a.name is None else a.name: a.value for i, a in enumerate(arguments)}
            for name, part in zip(value.fields, value, strict=True):
                yield from _tolerances(given[name], part)
        case _:
            yield 0.0
