"""Elements of arrays at many places at once. Owns `gathered`."""

from __future__ import annotations

from typing import Any

import numpy as np

from potto.kernels.cells import Ints, Rows, Value, parts_of
from potto.kernels.tape import Node


def gathered(rows: Rows, places: Ints) -> Value:
    """The elements at places (whole numbers within the array, of any shape, along batches)."""
    return _gathered(rows.item, places, 0)


def _gathered(value: Value, places: Ints, inner: int) -> Value:
    if isinstance(value, tuple):
        return tuple([_gathered(item, places, inner) for item in value])
    if isinstance(value, Rows):
        return Rows(_gathered(value.item, places, inner + 1), value.size)
    return parts_of(value, lambda part: _taken(part, places, inner))


def _taken(part: Any, places: Ints, inner: int) -> Any:
    """The rows of a part at places; `inner` axes of places of inner arrays stay in front."""
    if not np.ndim(part):
        return part
    if part.ndim == inner + 1:
        found = part[places]
        if not inner or not places.ndim:
            return float(found) if not np.ndim(found) and not isinstance(found, Node) else found
        return np.moveaxis(found, range(places.ndim, places.ndim + inner), range(inner))
    batch = part.shape[inner + 1 :]
    shape = np.broadcast_shapes(places.shape, batch)
    if not isinstance(part, Node):
        part = np.moveaxis(part, 0, inner)
        own = part.shape[:inner]
        pad = (1,) * (len(shape) - len(batch))
        wide = np.broadcast_to(part.reshape(*own, part.shape[inner], *pad, *batch), (*own, part.shape[inner], *shape))
        at = np.broadcast_to(places, shape).reshape((1,) * inner + (1, *shape))
        return np.take_along_axis(wide, np.broadcast_to(at, (*own, 1, *shape)), axis=inner).reshape(*own, *shape)
    inside, behind = range(1, 1 + inner), range(-inner, 0)
    turned: Any = np.moveaxis(part, inside, behind)  # type: ignore[type-var]
    return np.moveaxis(turned[(places, *np.indices(batch, sparse=True))], behind, range(inner))
