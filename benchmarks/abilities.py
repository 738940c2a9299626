"""What the integrator is able to do, line by line: `python benchmarks/abilities.py [--only NAME]`.

Each line asks one thing that has been beyond some version of Potto, and says what should come of it: an accuracy, or a
ratio of two costs in the same run. Times are those of the processor, on one thread, as others may use the machine. A
line runs in a process of its own under a time limit, so no answer is an answer, too. `--against DIR` asks another
checkout the same, in turns. `--page FILE` puts the table between the two marks of a page.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import resource
import signal
import statistics
import subprocess
import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from ability_lines import Finding, Line

HERE = Path(__file__).resolve().parent.parent
LIMIT = 60.0  # seconds of the processor for a line
PATIENCE = 5  # times as long by the clock on the wall, where others use the processor
PAIRS = 3
BEGIN, END = "<!-- abilities -->", "<!-- /abilities -->"
ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


def lines() -> dict[str, Line]:
    """All of them, in the order in which they are told."""
    import ability_costs
    import ability_regions

    return {each.name: each for each in (*ability_costs.LINES, *ability_regions.LINES)}


def run_here(name: str, limit: float) -> None:
    """A line in this process, within `limit` seconds of the processor: its finding, and where the Potto is, as JSON."""
    resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(limit), math.ceil(limit)))
    import potto

    finding = lines()[name].run()
    print(json.dumps({"potto": str(Path(potto.__file__).parent.parent), **asdict(finding)}))


def run_apart(name: str, tree: Path, limit: float) -> Finding:
    """A line in a process of its own that loads the Potto of `tree`."""
    command = [sys.executable, __file__, "--line", name, "--limit", str(limit)]
    environment = {**os.environ, "PYTHONPATH": str(tree), **ONE_THREAD}
    try:
        waits = PATIENCE * limit
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=waits)
        late = done.returncode in (-signal.SIGXCPU, -signal.SIGKILL)
    except subprocess.TimeoutExpired:
        late = True
    if late:
        return Finding(note=f"no answer in {limit:.0f} s")
    if done.returncode:
        said = (done.stderr.strip().splitlines() or ["it ended without a word"])[-1]
        return Finding(note=said[:160])
    answer = json.loads(done.stdout.splitlines()[-1])
    loaded = answer.pop("potto")
    assert Path(loaded) == tree, f"asked {loaded}, not {tree}"
    return Finding(**answer)


def in_turns(name: str, trees: list[Path], limit: float, pairs: int) -> list[Finding]:
    """The finding of each tree, its time the median over the turns, in which they alternate."""
    rounds = [[run_apart(name, tree, limit) for tree in trees] for _ in range(pairs if len(trees) > 1 else 1)]
    columns = list(zip(*rounds, strict=True))
    return [replace(column[-1], seconds=statistics.median(f.seconds for f in column)) for column in columns]


def tell(line: Line, findings: list[Finding]) -> None:
    """A line as text; what another tree finds stands below."""
    print(f"\n{line.name}: {line.asked}")
    for who, finding in zip(("here ", "there"), findings):
        print(f"  {who if len(findings) > 1 else '':5} {told(finding)}")
    if len(findings) > 1 and all(math.isfinite(f.seconds) for f in findings):
        print(f"        time here/there: {findings[0].seconds / findings[1].seconds:.2f}")
    print(f"        goal: {line.goal}: {'met' if findings[0].met else 'NOT MET'}", flush=True)


def told(finding: Finding) -> str:
    """A finding in one line of text."""
    parts = []
    if finding.value is not None and finding.error is not None:
        parts.append(f"{finding.value:.12g} ± {finding.error:.1e}")
    if finding.off is not None:
        parts.append(f"off by {finding.off:.1e}")
    if finding.evals:
        parts.append(f"{finding.evals:,} evaluations")
    if math.isfinite(finding.seconds):
        parts.append(duration(finding.seconds))
    if finding.ratio is not None:
        parts.append(f"ratio {finding.ratio:.3g}")
    return ", ".join(parts) + (f" ({finding.note})" if parts and finding.note else finding.note)


def duration(seconds: float) -> str:
    if seconds >= 1:
        return f"{seconds:.1f} s"
    return f"{seconds * 1e3:.2f} ms" if seconds >= 1e-3 else f"{seconds * 1e6:.1f} us"


def plain(finding: Finding) -> dict[str, Any]:
    """For JSON, which has no infinities."""
    shown = asdict(finding)
    return {k: str(v) if isinstance(v, float) and not math.isfinite(v) else v for k, v in shown.items()}


def table(known: dict[str, Line], found: dict[str, list[Finding]]) -> str:
    """What was found here as a table in Markdown."""
    rows = []
    for name, (finding, *_) in found.items():
        line, met = known[name], "yes" if finding.met else "**no**"
        rows.append(f"| {name} | {line.asked} | {line.goal} | {told(finding)} | {met} |")
    return "\n".join(["| | asked | goal | found | met |", "|---|---|---|---|---|", *rows])


def into_page(page: Path, text: str) -> None:
    """Put a text between the marks of a page."""
    before, rest = page.read_text(encoding="utf-8").split(BEGIN)
    page.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{rest.split(END)[1]}", encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", metavar="NAME", action="append", help="only this line; may be repeated")
    parser.add_argument("--json", metavar="FILE", type=Path, help="put what was found there as well")
    parser.add_argument("--page", metavar="FILE", type=Path, help="put the table of all lines into this page")
    parser.add_argument("--against", metavar="DIR", type=Path, help="another checkout that is asked the same")
    parser.add_argument("--pairs", type=int, default=PAIRS, help="how many turns with another checkout")
    parser.add_argument("--limit", type=float, default=LIMIT, help="seconds for a line (default %(default)s)")
    parser.add_argument("--line", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.line:
        run_here(options.line, options.limit)
        return
    known = lines()
    for name in options.only or ():
        if name not in known:
            parser.error(f"there is no line {name!r}; there are: {', '.join(known)}")
    trees = [HERE, *([options.against.resolve()] if options.against else [])]
    found: dict[str, list[Finding]] = {}
    for name in options.only or known:
        found[name] = in_turns(name, trees, options.limit, options.pairs)
        tell(known[name], found[name])
        if options.json:
            shown = {n: {"goal": known[n].goal, "findings": [plain(f) for f in fs]} for n, fs in found.items()}
            options.json.write_text(json.dumps(shown, indent=1) + "\n", encoding="utf-8")
    if options.page:
        into_page(options.page, table(known, found))
    print(f"\n{sum(fs[0].met for fs in found.values())} of {len(found)} goals are met")


if __name__ == "__main__":
    main()
