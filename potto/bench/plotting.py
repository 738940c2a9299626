"""The report of the bench as a picture: error against time, and against evaluations, a pair of panels a problem.

Owns the plot and is the only code that knows matplotlib, which is imported when a plot is asked for.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from potto.bench.measure import BenchRun
from potto.bench.problems import BenchProblem, Quantity

LEAST = 1e-17  # where an error of zero is drawn
PAIRS = 2  # of panels in a row
_STYLES = {
    "potto quadrature": ("#d62728", "o", 2.4), "potto qmc": ("#ff7f0e", "s", 1.8), "potto mc": ("#e6b800", "^", 1.8),
}  # fmt: skip
_OTHERS = ("#1f77b4", "#17becf", "#2ca02c", "#9467bd", "#8c564b", "#7f7f7f", "#000000", "#e377c2")


def has_matplotlib() -> bool:
    from importlib.util import find_spec

    return find_spec("matplotlib") is not None


def save(problems: Sequence[BenchProblem], quantity: Quantity, runs: Sequence[BenchRun], path: str) -> None:
    """Draw one quantity of some problems into a file; its ending says the format. Raises OSError, ValueError."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    shown = [p for p in problems if any(r.problem == p.id and r.quantity == quantity for r in runs)]
    rows = math.ceil(len(shown) / PAIRS) or 1
    columns = 2 * min(PAIRS, max(len(shown), 1))
    figure = Figure(figsize=(3.4 * columns, 2.7 * rows + 0.9), layout="constrained", dpi=110)
    FigureCanvasAgg(figure)
    methods = list(dict.fromkeys(run.method for run in runs))
    handles: dict[str, Any] = {}
    for number, problem in enumerate(shown):
        row, pair = divmod(number, PAIRS)
        for half in (0, 1):
            axes = figure.add_subplot(rows, columns, row * columns + 2 * pair + half + 1)
            _panel(axes, problem, quantity, runs, methods, half == 1, handles)
    figure.suptitle(f"Relative error of the {quantity}, against time and against evaluations", fontsize=11)
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=5, fontsize=8)
    figure.savefig(path)


def _panel(
    axes: Any, problem: BenchProblem, quantity: Quantity, runs: Sequence[BenchRun], methods: Sequence[str],
    counted: bool, handles: dict[str, Any],
) -> None:  # fmt: skip
    for index, method in enumerate(methods):
        mine = [r for r in runs if (r.problem, r.quantity, r.method) == (problem.id, quantity, method)]
        mine = [r for r in mine if not r.failure and math.isfinite(r.error)]
        color, marker, width = _STYLES.get(method, (_OTHERS[index % len(_OTHERS)], ".", 1.0))
        across = [r.evaluations if counted else r.seconds * 1e3 for r in mine]
        up = [max(r.error, LEAST) for r in mine]
        if mine:
            (handles[method],) = axes.loglog(across, up, marker=marker, color=color, lw=width, ms=4, label=method)
    axes.set_title(problem.title, fontsize=9)
    axes.set_xlabel("evaluations" if counted else "ms", fontsize=8)
    axes.set_ylim(LEAST / 3, 30)
    axes.tick_params(labelsize=7)
    axes.grid(True, lw=0.3)
