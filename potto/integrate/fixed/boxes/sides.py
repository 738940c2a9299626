"""On which side of every surface boxes lie: members of a batch that nothing cuts.

Owns `Box`, `box_of` and `sides_of`. Of a picture's pixels all but a few lie on one side of every surface. Members that
come one after the other are enclosed together, so that most are settled by the dozen; those whose run a surface may
cross are looked at one by one. Where a surface is affine in each variable of integration, its extremes over a box are
at the corners, so that signs there tell whether it crosses; of others an enclosure tells.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from typing import Any

import numpy as np
from msgspec import Struct

from potto.calculus.algebra.degree import degree, plane
from potto.calculus.solving.enclosable import enclosable
from potto.core.term_kinds import union_of
from potto.core.terms import Branch, Integral, Lam, Term, function_of, postorder, tuple_
from potto.integrate.fixed.boxes.tensor_product import Bounds, BoxIntegrand
from potto.integrate.fixed.lowered.box_text import NEAR
from potto.integrate.fixed.straight import MOST_TERMS, StraightIntegral
from potto.integrate.pieces import Evaluator, gather, numbers_at, resting
from potto.integrate.rules.intervals import Interval
from potto.integrate.rules.lowered_intervals import enclosures
from potto.kernels.cells import Array, Bools, Cell, Ints, Value

MOST_VARIABLES = 3
# Members that are enclosed together; and that are done at once, whose numbers stay in the cache.
RUN, AT_ONCE = 32, 1 << 15
UNCLEAR = -1  # of sides
NARROW = 1e3  # times how far its bounds may be off: what is not wider is left to the ways that cut


class Sides(Struct, frozen=True):
    """Of the boxes of members their bounds and their sides: a bit for each surface on which it depends what is
    integrated, or UNCLEAR."""

    bounds: Bounds
    codes: Ints


class Box(Struct, frozen=True, dict=True, eq=False):
    """Bounds and surfaces of an integral over a box, as functions of parameters, and of parameters and variables.

    surfaces: first those that are affine in each variable, `flat` of them, then the others. plan: the same as an
    integral without cuts, with the surfaces on which its integrand depends. places: of these among all surfaces.
    body: the integrand with calls, where carrying them out makes too much of it. faces: what is integrated, by sides.
    """

    variables: tuple[str, ...]
    bounds: Lam
    surfaces: tuple[Term, ...]
    flat: int
    plan: StraightIntegral
    places: tuple[int, ...]
    body: Lam | None
    faces: dict[int, BoxIntegrand] = {}

    def face(self, code: int) -> BoxIntegrand:
        """What is integrated where the surfaces are on these sides, a bit for each of the plan's."""
        found = self.faces.get(code)
        if found is None:
            term = self.plan.face(tuple(bool(code >> bit & 1) for bit in range(len(self.places))))
            function = function_of(term) if self.body is None else self.body
            degrees = tuple(degree(term, variable) for variable in self.variables)
            found = self.faces[code] = BoxIntegrand(self.plan, term, function, degrees)
        return found

    @cached_property
    def names(self) -> tuple[str, ...]:
        """All parameters."""
        return tuple(sorted(self.depends.union(self.plan.names, self.bounds.params)))

    @cached_property
    def together(self) -> bool:
        """Whether surfaces can be enclosed over several boxes."""
        return all(map(enclosable, self.surfaces))

    @cached_property
    def corners(self) -> Lam:
        """The surfaces that are affine in each variable."""
        return function_of(tuple_(self.surfaces[: self.flat]))

    @cached_property
    def depends(self) -> frozenset[str]:
        """The parameters of the surfaces."""
        return union_of(self.surfaces) - set(self.variables)

    @cached_property
    def asked(self) -> tuple[str, ...]:
        """What is asked for to look at one box."""
        return tuple(sorted(self.depends))

    @cached_property
    def depends_curved(self) -> frozenset[str]:
        """The parameters of those surfaces that are not affine in each variable."""
        return union_of(self.surfaces[self.flat :]) - set(self.variables)


def box_of(term: Integral, surfaces: Iterable[Term], body: Lam, inlined: Term) -> Box | None:
    """The box of an integral, or None if its bounds depend on its variables or a surface can't be enclosed over it.

    inlined: the integrand with calls carried out.
    """
    names = frozenset(term.variables)
    bounds = tuple(bound for pair in term.bounds for bound in pair)
    if len(names) > MOST_VARIABLES or any(b.free & names for b in bounds) or any(term.hints):
        return None
    if any(isinstance(node, Integral) for node in postorder(term.body)):
        return None
    flat: list[Term] = []
    curved: list[Term] = []
    for surface in surfaces:
        if surface.free & names:
            (flat if all(plane(surface, (name,)) for name in names) else curved).append(surface)
    if not all(map(enclosable, curved)):
        return None
    nodes = postorder(inlined)
    large = len(nodes) > MOST_TERMS
    sides = () if large else tuple(dict.fromkeys(n.surface for n in nodes if isinstance(n, Branch)))
    number = {surface: i for i, surface in enumerate((*flat, *curved))}
    decided = tuple(s for s in sides if s in number)
    places = tuple(number[s] for s in decided)
    plan = _plan(term, inlined, decided)
    return Box(term.variables, function_of(tuple_(bounds)), (*flat, *curved), len(flat), plan, places,
               body if large else None)  # fmt: skip


def _plan(term: Integral, inlined: Term, decided: tuple[Term, ...]) -> StraightIntegral:
    frames = tuple(function_of(tuple_(pair)) for pair in term.bounds)
    free = inlined.free.union(*(frame.body.free for frame in frames)) - set(term.variables)
    nothing: tuple[Any, ...] = ((),) * len(frames)
    none = (frozenset[int](),) * len(frames)
    surfaces = function_of(tuple_(decided))
    return StraightIntegral(term.variables, frames, nothing, none, none, inlined, surfaces, tuple(sorted(free)))


def sides_of(box: Box, machine: Evaluator, env: dict[str, Value], batch: int) -> Sides | None:
    """On which side of every surface the box of each member lies, wherever its bounds are within their errors; None if
    a bound moves."""
    low, high, off = np.empty((3, len(box.variables), batch))
    codes = np.empty(batch, dtype=np.int64)
    for start in range(0, batch, AT_ONCE):
        part = slice(start, min(start + AT_ONCE, batch))
        here = env if part.stop - start == batch else gather(env, part)
        ends = _ends(box, machine, here, part.stop - start)
        if ends is None:
            return None
        (low[:, part], high[:, part]), (below, above) = ends
        off[:, part] = below + above
        codes[part] = _codes(box, machine, here, low[:, part] - below, high[:, part] + above, off[:, part])
    return Sides(Bounds(low, high, off if off.any() else None), codes)


def _ends(box: Box, machine: Evaluator, env: Mapping[str, Value], batch: int) -> tuple[Array, Array] | None:
    """The lower and upper bounds of the variables, and how far they may be off, (2, variables, B) each; None if one
    moves."""
    ends, off = np.empty((2, 2, len(box.variables), batch))
    for number, cell in enumerate(numbers_at(box.bounds, machine, env)):
        if any(t is not None for t in cell.t):
            return None  # a bound that moves has boundary terms of its own
        ends[number % 2, number // 2] = cell.v
        off[number % 2, number // 2] = 0.0 if cell.e is None else cell.e
    return ends, off


def _codes(box: Box, machine: Evaluator, env: Mapping[str, Value], low: Array, high: Array, off: Array) -> Ints:
    """Per member a number whose bits are the sides on which its box lies of the surfaces that the integrand depends on;
    UNCLEAR where it is not on one side of every surface, or is not finite, or empty, or is next to nothing beside how
    far its bounds may be off."""
    size = high - low
    plain: Bools = np.asarray((np.isfinite(size) & (size > NARROW * off)).all(axis=0))
    codes = np.zeros(plain.size, dtype=np.int64)
    if box.surfaces:
        todo = _by_runs(box, machine, env, low, high, codes)
        some = low.take(todo, 1), high.take(todo, 1)
        codes[todo] = _one_by_one(box, machine, gather({name: env[name] for name in box.asked}, todo), *some)
    codes[~plain] = UNCLEAR
    return codes


def _by_runs(
    box: Box, machine: Evaluator, env: Mapping[str, Value], low: Array, high: Array, codes: Ints
) -> Ints:  # fmt: skip
    """Put the sides of members that lie on them together with their neighbours; those that are left."""
    count, everybody = codes.size // RUN, np.arange(codes.size)
    if not count or not box.together:
        return everybody

    def ends(lower: Any, upper: Any) -> Interval:
        if not isinstance(lower, np.ndarray):
            return lower, upper
        rows = (x[: count * RUN].reshape(count, RUN) for x in (lower, upper))
        return next(rows).min(axis=1), next(rows).max(axis=1)

    ranges = {name: ends(*own) for name, own in _ranges(box, env, box.depends, low, high).items()}
    settled = np.ones(count, dtype=bool)
    found = np.zeros(count, dtype=np.int64)
    for number, (least, most) in enumerate(enclosures(box.surfaces, ranges, count, machine.backend)):
        settled &= (least > 0) | (most < 0)
        if number in box.places:
            found |= np.asarray(least > 0, dtype=np.int64) << box.places.index(number)
    codes[: count * RUN] = np.repeat(found, RUN)
    left = np.ones(codes.size, dtype=bool)
    left[: count * RUN] = np.repeat(~settled, RUN)
    return everybody[left]


def _ranges(
    box: Box, env: Mapping[str, Value], names: Iterable[str], low: Array, high: Array
) -> dict[str, Interval]:  # fmt: skip
    """What these parameters, and the variables, can be."""
    found: dict[str, Interval] = {}
    for name in names:
        cell = env[name]
        assert isinstance(cell, Cell)
        found[name] = (cell.v, cell.v) if cell.e is None else (cell.v - cell.e, cell.v + cell.e)
    return found | {x: (low[n], high[n]) for n, x in enumerate(box.variables)}


def _one_by_one(box: Box, machine: Evaluator, env: dict[str, Value], low: Array, high: Array) -> Ints:
    """The same as `_codes` for members each by itself, with boxes that are neither empty nor infinite."""
    count = low.shape[1]
    codes = np.zeros(count, dtype=np.int64)
    for number, (above, below) in enumerate(_at_corners(box, machine, env, low, high)):
        codes[~(above | below)] = UNCLEAR
        if number in box.places:
            codes |= np.asarray(above, dtype=np.int64) << box.places.index(number)
    index: Ints = np.nonzero(codes != UNCLEAR)[0]
    curved = box.surfaces[box.flat :]
    if curved and index.size:
        here = gather({name: env[name] for name in box.depends_curved}, index)
        ranges = _ranges(box, here, here, low.take(index, 1), high.take(index, 1))
        for number, (least, most) in enumerate(enclosures(curved, ranges, index.size, machine.backend), box.flat):
            codes[index[~((least > 0) | (most < 0))]] = UNCLEAR
            if number in box.places:
                codes[index] |= np.asarray(least > 0, dtype=np.int64) << box.places.index(number)
    return codes


def _at_corners(
    box: Box, machine: Evaluator, env: Mapping[str, Value], low: Array, high: Array
) -> Iterator[tuple[Bools, Bools]]:
    """For each surface that is affine in each variable, which boxes lie above and which below it, clear of it."""
    if not box.flat:
        return
    corners = list(itertools.product((0, 1), repeat=len(box.variables)))
    function = box.corners
    here = {name: resting(env[name]) for name in function.params if name in env}
    for n, variable in enumerate(box.variables):
        here[variable] = Cell(np.stack([(low[n], high[n])[corner[n]] for corner in corners]))
    for value in numbers_at(function, machine.with_directions(0).tracking(), here):
        at = np.broadcast_to(value.v, (len(corners), low.shape[1]))
        least, most = at.min(axis=0), at.max(axis=0)
        near = NEAR * np.maximum(np.abs(least), np.abs(most))
        if value.e is not None:
            near += np.broadcast_to(value.e, at.shape).max(axis=0)
        yield np.asarray(least > near), np.asarray(most < -near)
