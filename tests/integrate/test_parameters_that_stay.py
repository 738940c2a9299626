"""Several cuts in one variable at parameters that hardly move: right wherever they go, and soon in a fraction of the
calls of functions that it takes anywhere else."""

from __future__ import annotations

import mpmath as mp
import pytest
from call_counts import calls_in

import potto
from potto.kernels.making import counts

DIGITS = 30
CUTS = 6
PROGRAM = f"""
def f(t, u, s)
  integral [0, 2] exp(-x)*({" + ".join(f"{k}*[u*x < t/{k}]" for k in range(1, CUTS + 1))} + 7*[x < s]) d(x)
"""
STILL = [(0.75 + 1e-6 * i, 1.25, 1.1 - 1e-6 * i) for i in range(60)]


def exact(t: float, u: float, s: float) -> tuple[mp.mpf, list[mp.mpf]]:
    """The value and the derivatives: k times the integral of exp(-x) up to t/(k u)."""
    with mp.workdps(DIGITS):
        places = [(k, mp.mpf(t) / (k * mp.mpf(u))) for k in range(1, CUTS + 1)]
        value = sum(k * (1 - mp.exp(-x)) for k, x in places) + 7 * (1 - mp.exp(-mp.mpf(s)))
        along = sum(k * x * mp.exp(-x) for k, x in places)
        return value, [along / t, -along / u, 7 * mp.exp(-mp.mpf(s))]


@pytest.mark.parametrize("backend", ["numpy", "auto", "native"])
def test_right_where_they_stay_and_where_they_go(backend: str) -> None:
    """Within the bounds that answers give, and 1e-13 of the largest number, as one cut is off by 1e-15 of itself."""
    f = potto.compile(PROGRAM).f
    gradient = potto.grad(f, ["t", "u", "s"])
    away = [(0.75, 1.25, 0.13), (0.76, 1.24, 0.13), (1.5, 0.9, 0.5)]  # cuts pass each other
    with potto.settings(backend=backend):
        for at in (*STILL, *away, *STILL, *away, *STILL[::-1]):
            value, slopes = exact(*at)
            found = gradient(*at)
            assert abs(found.value - value) <= found.error < 1e-10
            for slope, number, error in zip(slopes, found.tangent, found.tangent_error, strict=True):
                assert abs(number - slope) <= error < 1e-10


def test_soon_with_few_calls() -> None:
    """Of functions, a third of what it takes where they move: about 40, and 400."""
    pytest.importorskip("llvmlite")
    f = potto.compile(PROGRAM).f
    moving = [(0.7 + 0.01 * i, 1.25, 1.1) for i in range(5)]
    with potto.settings(backend="native"):  # when numpy has done it for long enough depends on the time
        before = counts.native_points
        far = [calls_in(lambda at=at: f(*at)) for at in moving]  # type: ignore[misc]
        assert counts.native_points == before
        for at in STILL:
            f(*at)
        assert counts.native_points > before
        assert 3 * calls_in(lambda: f(*STILL[0])) < min(far)
