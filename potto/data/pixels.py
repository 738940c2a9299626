"""Pictures: PNG and JPEG as arrays of light, from 0 to 1.

Owns `picture_head`, which finds sizes in the bytes of a sound file, and `picture`, which needs Pillow for all but
colours of 16 bits: of those Pillow keeps 8, which is what interlaced ones are left with. A grey picture is an array of
numbers, a coloured one of rows of three. Transparency is dropped, palettes are looked up; a JPEG is turned as a note
in it says (the orientation of Exif 2.32, 4.6.4): as whoever looks at it sees it.
"""

from __future__ import annotations

import io
import struct
from typing import TYPE_CHECKING, Any

from msgspec import Struct

from potto.data.mistakes import NO_PACKAGE, DataMistake, DataRefused, malformed
from potto.data.scanlines import CHANNELS, deep, is_sound
from potto.data.values import Item, NumberArray, NumberRow, RealNumber, Sizes
from potto.extras import install_command

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

_PNG, _JPEG = b"\x89PNG\r\n\x1a\n", b"\xff\xd8"
_GREY, _GREY_ALPHA = 0, 4  # colour types of PNG
# The segments of JPEG that tell sizes: start of frame, but not those of tables, which lie between.
_FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_END = b"\xff\xd9"  # of a JPEG; within its pixels no such bytes stand beside each other
_BARE = frozenset({0x01, *range(0xD0, 0xD9)})  # segments without a length
# What Pillow calls the turn that an orientation asks for.
_TURNS = {
    2: "FLIP_LEFT_RIGHT", 3: "ROTATE_180", 4: "FLIP_TOP_BOTTOM", 5: "TRANSPOSE", 6: "ROTATE_270", 7: "TRANSVERSE",
    8: "ROTATE_90",
}  # fmt: skip
_ON_THEIR_SIDE = 5  # orientations from which on rows become columns
_EXIF, _NOTES, _ORIENTATION = b"Exif\0\0", 0xE1, 0x0112
_AGAIN = "write the picture again as PNG or JPEG"


class _Head(Struct, frozen=True):
    """Sizes, whether there are colours, and the colour type of a PNG whose values Pillow would cut to 8 bits. sound:
    the file is whole, as far as that is seen without Pillow. turn: to be done to what is stored; sizes are those after
    it."""

    height: int
    width: int
    coloured: bool
    deep: int | None = None
    sound: bool = True
    turn: str | None = None

    @property
    def item(self) -> Item:
        return NumberRow(3) if self.coloured else RealNumber()


def picture_head(content: bytes) -> Sizes | None:
    """The shape of a picture; None for one that may be damaged."""
    head = _head(content)
    return Sizes((head.height, head.width), head.item) if head.sound else None


def picture(content: bytes) -> NumberArray:
    """The pixels of a picture, row by row from the top."""
    head = _head(content)
    numbers = _pixels(content, head) if head.deep is None else _deep(content, head, head.deep)
    return NumberArray((head.height, head.width), head.item, numbers)


def _head(content: bytes) -> _Head:
    if not content:
        raise malformed("the file is empty", hint=_AGAIN)
    if content.startswith(_PNG):
        head = _png(content)
    elif content.startswith(_JPEG):
        head = _jpeg(content)
    else:
        raise malformed("the file is neither PNG nor JPEG: it does not start like one", hint=_AGAIN)
    if not head.height or not head.width:
        raise malformed(f"the picture has no pixels: it is {head.width} x {head.height}", hint=_AGAIN)
    return head


def _png(content: bytes) -> _Head:
    if content[12:16] != b"IHDR" or len(content) < 33:
        raise malformed("the head of the PNG file is broken", hint=_AGAIN)
    width, height, depth, colour, interlaced = struct.unpack(">IIBBxxB", content[16:29])
    deep = colour if depth == 16 and colour in CHANNELS and not interlaced else None
    return _Head(height, width, colour not in (_GREY, _GREY_ALPHA), deep, is_sound(content))


def _jpeg(content: bytes) -> _Head:
    at, orientation = 2, 1
    while at + 4 <= len(content) and content[at] == 0xFF:
        mark = content[at + 1]
        if mark == 0xFF or mark in _BARE:  # filling, or nothing but a mark
            at += 1 if mark == 0xFF else 2
            continue
        if mark in _FRAMES and at + 10 <= len(content):
            height, width, channels = struct.unpack(">HHB", content[at + 5 : at + 10])
            if orientation >= _ON_THEIR_SIDE:
                height, width = width, height
            whole = content.find(_END, at) >= 0
            return _Head(height, width, channels > 1, sound=whole, turn=_TURNS.get(orientation))
        (size,) = struct.unpack(">H", content[at + 2 : at + 4])
        if mark == _NOTES and content.startswith(_EXIF, at + 4):
            orientation = _orientation(content[at + 4 + len(_EXIF) : at + 2 + size])
        at += 2 + size
    raise malformed("the JPEG file does not say how large the picture is", hint=_AGAIN)


def _orientation(notes: bytes) -> int:
    """The orientation among notes, which are a TIFF file; 1, as it is stored, where there is none."""
    order = {b"II": "<", b"MM": ">"}.get(notes[:2])
    if order is None or len(notes) < 8:
        return 1
    (at,) = struct.unpack_from(order + "I", notes, 4)
    count = struct.unpack_from(order + "H", notes, at)[0] if at + 2 <= len(notes) else 0
    for entry in range(at + 2, min(at + 2 + 12 * count, len(notes) - 11), 12):
        tag, _, _, value = struct.unpack_from(order + "HHIH", notes, entry)
        if tag == _ORIENTATION:
            return value if value in _TURNS else 1
    return 1


def _pixels(content: bytes, head: _Head) -> npt.NDArray[np.float64]:
    import numpy as np

    try:
        from PIL import Image
    except ImportError:
        raise DataRefused(_without_pillow()) from None
    try:
        with Image.open(io.BytesIO(content), formats=("PNG", "JPEG")) as image:
            plain = _converted(image, head)
            if head.turn is not None:
                plain = plain.transpose(Image.Transpose[head.turn])
            largest = 65535.0 if plain.mode.startswith("I") else 255.0
            found = np.ascontiguousarray(plain, np.float64)
    except (OSError, SyntaxError, ValueError, EOFError, struct.error, Image.DecompressionBombError) as error:
        raise malformed(f"the picture can't be read: {error}", hint=_AGAIN) from None
    if found.size != head.height * head.width * (3 if head.coloured else 1):
        raise malformed("the picture is not as large as its head says", hint=_AGAIN)
    found /= largest
    return found


def _deep(content: bytes, head: _Head, colour: int) -> npt.NDArray[np.float64]:
    import numpy as np

    channels = deep(content, head.height, head.width, colour)
    return np.ascontiguousarray(channels[:, :, : 3 if head.coloured else 1] / 65535.0)


def _converted(image: Any, head: _Head) -> Any:
    """The picture in one of three modes: colours, grey, grey of 16 bits."""
    if head.coloured:
        return image.convert("RGB")
    return image if image.mode.startswith("I") else image.convert("L")


def _without_pillow() -> DataMistake:
    message = "to read pictures takes Pillow, which is not installed"
    return DataMistake(NO_PACKAGE, message, expected="Pillow", hint=install_command("images"))
