"""The figures of `docs/lsp.md`, measured and written there: the goals, programs with arrays, files by lines, and peers.

Run: `python benchmarks/lsp_page.py [--peers FOLDER] [--quick] [--out FOLDER]`, with nothing else running. `--peers` is
a folder of programs with type checkers of Python (`pip install ty pyrefly basedpyright`). It takes about a quarter of
an hour, with `--quick` a third of that; `--out` writes to another folder than `docs`.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from installed import as_installed
from lsp_peers import COLUMNS, compare
from lsp_whole import Rows, drawn, sizes_measured
from lsp_workspace import workspace, written

ROOT = Path(__file__).resolve().parents[1]
BEGIN, END = "<!-- figures of benchmarks/lsp_page.py -->", "<!-- end of the figures -->"
PICTURE = """\
<picture>
  <source media="(prefers-color-scheme: dark)" srcset="images/lsp-lines-dark.png">
  <img alt="Milliseconds of processor time of each question after a key, against 100 to 20,000 lines" \
src="images/lsp-lines-light.png">
</picture>"""
Measured = dict[tuple[str, str], dict[str, Any]]  # by gate and what


def gates(*options: str) -> Measured:
    """What `lsp.py` measures."""
    command = [sys.executable, str(ROOT / "benchmarks/lsp.py"), "--json", *options]
    found = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout
    rows = [json.loads(line) for line in found.splitlines() if line.startswith("{")]
    return {(row["gate"], row["what"]): row for row in rows if not row["what"].startswith("- ")}


def gates_table(rows: Measured) -> Iterator[str]:
    """A row for each goal; with the ratio to a program without arrays, if there is one."""
    yield "| gate | what | goal | measured |"
    yield "|---|---|---|---|"
    for (gate, what), row in rows.items():
        yield f"| {gate} | {what} | {row['goal']:g} {row['unit']} | {_cell(row)} |"


def _cell(row: dict[str, Any]) -> str:
    missed = ", missed" if row["value"] > row["goal"] else ""
    ratio = f" ({row['ratio']:.2g} times)" if "ratio" in row else ""
    return f"{number(row['value'])} {row['unit']}{missed}{ratio}"


def number(value: float) -> str:
    """With two digits, three from 10 on."""
    return f"{value:,.0f}" if value >= 10 else f"{value:.1f}" if value >= 1 else f"{value:.2f}"


def lines_table(rows: Rows) -> Iterator[str]:
    sizes = list(next(iter(rows.values())))
    yield f"| ms | {' | '.join(f'{size:,} lines' for size in sizes)} |"
    yield f"|---|{'---|' * len(sizes)}"
    for what, costs in rows.items():
        if what.startswith("opened") or "cold" not in what:
            yield f"| {what} | {' | '.join(map(number, costs.values()))} |"


def peers_table(programs: Path, quick: bool) -> Iterator[str]:
    rounds, texts = 3 if quick else 10, workspace()
    yield f"| ms, MB | {' | '.join(COLUMNS)} |"
    yield f"|---|{'---|' * len(COLUMNS)}"
    with written(texts) as folder:
        for server, found in compare(folder, texts, programs, rounds):
            yield _peer(server, found)


def _peer(name: str, found: Sequence[float]) -> str:
    return f"| {name} | {' | '.join('–' if value != value else number(value) for value in found)} |"


def page(programs: Path | None, quick: bool, pictures: Path) -> str:
    """All figures as Markdown; the picture goes into a folder."""
    options = ["--quick"] if quick else []
    before = os.getloadavg()[0]
    parts = [[*gates_table(gates(*options))]]
    parts += [["Programs with arrays, records, folds and look-ups, beside as many lines without:"]]
    parts += [[*gates_table(gates("--arrays", *options))]]
    with tempfile.TemporaryDirectory() as cache:
        os.environ["POTTO_CACHE"] = cache
        rows = sizes_measured()
    drawn(rows, pictures / "lsp-lines-light.png")
    parts += [["Milliseconds of processor time; questions are about all of the file, after a key:"]]
    parts += [[*lines_table(rows)], [PICTURE]]
    if programs is not None:
        parts += [["A person types into a file of 2,000 lines in each server's own language, in one run:"]]
        parts += [[*peers_table(programs, quick)]]
    head = f"{platform.python_implementation()} {platform.python_version()}, {os.cpu_count()} processors, "
    head += f"load {before:.1f} before and {os.getloadavg()[0]:.1f} after; one run of each, one after the other"
    return "\n\n".join(["\n".join(part) for part in ([f"{head}:"], *parts)])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--peers", type=Path, metavar="FOLDER")
    parser.add_argument("--quick", action="store_true", help="fewer rounds")
    parser.add_argument("--out", type=Path, default=ROOT / "docs", metavar="FOLDER")
    options = parser.parse_args()
    as_installed()
    text = (ROOT / "docs/lsp.md").read_text(encoding="utf-8")
    head, _, rest = text.partition(BEGIN)
    _, _, tail = rest.partition(END)
    (options.out / "images").mkdir(parents=True, exist_ok=True)
    found = page(options.peers, options.quick, options.out / "images")
    (options.out / "lsp.md").write_text(f"{head}{BEGIN}\n\n{found}\n\n{END}{tail}", encoding="utf-8")


if __name__ == "__main__":
    main()
