"""Images of functions: values over a grid of pixels, and how numbers become colours.

Owns `Grid`, `sampled` and the colours. The pixels of a band are one array call; where the program has no value, the
image has a hole, and the pixels around it are found by halving the band.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from typing import Any

import numpy as np
from msgspec import Struct

from potto.applications.png import encode
from potto.diagnostics import PottoError
from potto.kernels.cells import Array
from potto.kernels.errors import WRONG_CALL
from potto.runtime.answers.batches import INTERRUPTED
from potto.runtime.answers.estimate import Estimate
from potto.runtime.evaluation.record import Gauge, watching

BAND = 1 << 18  # pixels of one array call, which is evaluated in blocks
HOLE = (128, 128, 128)
DECADES = 16  # of an error map: from black, 1e-16, to white, 1


class Grid(Struct, frozen=True):
    """Pixels over a box of the plane; the first row is the top one."""

    width: int
    height: int
    box: tuple[float, float, float, float] = (0.0, 1.0, 0.0, 1.0)  # x0, x1, y0, y1

    def middles(self) -> tuple[Array, Array]:
        """The coordinates of the middles of all pixels, row by row: (height * width,) each."""
        x0, x1, y0, y1 = self.box
        across = x0 + (x1 - x0) * (np.arange(self.width) + 0.5) / self.width
        down = y1 - (y1 - y0) * (np.arange(self.height) + 0.5) / self.height
        return np.tile(across, self.height), np.repeat(down, self.width)


class Sampled(Struct):
    """Numbers at places: (parts, n), nan where there is none; how many have none, and what went wrong first.

    answers: the estimates that the numbers were taken from, one or more a band.
    """

    numbers: Array
    holes: int = 0
    trouble: PottoError | None = None
    answers: list[Estimate] = []

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
        return any(INTERRUPTED in answer.shortfalls for answer in self.answers)


Call = Callable[..., tuple[Sequence[Any], Estimate]]  # places to the parts that are drawn, and where they are from


def sampled(call: Call, places: Sequence[Array], progress: Callable[[int], None] | None = None) -> Sampled:
    """The parts of a call at many places, band by band. `progress` is told how many are done. Of a call that was
    interrupted what it has done is kept, and no other follows.

    Raises the PottoError of the first place if the call has no value at any, or if it is no call of the function.
    """
    count = places[0].size
    found = Sampled(np.empty((0, count)))
    for start in range(0, count, BAND):
        stop = min(start + BAND, count)
        with nullcontext() if progress is None else watching(_gauge(progress, start, stop)):
            _fill(call, places, start, stop, found)
        if found.interrupted:
            break
        if progress is not None:
            progress(stop)
    if found.trouble is not None and found.holes == count:
        raise found.trouble
    return found


def _gauge(progress: Callable[[int], None], start: int, stop: int) -> Gauge:
    """What tells how many are done while one band is."""
    gauge = Gauge()
    gauge.told = lambda: progress(start + int(gauge.share * (stop - start)))
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


def flat(value: Any) -> list[Any]:
    """The numbers of an answer, tuples and lists taken apart."""
    if isinstance(value, tuple | list):
        return [number for item in value for number in flat(item)]
    return [value]


# Colours: arrays of parts (k, n) to bytes (n, 3)


def limits(parts: Array, *, even: bool = False) -> tuple[float, float]:
    """The least and the largest finite number; `even`: as far below zero as above."""
    finite = parts[np.isfinite(parts)]
    if not finite.size:
        return (-1.0, 1.0) if even else (0.0, 1.0)
    low, high = float(finite.min()), float(finite.max())
    if even:
        most = max(-low, high) or 1.0
        return -most, most
    return low, high


def shades(parts: Array, low: float, high: float) -> Any:
    """One part in greys from black (`low`) to white, three and more as red, green and blue."""
    level = np.clip((parts - low) / ((high - low) or 1.0), 0.0, 1.0)
    return _bytes(level[:3] if len(parts) >= 3 else np.repeat(level[:1], 3, axis=0))


def signed(parts: Array, low: float, high: float) -> Any:
    """Zero white, what is above it red, what is below it blue; `high` = -`low` is the deepest.

    Of three parts and more each is a channel, and zero is gray.
    """
    if len(parts) >= 3:
        return shades(parts, low, high)
    share = np.clip(parts[0] / (high or 1.0), -1.0, 1.0)
    up, down = np.maximum(share, 0.0), np.maximum(-share, 0.0)
    return _bytes(np.stack([1 - 0.95 * down, 1 - 0.85 * (up + down), 1 - 0.95 * up]))


def coloured(
    components: Sequence[Sequence[float]], signed_values: bool
) -> tuple[list[tuple[int, int, int]], float, float]:
    """The colours of pixels given by plain numbers, part by part, and the least and the largest number."""
    parts = np.asarray(components, dtype=float)
    low, high = limits(parts, even=signed_values)
    if len(parts) >= 3 and not signed_values and low >= 0 and high <= 1:
        low, high = 0.0, 1.0  # colours as they are meant
    rgb = (signed if signed_values else shades)(parts, low, high)
    return [(r, g, b) for r, g, b in rgb.tolist()], *limits(parts)


def decades(parts: Array) -> Any:
    """The largest of the parts by its power of ten: black for 1e-16 and less, white for 1 and more."""
    with np.errstate(divide="ignore"):
        level = 1 + np.log10(np.max(np.abs(parts), axis=0)) / DECADES
    return _bytes(np.repeat(np.clip(level, 0.0, 1.0)[None], 3, axis=0))


def _bytes(levels: Array) -> Any:
    holes = np.isnan(levels).any(axis=0)
    rgb = np.round(255 * np.where(holes, 0.0, levels)).astype(np.uint8).T
    rgb[holes] = HOLE
    return rgb


def largest(parts: Array) -> float:
    """The largest finite number; nan if there is none."""
    finite = parts[np.isfinite(parts)]
    return float(finite.max()) if finite.size else float("nan")


def save_array(path: str, parts: Array, grid: Grid) -> None:
    """Write numbers as a .npy file: (height, width), with a last axis for several parts. Raises OSError."""
    shaped = parts.reshape(len(parts), grid.height, grid.width)
    np.save(path, shaped[0] if len(shaped) == 1 else np.moveaxis(shaped, 0, -1))


def png(rgb: Any, grid: Grid) -> bytes:
    """The bytes of colours as a PNG file."""
    return encode(np.ascontiguousarray(rgb).tobytes(), grid.width, grid.height)
