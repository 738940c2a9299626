"""How sampled points are spread: more of them where cuts are close together, with weights that make up for it; and the
same points whatever the length of the chunks that they come in."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import potto
from potto.integrate.montecarlo import sampling
from potto.integrate.montecarlo.cube_map import ascending, crowd

SHARE = 2.0**-4
EVEN = (np.arange(40_000) + 0.5) / 40_000

PLACES = {
    "one thin": [0.3, 0.3 + 1e-6],
    "at the ends": [1e-9, 1 - 1e-3],
    "unsorted, twice the same": [0.9, 0.2, 0.2, 0.21],
    "more rows than are compared in pairs": [0.5, 0.51, 0.1, 0.11, 0.9, 0.7, 0.72, 0.3],
    "nothing but thin ones": list(np.arange(1, 24) / 24),
}


@pytest.mark.parametrize("name", PLACES)
@pytest.mark.parametrize("rows", ["one for all", "one for each"])
def test_weights_make_up_for_where_points_are(name: str, rows: str) -> None:
    """Means over even points of 1, x and x^2; off by half a cell at each cut, at most, with a weight of 16, at most."""
    places = [np.full(EVEN.shape, x) if rows == "one for each" else np.array(x) for x in PLACES[name]]
    label, weight = crowd(ascending(places), SHARE, EVEN)
    assert weight is not None and (np.diff(label) >= 0).all() and label[0] >= 0 and label[-1] <= 1
    for power in range(3):
        assert np.mean(weight * label**power) == pytest.approx(1 / (power + 1), rel=0, abs=25 * 16 / 40_000 / 2)
    ends = np.sort([0.0, *PLACES[name], 1.0])
    for low, high in itertools.pairwise(ends):
        if high > low and name != "nothing but thin ones":
            assert np.mean((label >= low) & (label <= high)) >= 0.9 * min(SHARE, high - low)


def test_points_beside_thick_stretches_stay() -> None:
    places = np.where(EVEN < 0.5, 0.4, 0.01)
    label, weight = crowd(ascending([places]), SHARE, EVEN)
    assert weight is not None
    assert (label[EVEN < 0.5] == EVEN[EVEN < 0.5]).all() and (weight[EVEN < 0.5] == 1).all()


@pytest.mark.parametrize("method", ["mc", "qmc"])
def test_answers_do_not_depend_on_chunks(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Equal but for the order in which 40,000 samples are added up: 40,000 roundings of 1e-16 at most."""
    program = potto.grad(potto.compile("def f(t) integral ([0, 1], [0, 1]) exp(x*y)*[x*x + y < t] d(x, y)").f, "t")
    found = []
    for chunk in (1 << 14, 1 << 10):
        monkeypatch.setattr(sampling, "CHUNK", chunk)
        with potto.settings(method=method, samples=40_000, seed=3):
            found.append(program(t=0.8))
    one, other = found
    assert (one.value, one.tangent) == pytest.approx((other.value, other.tangent), rel=4e-12, abs=0)
    assert (one.error, one.tangent_error) == pytest.approx((other.error, other.tangent_error), rel=1e-6, abs=0)
