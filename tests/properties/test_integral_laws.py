"""Laws that hold whatever the integrand is: a fixed sample in the tests, new ones under `make fuzz` (2,000).

Each failure names the number that draws it again: `kept(number)`.
"""

from __future__ import annotations

import random
from collections import Counter

import pytest
from how_many import examples
from program_laws import Broken, kept

CHUNKS = examples(2, 20)
EACH = examples(7, 100)
RARE = ("refused", "slow")  # what a run on new programs may have now and then


@pytest.mark.parametrize("chunk", range(CHUNKS))
def test_laws_are_kept(chunk: int) -> None:
    pick = random.SystemRandom() if EACH > 7 else random.Random(chunk)
    counts: Counter[str] = Counter()
    broken: list[Broken] = []
    for _ in range(EACH):
        try:
            counts[kept(pick.randrange(10**9))] += 1
        except Broken as failure:
            broken.append(failure)
    rare = [failure for failure in broken if failure.kind.startswith(RARE)]
    assert len(rare) == len(broken) and len(rare) <= EACH // 33, f"{counts}\n" + "\n".join(map(str, broken))
    assert counts["kept"] > EACH // 2, counts
