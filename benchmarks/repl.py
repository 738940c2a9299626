"""How quick the prompt is: `python benchmarks/repl.py [--json]`.

Start to the first prompt on a real terminal, the first expression after it, the time of a keystroke (highlighting, the
question whether an entry is over), and of completion. Targets: 250 ms, 300 ms, 10 ms at the 99th percentile.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable

RUNS = 7
TEXT = """def renderer(c, shader)
    area = integral ([0, 1], [0, 1])
        (shader(x, y) * [x + y + c >= 0]) d(x, y)
    edge = sqrt(c^2 + 1) * clamp(c, 0, 1)
    area + edge
"""


def quantile(times: list[float], share: float) -> float:
    return sorted(times)[min(int(len(times) * share), len(times) - 1)]


def startup() -> dict[str, float]:
    """Milliseconds to the prompt, and from a typed expression to its answer; the median of some runs."""
    import pexpect

    prompts, first = [], []
    for _ in range(RUNS):
        with tempfile.TemporaryDirectory() as folder:
            environment = {**os.environ, "TERM": "xterm", "PROMPT_TOOLKIT_NO_CPR": "1", "POTTO_HISTORY": f"{folder}/h"}
            start = time.perf_counter()
            process = pexpect.spawn(sys.executable, ["-m", "potto", "repl"], env=environment, encoding="utf-8")
            process.delaybeforesend = None
            process.expect("po>")
            prompts.append(time.perf_counter() - start)
            time.sleep(0.5)  # nobody types faster
            start = time.perf_counter()
            process.send("integral [0, 1] [x < 0.3]*x d(x)\r")
            process.expect("_1 = ")
            first.append(time.perf_counter() - start)
            process.close(force=True)
    return {"prompt": statistics.median(prompts) * 1e3, "first expression": statistics.median(first) * 1e3}


def each(action: Callable[[str], object]) -> list[float]:
    """Seconds that an action takes at every character of a text being typed."""
    times = []
    for end in range(1, len(TEXT) + 1):
        start = time.perf_counter()
        action(TEXT[:end])
        times.append(time.perf_counter() - start)
    return times


def keystrokes() -> dict[str, float]:
    """Milliseconds, at the 99th percentile, of what a key waits for, and of completion, for which it doesn't."""
    from potto_repl.complete import candidates
    from potto_repl.editing import is_over
    from potto_repl.highlight import PottoLexer
    from potto_repl.start import Loader
    from prompt_toolkit.document import Document

    from potto.settings import DEFAULTS

    loader = Loader(DEFAULTS)
    session = loader.session
    for number in range(200):
        list(session.enter(f"def name{number}(x) sin(x) + {number}"))
    lexer = PottoLexer(loader, lambda text: ())
    found = {
        "highlighting": each(lambda text: lexer.lex_document(Document(text))(0)),
        "enter": each(is_over),
        "completion": each(lambda text: candidates(session, text)),
    }
    return {f"{name} p99": quantile(times, 0.99) * 1e3 for name, times in found.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    figures = {**startup(), **keystrokes()}
    if parser.parse_args().json:
        print(json.dumps(figures))
        return
    for name, milliseconds in figures.items():
        print(f"{name:<18} {milliseconds:8.2f} ms")


if __name__ == "__main__":
    main()
