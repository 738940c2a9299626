"""Where a derivative is not zero: each channel of a picture is lit where its derivative is more than its error.

Red is the derivative by the corner, green by the light, blue by the camera's place, of the same shader.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np

import potto
from potto.applications.png import encode

HERE = Path(__file__).parent
SHADERS = {"by_depth": {}, "two_tones": {"lx": 0.2, "threshold": 0.8}}


def lit(function: Any, side: int, given: dict[str, float]) -> tuple[Any, float]:
    """(side, side, 3) booleans, and the largest estimated error."""
    xs = (np.arange(side) + 0.5) / side * 1.2 - 0.6
    x, y = np.meshgrid(xs, xs)
    channels, worst = [], 0.0
    for name in ("q", "lx", "ex"):
        duals = {f"d{k}": (v, float(k == name)) for k, v in given.items()}
        if name in given:
            found = potto.deriv(function)(x, y, **duals)
            slope, error = np.asarray(found.tangent, dtype=float), np.asarray(found.tangent_error, dtype=float)
            channels.append(np.abs(slope) > np.maximum(error, 1e-12))
            worst = max(worst, float(error.max()))
        else:  # the shader does not look at it
            channels.append(np.zeros(x.shape, dtype=bool))
    return np.stack(channels, axis=-1), worst


def pictures(folder: Path, quick: bool) -> list[dict[str, Any]]:
    side = 8 if quick else 128
    text = (HERE / "main.po").read_text(encoding="utf-8").replace("h = 1 / 256", f"h = 1.2 / {side}")
    module, made = potto.Workspace(HERE).compile(text), []
    with potto.settings(rtol=1e-8, atol=1e-7):
        for name, more in SHADERS.items():
            start = time.perf_counter()
            channels, error = lit(getattr(module, name), side, {"q": -0.2, "ex": 0.0, "focal": 1.0, **more})
            file = f"raytrace-sparsity-{name.replace('_', '-')}.png"
            (folder / file).write_bytes(encode((channels[::-1] * np.uint8(255)).tobytes(), side, side))
            caption = f"{name.replace('_', ' ')}: red corner, green light, blue camera"
            seconds = time.perf_counter() - start
            made.append({"file": file, "caption": caption, "seconds": seconds, "error": error})
    return made
