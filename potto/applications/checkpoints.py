"""How far a fit has come, kept in a file: written after every step, and where the next fit goes on from.

The file is JSON: the best place met, its value, and steps so far. It is replaced whole, so that whatever interrupts a
fit leaves the last step that was done. What a method has learned of the curvature is not kept.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping

from potto.applications.minimization import Iterate
from potto.kernels.errors import wrong_call


def kept(path: str, start: Mapping[str, float]) -> dict[str, float]:
    """Where to start: at what the file holds, or at `start` where there is none. Raises PottoError for another fit's
    file, and for one that cannot be read."""
    try:
        with open(path, encoding="utf-8") as stream:
            found = json.load(stream)["parameters"]
        numbers = {name: float(value) for name, value in found.items()}
    except FileNotFoundError:
        return dict(start)
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise wrong_call(f"`{path}` is not a checkpoint of a fit: {error}", "name another file, or remove it") from None
    if numbers.keys() != start.keys():
        has, wanted = ", ".join(numbers), ", ".join(start)
        raise wrong_call(f"`{path}` is a checkpoint of a fit of {has}, not of {wanted}", "name another file")
    return {name: numbers[name] for name in start}


def keeping(path: str, names: tuple[str, ...], told: Callable[[Iterate], None] | None) -> Callable[[Iterate], None]:
    """Who is told of steps writes them to the file, and tells the other."""

    def step(step: Iterate) -> None:
        found = {"parameters": dict(zip(names, step.parameters, strict=True)), "value": step.value,
                 "step": step.number, "evaluations": step.evaluations}  # fmt: skip
        with open(path + ".part", "w", encoding="utf-8") as stream:
            json.dump(found, stream)
        os.replace(path + ".part", path)
        if told is not None:
            told(step)

    return step
