"""Helper processes for one database: started, given files, listened to, ended."""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from queue import Empty, SimpleQueue
from threading import Lock, Thread
from types import TracebackType

from potto.crew.helper import serve
from potto.crew.pipes import CheckResult, CheckTask, Part, packed, unpacked
from potto.crew.processes import begun, can_be_copied
from potto.query import Database
from potto.query.parcels import Receiver

logger = logging.getLogger(__name__)
ENOUGH = 200_000  # bytes of programs for each helper: about twice what is checked in the time that it takes to start
ENOUGH_FOR_COPIES = 30_000  # of which a tenth is checked in that time
MOST = 8
AHEAD = 4  # parts that a helper is given before it has told about the first


def helpers_for(files: Iterable[str], opened: int = 0, processors: int | None = None) -> int:
    """How many helpers are worth starting for these files and `opened` bytes of open ones: one processor is left to
    whoever asks."""
    sizes = opened
    for file in files:
        try:
            sizes += os.stat(file).st_size
        except (OSError, ValueError):
            continue
    free = (usable_processors() if processors is None else processors) - 1
    return max(0, min(free, MOST, sizes // (ENOUGH_FOR_COPIES if can_be_copied() else ENOUGH)))


def usable_processors() -> int:
    """How many processors this process may use."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class Crew:
    """Helpers that check files, and pieces of them, beginning with the last. One thread at a time may use it, beside
    the listeners."""

    def __init__(
        self,
        db: Database,
        roots: Sequence[str],
        files: Iterable[str],
        helpers: int,
        texts: Mapping[str, str] | None = None,
        pieces: Iterable[tuple[str, str]] = (),
    ) -> None:
        """pieces: of files, to be checked before everything else, beginning with the last."""
        self._db, self._roots = db, tuple(roots)
        whole: list[Part] = [(file, None) for file in files]
        self._left = dict.fromkeys([*whole, *pieces])  # what nobody has begun
        self._lock = Lock()
        self._found: SimpleQueue[tuple[_Helper, CheckResult]] = SimpleQueue()
        self._taking: tuple[_Helper, CheckResult] | None = None
        self._receivers: dict[tuple[_Helper, int], Receiver] = {}
        self._helpers: list[_Helper] = []
        self.texts = texts or {}  # of open files, to be replaced when they change
        for _ in range(helpers if self._left else 0):
            self._start()

    def __enter__(self) -> Crew:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def processes(self) -> tuple[int, ...]:
        """The ids of the processes that run."""
        return tuple(helper.process.pid for helper in self._helpers if helper.process.poll() is None)

    @property
    def expects(self) -> bool:
        """Whether a helper still has something to say."""
        return any(helper.expected for helper in self._helpers)

    @property
    def has_found(self) -> bool:
        """Whether there is something to `take`."""
        return self._taking is not None or not self._found.empty()

    def take(self) -> str | None:
        """Take over what was found out about one file or piece, and say of which file all is known; None if there is
        nothing now, nothing that holds, or it was a piece. If that is cancelled, the next call goes on with it."""
        if self._taking is None:
            try:
                self._taking = self._found.get_nowait()
            except Empty:
                return None
        helper, found = self._taking
        holds = found.parcel is not None and self._receiver(helper, found.round).take(found.parcel)
        self._taking = None
        file, piece = found.part
        return file if holds and piece is None else None

    def _receiver(self, helper: _Helper, round: int) -> Receiver:
        key = helper, round
        if key not in self._receivers:
            self._receivers[key] = Receiver(self._db)
        return self._receivers[key]

    def leave(self, file: str, piece: str | None = None) -> None:
        """A file, or a piece of it, that is checked here needs no helper."""
        with self._lock:
            self._left.pop((file, piece), None)

    def close(self) -> None:
        """End all helpers."""
        with self._lock:
            self._left.clear()
        for helper in self._helpers:
            helper.end()

    # Helpers

    def _start(self) -> None:
        try:
            helper = _Helper()
        except OSError:
            logger.warning("a helper process does not start", exc_info=True)
            return
        self._helpers.append(helper)
        Thread(target=self._listen, args=(helper,), name="potto-crew", daemon=True).start()

    def _listen(self, helper: _Helper) -> None:
        """Give a helper parts and take its answers, on a thread of its own."""
        self._give(helper, AHEAD)
        helper.expected -= 1
        try:
            while (found := unpacked(helper.answers)) is not None:
                self._found.put((helper, found))
                self._give(helper, 1)
                helper.expected -= 1
        except Exception:
            logger.warning("what a helper process says is not understood", exc_info=True)
            helper.end()
        helper.answers.close()
        helper.expected = 0

    def _give(self, helper: _Helper, count: int) -> None:
        with self._lock:
            parts = tuple(self._left.popitem()[0] for _ in range(min(count, len(self._left))))
        if parts:
            helper.put(parts, self._roots, self.texts)


class _Helper:
    """One process and the texts that it has."""

    def __init__(self) -> None:
        self.process, self._tasks, self.answers = begun(serve)
        self._texts: Mapping[str, str] = {}
        self.expected = 1  # answers; one more until it has been given parts

    def put(self, parts: tuple[Part, ...], roots: tuple[str, ...], texts: Mapping[str, str]) -> None:
        """Give it parts, and the texts of which it has another version. A dead helper does not notice."""
        changed = [(key, text) for key, text in texts.items() if self._texts.get(key) != text]
        closed = [(key, None) for key in self._texts if key not in texts]
        self._texts = texts
        self.expected += len(parts)
        try:
            self._tasks.write(packed(CheckTask(parts, roots, (*changed, *closed))))
            self._tasks.flush()
        except (OSError, ValueError):
            logger.info("a helper process has ended")

    def end(self) -> None:
        """End it at once."""
        self.process.kill()
        self.process.wait()
        with suppress(OSError, ValueError):
            self._tasks.close()
