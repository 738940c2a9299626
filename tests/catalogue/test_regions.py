"""Every region of the catalogue: value and derivative with bounds that cover and are within the goal.

The goal is a relative error of 1e-9 in one and two variables and of 1e-7 in more. What is not within it is listed, with
what happens instead, and expected to fail: once it is mended its test turns red until the list is shorter.
"""

from __future__ import annotations

import math
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

import pytest
from recompute import SECONDS, TRUTHS, difference, reference
from regions import ENTRIES, REGIONS, Region

import potto

EPS = 2.0**-52
PATIENCE = 40.0  # seconds of processor time that a region may take, on a machine half as fast as others
SECOND_WITHIN = 1e-6  # what is asked of second derivatives

UNMET: dict[str, str] = {}
UNMET_SECOND: dict[str, str] = {}
SLOW = set(UNMET) | {
    "ball of normals", "depth test", "flower", "folium", "folium and wings", "gyroid corner", "quartic", "quartic ball",
    "gyroid slab", "near a fold", "three cosines", "three metaballs", "torus", "torus, quartic", "touching ball, 4-D",
    "touching ball, 5-D", "touching ball, 6-D", "two metaballs", "weighted cubic",
}  # fmt: skip


class TooSlow(Exception):
    pass


@contextmanager
def within_patience() -> Iterator[None]:
    """An exception after some seconds of the processor, however many others use the machine."""

    def stop(number: int, frame: FrameType | None) -> None:
        raise TooSlow(f"no answer in {PATIENCE:.0f} s")

    before = signal.signal(signal.SIGVTALRM, stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, PATIENCE)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)


def check(found: float, error: float, exact: float, within: float) -> None:
    """The bound covers, but for the rounding of the truth and the answer, and is as small as was asked for."""
    assert math.isfinite(error) and error <= within * (abs(exact) or 1.0), (found, error, exact)
    assert abs(found - exact) <= error + 4 * EPS * abs(exact), (found, error, exact)


def marked(names: list[str], unmet: dict[str, str]) -> list[Any]:
    """Parameters with their marks."""
    marks = {name: [] for name in names}
    for name in names:
        marks[name] += [pytest.mark.xfail(reason=unmet[name], strict=True)] if name in unmet else []
        marks[name] += [pytest.mark.slow] if name in SLOW else []
    return [pytest.param(REGIONS[name], id=name, marks=marks[name]) for name in names]


@pytest.mark.filterwarnings("ignore::potto.ProgramWarning")
@pytest.mark.parametrize("region", marked(list(REGIONS), UNMET))
def test_value_and_derivative(region: Region) -> None:
    f = potto.compile(region.program).f
    with within_patience():
        answer = potto.deriv(f)((region.at, 1.0))
    check(answer.value, answer.error, region.value, region.within)
    check(answer.tangent, answer.tangent_error, region.derivative, region.within)


@pytest.mark.parametrize("region", marked(list(SECONDS), UNMET_SECOND))
def test_second_derivative(region: Region) -> None:
    assert region.second is not None
    f = potto.compile(region.program).f
    with within_patience():
        answer = potto.hvp(f, {"t": 1.0})(t=region.at)
    check(answer.tangent, answer.tangent_error, region.second, SECOND_WITHIN)


def test_what_is_listed_is_in_the_catalogue() -> None:
    assert set(UNMET) <= set(REGIONS) and set(UNMET_SECOND) <= set(SECONDS) and set(SLOW) <= set(REGIONS)
    assert set(TRUTHS) == set(REGIONS) and len(REGIONS) >= 60


@pytest.mark.parametrize("name", [
    "cubic", "damped", "thermostat, 8 steps", "normal waves", "hyperbola", "band", "lens", "bracket within, 2-D",
    "common part of balls", "half space, 5-D", "three half spaces",
])  # fmt: skip
def test_references_are_what_the_mathematics_gives(name: str) -> None:
    """Of a few that take no time; `recompute.py` does all of them."""
    region = REGIONS[name]
    assert difference(ENTRIES[name], reference(name, region.dimensions, region.at)) < 1e-13
