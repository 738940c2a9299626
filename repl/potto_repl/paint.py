"""Parts of a reply as text for a screen or a pipe.

Owns `painted` and `Screen`. What a screen cannot show is written in another way: symbols in ASCII, images as text.
"""

from __future__ import annotations

from msgspec import Struct

from potto.applications.framed import Image
from potto.applications.pictures import Plot
from potto.reports.render import COLORS, PLAIN, Palette
from potto_repl.backslash_symbols import ascii_only
from potto_repl.drawing import Protocol, braille, half_blocks, inline, room_for_curves, shrunk
from potto_repl.reply import Part

DIM, OFF = "\x1b[2m", "\x1b[0m"


class Screen(Struct, frozen=True):
    """What the screen can do.

    answers: whether an answer says under which name it stays at hand. breaks: whether prose is broken to its width.
    """

    color: bool = False
    unicode: bool = True
    width: int = 80
    images: Protocol = "blocks"
    answers: bool = True
    breaks: bool = False

    @property
    def palette(self) -> Palette:
        return COLORS if self.color else PLAIN


def painted(part: Part, look: Screen) -> str:
    """A part as it is written, without a final newline."""
    columns = look.width if look.breaks else None
    text = _picture(part, look) if part.kind == "picture" else part.shown(look.palette, columns)
    name = (part.data or {}).get("name")
    if not look.answers and name and text.startswith(f"{name} = "):
        text = text.removeprefix(f"{name} = ")
    if not look.unicode:
        text = ascii_only(text)
    return f"{DIM}{text}{OFF}" if look.color and part.kind in ("tail", "note") else text


def _picture(part: Part, look: Screen) -> str:
    data = part.data or {}
    picture = data.get("_picture")
    if isinstance(picture, Plot):
        width, height = room_for_curves(look.width), data.get("_height", 12)
        shown = braille(picture, width, height, unicode=look.unicode, color=look.color)
        return f"{shown}\n{data['_scale']}" if data.get("_scale") else shown
    if isinstance(picture, Image):
        if look.breaks and (not look.color or look.images == "blocks"):
            picture = shrunk(picture, look.width)
        if not look.color:
            shown = half_blocks(picture, unicode=look.unicode, color=False)
        else:
            shown = inline(picture, look.images, min(picture.size[0], look.width))
        return f"{shown}\n{data.get('_scale', '')}"
    return part.text
