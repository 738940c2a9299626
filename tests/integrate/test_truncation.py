"""What the decay of Legendre coefficients says of powers of the distance to an end, against their integrals."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from potto.integrate.fixed.cells.alike import ORDERS
from potto.integrate.rules.gauss import analytic_truncation, decay_of_power, gauss, truncation
from potto.kernels.cells import Array

EPS = 2.0**-52


def off(n: int, power: float) -> float:
    """The error of the rule with n nodes for x^power on [0, 1], its nodes as they are."""
    rule = gauss(n)
    with mp.workdps(40):
        found = mp.fsum(mp.mpf(float(w)) * mp.mpf(float(x)) ** power for x, w in zip(rule.nodes, rule.weights))
        return float(abs(found - 1 / (mp.mpf(power) + 1)))


def sizes(n: int, power: float) -> Array:
    rule = gauss(n)
    found: Array = np.abs(rule.nodes**power @ rule.transform)
    return found


@pytest.mark.parametrize("n", [6, 8, 10, 11, 12, 14])
def test_no_power_at_an_end_is_off_by_more_than_its_bound(n: int) -> None:
    """Those whose coefficients fall as if geometrically up to the last, a little below n, were by up to 2,000 times."""
    for power in np.arange(-0.65, n + 2, 0.1):
        error = off(n, float(power))
        assert error <= float(truncation(sizes(n, float(power)), True)) + 16 * EPS, power


@pytest.mark.parametrize(("n", "power"), [(8, 0.5), (11, 2.3), (16, 4.7)])
def test_coefficients_of_a_power_go_on_as_they_do(n: int, power: float) -> None:
    """Shifted Legendre coefficients of x^p: (2k + 1) (-p)(1 - p)…(k - 1 - p)/((p + 1)…(p + k + 1)), here their sizes
    without the factor 2k + 1 that the rule leaves to the norm."""
    with mp.workdps(30):
        c = [abs(mp.rf(-mp.mpf(power), k) / mp.rf(mp.mpf(power) + 1, k + 1)) for k in range(2 * n + 1)]
    last = float((c[n - 1] + c[n - 2]) / (c[n - 3] + c[n - 4]))
    assert float(decay_of_power(n, np.array(last))) == pytest.approx(float(c[2 * n] / c[n - 1]), rel=0.5)


@pytest.mark.parametrize("distance", [0.05, 0.3, 1.0, 10.0])
@pytest.mark.parametrize("power", [-1.0, 0.5, -2.5])
def test_more_nodes_leave_out_no_more_than_the_first_coefficients_tell(power: float, distance: float) -> None:
    """Of (x + d)^p, whose integral is a difference of powers: by the first m coefficients at n nodes, m < n, as of
    rules that were skipped. 64 eps of the largest number is what rounding leaves."""
    for n in ORDERS:
        rule = gauss(n)
        with mp.workdps(40):
            p, low, high = mp.mpf(power), mp.mpf(distance), mp.mpf(distance) + 1
            nodes = [(low + mp.mpf(float(x))) ** p for x in rule.nodes]
            found = mp.fsum(mp.mpf(float(w)) * y for w, y in zip(rule.weights, nodes))
            exact = mp.log(high / low) if power == -1 else (high ** (p + 1) - low ** (p + 1)) / (p + 1)
            error, rounding = float(abs(found - exact)), 64 * EPS * float(max(low**p, high**p))
        coefficients = np.abs(np.array(list(map(float, nodes))) @ rule.transform)
        for m in ORDERS[: ORDERS.index(n)]:
            assert error <= float(analytic_truncation(coefficients[:m], m)) + rounding, (n, m)
