"""Where a surface of two variables has a critical point on itself, so that its level moves infinitely fast there.

Owns `beside_saddles`. What crosses a level set psi = 0 counts by 1/|grad psi|, which grows at least like 1/r beside a
place where psi and its gradient are 0: along any branch that runs into it the slope by the level is infinite, of
x^3 + y^3 - 3*x*y < t at t = 0 like log(1/t). Sections lie too close together there to tell how it grows from near by,
so the place is looked for by its own equations, grad psi = 0, and how it grows is told from afar.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from potto.calculus.solving.enclosable import slope_of
from potto.core.terms import Lam, Term, function_of, tuple_
from potto.integrate.decomposition.meetings import as_array
from potto.integrate.panels.panel_batch import PanelBatch
from potto.integrate.pieces import gather, number_at, numbers_at, still
from potto.kernels.cells import Array, Cell, Ints, Value

# Steps towards a critical point, each of which at least halves the distance where the gradient is a square or a cube;
# which part of the largest gradient is none, and of a range how far beyond it a place may be.
STEPS, LEVEL, BEYOND = 64, 2.0**-40, 2.0**-30
STARTS = 5  # places along each variable, ends counted
# How far from a place it is told how the slope grows, in parts of the range, and by which power at the least, for 1/r.
ASIDE, POWER = (1e-3, 1e-4, 1e-5), 0.95
ROUNDED = 4.0  # how many times its rounding a surface may be at a place that it goes through


def beside_saddles(work: PanelBatch, members: Ints) -> Array:
    """To which infinity the derivatives of some members go for such places, 0 for others: (k, B)."""
    goes = np.zeros((work.k, work.batch))
    plan = work.parent.plan
    if len(plan.levels) != 2 or plan.over is not None:
        return goes
    for surface in dict.fromkeys(group.cut.surface for group in plan.groups):
        terms = _terms(surface, *(level.variable for level in plan.levels))
        if terms is None:
            continue
        owner, places = _critical(work, members, *terms)
        for sign in (1.0, -1.0) if owner.size else ():
            found = _growth(work, owner, places, sign)
            for d, n in zip(*np.nonzero(found), strict=True):
                goes[d, owner[n]] = found[d, n]
    return goes


@lru_cache(maxsize=256)
def _terms(surface: Term, x: str, y: str) -> tuple[Lam, Lam] | None:
    """A surface; its gradient, and the slopes of that, as one function. None if it is no smooth one of both."""
    if not {x, y} <= surface.free:
        return None
    gradient = [slope_of(surface, name) for name in (x, y)]
    slopes = [None if g is None else slope_of(g, name) for g in gradient for name in (x, y)]
    found = [term for term in (*gradient, *slopes) if term is not None]
    return (function_of(surface), function_of(tuple_(tuple(found)))) if len(found) == 6 else None


def _critical(work: PanelBatch, members: Ints, surface: Lam, slopes: Lam) -> tuple[Ints, Array]:
    """The places within the range at which a surface and its gradient are 0: whose, and where along the outer
    variable, (N,) each."""
    low, high = _range(work, 0, {name: still(value) for name, value in work.env.items()}, work.batch)
    seg = work.seg.pick(np.nonzero(np.isin(work.seg.owner, members))[0])
    even = low[members] + np.linspace(0.0, 1.0, STARTS)[:, None] * (high - low)[members]
    owner = np.concatenate((seg.owner, seg.owner, np.tile(members, STARTS)))
    x = np.concatenate((seg.a, seg.b, even.ravel()))
    owner, x = owner[np.isfinite(x)], x[np.isfinite(x)]
    bottom, top = _range(work, 1, _placed(work, owner, x), owner.size)
    y = (bottom + np.linspace(0.0, 1.0, STARTS)[:, None] * (top - bottom)).ravel()
    owner, x = np.tile(owner, STARTS), np.tile(x, STARTS)
    start = np.isfinite(y)
    owner, at = owner[start], np.stack((x, y))[:, start]
    machine = work.machine.with_directions(0)
    largest = np.zeros((2, work.batch))
    with np.errstate(all="ignore"):
        for turn in range(STEPS):
            found = _numbers(slopes, work, owner, at)
            gradient, matrix = found[:2], np.moveaxis(found[2:].reshape(2, 2, -1), -1, 0)
            if not turn:
                for row, g in zip(largest, np.abs(gradient), strict=True):
                    np.fmax.at(row, owner, g)
            known = np.isfinite(found).all(axis=0)
            owner, at, gradient, matrix = owner[known], at[:, known], gradient[:, known], matrix[known]
            at = at - (np.linalg.pinv(matrix) @ gradient.T[..., None])[..., 0].T
        flat = (np.abs(_numbers(slopes, work, owner, at)[:2]) <= LEVEL * largest[:, owner]).all(axis=0)
        owner, at = owner[flat], at[:, flat]
        value = number_at(surface, machine.tracking(), _placed(work, owner, *at, of=surface))
        on_it = np.abs(value.v) <= ROUNDED * (0.0 if value.e is None else value.e)
        bottom, top = _range(work, 1, _placed(work, owner, at[0]), owner.size)
        for place, lo, hi in ((at[0], low[owner], high[owner]), (at[1], bottom, top)):
            on_it &= (place >= lo - BEYOND * (hi - lo)) & (place <= hi + BEYOND * (hi - lo))
    return owner[on_it], at[0, on_it]


def _growth(work: PanelBatch, owner: Ints, places: Array, side: float) -> Array:
    """The signs of derivatives that grow like 1/r, or faster, on one side of places, 0 of others: (k, N)."""
    low, high = _range(work, 0, {name: still(value) for name, value in work.env.items()}, work.batch)
    u = np.array(ASIDE) * (high - low)[owner, None]
    x = places[:, None] + side * u
    goes = np.zeros((work.k, owner.size))
    seg = work.seg
    own = (seg.owner == owner[:, None]) & (seg.a < x.min(axis=1)[:, None]) & (seg.b > x.max(axis=1)[:, None])
    there = np.nonzero(own.any(axis=1))[0]
    if not there.size:
        return goes
    numbers, _, _ = work.integrand(own[there].argmax(axis=1), x[there])
    slopes = numbers[:, 1 : 1 + work.k]
    with np.errstate(all="ignore"):
        power = np.log(np.abs(slopes[..., 1:] / slopes[..., :-1])) / np.log(u[there, :-1] / u[there, 1:])
        grows = ((power >= POWER) & (slopes[..., 1:] * slopes[..., :1] > 0)).all(axis=-1)
    signs = np.where(grows, np.sign(slopes[..., -1]), 0.0)
    goes[:, there] = np.take_along_axis(signs, np.abs(signs).argmax(axis=0)[None], axis=0)[0]
    return goes


def _placed(work: PanelBatch, owner: Ints, *at: Array, of: Lam | None = None) -> dict[str, Value]:
    """What members have, with the variables, from the outermost one in, at places (N,)."""
    here = {name: still(value) for name, value in gather(work.env, owner).items()}
    for level, place in zip(work.parent.plan.levels, at, strict=False):
        here[level.variable] = Cell(place)
    return here if of is None else {name: here[name] for name in of.params}


def _numbers(function: Lam, work: PanelBatch, owner: Ints, at: Array) -> Array:
    """Several numbers at places (2, N), as rows."""
    values = numbers_at(function, work.machine.with_directions(0), _placed(work, owner, *at, of=function))
    return np.stack([as_array(value.v, owner.size) for value in values])


def _range(work: PanelBatch, number: int, env: dict[str, Value], size: int) -> tuple[Array, Array]:
    """Where a variable begins and ends, (B,) each."""
    bounds = work.parent.plan.levels[number].bounds
    lo, hi = numbers_at(bounds, work.machine.with_directions(0), {name: env[name] for name in bounds.params})
    a, b = as_array(lo.v, size), as_array(hi.v, size)
    return np.minimum(a, b), np.maximum(a, b)
