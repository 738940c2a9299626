"""On which sides of their surfaces the cells of a `StepIntegral` lie: how it is on the first one, and at which cuts it
changes.

Owns `StepPlaces`, `StepSides` with `sides_of`, and `taken`, which values are chosen. Of a polynomial all of whose roots
are rows the coefficient of the highest power tells its sign far away, and each root turns it round. Any other surface
is asked in the middle between its own cuts: all of them together once more than there are cuts, not once a cell. Where
rounding hides a sign, or there is no value, that is not sure.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from potto.core.terms import Const, children
from potto.integrate.fixed.steps.step_choices import Heads, StepChoice
from potto.integrate.fixed.steps.step_integral import StepIntegral, asked_between, probe
from potto.integrate.fixed.straight import CLEAR
from potto.integrate.pieces import Evaluator, numbers_at, resting
from potto.kernels.cells import Array, Bools, Cell, Ints, Value


class StepPlaces(Struct, frozen=True):
    """Where rows of a frame come in the order of its cuts. place: ([B,] R + 1), of R rows and one that stands for none:
    the first cell above a cut, the number of cells for what is none. cells: how many."""

    place: Ints
    cells: int

    def along(self, rows: Ints, changes: NDArray[Any], first: NDArray[Any]) -> NDArray[Any]:
        """Sums on the cells, (..., C): of `first` (...) and of the changes (..., N) at those rows (N,) that are
        passed."""
        place = self.place[..., rows]
        found = np.zeros((*changes.shape[:-1], self.cells + 1), dtype=changes.dtype)
        at: Any = (..., place) if place.ndim == 1 else (..., np.arange(len(place))[:, None], place)
        np.add.at(found, at, changes)  # a cut may be one of several surfaces
        found[..., 0] += first
        return np.cumsum(found[..., :-1], axis=-1)


class StepSides(Struct, frozen=True):
    """first: ([B,] S), whether the first cell is above each surface. change: ([B,] S, M), 1 or -1 where the sign of
    one changes at its rows, else 0. sure: for whom all that is known. leads: ([B,] T), whether leading coefficients
    that were asked for are above 0. between: whether surfaces were asked between their rows."""

    first: Bools
    change: Ints
    sure: Bools
    leads: Bools
    between: bool


class _Layout(Struct, frozen=True):
    """What there is to be known of surfaces before any number.

    rows: (S, M), of the surfaces, filled up with a row that is none. roots: polynomials by their degrees, with the
    signs of their leading coefficients, (N,) each. leads: those whose signs are asked for. others: the surfaces that
    are asked, by how many rows they have, with the numbers of their places, (N, m + 1), among all, which have the names
    `probes`. untold: the rows of what leads only where these are there.
    """

    rows: Ints
    roots: tuple[tuple[int, Ints], ...]
    signs: Ints
    leads: Ints
    others: tuple[tuple[Ints, Ints], ...]
    probes: tuple[str, ...]
    untold: Ints


@lru_cache(maxsize=512)
def layout(plan: StepIntegral, there: bool = True) -> _Layout:
    """there: all roots are, of what is not told without."""
    most = max(len(surface.rows) for surface in plan.surfaces)
    rows = np.array([[*s.rows, *[plan.rows] * (most - len(s.rows))] for s in plan.surfaces])
    signs = [int(np.sign(s.lead.value)) if isinstance(s.lead, Const) else 0 for s in plan.surfaces]
    leads = [n for n, s in enumerate(plan.surfaces) if s.lead is not None and not signs[n]]
    roots: dict[int, list[int]] = {}
    others: dict[int, list[tuple[int, range]]] = {}
    probes: list[str] = []
    for n, s in enumerate(plan.surfaces):
        if not asked_between(s, there):
            roots.setdefault(len(s.rows), []).append(n)
            continue
        names = [probe(n, i) for i in range(1 + len(s.rows))]
        others.setdefault(len(s.rows), []).append((n, range(len(probes), len(probes) + len(names))))
        probes += names
    groups = tuple((np.array([n for n, _ in own]), np.array([at for _, at in own])) for own in others.values())
    by_degree = tuple((degree, np.array(own)) for degree, own in roots.items())
    untold = np.array([row for s in plan.surfaces if s.lead is not None and not s.told for row in s.rows], dtype=int)
    return _Layout(rows, by_degree, np.array(signs), np.array(leads, dtype=int), groups, tuple(probes), untold)


def sides_of(plan: StepIntegral, places: Array, machine: Evaluator, env: Mapping[str, Value]) -> StepSides:
    """places: ([B,] R), of the rows of the frame, nan for a root that is not there."""
    untold, shape = layout(plan).untold, places.shape[:-1]
    complete = not (untold.size and np.isnan(places[..., untold]).any())
    at = layout(plan, complete)
    first = np.zeros((*shape, len(plan.surfaces)), dtype=bool)
    change = np.zeros((*shape, *at.rows.shape), dtype=np.int8)
    sure = np.ones(shape, dtype=bool)
    stretches = [_stretches(places, at.rows[own, : numbers.shape[1] - 1]) for own, numbers in at.others]
    signs, leads = at.signs, at.leads.size
    above = np.zeros((*shape, 0), dtype=bool)
    if leads or stretches:
        above, clear = _asked(plan, complete, stretches, shape, machine, env)
    if leads:
        signs = np.broadcast_to(signs, first.shape).copy()
        signs[..., at.leads] = np.where(above[..., :leads], 1, -1)
        sure &= clear[..., :leads].all(axis=-1)
    for degree, own in at.roots:
        passed, turns, pairs = _roots(places, at.rows[own, :degree], signs[..., own])
        first[..., own], change[..., own, :degree] = passed, turns
        sure &= pairs.all(axis=-1)
    for (own, numbers), (ends, order) in zip(at.others, stretches, strict=True):
        there = ends[..., 1:] > ends[..., :-1]
        side = above[..., leads + numbers]
        sure &= (clear[..., leads + numbers] | ~there).all(axis=(-2, -1))
        first[..., own] = np.take_along_axis(side, there.argmax(axis=-1)[..., None], -1)[..., 0]
        turned = side[..., 1:].astype(np.int8) - side[..., :-1]
        back = np.empty_like(turned)
        np.put_along_axis(back, order, turned, -1)
        change[..., own, : back.shape[-1]] = back
    return StepSides(first, change, sure, above[..., :leads], bool(stretches))


def same_leads(plan: StepIntegral, sides: StepSides, machine: Evaluator, env: Mapping[str, Value]) -> bool:
    """Whether the leading coefficients of one member, which are all that is asked for, have the signs that they have
    for these sides."""
    above, clear = _asked(plan, True, (), (), machine, env)
    return bool(clear.all() and (above == sides.leads).all())


def _roots(places: Array, rows: Ints, signs: Ints) -> tuple[Bools, Ints, Bools]:
    """Of N polynomials of a degree, whose roots are these rows (N, d), whether they are above 0 at the lower bound, how
    that changes at each root, and whether those that are not there come in pairs."""
    roots, degree = places[..., rows], rows.shape[1]
    low = places[..., :1, None]
    if degree == 1:
        return ((roots <= low) == (signs > 0)[..., None])[..., 0], signs[..., None], ~np.isnan(roots[..., 0])
    below, rank = (roots <= low).sum(axis=-1), roots.argsort(axis=-1).argsort(axis=-1)
    above = np.where((degree - below) % 2, -signs, signs) > 0
    turns = np.where((degree - rank) % 2, signs[..., None], -signs[..., None])
    return above, turns, np.isnan(roots).sum(axis=-1) % 2 == 0


def _stretches(places: Array, rows: Ints) -> tuple[Array, Ints]:
    """The ends of the stretches between the rows of each surface (N, m) and the bounds, ([B,] N, m + 2), where rows
    that are not between these are at one of them; and the order of the rows."""
    low, high = places[..., :1, None], places[..., 1:2, None]
    at = np.fmin(np.fmax(places[..., rows], low), high)
    order = at.argsort(axis=-1)
    inner = np.take_along_axis(at, order, -1)
    side = (*inner.shape[:-1], 1)
    return np.concatenate([np.broadcast_to(low, side), inner, np.broadcast_to(high, side)], axis=-1), order


def _asked(
    plan: StepIntegral, there: bool, stretches: Sequence[tuple[Array, Ints]], shape: tuple[int, ...],
    machine: Evaluator, env: Mapping[str, Value],
) -> tuple[Bools, Bools]:  # fmt: skip
    """Whether what is asked is above 0, surfaces in the middles of stretches, and whether that is clear of rounding,
    ([B,] T)."""
    at, asked = layout(plan, there), plan.asked[not there]
    where = np.empty((len(at.probes), *shape))
    for (_, numbers), (ends, _) in zip(at.others, stretches, strict=True):
        middles = 0.5 * (ends[..., 1:] + ends[..., :-1])
        where[numbers] = np.moveaxis(middles, 0, -1) if shape else middles
    values = np.zeros((2, len(children(asked.body)), *shape))
    places = dict(zip(at.probes, map(Cell, where if shape else where.tolist()), strict=True))
    here: dict[str, Value] = {name: places.get(name) or resting(env[name]) for name in asked.params}
    for number, cell in enumerate(numbers_at(asked, machine.with_directions(0).tracking(), here)):
        values[0, number], values[1, number] = cell.v, 0.0 if cell.e is None else cell.e
    both = np.moveaxis(values, 1, -1)
    return both[0] > 0, np.abs(both[0]) > CLEAR * both[1]


def taken(plan: StepIntegral, choice: StepChoice[int], sides: StepSides, passed: StepPlaces) -> Ints:
    """The number of the value that is chosen on each cell, ([B,] C)."""
    found = np.full((*sides.sure.shape, passed.cells), len(choice.alternatives))
    for number in range(len(choice.alternatives) - 1, -1, -1):
        led = [_led(plan, heads, sides, passed) for heads in choice.alternatives[number].heads]
        found[np.sum(led, axis=0) > 0] = number
    return found


def _led(plan: StepIntegral, heads: Heads[int], sides: StepSides, passed: StepPlaces) -> Ints:
    """How many heads lead to their value on each cell: each is asked below and above its own cuts."""
    own, rows, once = _own_rows(plan, heads)
    cuts = passed.place[..., rows]  # ([B,] H, m M)
    there = cuts < passed.cells
    n, most = cuts.shape[-1], cuts.shape[-1] // own.shape[1]
    asked = np.zeros((*cuts.shape[:-1], 1 + 2 * n), dtype=cuts.dtype)
    np.copyto(asked[..., 1 : 1 + n], cuts, where=there)
    asked[..., 1 + n :] = np.maximum(asked[..., 1 : 1 + n] - 1, 0)
    found = []
    for s in range(own.shape[1]):
        side = sides.first[..., own[:, s], None].astype(np.int8)
        for m in range(most):
            passes = cuts[..., s * most + m, None] <= asked
            side = side + sides.change[..., own[:, s], m, None] * passes
        found.append(side > 0)
    leads = heads.decide(found).astype(np.int64)
    changes = (leads[..., 1 : 1 + n] - leads[..., 1 + n :]) * (there & once)
    flat = changes.reshape(*changes.shape[:-2], -1)
    return passed.along(rows.reshape(-1), flat, leads[..., 0].sum(axis=-1))


@lru_cache(maxsize=512)
def _own_rows(plan: StepIntegral, heads: Heads[int]) -> tuple[Ints, Ints, Bools]:
    """The surfaces of each head, (H, m), their rows, (H, m M), and which of these are not those of one before."""
    own = np.array(heads.surfaces)
    rows = layout(plan).rows[own].reshape(len(own), -1)
    earlier = (rows[:, :, None] == rows[:, None, :]) & np.tri(rows.shape[1], k=-1, dtype=bool)
    return own, rows, np.logical_not(earlier.any(axis=-1))
