"""Tuples and records given to derivatives without tangents: they stand still, as numbers do."""

from __future__ import annotations

import math

import numpy as np
import pytest
from marks import check

import potto
from potto.evaluating.world import World

PROGRAM = """
record P(x: Real, y: Real)
record M(xs: [n] Real, p: P)
def f(u: (Real, Real), t) u.x*t^2 + u.y
def h(p: P, t) p.x*t
def nested(u: (Real, (Real, Real)), t) u.0*t + u.1.y
def mesh(s: M, t) s.xs[1]*t + s.p.y*t
def swapped(t)(u: (Real, Real)) u.x*t^2
def inside(u: (Real, Real), t) integral [0, 1] [x < u.x*t]*u.y d(x)
df = deriv(f)
pair = (1, 2)
def make(a) P(a, 2*a)
def within(u: (Real, Real), t) snd(df(u, (t, 1)))
"""


@pytest.mark.parametrize(
    ("text", "value", "tangent"),
    [
        ("deriv(f)((1, 2), (3, 1))", 11, 6),
        ("deriv(f)(((1, 2), (0, 0)), (3, 1))", 11, 6),  # the same, with tangents
        ("deriv(f)(((1, 1), (2, 0)), (3, 1))", 10, 2 * 9 + 6),
        ("deriv(f)(dt=(3, 1), du=pair)", 11, 6),
        ("df((1, 2), (3, 1))", 11, 6),
        ("let q = (1, 2) in df(q, (3, 1))", 11, 6),
        ("deriv(h)(P(1, 2), (3, 1))", 3, 1),
        ("deriv(h)(make(2), (3, 1))", 6, 2),
        ("deriv(h)(make(2) with x = 5, (3, 1))", 15, 5),
        ("deriv(nested)((1, (2, 3)), (3, 1))", 6, 1),
        ("deriv(mesh)(M([1, 2], P(3, 4)), (5, 1))", 30, 6),
        ("deriv(swapped)((3, 1))((1, 2))", 9, 6),
        ("deriv(inside)((0.5, 2), (0.5, 1))", 0.5, 1),  # the surface x = u.x t moves by u.x, the jump is u.y
        ("(1, within((1, 2), 3))", 1, 6),
    ],
)
def test_what_stands_still(text: str, value: float, tangent: float) -> None:
    world = World()
    key = world.put("<text>", PROGRAM)
    found = world.evaluate(key, text).estimate
    whole = found.value if found.tangent is None else (found.value, found.tangent)
    assert whole == pytest.approx((value, tangent), rel=1e-12)


HOLDERS = """
record P(w: Real, f: Real -> Real)
square = \\x . x*x
step = \\y . [y > 0.5]
id = \\x . x
unit = \\x . 1
def both(fs: (Real -> Real, Real -> Real), t) fs.0(t) + fs.1(t)
def h(p: P, t) p.w*t + (p.f)(t)
def g(q: (Real, Real -> Real), t) fst q*t + (snd q)(t)
def two(fs: [2] (Real -> Real), t) (fs[0])(t) + t*(fs[1])(t)
def all(ps: [n] P, t) sum p in ps ((p.f)(t*p.w))
def on(p: P, t) 3*h(p, t)
def chosen(p: P, a, t) (if a > 0 then p.f else square)(t)
def apply(f: Real -> Real, t) f(t)
def handed(f: Real -> Real, t) 2*apply(f, t)
one = P(1, step)
scene = [P(1, step), P(2, step)]
"""


@pytest.mark.parametrize(
    ("text", "value", "tangent"),
    [
        ("deriv(h)(P(w=3, f=square), (2, 1))", 10, 7),
        ("deriv(h)(P(3, square) with w = 4, (2, 1))", 12, 8),
        ("deriv(g)((3, square), (2, 1))", 10, 7),
        ("deriv(g)(((3, 1), deriv(square)), (2, 1))", 10, 9),
        ("deriv(h)(P(w=(3, 1), f=deriv(square)), (2, 1))", 10, 9),
        ("deriv(h)(P(w=3, f=deriv(square)), (2, 1))", 10, 7),
        ("deriv(h)(P((3, 1), deriv(square)) with w = (4, 0), (2, 1))", 12, 8),
        ("deriv(two)([square, square], (2, 1))", 12, 16),
        ("deriv(two)([sqrt, square], (4, 1))", 66, 48.25),
        ("deriv(two)([unit, id], (4, 1))", 17, 8),  # of any type: functions of numbers as well as of duals
        ("deriv(both)((id, square), (4, 1))", 20, 9),
        ("deriv(both)((square, unit), (4, 1))", 17, 8),
        ("deriv(all)([P(1, square), P(2, square)], (2, 1))", 20, 20),
        ("deriv(all)([P((1, 1), deriv(square)), P((2, 0), deriv(square))], (2, 1))", 20, 28),
        ("deriv(all)([((1, 1), deriv(square)), ((2, 0), deriv(square))], (2, 1))", 20, 28),
    ],
)
def test_functions_in_what_stands_still_are_derived(text: str, value: float, tangent: float) -> None:
    world = World()
    found = world.evaluate(world.put("<text>", HOLDERS), text).estimate
    assert (found.value, found.tangent) == pytest.approx((value, tangent), rel=1e-12)


# At t = 2 and y = x t the step jumps where x = 1/4: its delta gives x/|dy/dx| = 1/8.
@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("snd(deriv(h)(one, (x*t, x)))", 1 / 2 + 1 / 8),
        ("snd(deriv(h)(P(x, step), (x*t, x)))", 1 / 3 + 1 / 8),
        ("D(h, t)(P(x, step), x*t)*x", 1 / 3 + 1 / 8),
        ("snd(deriv(g)(((1, 0), deriv(step)), (x*t, x)))", 1 / 2 + 1 / 8),
        ("snd(deriv(two)([step, step], (x*t, x)))", 1 / 8 + (1 - 1 / 16) / 2 + 1 / 16),
        ("snd(deriv(all)(scene, (x*t, x)))", 1 / 8 + 1 / 16),
        ("snd(deriv(all)([P(x, step), P(2, step)], (x*t, x)))", 1 / 8 + 1 / 16),  # of x^2 t, at 1/2: x^2/(2 x t)
        ("D(all, t)([P(1, step), P(2, sin)], x*t)*x", 1 / 8 + (4 * math.sin(4) + math.cos(4) - 1) / 8),
        ("snd(deriv(on)(one, (x*t, x)))", 3 * (1 / 2 + 1 / 8)),
        ("D(on, t)(one, x*t)*x", 3 * (1 / 2 + 1 / 8)),
        ("snd(deriv(chosen)(one, 1, (x*t, x)))", 1 / 8),
        ("snd(deriv(handed)(deriv(step), (x*t, x)))", 2 / 8),
    ],
)
def test_jumps_of_functions_that_are_held_or_handed_on_count_under_an_integral(text: str, value: float) -> None:
    module = potto.compile(f"{HOLDERS}def f(t) integral [0, 1] {text} d(x)")
    assert module.f(2.0).value == pytest.approx(value, rel=1e-12, abs=0)


def test_from_python() -> None:
    m = potto.compile(PROGRAM)
    for u in ((1.0, 2.0), ((1.0, 2.0), (0.0, 0.0))):
        found = potto.deriv(m.f)(u, (3.0, 1.0))
        assert (found.value, found.tangent) == pytest.approx((11, 6))
    for p in ({"x": 1.0, "y": 2.0}, (1.0, 2.0)):
        assert potto.deriv(m.h)(p, (3.0, 1.0)).tangent == pytest.approx(1)
    scene = {"xs": np.array([1.0, 2.0]), "p": (3.0, 4.0)}
    assert potto.deriv(m.mesh)(scene, (5.0, 1.0)).tangent == pytest.approx(6)


def test_records_that_hold_functions_are_dicts_from_python() -> None:
    m = potto.compile(HOLDERS)
    dh, df = potto.deriv(m.h), potto.deriv(m.square)
    assert dh.type.startswith("(dp: D P, dt:")
    for p, tangent in (({"w": 3.0, "f": m.square}, 7), ({"f": df, "w": (3.0, 1.0)}, 9), (((3.0, 1.0), df), 9)):
        found = dh(p, (2.0, 1.0))
        assert (found.value, found.tangent) == (10, tangent)
    with pytest.raises(potto.PottoError, match=r"`dp.f` is .*: a function is needed, not a tuple of 2"):
        dh(((3.0, m.square), (1.0, df)), (2.0, 1.0))
    with pytest.raises(potto.PottoError, match="`dp` is D P, but what is given has no `f` and has `g`"):
        dh({"w": 3.0, "g": m.square}, (2.0, 1.0))


def test_a_dual_as_a_whole_of_what_holds_functions() -> None:
    check("""
        record P(w: Real, f: Real -> Real)
        def h(p: P, t) p.w*t + (p.f)(t)
        k = deriv(h)((P(1, sqrt), P(0, deriv(sqrt))), (2, 1))
        #            ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^ error[P0306]: must be `D P`, but this is `(P, D P)`
    """)


def test_where_nobody_can_tell() -> None:
    check("""
        def f(u: (Real, Real), t) u.x*t + u.y
        def g(us: [n] (Real, Real), t) sum u in us (snd(deriv(f)(u, (t, 1))))
        #                                                        ^ error[P0306]: `du` of `deriv` must be
        def by_hand(a: ((Real, Real), (Real, Real))) a.0.x + a.1.y
        h = by_hand((1, 2))
        #           ^^^^^^ error[P0306]: must be `((Real, Real), (Real, Real))`
    """)


def test_what_varies_in_what_stands_still_counts() -> None:
    check("""
        def plain(u: (Real*, Real), t) if u.y > 0 then u.x*t else t
        def f(t) integral [0, 1] snd(deriv(plain)((t, x), (t, 1))) d(x)
        #                                         ^^^^^^ error[P0301]: depends on the variable of integration
        def g(t) integral [0, 1] snd(deriv(plain)((x, t), (t, 1))) d(x)
    """)


def test_nothing_moves() -> None:
    check("""
        def f(u: (Real, Real), t) u.x*t + u.y
        k = deriv(f)((1, 2), 3)
        #            ^^^^^^ warning[P0615]: no argument of this derivative has a tangent
    """)


@pytest.mark.parametrize("call", [
    "deriv(h)((P(1, square), P(0, deriv(square))), (2, 1))",
    "deriv(all)(([P(1, square)], [P(0, deriv(square))]), (2, 1))",
])  # fmt: skip
def test_what_to_write_for_it(call: str) -> None:
    with pytest.raises(potto.PottoError) as told:
        potto.compile(HOLDERS).eval(call)
    assert "`(value, tangent)` for a number, `deriv(f)` for a function" in told.value.diagnostics[0].help
