"""Shaders of the paper's first figure swapped under one triangle: what each takes to compile, and its first pixel.

`python benchmarks/paper_swaps.py` prints one line of JSON, as `paper.py` asks for it, in a process of its own: what a
process has compiled the next one reads from disk. Times are seconds of the processor.
"""

from __future__ import annotations

import json
import time
from pathlib import Path

import potto

SCENE = Path(__file__).resolve().parents[1] / "examples" / "raytrace"
GEOMETRY = {"dq": (-0.2, 1.0), "dex": (0.0, 0.0), "dfocal": (1.0, 0.0)}
SHADERS = {
    "by_depth": {},
    "two_tones": {"dlx": (0.2, 0.0), "dthreshold": (0.8, 0.0)},
    "by_law": {"dlx": (0.2, 0.0), "dthreshold": (0.3, 0.0)},
}
PIXEL = (0.1, 0.05)
EDGES = {"two_tones": (-0.2765625, -0.2203125), "by_law": (-0.0375, -0.0515625)}  # pixels that the tones' edge crosses


def swaps() -> dict[str, dict[str, float]]:
    """By shader: what its first pixel takes with its derivative beyond what the same one takes again, `plan` for where
    surfaces cut and meet, `compile` for the rest; and `pixel`, what it takes again. So for the first one at an edge."""
    module, found = potto.load(SCENE / "main.po"), {}
    with potto.settings(backend="numpy", rtol=1e-8, atol=1e-7):
        for name, numbers in SHADERS.items():
            for title, pixel in ((name, PIXEL), (f"{name}, at its edge", EDGES.get(name))):
                if pixel is None:
                    continue
                times, shares = [], []
                for _ in range(3):
                    start = time.process_time()
                    answer = potto.deriv(getattr(module, name))(*pixel, **GEOMETRY, **numbers)
                    times.append(time.process_time() - start)
                    shares.append(answer.plan_seconds / answer.seconds)
                plan = shares[0] * times[0]
                found[title] = {"compile": times[0] - plan - min(times[1:]), "plan": plan, "pixel": min(times[1:])}
    return found


if __name__ == "__main__":
    print(json.dumps(swaps()))
