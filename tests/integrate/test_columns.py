"""Batches as columns: members picked and put back, whatever order they come in."""

from __future__ import annotations

import numpy as np
import pytest

from potto.integrate.columns import distinct, places_of, run_of
from potto.integrate.pieces import Sums


def numbered(count: int) -> Sums:
    """Sums whose values are the numbers of their members."""
    sums = Sums.zeros(1, 0, count)
    sums.v[0] = np.arange(count)
    return sums


@pytest.mark.parametrize("index", [[2, 3, 4], [2, 4, 3, 5], [0, 0, 2], [3], [4, 3, 2], [1, 1, 1], [0, 5]])
def test_members_are_those_that_were_asked_for(index: list[int]) -> None:
    places = np.array(index)
    assert numbered(6).pick(places).v[0].tolist() == index
    whole = numbered(6)
    part = numbered(len(index))
    whole.put(places, part)
    expected = np.arange(6.0)
    expected[places] = np.arange(len(index))
    assert whole.v[0].tolist() == expected.tolist()


def test_many_members_are_put_in_each_row() -> None:
    random = np.random.default_rng(0)
    whole, part = Sums.zeros(2, 3, 500), Sums.zeros(2, 3, 200)
    places = random.permutation(500)[:200]
    for x in part.arrays().values():
        x[...] = random.random(x.shape)
    whole.put(places, part)
    for name, x in whole.arrays().items():
        for number, place in enumerate(places):
            assert (x[..., place] == part.arrays()[name][..., number]).all()
        assert not np.delete(x, places, axis=-1).any()


def test_only_what_is_in_order_is_a_run() -> None:
    assert run_of(np.array([2, 3, 4])) == slice(2, 5)
    assert run_of(np.array([2, 4, 3, 5])) is None
    assert run_of(np.array([0, 2, 2])) is None


@pytest.mark.parametrize("kind", [np.int64, np.uint16])
@pytest.mark.parametrize("step", [1, 7, 10_000])
def test_places_among_the_numbers_that_there_are(kind: type, step: int) -> None:
    numbers = (np.random.default_rng(0).integers(0, 6, 300) * step + 3).astype(kind)
    known = distinct(numbers)
    assert known.tolist() == sorted(set(numbers.tolist()))
    assert (known[places_of(known, numbers)] == numbers).all()
    assert places_of(known, numbers[:2]).tolist() == [known.tolist().index(n) for n in numbers[:2].tolist()]
