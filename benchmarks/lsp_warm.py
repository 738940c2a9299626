"""What edits cost the analysis of the language server alone, in processor time of its thread: on a busy machine too.

Run: `python benchmarks/lsp_warm.py [--arrays]`. The same workspace as in `lsp.py`, all of it checked, five files open;
no client, no messages, no other threads. It takes about ten seconds to begin with.
"""

from __future__ import annotations

import gc
import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from lsp_workspace import longer, resigned, workspace
from potto_lsp import collector
from potto_lsp.analysis import Analysis
from potto_lsp.client import Client
from potto_lsp.documents import Document
from potto_lsp.publishing import Publisher
from potto_lsp.text import DocumentText

ROUNDS = 60
Times = tuple[float, float]  # ms until what was waited for is told, and until all is done


class Session:
    """A workspace, all checked, without a client."""

    def __init__(self, folder: Path, texts: dict[str, str]) -> None:
        self.folder, self.version = folder, 0
        self.analysis = Analysis("utf-16")
        self.analysis.set_folders([folder.as_uri()])
        self.told: list[Any] = []
        self.publisher = Publisher(self.analysis, Client(), lambda method, params: self.told.append(params["uri"]))
        self.put("large", texts["large"])
        gc.disable()
        self.check(set())
        self.analysis.settled = True
        self.analysis.forget_trees()
        collector.begin_collecting()

    def put(self, name: str, text: str) -> None:
        self.version += 1
        uri = (self.folder / f"{name}.po").as_uri()
        self.analysis.put(Document(uri, "potto", self.version, DocumentText(text, "utf-16")))

    def open(self, name: str, text: str) -> None:
        self.put(name, text)
        self.check(set())
        key = str(self.folder / f"{name}.po")
        self.analysis.prepare(key)
        self.analysis.prepare_users(key)

    def check(self, wanted: set[str]) -> float:
        """Check all that there is; when the last of the wanted files was told of."""
        self.told.clear()
        missing, when = {(self.folder / f"{name}.po").as_uri() for name in wanted}, 0.0
        for step in self.publisher.steps_again():
            with self.analysis.db.evaluating():
                step()
            if missing and missing <= set(self.told):
                missing, when = set(), time.thread_time()
        return when or time.thread_time()  # of files with nothing new nobody is told

    def edit(self, name: str, text: str, wanted: set[str]) -> Times:
        start = time.thread_time()
        self.put(name, text)
        told, done = self.check(wanted), time.thread_time()
        collector.tidy()  # as the server does while nobody waits
        return (told - start) * 1e3, (done - start) * 1e3


def show(what: str, edits: Callable[[int], Times]) -> None:
    times = [edits(turn) for turn in range(ROUNDS)]
    for part, those in (("told", [t for t, _ in times]), ("all done", [t for _, t in times])):
        first, ordered = those[0], sorted(those)
        print(
            f"{what:<46} {part:<9} first {first:6.1f}  least {ordered[0]:6.1f}  "
            f"median {ordered[ROUNDS // 2]:6.1f}  p95 {ordered[int(0.95 * ROUNDS)]:6.1f} ms"
        )


def main() -> None:
    arrays = "--arrays" in sys.argv
    texts = workspace(arrays)
    large, leaf = texts["large"], texts["m0"]
    users = [name for name, text in texts.items() if "from m0 import f1 " in text or "import m0 as" in text][:3]
    at = large.index("sin(", len(large) // 2)
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as cache:
        os.environ["POTTO_CACHE"] = cache
        for name, text in texts.items():
            (Path(folder) / f"{name}.po").write_text(text)
        session = Session(Path(folder), texts)
        for name in ("m0", *users, "large"):
            session.open(name, texts[name])
        typed = [large[:at] + "2*" + large[at:], large]
        show("body edit in the 2,000-line module", lambda n: session.edit("large", typed[n % 2], {"large"}))
        broken = [large[:at] + "(" + large[at:], large]
        show("a bracket too many in it", lambda n: session.edit("large", broken[n % 2], {"large"}))
        moved = ["\n" + large, large]
        show("a line at its top", lambda n: session.edit("large", moved[n % 2], {"large"}))
        again = resigned(leaf, None)
        show("signature in a leaf, to its open importers", lambda n: session.edit("m0", again[n % 2], set(users)))
        unseen = [text for n in range(ROUNDS // 2) for text in resigned(leaf, n)]
        show("the same, one that never was there before", lambda n: session.edit("m0", unseen[n], set(users)))
        show(
            "the same, of types that never were there before", lambda n: session.edit("m0", longer(leaf, n), set(users))
        )
        print(f"load {os.getloadavg()[0]:.1f} of {os.cpu_count()} processors")


if __name__ == "__main__":
    main()
