"""Singularities that only a corner of the domain has, and peaks far out on an infinite range. Closed forms."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Literal

import mpmath as mp
import pytest

import potto

CORNERS = [
    ("1/(1 - x*y)", math.pi**2 / 6, 1e-9),
    ("1/(x + y)", 2 * math.log(2), 1e-9),
    ("log(x + y)", 2 * math.log(2) - 1.5, 1e-9),
    ("1/(x + y)^1.5", 4 - 4 * (math.sqrt(2) - 1), 1.0),  # nothing is vouched for, and it is no infinity
]


@pytest.mark.parametrize(("body", "exact", "largest"), CORNERS, ids=[row[0] for row in CORNERS])
def test_an_integrand_that_is_infinite_in_a_corner(body: str, exact: float, largest: float) -> None:
    """At nodes next to it the inner integral has a pole closer than doubles can approach; they count for little."""
    answer = potto.compile(f"def f(t)\n    integral ([0, 1], [0, 1]) t*({body}) d(x, y)").f(1.0)
    assert abs(answer.value - exact) <= answer.error <= largest
    assert abs(answer.value - exact) <= 1e-4


NARROW = [
    ("[0, t], [0, 1]", "(1 + 1e6*exp(-1e6*x))*exp(y)", lambda t: (t + 1)*(math.e - 1)),
    ("[0, 1], [-t, 0], [0, 1]", "(1 + 1e6*exp(1e6*y))*exp(x)*cos(z)", lambda t: (t + 1)*(math.e - 1)*math.sin(1)),
    ("[0, inf], [0, 1]", "exp(-x)*(1 + 1e6*exp(-1e6*x))*exp(y)*[x + y < t]",
     lambda t: math.exp(t)*((1 - math.exp(-2*t))/2 + 1e6/(1e6 + 2)) - (1 - math.exp(-t)) - 1e6/(1e6 + 1)),
    ("[0, t], [0, 1], [0, 1], [0, 1]", "(1 + 1e6*exp(-1e6*x))*exp(y*z*w)",
     lambda t: (t + 1)*float(mp.nsum(lambda n: 1/(mp.factorial(n)*(n + 1)**3), [0, mp.inf]))),
    # of a sum nothing is read off: nodes at the ends have to see it
    ("[0, t], [0, 1]", "(1 + (sum k in 1..3 (1e6*k*exp(-1e6*k*x))))*exp(y)", lambda t: (t + 3)*(math.e - 1)),
]  # fmt: skip


@pytest.mark.parametrize(("ranges", "body", "exact"), NARROW, ids=[row[1] for row in NARROW])
def test_what_is_narrow_at_an_end_of_an_outer_variable(ranges: str, body: str, exact: Callable[[float], float]) -> None:
    """It was missed without a word: 1.72 of 2.23. Its tail is nothing to rounding."""
    names = ", ".join("xyzw"[: ranges.count("[")])
    f = potto.compile(f"def f(t) integral ({ranges}) {body} d({names})").f
    answer = f(0.3)
    assert abs(answer.value - exact(0.3)) <= answer.error <= 1e-9


E1 = math.e - 1
# Programs with layers beside cuts, and such as are 0 at the end itself, or small: what they are, and their slopes.
LAYERS = [
    ("([0, 1], [0, 1]) [x > t]*(1 + 1e4*exp(-1e4*(x - t)))*exp(y) d(x, y)", lambda t: (2 - t)*E1, -E1),
    ("([0, 1], [0, 1]) [x > t + y/8]*(1 + 1e4*exp(-1e4*(x - t - y/8)))*exp(y) d(x, y)",
     lambda t: (2 - t)*E1 - 1/8, -E1),
    ("([0, 1], [0, 1], [0, 1]) [y > t*x]*(1 + 1e4*exp(-1e4*(y - t*x)))*exp(z) d(x, y, z)",
     lambda t: (2 - t/2)*E1, -E1/2),
    ("([0, t], [0, 1]) (1 + 1e6*x*exp(-1e4*x))*exp(y) d(x, y)", lambda t: (t + 0.01)*E1, E1),
    ("[0, 1] (t + 0.5*exp(-5000*x)) d(x)", lambda t: t + 1e-4, 1),
]  # fmt: skip


@pytest.mark.parametrize("backend", ["numpy", "native"])
@pytest.mark.parametrize(("body", "exact", "slope"), LAYERS, ids=[row[0] for row in LAYERS])
def test_a_layer_beside_a_cut_or_an_end(
    body: str, exact: Callable[[float], float], slope: float, backend: Literal["numpy", "native"]
) -> None:
    """No node of a range sees it, nor need its end: all but the third and fourth were missed without a word."""
    f = potto.compile(f"def f(t) integral {body}").f
    with potto.settings(backend=backend):
        for t, answer in ((0.3, potto.deriv(f)((0.3, 1.0))), (0.25, f([0.25, 0.35])[0])):
            assert abs(answer.value - exact(t)) <= answer.error <= 1e-8
            if answer.tangent is not None:
                assert abs(answer.tangent - slope) <= answer.tangent_error <= 1e-7


PEAKS = [
    ("exp(-(1e4*(x - t))^2)", math.sqrt(math.pi)),
    ("exp(-1e8*(x - t)^2)", math.sqrt(math.pi)),
    ("1/(1 + (1e4*(x - t))^2)", math.pi),
    ("1/cosh(1e4*(x - t))", math.pi),
]


@pytest.mark.parametrize("ends", ["-inf, inf", "0, inf", "-inf, 1e5", "0, 2000"])
@pytest.mark.parametrize(("body", "size"), PEAKS, ids=[row[0] for row in PEAKS])
def test_a_peak_far_narrower_than_the_range(body: str, size: float, ends: str) -> None:
    answer = potto.compile(f"def f(t)\n    integral [{ends}] {body} d(x)").f(1000.0)
    exact = size * 1e-4
    slack = 3e-11 if body.startswith("1/(1") and ends != "-inf, inf" else 1e-15  # what its tails lack
    assert abs(answer.value - exact) <= answer.error + slack and answer.error <= 1e-7 * exact + slack


@pytest.mark.parametrize("t", [1e-15, 1e-12, 1e-9, -1e-9, 1e-6, 1e-3])
@pytest.mark.parametrize("box", ["[-1, 1], [-1, 1]", "[0, 1], [0, 1]", "[-1, 0], [-1, 0]", "[-1, 0], [0, 1]"])
def test_a_hyperbola_close_to_its_asymptotes(t: float, box: str) -> None:
    """Where x y > 0 the area is |t| (1 - ln |t|) a quarter, seen from either side of 0 with the same digits."""
    f = potto.compile(f"def f(t)\n    integral ({box}) [x*y < t] d(x, y)").f
    found = potto.deriv(f)((t, 1.0))
    quarters = {"[-1, 1], [-1, 1]": 2, "[-1, 0], [0, 1]": int(t < 0)}.get(box, int(t > 0))
    exact = -quarters * math.log(abs(t))
    assert abs(found.tangent - exact) <= found.tangent_error <= 1e-11 and found.converged


@pytest.mark.parametrize("t", [1e-6, 1e-8, 1e-9, 1e-12])
def test_a_small_part_that_is_steep_at_an_end_shows_beside_a_large_smooth_one(t: float) -> None:
    """The area under x y adds t ln t, by t/x for x > t, to a form whose nodes move: there it was a part in a thousand,
    and the large part's decay was taken for that of the whole."""
    nested = "integral [0, 1] (integral [0, 1] (if [x*y >= t] then x*y + 1 else 1) d(y)) d(x)"
    answer = potto.deriv(potto.compile(f"def f(t)\n    {nested}").f)((t, 1.0))
    assert abs(answer.tangent - t * math.log(t)) <= answer.tangent_error <= 1e-10


# Peaks along the roots of what has no single formula for them: (program, what is 0 at a peak, where the domain ends).
ALONG_ROOTS = [
    ("integral [0, 1] exp(-(n*(sin(20*x) - 0.3))^2) d(x)", lambda x: mp.sin(20 * x) - mp.mpf("0.3"), 1),
    ("integral [0, 1] exp(-(n*(x^3 + x - 0.3))^2) d(x)", lambda x: x**3 + x - mp.mpf("0.3"), 1),
    ("integral [0, 3] exp(-(n*(cos(2*x + 0.3) - x/5))^2) d(x)", lambda x: mp.cos(2 * x + mp.mpf("0.3")) - x / 5, 3),
]


@pytest.mark.parametrize("n", [30, 100, 10_000, 1_000_000])
@pytest.mark.parametrize("number", range(len(ALONG_ROOTS)))
def test_peaks_are_found_along_roots_of_any_kind(number: int, n: int) -> None:
    text, center, end = ALONG_ROOTS[number]
    answer = potto.compile(f"def f(n) {text}").f(n)
    with mp.workdps(30):
        grid = [mp.mpf(i) * end / 500 for i in range(501)]
        roots = [mp.findroot(center, (a, b), solver="anderson") for a, b in itertools.pairwise(grid)
                 if center(a) * center(b) < 0]  # fmt: skip
        places = sorted({mp.mpf(0), mp.mpf(end), *(r + k / mp.mpf(n) for r in roots for k in (-3, -1, 0, 1, 3))})
        places = [p for p in places if 0 <= p <= end]
        exact = float(mp.quad(lambda x: mp.exp(-((n * center(x)) ** 2)), places))
    # a peak is placed to the rounding of x and of what is 0 there: up to 20n times 1e-16, in parts of its width
    assert abs(answer.value - exact) <= answer.error <= (1e-10 + 3e-14 * n) * exact


@pytest.mark.parametrize("k", [3e3, 2e5])
@pytest.mark.parametrize("t", [0.3, 0.7071])
def test_what_is_narrow_where_a_divisor_is_small(k: float, t: float) -> None:
    """Rules of few nodes, too, leave alone what is divided by what grows so much."""
    f = potto.compile("def f(k, t)\n    integral [0, 1] (1 + 1/(1 + k^2*(x - t)^2)^2) d(x)").f
    found = f(k, t)
    with mp.workdps(40):
        ends = mp.mpf(t), 1 - mp.mpf(t)
        exact = 1 + mp.fsum(mp.atan(k * u) / (2 * k) + u / (2 * (1 + (k * u) ** 2)) for u in ends)
        assert abs(found.value - exact) <= found.error + 1e-15
    assert found.error <= 1e-10


@pytest.mark.slow
def test_a_steep_turn_along_a_circle() -> None:
    """Over x a root of the distance from sqrt(t), but for a stretch of 1e-5: a piece graded towards it looks smooth in
    one form of the derivative alone. The exact ones by the area of discs within the square, by mpmath."""
    f = potto.deriv(potto.compile(
        "def f(t) integral ([0, 1], [0, 1]) atan2(2e4*(x^2 + y^2 - t), 1) d(x, y)").f)  # fmt: skip
    answer = f((0.5, 1.0))
    assert abs(answer.value - 1.3483236115858564403 / 4) <= answer.error + 2e-16 <= 1e-9
    assert abs(answer.tangent + 9.8690639924038129418 / 4) <= answer.tangent_error + 1e-15 <= 1e-8
