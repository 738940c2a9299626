"""The prompt on a terminal: reads entries with prompt_toolkit and shows what comes of them.

Owns `Terminal`. The only place, with `keys` and `highlight`, that knows prompt_toolkit; what is read is answered by
`respond`. Entries are evaluated on the main thread, so that Ctrl-C reaches them at once.
"""

from __future__ import annotations

import asyncio
import os
import shutil
import subprocess
import sys
import tempfile
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

from prompt_toolkit import PromptSession
from prompt_toolkit.application import run_in_terminal
from prompt_toolkit.auto_suggest import AutoSuggestFromHistory, DynamicAutoSuggest
from prompt_toolkit.completion import ThreadedCompleter
from prompt_toolkit.enums import EditingMode
from prompt_toolkit.formatted_text import StyleAndTextTuples
from prompt_toolkit.history import FileHistory, History, InMemoryHistory
from prompt_toolkit.output import ColorDepth
from prompt_toolkit.styles import DynamicStyle

from potto.evaluating.progress import PLAIN, Progress
from potto_repl.background import Checker
from potto_repl.banner import greeting
from potto_repl.highlight import PottoCompleter, PottoLexer, style
from potto_repl.keyboard import kept_interrupts, loud_keys, quiet_keys
from potto_repl.keys import bindings
from potto_repl.session_loading import Loader

NARROW = 40
WATCH = 0.3  # seconds between two looks at the files


def history_path() -> Path:
    """Where entries are kept between sessions: `POTTO_HISTORY`, or the user's folder for such files."""
    named = os.environ.get("POTTO_HISTORY")
    if named:
        return Path(named)
    base = os.environ.get("XDG_STATE_HOME") or os.path.expanduser("~/.local/state")
    return Path(base) / "potto" / "history"


def open_history() -> History:
    """The history of all sessions; if it can't be kept, that of this session only."""
    path = history_path()
    if path.exists() and not path.is_file():
        return InMemoryHistory()
    home = os.path.expanduser("~")
    if str(path).startswith(home) and not os.path.isdir(home):
        return InMemoryHistory()  # nobody's home is made here
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a", encoding="utf-8"):
            pass
    except OSError:
        return InMemoryHistory()
    return KeptHistory(str(path))


class KeptHistory(FileHistory):
    """A history in a file. If that can't be read or written any more, it holds this session only."""

    def load_history_strings(self) -> list[str]:
        try:
            return list(super().load_history_strings())
        except OSError:
            return []

    def store_string(self, string: str) -> None:
        with suppress(OSError):
            super().store_string(string)


class Terminal:
    """A conversation on a terminal."""

    def __init__(
        self, loader: Loader, *, theme: str = "dark", color: bool = True, unicode: bool = True, vi: bool = False,
        history: History | None = None, **io: Any,
    ) -> None:  # fmt: skip
        self.loader = loader
        self.theme = theme
        self.color = color
        self.unicode = unicode
        self.vi = vi
        self.suggests = True
        self.progress = Progress(sys.stdout, self.columns, dim=color)
        self.checker = Checker(loader, self._checked)
        self.lexers = (PottoLexer(loader, self.checker.wrong), PottoLexer(loader, self.checker.wrong))
        self.prompt_session: PromptSession[str] = PromptSession(
            message=self.message,
            multiline=True,
            prompt_continuation=self.continuation,
            lexer=self.lexers[0],
            completer=ThreadedCompleter(PottoCompleter(loader)),
            complete_while_typing=False,
            enable_history_search=True,
            auto_suggest=DynamicAutoSuggest(lambda: self._suggest),
            history=history if history is not None else open_history(),
            key_bindings=bindings(),
            style=DynamicStyle(lambda: style(self.theme)),
            color_depth=None if color else ColorDepth.DEPTH_1_BIT,
            enable_open_in_editor=True,
            tempfile_suffix=".po",
            editing_mode=EditingMode.VI if vi else EditingMode.EMACS,
            include_default_pygments_style=False,
            reserve_space_for_menu=6,
            **io,
        )
        self.prompt_session.default_buffer.on_text_changed += lambda buffer: self._typed(buffer.text)
        self._suggest = AutoSuggestFromHistory()
        self._attached = False
        loader.told = self._checked  # what was typed before that has no colours yet

    # The loop

    def run(self, file: str | None = None) -> int:
        """Talk until the person leaves; the exit status."""
        with quiet_keys(), kept_interrupts():
            return self._run(file)

    def _run(self, file: str | None) -> int:
        self.say(greeting())
        if file is not None:
            self.answer(f":load {file}")
        while not (self.loader.ready and self.loader.session.leaving):
            try:
                text = self.read()
            except KeyboardInterrupt:
                continue  # the half-typed block is dropped
            except EOFError:
                break
            if text.strip():
                self.answer(text)
        return 0

    def read(self) -> str:
        """One entry."""
        self._obey()
        return self.prompt_session.prompt(pre_run=self._prepare)

    def _prepare(self) -> None:
        self.loader.start()
        self.prompt_session.app.create_background_task(self._watch())

    def answer(self, text: str) -> None:
        """Show what comes of an entry. Interrupted, it says so, and everything is as it was."""
        self.checker.stop()
        try:
            with self.progress:
                if not self.loader.ready:
                    self.progress.note("starting")
                self._attach()
                self.progress.note(PLAIN)
                from potto.runtime.evaluation.gauge import Gauge, watching
                from potto_repl.backslash_symbols import readable
                from potto_repl.respond import stream

                with watching(Gauge()) as self.progress.gauge:
                    for part in stream(self.loader.session, readable(text)):
                        self.show(part)
        except KeyboardInterrupt:
            self.say("interrupted; everything that was defined is still there")

    def show(self, part: Any) -> None:
        from potto_repl.drawing import protocol
        from potto_repl.paint import Screen, painted

        session = self.loader.session
        if part.kind == "tail" and not session.options.details:
            return
        color = self.color and session.options.theme != "none"
        look = Screen(color, self.unicode and session.options.unicode, self.columns(), protocol(), breaks=True)
        self.say(painted(part, look))

    def say(self, text: str) -> None:
        self.progress.say(text + "\n")

    # What the session needs of the terminal

    def _attach(self) -> None:
        if self._attached:
            return
        session = self.loader.session
        from msgspec.structs import replace

        keys = "vi" if self.vi else "emacs"
        session.options = replace(session.options, theme=self.theme, keys=keys, unicode=self.unicode)
        session.edit = self.edit
        session.progress = self.progress.note
        session.width = self.columns
        self._attached = True

    def _obey(self) -> None:
        """Follow what `:set` has changed."""
        if self._attached:
            options = self.loader.session.options
            self.theme = options.theme if self.color else "none"
            self.vi = options.keys == "vi"
            self.suggests = options.suggest
        self.prompt_session.editing_mode = EditingMode.VI if self.vi else EditingMode.EMACS
        self.prompt_session.auto_suggest = self._suggest if self.suggests else None

    @staticmethod
    def columns() -> int:
        """As the terminal has it now: COLUMNS may have been right once. Where it does not know, it says 0."""
        known = 0
        with suppress(OSError, ValueError):
            known = os.get_terminal_size(sys.__stdout__.fileno()).columns if sys.__stdout__ else 0
        return known or shutil.get_terminal_size().columns

    def edit(self, text: str) -> str | None:
        """The text as the person's editor leaves it; None if that fails."""
        from potto_repl.commands.files import editor

        with tempfile.TemporaryDirectory(prefix="potto-") as folder:
            path = Path(folder) / "entry.po"
            path.write_text(text, encoding="utf-8")
            try:
                with loud_keys():
                    done = subprocess.run([*editor(), str(path)], check=False)
            except OSError as error:
                self.say(f"error: the editor cannot be started: {error.strerror}")
                return None
            return path.read_text(encoding="utf-8") if done.returncode == 0 else None

    # What prompt_toolkit asks

    def message(self) -> StyleAndTextTuples:
        if self.columns() < NARROW:
            return [("class:prompt", "po> ")]
        number = self.loader.session.number + 1 if self.loader.ready else 1
        return [("class:prompt", f"{number} po> ")]

    def continuation(self, width: int, line: int, wrapped: int) -> StyleAndTextTuples:
        return [("class:continuation", "... ".rjust(width) if not wrapped else " " * width)]

    def _typed(self, text: str) -> None:
        if self.loader.ready and self.loader.session.options.check:
            self.checker.look(text)

    def _checked(self) -> None:
        """Draw the text again: prompt_toolkit recolours the same text only for another lexer."""
        app = self.prompt_session.app
        if app.is_running:
            self.prompt_session.lexer = self.lexers[self.prompt_session.lexer is self.lexers[0]]
            app.invalidate()

    async def _watch(self) -> None:
        """Reload files that change while the prompt waits."""
        while True:
            await asyncio.sleep(WATCH)
            if not self.loader.ready or not self.loader.session.watching:
                continue
            from potto_repl.following import refreshed

            parts = await asyncio.get_running_loop().run_in_executor(None, refreshed, self.loader.session, True)
            if parts:
                await run_in_terminal(partial(self._show_all, parts))

    def _show_all(self, parts: list[Any]) -> None:
        for part in parts:
            self.show(part)
