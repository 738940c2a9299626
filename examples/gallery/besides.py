"""The programs of the gallery beside those that sample first, and what was said of the same questions elsewhere.

Owns `Beside`, `besides` and `sampled_by`. Numbers are those of `examples/beside.py`, by JAX where it is installed; what
was said elsewhere stands in a table of `docs/worlds.md`, which is read here.
"""

from __future__ import annotations

import importlib.util
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

EXAMPLES = Path(__file__).resolve().parents[1]
sys.path.append(str(EXAMPLES))
from beside import WORLDS, Row, by_jax, by_numpy, row  # noqa: E402

PAGE, HEADING = EXAMPLES.parent / "docs" / "worlds.md", "## What other tools say"


@dataclass(frozen=True)
class Beside:
    """A program's numbers beside those of samples; what was said elsewhere, where, and the address of that."""

    program: str
    numbers: Row
    said: str
    source: str
    address: str


def sampled_by() -> str:
    """What samples are summed up by, and differentiated."""
    return "JAX" if importlib.util.find_spec("jax") else "numpy"


def besides(folder: str) -> list[Beside]:
    """Those of a folder of examples, in order."""
    sampler = by_jax if sampled_by() == "JAX" else by_numpy
    told = {program: rest for program, *rest in _told()}
    nothing = ["", "", ""]
    return [
        Beside(world.program, row(world, sampler), *told.get(world.program, nothing))
        for world in WORLDS
        if world.program.startswith(f"{folder}/")
    ]


def _told() -> Iterator[tuple[str, str, str, str]]:
    """Programs, what was said, where, and the address: rows of the table, one of which may be about several."""
    for line in PAGE.read_text(encoding="utf-8").partition(HEADING)[2].splitlines():
        found = re.match(r"\| (`.+?`) \| (.+) \| \[(.+)\]\((.+)\) \|$", line)
        if found:
            names, said, source, address = found.groups()
            first, *others = re.findall("`(.+?)`", names)
            folder = first.partition("/")[0]
            for program in (first, *(f"{folder}/{other}" for other in others)):
                yield program, said, source, address
