"""The one thread that owns the database, and the order in which it works.

Owns `Job` and `Worker`. Edits and quick questions are done in the order in which they came. Then it is told what is
wrong with the open files: to those who ask, and unasked. Slow questions (over a whole file, which editors ask after
each key, or over the workspace) wait for that, and the check of all other files for them. What waits gives way to
whatever comes: the database is cancelled, unwinds at the entry of the next query, and what it has found until then is
kept.
"""

from __future__ import annotations

import logging
import time
from collections import deque
from collections.abc import Callable, Iterator
from itertools import chain
from queue import Empty, SimpleQueue
from threading import Lock, Thread
from typing import TYPE_CHECKING, Literal

from msgspec import Struct, field

if TYPE_CHECKING:
    from potto.query import Database

logger = logging.getLogger(__name__)
LONG = 0.05  # seconds after which an edit interrupts even a quick question
REST = 1.0  # seconds without anything to do after which there is time for more
YIELDING = ("diagnosis", "slow", "idle")  # jobs that give way to what comes
TICK = 0.004  # seconds between two decisions of the scheduler, by most kernels, on a processor that is never idle
NOD = 0.0001  # seconds in which another thread on this processor begins to run
LOOK = 8  # queries between two looks around: with 0.1 ms for one, about a millisecond
PATIENCE = 8  # how often a job gives way to questions; after that it is finished first, or it might never be

_claims = Lock()


class Job(Struct, eq=False):
    """Something to do. Whoever claims it may answer it, and nobody else.

    `run` and `drop` are given the job, so that neither refers to it: a document is kept no longer than its questions.
    """

    kind: Literal["edit", "quick", "diagnosis", "slow", "idle"]
    run: Callable[[Job], None]
    outdated: Callable[[], bool] = field(default=lambda: False)
    drop: Callable[[Job], None] = field(default=lambda job: None)
    stop: Callable[[], None] = field(default=lambda: None)
    given_way: int = 0
    _claimed: bool = False

    def claim(self) -> bool:
        """True for the first caller."""
        with _claims:
            claimed, self._claimed = self._claimed, True
            return not claimed

    @property
    def claimed(self) -> bool:
        return self._claimed


class Worker:
    """A queue of jobs and the thread that does them.

    `idle` gives the steps of idle work, and a None after those that slow questions wait for. `dead` is called if the
    thread cannot start, `rest` when there has been nothing to do for a while, and again as long as it says so.
    `arrived` says whether a message has come that nobody has read.
    """

    def __init__(
        self,
        start: Callable[[], Database],
        idle: Callable[[], Iterator[Callable[[], None] | None]],
        dead: Callable[[], None] = lambda: None,
        rest: Callable[[], bool] = lambda: False,
        arrived: Callable[[], bool] = lambda: False,
    ) -> None:
        self._start, self._idle, self._dead, self._rest, self._arrived = start, idle, dead, rest, arrived
        self._db: Database | None = None
        self._inbox: SimpleQueue[Job | None] = SimpleQueue()
        self._quick: deque[Job] = deque()
        self._diagnoses: deque[Job] = deque()
        self._slow: deque[Job] = deque()
        self._steps: Iterator[Callable[[], None] | None] | None = None
        self._urgent = False  # whether slow questions wait for the next step
        self._running: Job | None = None
        self._since = 0.0
        self._looked = 0  # queries since the last look around
        self._thread = Thread(target=self._work, name="potto-analysis", daemon=True)

    def start(self) -> None:
        """Start. Jobs that were queued before have waited."""
        self._thread.start()

    def put(self, job: Job) -> None:
        """Queue a job, from any thread. A running job that is less urgent gives way."""
        self._inbox.put(job)
        running, db = self._running, self._db
        if running is None or db is None:
            return
        if job.kind == "slow" and (running.kind != "idle" or self._urgent):
            return
        if job.kind == "diagnosis" and (running.kind not in ("slow", "idle") or self._urgent):
            return
        if job.kind == "quick" and running.given_way >= PATIENCE:
            return
        if running.kind in YIELDING or (job.kind == "edit" and time.monotonic() - self._since > LONG):
            db.cancel()

    def cancelled(self, job: Job) -> None:
        """Nobody waits for this job any more."""
        if self._running is job and self._db is not None:
            self._db.cancel()

    def _work(self) -> None:
        try:
            self._db = self._start()
            self._db.look_around = self._look_around
        except BaseException:
            logger.critical("the analysis cannot start", exc_info=True)
            self._dead()
            raise
        while True:
            job = self._next()
            if job is not None:
                self._do(job)

    def _next(self) -> Job | None:
        """The next job; None after a step of idle work."""
        self._receive(wait=False)
        if self._quick:
            return self._quick.popleft()
        if self._diagnoses:
            return self._diagnoses.popleft()
        if self._slow and not self._urgent:
            return self._slow.popleft()
        if self._steps is None:
            again = True
            while not self._receive(wait=True, seconds=REST if again else None):
                again = self._rest()
            return None
        try:
            step = next(self._steps)
        except StopIteration:
            self._steps, self._urgent = None, False
            return None
        except Exception:  # the rest of idle work is lost until the next edit; whoever asks is answered
            logger.error("idle work failed", exc_info=True)
            self._steps, self._urgent = None, False
            return None
        if step is None:
            self._urgent = False
            return None
        return Job("idle", lambda job: step())

    def _receive(self, wait: bool, seconds: float | None = None) -> bool:
        """Sort the jobs that have come, or that come within `seconds`. Whether there were any."""
        found = False
        try:
            while True:
                job = self._inbox.get(wait, seconds)
                wait, found = False, True
                if job is not None:
                    waiting = {"slow": self._slow, "diagnosis": self._diagnoses}.get(job.kind, self._quick)
                    waiting.append(job)
                if job is None or job.kind == "edit":
                    self._steps, self._urgent = self._idle(), True
        except Empty:
            return found

    def check_again(self) -> None:
        """Start the idle work over."""
        self._inbox.put(None)

    def _do(self, job: Job) -> None:
        from potto.query import Cancelled

        assert self._db is not None
        if job.claimed:
            return
        if job.kind != "edit" and job.outdated():
            job.drop(job)
            return
        self._since, self._running = time.monotonic(), job
        try:
            with self._db.evaluating():
                if job.kind in YIELDING and job.given_way < PATIENCE and not self._inbox.empty():
                    raise Cancelled  # what came before this evaluation began could not cancel it
                job.run(job)
        except Cancelled:
            self._give_way(job)
        except Exception:
            logger.error("a job failed", exc_info=True)
        finally:
            self._running = None
        if job.kind == "quick" and not self._quick and self._inbox.empty():
            time.sleep(NOD)  # whoever is answered may be on this processor, and would wait for it as well

    def _look_around(self) -> None:
        """Leave the processor to the reading thread if a message has arrived and the running job gives way. Where both
        share a processor, a thread that wakes would otherwise wait for the next tick while the other has work."""
        self._looked = (self._looked + 1) % LOOK
        job = self._running
        if self._looked or job is None or job.kind not in YIELDING or not self._arrived():
            return
        until = time.monotonic() + TICK
        while self._inbox.empty() and time.monotonic() < until:
            time.sleep(NOD)

    def _give_way(self, job: Job) -> None:
        """Return to a job after everything more urgent; to idle work only if no edit has restarted it."""
        if job.kind == "idle":
            self._steps = chain([lambda: job.run(job)], self._steps or ())
        elif not job.claimed:
            job.given_way += 1
            (self._diagnoses if job.kind == "diagnosis" else self._slow).appendleft(job)
