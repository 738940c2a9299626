"""The surfaces of an integrand in all its variables, and at which places of several of them it is not smooth.

Owns `Arrangement`, which `arrangement_of` makes, and `Sieve`, which `sieve` makes. Where surfaces meet, or one of them
turns, an integrand that is a polynomial in their sides (`calculus/decomposition/side_polynomials`) changes only if its
mixed difference by the sides of those that take part is not 0, the others being on the sides that they have there: what
balls of a union have in common within a third one leaves nothing.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import numpy as np
from msgspec import Struct

from potto.calculus.decomposition.critical import Critical
from potto.calculus.decomposition.side_polynomials import LEAST, MOST, by_sides
from potto.calculus.decomposition.surface_cuts import along, side
from potto.calculus.solving.enclosable import enclosable
from potto.calculus.surfaces.finding import Resolve
from potto.core.terms import Lam, Term, function_of
from potto.integrate.columns import distinct
from potto.integrate.decomposition.conic_corners import BESIDE, CANCELLED, MOST_NEAR
from potto.integrate.decomposition.meetings import as_array
from potto.integrate.levels import Group
from potto.integrate.pieces import Evaluator, number_at
from potto.integrate.rules.intervals import Interval, enclosure
from potto.kernels.cells import Array, Bools, Cell, Ints


class Arrangement(Struct, frozen=True):
    """The surfaces with sides, as they were written, the forms by which they are known, and what equations have of
    each, with the numbers of its sides; and what is integrated as a polynomial in these."""

    surfaces: tuple[Term, ...]
    keys: tuple[Term, ...]
    parts: tuple[Term, ...]
    polynomial: Lam


def arrangement_of(body: Term, groups: Sequence[Group], resolve: Resolve) -> Arrangement | None:
    """The arrangement of an integrand; None where its surfaces can't be enclosed, or it can't be told."""
    cuts = [group.cut for group in groups if group.cut.jumps]
    sides = {jump.path: (side(n), jump.orientation) for n, cut in enumerate(cuts) for jump in cut.jumps}
    if len(cuts) < 2 or not all(enclosable(cut.surface, jumps=True) for cut in cuts):
        return None
    polynomial = by_sides(body, sides, resolve)
    if polynomial is None:
        return None
    surfaces, keys = (tuple(getattr(cut, name) for cut in cuts) for name in ("surface", "key"))
    return Arrangement(surfaces, keys, tuple(map(along, cuts)), function_of(polynomial))


class Sieve(Struct, frozen=True):
    """What tells of places of systems, for members of a batch, where what is integrated may not be smooth.

    names: what places are given by. at: the values of what is named further. parts: of each system the surfaces in it.
    face: a surface both sides of which count wherever it is.
    """

    arrangement: Arrangement
    names: tuple[str, ...]
    at: Mapping[str, Array]
    parts: tuple[tuple[int, ...], ...]
    machine: Evaluator
    face: Term | None

    def kept(self, system: Ints, member: Ints, box: Array) -> Bools:
        """Which boxes (n, 2, P) may hold places that count, of these systems and members."""
        known = self.at.keys() | set(self.names)
        sizes = np.array([len(parts) for parts in self.parts])[system]
        found = np.ones(system.size, dtype=bool)
        if not frozenset().union(*(s.free for s in self.arrangement.surfaces)) <= known:
            return found
        for size in distinct(sizes[sizes > 0]):
            here = np.nonzero(sizes == size)[0]
            parts = np.array([own if len(own) == size else (0,) * size for own in self.parts])[system[here]]
            found[here] = self._bounding(parts.T, member[here], box[:, :, here])
        return found

    def _bounding(self, parts: Ints, member: Ints, box: Array) -> Bools:
        """The same, of boxes in whose systems there are surfaces, (k, P): all of these have to be there."""
        surfaces, count = self.arrangement.surfaces, member.size
        reach = BESIDE * np.abs(np.where(np.isfinite(box), box, 0.0)).max(axis=1).sum(axis=0)
        at: dict[str, Interval] = {name: (v[member], v[member]) for name, v in self.at.items()}
        at |= {name: (box[n, 0] - reach, box[n, 1] + reach) for n, name in enumerate(self.names)}
        bounds = enclosure(surfaces, at)
        low, high = (np.stack([np.broadcast_to(ends[end], (count,)) for ends in bounds]) for end in (0, 1))
        near = ~((low > 0) | (high < 0)) | np.array([surface is self.face for surface in surfaces])[:, None]
        place = np.arange(count)
        there = near[parts, place].all(axis=0)
        near[parts, place] = False
        drawn = np.random.default_rng(0).uniform(LEAST, MOST, (len(surfaces), 1))
        sides = np.where(near, drawn, np.where(low > 0, 1.0, 0.0))
        mixed, most, still = np.zeros(count), np.zeros(count), self.machine.with_directions(0)
        for own in itertools.product((0.0, 1.0), repeat=len(parts)):
            sides[parts, place] = np.array(own)[:, None]
            env = {side(n): Cell(row) for n, row in enumerate(sides)}
            whole = as_array(number_at(self.arrangement.polynomial, still, env).v, count)
            mixed += (-1) ** int(sum(own)) * whole
            most = np.maximum(most, np.abs(whole))
        kept: Bools = there & (~(np.abs(mixed) <= CANCELLED * most) | (near.sum(axis=0) > MOST_NEAR))
        return kept


def sieve(
    arrangement: Arrangement, systems: Sequence[Critical], names: tuple[str, ...], at: Mapping[str, Array],
    machine: Evaluator, face: Term | None,
) -> Sieve:  # fmt: skip
    """The sieve for some systems."""
    number = {part: n for n, part in enumerate(arrangement.parts)}
    parts = tuple(tuple(number[e] for e in dict.fromkeys(own.equations) if e in number) for own in systems)
    return Sieve(arrangement, names, at, parts, machine, face)
