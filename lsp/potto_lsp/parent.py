"""The server ends when its client has died.

Owns `watch`. The end of standard input shows this too, but not if another process holds the pipe open.
"""

from __future__ import annotations

import logging
import os
import select
import sys
import time
from threading import Thread

logger = logging.getLogger(__name__)
PAUSE = 1.0  # seconds between two looks where the system cannot tell by itself


def watch(process: int) -> None:
    """End this process soon after another one has ended."""
    Thread(target=_watch, args=(process,), name="potto-parent", daemon=True).start()


def _watch(process: int) -> None:
    if hasattr(os, "pidfd_open"):
        _wait_for_descriptor(process)
    else:
        while _is_alive(process):
            time.sleep(PAUSE)
    logger.warning("the client (process %d) is gone", process)
    logging.shutdown()
    os._exit(1)


def _wait_for_descriptor(process: int) -> None:
    try:
        descriptor = os.pidfd_open(process)
    except ProcessLookupError:
        return
    except OSError:  # not ours to watch, or an old kernel
        while _is_alive(process):
            time.sleep(PAUSE)
        return
    poll = select.poll()
    poll.register(descriptor, select.POLLIN)
    poll.poll()
    os.close(descriptor)


def _is_alive(process: int) -> bool:
    if sys.platform == "win32":  # there, os.kill would end it
        import ctypes

        handle = ctypes.windll.kernel32.OpenProcess(0x00100000, False, process)
        if not handle:
            return False
        waiting = ctypes.windll.kernel32.WaitForSingleObject(handle, 0)
        ctypes.windll.kernel32.CloseHandle(handle)
        return bool(waiting == 0x102)
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
