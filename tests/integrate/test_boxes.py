"""Pictures: pixels that no surface crosses are integrated whole; they must agree with pixels that are cut."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import potto
from potto.integrate.fixed.lowered.boxes import LoweredBoxes, Passed
from potto.kernels.native import objects
from potto.runtime.answers import convergence
from potto.runtime.integration.methods import quadrature

needs_llvm = pytest.mark.skipif(not objects.available(), reason="llvmlite is not installed")

PROGRAM = """
def line(a, b, t) integral ([a, a + 1/16], [b, b + 1/16]) exp(x*y)*[x + 2*y >= t] d(x, y)
def saddle(a, b, t) integral ([a, a + 1/16], [b, b + 1/16]) (x + y)*[(x - t)*(y - 1/3) >= 0] d(x, y)
def disc(a, b, t) integral ([a, a + 1/16], [b, b + 1/16]) [x*x + y*y <= t] d(x, y)
def root(a, b, t) integral ([a, a + 1/16], [b, b + 1/16]) sqrt(x)*abs(y - t)/(1 + x) d(x, y)
def peak(a, b, t) integral ([a, a + 1/16], [b, b + 1/16]) exp(-1000000*(x - t)^2) d(x, y)
def wave(a, b, t) integral ([a, a + 1/16], [b, b + 1/16]) sin(200*t*x*y) d(x, y)
def solid(a, b, t) integral ([a, a + 1/16], [b, b + 1/16], [0, 1]) x*y/(1 + z)*[z <= t + x] d(x, y, z)
def strip(a, b, t) integral [a, a + b/16] cos(x)*[x >= t] d(x)
def moving(a, b, t) integral ([a, a + t/16], [b, b + 1/16]) x*y d(x, y)
def turned(a, b, t) integral ([a + 1/16, a], [b, b + 1/16]) exp(x*y)*[x + 2*y >= t] d(x, y)
def pair(a, b, t) integral ([a, a + 1/16], [b, b + 1/16]) (x*[x > t], y*t) d(x, y)
def weighed(p, q, h, w, t) integral ([p, p + h], [q, q + h]) exp(w*x*y)*[x + 2*y >= t] d(x, y)
def toned(a, b, t) weighed(a, b, 1/16, t/3, t - 0.1)
def about(a, b, t) weighed(a - 0.1/3, b - 0.1/3, 0.2/3, 1/3, t)
"""
NAMES = [
    "line", "saddle", "disc", "root", "peak", "wave", "solid", "strip", "moving", "turned", "pair", "toned", "about",
]  # fmt: skip


def picture(name: str, t: float) -> potto.Estimate:
    m = potto.compile(PROGRAM)
    a, b = np.meshgrid(np.arange(16) / 16, np.arange(16) / 16)
    found: potto.Estimate = potto.deriv(getattr(m, name))((a, 0.0), (b, 0.0), (t, 1.0))
    return found


def parts(estimate: potto.Estimate) -> list[tuple[Any, Any]]:
    numbers = (estimate.value, estimate.error), (estimate.tangent, estimate.tangent_error)
    return [p for n, e in numbers for p in (zip(n, e, strict=True) if isinstance(n, tuple) else [(n, e)])]


@pytest.mark.parametrize("t", [0.4375, 0.7])  # on the edges of pixels, and between them
@pytest.mark.parametrize("name", NAMES)
def test_a_picture_is_the_same_without_looking_for_whole_pixels(
    name: str, t: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    with_boxes = picture(name, t)
    monkeypatch.setattr(quadrature, "FEW", 10**9)
    without = picture(name, t)
    for (v, e), (w, f) in zip(parts(with_boxes), parts(without), strict=True):
        # Two methods, each within its own bound of the same truth; 1e-18 is the rounding of a pixel's area.
        assert (np.abs(v - w) <= e + f + 1e-18).all()
    # Those that are left by themselves may do better: of a range of length 0 nothing but 0 is left.
    assert (with_boxes.member_converged | ~without.member_converged).all()


@needs_llvm
@pytest.mark.parametrize("name", NAMES)
def test_machine_code_gives_whole_pixels_as_numpy_does(name: str) -> None:
    found = []
    for backend in ("numpy", "native"):
        with potto.settings(backend=backend):
            found.append(picture(name, 0.7))
    for (v, e), (w, f) in zip(*map(parts, found), strict=True):
        most = np.abs(w).max()
        # A few units in the last place, where sums cancel of what is added up; errors are read off coefficients, which
        # may be nothing but rounding.
        assert (np.abs(v - w) <= 8 * np.spacing(np.abs(w)) + 0.01 * np.minimum(e, f)).all()
        assert (e <= 3 * f + 1e-15 * most).all() and (f <= 3 * e + 1e-15 * most).all()
    assert (found[0].member_converged == found[1].member_converged).all()


@needs_llvm
def test_machine_code_takes_parameters_that_rounding_puts_off(monkeypatch: pytest.MonkeyPatch) -> None:
    done: list[int] = []
    run = LoweredBoxes.run

    def noted(way: LoweredBoxes, *given: Any) -> Passed:
        passed = run(way, *given)
        done.append(passed.sums.v.shape[-1] - passed.crossed.size - passed.left.size)
        return passed

    monkeypatch.setattr(LoweredBoxes, "run", noted)
    with potto.settings(backend="native"):
        picture("toned", 0.7)
    a, b = np.meshgrid(np.arange(16) / 16, np.arange(16) / 16)
    near = np.abs(a + 2 * b + 3 / 32 - 0.6) < 3 / 32  # pixels that the line x + 2 y = t - 0.1 cuts
    assert sum(done) == 256 - near.sum()


def test_whole_pixels_have_the_values_of_a_closed_form() -> None:
    # The second antiderivative of (x + y + t)^-2 is -log(x + y + t); its derivative by t is -1/(x + y + t).
    h = 1 / 512
    m = potto.compile("""
def f(a, b, t) integral ([a, a + 1/512], [b, b + 1/512]) 1/(x + y + t)^2*[x + y + t > 0] d(x, y)
""")
    a, b = np.meshgrid(np.arange(64) / 64, np.arange(64) / 64)
    got = potto.deriv(m.f)((a, 0.0), (b, 0.0), (1.0, 1.0))
    z = 1 + a + b
    value = np.log1p(h * h / (z * (z + 2 * h)))  # log of (z + h)^2/(z (z + 2 h)), without cancellation
    rate = -2 * h * h / (z * (z + h) * (z + 2 * h))
    # A few roundings of numbers of this size, on either side.
    assert (np.abs(got.value - value) <= 1e-14 * value).all() and (np.abs(got.tangent - rate) <= 2e-14 * -rate).all()
    assert got.evals == 16 * 64 * 64  # a product of 4 x 4 nodes each, and no cuts


@pytest.mark.parametrize("backend", ["numpy", pytest.param("native", marks=needs_llvm)])
@pytest.mark.parametrize("place", ["weighed(a - length(t), b, 1/16, 1, t)", "weighed(a, b, 1/16, length(t), t)"])
def test_whole_pixels_are_off_by_what_their_bounds_and_parameters_are(place: str, backend: str) -> None:
    length = "def length(t) integral ([0, 1], [0, 1]) sqrt(abs(x - y*t))/10 d(x, y)"
    m = potto.compile(f"{PROGRAM}{length}\ndef f(a, b, t) {place}\n")
    a, b = np.meshgrid(np.arange(16) / 16, np.arange(16) / 16)
    exact = m.f(a, b, 0.7)
    with potto.settings(rtol=1e-3, backend=backend):
        found, length = m.f(a, b, 0.7), m.length(0.7)
    whole = np.abs(a + 2 * b - 0.7) > 0.3  # clear of the line
    off = np.abs(found.value - exact.value)[whole]
    assert off.max() > 1e-13 and (off <= (found.error + exact.error)[whole]).all()
    # Two sides of a pixel move by as much, and what is integrated is at most e^2, and its derivative by a weight 2 e^2
    # over the pixel: not more than these, or the pixel would be less sure than it is.
    assert found.error[whole].max() <= 2 * math.e**2 / 16 * length.error + 1e-15


def test_only_pixels_that_are_cut_are_cut() -> None:
    m = potto.compile("def f(a, b, t) integral ([a, a + 1/64], [b, b + 1/64]) [x + y <= t] d(x, y)")
    a, b = np.meshgrid(np.arange(64) / 64, np.arange(64) / 64)
    got = potto.deriv(m.f)((a, 0.0), (b, 0.0), (0.51, 1.0))
    lit, dark = (a + b + 2 / 64 <= 0.51).sum(), (a + b >= 0.51).sum()
    # Of what is constant one node tells all, of what is 0 nobody has to ask.
    assert lit <= got.evals <= lit + 4 * (64 * 64 - lit - dark)
    # area of the triangle and the length of its edge along one axis
    assert abs(got.value.sum() - 0.51**2 / 2) <= 1e-14 and abs(got.tangent.sum() - 0.51) <= 1e-13


def test_a_curved_surface_is_enclosed_over_pixels() -> None:
    """A quarter of a disc, and of the ring between two: pixels beside the circles take a node each."""
    m = potto.compile("""
def disc(a, b, t) integral ([a, a + 1/64], [b, b + 1/64]) [x^2 + y^2 < t^2] d(x, y)
def ring(a, b, t) integral ([a, a + 1/64], [b, b + 1/64]) x*y*[sqrt(x^2 + y^2) < t]*[x^2 + y^2 > t^2/4] d(x, y)
""")
    a, b = np.meshgrid(np.arange(64) / 64, np.arange(64) / 64)
    disc = potto.deriv(m.disc)((a, 0.0), (b, 0.0), (0.8, 1.0))
    assert disc.converged and disc.evals <= 4 * 64 * 64
    assert abs(disc.value.sum() - math.pi * 0.16) <= 1e-13 and abs(disc.tangent.sum() - math.pi * 0.4) <= 1e-11
    ring = potto.deriv(m.ring)((a, 0.0), (b, 0.0), (0.8, 1.0))
    assert ring.converged
    assert abs(ring.value.sum() - 0.8**4 * (1 - 1 / 16) / 8) <= 1e-13  # int r^3 dr sin cos
    assert abs(ring.tangent.sum() - 0.8**3 * (1 - 1 / 16) / 2) <= 1e-11


@pytest.mark.parametrize("backend", ["numpy", pytest.param("native", marks=needs_llvm)])
@pytest.mark.parametrize("far", [0.3, 1e4, 1e6, 1e308])
def test_what_is_narrow_at_a_corner_of_one_member_is_seen_by_its_nodes_or_its_corners(far: float, backend: str) -> None:
    """All nodes of a long stretch may lie where exp(-x) is 0 to the last bit, and those of a pixel beside the one
    corner where something is."""
    m = potto.compile("""
def tail(t) integral [0, t] exp(-x) d(x)
def on_top(t, k) integral [0, t] (1 + k*exp(-k*x)) d(x)
def corner(a, b) integral ([a, a + 1/16], [b, b + 1/16]) 1e10*exp(-1e5*(x + y)) d(x, y)
""")
    t = np.linspace(0.1, 0.9, 100)
    t[41] = far
    a, b = np.meshgrid(np.arange(16) / 16, np.arange(16) / 16)
    with potto.settings(backend=backend):
        tail, on_top, corner = m.tail(t), m.on_top(np.minimum(t, 0.9), 1e6), m.corner(a, b)
    for found, exact in (
        (tail, -np.expm1(-t)),
        (on_top, np.minimum(t, 0.9) - np.expm1(-1e6 * np.minimum(t, 0.9))),
        (corner, np.where(a + b > 0, 0.0, 1.0)),  # all others have less than exp(-6250) of it
    ):
        assert (np.abs(found.value - exact) <= found.error + 1e-15).all()
        assert found.converged and found.error.max() <= 1e-10


@pytest.mark.parametrize("spoilt", [(), (7, 50)])
@pytest.mark.parametrize("edge", [50.0, 3.9])
def test_numbers_that_machine_code_knows_to_be_precise_are_not_asked_again(
    spoilt: tuple[int, ...], edge: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """But for members that are cut; and where one is less so, as sin(x + 1e10) is off by the rounding of its argument,
    all are."""
    pytest.importorskip("llvmlite")
    text = "def f(px, k, c) integral ([px, px + 1], [0, 1]) sin(x + k)*[x + y < c] d(x, y)"
    asked, looked = list[int](), convergence.rough_places

    def counted(numbers: Any, errors: Any, rtol: float) -> Any:
        asked.append(np.size(numbers))
        return looked(numbers, errors, rtol)

    monkeypatch.setattr(convergence, "rough_places", counted)
    px, k = np.linspace(0, 2, 300), np.full(300, 0.3)
    k[list(spoilt)] = 1e10
    with potto.settings(backend="native"):
        answer = potto.grad(potto.compile(text).f, "c")(px, k, edge)
    assert np.flatnonzero(~answer.member_converged).tolist() == list(spoilt)
    assert (300 in asked) == bool(spoilt)
    x = px[px + 2 <= edge]
    exact = np.cos(x + 0.3) - np.cos(x + 1.3)
    off = np.abs(answer.value[: x.size] - exact) > answer.error[: x.size] + 1e-15
    assert set(np.flatnonzero(off)) <= set(spoilt)
