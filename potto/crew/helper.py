"""What a helper process does: it checks the files that it is given, in a database of its own, until its input ends."""

from __future__ import annotations

import gc
import os
import signal
from queue import SimpleQueue
from threading import Thread
from typing import BinaryIO

from potto.checking.check import check_ahead, diagnostics
from potto.crew.pipes import CheckResult, CheckTask, Part, packed, unpacked
from potto.modules import open_files
from potto.modules.misread import piece_diagnostics
from potto.modules.texts import is_diffeo
from potto.query import Database
from potto.query.parcels import Asked, Sender


def serve(reader: BinaryIO, writer: BinaryIO) -> None:
    """Check the parts of each task and answer one after the other."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal sends it to everybody; the input ends all the same
    gc.disable()  # it lives for seconds, and nearly all that it makes stays
    tasks: SimpleQueue[CheckTask] = SimpleQueue()
    Thread(target=_read, args=(reader, tasks), name="potto-tasks", daemon=True).start()
    helper = Helper()
    while True:
        task = tasks.get()
        helper.prepare(task)
        for part in task.parts:
            writer.write(helper.checked(part))
            writer.flush()


def _read(reader: BinaryIO, tasks: SimpleQueue[CheckTask]) -> None:
    """Read tasks as they come, so that whoever gives them never waits. At the end nobody is left to answer."""
    while (task := unpacked(reader)) is not None:
        tasks.put(task)
    os._exit(0)


class Helper:
    """A database, and what of it has been sent."""

    def __init__(self) -> None:
        self._db = Database()
        self._files = open_files(self._db)
        self._sender, self._round = Sender(self._db), 0

    def prepare(self, task: CheckTask) -> None:
        """Bring roots and texts up to date."""
        before = self._db.revision
        self._files.set_roots(task.roots)
        for key, text in task.texts:
            if text is None:
                self._files.close(key)
            else:
                self._files.set_text(key, text)
        if self._db.revision != before:
            self._begin_anew()

    def _begin_anew(self) -> None:
        self._sender, self._round = Sender(self._db), self._round + 1

    def checked(self, part: Part) -> bytes:
        """What there is to say about a file, or a piece of it, as a message."""
        file, piece = part
        try:
            return packed(CheckResult(part, self._round, self._sender.pack_all(_asked(file, piece))))
        except Exception:  # whoever asked checks it and meets it there
            self._begin_anew()
            return packed(CheckResult(part, self._round, None))


def _asked(file: str, piece: str | None) -> list[Asked]:
    """What is asked about a file or a piece of it. What the parser says rests on the piece's text alone."""
    if piece is None:
        return [(diagnostics, (file,))]
    return [(piece_diagnostics, (piece, is_diffeo(file))), (check_ahead, (file, piece))]


def main() -> None:
    """Serve the process that has started this one, over standard input and output."""
    reader, writer = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what anything prints must not get between the messages
    try:
        serve(reader, writer)
    except BrokenPipeError:
        os._exit(0)
