"""Regions and conditions with answers by mathematics, shared by tests and benchmarks.

Owns `Region`, `REGIONS` and `ENTRIES`, what the file says. They stand beside the tests and not in the package, as they
are to judge any version of it: a benchmark that loads another checkout of Potto still asks these questions and compares
with these answers. Programs and answers are data, in `regions.json`; the mathematics is in `references`, and with
`recompute.py` the answers are found anew.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

FILE = Path(__file__).parent / "regions.json"
WITHIN = {1: 1e-9, 2: 1e-9}  # the relative error that is asked for, by the number of variables
WITHIN_MORE = 1e-7


@dataclass(frozen=True)
class Region:
    """An integral as a function `f` of one parameter, and what is known of it.

    at: where the parameter is. value, derivative, second: by mathematics, the second derivative for some of them.
    """

    id: str
    dimensions: int
    kind: str
    why: str
    program: str
    at: float
    value: float
    derivative: float
    second: float | None

    @property
    def within(self) -> float:
        """The relative error that an answer may have."""
        return WITHIN.get(self.dimensions, WITHIN_MORE)


def _region(entry: Mapping[str, Any]) -> Region:
    second = entry.get("second")
    return Region(
        entry["id"], entry["dimensions"], entry["kind"], entry["why"], "\n".join(entry["program"]), entry["at"],
        float(entry["value"]), float(entry["derivative"]), None if second is None else float(second),
    )  # fmt: skip


ENTRIES: dict[str, dict[str, Any]] = {
    entry["id"]: entry for entry in json.loads(FILE.read_text(encoding="utf-8"))["regions"]
}
REGIONS: dict[str, Region] = {name: _region(entry) for name, entry in ENTRIES.items()}
