"""Values as the prompt shows them: the digits that hold, the error, what it cost, a derivative in its parts.

Owns `value_parts`. The digits are chosen by the runtime; the parts of a derivative come from a second evaluation in
which surfaces and bounds stand still.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from msgspec import Struct

from potto.core.terms import App, Delta, Global, Integral, Term, postorder, reached
from potto.diagnostics import PottoError
from potto.elaborate import elaborate_expression
from potto.evaluating.world import World
from potto.projects.settings import Settings
from potto.runtime.answers.estimate import Estimate
from potto.runtime.answers.printing import format_count, format_seconds, led, with_error
from potto.runtime.answers.shown import as_dual, estimate_json, format_estimate, gives_dual, interval
from potto.runtime.evaluate import Clock, report
from potto.syntax import nodes
from potto_repl.reply import Part

SLOW = 5.0  # seconds; of a derivative that took longer the parts are not looked for, which would take as long again
MANY = 2_000_000  # evaluations; fewer that took long waited for something else, which only the first time takes
TINY = 1e-13


class Parts(Struct, frozen=True):
    """The two parts of a tangent, each with its error."""

    interior: Any
    interior_error: Any
    boundary: Any
    boundary_error: Any


def tail(estimate: Estimate, settings: Settings) -> str:
    """Method, evaluations and time; nothing if there was nothing to do."""
    if not estimate.evals and estimate.seconds < 0.05:
        return ""
    words = [estimate.method]
    if "mc" in estimate.method:
        most = "up to " if "qmc" in estimate.method else ""  # it stops where that is enough, or the budget is spent
        words += [f"{most}{settings.samples:,} samples", f"seed {settings.seed}"]
    words += [format_count(estimate.evals, "evaluation"), format_seconds(estimate.seconds)]
    return ", ".join(words)


def is_dual(world: World, file: str, expr: nodes.Expr) -> bool:
    """Whether an expression gives a value together with its derivative."""
    return gives_dual(elaborate_expression(world.db, file, expr).term, world.program.linker)


def parts_of(world: World, file: str, expr: nodes.Expr, dual: Estimate, settings: Settings) -> Parts | None:
    """The tangent of a derivative as interior and boundary; None where it cannot be taken apart.

    Of a second derivative the interior is the integral of the integrand's second derivative, and the rest the boundary.
    Samples are the same in both evaluations, so that their difference has the noise of the boundary alone.
    """
    if (dual.seconds > SLOW and dual.evals > MANY) or dual.tangent is None:
        return None
    term = _called(world, elaborate_expression(world.db, file, expr).term)
    program = world.program
    if term is None or not program.linker.inexact(term):
        return None  # no integral, no parts
    machine = program.machine(settings).changed(frozen=True)
    try:
        with Clock() as clock:
            value = program.value(machine, term)
        still = as_dual(report(value, machine, clock))
    except PottoError:
        return None  # the derivative has a value, its interior alone has none
    if still.tangent is None:
        return None
    sampled = dual.method == "mc"
    error = _combined(dual.tangent_error, still.tangent_error, sampled)
    smallest = 0.0 if "mc" in dual.method else 1.0
    return Parts(still.tangent, still.tangent_error, *_difference(dual.tangent, still.tangent, error, smallest))


def _called(world: World, term: Term) -> Term | None:
    """The call of a derivative behind names; None if a delta in a function of its own makes its parts hard to tell."""
    for _ in range(100):
        if not isinstance(term, Global):
            break
        term = world.program.linker.term(term.module, term.name)
    if not isinstance(term, App):
        return None
    for parts in reached(term, resolve=world.program.linker.reach.resolve):
        integrals = [node for node in parts if isinstance(node, Integral)]
        known = {inner for node in integrals for inner in postorder(node.body) if inner.free & set(node.variables)}
        if any(isinstance(node, Delta) and node not in known for node in parts):
            return None
    return term


def _combined(whole: Any, part: Any, sampled: bool) -> Any:
    """The error of the difference. If the samples of the two parts are independent, squares of errors add up."""
    if isinstance(whole, tuple):
        return tuple(_combined(x, y, sampled) for x, y in zip(whole, part, strict=True))
    return math.sqrt(max(whole**2 - part**2, 0.0)) if sampled else whole + part


def _difference(whole: Any, part: Any, error: Any, share: float) -> tuple[Any, Any]:
    """What remains of the whole. Mere rounding, or a small enough share of its error, counts as nothing."""
    if isinstance(whole, tuple):
        pairs = [_difference(w, p, e, share) for w, p, e in zip(whole, part, error, strict=True)]
        return tuple(p[0] for p in pairs), tuple(p[1] for p in pairs)
    rest = whole - part
    if abs(rest) <= max(share * error, TINY * max(abs(whole), abs(part))):
        return 0.0, 0.0
    return rest, error


def value_parts(
    estimate: Estimate, type: str | None, settings: Settings, *, name: str = "", parts: Parts | None = None
) -> Iterator[Part]:
    """An answer: name, value ± error : type; a derivative over several lines; what it cost."""
    head = f"{name} = " if name else ""
    data = {**estimate_json(estimate, type), **({"name": name} if name else {})}
    if estimate.tangent is None:
        text = interval(estimate)
        data |= {"text": text, "_rows": [("", estimate.value, estimate.error)]}
        yield Part("answer", f"{head}{text}{f' : {type}' if type else ''}", data, numbers=True)
    else:
        text = format_estimate(estimate)
        rows = [("value", estimate.value, estimate.error), ("tangent", estimate.tangent, estimate.tangent_error)]
        if parts is not None:
            rows += [("  interior", parts.interior, parts.interior_error),
                     ("  boundary", parts.boundary, parts.boundary_error)]  # fmt: skip
            data["interior"], data["boundary"] = _plain(parts.interior), _plain(parts.boundary)
        lines = [f"{head}{led(text, estimate.converged)}{f' : {type}' if type else ''}"]
        lines += [f"  {label:<11} {with_error(value, error)}" for label, value, error in rows]
        yield Part("answer", "\n".join(lines), {**data, "text": text, "_rows": rows}, numbers=True)
    cost = tail(estimate, settings)
    if cost:
        yield Part("tail", cost)


def _plain(value: Any) -> Any:
    return [_plain(item) for item in value] if isinstance(value, tuple) else float(value)
