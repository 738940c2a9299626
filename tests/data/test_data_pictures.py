"""Pictures: what Pillow and the tests write is read; sizes are found without Pillow."""

from __future__ import annotations

import io
import struct
import sys
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from data_files import mistake, plain
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from potto.data import DataMistake, NumberArray, NumberRow, RealNumber, Sizes, shape, shape_of, thumbnail, values_of
from potto.data.files import MEMORY
from potto.extras import install_command

Image: Any = pytest.importorskip("PIL.Image")

sides = st.tuples(st.integers(1, 6), st.integers(1, 6))


def written(pixels: npt.NDArray[Any], kind: str = "PNG", mode: str | None = None, **how: Any) -> bytes:
    file = io.BytesIO()
    image = Image.fromarray(pixels)
    (image.convert(mode) if mode else image).save(file, kind, **how)
    return file.getvalue()


def light(content: bytes, name: str = "p.png") -> npt.NDArray[np.float64]:
    return np.array(plain(name, content))


@given(sides.flatmap(lambda side: hnp.arrays(np.uint8, side)))
def test_grey(pixels: npt.NDArray[np.uint8]) -> None:
    assert np.array_equal(light(written(pixels)), pixels / 255)
    assert shape_of(Path("p.png"), written(pixels)) == Sizes(pixels.shape, RealNumber())


@given(sides.flatmap(lambda side: hnp.arrays(np.uint16, side)))
def test_grey_of_sixteen_bits(pixels: npt.NDArray[np.uint16]) -> None:
    assert np.array_equal(light(written(pixels)), pixels / 65535)


@given(sides.flatmap(lambda side: hnp.arrays(np.uint8, (*side, 3))))
def test_colours(pixels: npt.NDArray[np.uint8]) -> None:
    assert np.array_equal(light(written(pixels)), pixels / 255)
    assert shape_of(Path("p.PNG"), written(pixels)) == Sizes(pixels.shape[:2], NumberRow(3))


@given(sides.flatmap(lambda side: hnp.arrays(np.uint8, (*side, 4))))
def test_transparency_is_dropped(pixels: npt.NDArray[np.uint8]) -> None:
    assert np.array_equal(light(written(pixels)), pixels[..., :3] / 255)
    grey = Image.fromarray(pixels).convert("LA")
    file = io.BytesIO()
    grey.save(file, "PNG")
    assert np.array_equal(light(file.getvalue()), np.asarray(grey)[..., 0] / 255)


def test_palettes_and_bits() -> None:
    pixels = np.zeros((4, 5, 3), np.uint8)
    pixels[1:, 2:] = (255, 128, 0)
    content = written(pixels, mode="P")
    assert content[25] == 3
    assert np.array_equal(light(content), np.asarray(Image.open(io.BytesIO(content)).convert("RGB")) / 255)
    bits = written(pixels[..., 0], mode="1")
    assert bits[24] == 1 and np.array_equal(light(bits), pixels[..., 0] / 255)


@pytest.mark.parametrize(("shape", "item"), [((7, 9), RealNumber()), ((7, 9, 3), NumberRow(3))])
@pytest.mark.parametrize("how", [{}, {"progressive": True}, {"comment": b"x" * 300}])
def test_jpeg(shape: tuple[int, ...], item: object, how: dict[str, Any]) -> None:
    content = written(np.full(shape, 200, np.uint8), "JPEG", quality=95, **how)
    assert shape_of(Path("p.jpeg"), content) == Sizes((7, 9), item)  # type: ignore[arg-type]
    assert np.allclose(light(content, "p.jpg"), 200 / 255, rtol=0, atol=0.01)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("orientation", range(10))
def test_a_jpeg_is_turned_as_its_notes_say(orientation: int, order: str) -> None:
    """Against Pillow's own way; what is no orientation turns nothing."""
    pixels = np.zeros((16, 24, 3), np.uint8)
    pixels[:8, :16] = (250, 120, 30)
    mark = b"II*\0" if order == "<" else b"MM\0*"
    make, turn = (
        struct.pack(order + "HHIHH", tag, 3, 1, value, 0) for tag, value in ((0x0100, 9), (0x0112, orientation))
    )
    notes = b"Exif\0\0" + mark + struct.pack(order + "IH", 8, 2) + make + turn + bytes(4)
    content = written(pixels, "JPEG", exif=notes)
    with Image.open(io.BytesIO(content)) as image:
        wanted = np.asarray(pytest.importorskip("PIL.ImageOps").exif_transpose(image)) / 255
    assert shape_of(Path("p.jpg"), content) == Sizes(wanted.shape[:2], NumberRow(3))
    assert np.array_equal(light(content, "p.jpg"), wanted)


@pytest.mark.parametrize("kept", range(0, 20, 3))
def test_notes_that_are_cut_off_turn_nothing(kept: int) -> None:
    notes = b"Exif\0\0" + (b"II*\0" + struct.pack("<IHHHIHH", 8, 1, 0x0112, 3, 1, 6, 0))[:kept]
    content = written(np.zeros((4, 6, 3), np.uint8), "JPEG", exif=notes)
    assert shape_of(Path("p.jpg"), content) == Sizes((4, 6), NumberRow(3))
    assert light(content, "p.jpg").shape == (4, 6, 3)


def test_jpeg_for_printing() -> None:
    content = written(np.full((4, 4, 3), 250, np.uint8), "JPEG", mode="CMYK")
    assert shape_of(Path("p.jpg"), content) == Sizes((4, 4), NumberRow(3))
    assert np.allclose(light(content, "p.jpg"), 250 / 255, rtol=0, atol=0.02)


def deep(pixels: npt.NDArray[np.uint16], filters: list[int]) -> bytes:
    """A PNG of 16 bits a channel, each line by a filter of its own."""
    height, width, channels = pixels.shape
    lines = pixels.astype(">u2").reshape(height, -1).view(np.uint8).astype(int)
    up = np.vstack([np.zeros_like(lines[:1]), lines[:-1]])
    before = ((0, 0), (2 * channels, 0))
    left, corner = np.pad(lines, before)[:, : lines.shape[1]], np.pad(up, before)[:, : lines.shape[1]]
    far = np.abs(np.stack([up - corner, left - corner, left + up - 2 * corner]))
    paeth = np.choose(far.argmin(axis=0), [left, up, corner])
    guesses = [np.zeros_like(lines), left, up, (left + up) // 2, paeth]
    raw = b"".join(
        bytes([kind]) + ((lines[at] - guesses[kind][at]) % 256).astype(np.uint8).tobytes()
        for at, kind in enumerate(filters)
    )
    head = struct.pack(">IIBBBBB", width, height, 16, {2: 4, 3: 2, 4: 6}[channels], 0, 0, 0)
    packed = zlib.compress(raw)
    parts = [(b"IHDR", head), (b"IDAT", packed[:20]), (b"IDAT", packed[20:]), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in parts
    )


@given(st.data(), sides, st.sampled_from([2, 3, 4]))
def test_colours_of_sixteen_bits(data: st.DataObject, side: tuple[int, int], channels: int) -> None:
    pixels = data.draw(hnp.arrays(np.uint16, (*side, channels)))
    content = deep(pixels, data.draw(st.lists(st.integers(0, 4), min_size=side[0], max_size=side[0])))
    expected = pixels[..., 0] if channels == 2 else pixels[..., :3]
    assert np.array_equal(light(content), expected / 65535)
    with Image.open(io.BytesIO(content)) as image:  # what Pillow makes of the same file: the upper halves
        halves = np.asarray(image)[..., 0 if channels == 2 else slice(3)]
        assert np.array_equal(halves, expected >> 8)


def test_what_is_said_without_pillow(monkeypatch: pytest.MonkeyPatch) -> None:
    content = written(np.zeros((2, 3), np.uint8))
    MEMORY.clear()
    monkeypatch.setitem(sys.modules, "PIL", None)
    found = mistake("p.png", content)
    assert (found.code, found.hint) == ("P0804", install_command("images"))
    assert shape_of(Path("p.png"), content) == Sizes((2, 3))
    monkeypatch.undo()
    assert isinstance(values_of(Path("p.png"), content), NumberArray)


@pytest.mark.parametrize("name", ["p.png", "p.jpg"])
@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "the file is empty"),
        (b"GIF89a", "the file is neither PNG nor JPEG: it does not start like one"),
        (b"\x89PNG\r\n\x1a\n", "the head of the PNG file is broken"),
        (b"\xff\xd8\xff\xe0\x00\x04ab", "the JPEG file does not say how large the picture is"),
    ],
)
def test_malformed_files(name: str, content: bytes, message: str) -> None:
    found = mistake(name, content)
    assert (found.code, found.message) == ("P0805", message)
    assert shape_of(Path(name), content) == found


def test_truncated_files() -> None:
    pixels = np.random.default_rng(1).integers(0, 65536, (10, 100, 3), np.uint16)
    plain = pixels.astype(np.uint8)
    for content in (written(plain), written(plain, "JPEG"), deep(pixels, [4] * 10)):
        found = mistake("p.png", content[:-400])
        assert found.code == "P0805" and found.message.startswith("the picture can't be read: ")


@given(st.data())
def test_damaged_files_are_answered(data: st.DataObject) -> None:
    pixels = np.arange(108, dtype=np.uint8).reshape(6, 6, 3)
    wide = deep(pixels.astype(np.uint16), [4] * 6)
    content = data.draw(st.sampled_from([written(pixels), written(pixels, "JPEG"), wide]))
    at, byte = data.draw(st.integers(0, len(content) - 1)), data.draw(st.integers(0, 255))
    for damaged in (content[:at] + bytes([byte]) + content[at + 1 :], content[:at]):
        told, value = shape_of(Path("p.png"), damaged), values_of(Path("p.png"), damaged)
        if content[1:4] == b"PNG":
            assert told == (value if isinstance(value, DataMistake) else shape(value))


@given(sides.flatmap(lambda side: hnp.arrays(np.uint8, side)) | sides.flatmap(lambda s: hnp.arrays(np.uint8, (*s, 3))))
def test_thumbnails_of_small_pictures_are_the_pictures(pixels: npt.NDArray[np.uint8]) -> None:
    value = values_of(Path("p.png"), written(pixels))
    assert isinstance(value, NumberArray)
    small = thumbnail(value)
    assert small is not None and np.array_equal(np.asarray(Image.open(io.BytesIO(small))), pixels)
