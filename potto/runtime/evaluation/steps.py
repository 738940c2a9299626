"""What many small linear steps one after the other make of vectors, and of what is not known of them.

Owns `carried` and `spread`. Matrices are (steps, *batch, d, d). Steps are taken in blocks, all blocks at once, so that
what is done one by one is a few hundred blocks and not ten thousand steps.

`spread` bounds errors to first order, with regard to sign: an error is bounded along axes that turn with the steps
(Lohner's method: Q from a QR factorization of what a block makes of the axes before). Bounding each component by
itself in each step would let an error that only turns grow without end.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from potto.kernels.cells import Array

LONGEST = 64  # steps of a block


def _length(count: int) -> int:
    """Of a block: about as many steps as there are then blocks."""
    return min(LONGEST, math.isqrt(count) + 1)


def carried(matrices: Array, added: Array | None, first: Array) -> Array:
    """All of x[0] = first, x[j + 1] = matrices[j] @ x[j] + added[j]; x are matrices (*batch, d, columns)."""
    count = len(matrices)
    if not count:
        return first[None]
    blocks = _blocks(matrices, np.eye(matrices.shape[-1]))
    shape = np.broadcast_shapes(matrices.shape[1:-2], first.shape[:-2])
    first = np.broadcast_to(first, (*shape, *first.shape[-2:]))
    more = None if added is None else _blocks(added, np.zeros(added.shape[-2:]))
    maps: list[Any] = [np.broadcast_to(np.eye(matrices.shape[-1]), blocks[:, 0].shape)]
    offsets: list[Any] = [0.0]
    for place in range(blocks.shape[1]):
        maps.append(blocks[:, place] @ maps[-1])
        if more is not None:
            offsets.append(more[:, place] + (blocks[:, place] @ offsets[-1] if place else 0.0))
    starts = [first]
    for block in range(len(blocks) - 1):
        here = maps[-1][block] @ starts[-1]
        starts.append(here if more is None else here + offsets[-1][block])
    x = np.stack(starts)
    found = [maps[place] @ x + (0.0 if more is None else offsets[place]) for place in range(blocks.shape[1])]
    last = maps[-1][-1] @ starts[-1] + (0.0 if more is None else offsets[-1][-1])
    whole = np.stack(found, axis=1).reshape(-1, *first.shape)
    return np.concatenate([whole, last[None]])[: count + 1]


def spread(matrices: Array, local: Array, first: Array) -> Array:
    """How far off all of x[j] may be where x[0] is off by `first`, and each step by `local[j]` more: (*batch, d).

    What overflows on the way is infinite.
    """
    count, d = len(matrices), matrices.shape[-1]
    if not count:
        return first[None]
    blocks = _blocks(matrices, np.eye(d))
    more = _blocks(local, np.zeros(d))
    maps: list[Array] = [np.broadcast_to(np.eye(d), blocks[:, 0].shape)]
    within: list[Array] = [np.zeros_like(more[:, 0])]
    errors: Any = None  # columns, each one error of before in this block
    for place in range(blocks.shape[1]):
        step = blocks[:, place]
        maps.append(step @ maps[-1])
        new = more[:, place, ..., None] * np.eye(d)
        errors = new if errors is None else np.concatenate([step @ errors, new], axis=-1)
        within.append(np.abs(errors).sum(axis=-1))
    shape = within[0].shape[1:]
    first = np.broadcast_to(first, shape)
    axes, sizes = np.broadcast_to(np.eye(d), (*shape, d)), first
    starts = []
    for block in range(len(blocks)):
        starts.append((axes, sizes))
        axes, sizes = _turned(maps[-1][block] @ axes, sizes, within[-1][block])
    q, r = (np.stack(part) for part in zip(*starts, strict=True))
    found = [(np.abs(maps[place] @ q) @ r[..., None])[..., 0] + within[place] for place in range(blocks.shape[1])]
    whole = np.stack(found, axis=1).reshape(-1, *shape)
    last = (np.abs(axes) @ sizes[..., None])[..., 0]
    return np.where(np.isnan(bound := np.concatenate([whole, last[None]])[: count + 1]), np.inf, bound)


def _turned(moved: Array, sizes: Array, more: Array) -> tuple[Array, Array]:
    """Perpendicular axes for what axes have become, the longest error first, and how far off along them."""
    order = np.argsort(-np.linalg.norm(moved, axis=-2) * sizes, axis=-1)
    if order.ndim == 1:
        moved, sizes = moved[:, order], sizes[order]
    else:
        moved = np.take_along_axis(moved, order[..., None, :], axis=-1)
        sizes = np.take_along_axis(sizes, order, axis=-1)
    q, r = np.linalg.qr(moved)
    along = np.abs(np.swapaxes(q, -1, -2)) @ more[..., None]
    return q, (np.abs(r) @ sizes[..., None] + along)[..., 0]


def _blocks(rows: Array, rest: Array) -> Array:
    """Rows in blocks, the last one filled up with `rest`."""
    length = _length(len(rows))
    missing = -len(rows) % length
    if missing:
        rows = np.concatenate([rows, np.broadcast_to(rest, (missing, *rows.shape[1:]))])
    return rows.reshape(-1, length, *rows.shape[1:])
