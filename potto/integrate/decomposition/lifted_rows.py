"""Closed-form cuts of a variable as far as something is bounded at the places in space that they come from.

Owns `LiftedRows`, `lifted`, which tells of which rows the places are known, and `counting`. Whether anything is bounded
there, the integrand as a polynomial in sides tells (`arrangements`): of the shadows of the n^2/2 edges in which n
surfaces meet few are those of a body, and each of the others would cut what lies beside it all the same.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from potto.calculus.decomposition.lifts import Lift
from potto.calculus.decomposition.surface_cuts import face_of
from potto.calculus.inlining.alike import Leaf, alike
from potto.core.terms import Lam, Term, Var, function_of, substitute, tuple_
from potto.integrate.decomposition.arrangements import Arrangement, Sieve
from potto.integrate.decomposition.meetings import Row, as_array
from potto.integrate.levels import LevelPlan
from potto.integrate.pieces import Evaluator, numbers_at
from potto.kernels.cells import Array, Bools, Cell, Ints, Value

FEW = 8  # rows of a variable that it does not pay to look at
MOST_POINTS = 1 << 16  # that are looked at at once


Columns = tuple[tuple[str, tuple[Leaf, ...] | str], ...]


class LiftedRows(Struct, frozen=True):
    """Rows whose places are one formula but for its numbers.

    names: the variables further in, the innermost first. known: along which of them it is known where the places are.
    places: where they are along these, by the place of the variable. columns: what each parameter of that is in each
    row, or the one name that it is in all. rows: which of the level. parts: of each the surfaces of the arrangement on
    which its places lie.
    """

    names: tuple[str, ...]
    known: tuple[bool, ...]
    places: Lam
    columns: Columns
    rows: tuple[int, ...]
    parts: tuple[tuple[int, ...], ...]


def lifted(levels: Sequence[LevelPlan], arrangement: Arrangement | None) -> tuple[tuple[LiftedRows, ...], ...]:
    """By variable the rows that `counting` may look at: those at which nothing is decided, with places over them."""
    if arrangement is None or len(levels) < 3:
        return ((),) * len(levels)
    names = [level.variable for level in levels]
    return tuple(_of_level(level, names[:n], names[n + 1 :], arrangement) for n, level in enumerate(levels))


def _of_level(
    level: LevelPlan, outer: Sequence[str], inner: Sequence[str], arrangement: Arrangement
) -> tuple[LiftedRows, ...]:
    """inner, outer: the variables further in and further out, the outermost first."""
    known = {key: number for number, key in enumerate(arrangement.keys)}
    rows, parts, terms = list[int](), list[tuple[int, ...]](), list[dict[str, Term]]()
    told = [n for n, (number, _) in enumerate(level.rows) if inner and _sifted(level, number, known)]
    for n in told if len(told) >= FEW else ():
        for lift in level.level.cuts[level.rows[n][0]].lifts:
            rows.append(n)
            parts.append(_parts(lift, known))
            terms.append(_places(lift, inner))
    found, names = list[LiftedRows](), tuple(reversed(inner))
    for known_ones in dict.fromkeys(tuple(name in term for name in names) for term in terms):
        own = [n for n, term in enumerate(terms) if tuple(name in term for name in names) == known_ones]
        wholes = [tuple_(tuple(terms[n][name] for name in names if name in terms[n])) for n in own]
        for function, columns, places in _shapes(wholes, {level.variable, *outer}):
            at = [own[place] for place in places]
            found.append(LiftedRows(names, known_ones, function, columns, tuple(rows[n] for n in at),
                                    tuple(parts[n] for n in at)))  # fmt: skip
    return tuple(found)


def _shapes(terms: Sequence[Term], own: set[str]) -> Iterator[tuple[Lam, Columns, tuple[int, ...]]]:
    """Terms that are one formula but for its numbers, with what each parameter is, and which they are. own: names that
    stand for themselves."""
    kinds = dict.fromkeys(frozenset().union(*(term.free for term in terms)) - own)
    groups, alone = alike(terms, kinds, lambda _: None)
    for group in groups:
        yield group.function, tuple(zip(group.function.params, group.columns, strict=True)), group.places
    for place in alone:
        function = function_of(terms[place])
        yield function, tuple((name, name) for name in function.params), (place,)


def _sifted(level: LevelPlan, number: int, known: dict[Term, int]) -> bool:
    """Whether nothing is decided at a cut, and it is known on which surfaces all places over it lie."""
    if number < 0 or level.decides(number):
        return False
    lifts = level.level.cuts[number].lifts
    return bool(lifts) and all(_parts(lift, known) for lift in lifts)


def _parts(lift: Lift, known: dict[Term, int]) -> tuple[int, ...]:
    """The surfaces of the arrangement that a place lies on."""
    keys = {face_of(surface)[0].key for surface in lift.surfaces - lift.bounds}
    return tuple(sorted(known[key] for key in keys if key in known))


def _places(lift: Lift, inner: Sequence[str]) -> dict[str, Term]:
    """Where a place is along those variables further in of which that is known, in terms of the variable and those
    further out."""
    at, found = dict(lift.at), dict[str, Term]()
    for name in inner:  # each by those further out, the outermost of which are settled first
        if name in at and at[name].free.isdisjoint(set(inner) - found.keys()):
            found[name] = substitute(at[name], found)
    return found


def counting(
    groups: Sequence[LiftedRows], level: LevelPlan, rows: list[Row], env: dict[str, Value],
    ends: tuple[Cell, Cell], batch: int, machine: Evaluator, arrangement: Arrangement, face: Term | None,
) -> list[Row]:  # fmt: skip
    """The rows of a variable without those over which nothing is bounded. Of such as turn there, what lies beside them
    is told still. face: the surface, if any, that is integrated over, both of whose sides count."""
    if not all(isinstance(value, Cell) for value in env.values()):
        return rows
    quiet = machine.with_directions(0)
    low, high = (as_array(of(ends[0].v, ends[1].v), batch) for of in (np.minimum, np.maximum))
    at = {name: as_array(value.v, batch) for name, value in env.items() if isinstance(value, Cell)}
    found: dict[int, Bools] = {}
    for group in groups:
        sieve = Sieve(arrangement, (level.variable, *group.names), at, group.parts, quiet, face)
        x = np.stack([as_array(rows[n].x, batch) for n in group.rows])
        e = np.stack([as_array(0.0 if rows[n].e is None else rows[n].e, batch) for n in group.rows])
        kept = np.ones(x.shape, dtype=bool)
        inside = np.nonzero((x > low) & (x < high))
        for start in range(0, inside[0].size, MOST_POINTS):
            which, member = (of[start : start + MOST_POINTS] for of in inside)
            box = _box(group, level.variable, (x[which, member], e[which, member]), which, member, at, quiet)
            kept[which, member] = sieve.kept(which, member, box)
        for n, own in zip(group.rows, kept, strict=True):
            found[n] = found[n] | own if n in found else own
    counts = list(rows)
    for n, kept in found.items():
        counts[n] = replace(rows[n], x=np.where(kept, rows[n].x, np.nan))
    passed = [replace(rows[n], x=np.where(kept, np.nan, rows[n].x), passed=True) for n, kept in found.items()
              if not kept.all() and (rows[n].turning or level.level.cuts[rows[n].cut].turning)]  # fmt: skip
    return counts + passed


def _box(
    group: LiftedRows, variable: str, place: tuple[Array, Array], which: Ints, member: Ints, at: Mapping[str, Array],
    machine: Evaluator,
) -> Array:  # fmt: skip
    """Where what lies over places of the variable is, (n, 2, P). place: where those are, how far off they may be."""
    x, off = place
    here = {name: Cell(values[member]) for name, values in at.items()} | {variable: Cell(x)}
    batch = next(iter(at.values())).size if at else 1
    given: dict[str, Value] = {}
    for name, own in group.columns:
        if isinstance(own, str):
            given[name] = here[own]
        else:
            values = np.stack([at[leaf.name] if isinstance(leaf, Var) else np.full(batch, leaf.value) for leaf in own])
            given[name] = Cell(values[which, member])
    cells = numbers_at(group.places, machine.tracking(), given)
    box = np.full((1 + len(group.names), 2, x.size), np.nan)
    box[0] = x - off, x + off
    for n, cell in zip(1 + np.flatnonzero(group.known), cells, strict=True):
        e = 0.0 if cell.e is None else cell.e
        box[n, 0], box[n, 1] = cell.v - e, cell.v + e
    unknown = np.isnan(box).any(axis=1)  # as well as what is not defined, which it may be but for rounding
    box[:, 0][unknown], box[:, 1][unknown] = -np.inf, np.inf
    return box
