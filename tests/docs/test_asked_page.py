"""The answers on the page of questions from elsewhere, against closed forms; that its programs give them is in
`test_pages`."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable
from pathlib import Path

import mpmath as mp
import pytest

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "asked-elsewhere.md").read_text(encoding="utf-8")


def phi(x: float) -> mp.mpf:
    return mp.npdf(x)


def _hyperbola() -> list[object]:
    return [1 + mp.log(4), mp.log(4)]


def _demand() -> list[object]:
    """The weight exp(u) moves the mean of u to 1; the difference u - v has variance 2. The cut at 8 is below 1e-11."""
    p, s = mp.mpf("1.5"), mp.sqrt(2)
    return [mp.exp(0.5) * mp.ncdf(-(1 + mp.log(p)) / s), -mp.exp(0.5) * phi(-(1 + mp.log(p)) / s) / (s * p)]


def _jump_near_a_bound() -> list[object]:
    a = mp.mpf("0.997")
    return [mp.e - mp.exp(a) + (mp.exp(4) - mp.exp(2)) / 2, -mp.exp(a)]


def _steep() -> list[object]:
    exact = (-151 + 101 * mp.sqrt(101)) / mp.mpf(7500000000)
    return [exact, exact]


def _kink() -> list[object]:
    a = mp.mpf("0.499")
    return [mp.exp(a) + mp.exp(1 - a) - 2, mp.exp(a) - mp.exp(1 - a)]


def _share() -> list[object]:
    return [mp.ncdf(-0.5), (phi(0.5) / 2, phi(0.5) / 4)]


def _event() -> list[object]:
    m, r = mp.mpf("0.5"), mp.sqrt(2)
    return [phi(m - r) - phi(m + r)]


def _bin() -> list[object]:
    low, high = mp.mpf("0.5"), mp.mpf("0.8")  # the roots of the bounds; the bin is between them, over the root of gain
    return [high - low, (low - high) / 2]


CLOSED: dict[str, Callable[[], list[object]]] = {
    "Where a step begins": lambda: [-1],
    "Jumps in general": lambda: [mp.exp(0.5)],
    "A squared difference of steps": lambda: [mp.mpf("0.25") / 2, mp.mpf("0.5")],
    "The time at which a force stops": lambda: [mp.exp(mp.mpf("0.4") - 1)],
    "The place of a Heaviside step": lambda: [2 * 3 + 0.5, -1],
    "A box from two steps": lambda: [mp.mpf("0.6"), 1, 1],
    "A product of piecewise functions": lambda: [mp.mpf(2 * 5 + 2 * 2 * 7) / 3 + 3 * 7, 2 * 5 - 2 * 7],
    "The same condition, written differently": lambda: [1, 1, -1],
    "A step times itself": lambda: [0.5, 0.5],
    "By the upper bound": lambda: [mp.sin(1)],
    "By a bound and by a parameter": lambda: [mp.exp(3) / 2, (mp.exp(3), mp.exp(3) * (mp.mpf(3) / 4 - 0.25))],
    "The bound is also in the integrand": lambda: [mp.mpf(5) / 3],
    "An improper integral from a parameter on": lambda: [-mp.pi / 2, (mp.pi / 2, 1)],
    "Bounds of a normal probability": lambda: [(phi(0) - phi(2), -phi(0), phi(2))],
    "Under a hyperbola": _hyperbola,
    "A wedge without end": lambda: [mp.pi / 8, 0.25],
    "A polytope": lambda: [mp.mpf("0.8") ** 3 / 6, mp.mpf("0.8") ** 2 / 2],
    "A disc": lambda: [4 * mp.pi, 4 * mp.pi],
    "A segment of a disc": lambda: [mp.acos(0.5) - mp.sqrt(3) / 4, -mp.sqrt(3)],
    "A lognormal demand": _demand,
    "A jump near a bound": _jump_near_a_bound,
    "The integral should be linear": _steep,
    "A kink and an error of zero": _kink,
    "Integrals across a floor": lambda: [1.5, 0.5],
    "A ball that bounces once": lambda: [5 - mp.mpf("2.95"), -1],
    "Two balls that exchange their speeds": lambda: [mp.mpf("1.2"), (1, 0, 1, 0)],
    "A silhouette as a loss": lambda: [0.25, 2 * (mp.mpf("0.25") - mp.mpf("0.4")) / 2],
    "A silhouette without blur": lambda: [mp.pi * mp.mpf("0.3")],
    "A threshold that should be learned": lambda: [1 - mp.sqrt(0.25), -1 / (2 * mp.sqrt(0.25))],
    "How many are above ten": _share,
    "A histogram as a loss": _bin,
    "A draw from a categorical distribution": lambda: [0.25 * 3 + 0.75 * 1, 2],
    "The probability of an event": _event,
}
SECTIONS = {part.partition("\n")[0].strip(): part for part in re.split(r"(?m)^### ", PAGE)[1:]}


def test_every_question_has_a_program_a_source_and_a_closed_form() -> None:
    assert set(SECTIONS) == set(CLOSED) and len(SECTIONS) >= 25
    for name, text in SECTIONS.items():
        assert text.count("```potto\n") == 1 and re.search(r"\]\(https://[^)]+\)", text), name


@pytest.mark.parametrize("name", sorted(SECTIONS))
def test_the_answers_are_those_of_the_closed_forms(name: str) -> None:
    said = [ast.literal_eval(text) for text in re.findall(r"(?m)^#= (.+)$", SECTIONS[name])]
    wanted = CLOSED[name]()
    assert len(said) == len(wanted) == SECTIONS[name].count("#> ")
    for numbers, exact in zip(said, wanted, strict=True):
        pairs = zip(numbers, exact, strict=True) if isinstance(numbers, tuple) else [(numbers, exact)]
        for number, true in pairs:
            assert abs(number - true) <= 1e-11 * max(abs(true), 1), (name, number, true)
