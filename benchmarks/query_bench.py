"""What the query database and the modules layer cost: a hit, verification, a keystroke in a workspace of 200 modules.

Run: `python benchmarks/query_bench.py [--json]`. Times are of the processor, medians unless it says p95; a deep chain's
first run is on several threads, so its time is the clock's.
"""

from __future__ import annotations

import argparse
import gc
import json
import statistics
import time
from collections.abc import Callable, Iterator

from potto.modules import definition, dependencies, module_diagnostics, names, resolve, strongly_connected
from potto.query import Database, query

MODULES, DEFINITIONS, LARGE = 200, 30, 330


@query
def constant(db: Database, name: str) -> int:
    found: int = db.get_input(("n", name), 0)
    return found


@query
def chain(db: Database, n: int) -> int:
    return constant(db, "base") if n == 0 else chain(db, n - 1) + 1


@query
def loop(db: Database, times: int, turn: int) -> float:
    """Seconds for one hit from inside a query."""
    constant(db, "x")
    start = time.thread_time()
    for _ in range(times):
        constant(db, "x")
    return (time.thread_time() - start) / times


def seconds(action: Callable[[], object], clock: Callable[[], float] = time.thread_time) -> float:
    start = clock()
    action()
    return clock() - start


def engine() -> Iterator[tuple[str, float, str]]:
    db = Database()
    yield "hit inside a query", statistics.median(loop(db, 30_000, turn) for turn in range(9)) * 1e6, "us"
    hits = [seconds(lambda: [constant(db, "x") for _ in range(10_000)]) / 10_000 for _ in range(9)]
    yield "hit from outside", statistics.median(hits) * 1e6, "us"
    db.set_input(("n", "base"), 1)
    yield "chain of 5,000, first run", seconds(lambda: chain(db, 5000), time.perf_counter) * 1e3, "ms"
    db.set_input(("n", "other"), 1)
    verify, rerun = [], []
    for turn in range(9):
        db.set_input(("n", "other"), turn + 2)
        verify.append(seconds(lambda: chain(db, 5000)))
        db.set_input(("n", "base"), turn + 2)
        rerun.append(seconds(lambda: chain(db, 5000)))
    yield "chain of 5,000, verified", statistics.median(verify) * 1e3, "ms"
    yield "chain of 5,000, all changed", statistics.median(rerun) * 1e3, "ms"


def module_text(number: int, definitions: int) -> str:
    """A module that imports two others and whose definitions use each other; about seven lines each."""
    first, second = (number * 7 + 1) % MODULES, (number * 13 + 2) % MODULES
    lines = [f"from m{first} import f0 as first", f"import m{second} as second", ""]
    for index in range(definitions):
        inner = f"f{index - 1}(x, t)" if index else "first(x, t) + second.f1(x, t)" if number else "x"
        lines += [
            f"# definition {index} of module {number}",
            f"def f{index}(x, t)",
            f"    a = {inner} + {index}",
            "    b = integral [0, 1] [y < t] * y * a d(y)",
            "    c = if t > 0 then sqrt(t) else 0",
            "    a*b + c",
            "",
        ]
    return "\n".join(lines) + "\n"


def key(number: int) -> str:
    return f"/bench/m{number}.po"


def check(db: Database, file: str) -> None:
    """What the modules layer is asked for each open file after a keystroke."""
    module_diagnostics(db, file)
    for name in names(db, file):
        definition(db, file, name)
        dependencies(db, file, name)
        strongly_connected(db, file, name)
        resolve(db, file, name)


def modules() -> Iterator[tuple[str, float, str]]:
    db, texts = Database(), {number: module_text(number, DEFINITIONS) for number in range(MODULES)}
    texts[0] = module_text(0, LARGE)
    db.on_missing_input = lambda found: (None, 1)
    db.set_input(("roots",), ("/bench",), 1)
    db.set_input(("workspace",), tuple(sorted(map(key, texts))), 1)
    for number, text in texts.items():
        db.set_input(("file", key(number)), text, 0 if number == 0 else 1)
    lines = sum(text.count("\n") for text in texts.values())
    yield f"cold: {lines:,} lines in {MODULES} modules", seconds(lambda: [check(db, key(n)) for n in texts]), "s"
    gc.freeze()
    body = "    c = if t > 0 then sqrt(t) else 0\n"
    at = texts[0].index(body, len(texts[0]) // 2)
    times: dict[str, list[float]] = {"body": [], "top": [], "all": []}
    for turn in range(60):
        edited = texts[0][:at] + body.replace("0\n", f"{turn + 1}\n") + texts[0][at + len(body) :]
        for what, text in (("body", edited), ("top", f"# {turn}\n" + "\n" * turn + edited)):
            times[what].append(seconds(lambda text=text: (db.set_input(("file", key(0)), text), check(db, key(0)))))
        times["all"].append(seconds(lambda: [check(db, key(n)) for n in texts]))
    large = texts[0].count("\n")
    for what, label in (
        ("body", f"keystroke in a body, module of {large:,} lines"),
        ("top", f"lines inserted at the top, module of {large:,} lines"),
        ("all", f"then all other {MODULES - 1} modules"),
    ):
        yield label, statistics.median(times[what]) * 1e3, "ms"
        yield f"{label}, p95", sorted(times[what])[int(0.95 * len(times[what]))] * 1e3, "ms"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="one object instead of a table")
    arguments = parser.parse_args()
    rows = [*engine(), *modules()]
    if arguments.json:
        print(json.dumps([{"what": what, "value": value, "unit": unit} for what, value, unit in rows]))
        return
    for what, value, unit in rows:
        print(f"{what:<60} {value:9.3f} {unit}")


if __name__ == "__main__":
    main()
