"""What a user types in the first minutes, and what Python answers: `first_minutes.txt`, run as it stands."""

from __future__ import annotations

import doctest
from pathlib import Path


def test_the_first_minutes() -> None:
    path = Path(__file__).with_name("first_minutes.txt")
    failed, tried = doctest.testfile(str(path), module_relative=False, optionflags=doctest.ELLIPSIS)
    assert tried > 20 and not failed
