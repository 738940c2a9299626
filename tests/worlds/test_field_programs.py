"""Fields: values and derivatives against closed forms, sections of 40 digits, clipped polygons and traced contours."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from exact_curves import CURVES
from exact_fields import ARROW, SITES, WAVES, balls, bright, cell_area, gained, two_bands
from polygons import area
from scipy.optimize import brentq
from worlds_references import agrees, dual, program, reference

import potto

BANDS = program("fields/bands")
BALLS = program("fields/metaballs")
PLATE = program("fields/plate")
NOISE = program("fields/noise")
CELLS = program("fields/voronoi")
POLYGON = program("fields/polygon")


@pytest.mark.parametrize("energy", [-1.9, -0.5, 0.0, 1.0, 1.999])
def test_states_of_a_chain(energy: float) -> None:
    exact = reference(lambda e: mp.acos(-e / 2) / mp.pi, energy)
    agrees(dual(BANDS, "below", energy), exact, 1e-11)
    assert abs(float(BANDS.density(energy)) - exact[1]) < 1e-11 * exact[1]


@pytest.mark.parametrize("energy", [-1.4, -0.7, 0.6, 1.0, 1.45])
def test_states_of_two_bands(energy: float) -> None:
    by_energy = reference(lambda e: two_bands(e, mp.mpf(1), mp.mpf(0.5)), energy)
    agrees(dual(BANDS, r"\e . filled(e, 1, 0.5)", energy), by_energy, 1e-11)
    by_hopping = reference(lambda v: two_bands(mp.mpf(energy), v, mp.mpf(0.5)), 1.0)
    agrees(dual(BANDS, rf"\v . filled({energy}, v, 0.5)", 1.0), by_hopping, 1e-11)


def test_energy_of_two_hoppings() -> None:
    """A complete elliptic integral; by v of 40-digit differences."""

    def exact(v: Any) -> Any:
        w = mp.mpf(0.5)
        return -2 / mp.pi * (v + w) * mp.ellipe(4 * v * w / (v + w) ** 2)

    agrees(dual(BANDS, r"\v . energy(v, 0.5)", 1.0), reference(exact, 1.0), 1e-11)


@pytest.mark.parametrize("energy", [-3.0, -1.0, 2.5])
def test_density_of_a_square_lattice(energy: float) -> None:
    density = mp.ellipk(1 - mp.mpf(energy) ** 2 / 16) / (2 * mp.pi**2)
    assert abs(dual(BANDS, "square", energy)[1] - float(density)) < 1e-9


@pytest.mark.parametrize("apart", [0.3, 0.7, 1.05])
@pytest.mark.parametrize("moment", [0, 1])
def test_metaballs(apart: float, moment: int) -> None:
    with mp.workdps(40):
        exact = balls(mp.mpf(apart), mp.mpf(1) / 2, lambda x: x ** (2 * moment))
    agrees(dual(BALLS, rf"\a . moments(a, 1, 0.5).{moment}", apart), exact, 1e-10)


@pytest.mark.parametrize("bump", [0, 1, 2])
def test_shape_derivative_of_the_plate(bump: int) -> None:
    start = [0.5, 0.7, 0.5]
    text = ", ".join("t" if i == bump else str(w) for i, w in enumerate(start))

    def exact(t: Any) -> Any:
        return gained([t if i == bump else mp.mpf(w) for i, w in enumerate(start)], mp.mpf(0.6))

    with mp.workdps(40):
        slope = float(mp.diff(exact, start[bump], h=mp.mpf(10) ** -12))
        agrees(dual(PLATE, rf"\t . gain([{text}], 0.6)", start[bump]), (float(exact(mp.mpf(start[bump]))), slope), 1e-9)


def test_a_step_gains_what_the_slope_foretells() -> None:
    """To first order |gradient|^2 h; with h = 1e-4 the second order is a ten-thousandth."""
    before, after = (float(PLATE.eval(f"gain({w}, 0.6)")) for w in ("start", "stepped(start, 0.6, 0.0001)"))
    slopes = potto.grad(PLATE.gain, ["w"])([0.5, 0.7, 0.5], 0.6).tangent
    assert abs((after - before) / 1e-4 - float(np.sum(np.square(slopes)))) < 1e-3 * float(np.sum(np.square(slopes)))


@pytest.mark.parametrize("weight", [0.36, 0.75])
def test_the_best_ellipse_is_found(weight: float) -> None:
    found = potto.fit(PLATE.earned, {"a": 0.45, "b": 0.4}, given={"weight": weight})
    assert found.converged
    assert abs(found["a"] - (1 - weight) ** 0.5) < 1e-6 and abs(found["b"] - ((1 - weight) / 2) ** 0.5) < 1e-6


@pytest.mark.parametrize("threshold", [0.55, 0.75, 0.95])
def test_a_bilinear_cell(threshold: float) -> None:
    with mp.workdps(40):
        exact = float(bright(mp.mpf(threshold))), float(mp.diff(bright, threshold, h=mp.mpf(10) ** -12))
    agrees(dual(NOISE, "bright", threshold), exact, 1e-10)


def length(x: float, t: float) -> float:
    """How much of a section is above the threshold: signs on a fine grid, ends by bisection."""

    def above(y: float) -> float:
        return sum(float(np.cos(a * x + b * y + c)) for a, b, c in WAVES) / 4 - t

    ys = np.linspace(0, 2, 81)
    values = sum(np.cos(a * x + b * ys + c) for a, b, c in WAVES) / 4 - t
    ends = [brentq(above, ys[i], ys[i + 1], xtol=1e-14) for i in np.nonzero(values[:-1] * values[1:] < 0)[0]]
    cuts = [0.0, *ends, 2.0]
    return sum(b - a for a, b in pairwise(cuts) if above((a + b) / 2) > 0)


def test_clouds() -> None:
    """Midpoints of 1,000 sections whose ends are bisected: good to 2e-5; the slope by differences of 0.02."""
    xs = (np.arange(1000) + 0.5) / 500

    def covered(t: float) -> float:
        return float(np.mean([length(float(x), t) for x in xs])) / 2

    value, slope = dual(NOISE, "clouds", 0.1)
    assert abs(value - covered(0.1)) < 2e-5
    assert abs(slope - (covered(0.11) - covered(0.09)) / 0.02) < 2e-3


@pytest.mark.slow
def test_clouds_where_a_wave_meets_a_bound_but_for_rounding() -> None:
    """With the other variable innermost the slope has its digits, and a sliver there, which is counted, spoils none."""
    found = potto.deriv(NOISE.clouds)((-0.32, 1.0))
    (_, slope), _ = CURVES["fields", "noise", "clouds"](-0.32)
    assert abs(found.tangent - slope) <= found.tangent_error < 1e-9


def moved(places: list[tuple[float, float]], which: int, axis: int, t: Any) -> list[tuple[Any, Any]]:
    found = [[mp.mpf(x), mp.mpf(y)] for x, y in places]
    found[which][axis] += t
    return [(x, y) for x, y in found]


@pytest.mark.parametrize("own", [0, 2])
def test_cells_by_all_sites(own: int) -> None:
    slopes = potto.grad(CELLS.cell, ["sites"])(SITES, own).tangent
    for which in range(len(SITES)):
        for axis in (0, 1):
            exact = reference(lambda t, w=which, a=axis: cell_area(moved(SITES, w, a, t), own), 0.0)
            assert abs(float(np.asarray(slopes)[which, axis]) - exact[1]) < 1e-12
    assert abs(float(CELLS.cell(SITES, own)) - exact[0]) < 1e-13


def test_a_polygon_by_all_corners() -> None:
    slopes = potto.grad(POLYGON.area, ["corners"])(ARROW).tangent
    for which in range(len(ARROW)):
        for axis in (0, 1):
            exact = reference(lambda t, w=which, a=axis: area(moved(ARROW, w, a, t)), 0.0)
            assert abs(float(np.asarray(slopes)[which, axis]) - exact[1]) < 1e-12
    assert abs(float(POLYGON.area(ARROW)) - exact[0]) < 1e-13


@pytest.mark.parametrize("apart", [1.4125, 1.6])
def test_metaballs_that_are_two(apart: float) -> None:
    """Between them nothing is above the level; the first refined sections of the derivative met nothing but that."""

    def g(x: Any) -> Any:
        return mp.exp(-((x + apart) ** 2)) + mp.exp(-((x - apart) ** 2))

    def rate(x: Any) -> Any:
        return 2 * ((x - apart) * mp.exp(-((x - apart) ** 2)) - (x + apart) * mp.exp(-((x + apart) ** 2))) / g(x)

    with mp.workdps(40):
        ends = [mp.findroot(lambda x: g(x) - 0.5, apart + d * mp.sqrt(mp.log(2))) for d in (-1, 1)]
        places = [ends[0], apart, ends[1]]
        value = 4 * mp.quad(lambda x: mp.sqrt(abs(mp.log(2 * g(x)))), places)
        slope = 2 * mp.quad(lambda x: rate(x) / mp.sqrt(abs(mp.log(2 * g(x)))), places)
    agrees(dual(BALLS, r"\a . area(a, 1, 0.5)", apart), (float(value), float(slope)), 1e-9)
