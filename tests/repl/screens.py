"""A prompt on a terminal of its own, for tests: what is typed, and what one sees."""

from __future__ import annotations

import os
import sys
import time

import pexpect
import pyte


class Screen:
    """A prompt on a terminal of its own, and what one sees there."""

    def __init__(self, folder, *arguments, columns=80, rows=40, **environment):
        self.terminal = pyte.Screen(columns, rows)
        self.stream = pyte.Stream(self.terminal)
        self.process = pexpect.spawn(
            sys.executable, ["-m", "potto", "repl", *arguments], cwd=str(folder), encoding="utf-8",
            dimensions=(rows, columns), timeout=60,
            env={**os.environ, "TERM": "xterm", "PROMPT_TOOLKIT_NO_CPR": "1", "POTTO_HISTORY": str(folder / "history"),
                 **environment},
        )  # fmt: skip
        self.process.logfile_read = self
        self.process.expect("po>")

    def write(self, text):
        self.stream.feed(text)

    def flush(self):
        pass

    def say(self, line, want):
        self.process.sendline(line)
        self.process.expect(want)
        self.process.expect(r"po>")

    @property
    def text(self):
        return "\n".join(line.rstrip() for line in self.terminal.display).rstrip()

    def leave(self):
        self.process.sendeof()
        self.process.expect(pexpect.EOF)
        self.process.close()
        return self.process.exitstatus

    def settle(self, holds):
        """Read on until the screen is as it should be: a prompt is redrawn in several writes."""
        until = time.monotonic() + 60
        while not holds(self.text):
            assert time.monotonic() < until, self.text
            self.process.expect([pexpect.TIMEOUT, r".+"], timeout=0.1)

    def interrupt(self):
        """Seconds from Ctrl-C to the next prompt."""
        self.process.delaybeforesend, before = None, self.process.delaybeforesend
        start = time.perf_counter()
        self.process.sendintr()
        self.process.expect("interrupted")
        self.process.expect("po>")
        self.process.delaybeforesend = before
        return time.perf_counter() - start
