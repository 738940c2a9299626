"""What a key costs in files of 100 to 20,000 lines, and what editors ask about whole files and about places in them:
cold, and after a key.

Run: `python benchmarks/lsp_whole.py [LINES ...]`. Milliseconds of processor time of the server, which other work on the
machine lengthens by half and not tenfold. Cold it should grow as the file does, and after a key hardly at all.
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
from lsp_client import Client
from lsp_typing import place_of
from lsp_workspace import definition

SIZES = (100, 300, 1_000, 2_000, 5_000, 20_000)
KEYS = 9
METHODS = (
    "codeLens", "semanticTokens/full", "documentSymbol", "inlayHint", "foldingRange", "documentLink", "formatting",
    "hover", "completion", "signatureHelp", "definition", "documentHighlight", "references", "rename", "codeAction",
    "selectionRange", "inlineValue",
)  # fmt: skip
WRITING = (
    "completion",
    "signatureHelp",
)  # asked where the keys are typed; of the others a place is a definition's name
Rows = dict[str, dict[int, float]]  # ms of each thing by lines


def program(lines: int) -> str:
    """A file of so many lines; every tenth definition is looked at by a live expression."""
    written: list[str] = []
    for number in itertools.count():
        if len(written) >= lines:
            return "\n".join(written) + "\n"
        one = definition(0, number, [])
        if number % 10 == 0:
            one.insert(-1, f"#> f{number}(0.5, 1)")
        written += one


class Whole:
    """A server with one file open."""

    def __init__(self, folder: Path, text: str) -> None:
        self.client, self.lines, self.tokens = Client(folder), text.count("\n"), ""
        self.line, self.column = place_of(text)
        lines = text.split("\n")
        self.name = next(n for n in range(self.line, -1, -1) if lines[n].startswith("def ")), len("def ")
        self.client.open("large", text)
        self.client.diagnosed("large")
        self.client.quiet(1.0)
        self.opened = self.client.processor() * 1e3

    def rest(self) -> None:
        """Wait until live expressions that were asked for are evaluated: the server and its processes do nothing."""
        before = -1.0
        while self.client.processor() - before > 0.005:
            before = self.client.processor()
            time.sleep(0.5)

    def cost(self, method: str) -> float:
        """Milliseconds of processor time for a request."""
        whole = {"start": {"line": 0, "character": 0}, "end": {"line": self.lines, "character": 0}}
        options = {"tabSize": 4, "insertSpaces": True}
        line, column = (self.line, self.column + len("sqrt(")) if method in WRITING else self.name
        place, context = {"line": line, "character": column}, {"diagnostics": [], "includeDeclaration": True}
        params: dict[str, Any] = {
            "range": {"start": place, "end": place} if method == "codeAction" else whole,
            "options": options, "position": place, "positions": [place], "newName": "renamed", "context": context,
        }  # fmt: skip
        if method == "semanticTokens/full" and self.tokens:
            method, params = "semanticTokens/full/delta", {"previousResultId": self.tokens}
        before = self.client.processor()
        document = {"textDocument": {"uri": self.client.uri("large")}}
        _, answer = self.client.ask(f"textDocument/{method}", {**document, **params})
        assert "result" in answer, answer
        if method.startswith("semanticTokens"):
            self.tokens = answer["result"]["resultId"]
        return (self.client.processor() - before) * 1e3

    def key(self, turn: int) -> float:
        """Milliseconds of processor time for a key, until there is no more to do."""
        before = self.client.processor()
        start, end = ({"line": self.line, "character": self.column + more} for more in (0, 2 if turn else 0))
        self.client.change("large", {"range": {"start": start, "end": end}, "text": f"{turn % 8 + 2}*"})
        self.client.diagnosed("large")
        self.client.quiet(0.15)
        return (self.client.processor() - before) * 1e3


def sizes_measured(sizes: tuple[int, ...] = SIZES) -> Rows:
    """What is measured, for files of some sizes."""
    rows: Rows = {}
    for size in sizes:
        with tempfile.TemporaryDirectory(prefix="potto-bench-") as name:
            whole = Whole(Path(name), program(size))
            rows.setdefault("opened and checked, cold", {})[size] = whole.opened
            for method in METHODS:
                rows.setdefault(f"{method}, cold", {})[size] = whole.cost(method)
            whole.rest()
            costs: dict[str, list[float]] = {}
            for turn in range(KEYS):
                costs.setdefault("a key, with all that follows it", []).append(whole.key(turn))
                for method in METHODS:
                    costs.setdefault(f"{method}, after a key", []).append(whole.cost(method))
            for what, found in costs.items():
                rows.setdefault(what, {})[size] = statistics.median(found)
            whole.client.process.kill()
    return rows


def table(rows: Rows) -> str:
    """The rows as text."""
    sizes = next(iter(rows.values()))
    lines = [f"{'lines, ms of processor time':<40}" + "".join(f"{size:>10,}" for size in sizes)]
    lines += [f"{what:<40}" + "".join(f"{cost:10.2f}" for cost in costs.values()) for what, costs in rows.items()]
    return "\n".join(lines)


def drawn(rows: Rows, file: Path) -> None:
    """A picture of what is asked after a key against the lines of the file; of `NAME-light.png` also the dark one."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    sizes = list(next(iter(rows.values())))
    looks = {file: "default"}
    if "-light." in file.name:
        looks[file.with_name(file.name.replace("-light.", "-dark."))] = "dark_background"
    for target, style in looks.items():
        with pyplot.style.context(style):
            figure, axes = pyplot.subplots(figsize=(7, 4.5), layout="constrained")
            for what, costs in rows.items():
                if "cold" not in what:
                    axes.loglog(list(map(int, costs)), list(costs.values()), marker="o", markersize=3, label=what)
            axes.set_xticks(sizes, [f"{size:,}" for size in sizes])
            axes.set_yticks([0.2, 0.5, 1, 2, 5, 10, 20], ["0.2", "0.5", "1", "2", "5", "10", "20"])
            axes.minorticks_off()
            axes.set_xlabel("lines of the file")
            axes.set_ylabel("ms of processor time")
            axes.grid(alpha=0.3)
            axes.legend(fontsize=7)
            figure.savefig(target, dpi=150)
            pyplot.close(figure)


def main() -> None:
    sizes = tuple(int(size) for size in sys.argv[1:]) or SIZES
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as cache:  # an evaluation may still write there
        os.environ["POTTO_CACHE"] = cache
        as_installed()
        print(table(sizes_measured(sizes)))


if __name__ == "__main__":
    main()
