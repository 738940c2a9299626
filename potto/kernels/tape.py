"""Tangents that are written down instead of worked out: what a number depends on, and how steeply.

Owns `Node`, `Edge`, `linear` and `leaves`. A kernel that tapes carries one tangent, a node: the linear map from the
numbers that it was made of. `sweeps` makes derivatives of it.

Nodes stand for arrays where numbers are batches: they have a shape, can be indexed, and numpy's functions that only
move members about (`MOVES`) take them. Anything else done to one raises `Untaped`, and forward mode is used.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Sequence
from types import EllipsisType
from typing import Any

import numpy as np

from potto.kernels.whole import PAIRWISE, UNIT_ROUNDOFF

Pull = Callable[[Any], Any]
Shape = tuple[int, ...]

FEW = 64  # leaves, up to which a node knows which of them it is made of

_numbers = itertools.count()


class Untaped(Exception):
    """Something was done with a tangent that a tape does not know."""


class Edge:
    """From a node to one that it was made of: `slope` times it, the slope off by `off`, and rounded itself unless it is
    `kept`; or its members moved about, by what `pull` is the adjoint of, which rounds off the part `lost` of what it
    adds up. A slope that is `fixed` does not move: where it is 0 nothing depends on the parent."""

    __slots__ = ("fixed", "kept", "lost", "off", "parent", "pull", "slope")

    def __init__(
        self, parent: Node, slope: Any = 1.0, off: Any = None, pull: Pull | None = None, kept: bool = False,
        fixed: bool = False, lost: float = 0.0,
    ) -> None:  # fmt: skip
        self.parent, self.slope, self.off, self.pull = parent, slope, off, pull
        self.kept, self.fixed, self.lost = kept, fixed, lost


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
        if self.ndim == 1 and isinstance(index, np.ndarray) and index.dtype.kind == "i":
            return Node((_picked(self, index),), shape)

        def pull(adjoint: Any) -> Any:
            whole = np.zeros(self.shape)
            np.add.at(whole, index, adjoint)
            return whole

        times = pull(1.0).max(initial=0.0)
        return Node((Edge(self, pull=pull, lost=(times - 1) * UNIT_ROUNDOFF if times > 1 else 0.0),), shape)

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
    """The sum of (slope, tangent, what the slope is off); what is not a node is 0. kept, fixed: as of `Edge`."""
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


def _picked(node: Node, index: np.ndarray) -> Edge:
    """The edge to a node of whose members some are picked, many of them often: going back, what comes to a member is
    added up in as many blocks as there are members to a place, and then in pairs, so that little is rounded off."""
    size, flat = node.size, index.ravel() % max(node.size, 1)
    blocks = max(flat.size // max(size, 1), 1)
    places = flat + size * (np.arange(flat.size) * blocks // max(flat.size, 1))

    def pull(adjoint: Any) -> Any:
        weights = np.broadcast_to(adjoint, index.shape).ravel()
        found = np.bincount(places, weights, blocks * size).reshape(blocks, size)
        return found[0] if blocks == 1 else np.add.reduce(np.ascontiguousarray(found.T), axis=1)

    times = int(np.bincount(places).max(initial=0)) - 1
    return Edge(node, pull=pull, lost=max(times, 0) * UNIT_ROUNDOFF + (PAIRWISE if blocks > 1 else 0.0))


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
    before = (slice(None),) * where

    def pull(place: int) -> Pull:
        return lambda adjoint: adjoint[(*before, place)]  # in a tenth of the time of `np.take`

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


# What nodes are made of


def leaves(nodes: Sequence[Node]) -> frozenset[Node] | None:
    """What nodes are made of member by member; None if that is more than FEW."""
    if any(node.leaves is ... for node in nodes):
        for node in in_order(nodes, by_members=True):
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
    return [node for node in in_order(nodes, by_members=True) if node.leaf]


def in_order(nodes: Iterable[Node], by_members: bool = False) -> list[Node]:
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
