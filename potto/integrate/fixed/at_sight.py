"""An integral over a rectangle that one surface crosses, at one set of parameters, by looking at it there.

Owns `at_sight` and `worth_a_look`. How surfaces cut the variables for all parameters, and meet, takes algebra and
kernels, which pay where many pixels ask for them. One pixel needs less: enclosures say on which side the others lie,
and that the one that crosses is a graph over one variable, monotone where it leaves the rectangle; so each root is one
that Newton's steps find, and the mean value theorem says how far off. Between the roots Gauss rules integrate, with the
decay of their coefficients as truncation; what the surface sweeps as it moves is added along it (Leibniz's rule).
Slopes and rounding are those of intervals at the nodes (`rules/jets`). Whatever is not plain here is left to plans.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from contextlib import nullcontext
from typing import Any

import numpy as np
from msgspec import Struct

from potto.core.terms import Branch, Integral, Term, Tuple, children, postorder
from potto.integrate.costs import SurfaceCount
from potto.integrate.decomposition.root_isolation import flat
from potto.integrate.fixed.straight import on_sides
from potto.integrate.pieces import Evaluator, Sums
from potto.integrate.rules.gauss import EPS, gauss, truncation
from potto.integrate.rules.intervals import CLOSE_INTERVALS, Interval, marked
from potto.integrate.rules.jets import Jet, Jets, NotAnalytic
from potto.kernels.cells import Array, Cell, Value
from potto.kernels.support import ARRAYS

ORDER = 11
MANY_PARTS = 30  # of surfaces: what follows from those of fewer is found out in about as long as a look takes
STEPS, CLOSE = 12, 1e-8  # of Newton's, at the most; a part of the range, whose square is below all rounding
# How much what is integrated may change over the rectangle, as a part of its size, and how many times as steep as
# where it is the least steep the surface may be: what is more concentrated than that is for panels that are refined.
CALM, STEADY = 4.0, 4.0
APART = 1e-6  # of a range: places that are closer are for those who tell what meets there

_INTERVALS, _FLOATS = Jets(CLOSE_INTERVALS), Jets(ARRAYS)
Env = dict[str, Jet[Interval]]


class _Rectangle(Struct, frozen=True):
    """outer, inner: the variables; the surface is a graph over the outer one. ends: their bounds. blur: how far off
    these may be, as parts of the ranges. fixed, moving: the parameters, without and with their k tangents, below which
    there is a row for `inner`. faces: what is integrated where the surface is below 0, and above. steep: the least
    slopes of the surface along both; 0 where it may turn."""

    outer: str
    inner: str
    ends: dict[str, tuple[float, float]]
    blur: float
    fixed: Env
    moving: Env
    k: int
    surface: Term
    faces: tuple[tuple[Term, ...], tuple[Term, ...]]
    steep: dict[str, float]

    def length(self, name: str) -> float:
        return self.ends[name][1] - self.ends[name][0]


def worth_a_look(body: Term) -> bool:
    """Whether surfaces have so many parts that what follows from them for all parameters takes longer to find."""
    return len(postorder(*_surfaces(body))) > MANY_PARTS


def at_sight(term: Integral, body: Term, machine: Evaluator, env: dict[str, Value]) -> Sums | None:
    """The integral, its calls carried out in `body`; None where it takes more than a look, or is not accurate."""
    if len(term.variables) != 2 or any(term.hints):
        return None
    with np.errstate(all="ignore"):
        try:
            found = _summed(_rectangle(term, body, machine, env), machine)
        except NotAnalytic:
            return None
    return found


# What is there


def _rectangle(term: Integral, body: Term, machine: Evaluator, env: dict[str, Value]) -> _Rectangle:
    """What there is to see. Raises NotAnalytic where it is not plain."""
    (body, *bounds), env = flat((body, *itertools.chain(*term.bounds)), env)
    names, k = term.variables, machine.directions
    fixed, moving = _parameters(frozenset().union(body.free, *(b.free for b in bounds)).difference(names), env, k)
    found = _INTERVALS.of(bounds, moving)
    if any(slope is not None for _, slope in found) or not all(_finite(v) for v, _ in found):
        raise NotAnalytic  # bounds that move
    ends, blur = {}, 0.0
    for name, (low, _), (high, _) in zip(names, found[::2], found[1::2], strict=True):
        ends[name] = float(0.5 * (low[0] + low[1])), float(0.5 * (high[0] + high[1]))
        length = ends[name][1] - ends[name][0]
        if not length > 0:
            raise NotAnalytic
        blur += float(low[1] - low[0] + high[1] - high[0]) / length
    box: Env = {**fixed}
    for i, name in enumerate(names):
        column = np.arange(2.0)[:, None] == i
        box[name] = marked(*ends[name]), marked(*(column.astype(float),) * 2)
    surface, sides, slope = _crossing(body, box, machine)
    faces = [on_sides(body, {**sides, surface: above}) for above in (False, True)]
    parts = [tuple(children(face)) if isinstance(face, Tuple) else (face,) for face in faces]
    _check_calm(parts, box, np.array([ends[name][1] - ends[name][0] for name in names]))
    least, most = (np.reshape(end, 2) for end in slope)
    steep = np.where(least > 0, least, np.where(most < 0, -most, 0.0))
    most = np.maximum(np.abs(least), np.abs(most))
    inner = int(np.argmax(steep * [ends[name][1] - ends[name][0] for name in names]))
    if not 0 < most[inner] <= STEADY * steep[inner]:
        raise NotAnalytic
    return _Rectangle(
        names[1 - inner], names[inner], ends, blur, fixed, moving, k, surface, (parts[0], parts[1]),
        dict(zip(names, steep.tolist(), strict=True)),
    )  # fmt: skip


def _parameters(names: Iterable[str], env: dict[str, Value], k: int) -> tuple[Env, Env]:
    """Parameters as intervals, and the same with columns of tangents below a row of zeros."""
    fixed: Env = {}
    moving: Env = {}
    for name in names:
        cell = env.get(name)
        if not isinstance(cell, Cell) or cell.arrays() or not math.isfinite(cell.v):
            raise NotAnalytic
        e = 0.0 if cell.e is None else float(cell.e)
        value = marked(float(cell.v) - e, float(cell.v) + e)
        rows = [0.0, *(0.0 if t is None else float(t) for t in cell.t[:k])]
        off = [0.0, *(0.0 if t is None else float(t) for t in cell.et[:k])]
        t, et = (np.array(x + [0.0] * (1 + k - len(x)))[:, None] for x in (rows, off))
        fixed[name] = value, None
        moving[name] = value, marked(t - et, t + et) if t.any() or et.any() else None
    return fixed, moving


def _crossing(body: Term, box: Env, machine: Evaluator) -> tuple[Term, dict[Term, bool], Interval]:
    """The one surface that may cross a box, the sides on which others lie all over, and its slopes."""
    surfaces = _surfaces(body)
    sides: dict[Term, bool] = {}
    open_: list[tuple[Term, Interval]] = []
    for surface, ((low, high), slope) in zip(surfaces, _INTERVALS.of(surfaces, box), strict=True):
        if slope is None or not _finite((low, high)) or not _finite(slope):
            raise NotAnalytic
        if low > 0 or high < 0:
            sides[surface] = bool(low > 0)
        else:
            open_.append((surface, slope))
    if len(open_) != 1:
        raise NotAnalytic
    for surface in surfaces if machine.costs is not None else ():
        seen = machine.costs.surfaces.setdefault(surface, SurfaceCount())  # type: ignore[union-attr]
        seen.met = seen.met or surface is open_[0][0]
        seen.asked = seen.moves = machine.directions > 0
    return open_[0][0], sides, open_[0][1]


def _surfaces(body: Term) -> tuple[Term, ...]:
    return tuple(dict.fromkeys(node.surface for node in postorder(body) if isinstance(node, Branch)))


def _check_calm(parts: Sequence[Sequence[Term]], box: Env, lengths: Array) -> None:
    """Whether what is integrated is known to be smooth, and to change little: no node misses anything."""
    terms = tuple(itertools.chain(*parts))
    for value, slope in _INTERVALS.of(terms, box):
        size = np.maximum(np.abs(value[0]), np.abs(value[1]))
        change = 0.0 if slope is None else lengths @ np.maximum(np.abs(slope[0]), np.abs(slope[1])).reshape(2)
        if not change <= CALM * size or not np.isfinite(size):
            raise NotAnalytic


def _finite(value: Interval) -> bool:
    return bool(np.isfinite(value[0]).all() and np.isfinite(value[1]).all())


# Where the surface is


def _values(it: _Rectangle, places: dict[str, Interval]) -> Interval:
    """The values of the surface."""
    env = it.fixed | {name: (marked(*ends), None) for name, ends in places.items()}
    return _INTERVALS.of((it.surface,), env)[0][0]


def _signs(values: Interval) -> Array:
    """Their signs. Raises NotAnalytic where one is not certain."""
    signs = np.where(values[0] > 0, 1, np.where(values[1] < 0, -1, 0))
    if not signs.all():
        raise NotAnalytic
    return signs


def _roots(it: _Rectangle, along: str, other: str, at: Array) -> tuple[Array, Array]:
    """The one root along a variable at each place of the other, and how far off it may be."""
    env: dict[str, Jet[Any]] = {name: (0.5 * (v[0] + v[1]), None) for name, (v, _) in it.fixed.items()}
    env[other] = at, None
    low, high = it.ends[along]
    x = np.full(at.shape, 0.5 * (low + high))
    for _ in range(STEPS):
        env[along] = x, np.ones((1, 1))
        value, slope = _FLOATS.of((it.surface,), env)[0]
        assert slope is not None
        before, x = x, np.clip(x - value / slope[0], low, high)
        if (np.abs(x - before) <= CLOSE * (high - low)).all():
            break  # this step has left a rounding
    found = _values(it, {along: (x, x), other: (at, at)})
    off = np.maximum(np.abs(found[0]), np.abs(found[1])) / it.steep[along] + EPS * np.abs(x)
    return x, off


class _Stretch(Struct, frozen=True):
    """Of the outer variable, from where to where, and the signs of the surface at both ends of the inner one."""

    low: float
    high: float
    below: int
    above: int


def _stretches(it: _Rectangle) -> tuple[list[_Stretch], float]:
    """Between the places at which the surface leaves the rectangle; and how far off these may be together."""
    (a, b), (c, d) = it.ends[it.outer], it.ends[it.inner]
    x, y = np.array([a, a, b, b]), np.array([c, d, c, d])
    first, last = _signs(_values(it, {it.outer: (x, x), it.inner: (y, y)})).reshape(2, 2)
    turns, off = first != last, 0.0
    places = np.full(2, np.nan)  # of the lower side of the rectangle, and the upper one
    if it.steep[it.outer] == 0:
        _signs(_values(it, {it.outer: (np.full(2, a), np.full(2, b)), it.inner: (y[:2], y[:2])}))
        if turns.any():
            raise NotAnalytic
    elif turns.any():
        found, error = _roots(it, it.outer, it.inner, y[:2][turns])
        places[turns], off = found, float(error.sum())
    cuts = [a, *sorted(places[turns].tolist()), b]
    if any(high - low <= APART * (b - a) for low, high in itertools.pairwise(cuts)):
        raise NotAnalytic
    stretches = []
    for low, high in itertools.pairwise(cuts):
        below, above = (int(last[i] if turns[i] and low >= places[i] else first[i]) for i in (0, 1))
        stretches.append(_Stretch(low, high, below, above))
    return stretches, off


# Sums


class _Totals(Struct):
    """Per component the value and its tangents, (m, 1 + k), how far they are off, and their sums without signs. nodes,
    crossing: how many there were between surfaces, and on them."""

    number: Array
    error: Array
    gross: Array
    nodes: int = 0
    crossing: int = 0

    def add(self, values: Array, errors: Array, weights: Array, smooth: bool = True) -> None:
        """Values (m, 1 + k, n) at the nodes of a stretch, by its weights."""
        length, rule = weights.sum(), gauss(ORDER)
        sizes = np.abs(values)
        self.number += values @ weights
        self.error += errors @ weights + 4 * EPS * (sizes @ weights)
        if smooth:
            self.error += truncation(np.abs(values @ rule.transform)) * length
        self.gross += sizes @ weights


def _summed(it: _Rectangle, machine: Evaluator) -> Sums | None:
    """The sums. Raises NotAnalytic."""
    stretches, off = _stretches(it)
    shape = len(it.faces[0]), 1 + it.k
    totals = _Totals(np.zeros(shape), np.zeros(shape), np.zeros(shape))
    low, high = it.ends[it.inner]
    rule = gauss(ORDER)
    for s in stretches:
        x, weights = s.low + (s.high - s.low) * rule.nodes, (s.high - s.low) * rule.weights
        if s.below == s.above:
            _add_between(it, totals, x, weights, np.full(ORDER, low), np.full(ORDER, high), s.below > 0)
            continue
        root, error = _roots(it, it.inner, it.outer, x)
        jump = _add_crossing(it, totals, x, weights, root, error, s.below > 0)
        totals.error[:, 1:] += off * jump
        _add_between(it, totals, x, weights, np.full(ORDER, low), root, s.below > 0)
        _add_between(it, totals, x, weights, root, np.full(ORDER, high), s.above > 0)
    totals.error += it.blur * totals.gross
    if not _accurate(totals, machine):
        return None
    machine.count(totals.nodes)
    with nullcontext() if machine.costs is None else machine.costs.apart(1.0):
        machine.count(totals.crossing)
    if machine.costs is not None:
        cells = sum(1 + (s.below != s.above) for s in stretches)
        machine.costs.stretches(cells, cells)
    v, e = totals.number[..., None], totals.error[..., None]
    gross = np.array([[totals.gross[:, 0].max()], [totals.gross[:, 1:].max(initial=0.0)]])
    return Sums(v[:, 0], e[:, 0], v[:, 1:], e[:, 1:], gross=gross)


def _add_between(
    it: _Rectangle, totals: _Totals, x: Array, weights: Array, low: Array, high: Array, above: bool
) -> None:
    """What is integrated along the inner variable, at each node of the outer one."""
    rule, length = gauss(ORDER), high - low
    y = low[:, None] + length[:, None] * rule.nodes
    wide = np.broadcast_to(x[:, None], y.shape).ravel()
    values, errors = _channels(it, above, (wide, wide), (y.ravel(), y.ravel()), y.shape)
    totals.nodes += y.size
    coefficients = np.abs(values @ rule.transform)
    beyond = errors @ rule.weights + truncation(coefficients) + 4 * EPS * (np.abs(values) @ rule.weights)
    totals.add(values @ rule.weights * length, beyond * length, weights)


def _add_crossing(
    it: _Rectangle, totals: _Totals, x: Array, weights: Array, root: Array, off: Array, below: bool
) -> Array:
    """What crosses the surface as it moves, and what comes of not knowing where it is. What crosses it at the most."""
    place = root - off, root + off
    (a, ea), (b, eb) = (_channels(it, side, (x, x), place, root.shape) for side in (below, not below))
    totals.crossing += 2 * x.size
    jump, error = a - b, ea + eb
    totals.error += ((np.abs(jump) + error) * off) @ weights
    if not it.k:
        return np.zeros((jump.shape[0], 0))
    one = np.zeros((1 + it.k, 1))
    one[0] = 1.0
    env = it.moving | {it.outer: (marked(x, x), None), it.inner: (marked(*place), marked(one, one))}
    slopes = _INTERVALS.of((it.surface,), env)[0][1]
    assert slopes is not None
    mid, radius = (np.broadcast_to(part, (1 + it.k, x.size)) for part in _middle(slopes))
    least = np.abs(mid[0]) - radius[0]
    speed = -mid[1:] / mid[0]
    doubt = (radius[1:] + np.abs(speed) * radius[0]) / least
    crossing = jump[:, :1] * speed
    errors = (np.abs(jump[:, :1]) + error[:, :1]) * doubt + error[:, :1] * np.abs(speed)
    whole = np.zeros((jump.shape[0], 1, x.size))
    totals.add(np.concatenate((whole, crossing), 1), np.concatenate((whole, errors), 1), weights)
    most: Array = np.abs(crossing).max(axis=-1)
    return most


def _channels(it: _Rectangle, above: bool, x: Interval, y: Interval, shape: tuple[int, ...]) -> tuple[Array, Array]:
    """What is integrated on one side, with its tangents: (m, 1 + k, *shape), and how far that may be off."""
    env = it.moving | {it.outer: (marked(*x), None), it.inner: (marked(*y), None)}
    size = math.prod(shape)
    found = np.zeros((2, len(it.faces[above]), 1 + it.k, size))
    for i, (value, slope) in enumerate(_INTERVALS.of(it.faces[above], env)):
        found[:, i, 0] = [np.broadcast_to(part, size) for part in _middle(value)]
        if slope is not None:
            found[:, i, 1:] = [np.broadcast_to(part, (1 + it.k, size))[1:] for part in _middle(slope)]
    found = found.reshape(*found.shape[:-1], *shape)
    return found[0], found[1]


def _middle(value: Interval) -> tuple[Array, Array]:
    """The middle of an interval, and how far off it may be."""
    return 0.5 * (value[0] + value[1]), 0.5 * (value[1] - value[0])


def _accurate(totals: _Totals, machine: Evaluator) -> bool:
    """Whether the errors are what was asked for, of a value and each of its tangents."""
    asked = np.maximum(machine.atol, machine.rtol * np.abs(totals.number))
    return bool((totals.error <= asked).all())
