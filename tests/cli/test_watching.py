"""What `--watch` waits for."""

from __future__ import annotations

import pytest

from potto.cli import files


def test_a_file_that_is_being_written_is_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing, a change, another one at once (at first it was empty), nothing: only now there is what to look at."""
    said, slept = [False, True, True, False], list[float]()
    monkeypatch.setattr(files.time, "sleep", slept.append)
    files.wait(lambda: said.pop(0))
    assert not said and slept == [files.PAUSE, files.SETTLED, files.SETTLED]
