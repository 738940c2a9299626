"""`D` and `grad`: derivatives that take plain numbers."""

from __future__ import annotations

import math

import pytest

import potto

PROGRAM = r"""
record Camera(eye: (Real, Real), focal: Real)

def f(t)
    integral [0, 1] [x < t] d(x)

def g(a, c)
    integral [0, 1] a*[x < c] d(x)

def h(cam: Camera, s)
    s*cam.focal^2 + 3*cam.eye.0*cam.eye.1

def weighted(xs: [n] Real, k)
    k*sum i in 0..n-1 ((i + 1)*xs[i]^2)

def renderer(c)(shader)
    integral [0, 1] shader(x)*[x < c] d(x)

def two(t)
    (t^2, 3*t)

def area(a, t)
    integral [0, 1] [x < t]*(x + a) d(x)

def shifted(t, a)
    integral [0, 1] [x < t + a]*x d(x)

def curried(a)(b)
    a^2*b^3

def scaled(xs: [n] Real, t)
    t*sum x in xs (x^2)

def seen(cam: Camera, t)
    cam.focal^2*cam.eye.0*t

def of(k, t)
    D(k)(t) + D(\x . x*t)(1)

def applied(shader, c)
    shader(c)

slope = D(f)
"""


@pytest.fixture(scope="module")
def program() -> potto.Module:
    return potto.compile(PROGRAM)


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("D(f)(0.3)", 1.0),
        ("slope(0.3)", 1.0),
        ("D(g, c)(3, 0.25)", 3.0),
        ("D(g, c)(c=0.25, a=3)", 3.0),
        ("grad(g)(3, 0.25)", (0.25, 3.0)),
        ("grad(g, c)(3, 0.25)", 3.0),
        ("grad(g, c, a)(3, 0.25)", (3.0, 0.25)),
        ("grad(f)(0.3)", 1.0),
        (r"D(\t . t^3)(2)", 12.0),
        (r"D(D(\t . t^3))(2)", 12.0),
        ("D(D(area))(2, 0.5)", 0.0),  # area is t^2/2 + a*t
        ("D(D(area, t), t)(2, 0.5)", 1.0),
        ("D(D(area, a), t)(2, 0.5)", 1.0),
        ("grad(D(area, t))(2, 0.5)", (1.0, 1.0)),
        ("D(grad(area), t)(2, 0.5)", (1.0, 1.0)),
        ("D(D(shifted))(0.3, 0.2)", 1.0),  # (t + a)^2/2
        ("D(D(D(curried, b), b), a)(2)(3)", 72.0),
        ("grad(D(curried, b))(2)(3)", (108.0, 72.0)),
        ("grad(D(scaled, t), xs)([1, 2], 3)[1]", 4.0),
        ("D(grad(scaled, xs), t)([1, 2], 3)[1]", 4.0),
        ("D(grad(seen, cam), t)(Camera((5, 7), 3), 2).focal", 30.0),
        (r"D([\(x, y) . x*y^2][0], y)(2, 3)", 12.0),
        (r"D(grad(\(x, y) . x*y^2), y)(2, 3)", (6.0, 4.0)),
        (r"D(if 1 > 0 then \(x, y) . x^3*y else \(x, y) . y, y)(2, 3)", 8.0),
        ("D(sin)(0)", 1.0),
        ("D(two)(3)", (6.0, 3.0)),
        ("grad(h, cam)(Camera((5, 7), 3), 2).focal", 12.0),
        ("grad(h, cam)(Camera((5, 7), 3), 2).eye", (21.0, 15.0)),
        ("grad(h, s)(Camera((5, 7), 3), 2)", 9.0),
        ("D(weighted, k)([1, 2, 3], 2)", 36.0),
        ("grad(weighted, xs)([1, 2, 3], 2)[1]", 16.0),
        (r"D(renderer)(0.5)(\x . x^2)", 0.25),
        (r"grad(renderer)(0.5)(\x . x^2)", 0.25),
        (r"of(\x . x^2, 3)", 9.0),
        ("grad(applied)(sin, 0)", 1.0),
        (r"let q = \(a, b) . a*b^2 in grad(q, b)(2, 3)", 12.0),
        (r"let q = \(a, b) . a*b^2; r = D(q, a) in r(2, 3)", 9.0),
        (r"integral [0, 1] D(\t . t^2)(x) d(x)", 1.0),
        (r"D(\s . f(s)^2)(0.25)", 0.5),
        ("let D = 2 in D*D", 4.0),
    ],
)
def test_derivatives_of_plain_numbers(program: potto.Module, expression: str, expected: float) -> None:
    found = program.eval(expression)
    assert found.value == pytest.approx(expected, rel=1e-9, abs=1e-12)


def test_all_derivatives_of_a_function_of_an_array(program: potto.Module) -> None:
    slopes, by_k = program.eval("grad(weighted)([1, 2, 3], 2)").value
    assert list(slopes) == pytest.approx([4, 16, 36]) and by_k == pytest.approx(36)


def test_it_agrees_with_the_dual_of_the_paper(program: potto.Module) -> None:
    for t in (-0.5, 0.2, 0.8, 1.5):
        assert program.eval(f"D(f)({t})").value == program.eval(f"snd(deriv(f)(({t}, 1)))").value


def test_a_derivative_is_a_function_of_python(program: potto.Module) -> None:
    slope = potto.compile("def f(t) integral [0, inf] exp(-x)*[x < t^2] d(x)\ns = D(f)").s
    assert slope.type == "(t: Real) -> Real"
    assert float(slope(0.5)) == pytest.approx(math.exp(-0.25) * 1.0, rel=1e-9)


@pytest.mark.parametrize(
    ("expression", "code", "told"),
    [
        ("D(g, d)(1, 2)", "P0310", "no parameter `d`"),
        ("D(g, 2)(1, 2)", "P0310", "the name of a parameter"),
        ("D(applied, shader)(sin, 2)", "P0306", "`shader` is a function"),
        ("D(applied)(sin, 2)", "P0306", "`shader` is a function"),
        ("D(3)", "P0307", "takes a function"),
        ("D(f(1))", "P0307", "takes a function"),
        ("D(g, a, c)(1, 2)", "P0308", "one parameter"),
        ("D(h)(Camera((1, 2), 3), 1)", "P0306", "differentiates by one number"),
        ("grad(two)(1)", "P0306", "gives one number"),
        ("D()", "P0309", "takes a function"),
        ("D", "P0323", "not a function that can be passed on"),
    ],
)
def test_misuse_is_told_where_it_is(program: potto.Module, expression: str, code: str, told: str) -> None:
    with pytest.raises(potto.PottoError) as caught:
        program.eval(expression)
    first = caught.value.diagnostics[0]
    assert first.code == code and told in first.message


def test_a_name_that_is_nearly_right_is_offered() -> None:
    m = potto.compile("def disc(radius, x) radius*x")
    with pytest.raises(potto.PottoError) as caught:
        m.eval("D(disc, raduis)(1, 2)")
    assert caught.value.diagnostics[0].help == "did you mean `radius`?"
