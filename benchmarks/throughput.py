"""How much in how little time, beside numpy and C by hand: `python benchmarks/throughput.py [--only NAME]`.

Each line is measured with what it is held against in one run, and says whether its goal is met. Times are those of the
processor, on one thread, as others may use the machine. A value that is wrong has no time. C is compiled by `cc`, and
left out where there is none; peers (scipy, vegas, quadax, JAX, Teg) are told of where they can be imported.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict
from pathlib import Path
from typing import Any

for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):  # before numpy is loaded
    os.environ.setdefault(variable, "1")

from abilities import duration  # noqa: E402
from throughput_by_hand import compiled  # noqa: E402
from throughput_lines import FAR, LINES, Asked, Row  # noqa: E402
from throughput_peers import one_integral  # noqa: E402

import potto  # noqa: E402


def backend(name: str | None) -> AbstractContextManager[Any]:
    """The setting of a backend, where there is one."""
    if name is None:
        return nullcontext()
    try:
        with potto.settings(backend=name):
            return potto.settings(backend=name)
    except potto.PottoError:
        if name == "numpy":
            return nullcontext()
        raise SystemExit(f"this Potto has no setting `backend`, so {name!r} cannot be asked for") from None


def measured(name: str, asked: Asked) -> Iterator[Row]:
    """The rows of a line; a row that says so where it breaks off."""
    try:
        yield from LINES[name][1](asked)
    except potto.PottoError as error:
        yield Row("no answer", 0, math.nan, math.inf, note=error.diagnostics[0].message[:90])


def told(row: Row) -> str:
    """A row as text."""
    size = f"{row.size:,}" if row.size else ""
    if not row.off <= FAR:
        reason = row.note or f"off by {row.off:.1e}"
        return f"  {row.name:24} {size:>9}  no time: {reason}"
    text = f"  {row.name:24} {size:>9} {duration(row.seconds):>10} {row.off:8.0e}"
    for theirs in (row.numpy, row.c):
        text += " " * 22 if math.isnan(theirs) else f" {duration(theirs):>10} ({row.seconds / theirs:7.3g}x)"
    goal = "" if math.isnan(row.goal) else f"goal {duration(row.goal)}: "
    met = {None: "", True: "met", False: "NOT MET"}[row.met]
    return f"{text} {goal}{met}{f' ({row.note})' if row.note else ''}"


def plain(row: Row) -> dict[str, Any]:
    """For JSON, which has neither nan nor infinities."""
    shown = {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in asdict(row).items()}
    return {**shown, "met": row.met}


def plot(path: str, found: dict[str, list[Row]]) -> None:
    """Time against size, a panel a line, ours beside what is done by hand."""
    try:
        import matplotlib
    except ImportError:
        raise SystemExit("a plot needs matplotlib: pip install '.[bench]'") from None
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    shown = {name: rows for name, rows in found.items() if len({row.size for row in rows if row.off <= FAR}) > 1}
    if not shown:
        raise SystemExit("there is nothing to plot: no line with several sizes was measured")
    columns = min(3, len(shown))
    rows_of = -(-len(shown) // columns)
    figure, axes = plt.subplots(rows_of, columns, figsize=(4.5 * columns, 3.5 * rows_of), squeeze=False)
    for axis in axes.flat[len(shown) :]:
        axis.set_axis_off()
    for axis, (name, rows) in zip(axes.flat, shown.items(), strict=False):
        right = sorted((row for row in rows if row.off <= FAR), key=lambda row: row.size)
        for label, key, style in (("potto", "seconds", "o-"), ("numpy by hand", "numpy", "s--"), ("C", "c", "^:")):
            points = [(row.size, getattr(row, key)) for row in right if math.isfinite(getattr(row, key))]
            if points:
                axis.loglog(*zip(*points, strict=True), style, label=label)
        axis.set_title(LINES[name][0], fontsize=8)
        axis.set_xlabel("size")
        axis.set_ylabel("seconds of the processor")
        axis.legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(path, dpi=120)
    print(f"{path}: time against size")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", metavar="NAME", action="append", help=f"of {', '.join(LINES)}; may be repeated")
    parser.add_argument("--json", metavar="FILE", type=Path, help="put what was found there as well")
    parser.add_argument("--plot", metavar="FILE", help="draw time against size (needs matplotlib)")
    parser.add_argument("--backend", choices=("auto", "numpy", "native"), help="what kernels are made of")
    parser.add_argument("--seconds", type=float, default=Asked.seconds, help="for a measurement (%(default)s)")
    options = parser.parse_args()
    for name in options.only or ():
        if name not in LINES:
            parser.error(f"there is no line {name!r}; there are: {', '.join(LINES)}")
    asked = Asked(options.seconds, options.backend == "native")
    print(f"goals for {'machine code' if asked.native else 'numpy'}; seconds of the processor, one thread")
    if compiled() is None:
        print("no C: there is no compiler `cc`, or it fails")
    print(f"  {'':24} {'size':>9} {'potto':>10} {'off':>8} {'numpy by hand':>21} {'C by hand':>21}")
    found: dict[str, list[Row]] = {}
    with backend(options.backend):
        for name in options.only or LINES:
            print(f"\n{name}: {LINES[name][0]}")
            found[name] = []
            for row in measured(name, asked):
                found[name].append(row)
                print(told(row), flush=True)
        if "one" in found:
            one_integral(sys.stdout, asked)
    rows = [row for rows in found.values() for row in rows if row.met is not None]
    print(f"\n{sum(bool(row.met) for row in rows)} of {len(rows)} goals are met")
    if options.json:
        shown = {name: [plain(row) for row in rows] for name, rows in found.items()}
        options.json.write_text(json.dumps(shown, indent=1) + "\n", encoding="utf-8")
    if options.plot:
        plot(options.plot, found)


if __name__ == "__main__":
    main()
