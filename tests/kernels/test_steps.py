"""Linear steps against themselves one by one, and what single numbers round off against batches."""

from __future__ import annotations

from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from potto.kernels.whole import ROUNDING, looked_through
from potto.runtime.evaluation.folds import steps
from potto.runtime.evaluation.folds.steps import carried, spread

SHAPES = st.tuples(st.integers(1, 140), st.sampled_from([(), (3,)]), st.integers(1, 3), st.integers(0, 1000))


def random_steps(shape: Any) -> Any:
    count, batch, d, seed = shape
    random = np.random.default_rng(seed)
    return random.normal(size=(count, *batch, d, d)) * 0.7, random


@given(SHAPES)
def test_vectors_are_carried_as_one_by_one(shape: Any) -> None:
    count, batch, d, _ = shape
    matrices, random = random_steps(shape)
    added, x = random.normal(size=(count, *batch, d, 2)), random.normal(size=(*batch, d, 2))
    found = carried(matrices, added, x)
    assert len(found) == count + 1
    for j in range(count):
        assert found[j] == pytest.approx(x, rel=1e-9, abs=1e-9)
        x = matrices[j] @ x + added[j]
    assert found[-1] == pytest.approx(x, rel=1e-9, abs=1e-9)


@given(SHAPES)
@pytest.mark.parametrize("most", [2, steps.MOST])  # with few columns errors are put into boxes again and again
def test_all_errors_of_before_are_bounded(most: int, shape: Any) -> None:
    """Whatever the signs: the sum of what every error can become is the sharp bound."""
    count, batch, d, _ = shape
    matrices, random = random_steps(shape)
    local, first = np.abs(random.normal(size=(count, *batch, d))), np.abs(random.normal(size=(*batch, d)))
    with patch.multiple(steps, MOST=most, NUMBERS=most):
        found = spread(matrices, local, first)
    errors = first[..., None] * np.eye(d)
    for j in range(count + 1):
        sharp = np.abs(errors).sum(axis=-1)
        assert np.all(found[j] >= sharp * (1 - 1e-12))
        if j < count:
            errors = np.concatenate([matrices[j] @ errors, local[j][..., None] * np.eye(d)], axis=-1)


def test_errors_that_turn_do_not_grow() -> None:
    angle = 0.3
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    found = spread(np.broadcast_to(turn, (5000, 2, 2)), np.zeros((5000, 2)), np.ones(2))
    assert np.all(found <= 2)  # one by one they would be (cos + sin)^5000


def test_errors_that_turn_along_an_ellipse_grow_as_the_steps_do() -> None:
    """A spring by the symplectic Euler method. Each block makes one box of errors, at most 2.5 times what is sharp;
    along axes alone the bound was 60 times that."""
    step, count = np.array([[1 - 3e-4, 0.01], [-0.03, 1]]), 10_000
    found = spread(np.broadcast_to(step, (count, 2, 2)), np.full((count, 2), 1e-16), np.zeros(2))
    power, sharp = np.eye(2), np.zeros(2)
    for _ in range(count):
        sharp += np.abs(power).sum(axis=-1) * 1e-16
        power = step @ power
    assert np.all(sharp * (1 - 1e-9) <= found[-1]) and np.all(found[-1] <= 2.5 * sharp)


def test_what_settles_beside_chaos_stays_small() -> None:
    found = spread(np.broadcast_to(np.diag([0.5, 3.0]), (300, 2, 2)), np.full((300, 2), 1e-16), np.zeros(2))
    assert found[-1, 0] == pytest.approx(2e-16, rel=1e-3, abs=0)


values = st.one_of(st.integers(-(2**54), 2**54).map(float), st.floats(-1e18, 1e18))


@given(st.sampled_from(["add", "mul", "div", "pow"]), st.lists(st.tuples(values, values), min_size=1, max_size=5))
def test_a_batch_that_is_looked_through_is_as_exact_as_numbers(op: str, pairs: list[tuple[float, float]]) -> None:
    operation: dict[str, Any] = {"add": np.add, "mul": np.multiply, "div": np.divide, "pow": np.power}
    if op == "pow":
        pairs = [(a, float(abs(b) % 7)) for a, b in pairs]
    a, b = (np.array(side) for side in zip(*pairs, strict=True))
    with np.errstate(all="ignore"):
        found = operation[op](a, b)
        with looked_through():
            off = ROUNDING[op](found, a, b)
        for place, (x, y) in enumerate(pairs):
            if np.isfinite(found[place]):
                assert off[place] == pytest.approx(ROUNDING[op](float(found[place]), x, y), rel=1e-12, abs=0)
