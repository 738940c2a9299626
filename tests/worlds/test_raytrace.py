"""The ray tracer: pixels on edges, at corners and inside, with their derivatives, against sections at 40 digits.

On a plane the cosine law and the law of the squared distance both are spheres around the light, and these cut the
plane in conics: so the reference knows a closed form where Potto is told none.
"""

from __future__ import annotations

import runpy
import time
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from exact_pictures import soft_triangle
from exact_rays import half_shadow
from level_sets_reference import integral as by_level_sets
from sections_reference import curve, integral
from worlds_references import EXAMPLES, agrees

import potto

FOLDER = potto.Workspace(EXAMPLES / "raytrace")
GIVEN = {"q": -0.2, "ex": 0.0, "focal": 1.0, "lx": 0.2, "threshold": 0.8}
H = 0.0625
STEP = mp.mpf(10) ** -15


def module(name: str) -> potto.Module:
    text = (EXAMPLES / "raytrace" / f"{name}.po").read_text(encoding="utf-8")
    return FOLDER.compile(text.replace("h = 1 / 256", f"h = {H}"), f"coarse {name}")


MAIN, HIDDEN, SPHERE, SHADOWS = map(module, ("main", "hidden", "sphere", "shadows"))


def box(x: float, y: float) -> tuple[Any, Any, Any, Any]:
    half = mp.mpf(H) / 2
    return mp.mpf(x) - half, mp.mpf(x) + half, mp.mpf(y) - half, mp.mpf(y) + half


def vector(*parts: Any) -> Any:
    return np.array([mp.mpf(part) for part in parts], dtype=object)


def size(v: Any) -> Any:
    return mp.sqrt(v @ v)


def line(n: Any, focal: Any = 1) -> Any:
    """The rays for which n.d = 0."""
    return 0, 0, 0, n[0], n[1], n[2] * focal


def tilted(kind: str, x: float, y: float, given: dict[str, Any]) -> Any:
    """The mean over a pixel of the triangle of the first figure."""
    eye, focal = vector(given["ex"], 0, -2), mp.mpf(given["focal"])
    corners = [vector(*c) - eye for c in (("-1.4", "-1.1", 1), ("1.5", given["q"], 2), ("-0.3", "1.2", "0.5"))]
    a, b, c = corners
    n = np.cross(c - a, b - a)
    sides = [np.cross(a, b), np.cross(b, c), np.cross(c, a)]
    light, plane, conics = vector(given["lx"], "-0.2", "-0.5") - eye, n @ a, []

    def ray(x: Any, y: Any) -> Any:
        return np.array([mp.mpf(x), mp.mpf(y), focal], dtype=object)

    reach = n @ (light - a) / size(n) / mp.mpf(given["threshold"])
    reach = mp.cbrt(reach) if kind == "by_law" else reach

    def lit(x: Any, y: Any) -> Any:
        d = ray(x, y)
        beside = light * (n @ d) - plane * d
        return beside @ beside - (reach * (n @ d)) ** 2

    def colour(x: Any, y: Any) -> Any:
        d = ray(x, y)
        if any(side @ d < 0 for side in sides):
            return mp.mpf(0)
        if kind == "by_depth":
            return n @ d / plane
        return mp.mpf("0.9") if lit(x, y) < 0 else mp.mpf("0.3")

    if kind != "by_depth":
        conics = [curve(lit)]
    return integral(colour, [line(side, focal) for side in sides], conics, box(x, y)) / mp.mpf(H) ** 2


def slope(value: Any, place: float) -> tuple[float, float]:
    with mp.workdps(40):
        here = value(mp.mpf(place))
        return float(here), float((value(mp.mpf(place) + STEP) - here) / STEP)


def found(m: potto.Module, name: str, wrt: str, place: float, at: tuple[float, float], **given: float) -> Any:
    duals = {f"d{k}": (v, 0.0) for k, v in given.items()} | {f"d{wrt}": (place, 1.0)}
    answer = potto.deriv(getattr(m, name))(*at, **duals)
    return float(answer.value), float(answer.tangent)


# An edge, a corner of the triangle, inside, an edge that the line between the tones crosses, and where that line runs.
CORNER = (-0.3 / 2.5, 1.2 / 2.5)
PLACES = {
    "by_depth": [(0.1, -0.25), CORNER, (-0.05, 0.1), (-1.4 / 3, -1.1 / 3)],
    "two_tones": [(0.1, -0.25), CORNER, (-0.15, 0.02), (0.02, 0.17), (0.08, -0.05)],
    "by_law": [(0.1, -0.25), CORNER, (-0.05, -0.05), (-0.3, -0.1)],
}
CASES = [
    (kind, wrt, at)
    for kind, places in PLACES.items()
    for at in places
    for wrt in (("q", "ex", "focal") if kind == "by_depth" else ("q", "ex", "focal", "lx", "threshold"))
]


@pytest.mark.parametrize(("kind", "wrt", "at"), CASES)
def test_the_tilted_triangle(kind: str, wrt: str, at: tuple[float, float]) -> None:
    names = ("q", "ex", "focal") if kind == "by_depth" else tuple(GIVEN)
    given = {name: GIVEN[name] for name in names} | ({"threshold": 0.3} if kind == "by_law" else {})
    others = {name: value for name, value in given.items() if name != wrt}
    exact = slope(lambda t: tilted(kind, *at, GIVEN | given | {wrt: t}), given[wrt])
    agrees(found(MAIN, kind, wrt, given[wrt], at, **others), exact, 1e-8)


def test_a_corner_on_the_border_of_a_pixel_is_no_kink() -> None:
    """To rounding it is beside the border; what lies between is nothing, whose sides are not worth a look."""
    at, others = (0.375 - H / 2, -0.046), {"ex": 0.0, "focal": 1.0}
    exact = slope(lambda t: tilted("by_depth", *at, GIVEN | {"q": t}), -0.2)
    agrees(found(MAIN, "by_depth", "q", -0.2, at, **others), exact, 1e-8)
    duals = {"dq": (-0.2, 1.0), "dex": (0.0, 0.0), "dfocal": (1.0, 0.0)}
    assert potto.deriv(MAIN.by_depth)(*at, **duals).evals < 700  # three times as many for three integrals


@pytest.mark.parametrize("kind", ["two_tones", "by_law"])
def test_the_line_between_the_tones_is_met(kind: str) -> None:
    """The pixels above are not all of one tone: the light and the threshold move something there."""
    threshold = 0.3 if kind == "by_law" else 0.8
    slopes = [found(MAIN, kind, "threshold", threshold, at, **{k: GIVEN[k] for k in ("q", "ex", "focal", "lx")})[1]
              for at in PLACES[kind]]  # fmt: skip
    assert sum(abs(s) > 1e-3 for s in slopes) >= 1


GREYS = ("0.9", "0.6", "0.3")


def planks(z: Any, x: float, y: float) -> Any:
    """By the order of the planes along each ray, which changes on lines only."""
    scene = [[(-2, -1, 3), (2, -1, z), (2, "-0.5", z)], [("1.5", -2, 3), ("1.5", 2, 5), (1, 2, 5)],
             [("1.8", "1.6", "3.2"), ("-1.8", "-1.9", "4.4"), ("-1.2", "-1.9", "4.6")]]  # fmt: skip
    triangles = [[vector(*corner) for corner in t] for t in scene]
    sides = [[np.cross(a, b), np.cross(b, c), np.cross(c, a)] for a, b, c in triangles]
    planes = [np.cross(b - a, c - a) / (np.cross(b - a, c - a) @ a) for a, b, c in triangles]

    def colour(x: Any, y: Any) -> Any:
        d = vector(x, y, 1)
        met = [i for i in range(3) if all(side @ d >= 0 for side in sides[i])]
        return mp.mpf(GREYS[max(met, key=lambda i: planes[i] @ d)]) if met else mp.mpf(0)

    lines = [line(side) for three in sides for side in three]
    lines += [line(planes[i] - planes[j]) for i, j in ((0, 1), (0, 2), (1, 2))]
    return integral(colour, lines, [], box(x, y)) / mp.mpf(H) ** 2


@pytest.mark.parametrize("at", [(0.35, -0.15), (0.32, -0.18), (-0.1, -0.15), (0.3, 0.25), (-0.6, -0.32)])
def test_triangles_hide_each_other(at: tuple[float, float]) -> None:
    exact = slope(lambda z: planks(z, *at), 5.0)
    agrees(found(HIDDEN, "picture", "z", 5.0, at), exact, 1e-8)


def test_pixels_of_triangles_that_hide_each_other_are_taken_together() -> None:
    """What hides a triangle of itself is defined nowhere, so that the pixels need no search: four times as many, of the
    same scene, do not ask kernels twice as often."""

    def asked(count: int) -> int:
        x, y = (of.ravel() for of in np.meshgrid(*[np.linspace(-0.55, 0.55, count)] * 2))
        seen = potto.deriv(HIDDEN.picture)(x, y, dz=(4.9, 1.0))
        assert np.all(seen.converged)
        return int(seen.stats["kernels compiled"] + seen.stats["kernels reused"])

    assert asked(12) < 2 * asked(6)


@pytest.mark.parametrize("at", [(0.066 + 0.27, 0.033), (0.066, 0.033 - 0.27), (-0.12, 0.22), (0.05, 0.05)])
def test_the_silhouette_of_a_sphere(at: tuple[float, float]) -> None:
    def area(r: Any) -> Any:
        m = vector("0.2", "0.1", 3)

        def inside(x: Any, y: Any) -> Any:
            d = vector(x, y, 1)
            return (m @ d) ** 2 - (d @ d) * (m @ m - r * r)

        colour = lambda x, y: mp.mpf(1) if inside(x, y) > 0 else mp.mpf(0)  # noqa: E731
        return integral(colour, [], [curve(inside)], box(*at)) / mp.mpf(H) ** 2

    agrees(found(SPHERE, "silhouette", "r", 0.8, at), slope(area, 0.8), 1e-8)


@pytest.mark.parametrize("wrt", ["r", "lx"])
def test_a_sphere_in_two_tones(wrt: str) -> None:
    """Against differences of values that have converged, of fourth order."""
    given, at = {"r": 0.8, "lx": 0.8}, (0.04, 0.04)

    def value(t: float) -> float:
        return found(SPHERE, "shaded", wrt, t, at, **{k: v for k, v in given.items() if k != wrt})[0]

    place, step = given[wrt], 1e-3
    near, far = value(place + step) - value(place - step), value(place + 2 * step) - value(place - 2 * step)
    tangent = found(SPHERE, "shaded", wrt, place, at, **{k: v for k, v in given.items() if k != wrt})[1]
    assert abs(tangent - (8 * near - far) / (12 * step)) < 1e-6 * max(1.0, abs(tangent))


def shadow(q: Any, lx: Any, x: float, y: float) -> Any:
    light = vector(lx, "0.4", 3)
    t = [vector("0.3", "0.3", 1), vector(q, "0.35", 1), vector("0.4", "0.8", 1)]
    cast = [corner + (corner - light) / 2 for corner in t]  # on the floor, as the light is at 3 and the triangle at 1
    pairs = list(zip(cast, cast[1:] + cast[:1]))

    def side(a: Any, b: Any, x: Any, y: Any) -> Any:
        return (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])

    lines = [curve(lambda x, y, a=a, b=b: side(a, b, mp.mpf(x), mp.mpf(y))) for a, b in pairs]
    dark = lambda x, y: mp.mpf(0) if all(side(a, b, x, y) > 0 for a, b in pairs) else mp.mpf(1)  # noqa: E731
    return integral(dark, lines, [], box(x, y)) / mp.mpf(H) ** 2


@pytest.mark.parametrize("at", [(0.21, 0.26), (0.6, 0.29), (1.1, 0.325), (0.36, 1.0), (0.5, 0.5)])
def test_a_hard_shadow(at: tuple[float, float]) -> None:
    by_corner, by_light = (
        slope(lambda q: shadow(q, mp.mpf("0.5"), *at), 0.9),
        slope(lambda lx: shadow(mp.mpf("0.9"), lx, *at), 0.5),
    )
    agrees(found(SHADOWS, "triangle", "q", 0.9, at, lx=0.5), by_corner, 1e-8)
    agrees(found(SHADOWS, "triangle", "lx", 0.5, at, q=0.9), by_light, 1e-8)


@pytest.mark.parametrize("at", [(0.4, 0.3), (0.33, 0.1), (0.5, 0.6), (0.1, 0.9), (0.8, 0.2)])
def test_a_soft_shadow(at: tuple[float, float]) -> None:
    exact = slope(lambda lx: half_shadow(lx, *at, H), 0.5)
    agrees(found(SHADOWS, "edge", "lx", 0.5, at, q=1.0), exact, 1e-8)


def test_the_ramp_of_a_soft_shadow_is_found_straight_through() -> None:
    """Sections turn next to its end. Nodes set around a turning point that a rounding puts within a stretch, not beyond
    it, are no good to what is a polynomial: they took nine times as many evaluations."""
    answer = SHADOWS.eval("deriv(\\t . soft((0.4, 0, 1), (0.6, 1, 1), lamp(t), 0.4, 0.3, 0.2, 0.2))((0.5, 1))")
    agrees(answer, slope(lambda lx: half_shadow(lx, mp.mpf("0.4"), mp.mpf("0.3"), mp.mpf("0.2")), 0.5), 1e-8)
    assert answer.evals < 60_000


@pytest.mark.slow
@pytest.mark.parametrize("at", [(0.25, 0.4), (0.35, 0.98)], ids=["an edge", "a corner"])
def test_a_soft_shadow_of_a_triangle(at: tuple[float, float]) -> None:
    """Sampled, with three or so digits: the error that is given covers what is missing, and is small."""
    with potto.settings(rtol=1e-2):
        found = potto.deriv(SHADOWS.triangle_softly)(*at, dq=(0.9, 0.0), dlx=(0.5, 1.0))
    value, slopes = soft_triangle(*at, H, {"q": 0.9, "lx": 0.5})
    assert abs(found.value - value) <= found.error < 0.01
    assert abs(found.tangent - slopes["lx"]) <= found.tangent_error < 0.05


NAMED = """
from geometry import Camera
from sphere import pixel, tones
def seen(x, y, mx, mz, r, ex, focal, shader)
    pixel((mx, 0.1, mz), r, Camera((ex, 0, -2), focal), shader, x - 1/32, y - 1/32, 1/16)
def silhouette(x, y, mx, mz, r, ex, focal) seen(x, y, mx, mz, r, ex, focal, \\(p, n, s) . 1)
def shaded(x, y, mx, mz, r, ex, focal, lx, th)
    seen(x, y, mx, mz, r, ex, focal, \\(p, n, s) . tones(p, n, (lx, 1, -1.5), th))
"""


@pytest.mark.parametrize("wrt", ["mx", "mz", "r", "ex", "focal"])
def test_a_sphere_all_of_whose_numbers_have_names(wrt: str) -> None:
    given = {"mx": 0.2, "mz": 1.0, "r": 0.8, "ex": 0.0, "focal": 1.0}

    def under(x: Any, y: Any, g: Any) -> Any:
        m, d = (g["mx"] - g["ex"], 0.1, g["mz"] + 2), (x, y, g["focal"])
        md, dd, mm = (sum(a * b for a, b in zip(*two)) for two in ((m, d), (d, d), (m, m)))
        return md * md - dd * (mm - g["r"] ** 2)

    at, named = (0.32, 0.05), FOLDER.compile(NAMED, "named sphere")
    lit = lambda x, y, g: np.where(np.real(under(x, y, g)) > 0, 1.0, 0.0)  # noqa: E731
    box = at[0] - H / 2, at[0] + H / 2, at[1] - H / 2, at[1] + H / 2
    value, slopes = by_level_sets([under], lit, box, given)
    others = {name: number for name, number in given.items() if name != wrt}
    agrees(found(named, "silhouette", wrt, given[wrt], at, **others), (value / H**2, slopes[wrt] / H**2), 1e-8)


def test_what_is_said_of_a_condition_fits_a_line() -> None:
    """The condition of the tones has 3,800 characters where everything has a name."""
    said = [d.message for d in FOLDER.compile(NAMED, "named sphere").diagnostics if d.code == "P0616"]
    assert len(said) == 1 and "searched for" in said[0] and len(said[0]) < 250


@pytest.mark.parametrize("kind", ["by_depth", "two_tones", "by_law"])
def test_no_pixel_takes_much_longer_than_the_others(kind: str) -> None:
    """Where the triangle begins within a pixel, rounding at its corner was taken for a peak, and halved away."""
    names = ("q", "ex", "focal") if kind == "by_depth" else tuple(GIVEN)
    duals = {f"d{n}": (GIVEN[n], float(n == "q")) for n in names}
    if kind == "by_law":
        duals["dthreshold"] = (0.3, 0.0)
    function, times = potto.deriv(getattr(MAIN, kind)), []
    places = [(0.6 * np.cos(t) * r, 0.6 * np.sin(t) * r) for t in np.arange(8) for r in (0.1, 0.4, 0.7)]
    for at in [*places, (-0.39375, -0.16875), (-0.13125, 0.43125), *PLACES[kind]]:
        best = []
        for _ in range(3):
            start = time.process_time()
            function(*at, **duals)
            best.append(time.process_time() - start)
        times.append(min(best))
    assert max(times) < 20 * np.median(times)


def test_what_moves_the_picture() -> None:
    """By depth everything inside of the triangle; in two tones its edges by the corner, and the light moves no edge."""
    lit: Any = runpy.run_path(str(EXAMPLES / "raytrace" / "sparsity.py"))["lit"]
    given = {"q": -0.2, "ex": 0.0, "focal": 1.0}
    near, _ = lit(MAIN.by_depth, 19, given)  # pixels of the height that MAIN has
    tones, _ = lit(MAIN.two_tones, 19, {**given, "lx": 0.2, "threshold": 0.8})
    corner, light, camera = np.moveaxis(tones, -1, 0)
    assert near[..., 0].sum() > 2 * corner.sum() > 0 and not near[..., 1].any()
    assert light.any() and light.sum() < corner.sum() and not (corner & ~near[..., 2]).any()
    assert camera.sum() >= corner.sum()
