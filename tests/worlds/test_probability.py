"""Probability: values and derivatives against closed forms by mpmath; fits against optima known beforehand."""

from __future__ import annotations

from typing import Any

import mpmath as mp
import pytest
from exact_probability import VOLATILITY, accepted, call, digital, expected_cost, knocked_out, truncated_moments
from worlds_references import agrees, dual, program, reference

import potto

TRUNCATED = program("probability/truncated")
CENSORED = program("probability/censored")
NEWS = program("probability/newsvendor")
OPTIONS = program("probability/options")
THRESHOLD = program("probability/threshold")
ACCEPTANCE = program("probability/acceptance")


@pytest.mark.parametrize("bound", [-3.0, -1.0, 0.7])
@pytest.mark.parametrize("part", [0, 1])
def test_moments_between_bounds(bound: float, part: int) -> None:
    found = dual(TRUNCATED, rf"\a . moments(a, 2).{part}", bound)
    agrees(found, reference(lambda a: truncated_moments(a, 2)[part], bound), 1e-12)


@pytest.mark.parametrize(("a", "b"), [(-1.0, 2.0), (-0.25, 0.75)])
def test_the_bounds_are_found_by_their_moments(a: float, b: float) -> None:
    first, second = truncated_moments(mp.mpf(a), mp.mpf(b))
    found = potto.fit(TRUNCATED.moments, {"a": -0.5, "b": 1.0}, target=(float(first), float(second)))
    assert found.converged and abs(found["a"] - a) < 1e-6 and abs(found["b"] - b) < 1e-6


@pytest.mark.parametrize("price", [0.5, 2.0])
def test_truncated_risk_is_least_where_an_outlier_costs_its_price(price: float) -> None:
    found = potto.fit(TRUNCATED.risk, {"a": -1.0, "b": 3.0}, given={"s": 0.5, "price": price})
    assert found.converged
    assert abs(found["a"] - (1 - price**0.5)) < 1e-6 and abs(found["b"] - (1 + price**0.5)) < 1e-6


@pytest.mark.parametrize(("shape", "time"), [(1.5, 2.0), (0.8, 0.1), (3.0, 4.0)])
def test_weibulls_survival_by_rate(shape: float, time: float) -> None:
    found = dual(CENSORED, rf"\r . survival({time}, {shape}, r)", 0.4)
    agrees(found, reference(lambda r: mp.exp(-((r * mp.mpf(time)) ** mp.mpf(shape))), 0.4), 1e-10)


@pytest.mark.parametrize("shape", [1.0, 1.5])
def test_the_effect_of_the_treatment_is_found(shape: float) -> None:
    rates = [(3 / sum(t**shape for t in times)) ** (1 / shape)
             for times in ((0.8, 1.1, 1.9, 2.4), (1.2, 2.9, 2.2, 3.5))]  # fmt: skip
    found = potto.fit(CENSORED.loss, {"rate": 1.0, "treatment": 0.1}, given={"shape": shape})
    assert found.converged
    assert abs(found["rate"] - rates[0]) < 1e-6 and abs(found["treatment"] - float(mp.log(rates[0] / rates[1]))) < 1e-6


@pytest.mark.parametrize("order", [5.0, 20.0, 26.0, 60.0])
def test_cost_of_an_order(order: float) -> None:
    agrees(dual(NEWS, "best", order), reference(expected_cost, order), 1e-12)


def test_the_best_order_is_found() -> None:
    found = potto.fit(NEWS.best, {"q": 20.0})
    quantile = mp.exp(3 + mp.mpf(0.4) * mp.sqrt(2) * mp.erfinv(mp.mpf(1) / 2))
    assert found.converged and abs(found["q"] - float(quantile)) < 1e-6 * float(quantile)


@pytest.mark.parametrize("spot", [80.0, 100.0, 125.0])
@pytest.mark.parametrize(("name", "exact"), [("call", call), ("digital", digital)])
def test_greeks_of_calls_and_digitals(name: str, exact: Any, spot: float) -> None:
    by_spot = dual(OPTIONS, rf"\s . {name}(market with spot = s, 105, 1)", spot)
    agrees(by_spot, reference(lambda s: exact(s, VOLATILITY, 105), spot), 1e-11)
    by_volatility = dual(OPTIONS, rf"\v . {name}(market with volatility = v, 105, 1)", 0.2)
    agrees(by_volatility, reference(lambda v: exact(mp.mpf(100), v, 105), 0.2), 1e-11)


@pytest.mark.parametrize("strike", [90, 110])
def test_gamma(strike: int) -> None:
    slope = rf"(\s . deriv(\u . call(market with spot = u, {strike}, 1))((s, 1)).1)"
    with mp.workdps(40):
        exact = mp.diff(lambda s: call(s, VOLATILITY, strike), 100, 2)
    assert abs(dual(OPTIONS, slope, 100.0)[1] - float(exact)) < 1e-12


# The bound of the error of the option with barriers is 1e-9 where it is off by 1e-14: more is not asked for.
@pytest.mark.parametrize(("of", "place"), [("spot", 100.0), ("spot", 128.0), ("volatility", 0.2)])
def test_greeks_of_a_barrier(of: str, place: float) -> None:
    with potto.settings(rtol=1e-7), mp.workdps(25):
        found = dual(OPTIONS, rf"\p . knocked_out(market with {of} = p, 95, 130, 1)", place)
        at = {"spot": mp.mpf(100), "volatility": VOLATILITY, of: mp.mpf(place)}

        def exact(p: Any) -> Any:
            return knocked_out(*(at | {of: p}).values(), 95, 130)

        agrees(found, (float(exact(at[of])), float(mp.diff(exact, at[of], h=mp.mpf(10) ** -8))), 1e-10)


def test_the_book_is_the_sum_of_what_is_held() -> None:
    def exact(s: Any) -> Any:
        calls = sum(n * call(s, VOLATILITY, k) for n, k in ((2, 90), (-1, 100), (3, 110)))
        return calls + 20 * digital(s, VOLATILITY, 105) - 5 * knocked_out(s, VOLATILITY, 95, 130)

    with potto.settings(rtol=1e-7), mp.workdps(25):
        found = dual(OPTIONS, "by_spot", 100.0)
        agrees(found, (float(exact(mp.mpf(100))), float(mp.diff(exact, 100, h=mp.mpf(10) ** -8))), 1e-10)


def test_the_best_threshold_is_found() -> None:
    found = potto.fit(THRESHOLD.cost, {"threshold": 0.1}, given={"miss": 5, "alarm": 1})
    best = 0.75 + float(mp.log(mp.mpf(4) / 5)) / 1.5
    assert found.converged and abs(found["threshold"] - best) < 1e-6


@pytest.mark.parametrize("angle", [-0.4, 0.3, 1.2])
def test_a_probit_classifier_is_turned(angle: float) -> None:
    def exact(a: Any) -> Any:
        mean = mp.cos(a) + mp.sin(a) / 2
        return mp.ncdf(0.5 - mean) + mp.mpf(0.8) * mp.ncdf(-0.5)

    agrees(dual(THRESHOLD, r"\a . turned(a, 0.5)", angle), reference(exact, angle), 1e-10)


def test_the_best_classifier_looks_along_the_means() -> None:
    """Its angle is atan(1/2); the densities at the threshold balance at length/2 + log(4/5)/length."""
    with potto.settings(rtol=1e-9):
        found = potto.fit(THRESHOLD.turned, {"angle": 0.1, "threshold": 0.5})
    length = 1.25**0.5
    assert found.converged
    assert abs(found["angle"] - float(mp.atan(0.5))) < 1e-6
    assert abs(found["threshold"] - (length / 2 + float(mp.log(mp.mpf(4) / 5)) / length)) < 1e-6


@pytest.mark.parametrize("near", [0.05, 0.5, 3.0])
def test_hard_acceptance(near: float) -> None:
    """The derivative of a quotient is a difference, which loses digits: its bound says so, and holds."""
    for lam, place, exact in (
        (r"\e . posterior_mean(1.5, e)", near, lambda e: accepted(mp.mpf(1.5), e)),
        (rf"\s . posterior_mean(s, {near})", 1.5, lambda s: accepted(s, mp.mpf(near))),
    ):
        found, (value, slope) = ACCEPTANCE.eval(f"deriv({lam})(({place}, 1))"), reference(exact, place)
        assert abs(found.value - value) <= min(found.error + 1e-15, 1e-12) and found.error < 1e-8
        assert abs(found.tangent - slope) <= min(found.tangent_error + 1e-15, 1e-12) and found.tangent_error < 1e-8
