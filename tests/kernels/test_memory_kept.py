"""Large arrays have the memory of those that are gone, and of nobody else."""

from __future__ import annotations

import os

import numpy as np
import pytest

import potto
from potto.kernels import memory
from potto.kernels.memory import LARGE, MOST, room


def test_memory_of_arrays_that_are_gone_is_used_again() -> None:
    count = LARGE // 8 + 12_340  # a size that no other test asks for
    first = room(count)
    where = first.ctypes.data
    part = first[4:].reshape(8, -1)[1:]
    del first
    part[:] = 1.0
    assert room(count).ctypes.data != where  # somebody has a part of it
    assert (part == 1.0).all()
    del part
    assert room(4, count // 4).ctypes.data == where


def test_no_more_memory_is_kept_than_some() -> None:
    """What is in use is its owner's; what is larger than all that is kept is not."""
    many = [room(MOST // 8 // 4) for _ in range(8)]
    assert len({a.ctypes.data for a in many}) == 8
    assert sum(block.size for block in memory._blocks) <= MOST
    before = list(map(id, memory._blocks))
    room(2 * MOST // 8)
    assert list(map(id, memory._blocks)) == before


@pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are not copies of one another here")
@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_memory_is_not_shared_with_processes_that_are_forked_off() -> None:
    """Pixels of one process were those of another: blocks were mapped to be shared."""
    mine = room(LARGE)
    mine[:] = 1.0
    child = os.fork()
    if not child:
        mine[:] = 2.0
        os._exit(0)
    os.waitpid(child, 0)
    assert (mine == 1.0).all()


@pytest.mark.parametrize("body", ["x", "integral [0, 1] x*s d(s)", "integral [0, 1] [s < x] d(s)"])
def test_answers_are_in_nobody_elses_hands(body: str) -> None:
    """What is done to an answer changes neither arguments nor its other parts, nor the answers to come."""
    f, x = potto.grad(potto.compile(f"def f(x) {body}").f, "x"), np.linspace(0.1, 0.9, 1 << 16)
    given, first = x.copy(), f(x)
    parts = first.value, first.error, first.tangent, first.tangent_error
    for number, part in enumerate(parts):
        part[:] = -1.0 - number
    assert (x == given).all() and [part[7] for part in parts] == [-1.0, -2.0, -3.0, -4.0]
    again = f(x)
    assert (again.value > 0).all() and (again.tangent > 0).all() and (again.error >= 0).all()
