"""How many examples a law is tried on: a few in the tests, which are the same each time, many where new ones are looked
for (`make fuzz`).

Owns `examples` and `the_same`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from hypothesis import seed, settings

Test = TypeVar("Test", bound=Callable[..., None])
LOOKING = not settings().derandomize


def examples(few: int, many: int = 1000) -> int:
    return many if LOOKING else few


def the_same(number: int) -> Callable[[Test], Test]:
    """Examples from a seed, unless new ones are looked for."""
    return (lambda test: test) if LOOKING else seed(number)
