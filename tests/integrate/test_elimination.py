"""Integrals over many variables, one variable after the other: closed forms in four to ten dimensions.

Where what is further in depends on one number of those further out (a sum, a product, the variable before) it is a
table of that number, and the errors are those of quadrature. Where it is not, nothing changes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath as mp
import pytest

import potto

NAMES = "abcdefghij"
Number = Callable[[Any], Any]


def program(bounds: list[str], body: str) -> str:
    return f"def f(t) integral ({', '.join(bounds)}) {body} d({', '.join(NAMES[: len(bounds)])})"


def cube(n: int, body: str) -> str:
    return program(["[0, 1]"] * n, body)


def total(n: int, power: str = "") -> str:
    return " + ".join(f"{name}{power}" for name in NAMES[:n])


def density(n: int, s: Any) -> Any:
    """Of the sum of n uniform numbers (Irwin and Hall)."""
    return sum((-1) ** k * mp.binomial(n, k) * (s - k) ** (n - 1) for k in range(int(s) + 1)) / mp.factorial(n - 1)


def below(n: int) -> Number:
    """int exp(-sum) [sum < t] over the unit cube."""
    return lambda t: mp.quad(lambda s: mp.exp(-s) * density(n, s), [0, *(k for k in range(1, n) if k < t), t])


def corner(weights: list[float]) -> Number:
    """The volume of the unit cube's part where the weighted sum is below t, by inclusion and exclusion."""

    def volume(t: Any) -> Any:
        n, found = len(weights), mp.mpf(0)
        for subset in range(2**n):
            rest = t - sum(mp.mpf(w) for i, w in enumerate(weights) if subset >> i & 1)
            if rest > 0:
                found += (-1) ** bin(subset).count("1") * rest**n
        return found / mp.factorial(n) / mp.fprod(weights)

    return volume


def ball(n: int) -> Number:
    return lambda t: mp.pi ** (mp.mpf(n) / 2) / mp.gamma(mp.mpf(n) / 2 + 1) * t**n


WEIGHTS = [1.0, 1.25, 1.5, 1.75, 2.0, 2.25]
WEIGHTED = " + ".join(f"{w}*{name}" for w, name in zip(WEIGHTS, NAMES, strict=False))

# name, program, where, value as a function of t, the largest error that may be admitted
CASES: list[tuple[str, str, float, Number, float]] = [
    ("plane in 8", cube(8, f"exp(-({total(8)}))*[{total(8)} < t]"), 3.25, below(8), 1e-10),
    ("plane in 5 through corners", cube(5, f"exp(-({total(5)}))*[{total(5)} < t]"), 2.0, below(5), 1e-10),
    ("plane in 10", cube(10, f"exp(-({total(10)}))*[{total(10)} < t]"), 4.5, below(10), 1e-9),
    ("tilted plane in 6", cube(6, f"[{WEIGHTED} < t]"), 4.0, corner(WEIGHTS), 1e-9),
    ("ball in 4", program(["[-1, 1]"] * 4, f"[{total(4, '^2')} < t^2]"), 0.9, ball(4), 1e-8),
    ("ball in 6", program(["[-1, 1]"] * 6, f"[{total(6, '^2')} < t^2]"), 0.7, ball(6), 1e-8),
    ("by its radius", cube(5, f"[sqrt({total(5, '^2')}) < t]"), 0.8, lambda t: ball(5)(t) / 32, 1e-8),
    ("product", cube(5, "[a*b*c*d*e < t]"), 0.1,
     lambda t: t * sum((-mp.log(t)) ** k / mp.factorial(k) for k in range(5)), 1e-9),
    ("in order", program(["[0, t]", "[0, a]", "[0, b]", "[0, c]", "[0, d]"], "a*b*c*d*e"), 0.9,
     lambda t: t**10 / 3840, 1e-9),
    ("simplex", program(["[0, t]", "[0, t - a]", "[0, t - a - b]", "[0, t - a - b - c]", "[0, t - a - b - c - d]"],
                        f"exp({total(5)})"), 0.9,
     lambda t: mp.quad(lambda s: mp.exp(s) * s**4 / 24, [0, t]), 1e-8),
    ("steps", cube(6, "[a < t]*[b > t]*[c + d < t]*(c + d + e + f)"), 0.3,
     lambda t: t * (1 - t) * (t**3 / 3 + t * t / 2), 1e-10),
    ("jump in what is passed on", cube(5, "(if [a < t] then cos(b) + a else b)*exp(c)*[a + b + c < 1]*d*e"), 0.4,
     lambda t: (mp.quad(lambda s: (mp.exp(s) - mp.cos(s) - mp.sin(s)) / 2 + (1 - s) * (mp.exp(s) - 1 - s), [1 - t, 1])
                + mp.quad(lambda s: mp.exp(s) - 1 - s - s * s / 2, [0, 1 - t])) / 4, 1e-8),  # by s = 1 - a
    ("larger one", cube(6, "[max(a, b) < t]*max(max(d, e), f)*c"), 0.7, lambda t: t**2 * mp.mpf(3) / 8, 1e-8),
    ("peak that nodes miss", cube(6, "exp(-1e9*(a - t)^2*(1 + b))*cos(b*c)*d*e*f"), 0.37,
     lambda t: mp.sqrt(mp.pi / mp.mpf(10)**9) / 8 * mp.quad(lambda b: mp.sinc(b) / mp.sqrt(1 + b), [0, 1]), 1e-4),
    ("normals", "def f(t) integral (" + ", ".join(f"{x} ~ normal(0.5, t)" for x in NAMES[:7]) + ") "
                f"[{total(7)} < 2*t + 3] d({', '.join(NAMES[:7])})", 0.8,
     lambda t: mp.ncdf((2 * t - mp.mpf(1) / 2) / (t * mp.sqrt(7))), 1e-9),
    ("waiting times", "def f(t) integral (" + ", ".join(f"{x} ~ exponential(2)" for x in NAMES[:6]) + ") "
                      f"[{total(6)} < t] d({', '.join(NAMES[:6])})", 2.5,
     lambda t: mp.gammainc(6, 0, 2 * t, regularized=True), 1e-9),
    ("least of four", "def f(t) integral (a ~ normal(0, 1), b ~ exponential(t), c ~ gamma(2, 1), d ~ uniform(0, 2)) "
     "min(a, min(b, min(c, d))) d(a, b, c, d)", 1.5,
     lambda t: mp.quad(lambda s: -mp.ncdf(s), [-15, 0]) + mp.quad(  # of P(all > s) - [s < 0]
         lambda s: mp.ncdf(-s)*mp.exp(-t*s)*(1 + s)*mp.exp(-s)*(1 - s/2), [0, 2]), 1e-9),
    ("peak on the way", cube(6, "exp(-1e9*(a + b - t)^2)*c*d*e*f"), 0.7,
     lambda t: mp.sqrt(mp.pi / mp.mpf(10)**9) / 16 * t, 1e-6),
]  # fmt: skip


@pytest.mark.parametrize(("name", "text", "at", "exact", "largest"), CASES, ids=[row[0] for row in CASES])
def test_closed_forms(name: str, text: str, at: float, exact: Number, largest: float) -> None:
    found = potto.deriv(potto.compile(text).f)((at, 1.0))
    assert found.method == "quadrature" and found.evals < 2_000_000
    with mp.workdps(40):
        value, rate = exact(mp.mpf(at)), mp.diff(exact, mp.mpf(at), h=mp.mpf(10) ** -15)
    for got, error, true in ((found.value, found.error, value), (found.tangent, found.tangent_error, rate)):
        assert abs(got - true) <= error <= largest * max(abs(value), abs(true)), (got, error, true)


@pytest.mark.parametrize("normals", [[(0.0, 1.0), (0.3, 1.0), (0.0, 2.0)],
                                     [(0.0, 1.0), (0.3, 1.0), (0.0, 2.0), (1.0, 0.5), (0.0, 3.0)]],
                         ids=["three", "five"])  # fmt: skip
def test_the_mean_of_the_greatest(normals: list[tuple[float, float]]) -> None:
    """It is the mean of x where x is the greatest, of one after the other; how it grows with the mean of the second is
    how often that is the greatest. With three variables iterated quadrature came first, with 5 seconds for 4 digits."""
    bounds = [f"{name} ~ normal({m}, {s})" for name, (m, s) in zip(NAMES, normals, strict=False)]
    bounds[1] = "b ~ normal(t, 1)"
    f = potto.compile(
        program(
            bounds,
            "max("
            + ", max(".join(NAMES[: len(normals) - 1])
            + f", {NAMES[len(normals) - 1]}"
            + ")" * (len(normals) - 1),
        )
    ).f
    found = potto.deriv(f)((0.3, 1.0))
    assert found.converged and found.evals < 2_000_000

    def shares(x: Any) -> list[Any]:
        below = [mp.ncdf((x - m) / s) for m, s in normals]
        return [mp.npdf(x, m, s) * mp.fprod(below[:i] + below[i + 1 :]) for i, (m, s) in enumerate(normals)]

    with mp.workdps(20):
        places = mp.linspace(-28, 28, 29)
        value, rate = mp.quad(lambda x: x * mp.fsum(shares(x)), places), mp.quad(lambda x: shares(x)[1], places)
    assert abs(found.value - value) <= found.error and abs(found.tangent - rate) <= found.tangent_error


THREE = "def f(t) integral (a ~ normal(0, 1), b ~ normal(t, 1), c ~ normal(0, 2)) {} d({})"


@pytest.mark.parametrize("order", ["a, b, c", "c, a, b", "b, c, a"])
def test_any_order_of_the_variables_may_hand_on_one_number(order: str) -> None:
    """With c innermost, both of the others would have to be known further in."""
    bounds = {"a": "a ~ normal(0, 1)", "b": "b ~ normal(t, 1)", "c": "c ~ normal(0, 2)"}
    every = ", ".join(bounds[name] for name in order.split(", "))
    f = potto.compile(f"def f(t) integral ({every}) [c > a]*[c > b] d({order})").f
    found = potto.deriv(f)((0.3, 1.0))
    assert found.converged and found.evals < 2_000_000
    with mp.workdps(20):
        places = mp.linspace(-20, 20, 21)
        value = mp.quad(lambda c: mp.npdf(c, 0, 2) * mp.ncdf(c) * mp.ncdf(c - 0.3), places)
        rate = -mp.quad(lambda c: mp.npdf(c, 0, 2) * mp.ncdf(c) * mp.npdf(c - 0.3), places)
    assert abs(found.value - value) <= found.error and abs(found.tangent - rate) <= found.tangent_error


@pytest.mark.parametrize(
    ("body", "sign"),
    [
        ("([a > b]*[a > c]*a + [b >= a]*[b > c]*b + [c >= a]*[c >= b]*c)", 0),
        ("(max(a, max(b, c)) - min(a, min(b, c)))", -1),
    ],
    ids=["cases", "range"],
)
def test_summands_are_eliminated_one_by_one(body: str, sign: int) -> None:
    """Each of them in an order of its own. Together they took 20 million evaluations, and did not converge."""
    found = potto.deriv(potto.compile(THREE.format(body, "a, b, c")).f)((0.3, 1.0))
    assert found.converged and found.evals < 5_000_000
    normals = [(0, 1), (mp.mpf(0.3), 1), (0, 2)]

    def share(x: Any, way: int, i: int) -> Any:
        beyond = [mp.ncdf(way * (x - m) / s) for m, s in normals]
        return mp.npdf(x, *normals[i]) * mp.fprod(beyond[:i] + beyond[i + 1 :])

    with mp.workdps(20):
        places = mp.linspace(-24, 24, 25)
        value = mp.quad(lambda x: x * mp.fsum(share(x, 1, i) for i in range(3)), places)
        value += sign * mp.quad(lambda x: x * mp.fsum(share(x, -1, i) for i in range(3)), places)
        rate = mp.quad(lambda x: share(x, 1, 1) + sign * share(x, -1, 1), places)
    assert abs(found.value - value) <= found.error and abs(found.tangent - rate) <= found.tangent_error


def test_summands_that_are_infinite_stay_together() -> None:
    """Neither of the two has a mean, their difference has one."""
    bounds = "a ~ cauchy(0, 1), b ~ normal(0, 1), c ~ normal(t, 1)"
    f = potto.compile(f"def f(t) integral ({bounds}) (max(a, b) - max(a, c)) d(a, b, c)").f
    found = potto.deriv(f)((0.3, 1.0))

    def greater(a: Any, m: Any) -> Any:
        return m * mp.ncdf(m - a) - a * mp.ncdf(m - a) + mp.npdf(a - m)  # the mean of max(a, .) - a

    with mp.workdps(20):
        places = [-mp.inf, -10, -1, 0, 1, 10, mp.inf]
        value = mp.quad(lambda a: (greater(a, 0) - greater(a, mp.mpf(0.3))) / (mp.pi * (1 + a * a)), places)
        rate = mp.quad(lambda a: -mp.ncdf(mp.mpf(0.3) - a) / (mp.pi * (1 + a * a)), places)
    assert abs(found.value - value) <= found.error and abs(found.tangent - rate) <= found.tangent_error


@pytest.mark.parametrize(
    ("body", "at"),
    [
        ("[a + t*b < 0.5]*(c + d + e)", 0.0),  # it runs along b
        ("(if [a < t] then cos(b*c) else b + c)*exp(d*e)*[a + c < b]", 0.4),
        ("1/(0.3 + (a - b)^2 + (c - d)^2 + e*t)", 0.5),  # more than one number
    ],
)
def test_what_cannot_be_passed_on_by_one_number_is_integrated_as_ever(body: str, at: float) -> None:
    f = potto.deriv(potto.compile(cube(5, body)).f)
    with potto.settings(samples=20_000, rtol=1e-4):
        found = f((at, 1.0))
    with potto.settings(method="mc", samples=20_000):
        again = f((at, 1.0))
    assert abs(found.value - again.value) <= found.error + again.error
    assert abs(found.tangent - again.tangent) <= found.tangent_error + again.tangent_error


SIX = [f"x{i}" for i in range(6)]


@pytest.mark.parametrize(
    "condition",
    [
        "[" + " and ".join(f"{x} < t" for x in SIX) + "]",
        "[max(" + ", ".join(SIX) + ") < t]",
        "[not (" + " or ".join(f"{x} >= t" for x in SIX) + ")]",
        "[min(" + ", ".join(f"t - {x}" for x in SIX) + ") > 0]",
        "*".join(f"[{x} < t]" for x in SIX),
    ],
    ids=["and", "max", "not or", "min", "product"],
)
def test_all_of_several_conditions_are_their_product(condition: str) -> None:
    """Each of six numbers below t: (1 - exp(-t))^6, at the cost of the product."""
    text = f"{condition}*exp({' '.join(f'- {x}' for x in SIX)})"
    f = potto.compile(f"def f(t) integral ({', '.join(['[0, 1]'] * 6)}) {text} d({', '.join(SIX)})").f
    answer = potto.grad(f, "t")(0.7)
    below = 1 - mp.exp(-mp.mpf(0.7))
    assert abs(answer.value - below**6) <= answer.error + 1e-17 and answer.error <= 1e-13
    assert abs(answer.tangent - 6 * below**5 * (1 - below)) <= answer.tangent_error + 1e-17
    assert answer.tangent_error <= 1e-13 and answer.evals <= 200


@pytest.mark.parametrize("condition", ["max({}) < t", "min({}) > t"])
def test_what_is_elsewhere_than_where_all_conditions_hold_counts(condition: str) -> None:
    """Half of the density everywhere, and the other half where all of six numbers are below, or above, t."""
    body = f"(if [{condition.format(', '.join(SIX))}] then 1 else 1/2)*exp({' '.join(f'- {x}' for x in SIX)})"
    f = potto.compile(f"def f(t) integral ({', '.join(['[0, 1]'] * 6)}) {body} d({', '.join(SIX)})").f
    with potto.settings(samples=20_000, rtol=1e-3):
        answer = potto.grad(f, "t")(0.7)
    below, all_of_it = 1 - mp.exp(-mp.mpf(0.7)), 1 - mp.exp(mp.mpf(-1))
    part = below if "max" in condition else all_of_it - below
    assert abs(answer.value - (part**6 + all_of_it**6) / 2) <= answer.error <= 1e-3
    slope = 3 * part**5 * (1 - below) * (1 if "max" in condition else -1)
    assert abs(answer.tangent - slope) <= answer.tangent_error <= 0.01


def _walked(density: str, steps: int, inside: bool) -> str:
    """The chance that the sums of some steps are ever (or never) above t times their number, t each."""
    names = NAMES[:steps]
    sums = [" + ".join(names[: k + 1]) for k in range(steps)]
    barrier = [f"[{s} {'<=' if inside else '>'} {k + 1}*t]" for k, s in enumerate(sums)]
    given = ", ".join(f"{name} ~ {density}" for name in names)
    body = "*".join(barrier) if inside else f"max({', '.join(barrier)})"
    return f"def f(t) integral ({given}) {body} d({', '.join(names)})"


def test_a_union_of_half_spaces_is_eliminated_as_its_disjoint_parts() -> None:
    """Of three exponential steps over a barrier. Below it a <= t, b <= 2t - a, c <= 3t - a - b; from there
    int exp(-a - b) (1 - exp(a + b - 3t)) db da is 1 - exp(-t) - t*exp(-2*t) - 3*t^2/2*exp(-3*t)."""
    answer = potto.grad(potto.compile(_walked("exponential(1)", 3, False)).f, "t")(1.5)
    t = mp.mpf(1.5)
    once, twice, thrice = (mp.exp(-k * t) for k in (1, 2, 3))
    ever = once + t * twice + 3 * t**2 / 2 * thrice
    slope = -once + (1 - 2 * t) * twice + (3 * t - 9 * t**2 / 2) * thrice
    assert abs(answer.value - ever) <= answer.error <= 1e-11
    assert abs(answer.tangent - slope) <= answer.tangent_error <= 1e-10 and answer.evals <= 100_000


@pytest.mark.parametrize("steps", [3, 4])
def test_ever_above_and_never_above_add_up(steps: int) -> None:
    """Of normal steps, where a step's table is large only beyond what the step before passes on."""
    ever, never = (potto.compile(_walked("normal(0, 1)", steps, inside)).f(1.5) for inside in (False, True))
    assert ever.converged and never.converged and ever.evals <= 2_000_000
    assert abs(ever.value + never.value - 1) <= ever.error + never.error <= 1e-10


def test_what_matters_of_ranges_that_one_exponent_holds_together() -> None:
    """exp(-a - b - c) bounds no variable while the others may be anything; between their bounds it does."""
    body = "exp(-a - b - c)*[a + b + c > 3*t]"
    found = potto.compile(program(["[0, inf]"] * 3, body)).f(1.5)
    true = mp.exp(-4.5) * (1 + 4.5 + mp.mpf(4.5) ** 2 / 2)  # a gamma(3) number above 3t
    assert abs(found.value - true) <= found.error <= 1e-11 and found.evals <= 60_000
