"""Where systems of equations have solutions: the critical places of integrals further in, found by numbers.

Owns `critical_rows`. Systems that differ by numbers alone are searched as one (`box_search`). The cuts need not move
where what is integrated is continuous there; where it is not, they do as the implicit function theorem says.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from potto.calculus.decomposition.critical import Critical, Within, slopes_of
from potto.calculus.inlining.alike import Leaf, SameShape, alike
from potto.core.terms import Const, Term, Tuple, function_of, tuple_, var
from potto.integrate.columns import side_by_side
from potto.integrate.decomposition.arrangements import Arrangement, sieve
from potto.integrate.decomposition.box_search import Search, inverses
from potto.integrate.decomposition.effective_range import Ranges
from potto.integrate.decomposition.meetings import SEARCHED, Row, as_array, tangents
from potto.integrate.decomposition.root_isolation import flat
from potto.integrate.events import Unsearched
from potto.integrate.pieces import gather
from potto.integrate.rules.gauss import EPS
from potto.kernels.cells import Array, Cell, Ints, Value, pad

SAME = 2.0**-44  # of the range: solutions no farther apart are one
# Where surfaces touch, rounding hides places here and there: how many times as far apart as they may be off neighbours
# are one, and how long what all of them lie in is, of how far off the one is of which least is known, if that is one.
CROWD, SPREAD = 32.0, 8.0
BEYOND = 0.125  # how far beyond its range a turning place is looked for, which the map of nodes takes care of


def critical_rows(
    systems: Sequence[Critical], variable: str, env: dict[str, Value], lo: Cell, hi: Cell, near: Ranges, batch: int,
    machine: Any, arrangement: Arrangement | None = None, face: Term | None = None,
) -> list[Row]:  # fmt: skip
    """The cuts of one variable at places where what lies further in meets, appears, merges or turns.

    near: of variables whose range is infinite, what matters of it. arrangement: the surfaces of what is integrated, if
    it can be told at which places it is smooth all the same; face: the one, if any, that is integrated over.
    """
    low, high = as_array(np.minimum(lo.v, hi.v), batch), as_array(np.maximum(lo.v, hi.v), batch)
    around = BEYOND * np.where(np.isfinite(high - low), high - low, 0.0)
    reach = np.minimum(1.0, np.maximum(np.abs(low), np.abs(high)))
    rows: list[Row] = []
    same = SAME * np.where(np.isfinite(high - low), high - low, 1.0)
    systems, env = _in_numbers(systems, env)
    numbers = frozenset(name for name, value in env.items() if isinstance(value, Cell))
    groups, unsearched = _groups(systems, variable, numbers)
    lost = [unsearched]
    fixed = {name: as_array(env[name].v, batch) for name in numbers}  # type: ignore[union-attr]
    for group in groups:
        wide = [around if system.turning else 0.0 * around for system in group.systems]
        ends = low - np.stack(wide), high + np.stack(wide)
        count = len(group.systems)
        ones = np.ones((len(group.names), batch * count))
        search = Search(group.names, group.fixed(env, batch), *group.parts(), near, count, ones)
        sifted = None if arrangement is None else sieve(arrangement, group.systems, group.names, fixed, machine, face)
        if sifted is not None and not group.turning:
            search.sifted = lambda owner, box, own=sifted: own.kept(owner // batch, owner % batch, box)
        owner, places, width = search.solved(ends[0].ravel(), ends[1].ravel(), machine.search)
        lost.append(len(search.lost))
        counts = np.ones(owner.size, dtype=bool)
        if sifted is not None and owner.size:
            box = np.stack((places - width, places + width), axis=1)
            counts = sifted.kept(owner // batch, owner % batch, box)
        for number, system in enumerate(group.systems):
            if number in search.lost:
                continue
            of = owner // batch == number
            for own, passed in ((of & counts, False), (of & ~counts, True)):
                if own.any() and (system.turning or not passed):
                    found = owner[own] % batch, places[:, own], width[0, own]
                    rows += _moving(system, variable, env, found, same, batch, reach, machine, passed)
    for _ in range(sum(lost)):
        machine.note(Unsearched(variable))
    return rows


def common_places(
    system: Critical, variable: str, env: dict[str, Value], ends: tuple[Array, Array], most: int, machine: Any
) -> tuple[Array, Array]:
    """Places (R, B) along a variable, at most so many, at which equations are 0 between ends (B,), and how far off
    these may be; nan where there are fewer. Where rounding hides them, or the search is given up, one that is so far
    off as the stretch goes in which they may be."""
    low, high = ends
    middle, reach = 0.5 * (low + high), 0.5 * (high - low)
    (system,), env = _in_numbers((system,), env)
    groups, _ = _groups((system,), variable, frozenset(name for name, value in env.items() if isinstance(value, Cell)))
    if not groups:
        return middle[None], reach[None]
    (group,) = groups
    search = Search(
        group.names, group.fixed(env, low.size), *group.parts(), {}, 1, np.ones((len(group.names), low.size))
    )
    owner, places, width = search.solved(low, high, machine.search)
    still = np.zeros((2, 0, owner.size))
    width = width[0]
    rows = _as_rows(system, owner, places[0], width, SAME * (high - low), low.size, (still[0], still[1]), CROWD)
    x, e = (np.stack([middle * np.nan, *(getattr(row, name) for row in rows)]) for name in ("x", "e"))
    least, furthest = np.full(low.shape, np.inf), np.full(low.shape, -np.inf)
    for whose, start, end in ((owner, places[0] - width, places[0] + width), *((of, *b[0]) for of, b in search.open)):
        np.minimum.at(least, whose, start)
        np.maximum.at(furthest, whose, end)
    count = np.isfinite(x).sum(axis=0)
    with np.errstate(invalid="ignore"):
        one = furthest - least <= SPREAD * np.fmax.reduce(e, axis=0)
    hidden = (count > most) | ((count > 1) & one)
    for whose, _ in search.open:
        hidden[whose] = True
    with np.errstate(invalid="ignore"):
        x = np.where(hidden, np.nan, x)
        x[0], e[0] = np.where(hidden, 0.5 * (least + furthest), np.nan), np.where(hidden, 0.5 * (furthest - least), 0.0)
    return x, e


class _Alike(Struct, frozen=True):
    """Systems that are the same but for their numbers, and are searched as one batch: of five balls ten pairs meet.

    names: what they are solved for, the variable that is cut first. terms: equations, slopes row by row, and ends of
    ranges. columns: what each of their further names is in each system, or the one name that it is in all.
    """

    systems: tuple[Critical, ...]
    names: tuple[str, ...]
    terms: tuple[Term, ...]
    columns: tuple[tuple[str, tuple[Leaf, ...] | str], ...]

    @property
    def turning(self) -> bool:
        """Whether any of them is where something turns."""
        return any(system.turning for system in self.systems)

    def parts(self) -> tuple[Sequence[Term], Sequence[Term], Sequence[Term]]:
        """Equations, slopes and ends."""
        n = len(self.names)
        return self.terms[:n], self.terms[n : n + n * n], self.terms[n + n * n :]

    def fixed(self, env: dict[str, Value], batch: int) -> dict[str, Array]:
        """What does not vary, of all members of the first system, then of all of the second."""

        def of(leaf: Leaf) -> Array:
            value = leaf.value if isinstance(leaf, Const) else env[leaf.name].v  # type: ignore[union-attr]
            return as_array(value, batch)

        rows = {name: [var(column)] * len(self.systems) if isinstance(column, str) else column
                for name, column in self.columns}  # fmt: skip
        return {name: np.concatenate([of(leaf) for leaf in row]) for name, row in rows.items()}


def _in_numbers(systems: Sequence[Critical], env: dict[str, Value]) -> tuple[tuple[Critical, ...], dict[str, Value]]:
    """Systems with a name of its own for each component of a tuple, and their values."""
    if not any(isinstance(env.get(name), tuple) for system in systems for name in system.free):
        return tuple(systems), env
    waiting, env = flat(tuple(term for system in systems for term in _terms(system)), env)
    found = []
    for system in systems:
        n = len(system.equations)
        equations, ends, waiting = waiting[:n], waiting[n : 3 * n - 2], waiting[3 * n - 2 :]
        bounds = zip(system.within, ends[::2], ends[1::2], strict=True)
        within = tuple(Within(w.variable, lo, hi) for w, lo, hi in bounds)
        found.append(Critical(tuple(equations), within, system.turning, system.steps))
    return tuple(found), env


def _terms(system: Critical) -> tuple[Term, ...]:
    """The equations of a system, and the bounds of what is within."""
    return (*system.equations, *(end for w in system.within for end in (w.lo, w.hi)))


@lru_cache(maxsize=256)
def _groups(systems: tuple[Critical, ...], variable: str, numbers: frozenset[str]) -> tuple[tuple[_Alike, ...], int]:
    """Systems by what they are but for their numbers, and how many can't be searched. Those that parameters alone
    decide are left out: they are solved everywhere, or nowhere."""
    posed: dict[tuple[str, ...], list[tuple[Critical, Term]]] = {}
    unsearched = 0
    once = {(frozenset(s.equations), s.within, s.turning, s.steps): s for s in systems}  # whichever two met first
    for system in once.values():
        slopes = slopes_of(system, variable)
        names = (variable, *(w.variable for w in system.within))
        n = len(names)
        terms = _terms(system)
        terms = (*terms[:n], *(slopes or ()), *terms[n:])
        if slopes is None or not frozenset().union(*(term.free for term in terms)) <= numbers.union(names):
            unsearched += 1
        elif all(equation.free.intersection(names) for equation in terms[:n]):
            posed.setdefault(names, []).append((system, tuple_(terms)))
    found: list[_Alike] = []
    for names, members in posed.items():
        kinds = dict.fromkeys(numbers.difference(names))
        groups, alone = alike([whole for _, whole in members], kinds, lambda _: None)
        shapes = [*groups, *(_by_itself(members[place][1], place) for place in alone)]
        for shape in shapes:
            pairs = zip(shape.function.params, shape.columns, strict=True)
            columns = tuple((name, column) for name, column in pairs if name not in names)
            together = tuple(members[place][0] for place in shape.places)
            whole = shape.function.body
            assert isinstance(whole, Tuple)
            found.append(_Alike(together, names, whole.items, columns))
    return tuple(found), unsearched


def _by_itself(term: Term, place: int) -> SameShape:
    """One that is like no other."""
    function = function_of(term)
    return SameShape(function, function.params, (place,))


def _speeds(
    system: Critical, variable: str, env: dict[str, Value], owner: Ints, places: Array, doubt: Array, machine: Any
) -> tuple[Array, Array]:
    """How solutions move along the variable that is cut, (k, P), and by how much that may be off: `doubt` as a part."""
    names = (variable, *(w.variable for w in system.within))
    k, n = machine.directions, len(names)
    here = {name: pad(value, k + n) for name, value in gather(env, owner).items()}
    for i, name in enumerate(names):
        unit = tuple(1.0 if i == j else None for j in range(n))
        here[name] = Cell(places[i], None, (None,) * k + unit)
    function = function_of(tuple_(system.equations))
    found = machine.with_directions(k + n).evaluate(function, {name: here[name] for name in function.params}, None)
    slopes = np.stack([tangents(cell.t, owner.size, k + n) for cell in found])  # (n, k + n, P)
    slopes = np.moveaxis(slopes, -1, 0)
    rates, matrices = slopes[:, :, :k], slopes[:, :, k:]
    inverse = inverses(matrices)
    moves = -inverse @ rates
    sizes = np.abs(inverse) @ (np.abs(rates) + np.abs(matrices) @ np.abs(moves))
    return moves[:, 0].T, sizes[:, 0].T * doubt


def _moving(
    system: Critical, variable: str, env: dict[str, Value], places: tuple[Ints, Array, Array], same: Array, batch: int,
    reach: Array, machine: Any, passed: bool,
) -> list[Row]:  # fmt: skip
    """Places of members as rows, with their speeds where what is integrated steps. passed: turning places at which
    nothing turns, but may a little further on: where a vertex ends an edge, what goes on beyond it."""
    owner, there, off = places
    t, et = np.zeros((2, machine.directions if system.steps and not passed else 0, owner.size))
    if t.size:
        doubt = 8 * EPS + off / np.maximum(reach[owner], np.abs(there[0]))
        t, et = _speeds(system, variable, env, owner, there, doubt, machine)
    rows = _as_rows(system, owner, there[0], off, same, batch, (t, et))
    return [replace(row, passed=True) for row in rows] if passed else rows


def _as_rows(
    system: Critical, owner: Ints, places: Array, width: Array, same: Array, batch: int, speeds: tuple[Array, Array],
    crowd: float = 1.0,
) -> list[Row]:  # fmt: skip
    """Places in order, one of those at one place for each member, as rows padded with nan. crowd: how many times as
    far apart as they may be off they are one still, that is off by as much as they are apart."""
    order = np.lexsort((places, owner))
    owner, places, width = owner[order], places[order], width[order]
    near = crowd * (width[1:] + width[:-1]) + same[owner[1:]] + 8 * EPS * np.abs(places[1:])
    new: Any = np.ones(owner.size, dtype=bool)
    new[1:] = (owner[1:] != owner[:-1]) | (places[1:] - places[:-1] > near)
    if not new.all():
        first = np.nonzero(new)[0]
        least, most = np.minimum.reduceat(places - width, first), np.maximum.reduceat(places + width, first)
        wide = most - least > 2 * (width[first] + same[owner[first]])
        places[first] = np.where(wide, 0.5 * (least + most), places[first])
        width[first] = np.where(wide, 0.5 * (most - least), width[first])
    owner, places, width = owner[new], places[new], width[new]
    off = width + SEARCHED * EPS * np.abs(places)
    x, off = side_by_side(owner, np.stack((places, off)), batch)
    t, et = (side_by_side(owner, of[:, order][:, new], batch, 0.0) for of in speeds)
    return [Row(x[i], tuple(t[:, i]), -1, system.turning, off[i], tuple(et[:, i])) for i in range(x.shape[0])]
