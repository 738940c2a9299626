"""The keyboard between two prompts: keys are kept for the next one, and not echoed into the answer.

Owns `quiet_keys` and `loud_keys`. Ctrl-C stays an interrupt throughout. Without a terminal both do nothing.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

_before: list[Any] = []


@contextmanager
def quiet_keys() -> Iterator[None]:
    """Keep keys as they are typed: no echo, no lines, so that a Ctrl-D typed too early is not lost."""
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
