"""PNG by its chunks and lines: whether it is sound, and colours of 16 bits, of which Pillow keeps 8.

Owns `deep`, and `is_sound` for any PNG. Two of the filters need what stands to the left, so they go byte by byte: a
million pixels take seconds.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from typing import TYPE_CHECKING

from potto.data.mistakes import malformed

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

CHANNELS = {2: 3, 4: 2, 6: 4}  # by colour types: colours, grey with alpha, colours with alpha
_AT_ONCE = 2**20  # bytes of pixels: small files can hold gigabytes of the same ones
_AGAIN = "write the picture again as PNG"


def deep(content: bytes, height: int, width: int, colour: int) -> npt.NDArray[np.uint16]:
    """The values of a picture that is not interlaced, in lines of pixels of channels."""
    import numpy as np

    step = 2 * CHANNELS[colour]
    stride = step * width
    raw = _inflated(content, height * (stride + 1))
    lines = np.empty((height, stride), np.uint8)
    above = bytes(stride)
    for number in range(height):
        at = number * (stride + 1)
        above = _line(raw[at], raw[at + 1 : at + 1 + stride], above, step)
        lines[number] = np.frombuffer(above, np.uint8)
    return lines.view(">u2").astype(np.uint16).reshape(height, width, CHANNELS[colour])


def is_sound(content: bytes) -> bool:
    """Whether all that a PNG holds has the sums that stand behind it, to its end, and the pixels can be unpacked."""
    kind, pixels = b"", zlib.decompressobj()
    for kind, data, told in _chunks(content):
        if zlib.crc32(kind + data) != told:
            return False
        rest = data if kind == b"IDAT" else b""
        try:
            while rest:
                pixels.decompress(rest, _AT_ONCE)
                rest = pixels.unconsumed_tail
        except zlib.error:
            return False
    return kind == b"IEND" and pixels.eof


def _chunks(content: bytes) -> Iterator[tuple[bytes, bytes, int]]:
    """The parts of a PNG: of which kind, what is in them, and the sum by which that is known to be right."""
    at = 8
    while at + 12 <= len(content):
        (size,) = struct.unpack(">I", content[at : at + 4])
        end = at + 8 + size
        (told,) = struct.unpack(">I", content[end : end + 4].rjust(4, b"\0"))
        yield content[at + 4 : at + 8], content[at + 8 : end], told
        at = end + 4


def _inflated(content: bytes, length: int) -> bytes:
    packed = b"".join(data for kind, data, _ in _chunks(content) if kind == b"IDAT")
    try:
        raw = zlib.decompressobj().decompress(packed, length)
    except zlib.error as error:
        raise malformed(f"the picture can't be read: {error}", hint=_AGAIN) from None
    if len(raw) < length:
        raise malformed("the picture can't be read: it ends too early", hint=_AGAIN)
    return raw


def _line(kind: int, line: bytes, above: bytes, step: int) -> bytes:
    """A line without its filter."""
    import numpy as np

    if kind == 0:
        return line
    if kind == 1:
        return np.frombuffer(line, np.uint8).reshape(-1, step).cumsum(axis=0, dtype=np.uint8).tobytes()
    if kind == 2:
        return (np.frombuffer(line, np.uint8) + np.frombuffer(above, np.uint8)).tobytes()
    if kind == 3:
        return _averaged(line, above, step)
    if kind == 4:
        return _predicted(line, above, step)
    raise malformed(f"the picture can't be read: there is no filter {kind}", hint=_AGAIN)


def _averaged(line: bytes, above: bytes, step: int) -> bytes:
    found = bytearray(step) + line
    for at, up in enumerate(above):
        found[at + step] = (found[at + step] + (found[at] + up) // 2) & 255
    return bytes(found[step:])


def _predicted(line: bytes, above: bytes, step: int) -> bytes:
    """Paeth's filter: whichever of left, above and corner is nearest to left + above - corner, in this order."""
    found = bytearray(step) + line
    for at, (up, corner) in enumerate(zip(above, bytes(step) + above)):
        left = found[at]
        by_left, by_up, by_corner = abs(up - corner), abs(left - corner), abs(left + up - 2 * corner)
        near = left if by_left <= by_up and by_left <= by_corner else up if by_up <= by_corner else corner
        found[at + step] = (found[at + step] + near) & 255
    return bytes(found[step:])
