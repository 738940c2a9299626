"""Gamma and its relatives, Bessel functions, sinc, sech and the inverse of erf: in integrals, conditions and samples.

Against mpmath: its own functions, quadrature and roots; derivatives by differences of those at 40 digits.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from mpmath import mp

import potto

Value = Callable[..., mp.mpf]

# A builtin as Potto and as mpmath have it, and an interval on which it has a root of `= t` at t and nowhere else
FUNCTIONS: list[tuple[str, Value, float, float, float]] = [
    ("sech(x)", mp.sech, 0.2, 3.0, 0.6),
    ("sinc(x)", mp.sinc, 0.1, 4.0, 0.4),
    ("gamma(x)", mp.gamma, 1.6, 5.0, 3.0),
    ("lgamma(x)", mp.loggamma, 1.6, 20.0, 7.0),
    ("digamma(x)", mp.digamma, 0.2, 9.0, 0.7),
    ("trigamma(x)", lambda x: mp.zeta(2, x), 0.2, 9.0, 0.7),
    ("besselj0(x)", lambda x: mp.besselj(0, x), 0.1, 3.5, 0.3),
    ("besselj1(x)", lambda x: mp.besselj(1, x), 2.0, 5.0, 0.1),
    ("erfinv(x)", mp.erfinv, -0.9, 0.9, 0.3),
]
EVERY = pytest.mark.parametrize(("text", "f", "lo", "hi", "t"), FUNCTIONS, ids=[text for text, *_ in FUNCTIONS])


def close(found: object, wanted: mp.mpf, rel: float = 1e-10) -> None:
    off = abs(mp.mpf(float(found)) - wanted)  # type: ignore[arg-type]
    assert off <= rel * max(1, abs(wanted)), (found, wanted)
    assert off <= getattr(found, "error", 0.0) + 1e-14 * max(1, abs(wanted)), (found, found.error, wanted)  # type: ignore[attr-defined]


@EVERY
def test_values_and_derivatives(text: str, f: Value, lo: float, hi: float, t: float) -> None:
    """Three derivatives, each of the one before."""
    program = potto.compile(
        f"def f(x) {text}\ndef d(x) snd(deriv(f)((x, 1)))\ndef e(x) snd(deriv(d)((x, 1)))\n"
        f"def g(x) snd(deriv(e)((x, 1)))\n"
    )
    for x in (lo, 0.5 * (lo + hi), hi):
        with mp.workdps(60):
            wanted = [mp.diff(f, mp.mpf(x), n) for n in range(4)]
        for name, value in zip("fdeg", wanted, strict=True):
            close(getattr(program, name)(x), value, 1e-9)


@EVERY
def test_an_integral(text: str, f: Value, lo: float, hi: float, t: float) -> None:
    """The value, and the derivative by a bound and by a scale of the argument."""
    program = potto.compile(
        f"def f(a, b) integral [{lo}, b] {text.replace('(x)', '(a*x)')} d(x)\n"
        "def fa(a, b) snd(deriv(f)((a, 1), (b, 0)))\ndef fb(a, b) snd(deriv(f)((a, 0), (b, 1)))\n"
    )
    with mp.workdps(30):

        def wanted(a: mp.mpf, b: mp.mpf) -> mp.mpf:
            return mp.quad(lambda x: f(a * x), [lo, (lo + b) / 2, b])

        end = lo + 0.7 * (hi - lo)
        close(program.f(1.0, end), wanted(mp.mpf(1), mp.mpf(end)))
        close(program.fb(1.0, end), f(mp.mpf(end)))
        close(program.fa(1.0, end), mp.quad(lambda x: x * mp.diff(f, x), [lo, (lo + end) / 2, end]))


@EVERY
@pytest.mark.parametrize("method", ["quadrature", "mc", "qmc"])
def test_a_condition(text: str, f: Value, lo: float, hi: float, t: float, method: str) -> None:
    """The value, and what moves as the root does: 1/f' there."""
    program = potto.compile(f"def f(t) integral [{lo}, {hi}] x*[{text} < t] d(x)\ndef g(t) snd(deriv(f)((t, 1)))\n")
    with mp.workdps(30):
        root = mp.findroot(lambda x: f(x) - t, (lo, hi), solver="anderson", tol=1e-24, maxsteps=200)
        slope = mp.diff(f, root)
        rising = slope > 0
        wanted = (root * root - mp.mpf(lo) ** 2) / 2 if rising else (mp.mpf(hi) ** 2 - root * root) / 2
        moved = root / abs(slope)
    with potto.settings(method=method, samples=40_000, seed=3):
        value, slope_found = program.f(t), program.g(t)
    if method == "quadrature":
        close(value, wanted)
        close(slope_found, moved, 1e-8)
    else:
        assert abs(float(value) - wanted) <= 5 * value.error + 1e-9
        assert abs(float(slope_found) - moved) <= 5 * slope_found.error + 1e-9


def test_a_condition_with_several_roots() -> None:
    """gamma falls and rises; a Bessel function goes through a number many times."""
    program = potto.compile(
        "def g(t) integral [0.1, 6] [gamma(x) < t] d(x)\ndef j(t) integral [0, 40] [besselj0(x) < t] d(x)\n"
        "def dj(t) snd(deriv(j)((t, 1)))\n"
    )
    with mp.workdps(30):
        left, right = (mp.findroot(lambda x: mp.gamma(x) - mp.mpf("1.5"), x) for x in (0.6, 2.6))
        close(program.g(1.5), right - left)
        zeros = [mp.besseljzero(0, n) for n in range(1, 13)]  # the last one below 40 is the twelfth
        inside = sum((zeros[i + 1] - zeros[i] for i in range(0, 12, 2)), mp.mpf(0))
        close(program.j(0.0), inside)
        rate = sum(1 / abs(mp.besselj(1, z)) for z in zeros)
        close(program.dj(0.0), rate, 1e-8)


def test_outside_of_the_domain() -> None:
    """Of what is not positive there is no gamma function here."""
    program = potto.compile("def f(x) gamma(x)\ndef h(x) trigamma(x)\n")
    for f in (program.f, program.h):
        assert math.isnan(float(f(-0.5)))


def test_as_good_as_the_formula() -> None:
    """sech and 1/cosh: the same value, the same bar, give or take the last places."""
    bodies = ("sech(a*x)", "1/cosh(a*x)")
    found = []
    for body in bodies:
        f = potto.compile(f"def f(a, t) integral [-3, 4] exp(-x*x)*{body}*[x + sin(x) < t] d(x)\n").f
        found.append([f(a, t) for a, t in ((0.5, 0.3), (2.0, 1.0), (5.0, -0.7))])
    for one, other in zip(*found, strict=True):
        assert float(one) == pytest.approx(float(other), rel=4e-15)
        assert one.error <= 2 * other.error + 1e-15
