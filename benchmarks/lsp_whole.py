"""What editors ask about whole files, at 250, 1,000 and 5,000 definitions: cold, and after a key.

Run: `python benchmarks/lsp_whole.py [SIZE ...]`. Milliseconds of processor time of the server, for a request by itself;
and, for a key after which all are asked at once, as editors do, the time of the wall clock until diagnostics came and
until the last answer did. All should grow as the file does.
"""

from __future__ import annotations

import itertools
import os
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from installed import as_installed
from lsp_workspace import definition

from lsp import Client, replace

KEYS = 5
METHODS = (
    "codeLens", "semanticTokens/full", "documentSymbol", "inlayHint", "foldingRange", "documentLink", "formatting",
)  # fmt: skip


def program(definitions: int) -> str:
    """Every tenth definition is looked at by a live expression."""
    written: list[str] = []
    for number in range(definitions):
        lines = definition(0, number, [])
        if number % 10 == 0:
            lines.insert(-1, f"#> f{number}(0.5, 1)")
        written += lines
    return "\n".join(written) + "\n"


class Whole:
    """A server with one large file open."""

    def __init__(self, folder: Path, text: str) -> None:
        self.client, self.text = Client(folder), text
        self.lines = text.split("\n")
        self.client.open("large", text)
        self.client.diagnosed("large")
        self.client.quiet(1.0)

    def params(self) -> dict[str, Any]:
        whole = {"start": {"line": 0, "character": 0}, "end": {"line": len(self.lines), "character": 0}}
        options = {"tabSize": 4, "insertSpaces": True}
        return {"textDocument": {"uri": self.client.uri("large")}, "range": whole, "options": options}

    def cost(self, method: str) -> float:
        """Milliseconds of processor time for a request."""
        before = self.client.processor()
        _, answer = self.client.ask(f"textDocument/{method}", self.params())
        assert "result" in answer, answer
        return (self.client.processor() - before) * 1e3

    def key(self, turn: int) -> float:
        """Type a character in the middle; when it was sent."""
        line = next(n for n in range(len(self.lines) // 2, len(self.lines)) if "sqrt(" in self.lines[n])
        column = self.lines[line].index("sqrt(")
        return self.client.change("large", replace(line, column, column + (2 if turn else 0), f"{turn % 8 + 2}*"))

    def cost_after_a_key(self, method: str, turn: int) -> float:
        """The same when the diagnostics after a key have come."""
        self.key(turn)
        self.client.diagnosed("large")
        self.client.quiet(0.3)
        return self.cost(method)

    def after_a_key(self, turn: int) -> tuple[float, float]:
        """Milliseconds until the diagnostics, and until the last answer to what is asked together."""
        sent = self.key(turn)
        waiting = {self.client.begin(f"textDocument/{method}", self.params()) for method in METHODS}
        told = 0.0
        while waiting or not told:
            arrived, message = self.client.until(lambda message: True)
            waiting.discard(message.get("id", 0) if "method" not in message else 0)
            version = message.get("params", {}).get("version") if "method" in message else None
            told = told or (arrived if version == self.client.versions["large"] else 0.0)
        return (told - sent) * 1e3, (time.perf_counter() - sent) * 1e3


def main() -> None:
    sizes = [int(size) for size in sys.argv[1:]] or [250, 1_000, 5_000]
    rows: dict[str, list[float]] = {}
    with tempfile.TemporaryDirectory(prefix="potto-bench-") as name, tempfile.TemporaryDirectory() as cache:
        os.environ["POTTO_CACHE"] = cache
        as_installed()
        for size in sizes:
            whole = Whole(Path(name), program(size))
            for method in METHODS:
                rows.setdefault(f"{method}, cold", []).append(whole.cost(method))
            keys = itertools.count()
            for method in METHODS:
                costs = [whole.cost_after_a_key(method, next(keys)) for _ in range(KEYS)]
                rows.setdefault(f"{method}, after a key", []).append(statistics.mean(costs))
            found = [whole.after_a_key(next(keys)) for _ in range(KEYS)]
            told, answered = (statistics.median(times) for times in zip(*found))
            rows.setdefault("all at once after a key: to the diagnostics (wall)", []).append(told)
            rows.setdefault("- to the last answer (wall)", []).append(answered)
            whole.client.process.kill()
    print(f"{'ms':<52}" + "".join(f"{size:>10,}" for size in sizes))
    for what, costs in rows.items():
        print(f"{what:<52}" + "".join(f"{cost:10.1f}" for cost in costs))


if __name__ == "__main__":
    main()
