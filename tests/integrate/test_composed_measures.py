"""Truncated measures and mixtures, with jumps in what is expected: values and derivatives by all parameters.

Against closed forms at 40 digits, by quadrature and by samples.
"""

from __future__ import annotations

import pytest
from chances import Cdf, check_chances
from mpmath import mp

import potto


def normal(t: mp.mpf, m: mp.mpf, s: mp.mpf) -> mp.mpf:
    return mp.erfc((m - t) / s / mp.sqrt(2)) / 2


def above(t: mp.mpf, m: mp.mpf, s: mp.mpf) -> mp.mpf:
    return mp.erfc((t - m) / s / mp.sqrt(2)) / 2


def between(a: mp.mpf, b: mp.mpf, m: mp.mpf, s: mp.mpf) -> mp.mpf:
    return above(a, m, s) - above(b, m, s)


def cut_normal(t: mp.mpf, m: mp.mpf, s: mp.mpf, lo: mp.mpf, hi: mp.mpf) -> mp.mpf:
    return between(lo, t, m, s) / between(lo, hi, m, s)


def two(t: mp.mpf, w: mp.mpf, v: mp.mpf, m: mp.mpf, s: mp.mpf, a: mp.mpf) -> mp.mpf:
    return (w * normal(t, m, s) + v * min(max(t / a, 0), 1)) / (w + v)


def cut_gamma(t: mp.mpf, a: mp.mpf, r: mp.mpf, hi: mp.mpf) -> mp.mpf:
    return mp.gammainc(a, 0, r * t) / mp.gammainc(a, 0, r * hi)


def cut_mixture(t: mp.mpf, w: mp.mpf, m: mp.mpf) -> mp.mpf:
    def left(end: mp.mpf) -> mp.mpf:
        return w * between(mp.mpf(0), end, mp.mpf(0), mp.mpf(1)) + (1 - w) * between(mp.mpf(0), end, m, mp.mpf("0.5"))

    return left(t) / left(mp.inf)


CASES: list[tuple[str, tuple[str, ...], Cdf, tuple[float, ...]]] = [
    ("truncated(normal(m, s), lo, hi)", ("m", "s", "lo", "hi"), cut_normal, (0.7, 0.2, 1.3, -1.0, 2.0)),
    ("truncated(normal(m, s), lo, hi)", ("m", "s", "lo", "hi"), cut_normal, (9.1, 0.0, 1.0, 9.0, 10.0)),
    ("mixture(w, normal(m, s), v, uniform(0, a))", ("w", "v", "m", "s", "a"), two, (0.7, 0.4, 1.1, 0.2, 1.3, 2.0)),
    ("mixture(w, normal(m, s), v, uniform(0, a))", ("w", "v", "m", "s", "a"), two, (-0.5, 2.0, 1.0, 0.2, 1.3, 2.0)),
    ("truncated(gamma(a, r), 0, hi)", ("a", "r", "hi"), cut_gamma, (0.9, 2.5, 1.5, 3.0)),
    ("truncated(mixture(w, normal(0, 1), 1 - w, normal(m, 0.5)), 0, inf)", ("w", "m"), cut_mixture, (2.5, 0.3, 3.0)),
]


@pytest.mark.parametrize("method", ["quadrature", "mc", "qmc"])
@pytest.mark.parametrize(("measure", "names", "cdf", "values"), CASES)
def test_chances(measure: str, names: tuple[str, ...], cdf: Cdf, values: tuple[float, ...], method: str) -> None:
    check_chances(measure, names, cdf, values, method)


def test_several_variables() -> None:
    """A parameter that is an outer variable: each weight stays with its variable."""
    f = potto.compile(
        "def f(w) integral (x ~ mixture(w, uniform(1, 2), 1, uniform(3, 5)), y ~ truncated(exponential(x), 0, 1)) "
        "[y < 0.25] d(x, y)\n"
    ).f
    with mp.workdps(30):

        def below(x: mp.mpf) -> mp.mpf:
            return mp.expm1(-x / 4) / mp.expm1(-x)

        w = mp.mpf("0.7")
        wanted = (w * mp.quad(below, [1, 2]) + mp.quad(below, [3, 5]) / 2) / (w + 1)
        assert abs(float(f(0.7)) - wanted) <= f(0.7).error + 1e-14
        assert abs(float(f(0.7)) - wanted) <= 1e-9


def test_of_several_results() -> None:
    """Chance, mean and square at once."""
    f = potto.compile("def f(w) integral (x ~ mixture(w, normal(1, 1), 3, normal(-1, 2))) ([x < 0], x, x*x) d(x)\n").f
    chance, mean, square = f(2.0).value
    with mp.workdps(30):
        exact = (2 * normal(mp.mpf(0), mp.mpf(1), mp.mpf(1)) + 3 * normal(mp.mpf(0), mp.mpf(-1), mp.mpf(2))) / 5
    assert abs(float(chance) - exact) < 1e-9
    assert float(mean) == pytest.approx(-0.2, abs=1e-9)
    assert float(square) == pytest.approx(19 / 5, abs=1e-8)


@pytest.mark.parametrize("values", [(1.0, 0.5), (2.0, 2.0)])
def test_nothing_left(values: tuple[float, ...]) -> None:
    f = potto.compile("def f(a, b) integral (x ~ truncated(uniform(0, 1), a, b)) x d(x)\n").f
    with pytest.raises(potto.PottoError, match="nothing is left"):
        f(*values)


def test_a_component_of_which_nothing_is_left() -> None:
    """The others are what is left: uniform between 3/2 and t, with mean 3/4 + t/2; outside of all of them, nothing."""
    f = potto.compile(
        "def f(t) integral (x ~ truncated(mixture(1, uniform(0, 1), 1, uniform(2, 3)), 1.5, t)) x d(x)\n"
    ).f
    answer = potto.deriv(f)((2.5, 1.0))
    assert abs(answer.value - 2.25) <= answer.error <= 1e-12
    assert abs(answer.tangent - 0.5) <= answer.tangent_error <= 1e-12
    with pytest.raises(potto.PottoError, match="nothing is left"):
        f(1.75)


@pytest.mark.parametrize(
    ("measure", "says"),
    [
        ("truncated(1, 2)", "`truncated` is not given the measures"),
        ("truncated(normal(0, 1), 2)", "`truncated` is not given the measures"),
        ("mixture(1, normal(0, 1), 2)", "`mixture` is not given the measures"),
        ("truncated(nomal(0, 1), 0, 1)", "there is no measure `nomal`"),
        ("mixture(1, normal(0), 1, normal(0, 1))", "`normal` takes 2 parameters, but is given 1"),
    ],
)
def test_mistakes(measure: str, says: str) -> None:
    with pytest.raises(potto.PottoError, match=says):
        potto.compile(f"def f(t) integral (x ~ {measure}) [x < t] d(x)\n").f(1.0)


@pytest.mark.parametrize("rtol", [1e-6, 1e-7, 1e-8, 1e-9])
def test_the_far_edge_of_a_density_under_another_one(rtol: float) -> None:
    """Along x, outermost, from 1.5 on, is what is left of a normal density's edge: 3e-6 of it, within a hundredth
    of the stretch. d/dt by mpmath."""
    f = potto.compile("""
def f(t)
    integral (x ~ exponential(2), y ~ normal(0.5, 0.3)) y*t*[x + 0.5*y >= t] d(x, y)
""").f
    with potto.settings(rtol=rtol):
        answer = potto.deriv(f)(([1.02] * 12, 1.0))
    assert (abs(answer.tangent - -0.137598317314747124) <= answer.tangent_error).all()
    assert (answer.tangent_error <= rtol).all()
