"""A picture of a function: a curve for one number, an image for two. For the evaluation process alone.

Owns `preview`. The whole picture is one batch.
"""

from __future__ import annotations

import base64
import struct
import zlib
from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from potto.diagnostics import PottoError
from potto.python.api import Module
from potto.python.functions import Function
from potto.runtime.answers.printing import format_digits, format_range
from potto_lsp.sampling import NoSamples, argument

if TYPE_CHECKING:
    from potto.evaluating.world import World

SIZE, CURVE = 128, 256  # pixels along a side of an image, and along a curve
Array = np.ndarray[Any, np.dtype[Any]]


class NoPicture(Exception):
    """Why something has no picture, for the user to read."""


def preview(
    world: World, file: str, name: str, box: Any, axes: Sequence[str], given: Mapping[str, str]
) -> dict[str, Any]:
    """The picture of a function as a data URI, and a text that describes it. Raises NoPicture.

    `given`: texts for the parameters that are functions. `axes`: the ranges of the others.
    """
    module = Module(world, file)
    function = getattr(module, name, None)
    (x0, x1), (y0, y1) = _box(box)
    if not isinstance(function, Function):
        raise _none(name)
    values = partial(_values, function) if not given else partial(_given_values, module, function, axes, given)
    said = name if not given else f"{name} with {', '.join(f'{key} = {text}' for key, text in given.items())},"
    xs = np.linspace(x0, x1, CURVE)
    curve = values((xs,))
    if curve is not None:
        return {"image": _uri(_plot(curve)), "text": _text(said, curve, _side(x0, x1)), "kind": "curve"}
    grid = np.meshgrid(np.linspace(x0, x1, SIZE), np.linspace(y1, y0, SIZE))
    image = values(tuple(grid))
    if image is None:
        raise _none(name)
    return {
        "image": _uri(_shade(image)), "kind": "image",
        "text": _text(said, image, f"{_side(x0, x1)} × {_side(y0, y1)}"),
    }  # fmt: skip


def _given_values(
    module: Module, function: Function, axes: Sequence[str], given: Mapping[str, str], arguments: tuple[Array, ...]
) -> Array | None:
    """The values over a batch of a function that also takes functions; None if it has another number of numbers."""
    if len(axes) != len(arguments):
        return None
    try:
        functions = {key: argument(module, key, text) for key, text in given.items()}
        value = np.asarray(function(**dict(zip(axes, arguments)), **functions).value, dtype=float)
    except (NoSamples, PottoError, AttributeError, TypeError, ValueError) as error:
        raise NoPicture(str(error)) from None
    return np.broadcast_to(value, arguments[0].shape)


def _none(name: str) -> NoPicture:
    return NoPicture(f"`{name}` is not a function of one or two numbers that gives a number")


def _box(box: Any) -> tuple[tuple[float, float], tuple[float, float]]:
    try:
        (x0, x1), (y0, y1) = box
        return (float(x0), float(x1)), (float(y0), float(y1))
    except (TypeError, ValueError):
        return (0.0, 1.0), (0.0, 1.0)


def _values(function: Function, arguments: tuple[Array, ...]) -> Array | None:
    """The values over a batch, passed at once, as a tuple or one by one; None if the function takes none of them."""
    shape = arguments[0].shape
    for groups in ((arguments,), ((arguments,),), tuple((one,) for one in arguments)):
        try:
            found: Any = function
            for group in groups:
                found = found(*group)
            value = np.asarray(found.value, dtype=float)
        except (PottoError, AttributeError, TypeError, ValueError):
            continue
        if value.shape in ((), shape):
            return np.broadcast_to(value, shape)
    return None


def _text(name: str, values: Array, where: str) -> str:
    good = values[np.isfinite(values)]
    return f"{name} over {where}: {format_range(good.min(), good.max())}" if good.size else f"{name}: no finite value"


def _side(low: float, high: float) -> str:
    return f"{format_digits(low)}..{format_digits(high)}"


def _scaled(values: Array) -> Array:
    """Values from 0 to 1; what is not finite is nan."""
    good = np.isfinite(values)
    low, high = (values[good].min(), values[good].max()) if good.any() else (0.0, 1.0)
    return np.where(good, (values - low) / (high - low if high > low else 1.0), np.nan)


def _shade(values: Array) -> Array:
    """Grey levels; red where there is no finite value."""
    scaled = _scaled(values)
    grey = np.nan_to_num(scaled * 255).astype(np.uint8)
    red = np.where(np.isnan(scaled), 200, grey).astype(np.uint8)
    return np.stack([red, grey, grey], axis=-1)


def _plot(values: Array) -> Array:
    """A curve in black on white; vertical strokes join its points."""
    height = CURVE // 2
    picture = np.full((height, len(values), 3), 255, np.uint8)
    rows = (1 - _scaled(values)) * (height - 3) + 1
    for column, row in enumerate(rows):
        if not np.isfinite(row):
            continue
        before = rows[column - 1] if column and np.isfinite(rows[column - 1]) else row
        first, last = sorted((round(float(row)), round(float(row + before) / 2)))
        picture[first : last + 1, column] = 0
    return picture


def _uri(picture: Array) -> str:
    """A picture as a PNG in a data URI."""
    height, width, _ = picture.shape
    rows = b"".join(b"\0" + picture[row].tobytes() for row in range(height))
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    data = b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", head) + _chunk(b"IDAT", zlib.compress(rows)) + _chunk(b"IEND", b"")
    return "data:image/png;base64," + base64.b64encode(data).decode("ascii")


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
