"""The page of limits says what Potto says: each of its programs is refused, or answered with what stands under it."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import pytest

import potto

PAGE = Path(__file__).resolve().parents[2] / "docs" / "limits.md"
BLOCKS = re.findall(r"(?m)^```potto-limit\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.DOTALL)


def said(program: str, asked: str | None) -> list[str]:
    """All that is said about a program, or about the value of an expression."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", potto.ProgramWarning)
        try:
            module = potto.compile(program + ("" if asked is None else f"\nasked = {asked}\n"))
            if asked is None:
                module.f  # noqa: B018
                return []
            answer = module.asked
        except potto.PottoError as error:
            return [f"{d.code}: {d.message}" for d in error.diagnostics]
    return [*answer.reasons, *map(str, answer.notes)]


@pytest.mark.parametrize("block", BLOCKS, ids=range(len(BLOCKS)))
def test_what_the_page_says_is_said(block: str) -> None:
    lines = block.rstrip("\n").split("\n")
    expected = lines.pop().removeprefix("# ")
    asked = lines.pop().removeprefix("#> ") if lines[-1].startswith("#> ") else None
    found = said("\n".join(lines) + "\n", asked)
    assert any(expected in message for message in found), found
