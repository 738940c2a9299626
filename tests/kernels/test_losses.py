"""What slopes and curvatures of builtins are said to be off holds, near 0, far out and at the ends, against mpmath.

The answers are derivatives that the books have in closed form, at 60 digits; what underflows is left out.
"""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Callable
from fractions import Fraction

import pytest
from mpmath import mp

import potto
from potto.python import derived_calls

Slopes = Callable[[mp.mpf], tuple[mp.mpf, mp.mpf]]
SMALL = (1e-8, 1e-4, 0.1, 0.7)
WIDE = (*SMALL, 2.0, 3.8317, 24.0, 26.0, 1e4, 445096.69645057945, 1e8)
needs_llvm = pytest.mark.skipif(importlib.util.find_spec("llvmlite") is None, reason="llvmlite is not installed")
BELOW_ONE = (*SMALL, 0.9999, 1 - 1e-8, 1 - 1e-12, 1 - 1e-15)


def _sech(x: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
    s, t = mp.sech(x), mp.tanh(x)
    return -s * t, s * (t * t - s * s)


def _tanh(x: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
    s = mp.sech(x) ** 2
    return s, -2 * s * mp.tanh(x)


def _sinc(x: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
    slope = mp.cos(x) / x - mp.sin(x) / x**2
    return slope, -mp.sin(x) / x - 2 * slope / x


def _erf(x: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
    bell = 2 / mp.sqrt(mp.pi) * mp.exp(-x * x)
    return bell, -2 * x * bell


def _erfinv(x: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
    root = mp.erfinv(x)
    slope = mp.sqrt(mp.pi) / 2 * mp.exp(root * root)
    return slope, 2 * root * slope * slope


def _gamma(x: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
    steep = mp.digamma(x)
    return mp.gamma(x) * steep, mp.gamma(x) * (steep * steep + mp.zeta(2, x))


def _j0(x: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
    return -mp.besselj(1, x), (mp.besselj(2, x) - mp.besselj(0, x)) / 2


def _j1(x: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
    return (mp.besselj(0, x) - mp.besselj(2, x)) / 2, (mp.besselj(3, x) - 3 * mp.besselj(1, x)) / 4


def _asin(x: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
    slope = 1 / mp.sqrt(1 - x * x)
    return slope, x * slope**3


FUNCTIONS: list[tuple[str, Slopes, tuple[float, ...]]] = [
    ("besselj0(x)", _j0, WIDE),
    ("besselj1(x)", _j1, WIDE),
    ("sinc(x)", _sinc, WIDE),
    ("sech(x)", _sech, (*SMALL, 20.0, 300.0)),
    ("tanh(x)", _tanh, (*SMALL, 20.0, 300.0)),
    ("erf(x)", _erf, (*SMALL, 3.3, 11.1, 25.1)),
    ("erfinv(x)", _erfinv, BELOW_ONE),
    ("asin(x)", _asin, BELOW_ONE),
    ("gamma(x)", _gamma, (*SMALL, 1.4616321449683622, 10.3, 100.3)),
    ("digamma(x)", lambda x: (mp.zeta(2, x), -2 * mp.zeta(3, x)), (*SMALL, 10.3, 1e8)),
    ("x^2.5/(1 + x^2)", lambda x: _rational(x), (*SMALL, 10.3, 1e8)),
    ("x^3 - 3*x", lambda x: (3 * x * x - 3, 6 * x), (-1e8, -1.00057729, -1.3, -1e-8, 0.0, 1.7)),
    ("(1.1*x)*(0.9 - 1.1*x)", lambda x: _cancelling(x), (0.40909090909090906, 0.41, 3.0)),
]


def _rational(x: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
    with mp.workdps(90):
        return tuple(mp.taylor(lambda s: s ** mp.mpf(2.5) / (1 + s * s), x, 2)[n] * n for n in (1, 2))  # type: ignore[return-value]


def _cancelling(x: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
    a, b = mp.mpf(1.1), mp.mpf(0.9)
    return a * b - 2 * a * a * x, -2 * a * a


@pytest.mark.parametrize(("text", "slopes", "points"), FUNCTIONS, ids=[text for text, *_ in FUNCTIONS])
def test_bars_of_slopes_hold(
    text: str, slopes: Slopes, points: tuple[float, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both ways that tangents go, forward and back along a tape."""
    program = potto.compile(f"def f(x) {text}\ndef g(x) snd(deriv(f)((x, 1)))\n")
    first, second = potto.deriv(program.f), potto.deriv(program.g)
    monkeypatch.setattr(derived_calls, "MANY", 1)  # by a tape from one parameter on
    back = potto.grad(program.f)
    for x in points:
        with mp.workdps(60):
            wanted = slopes(mp.mpf(x))
        for found, true in zip((first((x, 1.0)), second((x, 1.0))), wanted, strict=True):
            assert abs(mp.mpf(found.tangent) - true) <= found.tangent_error < math.inf, (x, found, true)
        swept = back(x)
        assert abs(mp.mpf(swept.tangent) - wanted[0]) <= swept.tangent_error < math.inf, (x, swept)


@pytest.mark.parametrize("x", [-1e8, -1.3, -1e-8, 0.0, 1.7])
def test_powers_whose_exponents_are_parameters(x: float) -> None:
    """The logarithm by which exponents count has no value at what is not positive: there they are whole, and exact."""
    found = potto.grad(potto.compile("def f(x, n) x^n").f, ["x"])(x, 3.0)
    assert abs(Fraction(found.tangent) - 3 * Fraction(x) ** 2) <= found.tangent_error < 1e-14 * x * x + 1e-300


def test_bars_of_slopes_are_no_larger_than_conditions_ask_for() -> None:
    """Of the size of the function nearby, a few last places; of erfinv as its condition, 3 r^2 of them."""
    program = potto.compile("def j(x) besselj1(x)\ndef e(x) erfinv(x)\ndef s(x) sin(x)\n")
    assert potto.deriv(program.j)((1e8, 1.0)).tangent_error < 3e-19  # where J1 is 8e-5 at most
    found = potto.deriv(program.e)((1 - 1e-12, 1.0))
    assert found.tangent_error < 400 * 2**-53 * found.tangent
    assert potto.deriv(program.s)((1.0, 1.0)).tangent_error <= 2**-52


@pytest.mark.parametrize("backend", ["numpy", pytest.param("native", marks=needs_llvm)])
@pytest.mark.parametrize(
    "text",
    ["sqrt(1 - x)", "(1 - x)^(1/3)", "(1 - x)^(x/2)", "norm([x - 1, 2 - 2*x])", "hypot(x - 1, 1 - x)"],
)
def test_an_exact_argument_spoils_nothing_where_a_slope_is_infinite(text: str, backend: str) -> None:
    """Alone, and in a batch with others."""
    function = potto.compile(f"def f(x) {text}\n").f
    with potto.settings(backend=backend):
        alone, among = function(1.0), function([1.0, 0.25, 1.0])
    assert (alone.value, alone.error) == (0, 0)
    assert (among.value[::2] == 0).all()
    assert (among.error[::2] == 0).all()
    assert alone.converged
    assert among.converged


@pytest.mark.parametrize(("text", "true"), [("asin(2 - x)", mp.pi / 2), ("acos(2 - x)", 0)])
def test_angles_of_exact_sines_of_1(text: str, true: mp.mpf) -> None:
    found = potto.compile(f"def f(x) {text}\n").f(1.0)
    assert abs(found.value - true) <= found.error <= math.ulp(float(true)) * (true > 0)
    assert found.converged


def test_an_argument_that_is_off_is_off_where_a_slope_is_infinite() -> None:
    """0.1 + 0.2 - 0.3 is 5.6e-17 in double precision, and 0 in truth: the root is 7.5e-9 off."""
    found = potto.compile("def f(a, b, c) sqrt(a + b - c)\n").f(0.1, 0.2, 0.1 + 0.2)
    assert found.value == 0
    assert found.error >= math.sqrt(2.0**-55)
