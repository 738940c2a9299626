"""Deltas of derivatives under an integral, where the function has an integral whose tangent has no closed form.

H(y) is the length of [exp(z) + z - 1 > y] in [0, 1], 1 - Z(y) for Z(y) = y + 1 - W(exp(y + 1)) with Lambert's W.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import mpmath
import pytest

import potto
from potto.calculus.inlining import unrolled

PROGRAM = """
def over(y, a) [y > a]
def H(y) integral [0, 1] [exp(z) + z - 1 > y] d(z)
def mixed(y, a) [y > a]*(1 + H(y))
def inside(y, a) integral [0, 1] (if [y > a] then [exp(z) + z - 1 > y] else z) d(z)
def edge(y, a) [y > H(a)]
def pair(y, a) ([y > a]*H(y), 3*[y > 2*a])
def points(p, q) [fst(p) + fst(q) > 1]*H(snd(p))
def curried(c)(y) [y > c]*H(y)
dmixed = deriv(mixed)
renamed = dmixed
def use(k, a) integral [0, 1] k(x, a) d(x)
def deriving(k, a) integral [0, 1] x*snd(deriv(k)((x, 0), (a, 1))) d(x)
def given(k, a) integral [0, 1] x*snd(k((x, 0), (a, 1))) d(x)
def app(k, y) k(y)
def times(k, y, a) k(y)*[y > a]*H(y)
def dual(p, a) integral [0, 1] snd(deriv(mixed)((x, 0), p)) d(x)
"""


def h(y: mpmath.mpf) -> mpmath.mpf:
    return mpmath.mpf(1) - (y + 1 - mpmath.lambertw(mpmath.exp(y + 1)).real)


def slope(y: mpmath.mpf) -> mpmath.mpf:
    z = 1 - h(y)
    return -1 / (mpmath.exp(z) + 1)


A = mpmath.mpf("0.4")
M = -(1 + h(A))  # the integral over [0, 1] of the tangent of `mixed` along a
SHIFTED: list[tuple[str, Callable[[], mpmath.mpf]]] = [
    ("integral [0, 1] snd(deriv(mixed)((x, 0), (a, 1))) d(x)", lambda: M),
    ("integral [0, 1] snd(dmixed((x, 0), (a, 1))) d(x)", lambda: M),
    ("integral [0, 1] snd(renamed((x, 0), (a, 1))) d(x)", lambda: M),
    ("integral [0, 1] snd(deriv(mixed)((x, 1), (a, 0))) d(x)", lambda: 1 + h(1)),  # mixed(1) - mixed(0)
    ("integral [0, 1] snd(deriv(mixed)((2*x, x), (a, 0))) d(x)",
     lambda: (1 + h(A))*A/4 + mpmath.quad(lambda y: slope(y)*y/4, [A, 2])),
    ("integral [0, 1] snd(deriv(inside)((x, 0), (a, 1))) d(x)", lambda: 0.5 - h(A)),
    ("integral [0, 1] snd(deriv(edge)((x, 0), (a, 1))) d(x)", lambda: -slope(A)),
    ("integral [0, 1] (let (v, w) = deriv(pair)((x, 0), (a, 1)) in fst(w) + 2*snd(w)) d(x)", lambda: -h(A) - 12),
    ("integral ([0, 1], [0, 1]) snd(deriv(points)(((x, y), (0, 0)), ((a, a), (1, 0)))) d(x, y)",
     lambda: mpmath.quad(h, [0, 1])),
    ("integral [0, 1] snd(deriv(curried)((a, 1))((x, 0))) d(x)", lambda: -h(A)),
    ("integral [0, 1] (if [x > 0.3] then snd(deriv(mixed)((x, 0), (a, 1))) else 2) d(x)", lambda: M + 0.6),
    ("integral [0, 1] (integral [0, x] snd(deriv(mixed)((x, 0), (a, 1)))*y d(y)) d(x)", lambda: M*A**2/2),
    ("integral [0, 1] (integral [0, x] snd(deriv(mixed)((z, 0), (a, 1))) d(z)) d(x)", lambda: M*(1 - A)),
    ("integral [0, 1] exp(integral [0, x] snd(deriv(mixed)((z, 0), (a, 1))) d(z)) d(x)",
     lambda: A + (1 - A)*mpmath.exp(M)),  # no linear matter, but the inner integral is
    ("integral (x ~ normal(0, 1)) snd(deriv(mixed)((x, 0), (a, 1))) d(x)", lambda: M*mpmath.npdf(A)),
    ("integral [0, 1] (sum i in 1..3 (snd(deriv(mixed)((i*x, 0), (a, 1))))) d(x)", lambda: M*mpmath.mpf(11)/6),
    (r"use(\(y, b) . snd(deriv(mixed)((y, 0), (b, 1))), a)", lambda: M),
    (r"use(\(y, b) . integral [0, y] snd(deriv(mixed)((z, 0), (b, 1))) d(z), a)", lambda: M*(1 - A)),
    ("deriving(mixed, a)", lambda: M*A),
    ("given(deriv(mixed), a)", lambda: M*A),
    ("given(renamed, a)", lambda: M*A),
    (r"integral [0, 1] snd(deriv(app)(deriv(\y . [y > a]*H(y)), (x, 1))) d(x)", lambda: h(1)),
    (r"integral [0, 1] snd(deriv(times)(\p . (fst(p)^2, 2*fst(p)*snd(p)), (x, 1), (a, 1))) d(x)",
     lambda: h(1) - A**2*h(A)),
    ("dual((a, 2), a)", lambda: 2*M),
    ("integral [0, 1] (snd(deriv(H)((x, 1))))^2 d(x)", lambda: mpmath.quad(lambda y: slope(y)**2, [0, 1])),
    ("integral [0, 1] (snd(deriv(H)((x, 1)))^2 + snd(deriv(mixed)((x, 0), (a, 1)))) d(x)",
     lambda: mpmath.quad(lambda y: slope(y)**2, [0, 1]) + M),
]  # fmt: skip


@pytest.mark.parametrize(("program", "expected"), SHIFTED, ids=[program for program, _ in SHIFTED])
def test_the_deltas_count(program: str, expected: Callable[[], mpmath.mpf]) -> None:
    got = potto.compile(f"{PROGRAM}def f(a) {program}\n").f(0.4)
    assert abs(got.value - expected()) <= 1e-14 + got.error and got.error <= 1e-11


@pytest.mark.parametrize(
    ("program", "expected"),
    [
        # -M(a) for M = 1 + H: differentiated once more by the closed form of the jump
        ("integral [0, 1] snd(deriv(mixed)((x, 0), (a, 1))) d(x)", lambda: -slope(A)),
        ("deriving(mixed, a)", lambda: M - A*slope(A)),
        (r"use(\(y, b) . integral [0, y] snd(deriv(mixed)((z, 0), (b, 1))) d(z), a)", lambda: -M - (1 - A)*slope(A)),
    ],
)  # fmt: skip
def test_they_are_differentiated_in_their_turn(program: str, expected: Callable[[], mpmath.mpf]) -> None:
    got = potto.deriv(potto.compile(f"{PROGRAM}def f(a) {program}\n").f)((0.4, 1.0))
    assert abs(got.tangent - expected()) <= 1e-14 + got.tangent_error and got.tangent_error <= 1e-11


def test_deltas_of_second_derivatives_count() -> None:
    """The second derivative of [x > a] is the derivative of a delta, that of abs(x) is 2 delta(x)."""
    m = potto.compile(r"""
step = \y . [y > 0]
def bend(y) abs(y)
def slope(y) snd(deriv(bend)((y, 1)))
def f(a) integral [-1, 1] x^2*snd(snd(deriv(deriv(step))(((x - a, 1), (1, 0))))) d(x)
def g(a) integral [-1, 1] (x + 3)*snd(snd(deriv(deriv(bend))(((x - a, 1), (1, 0))))) d(x)
def k(a) integral [-1, 1] (x + 3)*snd(deriv(slope)((x - a, 1))) d(x)
""")
    for function, value, tangent in ((m.f, -0.8, -2), (m.g, 6.8, 2), (m.k, 6.8, 2)):
        got = potto.deriv(function)((0.4, 1.0))
        assert abs(function(0.4).value - value) <= 1e-14
        assert abs(got.value - value) <= 1e-14 and abs(got.tangent - tangent) <= 1e-13


def test_what_a_function_under_two_derivatives_has_captured_moves() -> None:
    m = potto.compile(r"def f(t) snd(deriv(\s . s^2*t^3)((2, 1)))")
    got = potto.deriv(potto.deriv(m.f))(((1.5, 1.0), (1.0, 0.0)))
    assert got.value == (13.5, 27.0) and got.tangent == (27.0, 36.0)  # of 4 t^3


RECURSION = """
def often(n, y, a) if n > 0 then often(n - 1, y, a) + snd(deriv(mixed)((y, 0), (a, 1))) else 0
def total(n, a) integral [0, 1] often(n, x, a) d(x)
"""


def test_a_recursion_shows_its_deltas_once_it_is_written_out() -> None:
    m = potto.compile(f"{PROGRAM}{RECURSION}def f(a) total(2, a)")
    got = potto.deriv(m.f)((0.4, 1.0))
    assert abs(got.value - 2 * M) <= 1e-14 + got.error and got.error <= 1e-11
    assert abs(got.tangent + 2 * slope(A)) <= 1e-14 + got.tangent_error and got.tangent_error <= 1e-11


def test_what_is_not_seen_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    m = potto.compile(PROGRAM + RECURSION)
    deep = m.total(500, 0.4)
    assert abs(deep.value - 500 * M) <= deep.error <= 1e-10
    monkeypatch.setattr(unrolled, "MOST_CALLS", 400)
    m = potto.compile(PROGRAM + RECURSION)
    for call in (lambda: m.total(500, 0.4), lambda: potto.hessian(m.total, ["a"])(2, 0.4)):
        with pytest.raises(potto.PottoError) as caught:
            call()
        assert [d.code for d in caught.value.diagnostics] == ["P0510"]


def test_a_tangent_that_jumps_is_cut_where_it_jumps() -> None:
    """The tangent of G along a is -c/y [y > c a]: integrated over y with y it is -c (1 - c a), whose slope is c^2."""
    m = potto.compile("""
def G(y, a) integral [0, 1] [z*y > 0.59*a] d(z)
def f(a) integral [0, 1] x*snd(deriv(G)((x, 0), (a, 1))) d(x)
def g(a) integral [0, 1] x*snd(deriv(G)((x, x - 0.64), (a, 1))) d(x)
""")
    got = potto.deriv(m.f)((0.3437, 1.0))
    assert abs(got.value + 0.59 * (1 - 0.59 * 0.3437)) <= 1e-15 and abs(got.tangent - 0.59**2) <= 1e-14
    # Along y - 0.64 as well: c a/y^2 more of it, times y (y - 0.64), from c a on.
    exact = mpmath.diff(lambda a: mpmath.quad(lambda y: -0.59 + 0.59 * a * (y - 0.64) / y, [0.59 * a, 1]), 0.3437)
    got = potto.deriv(m.g)((0.3437, 1.0))
    assert abs(got.tangent - exact) <= 1e-12 + got.tangent_error and got.tangent_error <= 1e-11


def test_a_delta_where_its_factor_jumps_has_no_meaning() -> None:
    m = potto.compile(
        PROGRAM
        + """
def f(a) integral [0, 1] (if [x > a] then x else 0)*snd(deriv(mixed)((x, 0), (a, 1))) d(x)
def bend(a) integral [0, 1] abs(x - a)*snd(deriv(mixed)((x, 0), (a, 1))) d(x)
def rim(a) integral [0, 1] snd(deriv(mixed)((x, 0), (a, 1))) d(x)
"""
    )
    with pytest.raises(potto.PottoError) as caught:
        m.f(0.4)
    assert [d.code for d in caught.value.diagnostics] == ["P0505"]
    assert m.bend(0.4).value == 0  # a bend is no jump
    (note,) = m.rim(0.0).notes  # on the very edge of the domain there is none of it, and the sides differ
    assert m.rim(0.0).value == 0 and note.surface == "x = a"
    assert abs(note.backward) <= 1e-14 and abs(note.forward + 2) <= 1e-13


@pytest.mark.parametrize(
    ("region", "at", "area", "rate"),
    (
        # on the unit sphere each region is the cap x < h, of area 2 pi (1 + h), and the delta of its square is half
        ("x + x^2 + y^2 + z^2 < 1 + t", 0.3, math.pi * 1.3, math.pi),
        ("x + sqrt(x^2 + y^2 + z^2) < 1 + t", 0.3, math.pi * 1.3, math.pi),
        ("(x + t)^2 + y^2 + z^2 < 1", 0.8, math.pi * 0.6, -math.pi / 2),
    ),
)
def test_a_level_set_that_a_surface_cuts_in_a_circle(region: str, at: float, area: float, rate: float) -> None:
    """Along y and z the circle has no places by itself: it is all of x = h."""
    box = "([-3, 3], [-3, 3], [-3, 3])"
    f = potto.compile(f"def f(t)\n    integral {box} [{region}]*delta(1 - x^2 - y^2 - z^2) d(x, y, z)").f
    answer = potto.deriv(f)((at, 1.0))
    assert answer.converged
    assert abs(answer.value - area) <= answer.error + 1e-15 * area <= 1e-10
    assert abs(answer.tangent - rate) <= answer.tangent_error + 4e-15 <= 1e-10


@pytest.mark.parametrize("order", ("x, y, z", "z, y, x", "y, x, z"))
def test_the_second_derivative_of_what_two_balls_share(order: str) -> None:
    """A lens of unit balls at the distance d: pi (4 + d) (2 - d)^2/12, whose second derivative is pi d/2."""
    balls = "[x^2 + y^2 + z^2 < 1]*[(x - d)^2 + y^2 + z^2 < 1]"
    f = potto.compile(f"def f(d)\n    integral ([-2, 2], [-2, 2], [-2, 2]) {balls} d({order})").f
    answer = potto.hessian(f)(1.2)
    assert abs(answer.value - 0.6 * math.pi) <= answer.error + 1e-14 <= 1e-10


@pytest.mark.parametrize(("t", "b"), [(0.9, 0.1), (0.9, 0.3)])
def test_a_level_set_across_a_kink_of_what_is_summed(t: float, b: float) -> None:
    """Where x = 2y - b crosses the curve the sum over its roots bends: that was cut nowhere, and 1e-7 missed with a bar
    of 3e-14. From there on x - 2y + b is positive, and each x has one root."""

    def above(x: mpmath.mpf) -> mpmath.mpf:
        return mpmath.findroot(lambda y: y + y**5 + x + x**5 - t, 0.4)

    end = mpmath.findroot(lambda x: x + x**5 - t, 0.7)
    bend = mpmath.findroot(lambda x: x - 2 * above(x) + b, (0.2, 0.8), solver="anderson")
    exact = mpmath.quad(lambda x: (x - 2 * above(x) + b) / (1 + 5 * above(x) ** 4), [bend, end])
    peak = "delta(x + x^5 + y + y^5 - t)"
    f = potto.compile(f"def f(t, b) integral ([0, 1], [0, 1]) {peak}*max(x - 2*y + b, 0) d(x, y)").f
    answer = f(t, b)
    assert abs(answer.value - exact) <= answer.error + 1e-15  # mpmath's own, of about 15 digits
    assert answer.error < 1e-12 and answer.evals < 300
