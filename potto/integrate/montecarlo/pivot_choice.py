"""Which variables a surface is solved for to find points on it.

Owns `pivots`.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from potto.calculus.algebra.affine import affine
from potto.calculus.algebra.ranges import range_of
from potto.calculus.differentiation.derivative import NotSmooth, partial
from potto.core.simplify import simplify
from potto.core.terms import Term
from potto.integrate.montecarlo.cube_map import Chart
from potto.kernels.cells import Cell

# How much flatter than the steepest a pivot may be to do alone: its weight then varies by that factor at most.
STEEP = 4.0


def pivots(chart: Chart, term: Term, axes: tuple[int, ...], number: int) -> tuple[int, ...]:
    """Of the variables `axes` that a surface varies with one if that is known to do, otherwise all of them.

    number: that of its innermost variable, which is preferred.
    """
    if len(axes) == 1:
        return axes
    lengths = _box(chart, axes)
    slopes = None if lengths is None else _slopes(chart, term, lengths)
    if slopes is None or lengths is None:
        return axes
    most = {i: hi * _length(lengths[i]) for i, (_, hi) in slopes.items()}
    least = {i: lo * _length(lengths[i]) for i, (lo, _) in slopes.items()}
    order = sorted(axes, key=lambda i: (i != number, -least[i]))
    for i in order:
        if least[i] > 0 and STEEP * least[i] >= max(most.values()):
            return (i,)
    return axes


def _box(chart: Chart, axes: tuple[int, ...]) -> dict[int, tuple[float, float]] | None:
    """The bounds of the variables if they are the same everywhere."""
    box: dict[int, tuple[float, float]] = {}
    names = {level.variable for level in chart.plan.levels}
    for i in axes:
        level = chart.plan.levels[i]
        if (level.level.lo.free | level.level.hi.free) & names:
            return None
        lo, hi = chart.bounds(level, chart.start(1, chart.machine.directions).env, chart.machine)
        a, b = float(np.ravel(lo.v)[0]), float(np.ravel(hi.v)[0])
        box[i] = (min(a, b), max(a, b))
    return box


def _slopes(chart: Chart, surface: Term, box: dict[int, tuple[float, float]]) -> dict[int, tuple[float, float]] | None:
    """The least and the greatest |d psi/dx_i|; None if that is not known."""
    names = {i: chart.plan.levels[i].variable for i in box}
    found = affine(surface, tuple(names.values()))
    if found is None and any(np.isinf(end) for ends in box.values() for end in ends):
        return None
    terms = _partials(surface, tuple(names.values())) if found is None else found.coefficients
    if terms is None:
        return None
    known: dict[str, tuple[float, float]] = {names[i]: ends for i, ends in box.items()}
    for name, value in chart.env.items():
        if isinstance(value, Cell):
            at = float(np.ravel(value.v)[0])
            known[name] = (at, at)
    out: dict[int, tuple[float, float]] = {}
    for i, term in zip(names, terms, strict=True):
        r = range_of(term, known)
        out[i] = (max(r.lo, -r.hi, 0.0), max(abs(r.lo), abs(r.hi)))
    return out if all(np.isfinite(hi) for _, hi in out.values()) else None


def _length(ends: tuple[float, float]) -> float:
    length = ends[1] - ends[0]
    return length if np.isfinite(length) else 1.0


@lru_cache(maxsize=1024)
def _partials(surface: Term, names: tuple[str, ...]) -> tuple[Term, ...] | None:
    try:
        return tuple(simplify(partial(surface, name)) for name in names)
    except NotSmooth:
        return None
