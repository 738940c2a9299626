"""A pixel that one surface crosses is answered without a plan, as it would be by one."""

from pathlib import Path

import mpmath
import numpy as np
import pytest

import potto
from potto.integrate.costs import counting
from potto.integrate.fixed import at_sight
from potto.runtime.integration import problem
from potto.runtime.integration.methods import choices

SCENE = Path(__file__).resolve().parents[2] / "examples" / "raytrace" / "main.po"
DISC = """
def lit(u: Real*, v: Real*, a, b, c) if [1 / sqrt((a - u)^2 + (b - v)^2 + 1) > c] then 3 + u*v*a else 1
def pixel(x, y, a, b, c) integral ([x, x + 1/32], [y, y + 1/32]) lit(u, v, a, b, c) d(u, v)
def tinted(x, y, a, b, c)
    integral ([x, x + 1/32], [y, y + 1/32])
        (lit(u, v, a, b, c), 1 / lit(u, v, a, b, c)) d(u, v)
"""
CORNERED = (0.5, 0.5625, 0.1, 0.2, 0.875)  # a pixel that the edge enters on the left and leaves below


@pytest.fixture
def fresh(monkeypatch, tmp_path: Path):
    """Nothing is known from before, and few parts are worth a look."""
    monkeypatch.setenv("POTTO_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(at_sight, "MANY_PARTS", 4)
    problem.clear()


@pytest.fixture
def disc(fresh, tmp_path: Path):
    file = tmp_path / "disc.po"
    file.write_text(DISC)
    return potto.load(file)


def exact(x, y, a, b, c):
    """The pixel, by mpmath in strips: of two roots of the circle that is the edge, those in the pixel."""
    r2 = 1 / (c * c) - 1
    top, left = y + mpmath.mpf(1) / 32, x

    def strip(u):
        within = r2 - (u - a) ** 2
        half = mpmath.sqrt(within) if within > 0 else mpmath.mpf(0)
        low, high = (min(max(b + s * half, y), top) for s in (-1, 1))
        return mpmath.mpf(1) / 32 + (high - low) * 2 + u * a * (high**2 - low**2) / 2

    ends = [left, left + mpmath.mpf(1) / 32]
    for v in (y, top):
        if r2 > (v - b) ** 2:
            ends += [a + s * mpmath.sqrt(r2 - (v - b) ** 2) for s in (-1, 1)]
    ends = sorted(e for e in ends if ends[0] <= e <= ends[1])
    return mpmath.quad(strip, ends)


def looked(found) -> bool:
    return found.stats.get("integrals without a plan") == 1


def by(function, place, moving: int):
    """The derivative by one of the arguments."""
    return potto.deriv(function)(*((x, float(i == moving)) for i, x in enumerate(place)))


@pytest.mark.parametrize("place", [CORNERED, (-0.5, 0.4375, 0.05, 0.2, 0.86)])
def test_the_edge_of_a_disc(disc, place):
    mpmath.mp.dps = 30
    for moving in (2, 3, 4):
        found = by(disc.pixel, place, moving)
        numbers = [mpmath.mpf(x) for x in place]
        along = lambda t, moving=moving: exact(*numbers[:moving], t, *numbers[moving + 1 :])  # noqa: B023, E731
        assert looked(found) and found.converged
        # each within its own bar; the difference quotient of 30 digits is itself off by 1e-14 at the most
        assert abs(found.value - float(along(numbers[moving]))) <= found.error + 1e-16
        assert abs(found.tangent - float(mpmath.diff(along, numbers[moving]))) <= found.tangent_error + 1e-14
        assert found.error < 1e-10 and found.tangent_error < 1e-10


def test_pixels_of_a_scene_as_by_a_plan(fresh, monkeypatch):
    """At the edge between two tones, all three sides of the triangle passing by: a look and a plan agree."""
    two_tones = potto.deriv(potto.load(SCENE).two_tones)
    places = [(-0.2765625, -0.2203125), (-0.2765625 + 1 / 256, -0.2203125), (-0.3, -0.2203125)]
    more = {"dq": (-0.2, 1.0), "dex": (0.0, 0.3), "dfocal": (1.0, 0.0), "dlx": (0.2, 0.5), "dthreshold": (0.8, -0.1)}
    first = [two_tones(*place, **more) for place in places]
    monkeypatch.setattr(choices, "MOST_LOOKS", 0)
    for seen in filter(looked, first):
        planned = two_tones(*places[first.index(seen)], **more)
        assert not looked(planned)
        assert abs(seen.value - planned.value) <= seen.error + planned.error
        assert abs(seen.tangent - planned.tangent) <= seen.tangent_error + planned.tangent_error
    assert looked(first[0])


def test_ten_digits_where_the_edge_enters_at_a_side(fresh, monkeypatch):
    """Where that is counts 4000 times in the derivative; what is seen is what a plan finds."""
    by_law = potto.deriv(potto.load(SCENE).by_law)
    more = {"dq": (-0.2, 1.0), "dex": (0.0, 0.0), "dfocal": (1.0, 0.0), "dlx": (0.2, 0.0), "dthreshold": (0.3, 0.0)}
    with potto.settings(backend="numpy", rtol=1e-10):
        seen = by_law(-0.0375, -0.0515625, **more)
        monkeypatch.setattr(choices, "MOST_LOOKS", 0)
        planned = by_law(-0.0375, -0.0515625, **more)
    assert looked(seen) and not looked(planned)
    assert abs(seen.value - planned.value) <= seen.error + planned.error
    assert abs(seen.tangent - planned.tangent) <= seen.tangent_error + planned.tangent_error


def test_components(disc):
    place = CORNERED
    both = disc.tinted(*place)
    assert looked(both[0])
    assert abs(both[0].value - disc.pixel(*place).value) <= 2 * both[0].error
    # its reciprocal, 1 in the dark, by midpoints; along the edge they are off by a part of 1/2000
    u, v = (x + (np.arange(2000) + 0.5) / 64000 for x in place[:2])
    light = (place[2] - u[:, None]) ** 2 + (place[3] - v) ** 2 < 1 / place[4] ** 2 - 1
    mean = np.where(light, 1 / (3 + 0.1 * u[:, None] * v), 1.0).mean() / 1024
    assert both[1].value == pytest.approx(mean, abs=1e-6)


def test_what_is_not_plain_is_left_to_plans(disc):
    assert not looked(by(disc.pixel, CORNERED, 0))  # the pixel itself moves
    on_a_corner = 1 / mpmath.sqrt(1 + 0.5**2 + 0.5**2)
    assert not looked(by(disc.pixel, (0.5, 0.5, 0.0, 0.0, float(on_a_corner)), 4))


def test_plans_come_when_they_pay(disc, monkeypatch):
    monkeypatch.setattr(choices, "MOST_LOOKS", 2)
    assert [looked(by(disc.pixel, CORNERED, 4)) for _ in range(3)] == [True, True, False]


def test_what_a_look_costs_is_told(disc):
    with counting():
        value, slope = disc.pixel(*CORNERED), by(disc.pixel, CORNERED, 4)
    # a stretch that the edge cuts in two, and one beside it; 121 nodes a cell, two sides of 11 places on the edge
    for found, why in ((value, "cut along; no derivative is asked for"), (slope, "it moves: it has a boundary term")):
        assert found.stats["cells"] == 3 and found.stats["interior evaluations"] == 363 == found.evals - 22
        assert [surface["why"] for surface in found.stats["surfaces"]] == [why]
