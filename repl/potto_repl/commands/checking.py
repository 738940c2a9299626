"""`:check`: a derivative held against two others, which know nothing of it.

Finite differences of the value say whether it is right: by the reference evaluator in more digits where that is at
hand and quick, else by extrapolation of Potto's own values. The derivative of the discretized sum says what a tool
that samples first would have given.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator
from typing import Any

from msgspec import Struct
from msgspec.structs import replace

from potto.core.terms import Delta, Term, reached
from potto.diagnostics import PottoError
from potto.elaborate import elaborate_expression
from potto.projects.settings import Settings
from potto.runtime.answers.printing import format_error, format_number, with_error
from potto.runtime.answers.shown import as_dual
from potto.runtime.evaluate import Program
from potto.syntax import nodes, print_expression
from potto_repl.discretized import dimensions, discretized, points_of
from potto_repl.expressions import Called, call_of, checked
from potto_repl.registry import command
from potto_repl.reply import Part
from potto_repl.session import Conversation
from potto_repl.slopes import Slope, dual_text, slopes

DIGITS = 12  # of the reference evaluator's differences
STEPS = 7
SHRUNK = 3  # how often its step is made smaller


class Difference(Struct, frozen=True):
    """A derivative by finite differences, how far it may be off, and how it was computed."""

    value: float
    error: float
    how: str


@command("check", "c", argument="f(0.3, …)", completes="expression")
def check(session: Conversation, text: str) -> Iterator[Part]:
    """Compare a derivative with finite differences, and with the derivative of the discretized sum.

    `:check f(0.3)` does so for each number that `f` is given. Finite differences are taken in higher precision where
    mpmath is installed and the integral has one variable, else by extrapolating values of high accuracy.
    """
    called = call_of(session, text, ":check f(0.3)")
    for slope in slopes(session, called):
        if isinstance(slope.dual.tangent, tuple):
            yield Part("note", f"by {slope.name}: the value is a tuple; `:check` compares numbers")
            continue
        yield from _compared(session, called, slope)


def _compared(session: Conversation, called: Called, slope: Slope) -> Iterator[Part]:
    tangent, error = float(slope.dual.tangent), float(slope.dual.tangent_error)
    other = _difference(session, called, slope)
    rows = [f"by {slope.name}", f"  Potto               {with_error(tangent, error)}"]
    if slope.parts is not None:
        interior = format_number(float(slope.parts.interior), float(slope.parts.interior_error))
        boundary = format_number(float(slope.parts.boundary), float(slope.parts.boundary_error))
        rows[-1] += f"   interior {interior}, boundary {boundary}"
    apart = abs(other.value - tangent)
    slack = error + other.error + 1e-9 * max(abs(tangent), abs(other.value))
    agree = apart <= slack
    verdict = "agree" if agree else "DISAGREE"
    rows.append(f"  finite differences  {with_error(other.value, other.error)}   {other.how}")
    rows.append(f"  they {verdict}: {format_error(apart)} apart")
    summed, points = _discretized(session, slope)
    data: dict[str, Any] = {"by": slope.name, "derivative": tangent, "error": error, "differences": other.value,
                            "agree": agree, "discretized": summed}  # fmt: skip
    if summed is not None:
        sampled = format_number(summed, 1e-4 * max(abs(summed), abs(tangent), 1e-6) if summed else 0.0)
        rows.append(f"  differentiating the discretized sum gives {sampled}; "
                    f"Potto gives {format_number(tangent, error)}   {points}")  # fmt: skip
        missed = slope.parts is not None and abs(float(slope.parts.boundary)) > 1e-9 * max(1.0, abs(tangent))
        if missed and abs(summed - tangent) > 1e-3 * abs(tangent):
            rows.append("  the sum misses the boundary term")
    if not agree:
        rows.append("  the value may have a corner here, so that the derivatives on its two sides differ")
    yield Part("answer", "\n".join(rows), {"check": data}, numbers=True)


# Finite differences


def _difference(session: Conversation, called: Called, slope: Slope) -> Difference:
    term = elaborate_expression(session.db, session.file, slope.expr).term
    scale = _scale(session, called, slope.name)
    if importlib.util.find_spec("mpmath") is not None and _depth(session, term) <= 1:
        found = _exact_difference(session, called, slope.name, scale)
        if found is not None:
            return found
    return _extrapolated(session, called, slope, scale)


def _scale(session: Conversation, called: Called, name: str) -> float:
    """How far from its place a number can be moved: as far as it is from 0, and by 1 at 0."""
    where = abs(float(session.evaluate(print_expression(dict(called.given)[name]), session.settings).estimate.value))
    return where if where > 1e-6 else 1.0


def _exact_difference(session: Conversation, called: Called, name: str, scale: float) -> Difference | None:
    """With steps that shrink until two of them agree; None where none do, or the value is nothing to be told so."""
    before = _reference(session, called, name, scale)
    for _ in range(SHRUNK):
        scale /= 8
        now = _reference(session, called, name, scale)
        if before is None or now is None:
            return None
        if abs(now - before) <= 1e-9 * max(abs(now), abs(before)):
            error = max(abs(now - before), 10.0**-DIGITS * max(abs(now), 1.0))
            return Difference(now, error, f"central, {DIGITS + 15} digits")
        before = now
    return None


def _reference(session: Conversation, called: Called, name: str, scale: float) -> float | None:
    """The reference evaluator's derivative, with a step that is a hundredth of `scale`."""
    from potto.core.reference import NotAccurate, evaluate

    expr = checked(session, dual_text(called, name, scale), ":check f(0.3)").expr
    try:
        value = evaluate(elaborate_expression(session.db, session.file, expr).term, None, session.world.lookup, DIGITS)
    except (NotAccurate, PottoError, ArithmeticError, ValueError, TypeError):
        return None  # it cannot vouch for it; extrapolation can
    if not isinstance(value, tuple) or len(value) != 2 or isinstance(value[1], tuple | list) or callable(value[1]):
        return None
    return float(value[1].real) / scale


def _depth(session: Conversation, term: Term) -> int:
    """The variables of integration inside each other, followed through definitions."""
    return sum(dimensions(parts[-1]) for parts in reached(term, resolve=session.world.program.linker.reach.resolve))


def _has_deltas(session: Conversation, term: Term) -> bool:
    every = reached(term, resolve=session.world.program.linker.reach.resolve)
    return any(isinstance(node, Delta) for parts in every for node in parts)


def _extrapolated(session: Conversation, called: Called, slope: Slope, scale: float) -> Difference:
    """Ridders' method: central differences with shrinking steps, extrapolated to none."""
    settings = replace(session.settings, method="quadrature", rtol=1e-13, atol=0.0)
    at = dict(called.given)[slope.name]
    step, shrink = 0.05 * scale, 1.6
    table: list[list[float]] = []
    best, error = 0.0, float("inf")
    for i in range(STEPS):
        row = [_central(session, called, slope.name, at, step, settings)]
        step /= shrink
        for j in range(1, i + 1):
            factor = shrink ** (2 * j)
            row.append((row[j - 1] * factor - table[i - 1][j - 1]) / (factor - 1))
            doubt = max(abs(row[j] - row[j - 1]), abs(row[j] - table[i - 1][j - 1]))
            if doubt < error:
                best, error = row[j], doubt
        table.append(row)
    return Difference(best, max(error, 1e-12 * abs(best)), "central, extrapolated")


def _central(
    session: Conversation, called: Called, name: str, at: nodes.Expr, step: float, settings: Settings
) -> float:
    places = (f"({print_expression(at)}) {sign} {step!r}" for sign in "+-")
    right, left = (_moved(session, called, name, place, settings) for place in places)
    return (right - left) / (2 * step)


def _moved(session: Conversation, called: Called, name: str, value: str, settings: Settings) -> float:
    rest = iter(called.given)
    groups = []
    for group in called.head.groups:
        items = [next(rest) for _ in group]
        groups.append(", ".join(value if n == name else print_expression(e) for n, e in items))
    text = f"({called.head.text}){''.join(f'({group})' for group in groups)}"
    return float(session.evaluate(text, settings).estimate.value)


# The discretized sum


def _discretized(session: Conversation, slope: Slope) -> tuple[float | None, str]:
    """The derivative of the sum that stands for the integral, and how many points that has."""
    term = elaborate_expression(session.db, session.file, slope.expr).term
    depth = _depth(session, term)
    if not depth:
        return None, ""
    points = points_of(depth)
    if _has_deltas(session, term):
        return None, ""  # the points of a sum never meet a delta
    program = Program(lambda file, name: discretized(session.world.lookup(file, name), points))
    estimate = as_dual(program.evaluate(discretized(term, points), session.settings))
    summed = None if estimate.tangent is None or isinstance(estimate.tangent, tuple) else float(estimate.tangent)
    return summed, " x ".join([str(points)] * depth) + " points"
