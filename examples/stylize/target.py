"""Makes `target.png`: evening over hills and a lake, 48 x 48 pixels. No picture of anybody else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

SIDE = 48


def evening(side: int = SIDE) -> np.ndarray:
    """The picture, (side, side, 3) from 0 to 1, each pixel the mean of 4 x 4 places."""
    places = (np.arange(4 * side) + 0.5) / (4 * side)
    x, y = np.meshgrid(places, places)
    sky = np.stack([0.95 - 0.55 * (1 - y), 0.55 - 0.15 * (1 - y), 0.35 + 0.35 * (1 - y)], axis=-1)
    sun = (x - 0.68) ** 2 + (y - 0.40) ** 2
    picture = sky + np.exp(-sun / 0.02)[..., None] * [0.25, 0.2, 0.05]
    picture = np.where((sun < 0.008)[..., None], [1.0, 0.93, 0.7], picture)
    far = y > 0.52 - 0.10 * np.sin(4.5 * x + 0.6) - 0.04 * np.sin(11 * x)
    picture = np.where(far[..., None], np.stack([0.36 - 0.1 * y, 0.25 + 0.05 * x, 0.40 + 0 * x], axis=-1), picture)
    near = y > 0.70 - 0.16 * np.sin(3.2 * x + 2.4)
    picture = np.where(near[..., None], np.stack([0.12 + 0.1 * x, 0.16 + 0.1 * x, 0.14 + 0 * x], axis=-1), picture)
    lake = ((x - 0.42) / 0.36) ** 2 + ((y - 0.87) / 0.09) ** 2 < 1
    picture = np.where(lake[..., None], np.stack([0.75 - 0.2 * y, 0.42 + 0 * x, 0.42 + 0.1 * x], axis=-1), picture)
    return np.clip(picture, 0, 1).reshape(side, 4, side, 4, 3).mean(axis=(1, 3))


if __name__ == "__main__":
    pixels = np.rint(255 * evening()).astype(np.uint8)
    Image.fromarray(pixels).save(Path(__file__).parent / "target.png", optimize=True)
