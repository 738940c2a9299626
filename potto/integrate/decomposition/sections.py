"""Sections of surfaces that have no closed form: periodic families, and roots found by numbers.

Owns `searched_rows`. A family is a root for each integer in a range that the bounds give. Where nothing is known but
the surface itself, cells with one root each are told apart by enclosures (`brackets`); where these are not to be had (a
call, a conditional) sign changes are looked for on a grid that is refined where the surface comes close to zero without
crossing it. Each is polished; how a root moves follows from the surface's own derivatives.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from potto.calculus.solving.enclosable import slope_of
from potto.core.terms import Lam, Term, function_of
from potto.integrate.decomposition.meetings import SEARCHED, Row, as_array
from potto.integrate.decomposition.root_isolation import between, isolated
from potto.integrate.events import ROOTS_NOT_SEPARATED, TOO_MANY_ROOTS, Unsearched
from potto.integrate.levels import LevelPlan
from potto.integrate.pieces import still
from potto.integrate.rules.gauss import EPS
from potto.kernels.cells import Array, Cell, Ints, Value, map_arrays, pad

GRID = 64
MOST_IN_FAMILY = 100_000
BISECTIONS = 64
# Kinks that are cut at, for each member: next to x = 0 those of sin(1/x) < y beside y < x are without number, and what
# lies there is refined like all else that is not smooth. 256 of them take as long as 0.3 s.
MOST_KINKS = 256
JUMP = 8.0  # a surface that is so many times its rounding, and that of the place, where its sign changes jumps there
BESIDE = 2.0**-27  # how far from a pole, as a part of where it is, it is asked how it moves


def searched_rows(level: LevelPlan, env: dict[str, Value], lo: Cell, hi: Cell, batch: int, machine: Any) -> list[Row]:
    """The candidate cuts of one variable beyond the closed-form ones."""
    rows: list[Row] = []
    for number, family in level.families:
        rows += _family(level, number, family, env, lo, hi, batch, machine)
    for cut in level.searched:
        number = level.level.cuts.index(cut)
        rows += _search(level, number, cut.surface, env, lo, hi, batch, machine)
    return rows


def _call(function: Lam, env: dict[str, Value], machine: Any) -> Cell:
    value = machine.evaluate(function, {n: env[n] for n in function.params}, None)
    assert isinstance(value, Cell)
    return value


def _at(term: Term, variable: str, x: Any, env: dict[str, Value], machine: Any) -> Any:
    """A term's value with the variable at x, by a machine without directions."""
    function = function_of(term)
    here = {n: still(v) for n, v in env.items() if n in function.params}
    here[variable] = Cell(x)
    return _call(function, here, machine.with_directions(0)).v


def _family(
    level: LevelPlan, cut: int, family: Any, env: dict[str, Value], lo: Cell, hi: Cell, batch: int, machine: Any
) -> list[Row]:
    ends = [as_array(_at(family.inner, level.variable, x.v, env, machine), batch) for x in (lo, hi)]
    low, high = as_array(np.minimum(lo.v, hi.v), batch), as_array(np.maximum(lo.v, hi.v), batch)
    for stop in family.stops:
        at = as_array(_at(stop, level.variable, lo.v, env, machine), batch)
        inside = (at > low) & (at < high)
        ends.append(np.where(inside, as_array(_at(family.inner, level.variable, at, env, machine), batch), np.nan))
    stack = np.stack(ends)  # nan where an end or a stop does not count
    known = ~np.isnan(stack)
    first = np.ceil(np.where(known, stack, np.inf).min(axis=0) - 1e-6)
    last = np.floor(np.where(known, stack, -np.inf).max(axis=0) + 1e-6)
    spans = np.where(np.isfinite(first) & np.isfinite(last), last - first + 1, 0.0)
    count = float(spans.max(initial=0.0))
    # At a node at infinity of a variable further out nothing counts.
    outer = [env[name] for name in family.inner.free - {level.variable}]
    far = np.any([np.isinf(as_array(cell.v, batch)) for cell in outer if isinstance(cell, Cell)], axis=0)
    if (np.isinf(stack).any(axis=0) & ~far).any() or count > MOST_IN_FAMILY:
        machine.note(TOO_MANY_ROOTS)
        count = 0.0  # whatever was cut at some of them would be no better known
    function = function_of(family.root)
    turning = level.level.cuts[cut].turning
    rows = []
    for j in range(int(count)):
        here = dict(env)
        here[family.index] = pad(Cell(first + j), machine.directions)
        root = _call(function, here, machine.tracking())
        rows.append(Row(np.where(first + j <= last, root.v, np.nan), root.t, cut, turning, root.e, root.et))
    return rows


def _search(
    level: LevelPlan, cut: int, surface: Term, env: dict[str, Value], lo: Cell, hi: Cell, batch: int, machine: Any
) -> list[Row]:
    variable = level.variable
    low, high = as_array(np.minimum(lo.v, hi.v), batch), as_array(np.maximum(lo.v, hi.v), batch)
    function = function_of(surface)
    slope = slope_of(surface, variable)
    hidden: list[Row] = []
    if slope is None:
        a, b = _on_a_grid(function, variable, env, low, high, machine)
    else:
        brackets = isolated(surface, slope, variable, env, low, high, level.level.cuts[cut].decides)
        most = brackets.owner.size if level.level.cuts[cut].decides else MOST_KINKS * batch
        if level.level.cuts[cut].decides and not brackets.complete:
            machine.note(ROOTS_NOT_SEPARATED)
        elif not brackets.complete or brackets.owner.size > most:
            machine.note(Unsearched(variable))
        few = slice(most)  # those that are farthest apart are found first
        a, b = _padded(brackets.owner[few], brackets.a[few], brackets.b[few], batch)
        for start, end in zip(*(x.T for x in _padded(*brackets.hidden, batch)), strict=True):
            row = _moving(cut, function, variable, env, 0.5 * (start + end), end - start, machine)
            hidden.append(replace(row, e=row.e + (end - start), hides=end - start))
    roots, within = _polished(function, variable, env, a, b, machine)
    columns = zip(roots.T, within.T, strict=True)
    rows = [*(_moving(cut, function, variable, env, root, wide, machine) for root, wide in columns), *hidden]
    return rows + _at_places(cut, function, variable, env, low, low == high, machine)


def _at_places(
    cut: int, function: Lam, variable: str, env: dict[str, Value], x: Array, empty: Array, machine: Any
) -> list[Row]:
    """The places that empty ranges are, where the surface is 0 there: nothing else can be searched for in them."""
    if not empty.any():
        return []
    here = {**{n: still(v) for n, v in env.items()}, variable: Cell(x)}
    at = _call(function, here, machine.tracking().with_directions(0))
    zero: Any = np.abs(at.v) <= (0.0 if at.e is None else at.e)
    on = empty & zero
    there = np.where(on, x, np.nan)
    return [_moving(cut, function, variable, env, there, np.zeros(x.size), machine)] if on.any() else []


def _padded(owner: Ints, a: Array, b: Array, batch: int) -> tuple[Array, Array]:
    """Stretches as rows, one for each member, in order and padded with nan."""
    order = np.lexsort((a, owner))
    owner = owner[order]
    count = np.bincount(owner, minlength=batch)
    slot = np.arange(owner.size) - (np.cumsum(count) - count)[owner]
    first, last = np.full((2, batch, int(count.max(initial=0))), np.nan)
    first[owner, slot], last[owner, slot] = a[order], b[order]
    return first, last


def _on_a_grid(
    function: Lam, variable: str, env: dict[str, Value], low: Array, high: Array, machine: Any
) -> tuple[Array, Array]:
    """Brackets where nothing but values is known of the surface."""
    columns = _columns(function, env)
    still = machine.with_directions(0)

    def psi(x: Array) -> Array:
        value = _call(function, {**columns, variable: Cell(x)}, still).v
        return np.broadcast_to(value, x.shape)

    x = _grid(low[:, None], high[:, None], np.linspace(0.0, 1.0, GRID + 1)[None, :])
    return _brackets(psi, x)


def _columns(function: Lam, env: dict[str, Value]) -> dict[str, Value]:
    """The values that a function takes, as columns, and without tangents: duals in tuples, too."""
    return {n: map_arrays(still(v), lambda a: a[:, None]) for n, v in env.items() if n in function.params}


def _grid(low: Array, high: Array, s: Array) -> Array:
    """Points that run through [low, high], also where an end is infinite."""
    finite = low + (high - low) * s
    up = low + s / (1 - s)
    down = high - (1 - s) / s
    whole = (2 * s - 1) / (4 * s * (1 - s))
    x = np.where(np.isinf(high), np.where(np.isinf(low), whole, up), np.where(np.isinf(low), down, finite))
    return np.where(np.isfinite(x), x, np.nan)


def _brackets(psi: Any, x: Array) -> tuple[Array, Array]:
    """Intervals with a sign change, per batch member and padded with nan; dips towards zero are looked at closer."""
    y = psi(x)
    for _ in range(3):
        inner = np.abs(y[:, 1:-1])
        dip = (inner < np.abs(y[:, :-2])) & (inner <= np.abs(y[:, 2:])) & (np.sign(y[:, :-2]) == np.sign(y[:, 2:]))
        dip &= np.sign(y[:, 1:-1]) == np.sign(y[:, 2:])
        columns = np.nonzero(dip.any(axis=0))[0] + 1
        if not columns.size:
            break
        extra = [x]
        for s in (0.25, 0.5, 0.75):
            extra.append(x[:, columns - 1] + s * (x[:, columns] - x[:, columns - 1]))
            extra.append(x[:, columns] + s * (x[:, columns + 1] - x[:, columns]))
        x = np.sort(np.concatenate(extra, axis=1), axis=1)
        y = psi(x)
    x, y = _to_the_edges(psi, x, y)
    change = (y[:, :-1] * np.sign(y[:, 1:]) < 0) | ((y[:, :-1] == 0) & (y[:, 1:] != 0))
    most = int(change.sum(axis=1).max()) if change.size else 0
    a = np.full((x.shape[0], most), np.nan)
    b = np.full((x.shape[0], most), np.nan)
    row, column = np.nonzero(change)
    slot = (np.cumsum(change, axis=1) - 1)[row, column]
    a[row, slot], b[row, slot] = x[row, column], x[row, column + 1]
    return a, b


def _to_the_edges(psi: Any, x: Array, y: Array) -> tuple[Array, Array]:
    """With the last places before those where psi has no value: between these and the grid a sign may change."""
    defined = ~np.isnan(y)
    columns = np.nonzero((defined[:, 1:] != defined[:, :-1]).any(axis=0))[0]
    if not columns.size:
        return x, y
    there = np.where(defined[:, columns], x[:, columns], x[:, columns + 1])
    beyond = np.where(defined[:, columns], x[:, columns + 1], x[:, columns])
    for _ in range(BISECTIONS):
        middle = between(there, beyond)
        inside = ~np.isnan(psi(middle))
        there, beyond = np.where(inside, middle, there), np.where(inside, beyond, middle)
    x = np.sort(np.concatenate((x, there), axis=1), axis=1)
    return x, psi(x)


def _polished(
    function: Lam, variable: str, env: dict[str, Value], a: Array, b: Array, machine: Any
) -> tuple[Array, Array]:
    """The roots in brackets (B, r): Newton's steps where they stay inside and shrink, halves elsewhere. And how wide
    the brackets are in the end, which is all that is known where the sign changes by a jump."""
    if a.shape[1] == 0:
        return a, a
    columns = {n: pad(v, 1) for n, v in _columns(function, env).items()}
    one = machine.with_directions(1)

    def psi(x: Array) -> tuple[Array, Array]:
        value = _call(function, {**columns, variable: Cell(x, None, (1.0,))}, one)
        slope = 0.0 if value.t[0] is None else value.t[0]
        return np.broadcast_to(value.v, x.shape), np.broadcast_to(slope, x.shape)

    with np.errstate(all="ignore"):
        left = np.sign(psi(a)[0])
        right = np.sign(psi(b)[0])
        left = np.where((left == 0) | np.isnan(left), -right, left)
        x = between(a, b)
        for turn in range(BISECTIONS):
            f, slope = psi(x)
            below = left * f > 0
            a, b = np.where(below, x, a), np.where(below, b, x)
            step = x - f / slope
            good = (step > a) & (step < b) & (turn % 3 < 2)
            new = np.where(f == 0, x, np.where(good, step, between(a, b)))
            still = (np.abs(new - x) <= EPS * np.abs(x)) | np.isnan(x) | (np.abs(b - a) <= EPS * np.abs(x))
            x = new
            if still.all():
                break
    return x, b - a


def _moving(
    cut: int, function: Lam, variable: str, env: dict[str, Value], root: Array, within: Array, machine: Any
) -> Row:
    """The root as a candidate cut: dx = -psi_theta / psi_x; how far it is off is psi's own rounding over psi_x.

    Where psi changes its sign by a jump, or a pole, it is off by no more than the bracket is wide.
    """
    k = machine.directions
    here = {n: pad(v, k + 1) for n, v in env.items()}
    here[variable] = Cell(root, None, (None,) * k + (1.0,))
    value = _call(function, here, machine.tracking().with_directions(k + 1))
    slope = 0.0 if value.t[k] is None else value.t[k]
    with np.errstate(all="ignore"):
        rounding, step = 0.0 if value.e is None else value.e, SEARCHED * EPS * np.abs(root)
        off = (np.abs(value.v) + rounding) / np.abs(slope)
        jumps = np.abs(value.v) > JUMP * (rounding + step * np.abs(slope))
        off = np.where(jumps, np.minimum(off, within), off)
        off = np.where(np.isfinite(off), off, 0.0) + step
        # What stands still does so also where the surface is flat, and 0/0 would say nothing.
        t = tuple(None if x is None else np.where(np.asarray(x) == 0, 0.0, -np.asarray(x) / slope) for x in value.t[:k])
    et = _doubt(function, variable, here, root + off, t, value, machine.with_directions(k + 1)) if k else ()
    poles = np.isfinite(root) & ~np.isfinite(np.broadcast_to(value.v, root.shape))
    if k and poles.any():
        near = _beside_poles(function, variable, here, root, machine.with_directions(k + 1))
        t = tuple(np.where(poles, x, 0.0 if y is None else y) for x, y in zip(near, t, strict=True))
    return Row(root, t, cut, False, off, et)


def _doubt(
    function: Lam, variable: str, env: dict[str, Value], beside: Array, t: tuple[Any, ...], value: Cell, machine: Any
) -> tuple[Any, ...]:
    """How far off speeds may be, by the rounding of the derivatives that they are made of (`value`), and as the root is
    not where it should be, but anywhere as far away as `beside`."""
    k = len(t)
    off = _call(function, {**env, variable: Cell(beside, None, (None,) * k + (1.0,))}, machine)
    slope, steep = (0.0 if cell.t[k] is None else np.asarray(cell.t[k]) for cell in (value, off))
    found: list[Any] = []
    with np.errstate(all="ignore"):
        for speed, x, rounded in zip(t, off.t, value.et, strict=False):
            there = 0.0 if x is None else -np.asarray(x) / steep
            if speed is None:
                found.append(None)
                continue
            part = sum(0.0 if r is None else r * w for r, w in ((rounded, 1.0), (value.et[k], np.abs(speed))))
            doubt = np.abs(there - speed) + part / np.abs(slope)
            found.append(np.where(np.isfinite(doubt), doubt, 0.0))
    return tuple(found)


def _beside_poles(function: Lam, variable: str, env: dict[str, Value], root: Array, machine: Any) -> list[Array]:
    """How poles move: like the lines along which psi is constant beside them, in the mean of their two sides."""
    k = machine.directions - 1
    found = np.zeros((k, *root.shape))
    for side in (-BESIDE, BESIDE):
        at = {**env, variable: Cell(root + side * np.maximum(np.abs(root), BESIDE), None, (None,) * k + (1.0,))}
        value = _call(function, at, machine)
        slope = 0.0 if value.t[k] is None else value.t[k]
        for d, x in enumerate(value.t[:k]):
            with np.errstate(all="ignore"):
                speed = 0.0 if x is None else -np.asarray(x) / slope
            found[d] += np.where(np.isfinite(speed), speed, 0.0) / 2
    return list(found)
