"""PNG with colours of 16 bits, of which Pillow keeps 8.

Owns `deep`. Two of the filters need what stands to the left, so they go byte by byte: a million pixels take seconds.
"""

from __future__ import annotations

import struct
import zlib
from typing import TYPE_CHECKING

from potto.data.mistakes import malformed

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

CHANNELS = {2: 3, 4: 2, 6: 4}  # by colour types: colours, grey with alpha, colours with alpha
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


def _inflated(content: bytes, length: int) -> bytes:
    at, parts = 8, []
    while at + 12 <= len(content):
        (size,) = struct.unpack(">I", content[at : at + 4])
        if content[at + 4 : at + 8] == b"IDAT":
            parts.append(content[at + 8 : at + 8 + size])
        at += 12 + size
    try:
        raw = zlib.decompressobj().decompress(b"".join(parts), length)
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
