"""How numbers become colours: tones, maps, and the limits between which they go.

Owns `Paint`, the maps and the tones. Arrays of parts (k, n) become bytes (n, 3). A map is a few colours with straight
lines between them; those of values run from dark to light, diverging ones have white or gray at zero.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from msgspec import Struct

from potto.kernels.cells import Array

HOLE = (128, 128, 128)
DECADES = 16  # of an error map: from black, 1e-16, to white, 1
LOG_DECADES = 3  # that the tone `log` shows

# From the least number to the largest. Those of matplotlib, at ten places.
MAPS: dict[str, tuple[str, ...]] = {
    "gray": ("000000", "ffffff"),
    "viridis": ("440154", "482878", "3e4989", "31688e", "26828e", "1f9e89", "35b779", "6ece58", "b5de2b", "fde725"),
    "magma": ("000004", "180f3d", "440f76", "721f81", "9e2f7f", "cd4071", "f1605d", "fd9668", "feca8d", "fcfdbf"),
}
# From the deepest below zero to the highest above; the one in the middle is zero. The last two are of ColorBrewer.
DIVERGING: dict[str, tuple[str, ...]] = {
    "red-blue": ("0d26ff", "ffffff", "ff260d"),
    "brick-navy": (
        "053061", "2166ac", "4393c3", "92c5de", "d1e5f0", "f7f7f7", "fddbc7", "f4a582", "d6604d", "b2182b", "67001f",
    ),
    "purple-orange": (
        "2d004b", "542788", "8073ac", "b2abd2", "d8daeb", "f7f7f7", "fee0b6", "fdb863", "e08214", "b35806", "7f3b08",
    ),
}  # fmt: skip


class Tone(Struct, frozen=True):
    """How shares between 0 and 1 become levels between 0 and 1, and back."""

    forward: Callable[[Array], Array]
    backward: Callable[[Array], Array]


def _to_srgb(share: Array) -> Array:
    return np.where(share <= 0.0031308, 12.92 * share, 1.055 * np.maximum(share, 0.0) ** (1 / 2.4) - 0.055)


def _from_srgb(level: Array) -> Array:
    return np.where(level <= 0.04045, level / 12.92, ((np.maximum(level, 0.0) + 0.055) / 1.055) ** 2.4)


def _to_log(share: Array) -> Array:
    level: Array = np.log1p((10.0**LOG_DECADES - 1) * share) / (LOG_DECADES * np.log(10.0))
    return level


def _from_log(level: Array) -> Array:
    share: Array = np.expm1(LOG_DECADES * np.log(10.0) * level) / (10.0**LOG_DECADES - 1)
    return share


# linear: as it is. srgb: numbers are light, the file has what a screen wants. log: what is faint can be seen.
TONES = {
    "linear": Tone(lambda share: share, lambda level: level),
    "srgb": Tone(_to_srgb, _from_srgb),
    "log": Tone(_to_log, _from_log),
}


class Paint(Struct, frozen=True):
    """Colours for numbers from `low` to `high`; `even`, of a derivative, around zero. A tone works on the distance from
    zero then."""

    low: float
    high: float
    map: str = "gray"
    tone: str = "linear"
    even: bool = False

    @property
    def stops(self) -> Array:
        """The colours of the map, from 0 to 1: (colours, 3)."""
        texts = (DIVERGING if self.even else MAPS)[self.map]
        return np.array([[int(text[i : i + 2], 16) / 255 for i in (0, 2, 4)] for text in texts])

    def level(self, numbers: Array) -> Array:
        """Where numbers are along the map, from 0 to 1; nan stays nan."""
        if self.even:
            share = np.clip(numbers / (self.high or 1.0), -1.0, 1.0)
            return 0.5 + 0.5 * np.sign(share) * TONES[self.tone].forward(np.abs(share))
        return TONES[self.tone].forward(np.clip((numbers - self.low) / ((self.high - self.low) or 1.0), 0.0, 1.0))

    def number(self, level: float) -> float:
        """The number at a place of the map: the way back."""
        tone = TONES[self.tone].backward
        if self.even:
            away = 2 * level - 1
            return float(self.high * np.sign(away) * tone(np.abs(np.asarray(away))))
        return self.low + (self.high - self.low) * float(tone(np.asarray(level)))

    def colours(self, parts: Array) -> Any:
        """One part by the map, three as red, green and blue: bytes (n, 3). Of a derivative of colours zero is gray."""
        levels = self.level(parts[:3] if len(parts) >= 3 else parts[:1])
        if len(parts) >= 3:
            return as_bytes(levels)
        return as_bytes(self.along(levels[0]))

    def along(self, levels: Array) -> Array:
        """The colours at places of the map: (3, n) between 0 and 1."""
        stops = self.stops
        places = np.linspace(0.0, 1.0, len(stops))
        return np.stack([np.interp(levels, places, stops[:, channel]) for channel in range(3)])


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


def usual(parts: Array, *, even: bool = False) -> tuple[float, float]:
    """The limits that a picture has if nobody says otherwise: colours between 0 and 1 are meant as they are."""
    low, high = limits(parts, even=even)
    return (0.0, 1.0) if len(parts) >= 3 and not even and low >= 0 and high <= 1 else (low, high)


def coloured(
    components: Sequence[Sequence[float]], signed_values: bool
) -> tuple[list[tuple[int, int, int]], float, float]:
    """The colours of pixels given by plain numbers, part by part, and the least and the largest number."""
    parts = np.asarray(components, dtype=float)
    low, high = usual(parts, even=signed_values)
    rgb = Paint(low, high, "red-blue" if signed_values else "gray", even=signed_values).colours(parts)
    return [(r, g, b) for r, g, b in rgb.tolist()], *limits(parts)


def decades(parts: Array) -> Any:
    """The largest of the parts by its power of ten: black for 1e-16 and less, white for 1 and more."""
    with np.errstate(divide="ignore"):
        level = 1 + np.log10(np.max(np.abs(parts), axis=0)) / DECADES
    return as_bytes(np.repeat(np.clip(level, 0.0, 1.0)[None], 3, axis=0))


def as_bytes(levels: Array) -> Any:
    """Levels between 0 and 1 (3, n) as bytes (n, 3); where one is nan, there is a hole."""
    holes = np.isnan(levels).any(axis=0)
    rgb = np.round(255 * np.where(holes, 0.0, levels)).astype(np.uint8).T
    rgb[holes] = HOLE
    return rgb
