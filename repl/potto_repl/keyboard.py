"""The keyboard between two prompts: keys are kept for the next one instead of being echoed into the answer.

Owns `quiet_keys`, `loud_keys` and `kept_interrupts`. Ctrl-C remains an interrupt throughout. Without a terminal the
first two do nothing.
"""

from __future__ import annotations

import _thread
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

MOMENT = 0.01  # seconds until an interrupt that could not be raised comes again

_before: list[Any] = []
_coming: list[threading.Timer] = []  # interrupts that come again


@contextmanager
def quiet_keys() -> Iterator[None]:
    """Keep keys as they are typed, without echo and line by line, so that an early Ctrl-D isn't lost."""
    saved = _attributes()
    if saved is None:
        yield
        return
    import termios

    quiet = [*saved[:6], list(saved[6])]
    quiet[0] &= ~termios.ICRNL
    quiet[3] &= ~(termios.ICANON | termios.ECHO)
    _before.append(saved)
    _set(quiet)
    try:
        yield
    finally:
        _before.pop()
        _set(saved)


@contextmanager
def loud_keys() -> Iterator[None]:
    """The keyboard as other programs expect it, for an editor."""
    here = _attributes()
    if here is None or not _before:
        yield
        return
    _set(_before[-1])
    try:
        yield
    finally:
        _set(here)


@contextmanager
def kept_interrupts() -> Iterator[None]:
    """Neither lose a Ctrl-C nor let it do harm: if it can't be raised, or a module is half imported, it comes again."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    hook, handler = sys.unraisablehook, signal.getsignal(signal.SIGINT)

    def lost(what: sys.UnraisableHookArgs) -> None:
        if isinstance(what.exc_value, KeyboardInterrupt):
            _again()
        else:
            hook(what)

    sys.unraisablehook = lost
    signal.signal(signal.SIGINT, _interrupted)
    try:
        yield
    finally:
        while _coming:  # none may come when this is over
            timer = _coming.pop()
            timer.cancel()
            timer.join()
        sys.unraisablehook = hook
        signal.signal(signal.SIGINT, handler)


def _interrupted(_number: int, frame: FrameType | None) -> None:
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            _again()
            return
        frame = frame.f_back
    raise KeyboardInterrupt


def _again() -> None:
    """Interrupt once more, in a moment."""
    timer = threading.Timer(MOMENT, _thread.interrupt_main)
    timer.daemon = True
    _coming.append(timer)
    timer.start()


def _attributes() -> Any:
    try:
        import termios
    except ImportError:
        return None  # a system without termios
    try:
        return termios.tcgetattr(sys.stdin.fileno())
    except (OSError, ValueError, termios.error):
        return None  # no terminal


def _set(attributes: Any) -> None:
    import termios

    termios.tcsetattr(sys.stdin.fileno(), termios.TCSANOW, attributes)
