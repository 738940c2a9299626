"""Makes the figures of the pages, light and dark: `make pictures`, or `python docs/write_pictures.py [NAME…]`.

Each figure is a session at the prompt or a command, as the page shows it, drawn by `potto.applications.figures` into
`docs/images/NAME-light.png` and `NAME-dark.png`.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

from potto_repl.respond import respond
from potto_repl.session import Conversation

from potto.applications import figures
from potto.applications.framed import Image
from potto.applications.pictures import Plot
from potto.cli import render, rendering
from potto.cli.console import Console
from potto.cli.opening import opened
from potto.evaluating.world import World
from potto.projects.settings import DEFAULTS

HERE = Path(__file__).parent
IMAGES = HERE / "images"
WORKED = HERE.parent / "examples" / "worked"


def session(*entries: str) -> list[Plot | Image]:
    """The last picture of a session."""
    conversation = Conversation([HERE])
    for entry in entries:
        reply = respond(conversation, entry)
        if reply.failed:
            sys.exit(f"{entry}\n{reply.text}")
    return [conversation.last_picture]


def rendered(*words: str) -> list[Plot | Image]:
    """The images of `potto render FILE NAME …`."""
    parser = argparse.ArgumentParser()
    render.configure(parser)
    options = parser.parse_args(render.prepare(list(words)))
    world = World([HERE])
    grid = render.grid_of(options)
    file = opened(world, options.file)
    picture = rendering.picture_of(world, file, options, True)
    found = rendering.drawn(picture, grid, DEFAULTS, options, Console(sys.stdout, sys.stderr))
    caption = f"{grid.width} x {grid.height} pixels, {found.cost(grid)}"
    lines = rendering.outlines(world, file, picture, grid) if options.surfaces else ()
    return list(rendering.images(rendering.layers(picture, found, options, "x.png"), picture, grid, caption, lines))


G = "def g(t) (integral [0, 1] [x < t]*t^2 d(x)) * (if t < 0.6 then 1 else 0.4)"
NOISY = "def h(t) integral ([0, 1], [0, 1]) [x + y^2 < t] d(x, y)"

FIGURES: dict[str, Callable[[], list[Plot | Image]]] = {
    "figure-plot": lambda: session(G, ":plot g, deriv g 0 0.9"),
    "figure-noise": lambda: session(NOISY, ":set method mc", ":set samples 1000", ":plot h, deriv h 0.05 1.9"),
    "figure-render": lambda: rendered(str(WORKED / "picture.po"), "pixel", "r=0.7", "--wrt", "r", "--size", "192"),
    "figure-moon": lambda: rendered(
        str(WORKED / "moon.po"), "moon", "c=0.3", "--wrt", "c", "--box=-1,1,-1,1", "--size", "64",
    ),
    "figure-surfaces": lambda: rendered(
        str(WORKED / "painted.po"), "pixel", "t=0.5", "--wrt", "t", "--size", "192", "--surfaces",
    ),
    "figure-fit": lambda: session(
        "def cover(r) integral ([0, 1], [0, 1]) [u^2 + v^2 < r^2] d(u, v)",
        "def loss(r) (cover(r) - 1/2)^2", ":fit loss r=0.5",
    ),
}  # fmt: skip


def main(names: list[str]) -> None:
    for name in names or FIGURES:
        pictures = FIGURES[name]()
        for dark in (False, True):
            path = IMAGES / f"{name}-{'dark' if dark else 'light'}.png"
            figures.save(str(path), pictures, dark=dark)
            print(path.relative_to(HERE))


if __name__ == "__main__":
    main(sys.argv[1:])
