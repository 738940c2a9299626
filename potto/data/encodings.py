"""Texts within files of data: bytes to characters, and names that programs can write.

Owns `text_of` and `identifiers`.
"""

from __future__ import annotations

import codecs
import re
import unicodedata
from collections.abc import Sequence
from itertools import count

from potto.data.mistakes import malformed

_WIDE = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
# What may stand in a name: superscripts are letters to `\w`, but exponents to a program.
_ODD = re.compile(r"[\W²³¹⁰⁴-⁹]+")
_AROUND = re.compile(r"^\W+|\W+$")
_UTF8 = "save it again as UTF-8 text"


def text_of(content: bytes) -> str:
    """The text of a file, without a byte order mark, its lines ending with LF."""
    if content.startswith(_WIDE):
        raise malformed("this is UTF-16 text, not UTF-8", hint=_UTF8)
    if b"\0" in content:
        row = content.count(b"\n", 0, content.index(b"\0")) + 1
        raise malformed(f"line {row} holds a NUL byte: this is not text", row=row, hint=_UTF8)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        at = error.start + (3 if content.startswith(codecs.BOM_UTF8) else 0)
        row, byte = content.count(b"\n", 0, at) + 1, f"{content[at]:#04x}"
        message = f"line {row} is not UTF-8 text: it holds the byte {byte}"
        raise malformed(message, row=row, found=byte, hint=_UTF8) from None
    return text.replace("\r\n", "\n").replace("\r", "\n") if "\r" in text else text


def identifiers(names: Sequence[str]) -> list[str]:
    """Names as programs can write them, all different: `speed (m/s)` is `speed_m_s`, `2nd` is `_2nd`, a second `x`
    is `x_2`. One that is left out is told by its number, as `column_3`."""
    clean = [_identifier(name) or f"column_{number}" for number, name in enumerate(names, 1)]
    taken, found = set(clean), dict[str, None]()
    for name in clean:
        if name in found:
            name = next(other for n in count(2) if (other := f"{name}_{n}") not in taken)
            taken.add(name)
        found[name] = None
    return list(found)


def _identifier(name: str) -> str:
    plain = _ODD.sub("_", _AROUND.sub("", unicodedata.normalize("NFC", name)))
    return f"_{plain}" if plain[:1].isdigit() or plain.startswith("λ") else plain
