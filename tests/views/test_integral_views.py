"""What is seen of an integral, held against geometry by hand and closed forms."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import pytest
from msgspec import Struct

from potto.applications import integral_scenes
from potto.applications.integral_numbers import IntegralNumbers
from potto.applications.integral_pictures import remarks, told
from potto.applications.integral_scenes import IntegralScene
from potto.applications.integral_views import IntegralView
from potto.diagnostics import PottoError
from potto.evaluating.world import World

PROGRAM = r"""
def step(t) integral [0, 1] [x < t]*(x + 1/2) d(x)
def moving(t) integral [t^2, 2*t] x^2 d(x)
def disc(r) integral ([-1, 1], [-1, 1]) [x^2 + y^2 < r^2] d(x, y)
def corner(c) integral ([0, 1], [0, x]) [y < c] d(x, y)
def tail(m) integral [-inf, inf] [x < m]*exp(-x^2) d(x)
def ball(r) integral ([-1, 1], [-1, 1], [-1, 1]) [x^2 + y^2 + z^2 < r^2] d(x, y, z)
def shaded(c, shader) integral ([0, 1], [0, 1]) [x + y + c >= 0]*shader(x, y) d(x, y)
def both(a, b) integral [0, 1] a*[x < b] d(x)
def pair(k, p: (Real, Real)) integral [0, fst(p)] snd(p)*x d(x)
def two(t) (integral [0, 1] [x < t] d(x)) + (integral [0, 1] [x < t^2] d(x))
def kink(t) integral [0, 1] (if [exp(x) < t] then 2*(t - exp(x)) else exp(x) - t) d(x)
def steps(t) integral [0, 1] (sum i in 1..9 ([x < t/i])) d(x)
def part(c) integral [0, 1] (if [x < c] then (1, x) else (0, 2)) d(x)
def second(c) part(c).1
def on(c) integral [0, 1] delta(x - c)*x^2 d(x)
record Step(at: Real, height: Real)
low = Step(0.25, 3)
def rise(s: Step) integral [0, 1] (if [x < s.at] then 0 else s.height) d(x)
#> rise(low)
def raised(at) rise(low with at = at)
def total(g: Real* -> Real) integral [0, 1] g(x) d(x)
def plain(t) t^2
lost = 1 + nothing
"""


class Looked(Struct):
    view: IntegralView
    numbers: IntegralNumbers
    title: str
    svg: str


def looked(name: str, wrt: str, which: int = 0, shader: str = "", **values: float) -> Looked:
    world = World()
    file = world.put("program.po", PROGRAM)
    scene = IntegralScene(world, file, name, {"shader": shader} if shader else {})
    shot = scene.look({**scene.values, **values}, wrt, which)
    assert shot.numbers is not None
    return Looked(shot.view, shot.numbers, shot.title, shot.svg)


def test_a_step_is_a_point_that_gains_what_is_left_of_it() -> None:
    shot = looked("step", "t", t=0.3)
    (surface,) = shot.view.surfaces
    (arrow,) = surface.arrows
    assert surface.equation == "x = t"
    assert arrow.at == pytest.approx((0.3,), abs=1e-15)
    assert arrow.velocity == pytest.approx((1.0,))
    assert arrow.weight == pytest.approx(0.8, abs=1e-15)  # x + 1/2 at x = t
    assert shot.numbers.value == pytest.approx(0.3**2 / 2 + 0.15, abs=1e-15)
    assert shot.numbers.boundary == pytest.approx(0.8, abs=1e-14)
    assert shot.numbers.interior == 0
    assert max(shot.view.cells[0]) == 1


def test_bounds_that_move_gain_the_integrand_at_them() -> None:
    shot = looked("moving", "t", t=0.5)
    low, high = shot.view.bounds
    assert (low.at, low.velocity, low.weight) == ((0.25,), (1.0,), -(0.25**2) * 1.0)
    assert (high.at, high.velocity, high.weight) == ((1.0,), (2.0,), 2.0)
    assert shot.numbers.tangent == pytest.approx(low.weight + high.weight, abs=1e-14)


def test_a_circle_moves_outwards_everywhere_alike() -> None:
    shot = looked("disc", "r", r=0.7)
    (surface,) = shot.view.surfaces
    for arrow in surface.arrows:
        (x, y), (u, v) = arrow.at, arrow.velocity
        assert math.hypot(x, y) == pytest.approx(0.7, abs=1e-3)
        assert math.hypot(u, v) == pytest.approx(1.0, abs=1e-3)
        assert u * x + v * y == pytest.approx(0.7, abs=1e-3)
        assert arrow.weight == pytest.approx(1.0, abs=1e-3)
    assert surface.gain == pytest.approx(2 * math.pi * 0.7, rel=1e-3)
    assert shot.numbers.boundary == pytest.approx(2 * math.pi * 0.7, abs=1e-12)
    assert shot.numbers.difference == pytest.approx(2 * math.pi * 0.7, abs=1e-9)  # of pi r^2, no error of its own


def test_a_surface_ends_where_a_bound_that_bends_does() -> None:
    shot = looked("corner", "c", c=0.25)
    (surface,) = shot.view.surfaces
    assert min(min(a[0], b[0]) for a, b in surface.lines) == pytest.approx(0.25, abs=0.02)
    assert surface.gain == pytest.approx(0.75, abs=0.02)
    assert shot.view.cells[-1][0] == -1
    assert shot.view.cells[0][-1] >= 0


def test_an_endless_range_is_cut_and_says_so() -> None:
    shot = looked("tail", "m", m=0.2)
    assert shot.view.cut
    assert shot.view.surfaces[0].gain == pytest.approx(math.exp(-0.04), abs=1e-14)


def test_where_nothing_jumps_there_is_no_arrow() -> None:
    """Both sides meet at exp(x) = t but for rounding, which is no gain."""
    (surface,) = looked("kink", "t", t=1.7).view.surfaces
    assert surface.lines and surface.gain == 0 and not any(arrow.weight for arrow in surface.arrows)


def test_surfaces_that_are_not_drawn_are_told() -> None:
    view = looked("steps", "t", t=0.7).view
    assert not view.surfaces and remarks(view) == ["surfaces of a sum's conditions are not drawn"]


def test_of_three_variables_a_section_is_seen() -> None:
    shot = looked("ball", "r", r=0.7)
    assert shot.view.variables == ("x", "y")
    assert [(held.name, held.at) for held in shot.view.held] == [("z", 0.0)]
    assert shot.numbers.boundary == pytest.approx(4 * math.pi * 0.49, abs=1e-11)


def test_a_section_is_moved_along_the_variable_that_is_not_seen() -> None:
    """At z a ball is a disc of radius sqrt(r^2 - z^2), whose edge gains 2*pi*r whatever z is. Numbers stay."""
    world = World()
    scene = IntegralScene(world, world.put("program.po", PROGRAM), "ball", {"r": "0.7", "z": "0.3"})
    assert scene.sections == {"z": 0.3}
    shots = [scene.look(scene.values, "r", sections={"z": z}) for z in (0.3, -0.5, 3.0)]
    for shot, radius in zip(shots[:2], (math.sqrt(0.4), math.sqrt(0.24)), strict=True):
        (surface,) = shot.view.surfaces
        assert all(math.hypot(*arrow.at) == pytest.approx(radius, abs=1e-3) for arrow in surface.arrows)
        assert surface.gain == pytest.approx(2 * math.pi * 0.7, rel=1e-3)
        assert shot.numbers is shots[0].numbers
    (held,) = shots[2].view.held
    assert (held.at, held.low, held.high) == (1.0, -1.0, 1.0) and not shots[2].view.surfaces[0].lines


def test_a_parameter_that_is_a_function_is_written_in() -> None:
    shot = looked("shaded", "c", shader=r"\(x, y) . x", c=-0.7)
    assert shot.title == r"shaded(c = -0.7, shader = \(x, y) . x)"
    (surface,) = shot.view.surfaces
    # the edge y = 0.7 - x runs over x from 0 to 0.7: the integral of x dx along it
    assert surface.gain == pytest.approx(0.245, abs=1e-3)
    assert shot.numbers.boundary == pytest.approx(0.245, abs=1e-13)


def test_interior_and_boundary_are_told_apart() -> None:
    by_height = looked("both", "a", a=2, b=0.25).numbers
    by_place = looked("both", "b", a=2, b=0.25).numbers
    assert by_height.interior == pytest.approx(0.25)
    assert by_height.boundary == 0
    assert by_place.interior == 0
    assert by_place.boundary == pytest.approx(2.0)


def test_numbers_of_a_tuple_move_apart() -> None:
    assert looked("pair", "p_1", k=0, p_1=0.5, p_2=3).numbers.tangent == pytest.approx(1.5)
    assert looked("pair", "p_2", k=0, p_1=0.5, p_2=3).numbers.tangent == pytest.approx(0.125)


def test_of_an_integral_of_a_tuple_each_number_is_seen() -> None:
    """(c, c^2/2 + 2*(1 - c)): what gains c - 2 where x = c."""
    assert looked("part", "c", 0, c=0.5).numbers.tangent == pytest.approx(1)
    for shot in (looked("part", "c", 1, c=0.5), looked("second", "c", c=0.5)):
        assert shot.numbers.value == pytest.approx(1.125)
        assert shot.numbers.boundary == pytest.approx(-1.5)
        assert shot.view.surfaces[0].arrows[0].weight == pytest.approx(-1.5)


def test_a_record_moves_by_its_fields_and_begins_as_a_live_expression_gives_it() -> None:
    """height*(1 - at)"""
    shot = looked("rise", "s.at")
    assert shot.title == "rise(s.at = 0.25, s.height = 3)"
    assert shot.numbers.value == pytest.approx(2.25)
    assert shot.numbers.boundary == pytest.approx(-3)
    assert looked("rise", "s.height").numbers.interior == pytest.approx(0.75)
    assert looked("raised", "at", at=0.5).numbers.value == pytest.approx(1.5)


def test_a_delta_is_a_line_without_a_height() -> None:
    """c^2, all of it on the line"""
    shot = looked("on", "c", c=0.5)
    (surface,) = shot.view.surfaces
    assert (surface.equation, len(surface.lines)) == ("x = c", 1)
    assert not surface.arrows
    assert shot.numbers.value == pytest.approx(0.25)
    assert shot.numbers.interior == 0
    assert shot.numbers.boundary == pytest.approx(1)


def test_what_another_module_keeps_to_itself_is_looked_at(tmp_path: Path) -> None:
    (tmp_path / "inner.po").write_text(
        "def bump(x, t) (if [x < t] then x else 1)\ndef area(t) integral [0, 1] bump(x, t) d(x)\n"
    )
    (tmp_path / "outer.po").write_text("from inner import area\ndef a(t) 2*area(t)\n")
    world = World([str(tmp_path)])
    scene = IntegralScene(world, str(tmp_path / "outer.po"), "a", {})
    numbers = scene.look({"t": 0.5}, "t").numbers
    assert numbers is not None and numbers.boundary == pytest.approx(-0.5)


def test_where_numbers_take_too_long_the_picture_goes_on_without(monkeypatch: pytest.MonkeyPatch) -> None:
    """For a while without those that do not fit into a frame; those that nobody would wait for are given up."""
    world = World()
    scene = IntegralScene(world, world.put("program.po", PROGRAM), "disc", {})
    cases = ((0.0, 9.0, True, False), (0.0, 9.0, True, False), (10.0, 9.0, True, False), (10.0, 0.0, True, True),
             (0.0, 0.0, True, False), (0.0, 9.0, False, True))  # fmt: skip
    monkeypatch.setattr(integral_scenes, "FRAME", 0.0)
    for patience, again, quick, known in cases:
        monkeypatch.setattr(integral_scenes, "PATIENCE", patience)
        monkeypatch.setattr(integral_scenes, "AGAIN", again)
        shot = scene.look({"r": 0.7}, "r", quick=quick)
        assert (shot.numbers is not None) == known
        assert shot.view.surfaces[0].gain == pytest.approx(2 * math.pi * 0.7, rel=1e-2)
        assert (told(shot.numbers, "r")[0] == ("value", "…")) != known


def test_each_of_several_integrals_is_one_of_its_own() -> None:
    assert looked("two", "t", 0, t=0.5).numbers.tangent == pytest.approx(1)
    assert looked("two", "t", 1, t=0.5).numbers.tangent == pytest.approx(1)
    assert looked("two", "t", 1, t=0.5).numbers.value == pytest.approx(0.25)


def test_the_picture_is_xml_with_a_group_for_each_surface() -> None:
    for shot in (looked("step", "t", t=0.3), looked("disc", "r", r=0.7), looked("moving", "t", t=0.5)):
        root = ElementTree.fromstring(shot.svg)
        groups = [g for g in root.iter("{http://www.w3.org/2000/svg}g") if g.get("class") == "surface"]
        assert len(groups) == len(shot.view.surfaces)


@pytest.mark.parametrize(
    ("name", "wrt", "which", "says"),
    [("plain", "t", 0, "no integral"), ("total", "t", 0, "not a function of numbers"),
     ("step", "u", 0, "no number `u`"), ("nobody", "t", 0, "not defined"),
     ("lost", "t", 0, "nothing"), ("two", "t", 2, "2 integrals")],
)  # fmt: skip
def test_what_cannot_be_seen_says_why(name: str, wrt: str, which: int, says: str) -> None:
    with pytest.raises(PottoError, match=says):
        looked(name, wrt, which, t=0.5)


def texts(svg: str) -> list[tuple[float, str]]:
    """What is written in a picture, and how far down."""
    found = ElementTree.fromstring(svg).iter("{http://www.w3.org/2000/svg}text")
    return [(float(text.get("y", "nan")), text.text or "") for text in found]


def test_what_stands_beside_a_picture_does_not_lie_on_other_words() -> None:
    """The title, what goes up, and the greatest number of the scale; surfaces are set as mathematics is."""
    for svg in (looked("step", "t", t=0.3).svg, looked("disc", "r", r=0.5).svg):
        above = sorted(y for y, _ in texts(svg))[:3]
        assert min(b - a for a, b in pairwise(above)) >= 12
    assert any("x² + y² = r²" in text for _, text in texts(looked("disc", "r", r=0.5).svg))


def test_numbers_of_the_axes_are_round() -> None:
    """1, 2 or 5 times a power of ten apart: up to 0.9 and from 0.36 to 1.2, in fifths."""
    step, moving = looked("step", "t", t=0.3), looked("moving", "t", t=0.6)
    scales = [[text for _, text in texts(shot.svg) if text.replace(".", "").isdecimal()] for shot in (step, moving)]
    fifths = ["0", "0.2", "0.4", "0.6", "0.8", "1", "1.2"]
    assert scales == [[*fifths[:6], *fifths[:5]], [*fifths[2:], "0", "0.5", "1", "1.5"]]


def test_a_bound_that_leans_is_drawn_as_it_is() -> None:
    """y <= t*x of x from t to 1: its edge, a step of t to both sides, and arrows only where the domain is."""
    world = World()
    program = "def fan(t) integral ([t, 1], [0, t*x]) x + y d(x, y)"
    view = IntegralScene(world, world.put("fan.po", program), "fan", {}).look({"t": 0.5}, "t", ghost=0.1).view
    (outline,) = view.outline
    assert {(0.5, 0.0), (1.0, 0.0), (0.5, 0.25), (1.0, 0.5)} <= set(outline)
    for lines, t in zip(view.ghosts, (0.4, 0.6), strict=True):
        assert ((t, 0.0), (t, pytest.approx(t * t))) in lines
        leaning = [end for line in lines for end in line if end[0] != t]
        assert leaning and all(y == pytest.approx(t * x) for x, y in leaning)
    for arrow in view.bounds:
        (x, y), (u, v) = arrow.at, arrow.velocity
        assert (u, v, arrow.weight) in (
            (1, 0, pytest.approx(-x - y)),
            (0, pytest.approx(x), pytest.approx(x * (x + y))),
        )
        assert 0 <= y <= 0.5 * x + 1e-15


def test_a_section_goes_through_the_middle_of_the_whole_range() -> None:
    """Of a tetrahedron at z = 1/2: what is left of it is x + y <= 1/2."""
    world = World()
    program = "def tetra(c) integral ([0, 1], [0, 1 - x], [0, 1 - x - y]) [x < c] d(x, y, z)"
    view = IntegralScene(world, world.put("tetra.po", program), "tetra", {}).look({"c": 0.25}, "c").view
    assert [(held.name, held.at) for held in view.held] == [("z", 0.5)]
    side = len(view.cells)
    seen = {
        (j / (side - 1), i / (side - 1)) for i, row in enumerate(view.cells) for j, cell in enumerate(row) if cell >= 0
    }
    assert max(x + y for x, y in seen) == pytest.approx(0.5)


INDEXED = r"""
def many(t) sum i in 2..4 (integral [0, 1] [x < t/i]*(i + x) d(x))
def nested(t) sum i in 2..3 (sum j in i..5 (integral [0, 1] [x < t/(i*j)] d(x)))
def listed(t) sum j in 0..3 ([integral [0, 1] [x < t/(i + 1)] d(x) for i in 0..3][j])
def pair(t) (sum i in 1..2 (integral [0, 1] [x < t/i] d(x))) + (sum i in 3..4 (integral [0, 1] [x < t/i] d(x)))
"""


@pytest.mark.parametrize(
    ("name", "given", "which", "indices", "tangent"),
    [  # the derivative of one summand by t, by hand
        ("many", {}, 0, {"i": 2}, (2 + 0.3 / 2) / 2),
        ("many", {"i": "3"}, 0, {"i": 3}, (3 + 0.3 / 3) / 3),
        ("many", {"i": "99"}, 0, {"i": 4}, (4 + 0.3 / 4) / 4),
        ("nested", {}, 0, {"i": 2, "j": 2}, 1 / 4),
        ("nested", {"i": "3", "j": "2"}, 0, {"i": 3, "j": 3}, 1 / 9),
        ("listed", {"i": "1"}, 0, {"i": 1}, 1 / 2),
        ("pair", {}, 1, {"i": 1, "i_": 3}, 1 / 3),
    ],
)
def test_of_an_integral_in_a_sum_one_summand_is_seen(
    name: str, given: dict[str, str], which: int, indices: dict[str, float], tangent: float
) -> None:
    world = World()
    scene = IntegralScene(world, world.put("program.po", INDEXED), name, {"t": "0.3", **given})
    assert scene.values == {"t": 0.3, **indices}
    assert scene.moving == "t"
    numbers = scene.look(scene.values, "t", which).numbers
    assert numbers is not None
    assert numbers.tangent == pytest.approx(tangent, abs=1e-13)  # roundings of a product
    with pytest.raises(PottoError, match="no number `i` to differentiate by"):
        scene.regions("i")


def test_an_index_goes_as_far_as_another_one_lets_it() -> None:
    world = World()
    scene = IntegralScene(world, world.put("program.po", INDEXED), "nested", {"t": "0.3"})
    assert scene.indices == {"i": (2, 2, 3), "j": (2, 2, 5)}
    assert scene.look({"t": 0.3, "i": 3, "j": 2}, "t").indices == {"i": (3, 2, 3), "j": (3, 3, 5)}


def test_of_a_definition_that_cannot_be_read_it_is_said_why() -> None:
    for broken, says in {
        "def f(t integral [0, 1] [x < t] d(x)": "never closed",
        "def f(t) integral [0, 1] [x < ] d(x)": "expected an expression after `<`",
        "def g(t) integral [0, 1] [x < t] * d(x)\ndef f(t) 2*g(t)": "`g` is broken by this; it is needed through `f`",
    }.items():
        world = World()
        with pytest.raises(PottoError, match=says):
            IntegralScene(world, world.put("program.po", broken + "\n"), "f", {})


def test_a_root_is_exact_also_while_something_is_dragged() -> None:
    """x^3 = t at the cube root of t, which gains (t^(1/3) + 1/2)/(3*t^(2/3)) there, both to a few roundings."""
    world = World()
    program = "def cube(t) integral [0, 1] [x^3 < t]*(x + 1/2) d(x)"
    scene = IntegralScene(world, world.put("cube.po", program), "cube", {})
    for t in (0.1, 0.37, 0.9):
        root = t ** (1 / 3)
        for quick in (True, False):
            (surface,) = scene.look({"t": t}, "t", quick=quick).view.surfaces
            assert abs(surface.arrows[0].at[0] - root) <= 4e-16
            assert surface.gain == pytest.approx((root + 0.5) / (3 * root**2), rel=4e-15, abs=0)
