"""Tangents that are written down instead of worked out: what a number depends on, and how steeply.

Owns `Node`, `linear`, `swept`, `pushed` and `reached`. A kernel that tapes carries one tangent, a node: the linear map
from the numbers that it was made of. Swept from an answer back to the seeds, the tape gives the derivatives by all of
them, at the cost of a few values whatever their number (reverse accumulation); pushed forward, it gives tangents.

An edge keeps with its slope how far off that may be. To first order an error is then a sum over edges: the sensitivity
of the answer, along all paths without regard to sign, times what the slope is off, times how far the seeds can have
moved the parent, again without regard to sign. Two more numbers for each node are swept along for it. Where slopes are
exact and all is whole, nothing is rounded off, as in `whole`.

Nodes stand for arrays where numbers are batches: they have a shape, can be indexed, and numpy's functions that only
move members about (`MOVES`) take them. Anything else done to one raises `Untaped`, and forward mode is used.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from types import EllipsisType
from typing import Any

import numpy as np
from msgspec import Struct

from potto.kernels.whole import LARGEST, SHORT, TWICE

Pull = Callable[[Any], Any]
Shape = tuple[int, ...]
Swept = tuple[Any, Any]  # a derivative and how far off it may be

FEW = 64  # leaves, up to which a node knows which of them it is made of

_numbers = itertools.count()


class Untaped(Exception):
    """Something was done with a tangent that a tape does not know."""


class Edge:
    """From a node to one that it was made of: `slope` times it, the slope off by `off`, and rounded itself unless it is
    `kept`; or its members moved about, by what `pull` is the adjoint of. A slope that is `fixed` does not move: where
    it is 0 nothing depends on the parent."""

    __slots__ = ("fixed", "kept", "off", "parent", "pull", "slope")

    def __init__(
        self, parent: Node, slope: Any = 1.0, off: Any = None, pull: Pull | None = None, kept: bool = False,
        fixed: bool = False,
    ) -> None:  # fmt: skip
        self.parent, self.slope, self.off, self.pull = parent, slope, off, pull
        self.kept, self.fixed = kept, fixed


class Node:
    """A tangent on the tape. Without edges it is a seed. It is made of its `leaves` member by member: of seeds, and of
    what was moved about."""

    __slots__ = ("edges", "leaves", "number", "shape")

    def __init__(self, edges: Sequence[Edge], shape: Shape) -> None:
        self.edges, self.shape, self.number = edges, shape, next(_numbers)
        self.leaves: frozenset[Node] | EllipsisType | None = ...

    @property
    def leaf(self) -> bool:
        return not self.edges or self.edges[0].pull is not None

    @property
    def ndim(self) -> int:
        return len(self.shape)

    @property
    def size(self) -> int:
        return int(np.prod(self.shape))

    def __add__(self, other: Any) -> Node:
        return linear((1.0, self, None), (1.0, other, None))  # type: ignore[no-any-return]

    __radd__ = __add__

    def __getitem__(self, index: Any) -> Node:
        shape = np.broadcast_to(0.0, self.shape)[index].shape

        def pull(adjoint: Any) -> Any:
            if self.ndim == 1 and isinstance(index, np.ndarray) and index.dtype.kind == "i":
                weights = np.broadcast_to(adjoint, shape).ravel()
                return np.bincount(index.ravel() % self.size, weights, self.size)
            whole = np.zeros(self.shape)
            np.add.at(whole, index, adjoint)
            return whole

        return Node((Edge(self, pull=pull),), shape)

    def _unknown(self, *_: Any, **__: Any) -> Any:
        raise Untaped

    __float__ = __bool__ = __array__ = __neg__ = __abs__ = _unknown
    __mul__ = __rmul__ = __truediv__ = __sub__ = __rsub__ = _unknown

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **given: Any) -> Any:
        if ufunc is not np.add or method not in ("__call__", "reduce"):
            raise Untaped
        if method == "__call__":
            return linear(*((1.0, x, None) for x in inputs))
        axis = given.get("axis", 0) % self.ndim

        def pull(adjoint: Any) -> Any:
            return np.broadcast_to(np.expand_dims(adjoint, axis), self.shape)

        return Node((Edge(self, pull=pull),), self.shape[:axis] + self.shape[axis + 1 :])

    def __array_function__(self, function: Any, _: Any, args: Any, given: Any) -> Any:
        move = MOVES.get(function)
        if move is None:
            raise Untaped
        return move(*args, **given)


def linear(*edges: tuple[Any, Any, Any], kept: bool = False, fixed: bool = False) -> Any:
    """The sum of (slope, tangent, what the slope is off); what is no node is 0. kept, fixed: as of `Edge`."""
    made: list[Edge] = []
    shape: Shape = ()
    for slope, parent, off in edges:
        if parent.__class__ is Node:
            made.append(Edge(parent, slope, off, kept=kept, fixed=fixed))
            if parent.shape or not isinstance(slope, float):
                shape = np.broadcast_shapes(shape, np.shape(slope), parent.shape)
        elif parent is not None and np.any(np.asarray(parent) != 0):
            raise Untaped
    return Node(made, shape) if made else 0.0


def multiples(*edges: tuple[Any, Any, Any]) -> Any:
    """The sum of numbers as they are times tangents, as `linear`."""
    return linear(*edges, kept=True)


def scaled(edge: tuple[Any, Any, Any]) -> Any:
    """A tangent times a number that does not move."""
    return linear(edge, kept=True, fixed=True)


def scattered(masks: Sequence[Any], rows: Sequence[Any], shape: Shape) -> Any:
    """Rows put together again, each at the members of its mask."""

    def pull(mask: Any) -> Pull:
        return lambda adjoint: adjoint[mask]

    parts = [(_broadcast(row, (int(mask.sum()),)), mask) for row, mask in zip(rows, masks, strict=True)]
    return Node([Edge(row, pull=pull(mask)) for row, mask in parts if isinstance(row, Node)], shape)


# What numpy's functions do to nodes


def _broadcast(x: Any, shape: Shape) -> Any:
    """A node of this shape; its members are repeated, which sweeps see by themselves."""
    return x if not isinstance(x, Node) or x.shape == tuple(shape) else Node((Edge(x),), tuple(shape))


def _where(mask: Any, a: Any, b: Any) -> Any:
    def pull(kept: Any) -> Pull:
        return lambda adjoint: np.where(kept, adjoint, 0.0)

    shape = np.broadcast_shapes(np.shape(mask), *(x.shape for x in (a, b) if isinstance(x, Node)))
    sides = [(_broadcast(x, shape), kept) for x, kept in ((a, mask), (b, ~mask)) if isinstance(x, Node)]
    return Node([Edge(x, pull=pull(kept)) for x, kept in sides], shape)


def _stack(parts: Sequence[Any], axis: int = 0) -> Any:
    shape = np.broadcast_shapes(*(np.shape(x) for x in parts))
    where = axis % (len(shape) + 1)
    whole = (*shape[:where], len(parts), *shape[where:])

    def pull(place: int) -> Pull:
        return lambda adjoint: np.take(adjoint, place, axis=where)

    return Node([Edge(_broadcast(x, shape), pull=pull(i)) for i, x in enumerate(parts) if isinstance(x, Node)], whole)


def _broadcast_arrays(*parts: Any) -> list[Any]:
    shape = np.broadcast_shapes(*(np.shape(x) for x in parts))
    return [_broadcast(x, shape) if isinstance(x, Node) else np.broadcast_to(x, shape) for x in parts]


def _moveaxis(x: Node, source: Any, destination: Any) -> Node:
    shape = np.moveaxis(np.broadcast_to(0.0, x.shape), source, destination).shape

    def pull(adjoint: Any) -> Any:
        return np.moveaxis(np.broadcast_to(adjoint, shape), destination, source)

    return Node((Edge(x, pull=pull),), shape)


def _reshape(x: Node, shape: Shape) -> Node:
    shape = np.broadcast_to(0.0, x.shape).reshape(shape).shape

    def pull(adjoint: Any) -> Any:
        return np.reshape(np.broadcast_to(adjoint, shape), x.shape)

    return Node((Edge(x, pull=pull),), shape)


MOVES: dict[Any, Callable[..., Any]] = {
    np.broadcast_to: _broadcast,
    np.broadcast_arrays: _broadcast_arrays,
    np.where: _where,
    np.stack: _stack,
    np.moveaxis: _moveaxis,
    np.reshape: _reshape,
    np.shape: lambda x: x.shape,
    np.ndim: lambda x: x.ndim,
}


# Sweeps


def leaves(nodes: Sequence[Node]) -> frozenset[Node] | None:
    """What nodes are made of member by member; None if that is more than FEW."""
    if any(node.leaves is ... for node in nodes):
        for node in _in_order(nodes, by_members=True):
            if node.leaves is ...:
                node.leaves = frozenset((node,)) if node.leaf else _union([edge.parent for edge in node.edges])
    return _union(nodes)


def _union(nodes: Iterable[Node]) -> frozenset[Node] | None:
    found: frozenset[Node] = frozenset()
    for node in nodes:
        if node.leaves is None or node.leaves is ...:
            return None
        if not node.leaves <= found:
            found |= node.leaves
    return found if len(found) <= FEW else None


def every_leaf(nodes: Sequence[Node]) -> list[Node]:
    """What nodes are made of member by member, however much that is."""
    return [node for node in _in_order(nodes, by_members=True) if node.leaf]


def _in_order(nodes: Iterable[Node], by_members: bool = False) -> list[Node]:
    """All that nodes are made of, each after its parents; as far as members are not moved about."""
    seen = set(nodes)
    todo = list(seen)
    while todo:
        node = todo.pop()
        for edge in () if by_members and node.leaf else node.edges:
            if edge.parent not in seen:
                seen.add(edge.parent)
                todo.append(edge.parent)
    return sorted(seen, key=lambda node: node.number)


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
    sums: dict[Node, Accumulated] = {}
    for node, weight in answers:
        _gather(sums, node, Accumulated(weight, abs(weight), 0.0, _is_whole(weight)))
    marks: dict[Node, Any] = {}

    def used(node: Node) -> Any:
        if not marks:
            marks.update(_marked((node, np.not_equal(weight, 0)) for node, weight in answers))
        return marks[node]

    found: dict[Node, Swept] = {}
    order = _in_order([node for node, _ in answers])
    most = _largest(order, len(answers))
    for node in reversed(order):
        own = sums.pop(node)
        if not node.edges:
            nowhere = np.isnan(own.value)
            found[node] = own.value, np.where(nowhere, np.inf, own.error) if np.any(nowhere) else own.error
        for edge in node.edges:
            pull = edge.pull
            if pull is None:
                _gather(sums, edge.parent, _along(edge, own, most, partial(used, node)))
            else:
                _gather(sums, edge.parent, Accumulated(pull(own.value), pull(own.size), pull(own.error), own.whole))
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
    for node in reversed(_in_order(marks)):
        own = marks[node]
        for edge in node.edges:
            there = own & np.not_equal(edge.slope, 0) if edge.fixed else own
            mark(edge.parent, there if edge.pull is None else edge.pull(own.astype(float)))
    return marks


def pushed(nodes: Sequence[Node], directions: Sequence[Node]) -> list[list[Swept]]:
    """For each node its tangents in the direction of each leaf, and how far off they may be; None where it has none."""
    known: dict[Node, list[Accumulated | None]] = {}
    order = _in_order(nodes, by_members=True)
    most = _largest(order)
    for node in order:
        known[node] = [None if node is not leaf else Accumulated(1.0, 1.0, 0.0, True) for leaf in directions]
        for edge in () if node.leaf else node.edges:
            for d, tangent in enumerate(known[edge.parent]):
                if tangent is not None:
                    own, more = known[node][d], _along(edge, tangent, most)
                    known[node][d] = more if own is None else own + more
    return [[(None, None) if x is None else (x.value, x.error) for x in known[node]] for node in nodes]


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
        part = Accumulated(value, size, error, part.whole)
    known = sums.get(node)
    sums[node] = part if known is None else known + part


def _fitted(part: Any, shape: Shape) -> Any:
    """An adjoint in the shape of its node: summed over the axes along which that was repeated."""
    own = np.shape(part)
    if own == shape:
        return part
    if len(own) > len(shape):
        part = np.sum(part, axis=tuple(range(len(own) - len(shape))))
    repeated = tuple(i for i, (n, m) in enumerate(zip(np.shape(part), shape[len(shape) - np.ndim(part) :], strict=True))
                     if m == 1 and n != 1)  # fmt: skip
    if repeated:
        part = np.sum(part, axis=repeated, keepdims=True)
    return np.broadcast_to(part, shape) if shape else float(part)


def _times(slope: Any, adjoint: Any, used: Callable[[], Any] = lambda: False) -> Any:
    """A slope times an adjoint; 0 where the answer does not depend on the number, however steep that is there. Where it
    does, and has a slope of 0 by it as sqrt(x)^2 by sqrt(x) at 0, there is no telling."""
    found = slope * adjoint
    if isinstance(found, float):
        return 0.0 if found != found and adjoint == 0 and not used() else found
    wrong = np.isnan(found)
    return np.where(wrong & (np.asarray(adjoint) == 0) & ~used(), 0.0, found) if wrong.any() else found
