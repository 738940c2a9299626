"""The loss of a mesh of triangles of one colour each, and its gradient, by numpy: clip, and walk along the edges.

Owns `loss_and_gradient`. What `examples/stylize` is held against: it knows nothing of Potto. Areas are boundary
integrals of x dy with x held between the sides of the pixel (Green); the gradient by a corner is the integral of the
squared difference over the two edges that it moves, each edge clipped to the pixel (Liang and Barsky, 1984).
"""

from __future__ import annotations

import numpy as np

Array = np.ndarray


def loss_and_gradient(corners: Array, faces: Array, colours: Array, photo: Array) -> tuple[float, Array, Array]:
    """The loss, its slopes by corners and by colours.

    corners: (m, 2); faces: (n, 3) numbers of corners, so that areas are positive; colours: (n, 1, 3); photo: (h, w, 3).
    """
    height, width = photo.shape[:2]
    face, row, column = _pairs(corners[faces], width, height)
    place, size = np.stack([column / width, row / height], axis=1), np.array([1 / width, 1 / height])
    away = colours[face, 0] - photo[row, column]
    far = (away**2).sum(axis=1)
    area, slopes = np.zeros(face.size), np.zeros_like(corners)
    for k in range(3):
        first, second = faces[face, k], faces[face, (k + 1) % 3]
        a, d = corners[first] - place, corners[second] - corners[first]
        area += _under(a, d, size)
        low, high = _inside(a, d, size)
        outwards = far[:, None] * np.stack([d[:, 1], -d[:, 0]], axis=1)
        by_second = 0.5 * (high**2 - low**2)
        np.add.at(slopes, first, (high - low - by_second)[:, None] * outwards)
        np.add.at(slopes, second, by_second[:, None] * outwards)
    by_colour = np.zeros_like(colours)
    np.add.at(by_colour[:, 0], face, 2 * area[:, None] * away)
    return float(area @ far), slopes, by_colour


def _pairs(triangles: Array, width: int, height: int) -> tuple[Array, Array, Array]:
    """Each triangle with each pixel that its box touches: numbers of triangles, rows and columns."""
    found = []
    scale, most = np.array([width, height]), np.array([width - 1, height - 1])
    first = np.clip(np.floor(triangles.min(axis=1) * scale).astype(int), 0, most)
    last = np.clip(np.floor(triangles.max(axis=1) * scale).astype(int), 0, most)
    for number, ((i0, j0), (i1, j1)) in enumerate(zip(first, last, strict=True)):
        rows, columns = np.meshgrid(np.arange(j0, j1 + 1), np.arange(i0, i1 + 1), indexing="ij")
        found.append((np.full(rows.size, number), rows.ravel(), columns.ravel()))
    face, row, column = (np.concatenate(part) for part in zip(*found, strict=True))
    return face, row, column


def _between(a: Array, d: Array, size: float) -> tuple[Array, Array]:
    """From where to where, of 0 to 1, a + s d is between 0 and size."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = -a / d, (size - a) / d
    low, high = np.minimum(*ends), np.maximum(*ends)
    level, inside = d == 0, (a > 0) & (a < size)
    low, high = np.where(level, np.where(inside, 0.0, 1.0), low), np.where(level, np.where(inside, 1.0, 0.0), high)
    return np.clip(low, 0, 1), np.clip(high, 0, 1)


def _inside(a: Array, d: Array, size: Array) -> tuple[Array, Array]:
    """From where to where the edge from a along d is in the pixel, which begins at 0; as far as it is not, equal."""
    (x0, x1), (y0, y1) = (_between(a[:, k], d[:, k], size[k]) for k in (0, 1))
    low, high = np.maximum(x0, y0), np.minimum(x1, y1)
    return low, np.maximum(low, high)


def _under(a: Array, d: Array, size: Array) -> Array:
    """The integral of x dy over the part of the edge that is beside the pixel, with x held between its sides."""
    low, high = _between(a[:, 1], d[:, 1], size[1])
    ends = np.stack([a[:, 0] + s * d[:, 0] for s in (low, high)])
    least, most = ends.min(axis=0), ends.max(axis=0)
    held = np.clip(ends, 0, size[0])
    wide = np.where(most > least, most - least, 1.0)
    inside = np.abs(held[1] - held[0]) / wide
    beyond = (np.maximum(most - size[0], 0) - np.maximum(least - size[0], 0)) / wide
    mean = np.where(most > least, inside * held.mean(axis=0) + beyond * size[0], held[0])
    return d[:, 1] * np.maximum(high - low, 0) * mean
