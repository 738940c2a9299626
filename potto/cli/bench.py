"""`potto bench`: speed against error, beside the peers that are installed."""

from __future__ import annotations

import argparse
import difflib
import itertools
from typing import TYPE_CHECKING

from potto.cli.console import Console
from potto.extras import install_command

if TYPE_CHECKING:
    from potto.bench.adapter import Adapter
    from potto.bench.measure import BenchRun
    from potto.bench.problems import BenchProblem, Quantity

SUMMARY = "measure speed against error, beside other integrators that are installed"
EXAMPLE = "  potto bench eq1-quad disc --csv runs.csv --plot runs.png"
SECONDS = 0.2
QUICK_SECONDS, QUICK_RUNGS = 0.02, 4


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("problems", metavar="PROBLEM", nargs="*", help="which problems; all of them by default")
    parser.add_argument("--list", action="store_true", help="say which problems and methods there are")
    parser.add_argument("--methods", metavar="A,B", help="only methods whose names hold one of these words")
    parser.add_argument("--quantity", choices=("value", "derivative", "both"), default="both", help="what is computed")
    parser.add_argument("--by", choices=("time", "evaluations"), default="time", help="what the table counts")
    parser.add_argument("--seconds", type=float, default=SECONDS, help="how long one answer may take (default 0.2)")
    parser.add_argument("--quick", action="store_true", help="only the first and cheapest settings of each method")
    parser.add_argument("--csv", metavar="FILE", help="write every run to a CSV file")
    parser.add_argument("--plot", metavar="FILE", help="draw error against time and evaluations (.png, .svg, .pdf)")


def run(options: argparse.Namespace, console: Console) -> int:
    from potto.bench import report
    from potto.bench.measure import measure
    from potto.bench.plotting import has_matplotlib

    chosen = _problems(options.problems, console)
    adapters = _adapters(options.methods, console)
    if chosen is None or adapters is None:
        return 2
    if options.plot and not has_matplotlib():
        console.complain(f"potto bench: --plot needs matplotlib; install it with `{install_command('bench')}`")
        return 2
    if not options.seconds > 0:
        console.complain("potto bench: --seconds must be positive")
        return 2
    if options.list:
        _list(chosen, adapters, options, console)
        return 0
    quantities: tuple[Quantity, ...] = ("value", "derivative")
    if options.quantity != "both":
        quantities = (options.quantity,)
    seconds, rungs = (QUICK_SECONDS, QUICK_RUNGS) if options.quick else (options.seconds, None)
    if not options.json:
        console.answer(report.header(adapters))
    runs: list[BenchRun] = []
    for problem, quantity in itertools.product(chosen, quantities):
        console.progress(f"{problem.id}, {quantity} …")
        runs += measure([problem], adapters, [quantity], seconds, rungs)
        console.progress("")
        if not options.json:
            console.answer("\n" + report.table(problem, quantity, runs, options.by))
            console.out.flush()
    if options.json:
        console.answer_json(report.as_json(runs, adapters))
    else:
        rates = report.rates_table(report.rates(runs, adapters))
        console.answer(f"\n{rates}" if rates else "")
    return _files(runs, chosen, quantities, options, console)


def _files(
    runs: list[BenchRun], problems: list[BenchProblem], quantities: tuple[Quantity, ...], options: argparse.Namespace,
    console: Console,
) -> int:  # fmt: skip
    """Write the files that were asked for."""
    from potto.bench.plotting import save
    from potto.bench.report import write_csv

    try:
        if options.csv:
            with open(options.csv, "w", encoding="utf-8") as stream:
                write_csv(runs, stream)
        if options.plot:
            save(problems, quantities[-1], runs, options.plot)
    except (OSError, ValueError) as error:
        console.complain(f"potto bench: {error}")
        return 1
    return 0


def _problems(names: list[str], console: Console) -> list[BenchProblem] | None:
    from potto.bench.problems import catalogue

    known = {problem.id: problem for problem in catalogue()}
    for name in names:
        if name not in known:
            near = difflib.get_close_matches(name, known, 1)
            hint = f"did you mean `{near[0]}`?" if near else f"there are {', '.join(known)}"
            console.complain(f"potto bench: there is no problem `{name}`; {hint}")
            return None
    return [problem for name, problem in known.items() if not names or name in names]


def _adapters(words: str | None, console: Console) -> list[Adapter] | None:
    from potto.bench.ours import OURS
    from potto.bench.peers import PEERS

    known: list[Adapter] = [*OURS, *PEERS]
    if words is None:
        return known
    wanted = [word.strip() for word in words.split(",") if word.strip()]
    found = [a for a in known if any(word.lower() in a.name.lower() for word in wanted)]
    if not found:
        console.complain(f"potto bench: no method is named {words}; there are {', '.join(a.name for a in known)}")
        return None
    return found


def _list(problems: list[BenchProblem], adapters: list[Adapter], options: argparse.Namespace, console: Console) -> None:
    if options.json:
        console.answer_json({
            "problems": [{"id": p.id, "title": p.title, "why": p.why, "program": p.program, "wrt": p.parameter,
                          "at": p.at, "exact": dict(p.exact)} for p in problems],
            "methods": [{"name": a.name, "missing": a.missing()} for a in adapters],
        })  # fmt: skip
        return
    for problem in problems:
        console.answer(f"{problem.id:<12}{problem.title}: {problem.why}")
    console.answer("")
    for adapter in adapters:
        needed = adapter.missing()
        console.answer(f"{adapter.name:<20}{'installed' if needed is None else f'not installed ({needed})'}")
