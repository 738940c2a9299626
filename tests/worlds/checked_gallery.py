"""The gallery held to its references: `python tests/worlds/checked_gallery.py [FOLDER…]`, as `make gallery` does.

Each curve at some of its places and each picture at some of its pixels: anywhere, where a derivative is largest, at its
edges, where the estimated error is largest, and where corners are. What is said of an entry: how far value and
derivatives are off, as a part of their size or of 1; how many places are off by more than 1e-8, which their own errors
have to say; and how many times the median the slowest pixel takes.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from exact_curves import CURVES
from exact_pictures import CORNERS, PICTURES

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
sys.path.append(str(EXAMPLES / "gallery"))
from tables import Chapter, Curve, Picture, chapters  # noqa: E402

import potto  # noqa: E402
from potto.python.workers import Workers  # noqa: E402

TOLERANCE, SLOWEST = 1e-8, 20.0


class Depth(NamedTuple):
    """How closely an entry is looked at: places of a curve, of the pixels of a row or column each so many-th (and those
    with corners), those looked at of each kind, calls that are timed (none: no times are told)."""

    places: int
    step: int
    each: int
    calls: int


AS_SHOWN, QUICKLY = Depth(241, 1, 4, 3), Depth(21, 6, 2, 0)


class Checked(NamedTuple):
    """An entry; how many places were looked at, how far off those are that are good, where; how many are off by more
    but within their errors, and how many by more than these; the slowest by the median."""

    title: str
    places: int
    off: float
    where: str
    unsure: int
    wrong: int
    slowest: float

    def __str__(self) -> str:
        where = f"off by {self.off:.0e} {self.where}"
        unsure = f", {self.unsure} less good, as said" if self.unsure else ""
        return f"  {self.title:32} {self.places:3} places, {where:50} slowest {self.slowest:4.1f} x the median{unsure}"


class Tally:
    """What is added up over the places of an entry."""

    def __init__(self) -> None:
        self.places, self.off, self.where, self.unsure, self.wrong = 0, 0.0, "", 0, 0
        self.times: list[float] = []

    def count(self, where: str, found: Sequence[float], errors: Sequence[float], exact: Sequence[float]) -> None:
        """Numbers with their estimated errors, and what they should be."""
        gaps = [abs(a - b) / max(1.0, abs(b)) for a, b in zip(found, exact, strict=True)]
        if not max(gaps) <= TOLERANCE:
            honest = all(gap * max(1.0, abs(b)) <= e for gap, b, e in zip(gaps, exact, errors, strict=True))
            self.unsure += honest
            self.wrong += not honest
        elif max(gaps) > self.off:
            self.off, self.where = max(gaps), where

    def time(self, call: Any, calls: int) -> None:
        """The least time of the processor of some calls, the first of which may have had to compile."""
        spent = []
        for _ in range(calls):
            start = time.process_time()
            call()
            spent.append(time.process_time() - start)
        self.places += 1
        self.times.extend([min(spent)] if spent else [])

    def checked(self, title: str) -> Checked:
        slowest = max(self.times) / float(np.median(self.times)) if self.times else 0.0
        return Checked(title, self.places, self.off, self.where, self.unsure, self.wrong, slowest)


def spread(count: int, each: int, seed: int) -> Any:
    return np.random.default_rng(seed).permutation(count)[:each]


def curve(entry: Curve, chapter: Chapter, depth: Depth) -> Checked:
    """Where it bends, where it is steep, its ends, where it is least sure, anywhere."""
    text = (chapter.folder / f"{entry.program}.po").read_text(encoding="utf-8")
    module = potto.Workspace(chapter.folder).compile(f"{text}\nshown_in_the_gallery = {entry.function}\n")
    function, exact = potto.deriv(module.shown_in_the_gallery), CURVES[chapter.name, entry.program, entry.function]
    places, _, each, calls = depth
    grid = np.linspace(*entry.range, places)
    found = function((grid, np.ones_like(grid)))
    parts = found.value, found.tangent, found.error, found.tangent_error
    value, slope, off, error = (np.broadcast_to(np.asarray(x, dtype=float), grid.shape) for x in parts)
    bends = np.argsort(-np.abs(np.diff(slope, 2)))[:each] + 1
    chosen = {0, places - 1, *bends, *np.argsort(-np.abs(slope))[:1], *np.argsort(-error)[:1], *spread(places, each, 0)}
    tally = Tally()
    for k in sorted(map(int, chosen)):
        sides = exact(float(grid[k]))
        side = min(sides, key=lambda pair: abs(pair[1] - slope[k]))
        tally.count(f"at {grid[k]:.6g}", (value[k], slope[k]), (off[k], error[k]), side)
        tally.time(lambda k=k: function((float(grid[k]), 1.0)), calls)
    return tally.checked(entry.title)


def key(entry: Picture, chapter: Chapter) -> tuple[str, str, str]:
    given = dict(entry.given)
    return chapter.name, entry.program, given.get("shader", entry.function)


def picture(entry: Picture, chapter: Chapter, depth: Depth) -> Checked:
    """All its pixels by each parameter, and some of them by the reference."""
    width, height = entry.size
    x0, x1, y0, y1 = entry.box
    x, y = np.meshgrid(
        x0 + (np.arange(width) + 0.5) / width * (x1 - x0), y1 - (np.arange(height) + 0.5) / height * (y1 - y0)
    )
    given = {name: float(text) for name, text in entry.given if name != "shader"}
    module, h = scene(entry, chapter)
    corners = CORNERS.get(key(entry, chapter)[:2], lambda given: [])(given)
    taken = np.zeros(x.shape, dtype=bool)
    taken[:: depth.step, :: depth.step] = True
    for place in corners:
        taken |= within(x, y, place, h)
    x, y = x[taken], y[taken]
    shader = dict(entry.given).get("shader")
    more = {} if shader is None else {"dshader": potto.deriv(getattr(module, shader))}
    function = potto.deriv(getattr(module, entry.function))

    def seen(x: Any, y: Any, wrt: str) -> potto.Estimate:
        return function(x, y, **{f"d{name}": (v, float(name == wrt)) for name, v in given.items()}, **more)

    with potto.settings(**accuracy(entry)):
        found = {wrt: seen(x, y, wrt) for wrt in entry.wrt}
        chosen = pixels(found, x, y, corners, h, depth.each)
        tally = Tally()
        for at in chosen:
            px, py = float(x.flat[at]), float(y.flat[at])
            value, slopes = PICTURES[key(entry, chapter)](px, py, h, given)
            for wrt, part in found.items():
                parts = part.value, part.tangent, part.error, part.tangent_error
                numbers = [float(np.broadcast_to(np.asarray(p, dtype=float), x.shape).flat[at]) for p in parts]
                tally.count(f"at ({px:.5g}, {py:.5g}) by {wrt}", numbers[:2], numbers[2:], (value, slopes[wrt]))
            tally.time(lambda px=px, py=py: seen(px, py, entry.wrt[0]), depth.calls)
    return tally.checked(entry.title)


def scene(entry: Picture, chapter: Chapter) -> tuple[potto.Module, float]:
    """The program at the size of the gallery's pixels, and their side."""
    text = (chapter.folder / f"{entry.program}.po").read_text(encoding="utf-8")
    x0, x1 = entry.box[:2]
    assert entry.pixel == "h" and "h = 1 / 256" in text
    side = f"h = ({x1} - {x0})/{entry.size[0]}"
    module = potto.Workspace(chapter.folder).compile(text.replace("h = 1 / 256", side))
    return module, (x1 - x0) / entry.size[0]


def accuracy(entry: Picture) -> dict[str, float]:
    """What of its options are settings of accuracy."""
    words = dict(zip(entry.options[::2], entry.options[1::2], strict=True))
    return {name: float(words[f"--{name}"]) for name in ("rtol", "atol") if f"--{name}" in words}


def within(x: Any, y: Any, place: tuple[float, float], h: float) -> Any:
    """Which pixels have a place in them."""
    return (np.abs(x - place[0]) <= h / 2) & (np.abs(y - place[1]) <= h / 2)


def pixels(found: Mapping[str, potto.Estimate], x: Any, y: Any, corners: Any, h: float, each: int) -> list[int]:
    """Numbers of pixels, each once."""
    chosen: dict[int, None] = {}
    for place in corners:
        chosen.update(dict.fromkeys(map(int, np.nonzero(within(x, y, place, h))[0])))
    for seed, part in enumerate(found.values()):
        slope = np.abs(np.broadcast_to(np.asarray(part.tangent, dtype=float), x.shape)).ravel()
        error = np.broadcast_to(np.asarray(part.tangent_error, dtype=float), x.shape).ravel()
        edge = np.nonzero(slope > 0.05 * slope.max())[0]
        chosen.update(
            dict.fromkeys(map(int, (np.argmax(slope), np.argmax(error), *edge[spread(edge.size, each, seed)])))
        )
    chosen.update(dict.fromkeys(map(int, spread(x.size, each, 7))))
    return list(chosen)


def checked(entry: Curve | Picture, chapter: Chapter, depth: Depth) -> Checked:
    return curve(entry, chapter, depth) if isinstance(entry, Curve) else picture(entry, chapter, depth)


def main() -> None:
    """Each processor checks one entry after the other; times are those that it works."""
    bad = 0
    with Workers() as pool:
        tasks = [
            (chapter, entry, pool.submit(checked, entry, chapter, AS_SHOWN))
            for chapter in chapters(EXAMPLES, sys.argv[1:])
            for entry in chapter.entries
            if isinstance(entry, Curve | Picture)
        ]
        for chapter, entry, task in tasks:
            found = task.result()
            slow = isinstance(entry, Picture) and found.slowest > SLOWEST
            bad += bool(found.wrong or slow)
            marks = f"{'  WRONG' if found.wrong else ''}{'  SLOW' if slow else ''}"
            print(f"{chapter.name:12}{found}{marks}", flush=True)
    sys.exit(f"{bad} are not good to {TOLERANCE:.0e}, or have slow pixels" if bad else 0)


if __name__ == "__main__":
    main()
