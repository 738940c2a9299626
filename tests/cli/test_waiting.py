"""Who waits at a terminal sees how far an evaluation is, on a line that goes away; others see nothing of it."""

from __future__ import annotations

import io

import pytest

import potto
from potto.cli.console import Console
from potto.evaluating import progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_line_says_how_far_an_evaluation_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "PATIENCE", 0.0)
    ball = potto.compile("def ball(r) integral ([-1, 1], [-1, 1]) [x*x + y*y < r] d(x, y)").ball
    shown = []
    for stream in (Terminal(), io.StringIO()):
        console = Console(io.StringIO(), stream, "never")
        with console.waiting(), potto.settings(method="mc", samples=1_000_000):
            ball(0.5)
        shown.append(stream.getvalue())
        assert console.out.getvalue() == ""  # type: ignore[attr-defined]
    assert "\r\x1b[Kevaluating, " in shown[0] and shown[0].endswith("\r\x1b[K") and shown[1] == ""


def test_times_that_one_waits_are_round() -> None:
    assert [progress.duration(x) for x in (1.44, 114.9, 600, 11160)] == ["1.4 s", "2 min", "10 min", "3.1 h"]
