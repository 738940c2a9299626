"""Derivatives from a tape: swept from an answer back to the seeds, or pushed forward along a few of them.

Owns `swept`, `adjoints`, `pushed` and `reached`. Swept back, a tape gives the derivatives by all seeds at the cost of a
few values whatever their number (reverse accumulation); pushed forward, it gives tangents.

An edge keeps with its slope how far off that may be. To first order an error is then a sum over edges: the sensitivity
of the answer, along all paths without regard to sign, times what the slope is off, times how far the seeds can have
moved the parent, again without regard to sign. Two more numbers for each node are swept along for it. Where slopes are
exact and all is whole, nothing is rounded off, as in `whole`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any

import numpy as np
from msgspec import Struct

from potto.kernels.tape import Edge, Node, Pull, Shape, in_order
from potto.kernels.whole import LARGEST, PAIRWISE, SHORT, TWICE

Swept = tuple[Any, Any]  # a derivative and how far off it may be


class Accumulated(Struct, frozen=True):
    """What has come together so far: its value, the same along all paths without regard to sign, how far off it may
    be, and whether it is made of whole numbers, so that nothing was rounded off yet."""

    value: Any
    size: Any
    error: Any
    whole: bool

    def __add__(self, other: Accumulated) -> Accumulated:
        value, size, error = self.value + other.value, self.size + other.size, self.error + other.error
        if self.whole is not other.whole:  # the others have counted what this sum rounds off
            error = error + TWICE * (self.size if self.whole else other.size)
        return Accumulated(value, size, error, self.whole and other.whole)


def swept(answers: Sequence[tuple[Node, Any]]) -> dict[Node, Swept]:
    """The derivatives of a sum of answers, each times a weight, by every seed, and how far off they may be."""
    found: dict[Node, Swept] = {}
    whole = [(node, Accumulated(weight, abs(weight), 0.0, _is_whole(weight))) for node, weight in answers]
    for seed, own in adjoints(whole).items():
        nowhere = own.value != own.value
        found[seed] = own.value, np.where(nowhere, np.inf, own.error) if np.any(nowhere) else own.error
    return found


def adjoints(answers: Sequence[tuple[Node, Accumulated]]) -> dict[Node, Accumulated]:
    """What comes to every seed of what is known of answers: of derivatives by them that are off, how far these of the
    seeds are."""
    sums: dict[Node, Accumulated] = {}
    for node, part in answers:
        _gather(sums, node, part)
    marks: dict[Node, Any] = {}

    def used(node: Node) -> Any:
        if not marks:
            marks.update(_marked((node, np.not_equal(part.value, 0)) for node, part in answers))
        return marks[node]

    found: dict[Node, Accumulated] = {}
    order = in_order([node for node, _ in answers])
    most = _largest(order, len(answers))
    for node in reversed(order):
        own = sums.pop(node)
        if not node.edges:
            found[node] = own
        for edge in node.edges:
            pull = edge.pull
            if pull is None:
                _gather(sums, edge.parent, _along(edge, own, most, partial(used, node)))
            else:
                _gather(sums, edge.parent, _pulled(pull, edge.lost, own))
    return found


def reached(nodes: Iterable[tuple[Node, Any]]) -> dict[Node, Any]:
    """The seeds that these members of nodes are made of, and which members of them, however steeply."""
    return {node: own for node, own in _marked(nodes).items() if not node.edges}


def _marked(nodes: Iterable[tuple[Node, Any]]) -> dict[Node, Any]:
    """All nodes that these members of some are made of, and which members of them."""
    marks: dict[Node, Any] = {}

    def mark(node: Node, part: Any) -> None:
        own = np.asarray(_fitted(np.asarray(part, dtype=float), node.shape)) > 0
        marks[node] = own | marks[node] if node in marks else own

    for node, members in nodes:
        mark(node, members)
    for node in reversed(in_order(marks)):
        own = marks[node]
        for edge in node.edges:
            there = own & np.not_equal(edge.slope, 0) if edge.fixed else own
            mark(edge.parent, there if edge.pull is None else edge.pull(own.astype(float)))
    return marks


def pushed(nodes: Sequence[Node], directions: Sequence[Node]) -> list[list[Swept]]:
    """For each node its tangents in the direction of each leaf, and how far off they may be; None where it has none."""
    known: dict[Node, list[Accumulated | None]] = {}
    order = in_order(nodes, by_members=True)
    most = _largest(order)
    for node in order:
        known[node] = [None if node is not leaf else Accumulated(1.0, 1.0, 0.0, True) for leaf in directions]
        for edge in () if node.leaf else node.edges:
            for d, tangent in enumerate(known[edge.parent]):
                if tangent is not None:
                    own, more = known[node][d], _along(edge, tangent, most)
                    known[node][d] = more if own is None else own + more
    return [[(None, None) if x is None else (x.value, x.error) for x in known[node]] for node in nodes]


def _pulled(pull: Pull, lost: float, x: Accumulated) -> Accumulated:
    """What comes to the parent of a node whose members were moved about."""
    value, size, error = pull(x.value), pull(x.size), pull(x.error)
    return Accumulated(value, size, error, True) if x.whole else Accumulated(value, size, error + lost * size, False)


def _along(edge: Edge, x: Accumulated, most: float, used: Callable[[], Any] = lambda: True) -> Accumulated:
    """What comes to the other end of an edge, in either direction. used: which members anything depends on."""
    slope, whole = edge.slope, x.whole and edge.kept
    if slope.__class__ is float and slope == 1.0 and edge.off is None:
        whole = whole and bool(np.all(x.size <= most))
        return Accumulated(x.value, x.size, x.error if whole else x.error + TWICE * x.size, whole)
    steep = abs(slope)
    size = _times(steep, x.size)
    whole = whole and _is_whole(slope) and bool(np.all(size <= most))
    error = _times(steep, x.error) if whole else _times(steep, x.error) + TWICE * size
    return Accumulated(
        _times(slope, x.value, used), size, error if edge.off is None else error + _times(edge.off, x.size), whole
    )


def _largest(nodes: Sequence[Node], more: int = 0) -> float:
    """Whole numbers up to which all that comes together at a node can be added up as it is."""
    return LARGEST / (SHORT * sum([len(node.edges) for node in nodes], 1 + more))


def _is_whole(x: Any) -> bool:
    """Whether all of this are whole numbers; large arrays are not looked through."""
    if x.__class__ is float:
        return x.is_integer()
    return np.size(x) <= SHORT and bool(np.all(np.rint(x) == x))


def _gather(sums: dict[Node, Accumulated], node: Node, part: Accumulated) -> None:
    """Add what comes to a node: its adjoint, the same along all paths without regard to sign, and its error."""
    if node.shape or not isinstance(part.value, float):
        value, size, error = (_fitted(x, node.shape) for x in (part.value, part.size, part.error))
        several = not part.whole and np.size(part.size) > max(np.size(size), 1)
        part = Accumulated(value, size, error + PAIRWISE * size if several else error, part.whole)
    known = sums.get(node)
    sums[node] = part if known is None else known + part


def _fitted(part: Any, shape: Shape) -> Any:
    """An adjoint in the shape of its node: summed over the axes along which that was repeated."""
    own = np.shape(part)
    if own == shape:
        return part
    more = len(own) - len(shape)
    repeated = [i for i, n in enumerate(own) if i < more or (shape[i - more] == 1 and n != 1)]
    if repeated:
        part = _added_up(part, repeated).reshape([1 if i in repeated else n for i, n in enumerate(own)][max(more, 0) :])
    return np.broadcast_to(part, shape) if shape else float(part)


def _added_up(part: np.ndarray, axes: Sequence[int]) -> np.ndarray:
    """The sum over some axes, in pairs: as numpy adds up what lies side by side in memory."""
    kept = [i for i in range(part.ndim) if i not in axes]
    rows = np.ascontiguousarray(part.transpose(*kept, *axes)).reshape(*(part.shape[i] for i in kept), -1)
    return np.asarray(np.add.reduce(rows, axis=-1))


def _times(slope: Any, adjoint: Any, used: Callable[[], Any] = lambda: False) -> Any:
    """A slope times an adjoint; 0 where the answer does not depend on the number, however steep that is there. Where it
    does, and has a slope of 0 by it as sqrt(x)^2 by sqrt(x) at 0, there is no telling."""
    found = slope * adjoint
    if isinstance(found, float):
        return 0.0 if found != found and adjoint == 0 and not used() else found
    wrong = np.isnan(found)
    return np.where(wrong & (np.asarray(adjoint) == 0) & ~used(), 0.0, found) if wrong.any() else found
