"""The figures of `docs/lsp.md`, measured and written there: the goals, programs with arrays, files by lines, and peers.

Run: `python benchmarks/lsp_page.py [--native PYTHON] [--peers FOLDER] [--quick] [--out FOLDER]`, with nothing else
running. `--native` is the Python of a compiled front end (`make native` makes `.venv-native`), `--peers` a folder of
programs with type checkers of Python (`pip install ty pyrefly basedpyright`). It takes about half an hour, with
`--quick` a third of that; `--out` writes to another folder than `docs`.
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
from lsp_client import OURS, Client
from lsp_peers import COLUMNS, compare, measured
from lsp_whole import Rows, drawn, sizes_measured
from lsp_workspace import workspace, written

ROOT = Path(__file__).resolve().parents[1]
NATIVE = ROOT / ".venv-native/bin/python"
BEGIN, END = "<!-- figures of benchmarks/lsp_page.py -->", "<!-- end of the figures -->"
PICTURE = """\
<picture>
  <source media="(prefers-color-scheme: dark)" srcset="images/lsp-lines-dark.png">
  <img alt="Milliseconds of processor time of each question after a key, against 100 to 20,000 lines" \
src="images/lsp-lines-light.png">
</picture>"""
Measured = dict[tuple[str, str], dict[str, Any]]  # by gate and what


def gates(python: Path | str, *options: str) -> Measured:
    """What `lsp.py` measures with this Python."""
    command = [str(python), str(ROOT / "benchmarks/lsp.py"), "--json", *options]
    found = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout
    rows = [json.loads(line) for line in found.splitlines() if line.startswith("{")]
    return {(row["gate"], row["what"]): row for row in rows if not row["what"].startswith("- ")}


def gates_table(columns: Sequence[tuple[str, Measured]]) -> Iterator[str]:
    """A row for each goal, a column for each front end; with the ratio to a program without arrays, if there is one."""
    yield f"| gate | what | goal | {' | '.join(name for name, _ in columns)} |"
    yield f"|---|---|---|{'---|' * len(columns)}"
    for key, first in columns[0][1].items():
        cells = [_cell(rows[key]) if key in rows else "–" for _, rows in columns]
        yield f"| {key[0]} | {key[1]} | {first['goal']:g} {first['unit']} | {' | '.join(cells)} |"


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


def peers_table(native: Path | None, programs: Path, quick: bool) -> Iterator[str]:
    rounds, texts = 3 if quick else 10, workspace()
    yield f"| ms, MB | {' | '.join(COLUMNS)} |"
    yield f"|---|{'---|' * len(COLUMNS)}"
    with written(texts) as folder:
        if native is not None:
            found = measured(Client(folder, (str(native), *OURS[1:])), texts["large"], rounds)
            yield _peer("potto, machine code", found)
        for server, found in compare(folder, texts, programs, rounds):
            yield _peer("potto, interpreted" if server == "potto" else server, found)


def _peer(name: str, found: Sequence[float]) -> str:
    return f"| {name} | {' | '.join('–' if value != value else number(value) for value in found)} |"


def page(native: Path | None, programs: Path | None, quick: bool, pictures: Path) -> str:
    """All figures as Markdown; the picture goes into a folder."""
    pythons = [*([("machine code", native)] if native is not None else []), ("interpreted", Path(sys.executable))]
    options = ["--quick"] if quick else []
    before = os.getloadavg()[0]
    parts = [[*gates_table([(name, gates(python, *options)) for name, python in pythons])]]
    parts += [["Programs with arrays, records, folds and look-ups, beside as many lines without:"]]
    parts += [[*gates_table([(name, gates(python, "--arrays", *options)) for name, python in pythons])]]
    with tempfile.TemporaryDirectory() as cache:
        os.environ["POTTO_CACHE"] = cache
        rows = sizes_measured()
    drawn(rows, pictures / "lsp-lines-light.png")
    parts += [["Milliseconds of processor time, interpreted; questions are about all of the file, after a key:"]]
    parts += [[*lines_table(rows)], [PICTURE]]
    if programs is not None:
        parts += [["A person types into a file of 2,000 lines in each server's own language, in one run:"]]
        parts += [[*peers_table(native, programs, quick)]]
    head = f"{platform.python_implementation()} {platform.python_version()}, {os.cpu_count()} processors, "
    head += f"load {before:.1f} before and {os.getloadavg()[0]:.1f} after; one run of each, one after the other"
    return "\n\n".join(["\n".join(part) for part in ([f"{head}:"], *parts)])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--native", type=Path, default=NATIVE if NATIVE.exists() else None, metavar="PYTHON")
    parser.add_argument("--peers", type=Path, metavar="FOLDER")
    parser.add_argument("--quick", action="store_true", help="fewer rounds")
    parser.add_argument("--out", type=Path, default=ROOT / "docs", metavar="FOLDER")
    options = parser.parse_args()
    as_installed()
    text = (ROOT / "docs/lsp.md").read_text(encoding="utf-8")
    head, _, rest = text.partition(BEGIN)
    _, _, tail = rest.partition(END)
    (options.out / "images").mkdir(parents=True, exist_ok=True)
    found = page(options.native, options.peers, options.quick, options.out / "images")
    (options.out / "lsp.md").write_text(f"{head}{BEGIN}\n\n{found}\n\n{END}{tail}", encoding="utf-8")


if __name__ == "__main__":
    main()
