"""Where ranges are cut beside the places at which an exponential, or what is like it, may have a layer.

Owns `layer_rows` and `exponents_of`. What falls like exp(-k x) from an end or a cut on is gone before the first node if
k is large, and may be 0 at the end itself: x exp(-k x). How far it reaches is where its exponent has changed by DEPTH.
There the range is cut, and nodes are where the layer is, in whatever it is multiplied with and in each derivative.
Around places to which an integrand points by itself, as exp(-x^2) does, panels are refined anyway.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from potto.core.terms import Lam, Prim, Term, function_of, postorder, tuple_
from potto.integrate.decomposition.meetings import Row, as_array
from potto.integrate.levels import HINT, LevelPlan
from potto.integrate.pieces import Evaluator, gather, numbers_at, still
from potto.kernels.cells import Array, Cell, Ints, Value
from potto.primitives import PRIMITIVES

# By how much an exponent may change over a range whose nodes see what it is the exponent of, and by how much it has
# changed where nothing is left to doubles.
STEEPEST, DEPTH = 64.0, 40.0
# How far from a place it is looked, in parts of the range; between two of these it is taken to be linear.
DISTANCES = 8.0 ** -np.arange(13.0, 0.0, -1.0)
# Where variables further in are, all of them at once, in parts of their ranges.
PARTS = (0.0, 0.5, 1.0)


def exponents_of(body: Term, variable: str, known: frozenset[str]) -> Lam | None:
    """The exponents in an integrand that vary with a variable, as a tuple; None if there are none. known: the names
    that have values."""
    found = (
        exponent
        for node in postorder(body)
        if isinstance(node, Prim)
        for exponent in PRIMITIVES[node.op].exponents(*node.args)
        if variable in exponent.free and exponent.free <= known
    )
    terms = tuple(dict.fromkeys(found))
    return function_of(tuple_(terms)) if terms else None


def layer_rows(
    exponents: Lam, inner: Sequence[LevelPlan], variable: str, env: Mapping[str, Value], lo: Cell, hi: Cell,
    rows: Sequence[Row], batch: int, machine: Evaluator,
) -> list[Row]:  # fmt: skip
    """Rows beside both bounds and the places of other rows, for members on whose ranges an exponent changes much.

    inner: the variables further in."""
    ends = np.stack([as_array(end.v, batch) for end in (lo, hi)])
    low, high = ends.min(axis=0), ends.max(axis=0)
    steep = np.flatnonzero(np.isfinite(low) & np.isfinite(high) & (high > low))
    places = np.stack((low, 0.5 * (low + high), high))[:, steep]
    values = _at(exponents, inner, variable, env, steep, places, machine)
    with np.errstate(invalid="ignore"):
        steep = steep[(np.ptp(values, axis=2) > STEEPEST).any(axis=(0, 1))]
    if not steep.size:
        return []
    low, length = low[steep], (high - low)[steep]
    beside = [(lo.v, lo.t), (hi.v, hi.t), *((row.x, row.t) for row in rows)]  # a layer moves with what it lies beside
    middles = np.stack([as_array(x, batch)[steep] for x, _ in beside])
    middles = np.where((middles >= low) & (middles <= low + length), middles, np.nan)
    found = []
    for way in (1.0, -1.0):
        far = way * DISTANCES[:, None, None] * length
        there = np.concatenate((middles[None], middles + far)).reshape(-1, steep.size)
        values = _at(exponents, inner, variable, env, steep, there, machine)
        values = values.reshape(*values.shape[:2], 1 + DISTANCES.size, *middles.shape)
        with np.errstate(invalid="ignore"):
            change = np.nan_to_num(np.abs(values[:, :, 1:] - values[:, :, :1])).max(axis=1)
        for own in _reached(change) * length:
            for place, (_, speed) in zip(middles + way * own, beside, strict=True):
                x = np.full(batch, np.nan)
                x[steep] = place
                if np.isfinite(place).any():
                    found.append(Row(x, speed, HINT, False))
    return found


def _reached(change: Array) -> Array:
    """How far off, in parts of the range, changes (E, distances, ...) come to DEPTH, nan where they don't: (E, ...)."""
    beyond = change >= DEPTH
    at = np.maximum(beyond.argmax(axis=1), 1)[:, None]
    near, far = (np.take_along_axis(change, own, 1)[:, 0] for own in (at - 1, at))
    start, end = DISTANCES[at - 1][:, 0], DISTANCES[at][:, 0]
    with np.errstate(all="ignore"):
        part = np.clip((DEPTH - near) / (far - near), 0.0, 1.0)
        return np.where(beyond.any(axis=1) & np.isfinite(part), start + part * (end - start), np.nan)


def _at(
    exponents: Lam, inner: Sequence[LevelPlan], variable: str, env: Mapping[str, Value], members: Ints, places: Array,
    machine: Evaluator,
) -> Array:  # fmt: skip
    """Exponents (E, L, P, B) of members (B,) at places (P, B), on lines that lead through the variables further in."""
    machine = machine.with_directions(0)
    named = {level.variable for level in inner} & set(exponents.params)
    parts = np.asarray(PARTS if named else (0.5,))
    shape = parts.size, *places.shape
    given = {name: still(value) for name, value in env.items()}
    here = gather(given, np.broadcast_to(members, shape).ravel())
    here[variable] = Cell(np.broadcast_to(places, shape).ravel())
    part = np.broadcast_to(parts[:, None, None], shape).ravel()
    with np.errstate(all="ignore"):
        for level in inner if named else ():
            low, high = (np.broadcast_to(cell.v, part.shape) for cell in numbers_at(level.bounds, machine, here))
            low, high = (np.where(np.isfinite(end), end, other) for end, other in ((low, high - 1), (high, low + 1)))
            here[level.variable] = Cell(np.nan_to_num(low + part * (high - low)))
        values = numbers_at(exponents, machine, {name: here[name] for name in exponents.params})
        return np.stack([np.broadcast_to(value.v, part.shape).reshape(shape) for value in values])
