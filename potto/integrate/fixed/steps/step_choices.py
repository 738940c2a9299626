"""What nested conditions choose between, as counts: which of several values an integrand has is told along the cuts.

Owns `StepChoice`, `Alternative`, `Heads` and `choice_of`. In `if A then 1 else if B then 1 else ... 0` whichever holds
decides, and what is looked at first goes over to the rest, if it does not. Such a piece of the graph, which decides or
goes over to one other, is a head: a function of few conditions, so that it changes at few cuts. Heads that lead to the
same value, one after the other, lead to it where the number of those that do is not 0. So a union of n regions costs as
much as n cuts, where the ways through its graph are 2^n, and an intersection is what no head leads out of.
"""

from __future__ import annotations

import heapq
from collections.abc import Hashable, Mapping, Sequence
from typing import Generic, TypeVar

import numpy as np
from msgspec import Struct

from potto.calculus.decomposition.surface_cuts import face_of
from potto.core.terms import Branch, Term, postorder
from potto.kernels.cells import Bools

# Numbers of what a node leads to that is no other node: elsewhere, or to the value that is asked about.
ELSEWHERE, THERE = 0, 1
FIRST = 2  # number of the first node
Nodes = tuple[tuple[int, int, int], ...]
Surface = TypeVar("Surface", bound=Hashable)  # by its number, or by its canonical form


class Heads(Struct, Generic[Surface], frozen=True, eq=False):
    """Heads of one form. nodes: from the last to the first, which of their surfaces each asks, and what it leads to
    above and below. surfaces: those of each head."""

    nodes: tuple[tuple[int, int, int], ...]
    surfaces: tuple[tuple[Surface, ...], ...]

    def decide(self, sides: Sequence[Bools]) -> Bools:
        """Where they lead to their value, by on which sides of their surfaces that is asked."""
        found: list[Bools] = [np.zeros_like(sides[0]), np.ones_like(sides[0])]
        for surface, above, below in self.nodes:
            found.append(np.where(sides[surface], found[above], found[below]))
        return found[-1]


class Alternative(Struct, Generic[Surface], frozen=True, eq=False):
    """A value, and what leads to it."""

    value: Term
    heads: tuple[Heads[Surface], ...]


class StepChoice(Struct, Generic[Surface], frozen=True, eq=False):
    """The first of some alternatives to which something leads; else another value."""

    alternatives: tuple[Alternative[Surface], ...]
    otherwise: Term

    @property
    def values(self) -> tuple[Term, ...]:
        return (*(alternative.value for alternative in self.alternatives), self.otherwise)

    def numbered(self, numbers: Mapping[Surface, int]) -> StepChoice[int]:
        """The same with numbers for surfaces."""

        def heads(own: Heads[Surface]) -> Heads[int]:
            return Heads(own.nodes, tuple(tuple(numbers[surface] for surface in each) for each in own.surfaces))

        found = (Alternative(each.value, tuple(map(heads, each.heads))) for each in self.alternatives)
        return StepChoice(tuple(found), self.otherwise)


class _Head(Struct):
    """Its nodes, from the first to the last, and what it goes over to; None where it always decides."""

    nodes: list[Branch]
    rest: Branch | None

    def values(self) -> list[Term]:
        inside = {*self.nodes, self.rest}
        ends = (end for node in self.nodes for end in (node.then, node.orelse) if end not in inside)
        return list(dict.fromkeys(ends))


def choice_of(whole: Branch, variable: str) -> StepChoice[Term]:
    """A condition with conditions in its cases, by the canonical forms of its surfaces. What varies is one of these,
    what does not is a value."""
    place = {node: number for number, node in enumerate(postorder(whole))}
    found: list[tuple[Term, list[tuple[Nodes, tuple[Term, ...]]]]] = []
    rest: Branch | None = whole
    otherwise: Term = whole
    while rest is not None:
        head = _head(rest, place, variable)
        values, rest = head.values(), head.rest
        if rest is None:  # what the ones before lead to as well is the last that is asked for
            before = found[-1][0] if found else None
            otherwise = next((value for value in reversed(values) if value is not before), values[-1])
            values.remove(otherwise)
        for value in values:
            if not found or found[-1][0] is not value:
                found.append((value, []))
            found[-1][1].append(_form(head, value))
    return StepChoice(tuple(Alternative(value, _alike(forms)) for value, forms in found), otherwise)


def _head(first: Branch, place: Mapping[Term, int], variable: str) -> _Head:
    """From its first node as far as all ways that go on lead to one and the same."""
    waiting, seen = [(-place[first], first)], {first}
    nodes: list[Branch] = []
    while waiting and not (nodes and len(waiting) == 1):
        node = heapq.heappop(waiting)[1]
        nodes.append(node)
        for end in (node.then, node.orelse):
            if isinstance(end, Branch) and variable in end.free and end not in seen:
                seen.add(end)
                heapq.heappush(waiting, (-place[end], end))
    return _Head(nodes, waiting[0][1] if waiting else None)


def _form(head: _Head, value: Term) -> tuple[Nodes, tuple[Term, ...]]:
    """The nodes of a head as `Heads` has them, and its surfaces."""
    surfaces: dict[Term, int] = {}
    numbers: dict[Term, int] = {value: THERE}
    nodes: list[tuple[int, int, int]] = []
    for node in reversed(head.nodes):
        face, turned = face_of(node.surface)
        ends = [numbers.get(end, ELSEWHERE) for end in (node.then, node.orelse)]
        own = surfaces.setdefault(face.key, len(surfaces))
        over, under = ends if turned > 0 else ends[::-1]
        nodes.append((own, over, under))
        numbers[node] = FIRST + len(numbers) - 1
    return tuple(nodes), tuple(surfaces)


def _alike(forms: Sequence[tuple[Nodes, tuple[Term, ...]]]) -> tuple[Heads[Term], ...]:
    """Heads by their forms."""
    found: dict[Nodes, list[tuple[Term, ...]]] = {}
    for nodes, surfaces in forms:
        found.setdefault(nodes, []).append(surfaces)
    return tuple(Heads(nodes, tuple(own)) for nodes, own in found.items())
