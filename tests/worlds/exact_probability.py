"""Probability: expectations in closed form, for numbers of mpmath."""

from __future__ import annotations

from typing import Any

import mpmath as mp


def truncated_moments(a: Any, b: Any) -> tuple[Any, Any]:
    mass = mp.ncdf(b) - mp.ncdf(a)
    return (mp.npdf(a) - mp.npdf(b)) / mass, 1 + (a * mp.npdf(a) - b * mp.npdf(b)) / mass


def expected_cost(q: Any) -> Any:
    m, s = mp.mpf(3), mp.mpf(0.4)
    z, mean = (mp.log(q) - m) / s, mp.exp(m + s * s / 2)
    return q * mp.ncdf(z) - mean * mp.ncdf(z - s) + 3 * (mean * mp.ncdf(s - z) - q * mp.ncdf(-z))


RATE, VOLATILITY = mp.mpf(0.03), mp.mpf(0.2)


def call(spot: Any, volatility: Any, strike: int) -> Any:
    d = (mp.log(spot / strike) + (RATE - volatility**2 / 2)) / volatility
    return spot * mp.ncdf(d + volatility) - strike * mp.exp(-RATE) * mp.ncdf(d)


def digital(spot: Any, volatility: Any, strike: int) -> Any:
    return mp.exp(-RATE) * mp.ncdf((mp.log(spot / strike) + (RATE - volatility**2 / 2)) / volatility)


def knocked_out(spot: Any, volatility: Any, strike: int, barrier: int) -> Any:
    """The second half of the year in closed form, the first by quadrature up to the barrier."""
    drift, spread = (RATE - volatility**2 / 2) / 2, volatility / mp.sqrt(2)

    def later(half: Any) -> Any:
        low, high = ((mp.log(k / half) - drift) / spread for k in (strike, barrier))
        mean = half * mp.exp(drift + spread**2 / 2)
        return mean * (mp.ncdf(high - spread) - mp.ncdf(low - spread)) - strike * (mp.ncdf(high) - mp.ncdf(low))

    top = (mp.log(barrier / spot) - drift) / spread
    places = mp.linspace(-12, top, 10)
    half = mp.quad(lambda z: mp.npdf(z) * later(spot * mp.exp(drift + spread * z)), places, method="gauss-legendre")
    return mp.exp(-RATE) * half


def accepted(seen: Any, near: Any) -> Any:
    """The posterior mean: x is normal with variance 5, p given x has the mean 4 x/5."""
    low, high = (seen - near) / mp.sqrt(5), (seen + near) / mp.sqrt(5)
    return 4 / mp.sqrt(5) * (mp.npdf(low) - mp.npdf(high)) / (mp.ncdf(high) - mp.ncdf(low))
