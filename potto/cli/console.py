"""Where a command's words go: answers to one stream, complaints to the other, with colours where they are wanted."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TextIO

from msgspec import Struct

if TYPE_CHECKING:
    from potto.reports.render import Located, Palette, Sources

MOST_SHOWN = 50  # diagnostics of one command shown to a person


def wants_color(choice: str, stream: TextIO) -> bool:
    """Whether to colour what goes to a stream: `--color`, then NO_COLOR and TERM=dumb, then what the stream is."""
    if choice != "auto":
        return choice == "always"
    if os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb":
        return False
    return stream.isatty()


class Console(Struct):
    """The two streams of a command."""

    out: TextIO
    err: TextIO
    color: str = "auto"

    @property
    def for_a_screen(self) -> bool:
        """Whether answers go to a terminal that knows Unicode."""
        return self.out.isatty() and (self.out.encoding or "").lower().replace("-", "") == "utf8"

    def answer(self, text: str) -> None:
        """A line of the answer."""
        self.out.write(text + "\n")

    def answer_json(self, value: Any) -> None:
        """The answer as one JSON object on one line."""
        import json

        self.answer(json.dumps(value, ensure_ascii=False, allow_nan=False))

    def complain(self, text: str) -> None:
        """A line for the person: errors, notes, progress."""
        self.err.write(text + "\n")

    def progress(self, text: str) -> None:
        """A line that is overwritten by the next one, for a person who waits; nothing where nobody does."""
        if self.err.isatty():
            self.err.write(f"\r\x1b[K{text}")
            self.err.flush()

    @contextmanager
    def waiting(self) -> Iterator[None]:
        """In this block a line says how far an evaluation is, for a person who waits; it goes away when it is over."""
        from potto.evaluating.progress import shown

        with shown(self.err, wants_color(self.color, self.err)):
            yield

    def palette(self, stream: TextIO) -> Palette:
        from potto.reports.render import COLORS, PLAIN

        return COLORS if wants_color(self.color, stream) else PLAIN

    def diagnostics(
        self,
        diagnostics: Iterable[Located],
        sources: Sources,
        *,
        to_answer: bool = False,
        inline_header: bool = False,
    ) -> None:
        """Show diagnostics to a person: as the answer (of `check`), else as complaints."""
        from potto.reports.render import render

        stream = self.out if to_answer else self.err
        palette = self.palette(stream)
        shown = list(diagnostics)
        for located in shown[:MOST_SHOWN]:
            stream.write(render(located, sources, palette=palette, inline_header=inline_header) + "\n")
        if len(shown) > MOST_SHOWN:
            stream.write(f"... and {len(shown) - MOST_SHOWN} more (all of them with --json)\n")


def standard_console(color: str = "auto") -> Console:
    """The console of this process. What a stream cannot encode is escaped rather than fatal."""
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(errors="backslashreplace")
    return Console(sys.stdout, sys.stderr, color)
