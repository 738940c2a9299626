"""Random programs with arrays, records, folds and look-ups against plain numpy, which loops; slopes by differences, and
in reverse by every element of what is given.

A fixed sample in the tests, new programs under `make fuzz`, where nothing may be wrong in silence. Each failure names
the number that draws it again: `held(asked(number))`.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from how_many import examples
from program_arrays import array_program, given_arrays
from program_checks import Wrong, asked, held, where

import potto
from potto.python import derived_calls

EACH = examples(6, 100)
# What a run on new programs may have, as of programs without arrays.
RARE = ("refused", "slow", "one side", "sampled", "value without", "slope without")


@pytest.mark.parametrize("chunk", range(examples(5, 20)))
def test_programs_with_arrays(chunk: int) -> None:
    looking = EACH > 6
    pick = random.SystemRandom() if looking else random.Random(chunk)
    wrong: list[Wrong] = []
    for _ in range(EACH):
        try:
            held(replace(asked(pick.randrange(10**9)), source=array_program))
        except Wrong as failure:
            wrong.append(failure)
    rare = [failure for failure in wrong if failure.kind.startswith(RARE)]
    allowed = EACH // 33 if looking else 0
    assert len(rare) == len(wrong) and len(rare) <= allowed, "\n".join(map(str, wrong))


def leaves(form: Any) -> Iterator[float]:
    """The numbers of what nests tuples, lists and arrays, in order."""
    if isinstance(form, tuple | list | np.ndarray):
        for item in form:
            yield from leaves(item)
    else:
        yield float(form)


@pytest.mark.parametrize("chunk", range(examples(3, 20)))
def test_slopes_by_elements_add_up_to_those_along_a_direction(chunk: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """By all numbers that g is given, from a tape and forward: what f has along t and s, through how these move."""
    pick = random.SystemRandom() if EACH > 6 else random.Random(chunk + 1000)
    for _ in range(EACH):
        seed = pick.randrange(10**9)
        text, _ = array_program(seed, flat=True)
        point, module = where(seed), potto.compile(text)
        given, ahead = (given_arrays(seed, True, **point.moved(h)) for h in (0.0, 1.0))
        steps = [b - a for a, b in zip(leaves(list(given.values())), leaves(list(ahead.values())), strict=True)]
        along = potto.deriv(module.f)((point.t, point.dt), (point.s, point.ds))
        if along.notes or not along.converged:
            continue  # where it has two sides each way may take another one
        for many in (1, 10**9):
            monkeypatch.setattr(derived_calls, "MANY", many)
            slopes = potto.grad(module.g, list(given))(**given)
            parts = np.array([slope * step for slope, step in zip(leaves(slopes.tangent), steps, strict=True)])
            bars = float(np.sum(np.abs(steps) * np.array(list(leaves(slopes.tangent_error)))))
            off = 1e-12 * float(np.sum(np.abs(parts)) + 1) + bars + along.tangent_error
            assert abs(parts.sum() - along.tangent) <= off, f"{seed} {many}\n{text}{point}\n{parts.sum()} {along}"
