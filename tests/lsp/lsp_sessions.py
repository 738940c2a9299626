"""Recorded sessions of editors: see `sessions/README.md`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

SESSIONS = sorted((Path(__file__).parent / "sessions").glob("*.jsonl"))


def capabilities_of(editor: str) -> dict[str, Any]:
    """What an editor says that it can do."""
    path = next(path for path in SESSIONS if path.name.startswith(editor))
    with path.open(encoding="utf-8") as file:
        found: dict[str, Any] = json.loads(file.readline())["params"]["capabilities"]
    return found
