"""How quick the prompt is: `python benchmarks/repl.py [--json]`.

On a real terminal: `potto --version`, start to the first prompt, the first expression after it, and from a key to its
echo with a module of 2,000 lines loaded and what is typed being checked. In the process: what a key waits for
(highlighting, the question whether an entry is over) and completion. And which libraries are imported when.
Targets in milliseconds: 60, 250, 300, and 10 at the 99th percentile for all that a key waits for. The second column
says how much of the processor that took: for the prompt and the first expression on Linux, all threads together, so
that what is loaded beside the prompt counts too.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from installed import as_installed

RUNS = 7
LINES = 2000
TARGETS = {"version": 60.0, "prompt": 250.0, "first expression": 300.0, "echo p99": 10.0, "highlighting p99": 10.0,
           "enter p99": 10.0}  # fmt: skip
HEAVY = ("numpy", "scipy", "mpmath", "lark", "prompt_toolkit", "pygls", "asyncio", "potto.syntax",
         "potto.checking.check", "potto.kernels", "potto.integrate", "potto.ide", "potto_repl")  # fmt: skip
TEXT = """def renderer(c, shader)
    area = integral ([0, 1], [0, 1])
        (shader(x, y) * [x + y + c >= 0]) d(x, y)
    edge = sqrt(c^2 + 1) * clamp(c, 0, 1)
    area + edge
"""
TYPED = "name17(0.3) + integral [0, 1] (if [x < 0.4] then sin(name3(x)) else clamp(x, 0, 1)) d(x)"


def module(lines: int) -> str:
    """A program of so many lines, four a definition."""
    blocks = [
        f"# number {n}\ndef name{n}(x)\n    a = sin(x) + {n}\n    a * integral [0, 1] [u < x]*cos(u) d(u)\n"
        for n in range(lines // 4)
    ]
    return "".join(blocks)


def quantile(times: list[float], share: float) -> float:
    return sorted(times)[min(int(len(times) * share), len(times) - 1)]


Figure = tuple[float, float | None]  # milliseconds by the clock, and of the processor where that is known


def version() -> Figure:
    """How long `potto --version` takes."""
    times, ours = [], []
    for _ in range(RUNS):
        start, before = time.perf_counter(), os.times()
        subprocess.run([sys.executable, "-P", "-m", "potto", "--version"], check=True, capture_output=True)
        times.append(time.perf_counter() - start)
        after = os.times()
        ours.append(after.children_user - before.children_user + after.children_system - before.children_system)
    return statistics.median(times) * 1e3, statistics.median(ours) * 1e3


def spent(pid: int) -> float | None:
    """Seconds of the processor that a process has taken, with all of its threads; None where that is not told."""
    try:
        threads = os.listdir(f"/proc/{pid}/task")
        return sum(int(Path(f"/proc/{pid}/task/{t}/schedstat").read_text().split()[0]) for t in threads) / 1e9
    except OSError:
        return None


def median_of(numbers: list[float | None]) -> float | None:
    known = [number for number in numbers if number is not None]
    return statistics.median(known) * 1e3 if known else None


def opened(folder: str, *arguments: str) -> Any:
    """A prompt on a terminal of its own."""
    import pexpect

    environment = {**os.environ, "TERM": "xterm", "PROMPT_TOOLKIT_NO_CPR": "1", "POTTO_HISTORY": f"{folder}/h"}
    command = ["-P", "-m", "potto", "repl", *arguments]
    process = pexpect.spawn(
        sys.executable, command, env=environment, encoding="utf-8", timeout=60, dimensions=(40, 120)
    )
    process.delaybeforesend = None
    return process


def startup() -> dict[str, Figure]:
    """From the start to the prompt, and from a typed expression to its answer; the median of some runs."""
    prompts, first = [], []
    ours: list[float | None] = []
    later: list[float | None] = []
    for _ in range(RUNS):
        with tempfile.TemporaryDirectory() as folder:
            start = time.perf_counter()
            process = opened(folder)
            process.expect("po>")
            prompts.append(time.perf_counter() - start)
            ours.append(spent(process.pid))
            time.sleep(0.5)  # nobody types faster
            start, before = time.perf_counter(), spent(process.pid)
            process.send("integral [0, 1] [x < 0.3]*x d(x)\r")
            process.expect("_1 = ")
            first.append(time.perf_counter() - start)
            after = spent(process.pid)
            later.append(None if before is None or after is None else after - before)
            process.close(force=True)
    return {"prompt": (statistics.median(prompts) * 1e3, median_of(ours)),
            "first expression": (statistics.median(first) * 1e3, median_of(later))}  # fmt: skip


def drain(process: Any) -> None:
    """Read what the terminal has still to say."""
    import pexpect

    while True:
        try:
            process.read_nonblocking(10_000, 0)
        except pexpect.TIMEOUT:
            return


def echoes() -> dict[str, Figure]:
    """From a key to its echo, with a large module loaded, at the rate of somebody who types fast."""
    times = []
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "large.po").write_text(module(LINES))
        process = opened(folder, f"{folder}/large.po")
        process.expect("names")
        process.expect("po>")
        time.sleep(1)
        process.send("1 + 1\r")
        process.expect("_1 = 2")
        process.expect("po>")
        time.sleep(0.5)
        for number, char in enumerate(TYPED * 3):
            drain(process)
            start = time.perf_counter()
            process.send(char)
            process.read_nonblocking(10_000, 5)  # what a key changes on the screen is written at once
            times.append(time.perf_counter() - start)
            time.sleep(0.22 if number % 10 == 9 else 0.03)  # now and then long enough for a check to begin
        process.close(force=True)
    return {"echo p50": (statistics.median(times) * 1e3, None), "echo p99": (quantile(times, 0.99) * 1e3, None)}


def each(action: Callable[[str], object]) -> Figure:
    """Milliseconds that an action takes at the characters of a text being typed: the 99th percentile."""
    times, ours = [], []
    for end in range(1, len(TEXT) + 1):
        start, before = time.perf_counter(), time.thread_time()
        action(TEXT[:end])
        times.append(time.perf_counter() - start)
        ours.append(time.thread_time() - before)
    return quantile(times, 0.99) * 1e3, quantile(ours, 0.99) * 1e3


def keystrokes() -> dict[str, Figure]:
    """What a key waits for, and completion, for which it doesn't."""
    from potto_repl.complete import candidates
    from potto_repl.editing import is_over
    from potto_repl.highlight import PottoLexer
    from potto_repl.respond import respond
    from potto_repl.session_loading import Loader
    from prompt_toolkit.document import Document

    from potto.projects.settings import DEFAULTS

    loader = Loader(DEFAULTS)
    session = loader.session
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "large.po"
        path.write_text(module(LINES))
        assert not respond(session, f":load {path}").failed
        lexer = PottoLexer(loader, lambda text: ())
        found = {
            "highlighting": each(lambda text: lexer.lex_document(Document(text))(0)),
            "enter": each(is_over),
            "completion": each(lambda text: candidates(session, text)),
        }
    return {f"{name} p99": figure for name, figure in found.items()}


def imports() -> dict[str, list[str]]:
    """Which of the libraries that take time are imported by when."""
    stages = {
        "potto --version": "from potto.__main__ import main\ntry: main(['--version'])\nexcept SystemExit: pass",
        "the prompt": "import potto_repl.terminal",
        "an expression from a pipe": "from potto.__main__ import main\ntry: main(['repl', '-c', 'sin(1)'])\n"
                                     "except SystemExit: pass",
    }  # fmt: skip
    found = {}
    for name, code in stages.items():
        check = f"import sys\n{code}\nprint('HEAVY', *[m for m in {HEAVY!r} if m in sys.modules])"
        done = subprocess.run([sys.executable, "-c", check], capture_output=True, text=True, check=True)
        line = re.search(r"^HEAVY(.*)$", done.stdout, re.MULTILINE)
        found[name] = line[1].split() if line is not None else []
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    as_installed()
    figures: dict[str, Figure] = {"version": version(), **startup(), **echoes(), **keystrokes()}
    loaded = imports()
    if options.json:
        clock = {name: milliseconds for name, (milliseconds, _) in figures.items()}
        ours = {name: processor for name, (_, processor) in figures.items()}
        print(json.dumps({"milliseconds": clock, "processor": ours, "targets": TARGETS, "imports": loaded}))
        return
    for name, (milliseconds, processor) in figures.items():
        target = f"   (target {TARGETS[name]:.0f})" if name in TARGETS else ""
        own = f"{processor:8.2f} ms of the processor" if processor is not None else " " * 28
        print(f"{name:<18} {milliseconds:8.2f} ms {own}{target}")
    for stage, libraries in loaded.items():
        print(f"imported by {stage}: {', '.join(libraries) or 'none of these'}")


if __name__ == "__main__":
    main()
