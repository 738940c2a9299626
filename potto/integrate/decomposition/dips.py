"""Where ranges are cut around the places at which what a builtin is singular at 0 of comes near to 0.

Owns `dip_rows` and `singular_at`. sqrt(t - cos(x)) is |x| but for a stretch as
long as sqrt(t - 1), and 1/(a + x^2) is next to nothing outside of one: no node need be there, though x^2 itself is
seen from afar. So the least of each radicand, base, divisor, argument of a logarithm is looked for, and how far from it
that has become TWICE as large. There the range is cut, and GROWTH times farther off, and so on.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache

import numpy as np

from potto.calculus.solving.enclosable import enclosable
from potto.core.terms import Const, Prim, Term, postorder
from potto.integrate.decomposition.lines import Watched, apart, box_of, extent, on_lines
from potto.integrate.decomposition.meetings import Row
from potto.integrate.decomposition.turns import Span, cells_of
from potto.integrate.levels import HINT, LevelPlan
from potto.integrate.pieces import Evaluator
from potto.integrate.rules.intervals import enclosure
from potto.kernels.cells import Array, Cell, Ints, Value
from potto.primitives import PRIMITIVES

# By how much a number may differ over a range, as a factor, whose nodes see what it is the radicand of. Nodes see
# beyond a place on which what is singular there lies so many times farther off than the number doubles.
FACTOR, TWICE = 8.0, 2.0
SAMPLES = 17  # of a range, between which there is one least number at most
SECTIONS, ROUNDS = 8, 18  # of a stretch around it, and how often it is cut into those: to 4^-18
SETTLED = 1.01  # by what factor a number differs over a stretch on which the least is found; beside a root by far more
ASIDE = 1 / 32  # from such a part of an infinite range on, which says nothing of its scale
SHARE = 2.0  # from such a part of the range on nodes see what there is
GROWTH = 4.0
DISTANCES = 2.0 ** -np.arange(52.0, 0.0, -1.0)


@lru_cache(maxsize=1024)
def singular_at(term: Term) -> tuple[Term, ...]:
    """What builtins in an integrand are singular at 0 of, as far as it can be enclosed."""
    found = (
        base
        for node in _written_out(term)
        for base in map(_base, PRIMITIVES[node.op].edges(*node.args))
        if base.free and base.free <= term.free and enclosable(base)
    )
    return tuple(dict.fromkeys(found))


def _written_out(term: Term) -> Iterator[Prim]:
    """The builtins in a term, and those in the formulas of these."""
    for node in postorder(term):
        if isinstance(node, Prim):
            yield node
            formula = PRIMITIVES[node.op].formula
            if formula is not None:
                yield from (part for part in postorder(formula(*node.args)) if isinstance(part, Prim))


def _base(edge: Term) -> Term:
    """What is 0 where this is, and changes its sign there if it can."""
    while isinstance(edge, Prim) and (
        edge.op in ("abs", "sqrt", "neg") or (edge.op == "pow" and isinstance(edge.args[1], Const))
    ):
        edge = edge.args[0]
    return edge


def dip_rows(
    terms: Watched, inner: Sequence[LevelPlan], variable: str, env: Mapping[str, Value], lo: Cell, hi: Cell,
    batch: int, machine: Evaluator,
) -> list[Row]:  # fmt: skip
    """Rows around the places within the ranges of members where one of the terms comes near to 0."""
    low, high, there = extent(lo, hi, batch)
    if not there.size or not _dips_somewhere(terms, inner, variable, env, (low[there].min(), high[there].max())):
        return []
    search = _Search(terms, inner, variable, env, machine, Span(low, high, np.zeros(batch)))
    term, part, member, place = search.least(there)
    found = []
    for numbers in apart(member):
        x, own = place[numbers], member[numbers]
        for away in search.widths(term[numbers], part[numbers], own, x):
            inside = (away > low[own]) & (away < high[own])
            if inside.any():
                row = np.full(batch, np.nan)
                row[own[inside]] = away[inside]
                found.append(Row(row, (None,) * machine.directions, HINT, False))
    return found


def _dips_somewhere(
    terms: Watched, inner: Sequence[LevelPlan], variable: str, env: Mapping[str, Value], ends: tuple[float, float]
) -> bool:
    """Whether a term may come near to 0 for some member, as far as an enclosure over all of them tells."""
    box = box_of(terms, inner, variable, env, ends)
    if box is None:
        return True
    if not np.isfinite(ends).all():
        box[variable] = cells_of(ends)
    with np.errstate(all="ignore"):
        for least, most in enclosure(terms.terms, box):
            near, far = np.minimum(np.abs(least), np.abs(most)), np.maximum(np.abs(least), np.abs(most))
            if np.any(~((least * most > 0) & (far <= FACTOR * near)) & (near < np.inf)):
                return True
    return False


class _Search:
    """Where terms are nearest to 0, and how far from there they are twice as large."""

    def __init__(
        self, terms: Watched, inner: Sequence[LevelPlan], variable: str, env: Mapping[str, Value], machine: Evaluator,
        span: Span,
    ) -> None:  # fmt: skip
        self.terms, self.inner, self.variable, self.env, self.machine = terms, inner, variable, env, machine
        self.span = span
        self.parts = terms.parts(inner)

    def at(self, members: Ints, part: Ints, u: Array) -> Array:
        """All terms (E, ...), at parts u of members' ranges."""
        places = self.span.pick(members).places(u)
        return on_lines(
            self.terms, self.inner, self.variable, self.env, members, self.parts[part], places, self.machine
        )

    def of(self, term: Ints, part: Ints, members: Ints, u: Array) -> Array:
        """One term each (N,) at parts u (P, N)."""
        shape = u.shape
        values = self.at(np.broadcast_to(members, shape), np.broadcast_to(part, shape), u)
        return np.asarray(np.take_along_axis(values, np.broadcast_to(term, (1, *shape)), axis=0)[0])

    def least(self, there: Ints) -> tuple[Ints, Ints, Ints, Array]:
        """Of which term, on which line, of which member one is the least, and at which part of the range."""
        u = np.linspace(0.0, 1.0, SAMPLES)
        shape = (self.parts.size, SAMPLES, there.size)
        line = np.broadcast_to(np.arange(self.parts.size)[:, None, None], shape)
        values = self.at(np.broadcast_to(there, shape), line, np.broadcast_to(u[:, None], shape))
        with np.errstate(invalid="ignore"):
            size = np.where(np.isfinite(values), np.abs(values), np.inf)
            most = np.where(size < np.inf, size, 0.0).max(axis=2, keepdims=True)
            wall = np.full((*size.shape[:2], 1, size.shape[3]), np.inf)
            before, after = (np.concatenate(two, axis=2) for two in ((wall, size[:, :, :-1]), (size[:, :, 1:], wall)))
            lowest = (size <= before) & (size < after) & (FACTOR * size < most) & (size > 0)
            lowest[:, :, [0, -1]] &= ~self.span.pick(there).endless  # which are run through as fast as these ask for
        term, part, number, member = np.nonzero(lowest)
        if not term.size:
            return term, part, member, u[number]
        highest, sign = most[term, part, 0, member], np.sign(values[term, part, number, member])
        left, right = np.maximum(u[number] - u[1], 0.0), np.minimum(u[number] + u[1], 1.0)
        members, steps = there[member], np.linspace(0.0, 1.0, SECTIONS + 1)[:, None]
        for _ in range(ROUNDS):
            grid = left + steps * (right - left)
            own = self.of(term, part, members, grid) * sign
            own = np.where(np.isfinite(own), own, np.inf)
            best = own.argmin(axis=0)[None]
            left, middle, right = (
                np.take_along_axis(grid, np.clip(best + way, 0, SECTIONS), axis=0)[0] for way in (-1, 0, 1)
            )
            least, most = own.min(axis=0), own.max(axis=0)
            settled, gone = most <= SETTLED * least, least <= 0
            if (settled | gone).all():
                break
        keep = settled & ~gone & (FACTOR * least < highest)
        return term[keep], part[keep], members[keep], middle[keep]

    def widths(self, term: Ints, part: Ints, members: Ints, u: Array) -> list[Array]:
        """Places of cuts around these: nan where none is needed."""
        here = np.abs(self.of(term, part, members, u[None]))
        reached = []
        for way in (1.0, -1.0):
            away = u + way * DISTANCES[:, None]
            values = np.where((away >= 0) & (away <= 1), np.abs(self.of(term, part, members, np.clip(away, 0, 1))), 0.0)
            beyond = values >= TWICE * here
            first = DISTANCES[beyond.argmax(axis=0)]
            reached.append(np.where(beyond.any(axis=0) & (first * SHARE < 1), first, np.nan))
        narrow = np.isfinite(reached[0]) | np.isfinite(reached[1])
        narrow &= ~self.span.pick(members).endless | (np.fmin(*reached) < ASIDE)
        found = [np.where(narrow, u, np.nan)]
        for way, far in zip((1.0, -1.0), reached, strict=True):
            while (near := far * SHARE < 1).any():
                found.append(u + np.where(near, way * far, np.nan))
                far = GROWTH * far
        span = self.span.pick(members)
        return [span.places(place) for place in found]
