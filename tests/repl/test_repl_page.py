"""The sessions on docs/repl.md: each is what the prompt says. `POTTO_UPDATE=1` writes the answers anew."""

from __future__ import annotations

import os
import re
from pathlib import Path

from potto_repl.registry import COMMANDS
from test_repl_new_user import settled

PAGE = Path(__file__).resolve().parents[2] / "docs" / "repl.md"
_BLOCK = re.compile(r"(?<=```\n)po> .*?(?=```)", re.DOTALL)


def test_the_sessions_on_the_page(talk):
    page = PAGE.read_text(encoding="utf-8")

    def answered(found):
        asked = [line.removeprefix("po> ") for line in found[0].splitlines() if line.startswith("po> ")]
        return "".join(f"po> {text}\n{talk(text).text}\n" for text in asked)

    fresh = _BLOCK.sub(answered, page)
    if os.environ.get("POTTO_UPDATE"):
        PAGE.write_text(fresh, encoding="utf-8")
    assert _loosely(fresh) == _loosely(page)


def _loosely(text):
    """Without what is measured: times, whole lines in the table of times, what was in memory, and what only a slow
    machine says."""
    measured = r"(?:parse|check|compile|link|plan|evaluate|total|(?:\d+|#) (?:kernels?|functions?|evaluations))\b"
    lines = [line for line in settled(text).splitlines() if not re.match(measured, line)]
    row = re.compile(r"(?:mc|qmc|quadrature|method)\b")
    return "\n".join(" ".join(line.split()[:-2]) if row.match(line) else line for line in lines)


def test_the_table_of_commands_is_complete():
    listed = set(re.findall(r"^\| `:(\w+)", PAGE.read_text(encoding="utf-8"), re.MULTILINE))
    assert listed == set(COMMANDS)
