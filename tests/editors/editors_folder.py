"""Where the editors' files are, and what runs an editor."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

EDITORS = Path(__file__).resolve().parents[2] / "editors"
Run = Callable[..., str]
