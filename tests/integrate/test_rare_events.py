"""Events so rare that hardly a sample meets them: bars must cover what was not seen.

Closed forms by hand. Bars are four standard errors and more, so that of 1,280 runs (of `make fuzz` 4,800)
none may lie outside of its own; a seed that saw nothing must say so.
"""

from __future__ import annotations

import pytest
from how_many import examples

import potto

SEEDS = examples(40, 150)

RARE = [  # what is integrated, the parameter, value, derivative
    ("integral ([0, 1], [0, 1]) [x + y < b] d(x, y)", 0.01, 5e-5, 0.01),
    ("integral ([0, 1], [0, 1]) [x < b]*[y < b] d(x, y)", 0.01, 1e-4, 0.02),
    ("integral ([0, 1], [0, 1]) (1 + [x + y < b]) d(x, y)", 0.01, 1 + 5e-5, 0.01),
    ("integral ([0, 1], [0, 1]) (2 - [x*x < b]*[y < 0.01]) d(x, y)", 1e-4, 2 - 1e-4, -0.5),
    ("integral ([0, 1], [0, 1]) (if [x + y < b] then 3 else x) d(x, y)", 0.01, 0.5 + 1.5e-4 - 1e-6 / 6, 0.03 - 5e-5),
    ("integral ([0, 1], [0, 1], [0, 1]) [x + y + z > 3 - b] d(x, y, z)", 0.05, 0.05**3 / 6, 0.05**2 / 2),
    ("integral ([0, 1], [0, 1], [0, 1]) [x + y + z < b] d(x, y, z)", 0.05, 0.05**3 / 6, 0.05**2 / 2),
    ("integral (x ~ uniform(0, 1), y ~ uniform(0, 1)) [x > 1 - b and y > 1 - b] d(x, y)", 0.01, 1e-4, 0.02),
]


@pytest.mark.slow
@pytest.mark.parametrize("method", ["mc", "qmc"])
@pytest.mark.parametrize("samples", [100, 1000])
@pytest.mark.parametrize(("body", "b", "value", "tangent"), RARE, ids=[row[0] for row in RARE])
def test_no_seed_is_beyond_its_bar(
    body: str, b: float, value: float, tangent: float, samples: int, method: str
) -> None:
    dual = potto.deriv(potto.compile(f"def f(b)\n    {body}").f)
    for seed in range(SEEDS):
        with potto.settings(method=method, samples=samples, seed=seed):
            answer = dual((b, 1.0))
        assert abs(answer.value - value) <= answer.error + 1e-15, seed
        assert abs(answer.tangent - tangent) <= answer.tangent_error + 1e-15, seed


def test_a_surface_that_is_out_of_reach_costs_no_bar() -> None:
    """Nothing crosses x + y = 5 in the unit square: interval arithmetic says so, whatever was drawn."""
    dual = potto.deriv(potto.compile("def f(b)\n    integral ([0, 1], [0, 1]) (1 + [x + y < b]) d(x, y)").f)
    with potto.settings(method="mc", samples=100):
        answer = dual((5.0, 1.0))
    assert answer.value == 2.0 and answer.tangent == 0.0
    assert answer.error <= 1e-14 and answer.tangent_error == 0.0
