"""Images of functions: values over a grid of pixels.

Owns `Grid` and `sampled`. The pixels of a band are one array call; where the program has no value, the
image has a hole, and the pixels around it are found by halving the band.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from typing import Any

import numpy as np
from msgspec import Struct

from potto.diagnostics import PottoError
from potto.kernels.cells import Array
from potto.kernels.errors import WRONG_CALL
from potto.runtime.answers.batches import INTERRUPTED
from potto.runtime.answers.estimate import Estimate
from potto.runtime.evaluation.gauge import Gauge, watching

BAND = 1 << 18  # pixels of one array call, which is evaluated in blocks


class Grid(Struct, frozen=True):
    """Pixels over a box of the plane; the first row is the top one, which is y1, whether that is the larger or not."""

    width: int
    height: int
    box: tuple[float, float, float, float] = (0.0, 1.0, 0.0, 1.0)  # x0, x1, y0, y1

    def sides(self) -> tuple[Array, Array]:
        """The middles of the pixels across, and those down, from the top: (width,) and (height,)."""
        x0, x1, y0, y1 = self.box
        across = x0 + (x1 - x0) * (np.arange(self.width) + 0.5) / self.width
        down = y1 - (y1 - y0) * (np.arange(self.height) + 0.5) / self.height
        return across, down

    def middles(self) -> tuple[Array, Array]:
        """The coordinates of the middles of all pixels, row by row: (height * width,) each."""
        across, down = self.sides()
        return np.tile(across, self.height), np.repeat(down, self.width)


class Sampled(Struct):
    """Numbers at places: (parts, n), nan where there is none; how many have none, and what went wrong first.

    answers: the estimates that the numbers were taken from, one or more a band.
    stopped: whether somebody did not want to wait between two of them.
    """

    numbers: Array
    holes: int = 0
    trouble: PottoError | None = None
    answers: list[Estimate] = []
    stopped: bool = False

    @property
    def evaluations(self) -> int:
        return sum(answer.evals for answer in self.answers)

    @property
    def reasons(self) -> list[str]:
        """Why numbers are not as accurate as was asked."""
        return list(dict.fromkeys(reason for answer in self.answers for reason in answer.reasons))

    @property
    def interrupted(self) -> bool:
        """Whether somebody did not want to wait for the rest."""
        return self.stopped or any(INTERRUPTED in answer.shortfalls for answer in self.answers)


Call = Callable[..., tuple[Sequence[Any], Estimate]]  # places to the parts that are drawn, and where they are from


def sampled(call: Call, places: Sequence[Array], progress: Callable[[int], None] | None = None) -> Sampled:
    """The parts of a call at many places, band by band. `progress` is told how many are done. Of a call that was
    interrupted what it has done is kept, and no other follows.

    Raises the PottoError of the first place if the call has no value at any, or if it is not a call of the function.
    """
    count = places[0].size
    found = Sampled(np.empty((0, count)))
    for start in range(0, count, BAND):
        stop = min(start + BAND, count)
        with nullcontext() if progress is None else watching(_gauge(progress, start, stop)):
            try:
                _fill(call, places, start, stop, found)
            except KeyboardInterrupt:
                if not found.answers:
                    raise
                found.stopped = True
        if found.interrupted:
            break
        if progress is not None:
            progress(stop)
    if found.trouble is not None and found.holes == count:
        raise found.trouble
    return found


def _gauge(progress: Callable[[int], None], start: int, stop: int) -> Gauge:
    """What tells how many are done while one band is."""
    gauge, known = Gauge(), start

    def told() -> None:
        nonlocal known
        done = start if gauge.limit else start + int(gauge.share * (stop - start))
        if done > known:
            known = done
            progress(done)

    gauge.told = told
    return gauge


def _fill(call: Call, places: Sequence[Array], start: int, stop: int, found: Sampled) -> None:
    """One band; in halves if it has no value as a whole."""
    count = stop - start
    here = [float(p[start]) for p in places] if count == 1 else [p[start:stop] for p in places]
    try:
        parts, answer = call(*here)
    except PottoError as error:
        if any(diagnostic.code == WRONG_CALL.code for diagnostic in error.diagnostics):
            raise  # as it would everywhere
        found.trouble = found.trouble or error
        if count == 1:
            found.holes += 1
        else:
            middle = start + count // 2
            _fill(call, places, start, middle, found)
            _fill(call, places, middle, stop, found)
        return
    if not found.numbers.size:
        found.numbers = np.full((len(parts), places[0].size), np.nan)
    for row, part in zip(found.numbers, parts, strict=True):
        row[start:stop] = part
    found.answers.append(answer)


def flat(value: Any, axes: int = 0) -> list[Any]:
    """The numbers of an answer over a batch of so many axes: tuples and lists taken apart, and arrays by their own
    axes, which come behind those of the batch."""
    if isinstance(value, tuple | list):
        return [number for item in value for number in flat(item, axes)]
    own = np.ndim(value) - axes
    if own <= 0:
        return [value]
    return list(np.moveaxis(np.reshape(value, (*np.shape(value)[:axes], -1)), -1, 0))


def accurate(parts: Array, errors: Array, rtol: float, atol: float) -> bool:
    """Whether no number of an image is off by more than was asked for, beside the largest that it shows."""
    within = max(atol, rtol * largest(np.abs(parts)))
    return bool((np.isnan(parts) | (errors <= within)).all())


def largest(parts: Array) -> float:
    """The largest finite number; nan if there is none."""
    finite = parts[np.isfinite(parts)]
    return float(finite.max()) if finite.size else float("nan")
