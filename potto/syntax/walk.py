"""Ways over a syntax tree that need not know its kinds of nodes.

Owns `children`, `walk`, `deeper_than`, `extent`, `node_at` and `without_spans`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, TypeVar

from potto.source import NOWHERE, Span
from potto.syntax import nodes
from potto.syntax.nodes import Node

_Any = TypeVar("_Any")
_CLASSES: frozenset[type] = frozenset(
    found for found in vars(nodes).values() if isinstance(found, type) and hasattr(found, "__match_args__")
) - {Span}


def _inner_fields(kind: Any) -> tuple[str, ...]:
    """The fields of a kind of node that can hold nodes."""
    plain = ("Span", "str", "float", "int", "bool", "Span | None", "str | None")
    return tuple(
        name
        for name, told in kind.__annotations__.items()
        if told not in plain and not str(told).startswith(("Literal", "tuple[str"))
    )


_INNER = {kind: _inner_fields(kind) for kind in _CLASSES}


def children(node: Node) -> tuple[Node, ...]:
    """The nodes directly under one, in the order of the text."""
    out: list[Node] = []
    for name in _INNER[type(node)]:
        _gather(getattr(node, name), out)
    return tuple(out)


def _gather(value: Any, out: list[Node]) -> None:
    if type(value) in _CLASSES:
        out.append(value)
    elif isinstance(value, tuple):
        for item in value:
            _gather(item, out)


def walk(node: Node) -> Iterator[Node]:
    """A node and all under it, each before its children, in the order of the text."""
    pending = [node]
    while pending:
        current = pending.pop()
        yield current
        pending.extend(reversed(children(current)))


def deeper_than(node: Node, limit: int) -> Node | None:
    """The first node that lies deeper than `limit` levels, or None. Operands and arguments count for nothing."""
    pending = [(node, 1)]
    while pending:
        current, level = pending.pop()
        if level > limit:
            return current
        step = 0 if isinstance(current, (nodes.Operand, nodes.Argument, nodes.Binding)) else 1
        pending.extend((child, level + step) for child in reversed(children(current)))
    return None


def extent(node: Node) -> Span:
    """Where a node stands; an operand with the operator in front of it."""
    return node.op_span.cover(node.value.span) if isinstance(node, nodes.Operand) else node.span


def node_at(node: Node, offset: int) -> tuple[Node, ...]:
    """The nodes whose extent holds an offset (its end included), outermost first; empty if the node itself does not."""
    path: list[Node] = []
    pending = [node]
    while pending:
        for candidate in pending:
            place = extent(candidate)
            if place.start <= offset <= place.end:
                path.append(candidate)
                pending = list(children(candidate))
                break
        else:
            break
    return tuple(path)


def without_spans(node: _Any) -> _Any:
    """The same tree with every span at 0, so that trees of different texts compare."""
    if isinstance(node, tuple):
        return tuple(without_spans(item) for item in node)  # type: ignore[return-value]
    if isinstance(node, Span):
        return NOWHERE  # type: ignore[return-value]
    if type(node) not in _CLASSES:
        return node
    names: tuple[str, ...] = type(node).__match_args__  # type: ignore[attr-defined]
    return type(node)(*(without_spans(getattr(node, name)) for name in names))
