"""Large arrays have the memory of those that are gone, and of nobody else."""

from __future__ import annotations

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
