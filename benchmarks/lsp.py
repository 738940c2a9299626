"""The language server against its goals: a real client over standard streams, 200 modules, 42,000 lines.

Run: `python benchmarks/lsp.py [--json] [--quick] [--arrays] [--peers FOLDER] [--plot FILE]`. Times are of the wall
clock between a message sent and the answer read; on a busy machine they are those of the machine, so the load is shown
before and after, and beside the times how much of a processor the server has used for one such thing, in the mean.
From the first edit on, server and client have a processor each, where there are
several.

Then files of 100 to 20,000 lines (`lsp_whole`), drawn with `--plot`; and with `--peers`, type checkers of Python from a
folder of programs (`lsp_peers`). With `--arrays`, instead of all this, the programs have arrays, records, folds and
look-ups, and beside each figure stands its ratio to that of as many lines without.
"""

from __future__ import annotations

import argparse
import json
import random
import statistics
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from installed import as_installed
from lsp_client import PUSHED, Client
from lsp_peers import COLUMNS, compare
from lsp_typing import type_like_a_person
from lsp_whole import drawn, sizes_measured, table
from lsp_workspace import resigned, workspace, written

Row = tuple[str, str, float, str, float, float]  # gate, what, value, unit, goal, stretch
RESTED = 8.0  # seconds of quiet after which a server has kept what it knows of a workspace


def replace(line: int, start: int, end: int, text: str) -> dict[str, Any]:
    return between((line, start), (line, end), text)


def between(start: tuple[int, int], end: tuple[int, int], text: str) -> dict[str, Any]:
    places = [{"line": line, "character": character} for line, character in (start, end)]
    return {"range": {"start": places[0], "end": places[1]}, "text": text}


def quantile(times: list[float], part: float) -> float:
    return sorted(times)[min(int(part * len(times)), len(times) - 1)] * 1e3


def measure(folder: Path, texts: dict[str, str], rounds: int) -> Iterator[Row]:
    client = Client(folder)
    large = texts["large"]
    client.open("large", large)
    diagnosed, used = client.diagnosed("large") - client.started, client.processor()
    yield "G7", "start to `initialize` result", client.greeted * 1e3, "ms", 250, 150
    yield "G8", "start to diagnostics of the opened 2,000-line file, cold", diagnosed * 1e3, "ms", 700, 450
    yield "", "- processor time", used * 1e3, "ms", 700, 450
    yield "G9", "whole workspace checked cold", checked(client), "s", 2.5, 1.2
    yield "", "- processor time of the server", client.processor(), "s", 2.5, 1.2
    yield "", "- processor time of its helpers, each on a processor of its own", client.ended(), "s", 2.5, 1.2
    yield "G10", "memory then", client.memory(), "MB", 120, 90
    client.quiet(RESTED)
    with client.apart():
        yield from typing(client, large, rounds)
        yield from by_a_person(client, large, max(rounds // 10, 2))
        yield from signatures(client, texts, rounds)
        yield from questions(client, large, rounds)
        yield "G10", "memory with the whole workspace checked, and after all this", client.memory(), "MB", 120, 90
        longest = pauses(client, large, rounds * 50)
        yield "G12", f"longest pause over {rounds * 50:,} random edits", longest, "ms", 20, 10
    client.process.kill()
    client = Client(folder)
    client.open("large", large)
    diagnosed, used = client.diagnosed("large") - client.started, client.processor()
    yield "G8", "start to diagnostics of the opened file, known from earlier", diagnosed * 1e3, "ms", 350, 250
    yield "", "- processor time", used * 1e3, "ms", 350, 250
    yield "G9", "whole workspace known from earlier", checked(client), "s", 2.5, 1.2
    yield "", "- processor time of the server for that", client.processor(), "s", 2.5, 1.2
    client.process.kill()


def checked(client: Client) -> float:
    """Seconds from the start to the end of the first check, as its progress says."""
    arrived, _ = client.until(lambda m: m.get("method") == "$/progress" and m["params"]["value"]["kind"] == "end")
    return arrived - client.started


def typing(client: Client, large: str, rounds: int) -> Iterator[Row]:
    lines = large.split("\n")
    line = next(n for n in range(len(lines) // 2, len(lines)) if "sin(" in lines[n])
    column = lines[line].index("sin(")
    client.quiet(1.0)
    body, broken, top = [], [], []
    used = client.processor()
    for turn in range(rounds):
        sent = client.change("large", replace(line, column, column, str(turn % 9 + 1) + "*"))
        body.append(client.diagnosed("large") - sent)
        sent = client.change("large", replace(line, column, column + 2, ""))
        body.append(client.diagnosed("large") - sent)
    used = (client.processor() - used) / len(body)
    for _ in range(rounds):
        sent = client.change("large", replace(line, column, column, "("))
        broken.append(client.diagnosed("large") - sent)
        sent = client.change("large", replace(line, column, column + 1, ""))
        broken.append(client.diagnosed("large") - sent)
        sent = client.change("large", between((0, 0), (0, 0), "\n"))
        top.append(client.diagnosed("large") - sent)
        sent = client.change("large", between((0, 0), (1, 0), ""))
        top.append(client.diagnosed("large") - sent)
    yield "", "keystroke to diagnostics, body edit, median", statistics.median(body) * 1e3, "ms", 5, 2.5
    yield "G1", "keystroke to diagnostics, body edit in the 2,000-line module, p95", quantile(body, 0.95), "ms", 5, 2.5
    yield "", "- processor time of one, mean, with all that follows in idle time", used * 1e3, "ms", 5, 2.5
    yield "G2", "the same while the text is broken, p95", quantile(broken, 0.95), "ms", 5, 2.5
    yield "G2", "the same with a line inserted at the top, p95", quantile(top, 0.95), "ms", 5, 2.5


def by_a_person(client: Client, large: str, rounds: int) -> Iterator[Row]:
    client.quiet()
    used = client.processor()
    told, answered = type_like_a_person(client, "large", large, rounds)
    used = (client.processor() - used) / len(told)
    yield (
        "G1",
        "a person types, errors made and mended: to diagnostics, median",
        statistics.median(told) * 1e3,
        "ms",
        5,
        2.5,
    )
    yield "G1", "- p95", quantile(told, 0.95), "ms", 5, 2.5
    yield "", "- to the last answer of what VS Code asks then, median", statistics.median(answered) * 1e3, "ms", 50, 16
    yield "", "- processor time of a key, mean, with all of that and idle time", used * 1e3, "ms", 50, 16


def signatures(client: Client, texts: dict[str, str], rounds: int) -> Iterator[Row]:
    """The leaf loses a parameter that its importers fill, and gets it back."""
    users = [name for name, text in texts.items() if "from m0 import f1 " in text or "import m0 as" in text]
    opened = users[:3]
    client.open("m0", texts["m0"])
    for name in opened:
        client.open(name, texts[name])
    client.quiet()
    turns = range(max(rounds // 4, 12))
    never = [text for turn in turns for text in resigned(texts["m0"], turn)]
    near, far, used = leaf_becomes(client, never, opened)
    yield "", "signature edit in a leaf to its open importers, median", statistics.median(near) * 1e3, "ms", 10, 3
    yield "G3", "signature edit in a leaf to diagnostics of its open importers, p95", quantile(near, 0.95), "ms", 10, 3
    what = f"the same, to diagnostics of all modules ({len(users)} import it), p95"
    yield "G4", what, quantile(far, 0.95), "ms", 40, 15
    yield "", "- processor time of one, mean, the first one included", used * 1e3, "ms", 40, 15
    client.change("m0", {"text": texts["m0"]})
    client.quiet()
    again = [text for turn in turns for text in resigned(texts["m0"], None)]
    near, far, _ = leaf_becomes(client, again, opened)
    yield (
        "",
        "signature edit that is taken back and done again, to open importers, p95",
        quantile(near, 0.95),
        "ms",
        10,
        3,
    )
    yield "", "- to diagnostics of all modules, p95", quantile(far, 0.95), "ms", 40, 15


def leaf_becomes(client: Client, texts: list[str], opened: list[str]) -> tuple[list[float], list[float], float]:
    """Seconds until what is open is told of and until all is done, for each text; of the processor, in the mean."""
    near, far, used = [], [], client.processor()
    for text in texts:
        sent = client.change("m0", {"text": text})
        uris = {client.uri(name) for name in opened}
        while uris:
            arrived, message = client.until(lambda m: m.get("method") == PUSHED)
            uris.discard(message["params"]["uri"])
        near.append(arrived - sent)
        far.append(max(client.quiet(0.15), arrived) - sent)
    return near, far, (client.processor() - used) / len(texts)


def questions(client: Client, large: str, rounds: int) -> Iterator[Row]:
    lines = large.split("\n")
    places = [(n, line.index("sqrt")) for n, line in enumerate(lines) if "sqrt" in line]
    rng = random.Random(1)

    def hover() -> float:
        line, column = rng.choice(places)
        place = {"textDocument": {"uri": client.uri("large")}, "position": {"line": line, "character": column}}
        return client.ask("textDocument/hover", place)[0]

    for _ in range(50):
        hover()
    client.quiet()
    idle = [hover() for _ in range(rounds * 5)]
    busy = []
    for turn in range(rounds * 2):
        client.change("large", replace(0, 0, 0, "#") if turn % 2 == 0 else replace(0, 0, 1, ""))
        client.change("m0", replace(0, 0, 0, "#") if turn % 2 == 0 else replace(0, 0, 1, ""))
        busy.append(hover())
    yield "G5", "hover p99, idle", quantile(idle, 0.99), "ms", 1, 0.5
    yield "G5", "hover p99, while everything is re-checked", quantile(busy, 0.99), "ms", 5, 2
    client.quiet()
    cancelled = []
    for _ in range(rounds):
        id = client.begin("workspace/diagnostic", {"previousResultIds": []})
        sent = client.tell("$/cancelRequest", {"id": id})
        cancelled.append(client.until(lambda m, id=id: m.get("id") == id)[0] - sent)  # type: ignore[misc]
    yield "G6", "a cancelled request is answered RequestCancelled, p95", quantile(cancelled, 0.95), "ms", 5, 2


def pauses(client: Client, text: str, edits: int) -> float:
    """The longest time between an edit somewhere and its diagnostics, in ms."""
    rng, worst = random.Random(2), 0.0
    client.change("large", {"text": text})
    client.diagnosed("large")
    lines = text.split("\n")
    for _ in range(edits // 2):
        line = rng.randrange(len(lines))
        column = rng.randrange(len(lines[line]) + 1)
        typed = rng.choice(["x", "(", " ", "1", "+", "\n", "t", ")"])
        sent = client.change("large", replace(line, column, column, typed))
        worst = max(worst, client.diagnosed("large") - sent)
        end = {"line": line + 1, "character": 0} if typed == "\n" else {"line": line, "character": column + 1}
        back = {"range": {"start": {"line": line, "character": column}, "end": end}, "text": ""}
        sent = client.change("large", back)
        worst = max(worst, client.diagnosed("large") - sent)
    return worst * 1e3


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="one object a row instead of a table")
    parser.add_argument("--quick", action="store_true", help="fewer rounds")
    parser.add_argument("--arrays", action="store_true", help="programs with arrays, beside as many lines without")
    parser.add_argument(
        "--peers", type=Path, metavar="FOLDER", help="where the programs of type checkers of Python are"
    )
    parser.add_argument("--plot", type=Path, metavar="FILE", help="draw what a key costs against the lines of the file")
    arguments = parser.parse_args()
    as_installed()
    rounds = 20 if arguments.quick else 200
    if arguments.arrays:
        plain = list(rows_of(workspace(), rounds))
        for row, beside in zip(rows_of(workspace(arrays=True), rounds), plain, strict=True):
            show(row, arguments.json, row[2] / beside[2] if beside[2] else None)
        return
    texts = workspace()
    with written(texts) as folder:
        for row in measure(folder, texts, rounds):
            show(row, arguments.json)
        if not arguments.json:
            rows = sizes_measured()
            print(table(rows))
            if arguments.plot is not None:
                drawn(rows, arguments.plot)
        if arguments.peers is not None:
            print(f"{'ms, MB':<14}" + "".join(f"{column:>12}" for column in COLUMNS))
            for server, found in compare(folder, texts, arguments.peers, 3 if arguments.quick else 10):
                print(f"{server:<14}" + "".join(f"{value:12.1f}" for value in found), flush=True)


def rows_of(texts: dict[str, str], rounds: int) -> Iterator[Row]:
    with written(texts) as folder:
        yield from measure(folder, texts, rounds)


def show(row: Row, as_json: bool, ratio: float | None = None) -> None:
    """ratio: to the same without arrays."""
    gate, what, value, unit, goal, stretch = row
    if as_json:
        told = {"gate": gate, "what": what, "value": value, "unit": unit, "goal": goal, "stretch": stretch}
        print(json.dumps(told if ratio is None else {**told, "ratio": ratio}))
        return
    verdict = "stretch" if value <= stretch else "goal" if value <= goal else "MISSED"
    beside = "" if ratio is None else f", {ratio:.2f} x without arrays"
    print(f"{gate:<4} {what:<72} {value:9.2f} {unit:<3} {goal:>6g} / {stretch:<6g} {verdict}{beside}", flush=True)


if __name__ == "__main__":
    main()
