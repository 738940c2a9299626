"""The report of the bench: tables for a terminal, rows for CSV, objects for machines.

Owns the look of the report. For each problem a table says what each method needs to come within 1e-2, 1e-4 … of the
exact answer; the rates of convergence of the random methods follow.
"""

from __future__ import annotations

import csv
import math
import platform
import statistics
from collections.abc import Iterable, Sequence
from typing import Any, Literal, TextIO

from msgspec import Struct
from msgspec.structs import asdict

from potto.bench.adapter import Adapter, installed
from potto.bench.measure import BenchRun, slope
from potto.bench.problems import QUANTITIES, BenchProblem, Quantity, catalogue
from potto.runtime.answers.printing import format_error

Measure = Literal["time", "evaluations"]
TARGETS = (1e-2, 1e-4, 1e-6, 1e-8, 1e-12)
BLANK = "-"
_PACKAGES = ("numpy", "scipy", "vegas", "jax")


class Rate(Struct, frozen=True):
    """How fast the error of a random method falls: error ~ evaluations^rate."""

    problem: str
    quantity: Quantity
    method: str
    rate: float


def header(adapters: Iterable[Adapter]) -> str:
    """What was measured on what, and which peers are not there."""
    there = [f"{name} {found}" for name in _PACKAGES if (found := installed(name))]
    lines = [f"Python {platform.python_version()}, {', '.join(there)}; {platform.machine()}, {platform.system()}"]
    for adapter in adapters:
        needed = adapter.missing()
        if needed is not None:
            lines.append(f"{adapter.name}: not installed (pip install '{needed}')")
    return "\n".join(lines)


def table(problem: BenchProblem, quantity: Quantity, runs: Sequence[BenchRun], measure: Measure = "time") -> str:
    """One problem as a table: per method what it needs for each accuracy, its best error, and what it says of that."""
    here = [run for run in runs if run.problem == problem.id and run.quantity == quantity]
    what = "milliseconds" if measure == "time" else "evaluations"
    lines = [f"{problem.id}, {quantity}: {problem.title}; {problem.why}"]
    heads = "".join(f"{f'{t:.0e}'.replace('e-0', 'e-'):>10}" for t in TARGETS)
    lines.append(f"  {f'{what} to an error of':<24}{heads}   {'least error':>11} {'reported':>9}")
    for method in dict.fromkeys(run.method for run in here):
        rungs = [run for run in here if run.method == method]
        lines.append(f"  {method:<24}{_row(rungs, measure)}")
    return "\n".join(lines)


def _row(rungs: Sequence[BenchRun], measure: Measure) -> str:
    done = [run for run in rungs if not run.failure]
    if not done:
        return f" failed: {rungs[-1].failure}"
    cells = [_cost(needed(done, target), measure) for target in TARGETS]
    best = min(done, key=lambda run: math.inf if math.isnan(run.error) else run.error)
    said = format_error(best.reported) if best.reported is not None else BLANK
    failed = f"  then {rungs[-1].failure}" if rungs[-1].failure else ""
    return f"{''.join(f'{cell:>10}' for cell in cells)}   {best.error:>11.0e} {said:>9}{failed}"


def needed(rungs: Sequence[BenchRun], target: float) -> BenchRun | None:
    """The cheapest rung from which on every error is within the target: one lucky rung does not count."""
    found = None
    for run in reversed(rungs):
        if not run.error <= target:
            break
        found = run
    return found


def _cost(run: BenchRun | None, measure: Measure) -> str:
    if run is None:
        return BLANK
    return f"{run.seconds * 1e3:.3g}" if measure == "time" else f"{run.evaluations:,}"


def rates(runs: Sequence[BenchRun], adapters: Iterable[Adapter]) -> list[Rate]:
    """The rates of convergence of methods that draw random numbers."""
    found: list[Rate] = []
    for adapter in adapters:
        mine = [run for run in runs if run.method == adapter.name] if adapter.random else []
        for problem, quantity in dict.fromkeys((run.problem, run.quantity) for run in mine):
            rate = slope(run for run in mine if run.problem == problem and run.quantity == quantity)
            if rate is not None:
                found.append(Rate(problem, quantity, adapter.name, rate))
    return found


def rates_table(found: Sequence[Rate]) -> str:
    """The rates by method and problem, with their medians."""
    if not found:
        return ""
    lines = ["error ~ evaluations^rate; Monte Carlo: -1/2, quasi-Monte Carlo behind smooth edges: about -1"]
    methods = list(dict.fromkeys(r.method for r in found))
    columns = list(dict.fromkeys((r.problem, r.quantity) for r in found))
    places = {problem.id: place for place, problem in enumerate(catalogue())}
    columns.sort(key=lambda column: (places.get(column[0], len(places)), QUANTITIES.index(column[1])))
    lines.append(f"  {'':<22}" + "".join(f"{m:>18}" for m in methods))
    by = {(r.problem, r.quantity, r.method): r.rate for r in found}
    for problem, quantity in columns:
        cells = [by.get((problem, quantity, m)) for m in methods]
        told = "".join(f"{BLANK if c is None else f'{c:.2f}':>18}" for c in cells)
        lines.append(f"  {f'{problem}, {quantity}':<22}{told}")
    medians = [statistics.median(r.rate for r in found if r.method == m) for m in methods]
    lines.append(f"  {'median':<22}" + "".join(f"{m:>18.2f}" for m in medians))
    return "\n".join(lines)


def write_csv(runs: Iterable[BenchRun], stream: TextIO) -> None:
    """Every run as a row, all digits."""
    writer = csv.DictWriter(stream, BenchRun.__struct_fields__, lineterminator="\n")
    writer.writeheader()
    writer.writerows(asdict(run) for run in runs)


def as_json(runs: Sequence[BenchRun], adapters: Sequence[Adapter]) -> dict[str, Any]:
    """The report for machines."""
    methods = [{"name": a.name, "installed": a.missing() is None, "package": a.package} for a in adapters]
    return {
        "methods": methods,
        "runs": [{name: _plain(value) for name, value in asdict(run).items()} for run in runs],
        "rates": [asdict(rate) for rate in rates(runs, adapters)],
    }


def _plain(value: Any) -> Any:
    """nan and infinities as strings, as everywhere."""
    if isinstance(value, float) and not math.isfinite(value):
        return "nan" if math.isnan(value) else ("inf" if value > 0 else "-inf")
    return value
