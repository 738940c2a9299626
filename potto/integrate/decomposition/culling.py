"""Which of many integrals are 0 before anything is evaluated: no side of a condition that is not 0 is ever taken.

Owns `remaining`. A scene sums over primitives, and each of them is somewhere: over a pixel that it does not touch its
integrand is 0, and so is every derivative, since that is so for all parameters nearby. Members of a batch (the pixels)
are put into blocks along a curve that fills space (Morton 1966), blocks of blocks above them; a summand is followed
down into the blocks where it may be something. So a primitive costs what it covers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache, reduce
from typing import Any

import numpy as np
from msgspec import Struct

from potto.calculus.solving.enclosable import enclosable
from potto.core.terms import ZERO as NOTHING
from potto.core.terms import Branch, Integral, Term, postorder
from potto.integrate.decomposition.vanishing import zero_with
from potto.integrate.rules.intervals import Interval
from potto.integrate.rules.lowered_intervals import enclosures
from potto.kernels.cells import Array, Bools, Ints

FAN = 4  # blocks in a block
AT_ONCE = 1 << 17  # pairs that are looked at together
CURVE = 3  # numbers of a member that put it on the curve, at most
BITS = 10  # of each

Numbers = Mapping[str, Any]


class Pairs(Struct, frozen=True):
    """Members and summands that may be something together."""

    members: Ints
    summands: Ints


def remaining(
    term: Integral, members: Numbers, summands: Numbers, shared: Numbers, sizes: tuple[int, int], backend: str
) -> Pairs:
    """The pairs of a member and a summand whose integral is not 0 for certain.

    members, summands: the numbers of each, by name; shared: those of all. sizes: how many there are of both.
    backend: by which boxes are enclosed.
    """
    tree = _Tree(members, sizes[0])
    found: list[tuple[Ints, Ints]] = []
    waiting = [(0, np.zeros(sizes[1], dtype=np.int64), np.arange(sizes[1]))]
    while waiting:
        level, blocks, others = waiting.pop()
        for start in range(0, others.size, AT_ONCE):
            here, those = blocks[start : start + AT_ONCE], others[start : start + AT_ONCE]
            box = {**{name: (value, value) for name, value in shared.items()}, **tree.box(level, here)}
            box |= {name: (value[those], value[those]) for name, value in summands.items()}
            kept = ~_vanishing(term, box, here.size, backend)
            here, those = here[kept], those[kept]
            if level == tree.depth:
                found.append((tree.order[here], those))
            elif here.size:
                inner, again = tree.inside(level, here, those)
                waiting.append((level + 1, inner, again))
    if not found:
        return Pairs(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64))
    return Pairs(*(np.concatenate(side) for side in zip(*found, strict=True)))


class _Tree:
    """Members in an order in which neighbours are near each other, and the ranges of their numbers block by block."""

    def __init__(self, members: Numbers, size: int) -> None:
        self.size = size
        self.order = _along_curve(list(members.values()), size)
        self.depth = max(0, int(np.ceil(np.log(max(1, size)) / np.log(FAN) - 1e-9)))
        while FAN**self.depth < size:
            self.depth += 1
        self.levels: list[dict[str, Interval]] = []
        ranges = {name: (value[self.order], value[self.order]) for name, value in members.items()}
        self.levels.append(ranges)
        for _ in range(self.depth):
            ranges = {name: _joined(*ends) for name, ends in ranges.items()}
            self.levels.append(ranges)
        self.levels.reverse()

    def box(self, level: int, blocks: Ints) -> dict[str, Interval]:
        """The ranges of the members' numbers in blocks."""
        return {name: (lo[blocks], hi[blocks]) for name, (lo, hi) in self.levels[level].items()}

    def inside(self, level: int, blocks: Ints, others: Ints) -> tuple[Ints, Ints]:
        """The blocks in blocks, as far as there are any, each with what its block was with."""
        count = -(-self.size // FAN ** (self.depth - level - 1))
        inner = (blocks[:, None] * FAN + np.arange(FAN)).reshape(-1)
        there = inner < count
        return inner[there], np.repeat(others, FAN)[there]


def _joined(lo: Array, hi: Array) -> Interval:
    starts = np.arange(0, lo.size, FAN)
    return np.minimum.reduceat(lo, starts), np.maximum.reduceat(hi, starts)


def _along_curve(values: Sequence[Array], size: int) -> Ints:
    """The order of members along a Morton curve through the numbers in which they differ."""
    chosen = [v for v in values if v.size and np.all(np.isfinite(v)) and np.ptp(v) > 0][:CURVE]
    if not chosen:
        return np.arange(size)
    code = np.zeros(size, dtype=np.int64)
    cells = [((v - v.min()) / np.ptp(v) * (2**BITS - 1)).astype(np.int64) for v in chosen]
    for bit in range(BITS):
        for place, cell in enumerate(cells):
            code |= ((cell >> bit) & 1) << (bit * len(cells) + place)
    return np.argsort(code, kind="stable")


def culls(term: Integral) -> bool:
    """Whether there are conditions outside of which an integrand is 0."""
    return any(isinstance(node, Branch) and NOTHING in (node.then, node.orelse) for node in _structure(term.body))


def _below(node: Term) -> tuple[Term, ...]:
    """The parts of an integrand that make it 0 if they are."""
    return (node.body,) if isinstance(node, Integral) else zero_with(node)[1]


@lru_cache(maxsize=1024)
def _structure(body: Term) -> tuple[Term, ...]:
    return tuple(postorder(body, below=_below))


@lru_cache(maxsize=1024)
def _surfaces(body: Term) -> tuple[Term, ...]:
    """The surfaces that decide, which can be enclosed."""
    found = dict.fromkeys(node.surface for node in _structure(body) if isinstance(node, Branch))
    return tuple(surface for surface in found if enclosable(surface, jumps=True))


def _vanishing(term: Integral, box: dict[str, Interval], count: int, backend: str) -> Bools:
    """For each box, whether the integrand is 0 in all of it, and remains so for all parameters nearby."""
    with np.errstate(all="ignore"):
        for over in (term, *(n for n in _structure(term.body) if isinstance(n, Integral))):
            for name, ends in zip(over.variables, over.bounds, strict=True):
                (a, b), (c, d) = enclosures(ends, box, count, backend)
                box = {**box, name: (np.minimum(a, c), np.maximum(b, d))}
        surfaces = _surfaces(term.body)
        sides = dict(zip(surfaces, enclosures(surfaces, box, count, backend), strict=True))
        known: dict[Term, Any] = {}
        for node in _structure(term.body):
            known[node] = _zero(node, known, sides)
    return np.broadcast_to(np.asarray(known[term.body], dtype=bool), (count,))


def _zero(node: Term, known: Mapping[Term, Any], sides: Mapping[Term, Interval]) -> Any:
    if isinstance(node, Integral):
        return known[node.body]
    if isinstance(node, Branch) and node.surface in sides:
        then, orelse = known[node.then], known[node.orelse]
        lo, hi = sides[node.surface]
        return np.where(lo > 0, then, np.where(hi < 0, orelse, then & orelse))
    every, parts = zero_with(node)
    return reduce(np.logical_and if every else np.logical_or, [known[part] for part in parts], np.bool_(every))
