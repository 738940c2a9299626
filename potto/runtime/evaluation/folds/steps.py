"""What many small linear steps one after the other make of vectors, and of what is not known of them.

Owns `carried` and `spread`. Matrices are (steps, *batch, d, d). Steps are taken in blocks, all blocks at once, so that
what is done one by one is a few hundred blocks and not ten thousand steps.

`spread` bounds errors to first order, with regard to sign: what each block adds is a box of errors of its own, and what
later blocks make of all of these together, a zonotope, is known column by column (Kühn 1998). Within a block they are
bounded along axes that turn with the steps (Lohner's method: Q from a QR factorization of what a block makes of the
axes before). Bounding each component by itself in each step would let an error that only turns grow without end, and
along axes alone it would grow as the square of the steps where what it turns along is not a circle.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from potto.kernels.cells import Array

LONGEST = 64  # steps of a block
# Columns of errors, or in all columns numbers, from which on the older half of them are made one box.
MOST, NUMBERS = 512, 4096


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
    errors = None  # columns, each one error of before in this block
    for place in range(blocks.shape[1]):
        step = blocks[:, place]
        maps.append(step @ maps[-1])
        new = more[:, place, ..., None] * np.eye(d)
        errors = new if errors is None else np.concatenate([step @ errors, new], axis=-1)
        within.append(np.abs(errors).sum(axis=-1))
    shape = within[0].shape[1:]
    axes = np.broadcast_to(np.eye(d), (*shape, d))
    columns = axes * np.broadcast_to(first, shape)[..., None, :]
    starts, most = [], max(MOST, NUMBERS // d)
    for block in range(len(blocks)):
        starts.append((axes, sizes := _along(axes, columns)))
        step = maps[-1][block]
        if columns.shape[-1] > most:
            older, columns = columns[..., : most // 2], columns[..., most // 2 :]
            columns = np.concatenate([axes * _along(axes, older)[..., None, :], columns], axis=-1)
        columns = np.concatenate([step @ columns, within[-1][block][..., None] * np.eye(d)], axis=-1)
        axes = _turned(step @ axes, sizes)
    q, r = (np.stack(part) for part in zip(*starts, strict=True))
    found = [(np.abs(maps[place] @ q) @ r[..., None])[..., 0] + within[place] for place in range(blocks.shape[1])]
    whole = np.stack(found, axis=1).reshape(-1, *shape)
    last = np.abs(columns).sum(axis=-1)
    return np.where(np.isnan(bound := np.concatenate([whole, last[None]])[: count + 1]), np.inf, bound)


def _along(axes: Array, columns: Array) -> Array:
    """How far errors that are sums of columns (*batch, d, m), each by at most 1, go along perpendicular axes."""
    far: Array = np.abs(np.swapaxes(axes, -1, -2) @ columns).sum(axis=-1)
    return far


def _turned(moved: Array, sizes: Array) -> Array:
    """Perpendicular axes for what axes have become, the longest error first."""
    order = np.argsort(-np.linalg.norm(moved, axis=-2) * sizes, axis=-1)
    if order.ndim == 1:
        moved = moved[:, order]
    else:
        moved = np.take_along_axis(moved, order[..., None, :], axis=-1)
    q: Array = np.linalg.qr(moved)[0]
    return q


def _blocks(rows: Array, rest: Array) -> Array:
    """Rows in blocks, the last one filled up with `rest`."""
    length = _length(len(rows))
    missing = -len(rows) % length
    if missing:
        rows = np.concatenate([rows, np.broadcast_to(rest, (missing, *rows.shape[1:]))])
    return rows.reshape(-1, length, *rows.shape[1:])
