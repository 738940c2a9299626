"""Look-ups between the places of lattices: their slopes at places, and what integrals make of them."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import mpmath as mp
import numpy as np
import pytest

import potto

PROGRAMS = """
def line(x) interp([0, 1, 2], [0, 1, 3], x)
def picked(photo: [h, w] Real, u, v) image(photo, u, v)
def lit(photo: [h, w] Real, a, b, s) integral ([a, a + s], [b, b + s]) image(photo, u, v)^2*(u + 2*v) d(u, v)
def above(photo: [h, w] Real, a, b, s, t) integral ([a, a + s], [b, b + s]) [image(photo, u, v) > t] d(u, v)
def table(xs: [n] Real, ys: [n] Real, a, b) integral [a, b] interp(xs, ys, x)^2 d(x)
def higher(xs: [n] Real, ys: [n] Real, a, b, t) integral [a, b] [interp(xs, ys, x) > t]*x d(x)
def beyond(photo: [h, w] Real, a, b, c) integral ([0, 1], [0, 1]) image(photo, u, v)*[a*u + b*v > c] d(u, v)
def across(photo: [h, w] Real, c, t) integral [0, 1] [image(photo, c*x, x) > t] d(x)
def made(h, w, u) image([[i + j for j in 0..w-1] for i in 0..h-1], u, 1/2)
"""


@pytest.fixture(scope="module")
def programs() -> potto.Module:
    return potto.compile(PROGRAMS)


def bilinear(photo: np.ndarray, u: mp.mpf, v: mp.mpf) -> mp.mpf:
    h, w = photo.shape
    x, y = (min(max(at * n - mp.mpf(0.5), 0), n - 1) for at, n in ((u, w), (v, h)))
    i, j = int(mp.floor(x)), int(mp.floor(y))
    right, below, f, g = min(i + 1, w - 1), min(j + 1, h - 1), x - i, y - j
    upper = (1 - f) * mp.mpf(photo[j, i]) + f * mp.mpf(photo[j, right])
    lower = (1 - f) * mp.mpf(photo[below, i]) + f * mp.mpf(photo[below, right])
    return (1 - g) * upper + g * lower


def borders(low: float, high: float, count: int) -> list[mp.mpf]:
    middles = [(mp.mpf(k) + 0.5) / count for k in range(count)]
    inside = [m for m in middles if min(low, high) < m < max(low, high)]
    return [mp.mpf(low), *(inside if low < high else inside[::-1]), mp.mpf(high)]


def exact(f: Callable[[mp.mpf], mp.mpf], ends: list[mp.mpf]) -> mp.mpf:
    """The integral of what is a polynomial of degree 5 at most between these places, by three nodes of Gauss."""
    total, node = mp.mpf(0), mp.sqrt(mp.mpf(3) / 5)
    for low, high in itertools.pairwise(ends):
        middle, half = (low + high) / 2, (high - low) / 2
        total += half * (5 * f(middle - half * node) + 8 * f(middle) + 5 * f(middle + half * node)) / 9
    return total


def squared(photo: np.ndarray, a: float, b: float, s: float) -> mp.mpf:
    h, w = photo.shape

    def row(v: mp.mpf) -> mp.mpf:
        return exact(lambda u: bilinear(photo, u, v) ** 2 * (u + 2 * v), borders(a, a + s, w))

    return exact(row, borders(b, b + s, h))


# Slopes at places


def test_at_a_place_the_slope_is_that_to_the_right(programs: potto.Module) -> None:
    found = potto.grad(programs.line)(np.array([0.0, 0.5, 1.0, 1.5, 2.0]))
    assert found.value.tolist() == [0, 0.5, 1, 2, 3]
    assert found.tangent.tolist() == [1, 1, 2, 2, 0]


def test_at_the_middle_of_a_pixel_too(programs: potto.Module) -> None:
    photo = np.array([[0.0, 1.0, 5.0], [3.0, 0.0, 7.0]])
    u, v = np.array([1 / 6, 1 / 2, 1 / 2]), np.array([1 / 4, 1 / 4, 3 / 4])
    found = potto.grad(programs.picked, ("u", "v"))(photo, u, v)
    assert found.value == pytest.approx([0, 1, 0], abs=1e-15)
    assert found.tangent[0] == pytest.approx([3, 12, 21], abs=1e-13)  # differences of neighbours, times 3 columns
    assert found.tangent[1] == pytest.approx([6, -2, 0], abs=1e-13)  # times 2 rows; below the last all is as there


def test_by_all_pixels_for_many_points_at_once(programs: potto.Module) -> None:
    """A look-up is linear in the pixels: the derivative by one is the look-up in a picture of that pixel alone."""
    random = np.random.default_rng(3)
    photo, (u, v) = random.random((9, 7)), random.random((2, 6))
    slopes = np.asarray(potto.grad(programs.picked, "photo")(photo, u, v).tangent)
    assert slopes.shape == (6, 9, 7)
    for row, column in ((0, 0), (4, 3), (8, 6), (5, 1)):
        alone = np.zeros((9, 7))
        alone[row, column] = 1
        assert slopes[:, row, column] == pytest.approx(programs.picked(alone, u, v).value, abs=1e-15)


@pytest.mark.parametrize("size", [(1, 1), (1, 4), (2, 3), (4, 4), (5, 2), (40, 60)])
def test_points_in_pictures_of_all_sizes(programs: potto.Module, size: tuple[int, int]) -> None:
    random = np.random.default_rng(size[0])
    photo, (u, v) = random.random(size), 1.4 * random.random((2, 50)) - 0.2
    found = programs.picked(photo, u, v)
    wanted = [float(bilinear(photo, mp.mpf(x), mp.mpf(y))) for x, y in zip(u, v, strict=True)]
    assert (np.abs(found.value - wanted) <= found.error + 1e-16).all()


# Under integrals


@pytest.mark.parametrize(
    ("size", "a", "b", "s"),
    [
        ((2, 2), 0.0, 0.0, 1.0),
        ((3, 2), 0.25, 1 / 6, 0.5),  # begins on the middles of pixels
        ((2, 3), -0.5, -0.25, 2.0),  # goes beyond on all sides
        ((3, 3), 0.9, 0.8, -0.6),  # backwards
        ((4, 3), 0.3, 0.4, 0.01),  # within a cell
        ((1, 2), 0.1, 0.2, 0.7),
        ((2, 2), 0.4, 0.3, 0.0),
    ],
)
def test_the_square_of_a_look_up(programs: potto.Module, size: tuple[int, int], a: float, b: float, s: float) -> None:
    photo = np.random.default_rng(7).random(size)
    found = potto.grad(programs.lit, ("a", "b", "s"))(photo, a, b, s)
    assert abs(found.value - squared(photo, a, b, s)) <= found.error + 1e-16 < 1e-11
    with mp.workdps(20):
        step = mp.mpf(10) ** -6  # 1e-8 by central differences of a function whose third derivatives jump
        for place, slope in enumerate(found.tangent):
            ends = [squared(photo, *(mp.mpf(x) + sign * step * (i == place) for i, x in enumerate((a, b, s))))
                    for sign in (1, -1)]  # fmt: skip
            assert slope == pytest.approx(float((ends[0] - ends[1]) / (2 * step)), abs=1e-4)


def test_a_condition_on_a_look_up(programs: potto.Module) -> None:
    """Between four pixels 0, 0, 0, 1 it is x*y over a unit cell: above t that is 1 - t + t*log(t) of it."""
    photo, t = np.array([[0.0, 0.0], [0.0, 1.0]]), 0.3
    found = potto.grad(programs.above, "t")(photo, 0.25, 0.25, 0.5, t)
    assert abs(found.value - (1 - t + t * np.log(t)) / 4) <= found.error + 1e-17 < 1e-11
    assert abs(found.tangent - np.log(t) / 4) <= found.tangent_error + 1e-16 < 1e-11


def test_a_condition_on_a_picture_of_many_pixels(programs: potto.Module) -> None:
    """A picture that rises with u alone: above t is what lies to the right of one line."""
    photo = np.tile((np.arange(32) + 0.5) / 32, (24, 1))
    found = potto.grad(programs.above, "t")(photo, 0, 0, 1, 0.4)
    assert abs(found.value - 0.6) <= found.error + 1e-16 < 1e-11
    assert abs(found.tangent + 1) <= found.tangent_error + 1e-16 < 1e-11


def test_a_look_up_along_one_variable_in_both_directions(programs: potto.Module) -> None:
    """On the diagonal of x*y: x^2 > t from sqrt(t) on, where coordinates are taken from the middles of four pixels."""
    photo, t = np.array([[0.0, 0.0], [0.0, 1.0]]), 0.36
    found = potto.grad(programs.across, "t")(photo, 1, t)  # (2x - 1/2)^2 > t, from (sqrt(t) + 1/2)/2 on
    assert abs(found.value - (1 - (0.6 + 0.5) / 2)) <= found.error + 1e-16 < 1e-11
    assert abs(found.tangent + 1 / (4 * 0.6)) <= found.tangent_error + 1e-15 < 1e-11


@pytest.mark.parametrize(
    ("size", "a", "b", "c"), [((8, 8), 1.0, 0.7, 0.8), ((3, 5), 0.3, 1.1, 0.6), ((1, 4), 2, 0.5, 1)]
)
def test_an_edge_that_leans(programs: potto.Module, size: tuple[int, int], a: float, b: float, c: float) -> None:
    """The walk is from cell to cell, and cells that the edge crosses are cut by it: eight nodes a cell at most."""
    photo = np.random.default_rng(3).uniform(0, 1, size)
    h, w = size
    start, end, slope = mp.mpf(c) / a, mp.mpf(c - b) / a, mp.mpf(a) / b  # where the edge meets v = 0 and v = 1

    def row(v: mp.mpf) -> mp.mpf:
        first = min(max(start + (end - start) * v, 0), 1)
        return exact(lambda u: bilinear(photo, u, v), borders(first, 1, w))

    along_v = [*borders(0, 1, h), *((start - u) / (start - end) for u in borders(0, 1, w))]
    value = exact(row, sorted(v for v in along_v if 0 <= v <= 1))
    low, high = max(end, 0), min(start, 1)
    along_u = [*borders(0, 1, w), low, high, *(start - v / slope for v in borders(0, 1, h))]
    crossed = exact(lambda u: bilinear(photo, u, (start - u) * slope), sorted(u for u in along_u if low <= u <= high))
    found = potto.grad(programs.beyond, "c")(photo, a, b, c)
    assert found.value == pytest.approx(float(value), rel=1e-13)  # polynomials on polygons: nothing but rounding
    assert found.tangent == pytest.approx(float(-crossed / b), rel=1e-12)
    assert found.stats["evaluations"] <= 8 * (h + 1) * (w + 1)


def test_a_surface_on_the_border_of_two_cells() -> None:
    """At t = 1/2, the middle of a pixel, one cell ends and the next begins: the whole has one derivative there, at 0
    and 1 two."""
    program = """
photo = [[0, 1, 0.5], [0.25, 0.75, 1]]
def passed(t) integral ([0, 1], [0, 1]) image(photo, u, v)^2*[u < t] d(u, v)
"""
    function = potto.compile(program).passed
    found = potto.grad(function, "t")(0.5)
    column = 1 / 4 + (1 + 0.75 + 0.75**2) / 3 / 2 + 0.75**2 / 4
    assert found.tangent == pytest.approx(column, abs=1e-14) and not found.notes and found.converged
    assert potto.grad(function, "t")(1.0).notes
    several = potto.grad(function, "t")(np.array([0.5, 0.6, 1.0]))
    assert several.tangent[0] == pytest.approx(column, abs=1e-14) and len(several.notes) == 1


# Tables


def line(xs: np.ndarray, ys: np.ndarray, x: mp.mpf) -> mp.mpf:
    k = int(np.clip(np.searchsorted(xs, float(x), side="right") - 1, 0, len(xs) - 2))
    way = (min(max(x, mp.mpf(xs[0])), mp.mpf(xs[-1])) - mp.mpf(xs[k])) / (mp.mpf(xs[k + 1]) - mp.mpf(xs[k]))
    return mp.mpf(ys[k]) + way * (mp.mpf(ys[k + 1]) - mp.mpf(ys[k]))


@pytest.mark.parametrize(("a", "b"), [(0.1, 0.9), (-0.5, 1.5), (0.8, 0.2), (0.25, 0.75), (0.3, 0.3)])
@pytest.mark.parametrize("count", [2, 5, 40])
def test_the_square_of_a_table(programs: potto.Module, a: float, b: float, count: int) -> None:
    """0.25 and 0.75 are places of the table of five."""
    xs, ys = np.linspace(0, 1, count), np.random.default_rng(count).random(count)
    found = potto.grad(programs.table, ("a", "b", "ys"))(xs, ys, a, b)
    ends = [mp.mpf(a), *(mp.mpf(x) for x in sorted(xs, reverse=b < a) if min(a, b) < x < max(a, b)), mp.mpf(b)]
    wanted = exact(lambda x: line(xs, ys, x) ** 2, ends)
    assert abs(found.value - wanted) <= found.error + 1e-16
    assert found.tangent[0] == pytest.approx(-(float(line(xs, ys, mp.mpf(a))) ** 2), abs=1e-12)
    assert found.tangent[1] == pytest.approx(float(line(xs, ys, mp.mpf(b))) ** 2, abs=1e-12)
    moved = programs.table(xs, ys + 1e-6, a, b).value - programs.table(xs, ys - 1e-6, a, b).value
    assert np.sum(found.tangent[2]) == pytest.approx(moved / 2e-6, abs=1e-8)  # differences of doubles
    assert found.converged


def test_a_condition_on_a_table(programs: potto.Module) -> None:
    """A zigzag between 0 and 1 is above t in two stretches about each of its peaks, of length 2*(1 - t) places."""
    count, t = 41, 0.3
    xs = np.arange(count) / (count - 1)
    ys = (np.arange(count) % 2).astype(float)
    found = potto.grad(programs.higher, "t")(xs, ys, 0, 1, t)
    step, peaks = 1 / (count - 1), xs[1::2]
    assert abs(found.value - np.sum(peaks) * 2 * (1 - t) * step) <= found.error + 1e-15 < 1e-11
    assert abs(found.tangent + np.sum(peaks) * 2 * step) <= found.tangent_error + 1e-14 < 1e-11


@pytest.mark.parametrize(("xs", "first", "second"), [
    ([0, 2, 1], "2.0", "1.0"),
    ([0, 1, 1], "1.0", "1.0"),
    ([0, 0, 1], "0.0", "0.0"),
    ([float("nan"), 0, 1], "nan", "0.0"),
])  # fmt: skip
def test_places_that_do_not_rise_are_told(programs: potto.Module, xs: list[float], first: str, second: str) -> None:
    """At a point, under an integral, in a condition and in a gradient, by either spelling of a batch."""
    calls: list[Callable[[], object]] = [
        lambda: potto.compile("def at(xs: [n] Real, ys: [n] Real, x) interp(xs, ys, x)").at(xs, [0, 1, 2], 0.5),
        lambda: programs.table(xs, [0, 1, 2], 0.2, 0.7),
        lambda: programs.higher(xs, [0, 1, 2], 0.2, 0.7, 0.5),
        lambda: programs.table(xs, [0, 1, 2], np.linspace(0, 0.5, 5), 0.7),
        lambda: potto.grad(programs.table, wrt=("ys",))(xs, [0, 1, 2], 0.2, 0.7),
    ]
    for call in calls:
        with pytest.raises(potto.PottoError) as told:
            call()
        assert [d.code for d in told.value.diagnostics] == ["P0514"]
        assert f"{second} follows {first}" in told.value.diagnostics[0].message


@pytest.mark.parametrize("at", [0.25, 2.0])
def test_a_table_of_one_place_is_constant(programs: potto.Module, at: float) -> None:
    """As beyond the ends of a longer one, whether the place is within the range or beyond it: y^2*(b - a) with slope
    2*y*(b - a), and where y > t the integral of x, with no slope but by the bounds."""
    y, a, b = 0.5, 0.2, 0.7
    found = potto.grad(programs.table, wrt=("ys", "xs", "b"))([at], [y], a, b)
    assert float(found.value) == pytest.approx(y**2 * (b - a), rel=1e-14)
    by_value, by_place, by_bound = found.tangent
    assert (by_value[0], by_place[0], by_bound) == pytest.approx((2 * y * (b - a), 0, y**2), rel=1e-14)
    for t, holds in ((0.4, 1), (0.6, 0)):
        above = potto.grad(programs.higher, wrt=("ys", "b"))([at], [y], a, b, t)
        assert float(above.value) == pytest.approx(holds * (b**2 - a**2) / 2, rel=1e-14)
        assert (above.tangent[0][0], above.tangent[1]) == pytest.approx((0, holds * b), abs=1e-14)
    assert potto.compile("def at(xs: [n] Real, ys: [n] Real, x) interp(xs, ys, x)").at([at], [y], 0.3).value == y


def test_places_made_in_the_program() -> None:
    program = potto.compile("""
def squares(x) interp([0.1*i for i in 0..10], [i^2 for i in 0..10], x)
def flat(x) interp([1 for i in 0..3], [i for i in 0..3], x)
def moved(a) integral [0, 2] interp([0, a, 2], [0, 1, 0], x) d(x)
""")
    assert abs(program.squares(0.55) - 30.5) < 1e-12
    assert abs(program.moved(0.5) - 1) < 1e-12  # a tent of base 2 and height 1, wherever its peak
    for call in (lambda: program.flat(0.5), lambda: program.moved(2.0)):
        with pytest.raises(potto.PottoError, match="`interp` needs increasing places"):
            call()


def test_a_look_up_in_a_condition_within_a_condition() -> None:
    """In the cells at the ends the formula of the segments would be of what is not there."""
    program = potto.compile("""
def up(ys: [m] Real, x) interp([0.1, 0.7], ys, x)
def f(t, ys: [m] Real) integral [-0.5, 1] x*[(if [up(ys, x) > t] then 1 else up(ys, x)) > 0.5] d(x)
""")
    value = program.f(0.8, [0.4, 1.0])  # interp passes 0.5 at x = 0.2, and its sides above t stay above
    assert value.converged and abs(value - (1 - 0.2**2) / 2) < 1e-12
    assert abs(program.f(0.3, [0.4, 1.0]) - (1 - 0.5**2) / 2) < 1e-12  # all of it is above t


def test_each_summand_looks_up_at_places_of_its_own() -> None:
    """Sprites with one texture: each goes from cell to cell, and what it costs is not the pixels of the texture."""
    program = potto.compile("""
record Sprite(x: Real, y: Real, r: Real)
def texel(photo: [h, w] Real, s: Sprite, x, y) image(photo, (x - s.x)/s.r, (y - s.y)/s.r)
def inside(s: Sprite, x, y) [s.x <= x < s.x + s.r and s.y <= y < s.y + s.r]
def pixel(ss: [n] Sprite, photo: [h, w] Real, a, b, d)
    integral ([a, a + d], [b, b + d]) sum s in ss (inside(s, x, y)*texel(photo, s, x, y)) d(x, y)
""")
    photo = np.random.default_rng(3).uniform(size=(6, 5))
    sprites = [(0.1, 0.2, 0.5), (0.45, 0.3, 0.3), (0.8, 0.9, 0.7)]
    places = np.arange(8) / 8
    found = program.pixel(sprites, photo, places[:, None], places[None, :], 1 / 8)
    assert found.evals < 20_000

    def covered(sprite: tuple[float, float, float], a: float, b: float) -> mp.mpf:
        """In the coordinates of the texture, from 0 to 1."""
        ends = [
            [min(max((mp.mpf(at) - low) / sprite[2], 0), 1) for at in (start, start + mp.mpf(1) / 8)]
            for start, low in ((a, sprite[0]), (b, sprite[1]))
        ]
        h, w = photo.shape
        across, down = borders(*ends[0], w), borders(*ends[1], h)
        return sprite[2] ** 2 * exact(lambda v: exact(lambda u: bilinear(photo, u, v), across), down)

    for i, j in ((0, 0), (2, 3), (4, 4), (5, 4), (7, 7)):
        value = mp.fsum(covered(sprite, places[i], places[j]) for sprite in sprites)
        assert abs(found.value[i, j] - value) < 1e-14


@pytest.mark.parametrize("shape", [(0, 0), (0, 3), (3, 0)])
def test_an_image_without_pixels_has_no_value(programs: potto.Module, shape: tuple[int, int]) -> None:
    photo = np.zeros(shape)
    asked: list[Callable[[], object]] = [
        lambda: programs.picked(photo, 0.5, 0.5),
        lambda: programs.picked(photo.tolist(), np.linspace(0, 1, 5), 0.5),
        lambda: potto.grad(programs.picked, ["u", "v"])(photo, 0.5, 0.5),
        lambda: programs.lit(photo, 0, 0, 1),
        lambda: programs.made(*shape, 0.5),
    ]
    for ask in asked:
        with pytest.raises(potto.PottoError, match="this array or range is empty") as raised:
            ask()
        assert raised.value.diagnostics[0].code == "P0511"
    assert programs.made(1, 1, 0.5).value == 0
    assert programs.made(2, 2, 0.5).value == 1
