"""PNG files, as far as we need them: eight bits a channel, red, green and blue, and alpha if it is given.

Owns `encode` and `png`. A library would bring dozens of formats for the sake of these few lines.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence

Color = tuple[int, int, int]


def encode(rgb: bytes, width: int, height: int, quick: bool = False) -> bytes:
    """Pixels row by row from the top, three or four bytes each, as a PNG file; `quick`: larger, in less time."""
    channels, rest = divmod(len(rgb), max(width * height, 1))
    if rest or channels not in (3, 4):
        raise ValueError(f"{len(rgb)} bytes are not {width} x {height} pixels")
    stride = channels * width
    raw = b"".join(b"\x00" + rgb[i * stride : (i + 1) * stride] for i in range(height))
    head = struct.pack(">IIBBBBB", width, height, 8, 2 if channels == 3 else 6, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + _chunk(b"IHDR", head)
        + _chunk(b"IDAT", zlib.compress(raw, 1 if quick else 9))
        + _chunk(b"IEND", b"")
    )


def png(pixels: Sequence[Sequence[Color]]) -> bytes:
    """Pixels as a PNG file."""
    return encode(bytes(channel for row in pixels for pixel in row for channel in pixel), len(pixels[0]), len(pixels))


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
