"""How a helper process begins: as a copy of this one, or as a new one.

Owns `begun` and `can_be_copied`. A copy takes 5 ms and has everything loaded; a new process takes 120. Copied is only
what has no threads but Python's own, since the copy has none but its first: libraries with pools of threads would wait
for theirs. Should a copy hang all the same, nobody waits for it.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import warnings
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO, Protocol, cast

# Not `-m`, which looks for every module in the working folder first.
PROGRAM = "import sys; sys.path.append(sys.argv[1]); from potto.crew.helper import main; main()"
WITH_THREADS = frozenset({"numpy", "llvmlite"})  # whoever loads others with pools of threads has loaded numpy
Serve = Callable[[BinaryIO, BinaryIO], None]


class Process(Protocol):
    """What a crew asks of a process."""

    @property
    def pid(self) -> int: ...
    def poll(self) -> int | None:
        """None while it runs."""

    def kill(self) -> None: ...
    def wait(self) -> int: ...


def can_be_copied() -> bool:
    """Whether a copy of this process works: on Linux, without libraries that have threads."""
    return sys.platform == "linux" and WITH_THREADS.isdisjoint(sys.modules)


def begun(serve: Serve) -> tuple[Process, BinaryIO, BinaryIO]:
    """A helper process, where it reads its tasks and where it writes its answers. `serve` is what a copy does; it must
    end when its input does. Raises OSError if it does not start."""
    return _copied(serve) if can_be_copied() else _started()


def _started() -> tuple[Process, BinaryIO, BinaryIO]:
    pipe = subprocess.PIPE
    command = [sys.executable, "-P", "-c", PROGRAM, str(Path(__file__).parents[2])]
    process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL)
    return process, cast(BinaryIO, process.stdin), cast(BinaryIO, process.stdout)


class _Copy:
    """A child process by its id, as `subprocess` would show it."""

    def __init__(self, pid: int) -> None:
        self.pid = pid
        self._status: int | None = None

    def poll(self) -> int | None:
        return self._ended(os.WNOHANG)

    def wait(self) -> int:
        status = self._ended(0)
        assert status is not None
        return status

    def kill(self) -> None:
        if self.poll() is None:
            os.kill(self.pid, signal.SIGKILL)

    def _ended(self, how: int) -> int | None:
        if self._status is None:
            try:
                pid, status = os.waitpid(self.pid, how)
            except ChildProcessError:  # somebody else has waited for it
                pid, status = self.pid, 0
            if pid == self.pid:
                self._status = os.waitstatus_to_exitcode(status)
        return self._status


def _copied(serve: Serve) -> tuple[Process, BinaryIO, BinaryIO]:
    its_tasks, tasks = os.pipe()
    answers, its_answers = os.pipe()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of Python 3.12 on, if there are threads: see above
        pid = os.fork()
    if pid == 0:
        _be_the_copy(serve, its_tasks, its_answers)
    os.close(its_tasks)
    os.close(its_answers)
    return _Copy(pid), os.fdopen(tasks, "wb"), os.fdopen(answers, "rb")


def _be_the_copy(serve: Serve, tasks: int, answers: int) -> None:
    """Do the work of a helper in the copy, and end it."""
    with suppress(BaseException):
        _leave_alone({tasks, answers})
        serve(os.fdopen(tasks, "rb"), os.fdopen(answers, "wb"))
    os._exit(0)


def _leave_alone(own: set[int]) -> None:
    """Close whatever belongs to the process that was copied: whoever reads it must see its end."""
    null = os.open(os.devnull, os.O_RDWR)
    for standard in (0, 1, 2):
        os.dup2(null, standard)
    for other in [int(name) for name in os.listdir("/proc/self/fd")]:
        if other > 2 and other not in own:
            with suppress(OSError):
                os.close(other)
