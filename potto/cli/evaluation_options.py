"""The options of commands that evaluate: method, accuracy, limits."""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING, Any

from msgspec.structs import replace

from potto.cli.console import Console
from potto.projects.project import Projects
from potto.projects.settings import BACKENDS, DEFAULTS, METHODS, Settings, problem

if TYPE_CHECKING:
    from potto.runtime.answers.estimate import Estimate


MOST_WORKERS = 1024


def add_options(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("numbers")
    group.add_argument("--method", choices=METHODS, help=_help("how integrals are estimated", "method"))
    group.add_argument("--rtol", type=_number, help=_help("relative accuracy asked for", "rtol"))
    group.add_argument("--atol", type=_number, help=_help("absolute accuracy asked for", "atol"))
    group.add_argument("--samples", type=_whole, help=_help("points of a Monte Carlo estimate", "samples"))
    group.add_argument("--seed", type=_whole, help=_help("where its random numbers start", "seed"))
    group.add_argument("--max-evals", type=_whole, help=_help("the most evaluations", "max_evals"))
    group.add_argument("--backend", choices=BACKENDS, help=_help("what computes at many points", "backend"))
    group.add_argument("--stats", action="store_true", help="say what the evaluation cost")


def add_workers(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--workers", metavar="N", type=_some, help="processes for what takes seconds (default: as many "
                        "as there are processors); the numbers are the same")  # fmt: skip


def _some(text: str) -> int:
    if not text.isdecimal() or not 1 <= int(text) <= MOST_WORKERS:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of processes; write 1 for this one alone")
    return int(text)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None


def _whole(text: str) -> int:
    try:
        value = float(text)
        if value == int(value):
            return int(value)
    except (ValueError, OverflowError):
        pass
    raise argparse.ArgumentTypeError(f"{text!r} is not a whole number")


def _help(what: str, name: str) -> str:
    return f"{what} (otherwise as `potto.toml` says, or {getattr(DEFAULTS, name)})"


def settings_of(options: argparse.Namespace, console: Console) -> Settings | None:
    """The settings that the options ask for, over those of the project; None after a complaint."""
    given = {name: getattr(options, name) for name in Settings.__struct_fields__}
    chosen = {name: value for name, value in given.items() if value is not None}
    for name, value in chosen.items():
        complaint = problem(name, value)
        if complaint is not None:
            console.complain(f"potto: --{name.replace('_', '-')}: {complaint}")
            return None
    where = getattr(options, "file", None)
    project = Projects().of(os.path.abspath(where if where and where != "-" else os.getcwd()))
    return replace(DEFAULTS if project is None else project.settings, **chosen)


def accounts(options: argparse.Namespace) -> AbstractContextManager[None]:
    """Where evaluations keep books of what they cost, if `--stats` asks for them."""
    if not options.stats:
        return nullcontext()
    from potto.integrate.costs import counting

    return counting()


def totals(estimates: Sequence[Estimate]) -> dict[str, Any]:
    """What evaluations cost, all together, with the surfaces that they met."""
    from potto.runtime.answers.batches import stats_of

    return {"surfaces": [], **stats_of(estimates)}


def show_stats(estimates: Sequence[Estimate], console: Console) -> None:
    """What evaluations cost, all together, for the person."""
    from potto.runtime.answers.printing import computed_by

    seconds = sum(estimate.seconds for estimate in estimates)
    made = sum(estimate.compile_seconds for estimate in estimates)
    plans = sum(estimate.plan_seconds for estimate in estimates)
    once = f"{plans * 1e3:.2f} ms for plans, {(made - plans) * 1e3:.2f} ms for kernels"
    console.complain(f"time: {seconds * 1e3:.2f} ms, of it made once: {once}")
    found = totals(estimates)
    surfaces = found.pop("surfaces")
    console.complain(f"computed {computed_by(found)}")
    for name, total in found.items():
        console.complain(f"{name}: {total:,}")
    kept = sum(entry["kept"] for entry in surfaces)
    console.complain(f"surfaces kept: {kept}, dropped: {len(surfaces) - kept}")
    for entry in surfaces:
        console.complain(f"  {entry['surface']}   {'kept' if entry['kept'] else 'dropped'}: {entry['why']}")
