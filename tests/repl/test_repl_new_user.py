"""A session of somebody new to Potto: everything that is said, and the numbers against closed forms.

`POTTO_UPDATE=1` writes the transcript anew; then read what `git diff` says.
"""

from __future__ import annotations

import math
import os
import re
from pathlib import Path

import pytest
from potto_repl.without_terminal import entries

HERE = Path(__file__).parent
GOLDEN = HERE / "new_user_transcript.txt"
# What is measured or rounded differently from machine to machine.
_CHANGING = ((r"\n?^exact, .*$", ""),  # said where it took long enough to be noticed
             (r"(?:^.*[│└].*\n)+.*\n", "[picture]\n"), (r"± \([^)]*\)", "± #"), (r"(at \w+ = \d\.\d{5})\d+", r"\1"),
             (r"[\d,.]+ (?:ms|s)\b", "# ms"), (r"± \d(?:\.\d)?e-\d+", "± #"), (r"[\d,]+ evaluations", "# evaluations"),
             (r"slope \d\.\de-\d+", "slope #"), (r"= \d(?:\.\d+)?e-\d\d\b", "= #"), (r"\d+ steps", "# steps"),
             (r"\d+ points, error at most \d\.\de-\d+", "# points, error at most #"),
             (r"\d\.\de-1\d apart|\b0 apart", "# apart"), (r"\b\d\.\de-1\d\b", "#"),
             # beside an error a value has as many digits as the error has
             (r"(\d\.\d{11})\d+", r"\1"), (r"\.0{9,}(?!\d)", ""), (r"(\.\d*?[1-9])0{6,}(?!\d)", r"\1"))  # fmt: skip


def settled(text):
    for pattern, with_what in _CHANGING:
        text = re.sub(pattern, with_what, text, flags=re.MULTILINE)
    return text


@pytest.fixture
def session_of_a_new_user(talk):
    found = []
    for text in entries((HERE / "new_user.txt").read_text().splitlines()):
        reply = talk(text)
        found.append((text, reply))
    return found


def test_the_transcript(session_of_a_new_user):
    said = "\n".join(f"po> {text}\n{settled(reply.text)}\n" for text, reply in session_of_a_new_user)
    if os.environ.get("POTTO_UPDATE"):
        GOLDEN.write_text(said, encoding="utf-8")
    assert said == GOLDEN.read_text(encoding="utf-8")


NUMBERS = {
    "1 + 2": 3,
    "f(0.3)": 0.3,
    "f(x)": 0.25,
    "g(0.5)": 0.5**2 / 2,
    "disc(1)": math.pi,
    "sqrt(2)": math.sqrt(2),
    "_^2": 2,
    "Out[3] * 10": 3,
    "m": 1 + 4,
    "fact(5)": 120,
    "fact(7)": 7,
    "_(3)": 9,
    ":eval f(0.9)": 0.9,
    "f(0.75)": 0.75,
}


def test_the_numbers_are_closed_forms(session_of_a_new_user):
    replies = {}
    for text, reply in session_of_a_new_user:
        replies.setdefault(text, reply)
    for text, value in NUMBERS.items():
        data = replies[text].parts[0].data
        assert data["value"] == pytest.approx(value, rel=1e-9), text
        assert abs(data["value"] - value) <= data["error"] + 1e-15 * abs(value), text  # the error bar holds
    pair = replies["(f(0.5), g(1))"].parts[0].data
    assert pair["value"] == pytest.approx([0.5, 0.5], rel=1e-12)
    slope = replies["deriv(f)((0.3, 1))"].parts[0].data
    assert (slope["tangent"], slope["interior"], slope["boundary"]) == pytest.approx((1, 0, 1), rel=1e-12)
    assert replies["for v in [1, 2, 3]:\n    print(v, f(v/4))"].text == "1 0.25\n2 0.5\n3 0.75"
    grad = replies[":grad g(0.5)"].parts[0].data["gradient"]
    assert grad["t"] == pytest.approx(0.5, rel=1e-12)  # the jump at x = t is t high
    assert replies[":grad disc(1)"].parts[0].data["gradient"]["r"] == pytest.approx(2 * math.pi, rel=1e-7)
    fitted = replies[":fit loss t=0.9"].parts[0].data["parameters"]["t"]
    assert fitted == pytest.approx(0.4, abs=1e-5)  # t^2/2 = 0.08


def test_mistakes_of_a_new_user_are_answered(session_of_a_new_user):
    failed = [text.partition("\n")[0] for text, reply in session_of_a_new_user if reply.failed]
    assert failed == ["x + t", "f(y)", "def g(t)", "fact(5)", ":tpye f"]
