"""Where ranges are cut beside the places at which an exponential, or what is like it, may have a layer.

Owns `layer_rows` and `exponents_of`. What falls like exp(-k x) from an end or a cut on is gone before the first node if
k is large, and may be 0 at the end itself: x exp(-k x). How far it reaches is where its exponent has changed by DEPTH.
There the range is cut, and nodes are where the layer is, in whatever it is multiplied with and in each derivative.
Around places to which an integrand points by itself, as exp(-x^2) does, panels are refined anyway.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from potto.core.terms import Term
from potto.integrate.decomposition.lines import Watched, box_of, on_lines, watched
from potto.integrate.decomposition.meetings import Row, as_array
from potto.integrate.levels import HINT, LevelPlan
from potto.integrate.pieces import Evaluator
from potto.integrate.rules.intervals import Interval
from potto.integrate.rules.steepness import STEEPEST, change, exponents_in
from potto.kernels.cells import Array, Cell, Ints, Value

# By how much an exponent has changed where nothing is left to doubles; and beyond which exponentials are 0 or infinite,
# and what saturates has done so.
DEPTH, GONE = 40.0, 745.0
# How far from a place it is looked, in parts of the range; between two of these it is taken to be linear.
DISTANCES = 8.0 ** -np.arange(13.0, 0.0, -1.0)


def exponents_of(body: Term, variable: str, known: frozenset[str]) -> Watched | None:
    """The exponents in an integrand that vary with a variable; None if there are none. known: the names that have
    values."""
    return watched(exponents_in(body), variable, known)


def layer_rows(
    exponents: Watched, inner: Sequence[LevelPlan], variable: str, env: Mapping[str, Value], lo: Cell, hi: Cell,
    rows: Sequence[Row], batch: int, machine: Evaluator,
) -> list[Row]:  # fmt: skip
    """Rows beside both bounds and the places of other rows, for members on whose ranges an exponent changes much.

    inner: the variables further in."""
    ends = np.stack([as_array(end.v, batch) for end in (lo, hi)])
    low, high = ends.min(axis=0), ends.max(axis=0)
    steep = np.flatnonzero(np.isfinite(low) & np.isfinite(high) & (high > low))
    if not steep.size or not _steep_somewhere(exponents, inner, variable, env, (low[steep].min(), high[steep].max())):
        return []
    places = np.stack((low, 0.5 * (low + high), high))[:, steep]
    values = _at(exponents, inner, variable, env, steep, places, machine)
    values = np.where(np.isfinite(values), values, np.nan)  # where an exponent is infinite, it is so beside no layer
    steep = steep[(np.fmax.reduce(values, axis=2) - np.fmin.reduce(values, axis=2) > STEEPEST).any(axis=(0, 1))]
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
            here, beyond = values[:, :, :1], values[:, :, 1:]
            gone = (np.abs(here) > GONE) & (np.abs(beyond) > GONE) & (here * beyond > 0)
            changes = np.nan_to_num(np.where(gone, 0.0, np.abs(beyond - here))).max(axis=1)
        for own in _reached(changes) * length:
            for place, (_, speed) in zip(middles + way * own, beside, strict=True):
                x = np.full(batch, np.nan)
                x[steep] = place
                if np.isfinite(place).any():
                    found.append(Row(x, speed, HINT, False))
    return found


def _steep_somewhere(
    exponents: Watched, inner: Sequence[LevelPlan], variable: str, env: Mapping[str, Value], ends: Interval
) -> bool:
    """Whether an exponent may be steep for some member, as far as an enclosure over all of them tells."""
    box = box_of(inner, variable, env, ends)
    if box is None or any(not e.free <= box.keys() for e in exponents.terms):
        return True
    return not change(exponents.terms, box) <= STEEPEST


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
    exponents: Watched, inner: Sequence[LevelPlan], variable: str, env: Mapping[str, Value], members: Ints,
    places: Array, machine: Evaluator,
) -> Array:  # fmt: skip
    """Exponents (E, L, P, B) of members (B,) at places (P, B), on lines that lead through the variables further in."""
    parts = exponents.parts(inner)[:, None, None]
    wide = np.broadcast_to(places, (parts.size, *places.shape))
    return on_lines(exponents, inner, variable, env, members, parts, wide, machine)
