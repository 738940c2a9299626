"""How many nodes are enough, proved before any is evaluated.

Owns `FrameCell`, `Region`, `Orders`, `proved`, `proved_of_each` and `error_bounds`.

On a cell between known cuts the integrand is one formula, analytic wherever `discs` can bound it. If |f| <= M on the
ellipse with foci -1, 1 and half-axes adding up to rho, the Gauss rule with n nodes errs, relative to the length of its
interval, by at most

    (32/15) M rho^(-2n) / (1 - rho^(-2))                                                (n >= 2)

(Trefethen, Approximation Theory and Approximation Practice, theorem 19.3: the rule is exact up to degree 2n - 1 and for
odd functions, Chebyshev coefficients are at most 2 M rho^(-k), and the rule and the integral of T_k differ by at most
2 + 2/15.) A disc of radius R about the middle holds the ellipse of rho = R + sqrt(R^2 - 1). For a product of rules the
errors of the directions add up, each with the other variables on the real cell, which is covered by boxes.

The rule's nodes are formulas of the parameters, as the cuts are. So its error is an analytic function of them as well;
where it is at most E on a disc of radius d about a parameter, its derivative is at most E/d (Cauchy): that is the error
of the derivative of the rule, whose nodes move. One proof holds for all parameters in a region.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np
from msgspec import Struct

from potto.core.terms import Term
from potto.integrate.rules.complex_enclosures import Form, enclosed
from potto.kernels.cells import Array, Bools, Ints

LEAST_NODES, MOST_NODES = 2, 16
# Radii of the discs that are tried, in half-lengths of the cell; the last three are for polynomials.
RADII = (1.25, 1.5, 1.8, 2.2, 2.6, 3.0, 3.4, 3.8, 4.4, 5.0, 6.0, 8.0, 12.0, 20.0, 1e3, 1e8, 1e16)
# Into how many boxes the real interval of each of the other variables is cut, by the number of variables.
BOXES = {1: 1, 2: 6, 3: 3}
# What rounding may add to a bound.
SURE = 1.001


class FrameCell(Struct, frozen=True):
    """A stretch between two rows of the frame for every variable, outermost first, and the integrand on it."""

    rows: tuple[tuple[int, int], ...]
    body: Term


class Region(Struct, frozen=True, eq=False):
    """What was proved for all parameters near those given.

    cells: what it was proved of. outer: nodes for the outermost variable, per cell; inner: for each of the others.
    error: a bound of the integral's error. radius: per parameter that of the disc about it on whose every point the
    bound holds.
    """

    cells: tuple[FrameCell, ...]
    outer: tuple[int, ...]
    inner: tuple[int, ...]
    error: float
    radius: Mapping[str, float]

    def rate(self, speeds: Mapping[str, float]) -> float:
        """A bound of the error of the derivative, for parameters that move with these speeds."""
        return self.error * max((abs(v) / self.radius[n] for n, v in speeds.items() if v), default=0.0)


class Orders(Struct, frozen=True):
    """What was proved of one cell in each of R regions: nodes per variable (R, D), 0 where none were found, and bounds
    of the integral's error (R,)."""

    nodes: Ints
    error: Array


@lru_cache(maxsize=8)
def _probes(count: int) -> tuple[Array, Array, Array]:
    """Centres and radii of the variables at all probes, (D, N) each, and a bound of what a disc says of the rule's
    error, (orders, radii); N by direction, box, radius."""
    parts = BOXES[count]
    middles = (2 * np.arange(parts) + 1) / parts - 1
    centres, reach = [], []
    for direction in range(count):
        for box in itertools.product(middles, repeat=count - 1):
            for radius in RADII:
                centre, wide = list(box), [1.0 / parts] * (count - 1)
                centre.insert(direction, 0.0)
                wide.insert(direction, radius)
                centres.append(centre)
                reach.append(wide)
    radii = np.array(RADII)
    rho, n = radii + np.sqrt(radii * radii - 1), np.arange(LEAST_NODES, MOST_NODES + 1)[:, None]
    powers = np.maximum(SURE * 32 / 15 * rho ** (-2.0 * n) / (1 - rho**-2.0), 1e-300)
    return np.array(centres).T.copy(), np.array(reach).T.copy(), powers


def proved(
    variables: Sequence[str], frames: Sequence[Sequence[Term]], cells: Sequence[FrameCell],
    middle: Mapping[str, float], radius: Mapping[str, float], tolerance: float,
) -> Region | None:  # fmt: skip
    """Orders of Gauss rules that make the error of the integral a part `tolerance` of it; None if none are found.

    middle, radius: of the region of each parameter; the proof holds on discs of twice the radius.
    """
    count, places = len(variables), {name: np.array([x]) for name, x in middle.items()}
    bounds, sizes = zip(*(error_bounds(variables, frames, cell, places, radius) for cell in cells), strict=True)
    errors = np.array(bounds)[..., 0]
    share = tolerance * abs(float(sum(size[0] for size in sizes))) / (count * len(cells))
    enough: Bools = np.all(errors <= share, axis=0)
    enough[0] = True
    if not (enough.any(axis=1).all() and (errors[:, 0, -1] <= share).all()):
        return None
    outer, inner = (errors[:, 0] <= share).argmax(axis=1), enough[1:].argmax(axis=1)
    bound = sum(float(e[0, o] + e[np.arange(1, count), inner].sum()) for e, o in zip(errors, outer, strict=True))
    nodes, others = (tuple(int(number) + LEAST_NODES for number in numbers) for numbers in (outer, inner))
    return Region(tuple(cells), nodes, others, bound, dict(radius))


def proved_of_each(
    variables: Sequence[str], frames: Sequence[Sequence[Term]], cell: FrameCell, middle: Mapping[str, Array],
    radius: Mapping[str, float], exact: Sequence[int | None], tolerance: float,
) -> Orders:  # fmt: skip
    """The same of one cell in many regions at once, whose middles are (R,) each.

    exact: the nodes of those variables for which it is known that they leave nothing out.
    """
    errors, size = error_bounds(variables, frames, cell, middle, radius)
    free = np.array([n is None for n in exact])
    errors[~free] = 0.0
    enough = errors <= tolerance * np.abs(size) / max(1, int(free.sum()))
    number = enough.argmax(axis=1)
    error = np.take_along_axis(errors, number[:, None], 1)[:, 0].sum(axis=0)
    nodes = np.array([number[i] + LEAST_NODES if n is None else np.full(size.size, n) for i, n in enumerate(exact)])
    return Orders(np.where(enough.any(axis=1).all(axis=0), nodes, 0).T, error)


def error_bounds(
    variables: Sequence[str], frames: Sequence[Sequence[Term]], cell: FrameCell, middle: Mapping[str, Array],
    radius: Mapping[str, float] | Mapping[str, Array],
) -> tuple[Array, Array]:  # fmt: skip
    """Of a cell in R regions: bounds of the error of rules along each variable, (D, orders, R), and what the integral
    is about, (R,). Orders begin with LEAST_NODES. radius: the same in all regions, or of each (R,)."""
    count, names = len(variables), sorted(middle)
    centres, reach, powers = _probes(count)
    own = np.broadcast_arrays(np.zeros(1), *[2.0 * np.atleast_1d(radius[name]) for name in names])[1:]
    h = np.stack(np.broadcast_arrays(*[row[None] for row in reach], *[row[:, None] for row in own]))
    unit = np.eye(count + len(names))[:, :, None, None]
    start = {name: Form(middle[name][:, None], unit[i], 0.0, h) for i, name in enumerate(names, count)}
    form = _on_cell(variables, frames, cell, start, unit, centres, h)
    shape = next(iter(middle.values())).size if middle else 1, centres.shape[1]
    most = np.broadcast_to(form.most, shape).reshape(shape[0], count, -1, 1, len(RADII))
    errors = (most * powers).min(axis=-1).max(axis=2)
    size = np.broadcast_to(form.m, shape)[:, : shape[1] // count].mean(axis=1)
    return np.moveaxis(errors, 0, -1), size


def _on_cell(
    variables: Sequence[str], frames: Sequence[Sequence[Term]], cell: FrameCell, env: dict[str, Form], unit: Array,
    centres: Array, h: Array,
) -> Form:  # fmt: skip
    """The integrand times the lengths of the cell's stretches, over variables that run from -1 to 1 on the cell."""
    known: dict[Term, Form] = {}
    volume: Form | None = None
    for i, (variable, frame, (low, high)) in enumerate(zip(variables, frames, cell.rows, strict=True)):
        lo, hi = enclosed((frame[low], frame[high]), env, known, h)
        width = hi - lo
        place = Form(0.5 + 0.5 * centres[i], 0.5 * unit[i], 0.0, h)
        env[variable] = lo + width * place
        volume = width if volume is None else volume * width
    assert volume is not None
    return enclosed((cell.body,), env, known, h)[0] * volume
