"""Laws of the table of measures; a new entry is tested the day that it appears."""

from __future__ import annotations

import random
from functools import cache

import pytest
from lint import lint
from mpmath import mp

from potto.calculus.differentiation.derivative import partial
from potto.core.reference import evaluate
from potto.core.terms import Term, const, integral, mul, prim, sub, sum_, var
from potto.measures import MEASURES, Measure

X = var("x")
LANGUAGE = {"normal", "uniform", "triangular", "exponential"}
EVERY = pytest.mark.parametrize("measure", MEASURES.values(), ids=lambda m: m.name)
WITH_CDF = pytest.mark.parametrize("measure", [m for m in MEASURES.values() if m.cdf], ids=lambda m: m.name)


@cache
def samples(measure: Measure, count: int = 3) -> tuple[tuple[float, ...], ...]:
    """Valid parameters, the same in each run."""
    generator = random.Random(measure.name)
    found: list[tuple[float, ...]] = []
    while len(found) < count:
        draws = [generator.uniform(lo, hi) for lo, hi in measure.domain]
        whole = measure.name == "binomial"  # n is
        values = tuple(round(x, 0 if whole and place == 0 else 3) for place, x in enumerate(draws))
        if valid(measure, values):
            found.append(values)
    return tuple(found)


def valid(measure: Measure, values: tuple[float, ...]) -> bool:
    return all(evaluate(condition, {}) is True for condition, _ in measure.valid(*map(const, values)))


def expectation(measure: Measure, values: tuple[float, ...], body: Term) -> mp.mpf:
    """To 20 digits, along the entry's own support and hints."""
    parameters = tuple(map(const, values))
    density = measure.density(X, *parameters)
    if measure.discrete:
        return evaluate(sum_("x", *measure.counted(*parameters), mul(density, body)), {}, digits=20)
    term = integral(("x",), (measure.support(*parameters),), mul(density, body), (measure.hints(*parameters),))
    return evaluate(term, {}, digits=15)


def test_the_language_has_its_measures() -> None:
    assert set(MEASURES) >= LANGUAGE


@EVERY
def test_entries_are_complete(measure: Measure) -> None:
    names = tuple(map(var, measure.parameters))
    assert len(measure.domain) == len(names) and measure.doc.endswith(".")
    assert f"{measure.name}(" in measure.example
    assert all(message for _, message in measure.valid(*names))
    terms = [measure.density(X, *names), *measure.support(*names), *measure.hints(*names)]
    terms += [f(*names) for f in (measure.mean, measure.variance) if f is not None]
    terms += [] if measure.cdf is None else [measure.cdf(X, *names)]
    for term in terms:
        assert not lint(term) and term.free <= {"x", *measure.parameters}
    assert not measure.discrete or not measure.hints(*names)
    assert measure.density(X, *names).free == {"x", *measure.parameters} or measure.name == "uniform"


@EVERY
def test_the_density_integrates_to_one(measure: Measure) -> None:
    for values in samples(measure):
        assert abs(expectation(measure, values, const(1.0)) - 1) < mp.mpf("1e-14")


@EVERY
def test_mean_and_variance(measure: Measure) -> None:
    if measure.mean is None or measure.variance is None:
        assert measure.name == "cauchy"
        return
    for values in samples(measure, 2):
        mean = measure.mean(*map(const, values))
        centered = sub(X, mean)
        spread = evaluate(measure.variance(*map(const, values)), {})
        assert abs(expectation(measure, values, centered)) < mp.mpf("1e-12") * max(1, spread)
        assert abs(expectation(measure, values, mul(centered, centered)) - spread) < mp.mpf("1e-12") * max(1, spread)


@WITH_CDF
def test_the_density_is_the_slope_of_the_cdf(measure: Measure) -> None:
    assert measure.cdf is not None
    slope = partial(measure.cdf(X, *map(var, measure.parameters)), "x")
    for values in samples(measure):
        env = dict(zip(measure.parameters, values, strict=True))
        for place in (0.03, 0.41, 0.77, 0.995):
            assert measure.quantile is not None
            x = evaluate(measure.quantile(const(place), *map(const, values)), {})
            density = evaluate(measure.density(X, *map(const, values)), {"x": x})
            assert abs(evaluate(slope, {**env, "x": x}) - density) < mp.mpf("1e-25") * max(1, density)


@WITH_CDF
def test_the_quantile_inverts_the_cdf(measure: Measure) -> None:
    assert measure.quantile is not None and measure.cdf is not None
    for values in samples(measure):
        parameters = tuple(map(const, values))
        lo, hi = (evaluate(end, {}) for end in measure.support(*parameters))
        for place in (1e-12, 0.01, 0.3, 0.5, 0.72, 0.999):
            with mp.workdps(30):
                x = evaluate(measure.quantile(const(place), *parameters), {})
                assert lo <= x <= hi
                assert abs(evaluate(measure.cdf(X, *parameters), {"x": x}) - place) < mp.mpf("1e-25")


@EVERY
def test_hints_ascend_inside_of_the_support(measure: Measure) -> None:
    for values in samples(measure):
        parameters = tuple(map(const, values))
        lo, hi = (evaluate(end, {}) for end in measure.support(*parameters))
        points = [evaluate(hint, {}) for hint in measure.hints(*parameters)]
        assert points == sorted(points) and all(lo <= p <= hi for p in points)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("normal", (0.0, 0.0)),
        ("normal", (0.0, -1.0)),
        ("uniform", (2.0, 1.0)),
        ("uniform", (1.0, 1.0)),
        ("triangular", (0.0, 3.0, 2.0)),
        ("triangular", (0.0, -1.0, 2.0)),
        ("exponential", (0.0,)),
        ("exponential", (float("nan"),)),
        ("lognormal", (0.0, -1.0)),
        ("beta", (0.0, 1.0)),
        ("gamma", (1.0, 0.0)),
        ("student_t", (0.0, 0.0, 1.0)),
        ("bernoulli", (1.5,)),
        ("binomial", (2.5, 0.5)),
        ("binomial", (3.0, 1.0)),
        ("poisson", (0.0,)),
    ],
)
def test_what_is_not_valid(name: str, values: tuple[float, ...]) -> None:
    assert not valid(MEASURES[name], values)


def test_a_mode_at_an_end() -> None:
    """The side that has no width is never evaluated."""
    assert valid(MEASURES["triangular"], (0.0, 0.0, 2.0))
    assert abs(expectation(MEASURES["triangular"], (0.0, 0.0, 2.0), const(1.0)) - 1) < mp.mpf("1e-14")
    assert abs(expectation(MEASURES["triangular"], (0.0, 2.0, 2.0), X) - mp.mpf(4) / 3) < mp.mpf("1e-14")


def test_known_expectations() -> None:
    """E cos x is exp(-s^2/2) cos m for a normal x; E x^3 is 6/r^3 for an exponential one."""
    found = expectation(MEASURES["normal"], (0.5, 1.25), prim("cos", X))
    assert abs(found - mp.exp(-mp.mpf("0.78125")) * mp.cos(mp.mpf("0.5"))) < mp.mpf("1e-14")
    found = expectation(MEASURES["exponential"], (2.0,), mul(X, X, X))
    assert abs(found - mp.mpf(6) / 8) < mp.mpf("1e-14")
