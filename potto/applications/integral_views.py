"""An integral as it can be seen: its domain, surfaces, cells, and what moves them, in numbers.

Owns `IntegralView` and `Viewer`. A viewer belongs to one integral of one function; asking it again with other numbers
compiles nothing. In one variable surfaces are points and the boundary term is their sum, in two they are lines and it
is the integral along them; of more variables the first two are seen, in a section where the others stand.
"""

from __future__ import annotations

import math
import re
import time
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct

from potto.applications.contours import spread, zero_lines
from potto.applications.integral_numbers import Compile, constant
from potto.checking.regions import DrawnIntegral, RegionSurface
from potto.core.terms import ZERO, Lam
from potto.kernels.cells import Array, Cell, Value
from potto.runtime.evaluation.machine import WATCHING

PLACES = 257  # along a curve
SIDE = 97  # along a side of a square
QUICK_SIDE, COARSEST = 49, 17  # while something is dragged: as many as fit into a frame
FRAME = 0.016  # seconds
SEEN = 2  # variables, at most; of more there is a section
REACH = 6.0  # how far an endless range is drawn
ARROWS = 24  # of one surface, at most
NODES = 1500
ALONG = 9  # parts of a bound, between which its arrows stand
PARTS, CLOSER = 1024, 5  # a root is looked for in so many parts, so often: its ends are neighbours then

_NAME = re.compile(r"[^\W\d]\w*(?:\.\w+)*")
Point = tuple[float, ...]
Line = tuple[Point, Point]


class Arrow(Struct, frozen=True):
    """A place of a surface or a bound, how fast it moves there, and what the integral gains by that.

    weight: in one variable the gain itself; in two the gain for each unit of length along the surface.
    """

    at: Point
    velocity: Point
    weight: float


class Section(Struct, frozen=True):
    """A variable that is not seen: where it stands, and from where to where it may."""

    name: str
    at: float
    low: float
    high: float


class SurfaceView(Struct, frozen=True):
    """A surface inside of the domain. lines: from and to, in one variable the same point twice. condition: its equation
    as the program tells it, where parts of a parameter have no names of their own."""

    equation: str
    lines: tuple[Line, ...]
    arrows: tuple[Arrow, ...]
    gain: float  # what all of it adds to the derivative, as far as that is seen
    condition: str


class IntegralView(Struct, frozen=True):
    """What there is to see of an integral for one choice of its parameters.

    box: from and to of each variable that is seen. cells: at the places of `integrand` the number of the cell, one for
    each way that the surfaces can be on their sides; -1 outside of the domain. integrand: PLACES numbers, or rows
    from below. held: the variables that are not seen. ghosts: where surfaces and bounds are
    when the parameter is a step less, and a step more. nodes: where the integrand was evaluated for the value. outline:
    the corners of the domain, piece by piece, where that is not all of the box.
    """

    variables: tuple[str, ...]
    box: tuple[tuple[float, float], ...]
    integrand: tuple[tuple[float, ...], ...]
    cells: tuple[tuple[int, ...], ...]
    surfaces: tuple[SurfaceView, ...]
    bounds: tuple[Arrow, ...]
    held: tuple[Section, ...] = ()
    cut: bool = False  # whether a range goes on beyond what is drawn
    unseen: bool = False  # whether there are surfaces that are not drawn
    ghosts: tuple[tuple[Line, ...], tuple[Line, ...]] = ((), ())
    nodes: tuple[Point, ...] = ()
    outline: tuple[tuple[Point, ...], ...] = ()


class Viewer:
    """Looks at one integral. compile: makes a function of numbers and arrays of a term of the region. parts: the names
    of parts of parameters, and what the program calls these."""

    def __init__(self, region: DrawnIntegral, compile: Compile, parts: Mapping[str, str] | None = None) -> None:
        self.region = region
        self._written = {**{name: name.rstrip("_") for name in region.variables}, **(parts or {})}
        self._compiled = compile
        self.seen = region.variables[:SEEN]
        self._quick_side = QUICK_SIDE

    def look(
        self, given: Mapping[str, float], wrt: str = "", ghost: float = 0.0, nodes: bool = False, quick: bool = False,
        sections: Mapping[str, float] | None = None,
    ) -> IntegralView:  # fmt: skip
        """The view with these parameters; `sections`: where variables that are not seen stand, those left out in the
        middle of their ranges, and none beyond its range. With ghosts for steps of `wrt`, and nodes, if they are
        wanted; a `quick` one is as coarse as a frame asks for. Raises PottoError where the integrand has no value."""
        start = time.perf_counter()
        places: dict[str, Any] = {**given, **dict.fromkeys(self.region.variables, 0.0)}
        box, held, cut = self._ranges(places, sections or {})
        count = PLACES if len(box) == 1 else self._quick_side if quick else SIDE
        grids = [np.linspace(low, high, count) for low, high in box]
        at = {**places, **self._mesh(grids)}
        inside = self._inside(at)
        values = self._numbers(self.region.integrand, at)
        levels = [self._numbers(surface.level, at) for surface in self.region.surfaces]
        code = np.zeros(values.shape, dtype=np.int64)
        for place, level in enumerate(levels[:30]):
            code += (level > 0).astype(np.int64) << place
        _, cells = np.unique(code, return_inverse=True)
        cells = np.where(inside, cells.reshape(values.shape), -1)
        surfaces = tuple(
            self._surface(surface, level, grids, places)
            for surface, level in zip(self.region.surfaces, levels, strict=True)
        )
        view = IntegralView(
            self.seen, tuple(box), _rows(np.where(inside, values, np.nan)), _rows(cells), surfaces,
            self._bounds(places, box), tuple(held), cut, self.region.unseen,
            self._ghosts(places, grids, wrt, ghost) if ghost else ((), ()),
            self._nodes(given, box) if nodes else (), self._outline(grids, places) if len(grids) == 2 else (),
        )  # fmt: skip
        if quick:
            self._fit(time.perf_counter() - start)
        return view

    def _fit(self, seconds: float) -> None:
        """Make the next quick view of as many places as fit into three quarters of a frame; the rest is drawing."""
        side = self._quick_side * math.sqrt(0.75 * FRAME / seconds)
        self._quick_side = int(min(max(side, COARSEST), QUICK_SIDE))

    def _ghosts(
        self, places: Mapping[str, Any], grids: Sequence[Array], wrt: str, step: float
    ) -> tuple[tuple[Line, ...], tuple[Line, ...]]:
        """The surfaces that move, and the bounds, a step to both sides."""
        sides: list[tuple[Line, ...]] = []
        for way in (-step, step):
            there = {**places, wrt: places[wrt] + way}
            found: list[Line] = []
            for surface in self.region.surfaces:
                if surface.rate.body is ZERO:
                    continue
                level = self._numbers(surface.level, {**there, **self._mesh(grids)})
                ends = self._roots(surface, level, grids[0], there) if len(grids) == 1 else zero_lines(level, *grids)
                if len(ends):
                    middles = dict(zip(self.seen, ends.mean(axis=1).T, strict=True))
                    found += _lines(ends[np.nonzero(self._inside({**there, **middles}))[0]])
            for axis, rates in enumerate(self.region.rates[: len(self.seen)]):
                for end in (0, 1):
                    found += self._edge(axis, end, there, grids) if rates[end].body is not ZERO else ()
            sides.append(tuple(found))
        return sides[0], sides[1]

    def _edge(self, axis: int, end: int, places: Mapping[str, Any], grids: Sequence[Array]) -> tuple[Line, ...]:
        """A bound as lines: across the second variable's range there, or along the first one's."""
        if axis == 0:
            at = self._number(self.region.bounds[0][end], places)
            if not np.isfinite(at):
                return ()
            if len(grids) == 1:
                return (((at,), (at,)),)
            low, high = self._second({**places, self.seen[0]: at})
            return (((at, float(low)), (at, float(high))),) if low <= high else ()
        sides = self._second({**places, self.seen[0]: grids[0]})
        points = np.stack([grids[0], sides[end]], axis=1)
        there = sides[0] <= sides[1]
        return _lines(np.stack([points[:-1], points[1:]], axis=1)[there[:-1] & there[1:]])

    def _second(self, places: Mapping[str, Any]) -> Any:
        """From and to of the second variable, as far as they are drawn."""
        low, high = (self._numbers(bound, places) for bound in self.region.bounds[1])
        return np.where(np.isfinite(low), low, -REACH), np.where(np.isfinite(high), high, REACH)

    def _outline(self, grids: Sequence[Array], places: Mapping[str, Any]) -> tuple[tuple[Point, ...], ...]:
        """The domain as polygons, where its second range depends on the first variable."""
        low, high = self._second({**places, self.seen[0]: grids[0]})
        if np.ptp(low) == 0 and np.ptp(high) == 0:
            return ()
        xs, low, high = _with_corners(grids[0], low, high)
        there = np.nonzero(low <= high)[0]
        runs = [run for run in np.split(there, np.nonzero(np.diff(there) > 1)[0] + 1) if len(run) > 1]
        pieces: list[tuple[Point, ...]] = []
        for run in runs:
            x, y = np.concatenate([xs[run], xs[run[::-1]]]), np.concatenate([low[run], high[run[::-1]]])
            pieces.append(tuple(zip(x.tolist(), y.tolist(), strict=True)))
        return tuple(pieces)

    def _mesh(self, grids: Sequence[Array]) -> dict[str, Any]:
        return dict(zip(self.seen, np.meshgrid(*grids), strict=True))

    def _nodes(self, given: Mapping[str, float], box: Sequence[tuple[float, float]]) -> tuple[Point, ...]:
        """Where terms over all variables are evaluated while the integral is: some of MOST of them."""
        met: list[Array] = []

        def watch(function: Lam, args: list[Value]) -> None:
            where = dict(zip(function.params, args, strict=True))
            if set(self.region.variables) <= where.keys():
                values = [where[name] for name in self.seen]
                numbers = [np.asarray(value.v) for value in values if isinstance(value, Cell)]
                if len(numbers) == len(self.seen) and any(n.ndim for n in numbers):
                    met.append(np.stack([np.ravel(n) for n in np.broadcast_arrays(*numbers)], axis=1))

        whole = self._compiled(self.region.whole)
        token = WATCHING.set(watch)
        try:
            whole(*(given[name] for name in self.region.whole.params))
        finally:
            WATCHING.reset(token)
        if not met:
            return ()
        low, high = np.array(box).T
        found = np.unique(np.concatenate(met), axis=0)
        found = found[((found >= low) & (found <= high)).all(axis=1)]
        return tuple(map(tuple, found[:: max(1, -(-len(found) // NODES))].tolist()))

    # Numbers

    def _numbers(self, term: Lam, at: Mapping[str, Any]) -> Array:
        given = [at[name] for name in self.region.names]
        plain = constant(term)
        found = self._compiled(term).values(*given) if plain is None else plain
        numbers: Array = np.broadcast_to(found, np.broadcast_shapes(*map(np.shape, given)))
        return numbers

    def _number(self, term: Lam, at: Mapping[str, Any]) -> float:
        return float(self._numbers(term, at))

    def _ranges(
        self, places: dict[str, Any], sections: Mapping[str, float]
    ) -> tuple[list[tuple[float, float]], list[Section], bool]:
        """The box of what is seen, and the sections through the others; `places` is given where these stand, and the
        middles of what is seen."""
        box: list[tuple[float, float]] = []
        held: list[Section] = []
        cut = False
        for name, (from_, to) in zip(self.region.variables, self.region.bounds, strict=True):
            at = dict(places)
            if box:  # a bound that bends: all of what it reaches
                grids = [np.linspace(*reach, SIDE if name in self.seen else COARSEST) for reach in box]
                at |= dict(zip(self.seen, np.meshgrid(*grids), strict=False))
            lows, highs = self._numbers(from_, at), self._numbers(to, at)
            low, high = float(np.min(lows)), float(np.max(highs))
            cut = cut or not np.isfinite([low, high]).all()
            low, high = _drawn(low, high)
            places[name] = (low + high) / 2
            if name in self.seen:
                box.append((low, high))
            else:
                places[name] = min(max(sections.get(name, places[name]), low), high)
                held.append(Section(name, places[name], low, high))
        return box, held, cut

    def _inside(self, at: Mapping[str, Any]) -> Any:
        found: Any = True
        for name, (low, high) in zip(self.region.variables, self.region.bounds, strict=True):
            found = found & (at[name] >= self._numbers(low, at)) & (at[name] <= self._numbers(high, at))
        return found

    # What moves

    def _surface(
        self, surface: RegionSurface, level: Array, grids: Sequence[Array], places: Mapping[str, Any]
    ) -> SurfaceView:
        ends = self._roots(surface, level, grids[0], places) if len(grids) == 1 else zero_lines(level, *grids)
        if not len(ends):
            return SurfaceView(surface.equation, (), (), 0.0, self._condition(surface))
        middles = ends.mean(axis=1)
        at = {**places, **dict(zip(self.seen, middles.T, strict=True))}
        keep = self._inside(at)
        slopes = np.stack(
            [self._numbers(slope, at) for slope, _ in zip(surface.slopes, self.seen, strict=False)], axis=1
        )
        steep = np.linalg.norm(slopes, axis=1)
        rate = self._numbers(surface.rate, at)
        jump = np.zeros_like(rate) if surface.jump is None else self._numbers(surface.jump, at)
        keep &= steep > 0
        safe = np.where(steep > 0, steep, 1.0)
        weights = np.where(keep, jump * rate / safe, 0.0)
        velocities = -(rate / safe**2)[:, None] * slopes
        lengths = np.ones(len(ends)) if len(grids) == 1 else np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        chosen = np.nonzero(keep)[0]
        lines = _lines(ends[chosen])
        shares = ends[chosen] / np.array([np.ptp(grid) or 1.0 for grid in grids])
        long = float(np.sum(np.linalg.norm(shares[:, 1] - shares[:, 0], axis=1)))
        shown = chosen[spread(shares.mean(axis=1), long / ARROWS)]
        arrows = () if surface.jump is None else _arrows(middles[shown], velocities[shown], weights[shown])
        gain = float(np.sum(weights * lengths))
        return SurfaceView(surface.equation, lines, arrows, gain, self._condition(surface))

    def _condition(self, surface: RegionSurface) -> str:
        return _NAME.sub(lambda name: self._written.get(name[0], name[0]), surface.equation)

    def _roots(self, surface: RegionSurface, level: Array, xs: Array, places: Mapping[str, Any]) -> Array:
        """The points of a surface on a line: (n, 2, 1), each twice."""
        positive = level > 0
        at = np.nonzero(positive[1:] != positive[:-1])[0]
        low, high, side = xs[at], xs[at + 1], positive[at][:, None]
        each = np.arange(len(at))
        for _ in range(CLOSER if len(at) else 0):
            inner = low[:, None] + (high - low)[:, None] * np.linspace(0, 1, PARTS + 1)
            beyond = (self._numbers(surface.level, {**places, self.seen[0]: inner}) > 0) != side
            beyond[:, 0], beyond[:, -1] = False, True
            first = np.argmax(beyond, axis=1)
            low, high = inner[each, first - 1], inner[each, first]
        middle = (low + high) / 2
        return np.stack([middle, middle], axis=1)[:, :, None]

    def _bounds(self, places: Mapping[str, Any], box: Sequence[tuple[float, float]]) -> tuple[Arrow, ...]:
        """What bounds that move gain: at the ends of the range, or along the sides of the box."""
        found: list[Arrow] = []
        shares = np.linspace(0, 1, ALONG + 1)[1:-1]
        for axis, name in enumerate(self.seen):
            for end, sign in ((0, -1.0), (1, 1.0)):
                at, other = dict(places), np.zeros(1)
                if len(box) == 2 and axis == 0:
                    at[name] = self._number(self.region.bounds[0][end], at)
                    low, high = self._second(at)
                    other = low + shares * (high - low)
                elif len(box) == 2:
                    other = box[0][0] + shares * (box[0][1] - box[0][0])
                if len(box) == 2:
                    at[self.seen[1 - axis]] = other
                ends = np.broadcast_to(self._numbers(self.region.bounds[axis][end], at), other.shape)
                rate = np.broadcast_to(self._numbers(self.region.rates[axis][end], at), other.shape)
                if not rate.any() or not np.isfinite(ends).all():
                    continue
                at[name] = ends
                gain = sign * rate * np.broadcast_to(self._numbers(self.region.integrand, at), other.shape)
                points = np.stack([ends] if len(box) == 1 else [ends, other][:: 1 - 2 * axis], axis=1)
                moves = np.zeros_like(points)
                moves[:, axis] = rate
                there = np.broadcast_to(self._inside(at), other.shape)
                found += _arrows(points[there], moves[there], gain[there])
        return tuple(found)


def _lines(ends: Array) -> tuple[Line, ...]:
    return tuple((tuple(a), tuple(b)) for a, b in ends.tolist())


def _with_corners(xs: Array, low: Array, high: Array) -> tuple[Array, Array, Array]:
    """Two sides of a domain with the places between others where they meet, as far as they are straight there."""
    apart = high - low
    at = np.nonzero((apart[1:] < 0) != (apart[:-1] < 0))[0]
    share = apart[at] / (apart[at] - apart[at + 1])
    x, y = (side[at] + share * (side[at + 1] - side[at]) for side in (xs, high))
    return np.insert(xs, at + 1, x), np.insert(low, at + 1, y), np.insert(high, at + 1, y)


def _drawn(low: float, high: float) -> tuple[float, float]:
    """A range with both ends finite."""
    if not np.isfinite(low):
        low = high - 2 * REACH if np.isfinite(high) else -REACH
    return low, high if np.isfinite(high) else low + 2 * REACH


def _rows(values: Any) -> tuple[tuple[Any, ...], ...]:
    return tuple(map(tuple, np.atleast_2d(values).tolist()))


def _arrows(at: Array, velocities: Array, weights: Array) -> tuple[Arrow, ...]:
    together = zip(at.tolist(), velocities.tolist(), weights.tolist(), strict=True)
    return tuple(Arrow(tuple(a), tuple(v), w) for a, v, w in together)
