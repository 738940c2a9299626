"""Scenes in every spelling: value, gradient and second derivatives are those of the closed forms."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scenes import Scene, scene

import potto

TOLERANCE = 1e-9  # of a number, or where it is less than 1; the closed forms are right to 1e-14


def numbers(answer: object) -> list[float]:
    """All numbers of an answer, in their order."""
    if isinstance(answer, dict):
        return [x for part in answer.values() for x in numbers(part)]
    if isinstance(answer, list | tuple):
        return [x for part in answer for x in numbers(part)]
    return np.asarray(answer, dtype=float).ravel().tolist()


def plain(asked: Scene) -> Iterator[tuple[str, int]]:
    """The parameters that are numbers, and where they are among all numbers."""
    for place, name in enumerate(asked.names):
        if isinstance(asked.arguments[place], float):
            yield name, [whose for whose, _ in asked.slots].index(place)


def expressions(asked: Scene) -> Iterator[tuple[str, object]]:
    """What is asked in Potto, and the right answer."""
    answer, given = asked.answer, asked.text
    yield f"f({given})", answer.value
    yield f"grad(f)({given})", answer.slopes
    for name, at in plain(asked):
        yield f"D(f, {name})({given})", answer.slopes[at]
        yield f"grad(D(f, {name}))({given})", answer.bends[at]
        yield f"D(grad(f), {name})({given})", answer.bends[at]
        for other, beside in plain(asked):
            yield f"D(D(f, {name}), {other})({given})", answer.bends[at, beside]


def calls(asked: Scene, f: potto.Function) -> Iterator[tuple[str, object, object]]:
    """What is asked in Python, what it gives, and the right answer."""
    answer = asked.answer
    yield "f", f(*asked.arguments), answer.value
    gradient = potto.grad(f, list(asked.names))(*asked.arguments)
    yield "grad", [gradient[name] for name in asked.names], answer.slopes
    for name, at in plain(asked):
        batch: list[object] = list(asked.arguments)
        place = asked.names.index(name)
        batch[place] = np.repeat(batch[place], 3)  # type: ignore[call-overload]
        yield f"a batch of {name}", f(*batch), [answer.value] * 3
        yield f"grad over a batch of {name}", potto.grad(f, [name])(*batch)[name], [answer.slopes[at]] * 3


@given(seed=st.integers(0, 10**9))
def test_a_scene_in_any_spelling(seed: int) -> None:
    asked = scene(seed)
    module = potto.compile(asked.program)
    for text, expected in expressions(asked):
        found = numbers(module.eval(text).value)
        assert found == pytest.approx(numbers(expected), rel=TOLERANCE, abs=TOLERANCE), f"{text}\n{asked.program}"
    for what, answer, expected in calls(asked, module.f):
        found = numbers(answer)
        assert found == pytest.approx(numbers(expected), rel=TOLERANCE, abs=TOLERANCE), f"{what}\n{asked.program}"
