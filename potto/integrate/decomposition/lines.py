"""Terms of an integrand along lines: at places of one variable, at parts of the ranges of those further in.

Owns `Watched`, `watched`, `extent`, `box_of`, `on_lines` and `apart`. What decides where a variable is cut, beside its
surfaces, is found on few such lines.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from msgspec import Struct

from potto.calculus.solving.enclosable import enclosable
from potto.core.terms import Lam, Term, children, function_of, tuple_
from potto.integrate.decomposition.meetings import as_array
from potto.integrate.levels import LevelPlan
from potto.integrate.pieces import Evaluator, gather, numbers_at, still
from potto.integrate.rules.intervals import Interval, enclosure
from potto.kernels.cells import Array, Cell, Ints, Value

# Where variables further in are, all of them at once, in parts of their ranges.
PARTS = (0.0, 0.5, 1.0)


class Watched(Struct, frozen=True):
    """Terms that vary with a variable, and all of them as a function."""

    terms: tuple[Term, ...]
    function: Lam

    def parts(self, inner: Sequence[LevelPlan]) -> Array:
        """At which parts of the ranges of variables further in lines are."""
        return np.asarray(PARTS if {level.variable for level in inner} & set(self.function.params) else (0.5,))


def watched(terms: Iterable[Term], variable: str, known: frozenset[str]) -> Watched | None:
    """Those of some terms that vary with a variable; None if there are none. known: the names that have values."""
    own = tuple(term for term in terms if variable in term.free and term.free <= known)
    return Watched(own, function_of(tuple_(own))) if own else None


def extent(lo: Cell, hi: Cell, batch: int) -> tuple[Array, Array, Ints]:
    """The lower and the upper ends of the ranges of members, and which of these have a length."""
    ends = np.stack([as_array(end.v, batch) for end in (lo, hi)])
    low, high = ends.min(axis=0), ends.max(axis=0)
    return low, high, np.flatnonzero(high > low)


def box_of(
    terms: Watched, inner: Sequence[LevelPlan], variable: str, env: Mapping[str, Value], ends: Interval
) -> dict[str, Interval] | None:
    """Intervals that hold all numbers of a batch, a variable between its ends, and those further in; None where their
    ranges can't be enclosed, or the terms name more than these."""
    box: dict[str, Interval] = {}
    for name, value in env.items():
        if isinstance(value, Cell):
            box[name] = (np.min(value.v), np.max(value.v))
    box[variable] = ends
    for level in inner:
        low, high = children(level.bounds.body)
        if not ((low.free | high.free) <= box.keys() and enclosable(low) and enclosable(high)):
            return None
        (least, _), (_, most) = enclosure((low, high), box)
        box[level.variable] = least, most
    return box if all(term.free <= box.keys() for term in terms.terms) else None


def on_lines(
    terms: Watched, inner: Sequence[LevelPlan], variable: str, env: Mapping[str, Value], members: Ints, part: Array,
    places: Array, machine: Evaluator,
) -> Array:  # fmt: skip
    """Terms (E, ...) of members (...) at places (...), variables further in at parts (...) of their ranges."""
    machine = machine.with_directions(0)
    shape = places.shape
    given = {name: still(value) for name, value in env.items()}
    here = gather(given, np.broadcast_to(members, shape).ravel())
    here[variable] = Cell(places.ravel())
    parts = np.broadcast_to(part, shape).ravel()
    named = {level.variable for level in inner} & set(terms.function.params)
    with np.errstate(all="ignore"):
        for level in inner if named else ():
            low, high = (np.broadcast_to(cell.v, parts.shape) for cell in numbers_at(level.bounds, machine, here))
            low, high = (np.where(np.isfinite(end), end, other) for end, other in ((low, high - 1), (high, low + 1)))
            here[level.variable] = Cell(np.nan_to_num(low + parts * (high - low)))
        values = numbers_at(terms.function, machine, {name: here[name] for name in terms.function.params})
        return np.stack([np.broadcast_to(value.v, parts.shape).reshape(shape) for value in values])


def apart(member: Ints) -> list[Ints]:
    """Numbers of what was found of members, such that each member is among them once."""
    seen: dict[int, int] = {}
    rows: list[list[int]] = []
    for number, own in enumerate(member.tolist()):
        turn = seen[own] = seen.get(own, -1) + 1
        if turn == len(rows):
            rows.append([])
        rows[turn].append(number)
    return [np.asarray(row) for row in rows]
