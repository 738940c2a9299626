"""Random programs of all kinds, against brute force: values, derivatives to both sides, and errors that cover.

A fixed sample in the tests, new ones under `make fuzz` (2,000). There nothing may be wrong in silence, and what is
refused, or comes without a bound, is rare; each failure names the number that draws it again: `check(number)`.
"""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Callable, Iterable

import pytest
from how_many import examples
from program_checks import Wrong, check, held, tame

CHUNKS = examples(4, 20)
EACH = examples(9, 100)
# What a run on new programs may have: of sampled surfaces on bounds, and of cases that nobody has looked into yet.
RARE = ("refused", "slow", "one side", "sampled", "value without", "slope without", "no reason")


def outcomes(numbers: Iterable[int], checked: Callable[[int], str] = check) -> tuple[Counter[str], list[Wrong]]:
    counts: Counter[str] = Counter()
    wrong: list[Wrong] = []
    for number in numbers:
        try:
            counts[checked(number)] += 1
        except Wrong as failure:
            counts[failure.kind] += 1
            wrong.append(failure)
    return counts, wrong


@pytest.mark.parametrize("chunk", range(CHUNKS))
def test_programs_of_all_kinds(chunk: int) -> None:
    looking = EACH > 9
    pick = random.SystemRandom() if looking else random.Random(chunk)
    counts, wrong = outcomes([pick.randrange(10**9) for _ in range(EACH)])
    rare = [failure for failure in wrong if failure.kind.startswith(RARE)]
    allowed = EACH // 33 if looking else 0
    assert len(rare) == len(wrong) and len(rare) <= allowed, f"{counts}\n" + "\n".join(map(str, wrong))


@pytest.mark.slow
@pytest.mark.parametrize("start", range(10_000, 10_000 + examples(24, 840), 24))
def test_many_programs_converge_where_nothing_is_awkward(start: int) -> None:
    """Most of them do, and to what was asked for."""
    counts, wrong = outcomes(range(start, start + 24), lambda number: held(tame(number)))
    unbounded = [failure for failure in wrong if "inf" in str(failure)]  # the budget was spent, and the answer says so
    assert len(wrong) == len(unbounded) <= (1 if EACH > 9 else 0), "\n".join(map(str, wrong))
    assert counts["compared"] >= 18, counts
