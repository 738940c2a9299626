"""A picture as a mesh of coloured triangles: `python fit.py [constant|linear|quadratic]` fits corners and colours,
`python fit.py --side 22 --pixels 512 --steps 100` those of 968 triangles to a large picture.

The loss and its gradient, in all corners and colours, are those of `stylize.po`; scipy's L-BFGS-B goes down. Triangles
are kept from turning over by a barrier: the loss grows without end as one loses its area. Corners are measured in cells
of the grid, so that a step moves them about as far as it changes colours, and the first ones turn nothing over. Colours
are measured by polynomials that are orthogonal over a triangle of the grid: 1, x and y are next to the same there.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from scipy.optimize import minimize

import potto

HERE = Path(__file__).parent
TERMS = {"constant": 1, "linear": 3, "quadratic": 6}
BEYOND = 0.02  # how far the mesh reaches over the edge of the picture, so that no side runs along the edge of pixels
BARRIER = 1e-5
LEAST = 0.05  # of its first area, that a triangle keeps


@dataclass
class Mesh:
    """corners: (m, 2); faces: (n, 3) numbers of corners; colours: (n, terms, 3); losses: step by step."""

    corners: np.ndarray
    faces: np.ndarray
    colours: np.ndarray
    losses: list[float] = field(default_factory=list)
    seconds: float = 0.0

    def areas(self, corners: np.ndarray | None = None) -> np.ndarray:
        a, b, c = np.moveaxis((self.corners if corners is None else corners)[self.faces], 1, 0)
        return 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])


def grid(side: int, kind: str) -> Mesh:
    """Two triangles for each cell of a grid, grey all over."""
    line = np.linspace(-BEYOND, 1 + BEYOND, side + 1)
    x, y = np.meshgrid(line, line)
    numbers = np.arange((side + 1) ** 2).reshape(side + 1, side + 1)
    a, b, c, d = (n.ravel() for n in (numbers[:-1, :-1], numbers[:-1, 1:], numbers[1:, 1:], numbers[1:, :-1]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    colours = np.zeros((len(faces), TERMS[kind], 3))
    colours[:, 0] = 0.5
    return Mesh(np.stack([x.ravel(), y.ravel()], axis=1), faces, colours)


Slopes = Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray], tuple[float, np.ndarray, np.ndarray]]


def slopes_by_potto(kind: str) -> Slopes:
    """The loss and its slopes by corners and by colours, of corners, faces, colours and a photo."""
    gradient = potto.grad(getattr(potto.load(HERE / "stylize.po"), f"by_{kind}"), ["corners", "colours"])

    def slopes(
        corners: np.ndarray, faces: np.ndarray, colours: np.ndarray, photo: np.ndarray
    ) -> tuple[float, np.ndarray, np.ndarray]:
        found = gradient(corners, faces.astype(float), colours, photo)
        by_corner, by_colour = (np.asarray(part) for part in found.tangent)
        return float(found.value), by_corner, by_colour

    return slopes


def fitted(kind: str, photo: np.ndarray, side: int, steps: int, slopes: Slopes | None = None) -> Mesh:
    """The mesh after so many steps down. photo: (h, w, 3) from 0 to 1. The outer corners stay.

    slopes: the loss and its slopes, if they are not to be Potto's.
    """
    slopes = slopes or slopes_by_potto(kind)
    mesh = grid(side, kind)
    free = ((mesh.corners > 0) & (mesh.corners < 1)).all(axis=1)
    cell = (1 + 2 * BEYOND) / side
    first, count = mesh.areas(), 2 * int(free.sum())

    measured = orthogonal(mesh)

    def unpacked(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        corners = mesh.corners.copy()
        corners[free] = cell * x[:count].reshape(-1, 2)
        return corners, measured @ x[count:].reshape(mesh.colours.shape)

    def down(x: np.ndarray) -> tuple[float, np.ndarray]:
        corners, colours = unpacked(x)
        left = mesh.areas(corners) - LEAST * first
        if (left <= 0).any():
            return 1e3, np.zeros_like(x)
        loss, by_corner, by_colour = slopes(corners, mesh.faces, colours, photo)
        by_corner = cell * (by_corner + _barrier_slopes(mesh.faces, corners, left))
        by_colour = measured.transpose(0, 2, 1) @ by_colour
        reached.append(loss)
        return loss - BARRIER * np.log(left / first).sum(), np.concatenate([by_corner[free].ravel(), by_colour.ravel()])

    reached: list[float] = []
    start = time.perf_counter()
    colours = np.linalg.solve(measured, mesh.colours)
    begin = np.concatenate([mesh.corners[free].ravel() / cell, colours.ravel()])
    found = minimize(down, begin, jac=True, method="L-BFGS-B", options={"maxiter": steps},
                     callback=lambda x: mesh.losses.append(reached[-1]))  # fmt: skip
    mesh.corners, mesh.colours = unpacked(found.x)
    mesh.losses.insert(0, reached[0])
    mesh.seconds = time.perf_counter() - start
    return mesh


def monomials(x: np.ndarray, y: np.ndarray, count: int) -> np.ndarray:
    """What the coefficients of a colour are of, as the shaders have them: (count, …)."""
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y])[:count]


def orthogonal(mesh: Mesh) -> np.ndarray:
    """By triangle the coefficients of polynomials whose products with one another have the mean 0 over it, and with
    themselves 1: (n, terms, terms), one in a column. The mean is that of places spread evenly over the triangle."""
    u, v = np.array([(i + 1 / 3, j + 1 / 3) for i in range(6) for j in range(6 - i)]).T / 6
    a, b, c = np.moveaxis(mesh.corners[mesh.faces], 1, 0)[..., None]
    x, y = np.moveaxis(a + (b - a) * u + (c - a) * v, 1, 0)
    terms = np.moveaxis(monomials(x, y, mesh.colours.shape[1]), 0, 1)
    return np.linalg.inv(np.linalg.cholesky(terms @ terms.transpose(0, 2, 1) / u.size)).transpose(0, 2, 1)


def _barrier_slopes(faces: np.ndarray, corners: np.ndarray, left: np.ndarray) -> np.ndarray:
    """The derivative of -BARRIER times the sum of log(left) by all corners; left: of areas, till they are too small."""
    out = np.zeros_like(corners)
    for i in range(3):
        p, q = corners[faces[:, (i + 1) % 3]], corners[faces[:, (i + 2) % 3]]
        slopes = 0.5 * np.stack([p[:, 1] - q[:, 1], q[:, 0] - p[:, 0]], axis=1)  # of the area by corner i
        np.add.at(out, faces[:, i], -BARRIER * slopes / left[:, None])
    return out


def drawn(mesh: Mesh, side: int) -> np.ndarray:
    """The mesh as a picture, (side, side, 3) bytes: the colour at the middle of each pixel."""
    line = (np.arange(side) + 0.5) / side
    x, y = np.meshgrid(line, line)
    terms = monomials(x, y, mesh.colours.shape[1])
    picture = np.zeros((side, side, 3))
    for face, colours in zip(mesh.faces, mesh.colours, strict=True):
        a, b, c = mesh.corners[face]
        sides = [(q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]) >= 0 for p, q in ((a, b), (b, c), (c, a))]
        inside = np.logical_and.reduce(sides)
        picture[inside] = np.einsum("tn,tc->nc", terms[:, inside], colours)
    return np.rint(255 * np.clip(picture, 0, 1)).astype(np.uint8)


def target() -> np.ndarray:
    with Image.open(HERE / "target.png") as image:
        return np.asarray(image.convert("RGB")) / 255


def pictures(folder: Path, quick: bool) -> list[dict[str, Any]]:
    """For the gallery: the target, and what becomes of a mesh with each kind of colour."""
    photo = target()
    if quick:
        photo = photo.reshape(4, 12, 4, 12, 3).mean(axis=(1, 3))
    begin = np.rint(255 * photo).astype(np.uint8)
    Image.fromarray(begin).resize((384, 384), Image.Resampling.NEAREST).save(folder / "stylize-target.png")
    shown: list[dict[str, Any]] = [{"file": "stylize-target.png", "caption": "the target", "seconds": 0.0}]
    for kind in TERMS:
        mesh = fitted(kind, photo, 2 if quick else 7, 1 if quick else 60)
        file = f"stylize-{kind}.png"
        Image.fromarray(drawn(mesh, 32 if quick else 384)).save(folder / file)
        caption = f"{kind} colour: loss {mesh.losses[0]:.4f} to {mesh.losses[-1]:.4f}"
        shown.append({"file": file, "caption": caption, "seconds": mesh.seconds})
    return shown


def main() -> None:
    parser = argparse.ArgumentParser(description="Fit a mesh of coloured triangles to a picture.")
    parser.add_argument("kind", nargs="?", choices=tuple(TERMS), default="constant", help="of colour in a triangle")
    parser.add_argument("--side", type=int, default=7, help="cells of the grid across, of two triangles each")
    parser.add_argument("--steps", type=int, default=60, help="down, at the most")
    parser.add_argument("--pixels", type=int, metavar="N", help="the target made anew with N x N pixels")
    options = parser.parse_args()
    if options.pixels is None:
        photo = target()
    else:
        from target import evening  # beside this file, which is a script here

        photo = evening(options.pixels)
    mesh = fitted(options.kind, photo, options.side, options.steps)
    Image.fromarray(drawn(mesh, max(384, len(photo)))).save(f"{options.kind}.png")
    print(f"{options.kind}.png: {len(mesh.losses) - 1} steps in {mesh.seconds:.1f} s, "
          f"loss {mesh.losses[0]:.5f} to {mesh.losses[-1]:.5f}")  # fmt: skip


if __name__ == "__main__":
    main()
