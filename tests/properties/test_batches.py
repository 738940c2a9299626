"""Batches by numpy and as machine code against one integral at a time, in every order of the variables: nothing may be
off by more than both say.

A few programs in the tests, new ones under `make fuzz`. Each failure names the number that draws it: `check(number)`.
"""

from __future__ import annotations

import random
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from batch_programs import Drawn, drawn
from how_many import LOOKING, examples

import potto
from potto.diagnostics import PottoError

MEMBERS = 5  # of a batch, which are integrated by themselves
BUDGET = 200_000
ROUNDING = 1e-12  # what is not looked at, as a part of a number, or of 1
NUMBERS = [random.SystemRandom().randrange(10**9) if LOOKING else 7 * n for n in range(examples(8, 400))]


def gradient(text: str, asked: Drawn, backend: Any, *members: int) -> Any:
    f = potto.compile(text).f
    arguments = asked.at(members[0]) if members else asked.arguments
    with potto.settings(max_evals=BUDGET, rtol=asked.rtol, backend=backend):
        return potto.grad(f, list(asked.moving))(*arguments)


def parts(answer: Any, asked: Drawn, at: int | None = None) -> Iterator[tuple[str, float, float]]:
    """Value and derivatives with how far off each may be; of one member of a batch."""
    for what, numbers, errors in (
        ("value", answer.value, answer.error),
        *((f"d/d{name}", answer.tangent[i], answer.tangent_error[i]) for i, name in enumerate(asked.moving)),
    ):
        yield what, *(float(x if at is None else np.broadcast_to(x, asked.size)[at]) for x in (numbers, errors))


def apart(some: Iterator[tuple[str, float, float]], others: Iterator[tuple[str, float, float]]) -> Iterator[str]:
    """What of two answers cannot both be true."""
    for (what, x, off), (_, y, beyond) in zip(some, others, strict=True):
        if not (np.isnan(x) or np.isnan(y) or x == y or abs(x - y) <= off + beyond + ROUNDING * (1 + abs(y))):
            yield f"{what}: {x!r} ± {off:.2g} and {y!r} ± {beyond:.2g}"


def check(number: int) -> list[str]:
    """What is wrong with the program of a number."""
    asked, found = drawn(number), []
    pick = random.Random(number)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            batches = {backend: gradient(asked.text, asked, backend) for backend in ("numpy", "native")}
            for i in pick.sample(range(asked.size), MEMBERS):
                alone = gradient(asked.text, asked, "auto", i)
                answers = {f"in a batch by {name}": parts(batch, asked, i) for name, batch in batches.items()}
                for text in asked.others if not alone.notes else ():
                    answers[f"as {text}"] = parts(gradient(text, asked, "auto", i), asked)
                for name, other in answers.items():
                    found += [f"at {asked.at(i)} {name} {gap}" for gap in apart(parts(alone, asked), other)]
        except PottoError as refused:
            if not refused.diagnostics or refused.diagnostics[0].code[:3] not in ("P04", "P05"):
                raise
    return [f"{number} (rtol {asked.rtol}): {asked.text}{gap}" for gap in found]


@pytest.mark.parametrize("chunk", range(len(NUMBERS) // 8))
def test_a_batch_is_its_members(chunk: int) -> None:
    wrong = [gap for number in NUMBERS[8 * chunk : 8 * chunk + 8] for gap in check(number)]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("number", [14_000_690])
def test_a_batch_of_which_nobody_knows_who_met_something(number: int) -> None:
    """Of members that are looked at together none was kept: what they had met was told of nobody, which crashed."""
    assert not check(number)
