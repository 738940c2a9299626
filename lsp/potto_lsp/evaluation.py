"""The server's side of the evaluation process, which is started when first needed and given one task at a time.

Owns `EvaluationQueue` and `EvaluationTask`. A task has limits of time and memory and can be cancelled: the process is
interrupted, and killed if it doesn't react. If it dies, the next task starts a new one.
"""

from __future__ import annotations

import itertools
import json
import logging
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from queue import Empty, PriorityQueue, SimpleQueue
from threading import Event, Thread
from typing import TYPE_CHECKING, Any

from msgspec import Struct, field

if TYPE_CHECKING:
    from potto_lsp.analysis import Analysis

logger = logging.getLogger(__name__)
LIMIT, LOADING, GRACE = 10.0, 60.0, 0.5  # seconds: for a task, for the start, to heed an interrupt
MEMORY = 4096.0  # megabytes for a task
PATIENCE = 0.3  # seconds that a task may run on while a more urgent one waits
COMMAND, LIVE, POINTS = 0, 1, 2  # the urgency of tasks: what a user asked for comes first


class EvaluationTask(Struct, eq=False):
    """Something to evaluate. `done` is called once, on the evaluator's thread, with either `result` or `error`."""

    do: str
    file: str
    text: str
    done: Callable[[Mapping[str, Any]], None]
    more: Mapping[str, Any] = {}
    cancelled: Event = field(default_factory=Event)
    texts: Mapping[str, str] = {}
    roots: tuple[str, ...] = ()
    limit: float = LIMIT
    memory: float = MEMORY
    urgency: int = COMMAND


class Ended(Exception):
    """The process ended without an answer."""


class GivesWay(Exception):
    """A task was stopped for a more urgent one."""


class EvaluationQueue:
    """The queue of tasks, and the process that carries them out."""

    def __init__(self, analysis: Analysis) -> None:
        self._analysis = analysis
        self._tasks: PriorityQueue[tuple[int, int, EvaluationTask]] = PriorityQueue()
        self._thread: Thread | None = None
        self._process: subprocess.Popen[str] | None = None
        self._said: SimpleQueue[Mapping[str, Any] | None] = SimpleQueue()
        self._sent: dict[str, str] = {}
        self._ids, self._order = itertools.count(1), itertools.count(1)

    def put(self, task: EvaluationTask) -> EvaluationTask:
        """Queue a task, with the texts as they are now. For the thread that owns the database."""
        analysis = self._analysis
        task.texts = {key: document.text.text for key, document in analysis.documents.items()}
        task.roots = analysis.files.roots
        task.limit = self._setting("evaluation.timeLimit", LIMIT)
        task.memory = self._setting("evaluation.memoryLimit", MEMORY)
        if self._thread is None:
            self._thread = Thread(target=self._work, name="potto-evaluation", daemon=True)
            self._thread.start()
        self._add(task)
        return task

    def _setting(self, name: str, default: float) -> float:
        """A limit set by the user, if it is a positive number."""
        value = self._analysis.settings.get(name)
        return float(value) if isinstance(value, int | float) and value > 0 else default

    def _add(self, task: EvaluationTask) -> None:
        self._tasks.put((task.urgency, next(self._order), task))

    @property
    def started(self) -> bool:
        """Whether a process was ever started."""
        return self._thread is not None

    def close(self) -> None:
        """End the process."""
        self._end()

    def _work(self) -> None:
        while True:
            task = self._tasks.get()[-1]
            if task.cancelled.is_set():
                task.done({"error": "cancelled"})
                continue
            try:
                answer = self._answered(task)
            except GivesWay:
                self._add(task)
                continue
            except Exception:
                logger.error("the evaluation failed", exc_info=True)
                self._end()
                answer = {"error": "the evaluation process failed"}
            task.done(answer)

    def _answered(self, task: EvaluationTask) -> Mapping[str, Any]:
        """The answer to a task. If the process ends, something else may have killed it, so a new one is asked; if that
        ends too, the task is to blame."""
        for _ in range(2):
            try:
                return self._answer(task)
            except Ended:
                self._end()
        return {"error": "the evaluation process ended unexpectedly"}

    def _answer(self, task: EvaluationTask) -> Mapping[str, Any]:
        process = self._running()
        if process is None:
            return {"error": "the evaluation process does not start"}
        id = next(self._ids)
        closed = {key: None for key in self._sent if key not in task.texts}
        texts = {key: text for key, text in task.texts.items() if self._sent.get(key) != text}
        self._sent = dict(task.texts)
        message = {"id": id, "do": task.do, "file": task.file, "text": task.text, "roots": task.roots}
        message |= {"memory": task.memory, **task.more}
        assert process.stdin is not None
        try:
            process.stdin.write(json.dumps({**message, "texts": {**texts, **closed}}) + "\n")
            process.stdin.flush()
        except OSError as error:
            raise Ended from error
        return self._await(id, task)

    def _await(self, id: int, task: EvaluationTask) -> Mapping[str, Any]:
        begun = time.monotonic()
        deadline = begun + task.limit
        while True:
            if task.cancelled.is_set():
                return self._interrupt(id, "cancelled")
            if self._is_pressed(task) and time.monotonic() - begun > PATIENCE:
                self._interrupt(id, "")
                raise GivesWay
            left = deadline - time.monotonic()
            if left <= 0:
                return self._interrupt(id, f"stopped after {task.limit:g} seconds")
            try:
                said = self._said.get(timeout=min(left, 0.02))
            except Empty:
                continue
            if said is None:
                raise Ended
            if said.get("id") == id:
                return said

    def _is_pressed(self, task: EvaluationTask) -> bool:
        """Whether something more urgent is waiting."""
        with self._tasks.mutex:
            return bool(self._tasks.queue) and self._tasks.queue[0][0] < task.urgency

    def _interrupt(self, id: int, why: str) -> Mapping[str, Any]:
        """Interrupt the running task; kill the process if it doesn't react."""
        import signal

        process = self._process
        if process is not None and sys.platform != "win32":
            process.send_signal(signal.SIGINT)
            deadline = time.monotonic() + GRACE
            while (left := deadline - time.monotonic()) > 0:
                try:
                    said = self._said.get(timeout=left)
                except Empty:
                    break
                if said is None or said.get("id") == id:
                    return {"error": why}
        self._end()
        return {"error": why}

    def _running(self) -> subprocess.Popen[str] | None:
        """The process, started if necessary."""
        if self._process is not None and self._process.poll() is None:
            return self._process
        self._sent, self._said = {}, SimpleQueue()
        command = [sys.executable, "-P", "-m", "potto_lsp.evaluator"]
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=None, text=True, encoding="utf-8")
        Thread(target=_listen, args=(self._process, self._said), name="potto-listener", daemon=True).start()
        try:
            ready = self._said.get(timeout=LOADING)
        except Empty:
            ready = None
        if ready is None:
            self._end()
            return None
        return self._process

    def _end(self) -> None:
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.wait()


def _listen(process: subprocess.Popen[str], said: SimpleQueue[Mapping[str, Any] | None]) -> None:
    assert process.stdout is not None
    for line in process.stdout:
        said.put(json.loads(line))
    said.put(None)
