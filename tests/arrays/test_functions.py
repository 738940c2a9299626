"""Functions in arrays, tuples and records, and chosen by plain conditions."""

from __future__ import annotations

import math

import numpy as np
import pytest

import potto

MODULE = potto.compile(r"""
shapes = [\x . x, \x . x^2, \x . [x < 0.5]]
def at(i, x) shapes[i](x)
def all_of(x) [s(x) for s in shapes]
def scene(t) integral [0, 1] sum s in shapes (s(x*t)) d(x)
def picked(i, t) integral [0, 1] shapes[i](x*t) d(x)
def chosen(p, t) integral [0, 1] (if p > 0 then sin else cos)(x*t) d(x)
record Light(shader: Real -> Real, power: Real)
lamp = Light(shader=\x . x^2, power=2)
def lit(l: Light, t) integral [0, 1] l.power*l.shader(x*t) d(x)
pair = (\x . 3*x, 5)
def part(t) pair.0(t) + pair.1
""")
T = 0.8
EXACT = [T / 2, T**2 / 3, min(1, 0.5 / T)]


def test_elements_that_are_functions() -> None:
    assert [MODULE.at(i, 3).value for i in range(3)] == [3, 9, 0]
    assert MODULE.at(np.array([0.0, 1, 2, 1]), np.array([3.0, 3, 0.25, 4])).value.tolist() == [3, 9, 1, 16]
    assert MODULE.all_of(0.25).value.tolist() == [0.25, 0.0625, 1]
    assert potto.grad(MODULE.at, "x")(1.0, 3.0).tangent == 6


def test_functions_of_an_array_under_an_integral() -> None:
    found = potto.grad(MODULE.scene)(T)
    assert found.value == pytest.approx(sum(EXACT), rel=1e-13)
    assert found.tangent == pytest.approx(1 / 2 + 2 * T / 3 - 0.5 / T**2, rel=1e-12)
    for number, exact in enumerate(EXACT):
        assert MODULE.picked(number, T).value == pytest.approx(exact, rel=1e-13)
    assert MODULE.picked(np.array([0.0, 2, 1]), T).value == pytest.approx([EXACT[i] for i in (0, 2, 1)], rel=1e-13)
    with pytest.raises(potto.PottoError, match="out of range"):
        MODULE.picked(3, T)


def test_functions_chosen_by_a_plain_condition() -> None:
    assert MODULE.chosen(1, T).value == pytest.approx((1 - math.cos(T)) / T, rel=1e-13)
    assert MODULE.chosen(-1, T).value == pytest.approx(math.sin(T) / T, rel=1e-13)
    slope = potto.grad(MODULE.chosen, "t")(-1.0, T).tangent
    assert slope == pytest.approx(math.cos(T) / T - math.sin(T) / T**2, rel=1e-12)


def test_functions_in_records_and_tuples() -> None:
    module_of_lamp = MODULE.eval("lit(lamp, 0.8)")
    assert module_of_lamp.value == pytest.approx(2 * EXACT[1], rel=1e-13)
    assert MODULE.part(2).value == 11


def test_a_condition_that_varies_chooses_between_numbers() -> None:
    with pytest.raises(potto.PottoError, match="P0313"):
        potto.compile("def f(t) integral [0, 1] (if [x < t] then sin else cos)(x) d(x)")


SCENE = potto.compile(r"""
record Shape(r: Real, shade: Real -> Real)
def unit(x) 1
def ramp(x) x
def below(k) \x . [x < k]
def one(s: Shape, t) integral [0, 1] s.shade(x)*[x < s.r*t] d(x)
def apart(shapes: [n] Shape, t) sum s in shapes (integral [0, 1] s.shade(x)*[x < s.r*t] d(x))
def under(shapes: [n] Shape, t) integral [0, 1] sum s in shapes (s.shade(x)*[x < s.r*t]) d(x)
def colour(shapes: [n] Shape, t) sum s in shapes (s.shade(t)*s.r)
def of_each(fs: [n] (Real* -> Real*), t) sum f in fs (integral [0, 1] f(x)*[x < t] d(x))
def at(fs: [n] (Real* -> Real*), i, t) integral [0, 1] fs[i](x)*[x < t] d(x)
scene = [Shape(r=0.5, shade=unit), Shape(r=0.25, shade=ramp), Shape(r=0.8, shade=below(0.3))]
row = [Shape(r=(i + 1)/4, shade=\x . x*i) for i in 0..3]
def thresholds(ks: [n] Real) apart([Shape(r=1, shade=below(k)) for k in ks], 1)
""")


@pytest.mark.parametrize("name", ["apart", "under"])
def test_a_scene_is_a_list_of_shapes_with_shaders(name: str) -> None:
    """At t = 1: 0.5 + 0.25^2/2 + 0.3; by t, 0.5*1 + 0.25*0.25, and nothing by the third, whose shader ends before."""
    assert SCENE.eval(f"{name}(scene, 1)").value == pytest.approx(0.83125, rel=1e-13)
    assert SCENE.eval(f"D({name}, t)(scene, 1)").value == pytest.approx(0.5625, rel=1e-12)
    assert SCENE.eval(f"grad({name})(scene, 0.25)").value == pytest.approx(0.5 + 0.0625 / 4 + 0.8, rel=1e-12)


def test_functions_of_one_lambda_differ_by_what_they_have_captured() -> None:
    """With r = (i + 1)/4 and the shader i*x: the sum of i*r^2/2, and by t (at 1/2, where nothing meets) of i*r^2/2."""
    radii = np.arange(1, 5) / 4
    exact = float((np.arange(4) * radii**2 / 2).sum())
    assert SCENE.eval("apart(row, 1)").value == pytest.approx(exact, rel=1e-13)
    assert SCENE.eval("D(apart, t)(row, 0.5)").value == pytest.approx(exact, rel=1e-12)
    assert SCENE.eval("colour(row, 2)").value == 2 * float((np.arange(4) * radii).sum())
    assert SCENE.eval("grad(thresholds)([0.1, 0.7, 0.3])").value == pytest.approx([1, 1, 1], rel=1e-12)


def test_members_of_a_batch_choose_functions_with_surfaces_of_their_own() -> None:
    assert SCENE.eval("of_each([unit, ramp, below(0.3)], 0.5)").value == pytest.approx(0.5 + 0.125 + 0.3, rel=1e-13)
    functions = [SCENE.unit, SCENE.ramp]
    found = SCENE.at(functions, np.array([0.0, 1, 1, 0]), np.array([0.5, 0.5, 1, 1]))
    assert found.value == pytest.approx([0.5, 0.125, 0.5, 1], rel=1e-13)
    assert SCENE.eval("D(of_each, t)([unit, ramp, below(0.3)], 0.2)").value == pytest.approx(2.2, rel=1e-12)


def test_what_holds_a_function_rests() -> None:
    assert SCENE.eval("D(one, t)(scene[1], 1)").value == pytest.approx(0.0625, rel=1e-12)
    with pytest.raises(potto.PottoError, match="`s` holds a function"):
        SCENE.eval("grad(one, s)(scene[0], 1)")
    with pytest.raises(potto.PottoError, match="a second derivative stops at a tuple, record or array"):
        SCENE.eval(r"D(\t . D(one, t)(scene[0], t))(1)")


@pytest.mark.parametrize("place", ["1", "1 - i"])
def test_a_function_of_an_array_is_called_on_one_side_of_a_plain_condition(place: str) -> None:
    """Under an integral it is found beside it, where it is needed: at t = 1/2 not, at 1/4 for t^2."""
    module = potto.compile(rf"""
square = \u . u*u
def g(fs: [n] (Real* -> Real), t) sum i in 0..0 (integral [0, 1] (if [t >= 0.5] then x else fs[{place}](t)) d(x))
def f(t) g([sin, square], t)
""")
    assert module.f(0.5).value == pytest.approx(0.5, rel=1e-13)
    assert module.f(0.25).value == pytest.approx(1 / 16, rel=1e-13)


HOLDERS = potto.compile("""
record P(w: Real, f: Real -> Real)
def weighed(p: P, t) p.w*p.f(t)
def both(fs: (Real -> Real, Real -> Real), t) fs.0(t) + fs.1(2*t)
def total(fs: [n] (Real -> Real), t) sum f in fs (f(t))
def square(x) x^2
def wave(x) sin(x)
""")


def test_what_holds_functions_is_given_to_a_derivative_as_it_is() -> None:
    m = HOLDERS
    for p in ((2.0, m.square), ((2.0, 0.0), potto.deriv(m.square))):
        found = potto.deriv(m.weighed)(p, (3.0, 1.0))
        assert (found.value, found.tangent) == (18.0, 12.0)
    assert abs(potto.deriv(m.both)((m.square, m.wave), (0.5, 1.0)).tangent - (1 + 2 * math.cos(1))) < 1e-14
    assert abs(potto.deriv(m.total)([m.square, m.wave], (0.5, 1.0)).tangent - (1 + math.cos(0.5))) < 1e-14


def test_an_answer_that_holds_functions_is_no_argument() -> None:
    with pytest.raises(potto.PottoError, match="`p` holds functions"):
        HOLDERS.weighed(HOLDERS.P(2.0, HOLDERS.square), 3.0)


CHOOSING = r"""
record Disc(r: Real, shade: Real -> Real)
def flat(u) 1
def twice(u) 2*u
def above(k) \u . [u > k]
def light(t) sum f in [if i == 1 then flat else above(t*i) for i in 0..2] (integral [0, 1] f(u) d(u))
def discs(t) [if i == 1 then Disc(r=0.5, shade=flat) else Disc(r=t, shade=above(0.1*i)) for i in 0..2]
def seen(t) sum d in discs(t) (integral [0, 1] d.shade(u)*[u < d.r] d(u))
rows = [if i == 1 then [flat, twice] else [twice, above(0.1*i)] for i in 0..2]
def total(t) sum row in rows (row[0](t) + row[1](t/2))
names = [if i == 1 then flat else twice for i in 0..2]
def product(t) sum f in names (f(t))
"""


def test_elements_choose_functions_by_their_places() -> None:
    """Records and rows of functions as well, with what they have captured: one by one, as a batch, and derived."""
    module = potto.compile(CHOOSING)
    t = np.array([0.3, 0.4])
    for name, exact, slope in (
        ("light", 3 - 2 * t, [-2, -2]),  # (1 - 0) + 1 + (1 - 2t)
        ("seen", t + 0.5 + (t - 0.2), [2, 2]),
        ("total", 2 * t + 1 + (1 + t) + 2 * t + 0, [5, 5]),  # t/2 > 0, but not > 0.2
        ("product", 2 * t + 1 + 2 * t, [4, 4]),
    ):
        function = getattr(module, name)
        assert function(t).value == pytest.approx(exact, rel=1e-14), name
        assert potto.grad(function)(t).tangent == pytest.approx(slope, rel=1e-13), name
        for one, value in zip(t, exact, strict=True):
            assert function(float(one)).value == pytest.approx(value, rel=1e-14), name
            assert potto.vjp(function, 1.0)(float(one)).tangent == pytest.approx(slope[0], rel=1e-13), name
