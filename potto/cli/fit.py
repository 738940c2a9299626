"""`potto fit`: the parameters that make a function least, or bring it to a target."""

from __future__ import annotations

import argparse
import csv
import json
import time
from typing import TYPE_CHECKING, Any

from msgspec.structs import asdict

from potto.cli.calling import add_set, argument_in, arguments_in, assignment, called, function_in, with_values
from potto.cli.console import Console
from potto.cli.evaluation_options import accounts, add_options, settings_of, show_stats

if TYPE_CHECKING:
    from potto.applications.minimization import Iterate
    from potto.applications.minimizing import Fit
    from potto.evaluating.world import World
    from potto.runtime.answers.estimate import Estimate

SUMMARY = "find the parameters that make a function least, along its derivatives"
EXAMPLE = """  potto fit lamp.po loss angle=0.2 height=1 --with shader=lin --bound angle=0:1.5
  potto fit lamp.po light angle=0.2 --data measured.csv --target brightness --trace steps.csv"""
MOST_SHOWN = 6  # numbers in a line of progress
EVERY = 1.0  # seconds between lines of progress where no one line can be overwritten


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", help="the program; `-` reads it from standard input")
    parser.add_argument("name", metavar="NAME", help="the function: a name, or an expression that is a function")
    parser.add_argument("start", metavar="NAME=EXPR", nargs="+", type=assignment, help="what is fitted, and from where")
    parser.add_argument("--with", dest="given", metavar="NAME=EXPR", action="append", default=[], type=assignment,
                        help="what another parameter is given")  # fmt: skip
    parser.add_argument("--bound", metavar="NAME=LO:HI", action="append", default=[], type=_bound,
                        help="what a parameter may be; one side may be left out")  # fmt: skip
    parser.add_argument("--target", metavar="EXPR", help="what the function should be (with --data, the name of a "
                        "column); then the mean squared distance is made least")  # fmt: skip
    parser.add_argument("--data", metavar="FILE.csv", help="parameters as columns of a table with a header line")
    parser.add_argument("--steps", type=int, default=200, help="the most steps (default 200)")
    parser.add_argument("--optimizer", dest="way", choices=("lbfgs", "gauss-newton", "adam"), default="lbfgs",
                        help="how it goes down: lbfgs; gauss-newton for a target; adam for what is noisy")  # fmt: skip
    parser.add_argument("--checkpoint", metavar="FILE", help="write the best place to FILE after every step, and go on "
                        "from there if it exists")  # fmt: skip
    parser.add_argument("--trace", metavar="FILE", help="write every step to a .csv or .json file")
    parser.add_argument("--plot", metavar="FILE", help="draw the way there: .svg, or .png and .pdf by matplotlib")
    add_set(parser)
    add_options(parser)


def _bound(text: str) -> tuple[str, tuple[float, float]]:
    name, sides = assignment(text)
    low, colon, high = sides.partition(":")
    try:
        found = float(low or "-inf"), float(high or "inf")
    except ValueError:
        found = (1.0, 0.0)
    if not colon or not found[0] < found[1]:
        raise argparse.ArgumentTypeError(f"{text!r} is not a bound; write `{name}=0:1`, from less to more")
    return name, found


def prepare(arguments: list[str]) -> list[str]:
    """Let a target begin with a minus."""
    return with_values(arguments, "--target")


def run(options: argparse.Namespace, console: Console) -> int:
    from potto.cli.opening import fail, report_others

    chosen = settings_of(options, console)
    if chosen is None:
        return 2
    if options.steps < 1:
        console.complain("potto fit: --steps must be at least 1")
        return 2
    wrong = _no_plot(options)
    if wrong is not None:
        console.complain(f"potto fit: {wrong}")
        return 2
    from potto.diagnostics import PottoError
    from potto.evaluating.world import World
    from potto.projects.settings import settings

    world = World(["."])
    answers: list[Estimate] = []
    try:
        file, options = called(world, options, [*options.start, ("", options.target or "0")])
        with settings(**asdict(chosen)), accounts(options):
            found = _fitted(world, file, options, console, answers)
    except PottoError as error:
        console.progress("")
        return fail(error, options, console)
    except (OSError, ValueError) as error:  # of the table
        console.complain(f"potto fit: {error}")
        return 2
    try:
        if options.trace:
            _write_trace(found, options.trace)
        if options.plot:
            found.plot(options.plot, _least(options))
    except OSError as error:
        console.complain(f"potto fit: {error}")
        return 1
    _tell(found, options, console)
    if options.stats:
        show_stats(answers, console)
    return max(report_others(world, file, options, console), int(not found.converged))


def _fitted(
    world: World, file: str, options: argparse.Namespace, console: Console, answers: list[Estimate]
) -> Fit:  # fmt: skip
    """The fit that the command line asks for; its evaluations join the answers.

    Raises PottoError; OSError and ValueError for the table.
    """
    from potto.applications.fitting import fit, numbers_of
    from potto.evaluating.given import each_once

    function = function_in(world, file, options.name)
    start = {name: _start(world, file, name, text) for name, text in options.start}
    given = arguments_in(world, file, options.given)
    target: Any = None
    columns = read_table(options.data) if options.data else {}
    each_once([*options.start, *options.given, *((name, f"@{options.data}:{name}") for name in columns)])
    if options.target is not None:
        by_column = options.target.strip() in columns
        target = columns.pop(options.target.strip()) if by_column else argument_in(world, file, options.target)
    unknown = [name for name in columns if name not in function.parameters]
    if unknown:
        raise ValueError(f"{options.data} has a column `{unknown[0]}`, and `{options.name}` has no such parameter; "
                         "name the column of what is measured with --target")  # fmt: skip
    bounds = dict(options.bound)
    return fit(function, start, given={**given, **columns}, bounds=bounds, target=target, steps=options.steps,
               progress=_Progress(tuple(numbers_of(start)), console), watch=answers.append, method=options.way,
               checkpoint=options.checkpoint)  # fmt: skip


def _start(world: World, file: str, name: str, text: str) -> Any:
    """What a parameter starts at: numbers, records as dicts. Raises PottoError."""
    from potto.kernels.errors import wrong_call

    help = f"numbers are fitted; what stays as it is goes after --with: `--with {name}=…`"
    if text.lstrip("(").startswith("load("):  # what a table holds is what a fit is to, hardly ever what is fitted
        raise wrong_call(f"`{name}` starts at the numbers of a file, which are data", help)
    value = argument_in(world, file, text, name)
    if callable(value):
        raise wrong_call(f"`{name}` starts at something that is not a number", help)
    return value


class _Progress:
    """A line that is overwritten on a terminal; elsewhere a line now and then."""

    def __init__(self, names: tuple[str, ...], console: Console) -> None:
        self.names, self.console, self.last = names, console, time.perf_counter()

    def __call__(self, step: Iterate) -> None:
        from potto.runtime.answers.printing import format_digits, format_error

        shown = list(zip(self.names, step.parameters, strict=True))
        at = ", ".join(f"{n} = {format_digits(v)}" for n, v in shown[:MOST_SHOWN]) + ", …" * (len(shown) > MOST_SHOWN)
        line = f"step {step.number}: {format_digits(step.value)} at {at}, slope {format_error(step.slope)}"
        self.console.progress(line)
        if not self.console.err.isatty() and time.perf_counter() - self.last > EVERY:
            self.console.complain(line)
            self.last = time.perf_counter()


def read_table(path: str) -> dict[str, Any]:
    """The columns of a CSV file with a line of names, as arrays. Raises OSError, ValueError."""
    from potto.applications.fitting import column

    with open(path, encoding="utf-8-sig", newline="") as stream:
        rows = [row for row in csv.reader(stream) if any(cell.strip() for cell in row)]
    if len(rows) < 2:
        raise ValueError(f"{path} has no line of names with lines of numbers below it")
    names = [cell.strip() for cell in rows[0]]
    for number, row in enumerate(rows[1:], 2):
        if len(row) != len(names):
            raise ValueError(f"{path}, line {number}: {len(row)} cells under {len(names)} names")
    try:
        return {name: column([float(row[i]) for row in rows[1:]]) for i, name in enumerate(names)}
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _write_trace(found: Fit, path: str) -> None:
    """Every step with its parameters by name. Raises OSError."""
    rows: list[dict[str, Any]] = []
    for step in found.steps:
        row = asdict(step)
        parameters = dict(zip(found.numbers, row.pop("parameters"), strict=True))
        rows.append({"step": row.pop("number"), **parameters, **row})
    with open(path, "w", encoding="utf-8", newline="") as stream:
        if path.endswith(".json"):
            json.dump(rows, stream, indent=1)
            return
        writer = csv.DictWriter(stream, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def _no_plot(options: argparse.Namespace) -> str | None:
    """Why what --plot asks for can't be drawn."""
    if not options.plot:
        return None
    from potto.applications.figures import complaint

    return complaint(options.plot)


def _least(options: argparse.Namespace) -> str:
    return str(options.name) if options.target is None else "mean squared distance"


def _tell(found: Fit, options: argparse.Namespace, console: Console) -> None:
    from potto.runtime.answers.shown import json_number

    console.progress("")
    count = len(found.steps) - 1
    if options.json:
        console.answer_json({
            "parameters": found.numbers, "value": json_number(found.value), "slope": json_number(found.slope),
            "converged": found.converged, "reason": found.reason, "steps": count, "evaluations": found.evaluations,
            "seconds": found.seconds, "error": json_number(found.error),
        })  # fmt: skip
        return
    console.answer(found.told(_least(options)))
