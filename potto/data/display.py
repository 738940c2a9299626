"""How values of files are shown: in a line, and as a small picture.

Owns `summary` and `thumbnail`.
"""

from __future__ import annotations

import struct
import zlib
from typing import TYPE_CHECKING

from potto.data.values import NumberArray, NumberRow, RealNumber, Table, Value

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

_BLOCKS = "▁▂▃▄▅▆▇█"
_WIDEST = 24  # blocks
_MOST = 4  # columns of a table
_SIDE = 64  # pixels


def summary(value: Value) -> str:
    """A value in a line: shape, range, mean, and its course.

    `[100] from 0 to 9.9, mean 4.95 ▁▁▂▂▃▃▄▄▅▅▆▆▇▇██`
    """
    if isinstance(value, Table):
        shown = [f"{name} {_within(field)}" for name, field in value.fields[:_MOST]]
        more = len(value.fields) - len(shown)
        left_out = [f"without {', '.join(value.texts)}: no numbers"] if value.texts else []
        left_out += [f"without {name}: no value in line {line}" for name, line in value.gaps]
        return "; ".join([*shown, *([f"and {more} more"] if more else []), *left_out])
    if not isinstance(value, NumberArray):
        return _short(value)
    length = value.item.length if isinstance(value.item, NumberRow) else 1
    lines = value.values.reshape(-1, length)
    low, high = float(lines.min()), float(lines.max())
    scale = max(abs(low), abs(high)) or 1.0  # so that no sum is too large
    lines = lines / scale
    mean = float(lines.mean()) * scale
    spread = f"from {_short(low)} to {_short(high)}, mean {_short(mean)}" if low < high else f"all {_short(low)}"
    rows = f" of rows of {length}" if isinstance(value.item, NumberRow) else ""
    return f"[{', '.join(map(str, value.dimensions))}]{rows} {spread} {_course(lines)}"


def _within(value: Value) -> str:
    """A field in the line of its table."""
    return f"({summary(value)})" if isinstance(value, Table) else summary(value)


def _short(number: float) -> str:
    return f"{number:.4g}"


def _course(lines: npt.NDArray[np.float64]) -> str:
    """The means of lines in their order as blocks of eight heights."""
    import numpy as np

    count, length = lines.shape
    most = min(count, _WIDEST)
    edges = np.arange(most + 1) * count // most * length
    means = np.add.reduceat(lines.reshape(-1), edges[:-1]) / np.diff(edges)
    low, high = float(means.min()), float(means.max())
    if high - low <= 1e-12:
        return _BLOCKS[0] * len(means)
    steps = (means - low) / (high - low) * len(_BLOCKS) + 1e-9  # what is in the middle but for rounding stays there
    heights = np.minimum(steps.astype(int), len(_BLOCKS) - 1)
    return "".join(_BLOCKS[height] for height in heights.tolist())


def _blocks(values: npt.NDArray[np.float64], axis: int, most: int) -> npt.NDArray[np.float64]:
    """At most so many values along an axis: means of neighbours."""
    import numpy as np

    length = values.shape[axis]
    if length <= most:
        return values
    edges = np.arange(most + 1) * length // most
    sums = np.add.reduceat(values, edges[:-1], axis)
    along = [1] * values.ndim
    along[axis] = most
    return np.asarray(sums / np.diff(edges).reshape(along))


def thumbnail(value: Value) -> bytes | None:
    """A PNG of at most 64 x 64 pixels of an array in two directions; None if it is none.

    Numbers from 0 to 1 are light as they are, others from the least, black, to the greatest, white.
    """
    import numpy as np

    if (
        not isinstance(value, NumberArray)
        or len(value.dimensions) != 2
        or value.item not in (RealNumber(), NumberRow(3))
    ):
        return None
    light = value.values.reshape(*value.dimensions, -1)
    scale = float(np.abs(light).max()) or 1.0
    low, high = float(light.min()), float(light.max())
    if low < 0 or high > 1:
        light = (light / scale - low / scale) / ((high / scale - low / scale) or 1.0)
    factor = max(1.0, max(value.dimensions) / _SIDE)
    height, width = (max(1, round(length / factor)) for length in value.dimensions)
    small = _blocks(_blocks(light, 0, height), 1, width)
    return _png(np.round(np.clip(small, 0, 1) * 255).astype(np.uint8))


def _png(pixels: npt.NDArray[np.uint8]) -> bytes:
    height, width, channels = pixels.shape
    head = struct.pack(">IIBBBBB", width, height, 8, 2 if channels == 3 else 0, 0, 0, 0)
    raw = b"".join(b"\0" + row.tobytes() for row in pixels)
    return b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", head) + _chunk(b"IDAT", zlib.compress(raw, 9)) + _chunk(b"IEND", b"")


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
