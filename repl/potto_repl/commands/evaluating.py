"""Commands that evaluate without making an entry: values, derivatives at a point, time, accuracy."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from typing import Any

from msgspec.structs import replace

from potto.checking.check import absolute
from potto.elaborate import elaborate_expression
from potto.evaluating.answering import EXPRESSION
from potto.kernels.making import counts
from potto.projects.settings import Settings
from potto.reports.render import Located, ProgramError
from potto.runtime.answers.estimate import Estimate
from potto.runtime.answers.printing import (
    computed_by,
    format_bars,
    format_count,
    format_digits,
    format_error,
    format_numbers,
    format_seconds,
    largest,
    led,
    with_error,
)
from potto.runtime.answers.shown import as_dual
from potto.syntax import parse_expression
from potto.types import infer_expression
from potto_repl.expressions import call_of, checked
from potto_repl.registry import command
from potto_repl.reply import Part, Refusal, diagnostic
from potto_repl.session import Conversation, plain_names
from potto_repl.shown_values import is_dual, parts_of, tail, value_parts
from potto_repl.slopes import all_slopes

TOLERANCES = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
SAMPLES = (1_000, 10_000, 100_000)
ROUND, ROUNDS, MOST_TIMES = 0.1, 7, 10_000  # seconds of a round of `:timeit`, how many, of how many evaluations at most
BRIEF = 3.0  # seconds: what took no longer may be done twice


@command("eval", "e", argument="EXPR", completes="expression")
def evaluate(session: Conversation, text: str) -> Iterator[Part]:
    """Evaluate an expression without making it an entry: `_` and the numbering stay."""
    asked = checked(session, text, ":eval EXPR")
    answer = session.evaluate(asked.text, session.settings)
    estimate, parts = answer.estimate, None
    if is_dual(session.world, session.file, asked.expr):
        estimate = as_dual(estimate)
        parts = parts_of(session.world, session.file, asked.expr, estimate, session.settings)
    yield from value_parts(estimate, answer.type, session.settings, parts=parts)
    for located in answer.remarks:
        yield diagnostic(located, session.world.sources(asked.text))


@command("grad", "g", argument="f(0.3, …)", completes="expression")
def gradient(session: Conversation, text: str) -> Iterator[Part]:
    """Show the derivative of a call by each of its numbers, interior and boundary apart: `:grad f(0.3)`."""
    called = call_of(session, text, ":grad f(0.3)")
    lines: list[str] = []
    data: dict[str, Any] = {}
    cost = ""
    for slope in all_slopes(session, called):
        dual = slope.dual
        if not lines:
            lines.append(f"{text.strip()} = {led(with_error(dual.value, dual.error), dual.converged)}")
            data["value"] = dual.value
        sign = "∂/∂" if session.options.unicode else "d/d"
        line = f"  {sign}{slope.name} = {led(with_error(dual.tangent, dual.tangent_error), dual.converged)}"
        if slope.parts is not None:
            interior = format_numbers(slope.parts.interior, slope.parts.interior_error)
            boundary = format_numbers(slope.parts.boundary, slope.parts.boundary_error)
            line += f"   interior {interior}, boundary {boundary}"
        lines.append(line)
        data[slope.name] = dual.tangent
        cost = tail(dual, session.settings)
    yield Part("answer", "\n".join(lines), {"gradient": data}, numbers=True)
    if cost:
        yield Part("tail", cost)


@command("time", argument="EXPR", completes="expression")
def show_time(session: Conversation, text: str) -> Iterator[Part]:
    """Show how long each step towards a value takes: parse, check, compile, link, plan, evaluate."""
    text = plain_names(text)
    if not text:
        raise Refusal("an expression is missing", "write `:time EXPR`")
    phases: dict[str, float] = {}
    start = time.perf_counter()
    parsed = parse_expression(text)
    start = _lap(phases, "parse", start)
    inferred = infer_expression(session.db, session.file, parsed.expr)
    found = [*parsed.diagnostics, *inferred.diagnostics]
    start = _lap(phases, "check", start)
    wrong = [absolute(session.db, EXPRESSION, d, 0) for d in found if d.severity == "error"]
    if wrong:
        raise ProgramError([Located(EXPRESSION, d) for d in wrong], session.world.sources(text))
    term = elaborate_expression(session.db, session.file, parsed.expr).term
    start = _lap(phases, "compile", start)
    program = session.world.program
    linked = counts.linked
    program.linker.inexact(term)  # follows every definition that the term refers to
    _lap(phases, "link", start)
    linked = counts.linked - linked
    estimate = session.evaluate(text, session.settings).estimate
    phases["compile"] += estimate.compile_seconds - estimate.plan_seconds
    phases["plan"] = estimate.plan_seconds
    phases["evaluate"] = max(estimate.seconds - estimate.compile_seconds, 0.0)
    total = sum(phases.values())
    rows = [f"{name:<9} {format_seconds(spent):>9}  {spent / total:4.0%}" for name, spent in phases.items()]
    stats = {**estimate.stats, "definitions linked": linked + estimate.stats["definitions linked"]}
    rows += [
        f"{'total':<9} {format_seconds(total):>9}",
        *_made(stats),
        f"{format_count(estimate.evals, 'evaluation')}, {computed_by(stats)}",
    ]
    data = {"seconds": phases, "kernels": stats["kernels compiled"], "evaluations": estimate.evals, "stats": stats}
    yield Part("answer", "\n".join(rows), data)


def _made(stats: dict[str, Any]) -> Iterator[str]:
    """What was made for an evaluation, and what was there."""
    yield f"{format_count(stats['definitions linked'], 'definition')} linked"
    compiled, kept, again = (stats[f"kernels {how}"] for how in ("compiled", "from disk", "reused"))
    yield f"{format_count(compiled, 'kernel')} made, {kept:,} from the cache, {again:,} used again"
    compiled, kept = (stats[f"machine code {how}"] for how in ("compiled", "from the cache"))
    if compiled or kept:
        yield f"{format_count(compiled, 'function')} of machine code made, {kept:,} from the cache"


@command("timeit", argument="EXPR", completes="expression")
def time_often(session: Conversation, text: str) -> Part:
    """Show what an evaluation takes when it is done again and again: `:timeit f(0.3)`.

    What is made once, plans and kernels, does not count. The least of several rounds is what the machine can do, the
    median what it did.
    """
    asked = checked(session, text, ":timeit EXPR")

    def seconds(times: int) -> float:
        start = time.perf_counter()
        for _ in range(times):
            session.evaluate(asked.text, session.settings)
        return (time.perf_counter() - start) / times

    seconds(1)
    once = seconds(1)
    times = max(1, min(MOST_TIMES, round(ROUND / max(once, 1e-9))))
    rounds = sorted(seconds(times) for _ in range(ROUNDS if once < BRIEF else 1))
    least, median = rounds[0], rounds[len(rounds) // 2]
    told = f"{len(rounds)} rounds of {times:,}" if len(rounds) > 1 else "one round"
    shown = [f"{format_digits(1e3 * found, 3)} ms" for found in (least, median)]
    return Part("answer", f"{shown[0]} at least, {shown[1]} in the median of {told}",
                {"least": least, "median": median, "rounds": len(rounds), "times": times}, prose=True)  # fmt: skip


def _lap(phases: dict[str, float], name: str, start: float) -> float:
    now = time.perf_counter()
    phases[name] = now - start
    return now


@command("error", argument="EXPR", completes="expression")
def show_error(session: Conversation, text: str) -> Iterator[Part]:
    """Show how accuracy is paid for: value, estimated and actual error, evaluations and time, by method.

    The actual error is the distance from the most accurate answer in the table.
    """
    asked = checked(session, text, ":error EXPR")
    dual = is_dual(session.world, session.file, asked.expr)
    rows: list[tuple[str, str, Estimate]] = []
    attempts = list(_attempts(session.settings))
    for number, (label, accuracy, settings) in enumerate(attempts):
        if session.progress is not None:
            session.progress(f"{label} {accuracy}", number / len(attempts))
        estimate = session.evaluate(asked.text, settings).estimate
        if estimate.seconds < BRIEF and label not in {row[0] for row in rows}:
            estimate = session.evaluate(asked.text, settings).estimate  # what only the first time takes is not counted
        rows.append((label, accuracy, as_dual(estimate) if dual else estimate))
    if rows[0][2].text is not None:
        raise Refusal(f"`{asked.text}` is a function, which has no error", "give it its arguments")
    numbers = [(e.tangent, e.tangent_error) if dual else (e.value, e.error) for _, _, e in rows]
    best = min(numbers, key=lambda pair: largest(pair[1]))
    table = [("method", "asked", "value" if not dual else "tangent", "error", "actual", "evaluations", "time")]
    data = []
    for (label, accuracy, e), (value, error) in zip(rows, numbers, strict=True):
        actual = distance(value, best[0])
        table.append((label, accuracy, *format_bars(value, error), format_error(actual), f"{e.evals:,}",
                      format_seconds(e.seconds)))  # fmt: skip
        data.append({"method": label, "asked": accuracy, "error": largest(error), "actual": actual, "evals": e.evals})
    yield Part("answer", columns(table), {"table": data})


def _attempts(settings: Settings) -> Iterator[tuple[str, str, Settings]]:
    for rtol in TOLERANCES:
        yield "quadrature", f"{rtol:.0e}", replace(settings, method="quadrature", rtol=rtol, atol=0.0)
    for samples in SAMPLES:
        yield "mc", f"{samples:,}", replace(settings, method="mc", samples=samples)
    for samples in SAMPLES:
        yield "qmc", f"{samples:,}", replace(settings, method="qmc", samples=samples)


def distance(a: Any, b: Any) -> float:
    """The largest difference between the numbers of two values."""
    if isinstance(a, tuple | list):
        return max((distance(x, y) for x, y in zip(a, b, strict=True)), default=0.0)
    return abs(float(a) - float(b))


def columns(rows: Sequence[tuple[str, ...]]) -> str:
    """Rows of words under each other; all but the first column to the right."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return "\n".join(
        "  ".join([row[0].ljust(widths[0]), *(word.rjust(w) for word, w in zip(row[1:], widths[1:], strict=True))])
        for row in rows
    )
