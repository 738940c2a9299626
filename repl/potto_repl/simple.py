"""The prompt on a terminal that knows no escape codes (`TERM=dumb`): lines in, lines out."""

from __future__ import annotations

import shutil

from potto_repl.banner import greeting, say
from potto_repl.editing import is_over
from potto_repl.keyboard import kept_interrupts
from potto_repl.session_loading import Loader


class Simple:
    """A conversation by lines."""

    def __init__(self, loader: Loader, *, unicode: bool = True) -> None:
        self.loader = loader
        self.unicode = unicode

    def run(self, file: str | None) -> int:
        with kept_interrupts():
            return self._run(file)

    def _run(self, file: str | None) -> int:
        say(greeting())
        self.loader.start()
        if file is not None:
            self.answer(f":load {file}")
        while not self.loader.ready or not self.loader.session.leaving:
            try:
                text = self.read()
            except EOFError:
                say("")
                return 0
            except KeyboardInterrupt:
                say("")
                continue
            self.answer(text)
        return 0

    def read(self) -> str:
        """An entry, over as many lines as it takes."""
        number = self.loader.session.number + 1 if self.loader.ready else 1
        text = input(f"{number} po> ")
        while not is_over(text):
            text += "\n" + input("... ")
        return text

    def answer(self, text: str) -> None:
        try:
            session = self.loader.session  # waited for, so that only one thread imports what it needs
            from potto_repl.backslash_symbols import readable
            from potto_repl.paint import Screen, painted
            from potto_repl.respond import stream

            look = Screen(unicode=self.unicode, width=shutil.get_terminal_size().columns, breaks=True)
            for part in stream(session, readable(text)):
                say(painted(part, look))
        except KeyboardInterrupt:
            say("interrupted; everything that was defined is still there")
