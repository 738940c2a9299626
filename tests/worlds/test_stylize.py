"""The picture as a mesh of coloured triangles, against clipped polygons at 30 digits that know nothing of Potto."""

from __future__ import annotations

import importlib.util
import itertools
import sys
from pathlib import Path
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from polygons import Polygon, in_square

import potto

FOLDER = Path(__file__).parents[2] / "examples" / "stylize"
BY_HAND = Path(__file__).parents[2] / "benchmarks" / "mesh_by_hand.py"


def loaded(name: str, file: Path) -> Any:
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def fit() -> Any:
    return loaded("stylize_fit", FOLDER / "fit.py")


@pytest.fixture(scope="module")
def by_hand() -> Any:
    return loaded("mesh_by_hand", BY_HAND).loss_and_gradient


def integrated(polygon: Polygon, f: Any) -> mp.mpf:
    """Over a fan of triangles by three nodes of Gauss twice: exact up to the fourth degree."""
    if len(polygon) < 3:
        return mp.mpf(0)
    node = mp.sqrt(mp.mpf(3) / 5)
    rule = [((1 - node) / 2, mp.mpf(5) / 18), (mp.mpf(1) / 2, mp.mpf(8) / 18), ((1 + node) / 2, mp.mpf(5) / 18)]
    total, a = mp.mpf(0), polygon[0]
    for b, c in itertools.pairwise(polygon[1:]):
        double = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
        for (s, ws), (t, wt) in itertools.product(rule, rule):  # a + s ((b - a) + t (c - b))
            x, y = (a[i] + s * ((b[i] - a[i]) + t * (c[i] - b[i])) for i in (0, 1))
            total += double * s * ws * wt * f(x, y)
    return total


def loss(corners: Any, faces: np.ndarray, colours: Any, photo: np.ndarray) -> mp.mpf:
    size, total = len(photo), mp.mpf(0)
    for (j, i), face in itertools.product(np.ndindex(size, size), range(len(faces))):
        triangle, h = [tuple(corners[k]) for k in faces[face]], 1 / mp.mpf(size)
        piece = in_square(triangle, i * h, j * h, h)

        def far(x: mp.mpf, y: mp.mpf, j: int = j, i: int = i, face: int = face) -> mp.mpf:
            terms = (1, x, y, x * x, x * y, y * y)[: len(colours[face])]
            shown = [sum(t * c[k] for t, c in zip(terms, colours[face], strict=True)) for k in range(3)]
            return sum((u - mp.mpf(float(v))) ** 2 for u, v in zip(shown, photo[j, i], strict=True))

        total += integrated(piece, far)
    return total


@pytest.mark.parametrize("kind", ["constant", "linear", "quadratic"])
def test_the_loss_and_its_gradient(fit: Any, kind: str) -> None:
    """Differences of 1e-10 at 30 digits: 1e-15 of what they are of, where edges cross no new pixel."""
    random = np.random.default_rng(5)
    mesh, photo = fit.grid(2, kind), random.random((3, 3, 3))
    mesh.corners[4] += (0.07, -0.04)
    mesh.colours += random.uniform(-0.3, 0.3, mesh.colours.shape)
    function = getattr(potto.load(FOLDER / "stylize.po"), f"by_{kind}")
    found = potto.grad(function, ["corners", "colours"])(mesh.corners, mesh.faces.astype(float), mesh.colours, photo)
    with mp.workdps(30):
        corners = [[mp.mpf(float(x)) for x in p] for p in mesh.corners]
        colours = [[[mp.mpf(float(x)) for x in row] for row in c] for c in mesh.colours]
        assert abs(found.value - loss(corners, mesh.faces, colours, photo)) <= found.error < 1e-12
        step = mp.mpf(10) ** -10

        def slope(place: list[Any], k: int) -> float:
            ends = []
            for sign in (1, -1):
                kept = place[k]
                place[k] = kept + sign * step
                ends.append(loss(corners, mesh.faces, colours, photo))
                place[k] = kept
            return float((ends[0] - ends[1]) / (2 * step))

        by_corners, by_colours = (np.asarray(part) for part in found.tangent)
        for k in (0, 1):
            assert by_corners[4, k] == pytest.approx(slope(corners[4], k), abs=1e-12)
        for face, term in ((0, 0), (5, len(colours[0]) - 1)):
            assert by_colours[face, term, 1] == pytest.approx(slope(colours[face][term], 1), abs=1e-12)


@pytest.mark.parametrize("moved", [0.0, 1e-17, 1e-15, 1e-9, 0.02])
def test_a_mesh_by_hand_has_the_same_gradient(fit: Any, by_hand: Any, moved: float) -> None:
    """Also where the edges of a grid have been moved by some doubles only, as the first step of a fit does."""
    random, photo = np.random.default_rng(3), fit.target().reshape(16, 3, 16, 3, 3).mean(axis=(1, 3))
    mesh = fit.grid(5, "constant")
    mesh.corners += random.uniform(-moved, moved, mesh.corners.shape)
    mesh.colours += random.uniform(-0.3, 0.3, mesh.colours.shape)
    place = mesh.corners, mesh.faces, mesh.colours, photo
    for ours, theirs in zip(fit.slopes_by_potto("constant")(*place), by_hand(*place), strict=True):
        assert np.abs(np.asarray(ours) - theirs).max() < 1e-14


def test_a_fit_goes_as_far_as_one_by_hand(fit: Any, by_hand: Any) -> None:
    """The same optimizer along both. Its second step is by a small difference, and the paths part: both go down."""
    photo = fit.target().reshape(16, 3, 16, 3, 3).mean(axis=(1, 3))
    ours, theirs = (fit.fitted("constant", photo, 4, 40, slopes) for slopes in (None, by_hand))
    assert np.allclose(ours.losses[:5], theirs.losses[:5], rtol=1e-9, atol=0)
    assert ours.losses[-1] < 1.05 * theirs.losses[-1] < 0.2 * ours.losses[0]


def test_a_fit_goes_down_and_turns_no_triangle_over(fit: Any) -> None:
    """Where colours may change over a triangle, as many steps leave less than half as much: they are measured so
    that a step finds them."""
    photo = fit.target().reshape(8, 6, 8, 6, 3).mean(axis=(1, 3))
    constant, linear = (fit.fitted(kind, photo, 3, 12) for kind in ("constant", "linear"))
    for mesh in (constant, linear):
        assert mesh.losses[-1] < 0.35 * mesh.losses[0] and (mesh.areas() > 0).all()
        assert np.all(np.diff(mesh.losses) <= 1e-4)  # the barrier beside the loss may take that much
        assert fit.drawn(mesh, 16).shape == (16, 16, 3)
    assert linear.losses[-1] < 0.5 * constant.losses[-1]


def test_colours_are_measured_by_what_is_orthogonal(fit: Any) -> None:
    """Means over a triangle by Gauss's rule, exact here. Those of a few places, which take their part, are a tenth off;
    1, x, y and their products by themselves have a condition of 2e5."""
    mesh = fit.grid(3, "quadratic")
    a, b, c = mesh.corners[mesh.faces[4]]
    measured = fit.orthogonal(mesh)[4]
    nodes, weights = np.polynomial.legendre.leggauss(6)
    u, wide = (1 + nodes) / 2, weights / 2
    v = (1 - u[:, None]) * u  # the square folded to the triangle: exact up to degree 10
    x, y = (a[i] + (b - a)[i] * u[:, None] + (c - a)[i] * v for i in (0, 1))
    terms = np.tensordot(measured.T, fit.monomials(x, y, 6), 1)
    mean = np.einsum("iuv,juv,uv->ij", terms, terms, 2 * wide[:, None] * (1 - u[:, None]) * wide)
    assert np.abs(mean - np.eye(6)).max() < 0.15 and np.linalg.cond(mean) < 1.5


def test_colours_are_found_to_the_last_digits(fit: Any) -> None:
    """Two triangles over the halves of a picture, 0.2 and 0.8: from any colours one step of Newton leads there, as the
    second derivative by a colour is twice the area, 1/2."""
    gradient = potto.grad(potto.load(FOLDER / "stylize.po").by_constant, ["colours"])
    photo = np.full((2, 2, 3), 0.2)
    photo[:, 1] = 0.8
    corners = np.array([[0.5, -2.0], [0.5, 3.0], [-3.5, 0.5], [4.5, 0.5]])
    faces, start = np.array([[2.0, 0.0, 1.0], [3.0, 1.0, 0.0]]), np.full((2, 1, 3), 0.6)
    colours = start - np.asarray(gradient(corners, faces, start, photo).tangent) / (2 * 0.5)
    assert colours.ravel() == pytest.approx([0.2] * 3 + [0.8] * 3, abs=1e-14)
    assert abs(gradient(corners, faces, colours, photo).value) <= 1e-15
