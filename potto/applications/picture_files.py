"""Pictures as files: `.png` by ourselves, `.jpg` by Pillow, `.exr` by OpenEXR, `.npy` by numpy.

Owns `save`, and `complaint`, which says before anything is computed whether a file can be written. `.npy` and `.exr`
hold the numbers themselves, the others their colours.
"""

from __future__ import annotations

import os
from importlib.util import find_spec
from typing import Any

import numpy as np

from potto.applications.images import Grid
from potto.applications.png import encode
from potto.extras import install_command
from potto.kernels.cells import Array

# Endings with what they need: the package, the name that it is imported by, our extra.
NEEDS: dict[str, tuple[str, str, str] | None] = {
    ".png": None, ".npy": None, ".exr": ("OpenEXR", "OpenEXR", "exr"),
    ".jpg": ("Pillow", "PIL", "images"), ".jpeg": ("Pillow", "PIL", "images"),
}  # fmt: skip
NUMBERS = (".npy", ".exr")
QUALITY = 95  # of a JPEG, out of 100
_NAMES = {1: ("Y",), 3: ("R", "G", "B"), 4: ("R", "G", "B", "A")}  # of the channels of an EXR


def ending_of(path: str) -> str:
    return os.path.splitext(path)[1].lower()


def complaint(path: str, known: dict[str, tuple[str, str, str] | None] = NEEDS) -> str | None:
    """Why a file can't be written, for a person: its ending, a library, its folder; None if it seems that it can."""
    ending = ending_of(path)
    if ending not in known:
        what = f"`{ending}` is not a picture" if ending else f"`{path}` does not say which kind of picture it is"
        return f"{what}: end the name with {', '.join(list(known)[:-1])} or {list(known)[-1]}"
    needed = known[ending]
    if needed is not None and find_spec(needed[1]) is None:
        return f"`{ending}` needs {needed[0]}: {install_command(needed[2])}"
    folder = os.path.dirname(path)
    if folder and not os.path.isdir(folder):
        return f"there is no folder `{folder}` for `{path}`"
    return None


def save(path: str, parts: Array, rgb: Any, grid: Grid) -> None:
    """Write a picture. parts: the numbers (k, n). rgb: their colours (n, 3), for endings that are not `NUMBERS`.

    Raises OSError.
    """
    match ending_of(path):
        case ".npy":
            np.save(path, shaped(parts, grid))
        case ".exr":
            _save_exr(path, parts, grid)
        case ".png":
            with open(path, "wb") as stream:
                stream.write(encode(np.ascontiguousarray(rgb).tobytes(), grid.width, grid.height))
        case _:
            from PIL import Image

            Image.fromarray(pixels(rgb, grid)).save(path, quality=QUALITY, subsampling=0)


def shaped(parts: Array, grid: Grid) -> Array:
    """Numbers as an image: (height, width), with a last axis for several parts."""
    found = parts.reshape(len(parts), grid.height, grid.width)
    return found[0] if len(found) == 1 else np.moveaxis(found, 0, -1)


def pixels(rgb: Any, grid: Grid) -> Any:
    """Colours as an image: (height, width, 3) bytes."""
    return np.ascontiguousarray(rgb).reshape(grid.height, grid.width, 3)


def _save_exr(path: str, parts: Array, grid: Grid) -> None:
    import OpenEXR

    names = _NAMES.get(len(parts)) or tuple(f"part{i}" for i in range(len(parts)))
    planes = np.ascontiguousarray(parts.reshape(len(parts), grid.height, grid.width), dtype=np.float32)
    channels = {name: OpenEXR.Channel(plane) for name, plane in zip(names, planes, strict=True)}
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    try:
        OpenEXR.File(header, channels).write(path)
    except RuntimeError as error:
        raise OSError(str(error)) from None
