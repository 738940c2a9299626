"""The table of worlds beside sums that are differentiated: what the sums lack is there, and no more than that."""

from __future__ import annotations

import runpy
from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from worlds_references import EXAMPLES

BESIDE: dict[str, Any] = runpy.run_path(str(EXAMPLES / "beside.py"))
WORLDS = range(len(BESIDE["WORLDS"]))


def named(number: int) -> str:
    return str(BESIDE["WORLDS"][number].sampled.__name__)


@lru_cache
def row_of(number: int) -> Any:
    return BESIDE["row"](BESIDE["WORLDS"][number])


def test_every_program_is_there() -> None:
    """Of the paper's one for its renderer, of the ray tracer's those that have pixels."""
    folders = ("dynamics", "probability", "fields")
    wanted = {f"{folder}/{file.stem}" for folder in folders for file in (EXAMPLES / folder).glob("*.po")}
    wanted |= {"paper/image", "stylize/stylize", *(f"raytrace/{n}" for n in ("main", "hidden", "sphere", "shadows"))}
    assert {world.program for world in BESIDE["WORLDS"]} == wanted


def test_what_others_say_is_told_of_every_program() -> None:
    page = (EXAMPLES.parent / "docs" / "worlds.md").read_text(encoding="utf-8").partition("## What other tools say")[2]
    rows = [row.split("|") for row in page.splitlines() if row.startswith("| `")]
    assert all("](https://" in source for *_, source, _ in rows)
    told = " ".join(row[1] for row in rows)
    for world in BESIDE["WORLDS"]:
        assert f"`{world.program}`" in told or f"`{world.program.partition('/')[2]}`" in told, world.program


@pytest.mark.parametrize("number", WORLDS, ids=named)
def test_values_agree_and_slopes_of_sums_lack_the_boundary(number: int) -> None:
    """What bends and does not jump, the newsvendor's cost, has the derivative of its sum. Of all others a tenth of it
    or more is missing, mostly all."""
    row = row_of(number)
    assert abs(row.sampled - row.value) < row.world.near * max(1.0, abs(row.value))
    lacking = abs(row.sampled_slope - row.slope)
    assert lacking < 1e-4 if row.world.smooth else lacking > 0.1 * abs(row.slope) > 0.001


@pytest.mark.parametrize("number", WORLDS, ids=named)
def test_differences_of_sums_see_it(number: int) -> None:
    """The sum's values, a tenth apart, change as our derivative says, to what samples can tell."""
    row = row_of(number)
    up, down = (np.real(row.world.sampled(np, np.complex128(row.world.place + h))) for h in (0.05, -0.05))
    assert abs((up - down) / 0.1 - row.slope) < 0.03 * max(1.0, abs(row.slope))
