"""Lines between samples, along which the innermost variable is integrated: they are cells that are alike."""

from __future__ import annotations

import math

import pytest

import potto


def test_lines_between_samples_are_cells_alike() -> None:
    """Over the corner of a cube w comes to c^5/5!: each line takes the two nodes that are exact for its polynomial, at
    the most, where panels took eight. 4,096 samples: bars of a tenth are what 16 scramblings agree to."""
    text = "def f(c) integral ([0, 1], [0, 1], [0, 1], [0, 1]) [x + y + z + w < c]*w d(x, y, z, w)"
    with potto.settings(method="qmc", samples=4096):
        found = potto.grad(potto.compile(text).f, "c")(1.0)
    assert abs(found.value - 1 / 120) <= found.error < 0.1 / 120
    assert abs(found.tangent - 1 / 24) <= found.tangent_error < 0.1 / 24
    assert found.evals <= 2 * 4096


def test_lines_whose_cuts_move_elsewhere_are_cells_alike() -> None:
    """An arc is crossed by lines along either variable, so that its motion is a mean of its own, and lines are cut
    where it stands: if cuts moved, as others do, it would count twice. Against quadrature; panels took 25,072."""
    g = potto.grad(potto.compile("def f(r) integral ([0, 1], [0, 1]) exp(-r*x)*[x^2 + y^2 < r] d(x, y)").f, "r")
    exact = g(0.5)
    with potto.settings(method="qmc", samples=4096):
        found = g(0.5)
    assert abs(found.value - exact.value) <= found.error < 1e-3
    assert abs(found.tangent - exact.tangent) <= found.tangent_error < 2e-3
    assert found.evals <= 5 * 4096


@pytest.mark.parametrize("method", ["mc", "qmc"])
def test_lines_that_a_surface_is_not_on_take_no_evaluations(method: str) -> None:
    """A disc of r = 0.1 in a square of side 2: of lines along x as along y a tenth meet it, at two roots that have two
    sides each. That is 0.8 of an evaluation a sample beside its own; the other nine tenths would have been 7.2."""
    disc = potto.grad(potto.compile("def f(r) integral ([-1, 1], [-1, 1]) [x^2 + y^2 < r^2] d(x, y)").f, "r")
    with potto.settings(method=method, samples=1 << 12):
        found = disc(0.1)
    assert abs(found.tangent - 2 * math.pi * 0.1) <= found.tangent_error < 0.4
    assert found.evals <= 2 * 4096
