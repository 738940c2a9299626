"""Cuts of a range that others cover: within a disc of a union nothing changes at the circles of the others.

Owns `uncovered`. A sorted range is swept from below; what lies below the highest end so far is covered.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from msgspec.structs import replace

from potto.core.terms import Term
from potto.integrate.decomposition.corners import beside
from potto.integrate.decomposition.meetings import Row, as_array
from potto.integrate.levels import LevelPlan
from potto.integrate.pieces import Evaluator, numbers_at
from potto.kernels.cells import Array, Value


def uncovered(
    level: LevelPlan, rows: list[Row], env: dict[str, Value], batch: int, machine: Evaluator, face: Term | None
) -> list[Row]:
    """The cuts of a range without those that are covered.

    face: the surface, if any, that covers nothing, since it is what is integrated over.
    """
    slopes = numbers_at(level.covering, machine.with_directions(0), env)
    lows, highs = [], []
    for ends, slope in zip(level.covers, slopes, strict=True):
        if level.level.cuts[rows[ends[0]].cut].surface is face:
            continue
        x = [as_array(rows[i].x, batch) for i in ends]
        wide = np.maximum.reduce([as_array(beside(rows[i]), batch) for i in ends])
        up = as_array(slope.v, batch) > 0
        if len(ends) == 2:
            low, high = np.where(up, np.nan, np.minimum(*x)), np.where(up, np.nan, np.maximum(*x))
        else:
            low, high = np.where(up, x[0], -np.inf), np.where(up, np.inf, x[0])
        there = np.isfinite(wide) & (low + wide < high - wide)
        lows.append(np.where(there, low + wide, np.inf))
        highs.append(np.where(there, high - wide, -np.inf))
    if not lows:
        return rows
    places = np.stack([as_array(rows[i].x, batch) for i in level.covered])
    reach = np.stack([as_array(beside(rows[i]), batch) for i in level.covered])
    hidden = _below_ends(np.stack(lows), np.stack(highs), places - reach, places + reach)
    found = list(rows)
    for i, there in zip(level.covered, hidden, strict=True):
        if there.any():
            found[i] = replace(rows[i], x=np.where(there, np.nan, as_array(rows[i].x, batch)))
    return found


def _below_ends(lows: Array, highs: Array, starts: Array, stops: Array) -> Any:
    """Which stretches (R, B) lie within one of the ranges (K, B)."""
    order = np.argsort(lows, axis=0)
    lows, highs = np.take_along_axis(lows, order, 0), np.take_along_axis(highs, order, 0)
    highest = np.concatenate((np.full_like(lows[:1], -np.inf), np.maximum.accumulate(highs, axis=0)))
    both = np.concatenate((lows, starts))
    sorted_ = np.argsort(both, axis=0, kind="stable")  # of what is the same ranges come first
    begun = np.cumsum(sorted_ < lows.shape[0], axis=0)
    before = np.empty_like(begun)
    np.put_along_axis(before, sorted_, begun, 0)
    return stops < np.take_along_axis(highest, before[lows.shape[0] :], 0)
