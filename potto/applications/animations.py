"""Pictures that move: `.gif` by Pillow, `.mp4` by ffmpeg, `.npy` with the frames as first axis.

Owns `save_frames`, and `complaint`, which says before anything is computed whether a file can be written.
"""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from typing import Any

import numpy as np

from potto.applications.images import Grid
from potto.applications.picture_files import complaint as plain_complaint
from potto.applications.picture_files import ending_of, pixels, shaped
from potto.kernels.cells import Array

NEEDS: dict[str, tuple[str, str, str] | None] = {".gif": ("Pillow", "PIL", "images"), ".mp4": None, ".npy": None}
SHADES, KEPT = 256, 32  # colours of a GIF, and how many of them are the most frequent ones as they are
CHUNK = 1 << 12  # colours that are compared with a palette at once
QUALITY = "16"  # ffmpeg's constant rate factor: 0 loses nothing, 23 is usual


def ffmpeg() -> str | None:
    """The program that makes films: of the system, or of the package imageio-ffmpeg; None if there is none."""
    found = shutil.which("ffmpeg")
    if found is None and find_spec("imageio_ffmpeg") is not None:
        import imageio_ffmpeg

        found = str(imageio_ffmpeg.get_ffmpeg_exe())
    return found


def complaint(path: str) -> str | None:
    """Why an animation can't be written, for a person; None if it seems that it can."""
    if ending_of(path) == ".mp4" and ffmpeg() is None:
        return "`.mp4` needs the program ffmpeg: install it, or the package imageio-ffmpeg; a .gif does without"
    return plain_complaint(path, NEEDS)


def save_frames(
    path: str, frames: Sequence[Array], colours: Callable[[int], Any], grid: Grid, rate: float
) -> None:  # fmt: skip
    """Write frames, (parts, n) each, whose colours are bytes (n, 3), so many a second. Raises OSError."""
    match ending_of(path):
        case ".npy":
            np.save(path, np.stack([shaped(parts, grid) for parts in frames]))
        case ".gif":
            _save_gif(path, [pixels(colours(i), grid) for i in range(len(frames))], rate)
        case _:
            _save_mp4(path, (pixels(colours(i), grid).tobytes() for i in range(len(frames))), grid, rate)


def _save_gif(path: str, frames: Sequence[Any], rate: float) -> None:
    """A GIF that goes round for ever. All frames share one palette, so that nothing flickers."""
    from PIL import Image

    packed = [frame.astype(np.int32) @ np.array([1 << 16, 1 << 8, 1], dtype=np.int32) for frame in frames]
    known, counts = np.unique(np.concatenate([frame.ravel() for frame in packed]), return_counts=True)
    palette = known if len(known) <= SHADES else _palette(known, counts)
    nearest = np.concatenate([_nearest(known[i : i + CHUNK], palette) for i in range(0, len(known), CHUNK)])
    shown = []
    for frame in packed:
        image = Image.fromarray(nearest[np.searchsorted(known, frame)])
        image.putpalette(_channels(palette).astype(np.uint8).tobytes())
        shown.append(image)
    shown[0].save(path, save_all=True, append_images=shown[1:], duration=round(1000 / rate), loop=0, optimize=False)


def _palette(known: Any, counts: Any) -> Any:
    """Colours for all that there are: the most frequent ones as they are, so that grounds stay; means of the others."""
    from PIL import Image

    often = known[np.argsort(-counts, kind="stable")[:KEPT]]
    row = Image.fromarray(_channels(known)[None].astype(np.uint8))
    means = np.array(row.quantize(SHADES - KEPT).getpalette(), dtype=np.int32).reshape(-1, 3)
    return np.concatenate((often, means @ np.array([1 << 16, 1 << 8, 1], dtype=np.int32)))


def _nearest(some: Any, palette: Any) -> Any:
    """Which colour of a palette is the nearest to each."""
    away = _channels(some)[:, None] - _channels(palette)
    return np.argmin((away * away).sum(axis=-1), axis=1).astype(np.uint8)


def _channels(packed: Any) -> Any:
    return np.stack([packed >> 16, packed >> 8 & 255, packed & 255], axis=-1)


def _save_mp4(path: str, frames: Any, grid: Grid, rate: float) -> None:
    program = ffmpeg()
    if program is None:
        raise OSError("ffmpeg is gone")
    even = "pad=ceil(iw/2)*2:ceil(ih/2)*2"  # what players want
    words = [program, "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s",
             f"{grid.width}x{grid.height}", "-r", f"{rate:g}", "-i", "-", "-vf", even, "-pix_fmt", "yuv420p",
             "-c:v", "libx264", "-crf", QUALITY, "-movflags", "+faststart", path]  # fmt: skip
    done = subprocess.run(words, input=b"".join(frames), capture_output=True, check=False)
    if done.returncode:
        said = done.stderr.decode(errors="replace").strip().splitlines()
        raise OSError(f"ffmpeg cannot write `{path}`: {said[-1] if said else 'it says nothing'}")
