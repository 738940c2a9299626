"""Unions of regions that lie apart: of each by itself, the integral is a sum.

Owns `Union`. In `if a then u else if b then v else … 0`, which is what an `or` comes to, a condition matters to those
behind it only where both hold. Enclosures over thin slices of the domain tell between which planes each holds; those
whose boxes have nothing in common are integrated apart, so that n discs cost n times what one does, and not what their
n^2 crossings do, which are not there.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from msgspec import Struct

from potto.calculus.decomposition.factors import factors
from potto.calculus.solving.enclosable import enclosable
from potto.calculus.surfaces.domains import ends_of_domain
from potto.core.terms import (
    ZERO,
    Branch,
    Integral,
    Term,
    add,
    branch,
    mul,
    neg,
    with_integrand,
)
from potto.integrate.rules.intervals import Interval, enclosure
from potto.kernels.cells import Array, Bools

SLICES = 128  # of the range of a variable: 64 take as long, and 256 a fifth longer
# How far around parameters it is looked whether all the same lies apart, of their sizes: nothing is asked for those.
NEAR = 2.0**-4
MOST_KNOWN = 8  # boxes of parameters of which it is known what lies apart
MOST_WRITTEN = 16  # sums that are made of one integral

Box = dict[str, Interval]


class Region(Struct, frozen=True):
    """Where surface > 0 (>= 0 unless strict) the integrand is `value`, if it is not in a region before."""

    surface: Term
    strict: bool
    value: Term


class Union(Struct):
    """An integral over a union of regions. around: the other factors of the integrand. known: boxes of parameters, and
    which regions lie apart for all of them."""

    term: Integral
    around: tuple[Term, ...]
    regions: tuple[Region, ...]
    known: list[tuple[Box, tuple[tuple[int, ...], ...]]] = []
    written: dict[tuple[tuple[int, ...], ...], Term] = {}

    def at(self, parameters: Box) -> Term:
        """An equal sum for these parameters; the integral itself where nothing lies apart, or that can't be told."""
        groups = next((found for box, found in self.known if _within(parameters, box)), None)
        if groups is None:
            groups = self._groups(parameters)
            wide = {name: _widened(*ends) for name, ends in parameters.items()}
            near = wide if len(groups) > 1 and self._groups(wide) == groups else parameters
            if len(self.known) >= MOST_KNOWN:
                self.known.pop(0)
            self.known.append((near, groups))
        if len(groups) < 2 or (groups not in self.written and len(self.written) >= MOST_WRITTEN):
            return self.term
        if groups not in self.written:
            self.written[groups] = add(*(self._over(group) for group in groups))
        return self.written[groups]

    def _over(self, group: Sequence[int]) -> Integral:
        body: Term = ZERO
        for place in reversed(group):
            region = self.regions[place]
            body = branch((region.surface,), region.strict, region.value, body)
        return with_integrand(self.term, mul(*self.around, body))

    def _groups(self, parameters: Box) -> tuple[tuple[int, ...], ...]:
        """The regions that reach each other, in their order."""
        everything = (tuple(range(len(self.regions))),)
        box = dict(parameters)
        for variable, ends in zip(self.term.variables, self.term.bounds, strict=True):
            if not all(end.free <= box.keys() for end in ends):
                return everything
            (a, b), (c, d) = enclosure(ends, box)
            box[variable] = (min(a, c), max(b, d))
        surfaces = tuple(region.surface for region in self.regions)
        if not frozenset().union(*(surface.free for surface in surfaces)) <= box.keys():
            return everything
        apart = np.zeros((len(surfaces), len(surfaces)), dtype=bool)
        for variable in self.term.variables:
            lo, hi = box[variable]
            if not np.isfinite(hi - lo) or not lo < hi:
                continue
            edges = np.linspace(lo, hi, SLICES + 1)
            found = enclosure(surfaces, {**box, variable: (edges[:-1], edges[1:])})
            first, last = np.array([_reached(high) for _, high in found]).T
            apart |= last[:, None] + 1 < first  # a slice lies between them
        return _connected(~(apart | apart.T))


def union(term: Integral) -> Union | None:
    """An integral over a union, if it is one by its form, of what can be enclosed wherever it is integrated."""
    if len(term.variables) < 2 or not all(enclosable(end) for pair in term.bounds for end in pair):
        return None
    every = list(factors(term.body))
    for place, factor in enumerate(every):
        regions = tuple(_regions(factor))
        if len(regions) > 1 and all(_is_defined(region.surface, term.variables) for region in regions):
            return Union(term, (*every[:place], *every[place + 1 :]), regions)
    return None


def _regions(term: Term) -> Iterator[Region]:
    """Those of a chain of conditions behind the last of which it is 0; none of what is no such chain."""
    found: list[Region] = []
    while isinstance(term, Branch) and len(term.coordinates) == 1:
        if isinstance(term.orelse, Branch) or term.orelse is ZERO:
            found.append(Region(term.surface, term.strict, term.then))
            term = term.orelse
        else:
            found.append(Region(neg(term.surface), not term.strict, term.orelse))
            term = term.then
    return iter(found if term is ZERO else ())


def _is_defined(surface: Term, variables: Sequence[str]) -> bool:
    return enclosable(surface) and not ends_of_domain(surface)


def _reached(high: float | Array) -> tuple[float, float]:
    """The first and the last of the slices in which a surface may be above 0, by bounds of it from above."""
    there = np.nonzero(~(np.broadcast_to(high, SLICES) < 0))[0]
    return (float(there[0]), float(there[-1])) if there.size else (np.inf, -np.inf)


def _connected(near: Bools) -> tuple[tuple[int, ...], ...]:
    """The groups that a relation connects, of places 0, 1, …"""
    waiting, groups = set(range(near.shape[0])), list[tuple[int, ...]]()
    while waiting:
        group, fresh = set[int](), {min(waiting)}
        while fresh:
            group |= fresh
            fresh = set(np.nonzero(near[sorted(fresh)].any(axis=0))[0].tolist()) - group
        waiting -= group
        groups.append(tuple(sorted(group)))
    return tuple(groups)


def _within(inner: Box, outer: Box) -> bool:
    return all(outer[name][0] <= lo and hi <= outer[name][1] for name, (lo, hi) in inner.items())


def _widened(lo: float, hi: float) -> Interval:
    around = NEAR * max(abs(lo), abs(hi))
    return lo - around, hi + around
