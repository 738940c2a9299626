"""The corners of regions of half planes and conics, and the edges of a range that is an intersection of such.

Owns `corner_rows` and `within_walls`. What is integrated is 0 outside of an intersection, so that lines and conics
that cross there leave nothing: of n^2/2 crossings the corners count alone. Each line is clipped by all others (Cyrus
and Beck 1978), which takes n^2 sums and products, and no formula; where a conic takes part, or a union, crossings are
held against all the others (`conic_corners`). Whatever rounding does not settle counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from potto.calculus.decomposition.critical import Critical, Within
from potto.core.terms import Term, children, var
from potto.integrate.columns import distinct, side_by_side
from potto.integrate.decomposition.conic_corners import BESIDE, CLEAR, Places, conic_corners, mixed_corners, moving
from potto.integrate.decomposition.critical_places import common_places
from potto.integrate.decomposition.meetings import Row, as_array, tangents
from potto.integrate.degenerate.undefined import LOOKED_AT
from potto.integrate.events import Unsearched
from potto.integrate.levels import Corners, LevelPlan
from potto.integrate.pieces import Evaluator, gather, numbers_at
from potto.integrate.rules.gauss import EPS
from potto.kernels.cells import Array, Bools, Cell, Ints, Number, Value

ROUNDED = 2 * EPS  # of the sizes of its summands: how far off a sum of products is
FINEST = 4 * EPS**2  # the same with what rounding took from each product
SPLITS = 2.0**27 + 1
MOST_COMMON = 4  # places that two conics have in common
AROUND = "corner low", "corner high"  # names of the bounds of a search for places beside one
NEAR = 0.25  # of the size of its place: what is not known to that of a corner is not known at all
MOST_NUMBERS = 1 << 18  # that are clipped at once


class _Lines(Struct, frozen=True):
    """Half planes a*x + b*y + c >= 0 of a batch, (3, n, B): numbers, how far off they are, and tangents (k, 3, n, B)
    with errors. A line that is none for a member has nan for it all."""

    v: Array
    e: Array
    t: Array
    et: Array

    def in_order(self) -> _Lines:
        """The same with bounds that are reversed turned round."""
        turned = np.ones((self.v.shape[1], self.v.shape[2]))
        turned[-2:] = np.where(self.v[2, -2] + self.v[2, -1] < 0, -1.0, 1.0)
        return _Lines(self.v * turned, self.e, self.t * turned, self.et)

    def crossings(self, p: Ints, q: Ints, member: Ints) -> tuple[Array, Array, Array, Array]:
        """Where lines p and q of members meet along x: places (P,), how far off, speeds (k, P), how far off these."""
        below, off, speed, far = self.determinant(0, 1, p, q, member)
        above, up, rise, wide = self.determinant(1, 2, p, q, member)
        with np.errstate(all="ignore"):
            x, size = above / below, np.abs(below)
            e = (up + np.abs(x) * off) / size + EPS * np.abs(x)
            t = (rise - x * speed) / below
            et = (wide + np.abs(x) * far + e * np.abs(speed) + np.abs(t) * off) / size + EPS * np.abs(t)
        return x, e, t, et

    def determinant(self, i: int, j: int, p: Ints, q: Ints, member: Ints) -> tuple[Array, Array, Array, Array]:
        """v[i, p]*v[j, q] - v[j, p]*v[i, q], how far off it is, its tangents, and how far off these are."""
        (a, d), (c, b) = ([self.at(row, line, member) for line in (p, q)] for row in (i, j))
        (one, rest), (other, more) = _product(a[0], b[0]), _product(c[0], d[0])
        value = (one - other) + (rest - more)
        off = EPS * np.abs(value) + FINEST * (np.abs(one) + np.abs(other)) + _doubt(a, b) + _doubt(c, d)
        t = a[2] * b[0] + a[0] * b[2] - c[2] * d[0] - c[0] * d[2]
        pairs = ((a, b), (b, a), (c, d), (d, c))
        spread = sum((np.abs(x[2] * y[0]) for x, y in pairs), np.zeros_like(t))
        far = sum((np.abs(x[2]) * y[1] + x[3] * np.abs(y[0]) for x, y in pairs), ROUNDED * spread)
        return value, off, t, far

    def at(self, row: int, line: Ints, member: Ints) -> tuple[Array, Array, Array, Array]:
        """One number of some lines, how far off it is, its tangents, and how far off these are."""
        return (self.v[row, line, member], self.e[row, line, member],
                self.t[:, row, line, member], self.et[:, row, line, member])  # fmt: skip


def _product(a: Array, b: Array) -> tuple[Array, Array]:
    """A product, and what rounding has taken from it (Dekker 1971)."""
    product = a * b
    (high, low), (above, below) = _halves(a), _halves(b)
    return product, low * below - (((product - high * above) - low * above) - high * below)


def _halves(a: Array) -> tuple[Array, Array]:
    """A number as the sum of two with half of its digits each (Veltkamp)."""
    wide = SPLITS * a
    high = wide - (wide - a)
    return high, a - high


def _doubt(a: Sequence[Array], b: Sequence[Array]) -> Array:
    """How far off a product is by what its factors are."""
    return a[1] * np.abs(b[0]) + b[1] * np.abs(a[0])


def corner_rows(
    level: LevelPlan, env: dict[str, Value], lo: Cell, hi: Cell, batch: int, machine: Evaluator
) -> list[Row]:
    """The cuts of one variable at the corners of regions."""
    rows: list[Row] = []
    span = as_array(np.minimum(lo.v, hi.v), batch), as_array(np.maximum(lo.v, hi.v), batch)
    for region in level.corners:
        numbers = _numbers(numbers_at(region.numbers, machine.tracking(), env), batch, machine.directions)
        unknown = _unknown(region, numbers[0], level.variable, span, env, machine)
        if unknown.any():
            machine.note(Unsearched(level.variable), np.nonzero(unknown)[0])
        lines = _Lines(*(_apart(of[..., : 3 * region.lines, :], 3) for of in numbers)).in_order()
        conics = tuple(_apart(of[..., 3 * region.lines :, :], 6) for of in numbers[:2])
        straight, places = _crossing(lines, conics, span, region, machine)
        found = [(straight[2], *lines.crossings(*straight))]
        if conics[0].size:
            lost = ~(places.off <= NEAR * (1 + np.abs(places.place[0])))
            if lost.any():
                machine.note(Unsearched(level.variable), distinct(places.owner[lost]))
            told = places.sure | lost
            found.append(moving(region, level.variable, env, places.pick(told), machine))
            rows += _touching(region, places.pick(~told), level.variable, env, batch, machine)
        owner, x, e, t, et = (np.concatenate(of, axis=-1) for of in zip(*found, strict=True))
        order = np.lexsort((x, owner))
        x, e, t, et = (side_by_side(owner[order], of[..., order], batch, gap)
                       for of, gap in ((x, np.nan), (e, 0.0), (t, 0.0), (et, 0.0)))  # fmt: skip
        rows += [Row(x[i], tuple(t[:, i]), region.cut, False, e[i], tuple(et[:, i])) for i in range(x.shape[0])]
    return rows


def _unknown(
    region: Corners, v: Array, variable: str, span: tuple[Array, Array], env: dict[str, Value], machine: Evaluator
) -> Bools:
    """The members of which a line or a conic is not known, though its surface is defined: what a scene's primitive
    hides of itself, say, is defined nowhere, and cuts nothing."""
    flat, batch = 3 * region.lines, v.shape[1]
    lines, conics = v[: flat - 6].reshape(-1, 3, batch), v[flat:].reshape(-1, 6, batch)
    low, high = -v[flat - 4], v[flat - 1]  # of the last two, y - low and high - y
    missing = np.concatenate([~np.isfinite(of).all(axis=1) for of in (conics, lines)])
    some = np.nonzero(missing.any(axis=0))[0]
    unknown = np.zeros(batch, dtype=bool)
    if some.size:
        here, still = gather(env, some), machine.with_directions(0)
        defined = np.zeros((missing.shape[0], some.size), dtype=bool)
        for share in LOOKED_AT:
            for name, (a, b) in ((variable, span), (region.within.variable, (low, high))):
                here[name] = Cell((share * a + (1 - share) * b)[some])
            found = numbers_at(region.surfaces, still, here)[:-2]
            defined |= np.stack([~np.isnan(as_array(cell.v, some.size)) for cell in found])
        unknown[some] = (missing[:, some] & defined).any(axis=0)
    return unknown


def _touching(
    region: Corners, places: Places, variable: str, env: dict[str, Value], batch: int, machine: Evaluator
) -> list[Row]:
    """Cuts where conics touch: what their numbers do not tell, a search does for places, about there, at which both
    surfaces are 0 as they were written."""
    rows: list[Row] = []
    surfaces = children(region.surfaces.body)
    for pair in distinct(places.p * len(surfaces) + places.q):
        p, q = divmod(int(pair), len(surfaces))
        here = places.pick((places.p == p) & (places.q == q))
        low, high = (here.place + sign * here.off for sign in (-1.0, 1.0))
        around = {
            **gather(env, here.owner),
            **{name: Cell(of[1]) for name, of in zip(AROUND, (low, high), strict=True)},
        }
        system = Critical((surfaces[p], surfaces[q]), (Within(region.within.variable, *map(var, AROUND)),))
        found = common_places(system, variable, around, (low[0], high[0]), MOST_COMMON, machine)
        order = np.argsort(here.owner, kind="stable")
        for x, e in zip(*found, strict=True):
            placed = side_by_side(here.owner[order], np.stack((x, e))[:, order], batch)
            rows += [Row(x, (), -1, False, e) for x, e in zip(*placed, strict=True) if np.isfinite(x).any()]
    return rows


def _crossing(
    lines: _Lines, conics: Sequence[Array], span: tuple[Array, Array], region: Corners, machine: Evaluator
) -> tuple[tuple[Ints, Ints, Ints], Places]:
    """Which two lines cross where there may be a corner, and of which member; and where conics take part."""
    if region.polynomial is None:
        return _corners(lines), conic_corners((lines.v, lines.e), conics, span)
    places = mixed_corners((lines.v, lines.e), conics, span, region.polynomial, region.covers, machine)
    first = conics[0].shape[1]
    flat = places.p >= first
    straight = places.pick(flat)
    return (straight.p - first, straight.q - first, straight.owner), places.pick(~flat)


def _numbers(cells: Sequence[Cell], batch: int, directions: int) -> tuple[Array, Array, Array, Array]:
    """Numbers of a batch (n, B), how far off they are, their tangents (k, n, B), and how far off these are."""
    v = np.stack([as_array(cell.v, batch) for cell in cells])
    e = np.stack([as_array(0.0 if cell.e is None else np.abs(cell.e), batch) for cell in cells])
    t = np.stack([tangents(cell.t, batch, directions) for cell in cells], axis=1)
    et = np.abs(np.stack([tangents(cell.et, batch, directions) for cell in cells], axis=1))
    return v, e, t, et


def _apart(of: Array, each: int) -> Array:
    """Numbers (..., n, B) of lines or conics: (..., each, n/each, B)."""
    *outer, count, batch = of.shape
    return np.moveaxis(of.reshape(*outer, count // each, each, batch), -2, -3)


def _corners(lines: _Lines) -> tuple[Ints, Ints, Ints]:
    """Which two lines meet where there may be a corner, and of which member."""
    _, count, batch = lines.v.shape
    with np.errstate(all="ignore"):
        size = np.hypot(lines.v[0], lines.v[1])
        step = max(1, MOST_NUMBERS // size.size)
        parts = [
            _clipped(lines, size, np.arange(i, min(i + step, count - 2))) for i in range(0, max(count - 2, 1), step)
        ]
    one, other, owner = (np.concatenate(of) for of in zip(*parts, strict=True))
    pairs = distinct((np.minimum(one, other) * count + np.maximum(one, other)) * batch + owner)
    return pairs // (count * batch), pairs // batch % count, pairs % batch


def _clipped(lines: _Lines, size: Array, some: Ints) -> tuple[Ints, Ints, Ints]:
    """Some lines, the others at which they may end in all half planes, and whose they are. size: of normals, (n, B)."""
    v = lines.v / size
    off = (lines.e / size).sum(axis=0)
    a, b, c = v[:, some][:, :, None]
    (one, rest), (other, more) = (_product(lines.v[0][some][:, None], lines.v[1]),
                                  _product(lines.v[1][some][:, None], lines.v[0]))  # fmt: skip
    along = ((one - other) + (rest - more)) / (size[some][:, None] * size)
    at_foot = v[2] - c * (a * v[0] + b * v[1])  # of 0 on the line, from where the way along it is measured
    turned = EPS * np.abs(along) + off + off[some][:, None]  # how far off the slope is, as the lines themselves are
    doubt = CLEAR * (np.abs(v[2]) + np.abs(c)) + off + off[some][:, None]
    none = ~np.isfinite(at_foot)
    none[np.arange(some.size), some] = True
    starts, stops = ~none & (along > turned), ~none & (along < -turned)
    ends = [-(at_foot + x) / (along + y) for x in (-doubt, doubt) for y in (-turned, turned)]
    least, most = np.minimum.reduce(ends), np.maximum.reduce(ends)
    least, most = least - BESIDE * np.abs(least), most + BESIDE * np.abs(most)
    low = np.where(starts, least, -np.inf).max(axis=1, keepdims=True)
    high = np.where(stops, most, np.inf).min(axis=1, keepdims=True)
    there = (starts | stops) & (most >= low) & (least <= high)
    parallel = ~none & ~(starts | stops)  # as far as is known: nothing is at 0 nearer than this
    near = np.maximum(np.abs(at_foot) - doubt, 0.0) / (np.abs(along) + turned)
    there |= parallel & ((high >= near) | (low <= -near)) & (along != 0)
    outside = parallel & (at_foot < 0) & (high < near) & (low > -near)
    line, at, owner = np.nonzero(there & (low <= high) & ~outside.any(axis=1, keepdims=True))
    return some[line], at, owner


def within_walls(
    level: LevelPlan, rows: list[Row], env: dict[str, Value], batch: int, machine: Evaluator, face: Term | None
) -> list[Row]:
    """The cuts of a range outside of whose walls nothing is integrated, without those outside.

    face: the surface, if any, that is not a wall, since it is what is integrated over.
    """
    slopes = numbers_at(level.slopes, machine.with_directions(0), env)
    least: Number = -np.inf
    most: Number = np.inf
    for wall, slope in zip(level.walls, slopes, strict=True):
        if level.level.cuts[rows[wall[0]].cut].surface is face:
            continue
        ends = [(rows[i].x, beside(rows[i])) for i in wall]
        known = np.logical_and.reduce([np.isfinite(x) & np.isfinite(wide) for x, wide in ends])
        low = np.minimum.reduce([x - wide for x, wide in ends])
        high = np.maximum.reduce([x + wide for x, wide in ends])
        above, below = (slope.v > 0, slope.v < 0) if len(wall) == 1 else (slope.v < 0, slope.v < 0)
        least = np.where(known & above, np.maximum(least, low), least)
        most = np.where(known & below, np.minimum(most, high), most)
    found = list(rows)
    for i in (i for wall in level.walls for i in wall):
        x, wide = rows[i].x, beside(rows[i])
        beyond = (x + wide < least) | (x - wide > most)
        if np.any(beyond):
            found[i] = replace(rows[i], x=np.where(beyond, np.nan, as_array(x, batch)))
    return found


def beside(row: Row) -> Any:
    """How far beside a cut another one still counts."""
    return BESIDE * np.abs(row.x) + (0.0 if row.e is None else row.e)
