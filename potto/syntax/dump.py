"""A tree for the eye: one node a line, with its span. Owns `dump_tree`."""

from __future__ import annotations

from typing import Any

from potto.syntax.nodes import Node
from potto.syntax.walk import children, extent


def dump_tree(node: Node) -> str:
    """One node a line, children indented under it, plain fields beside its name."""
    lines: list[str] = []
    pending: list[tuple[Node, int]] = [(node, 0)]
    while pending:
        current, level = pending.pop()
        span = extent(current)
        plain = " ".join(f"{name}={value!r}" for name, value in _plain(current))
        lines.append(f"{'  ' * level}{type(current).__name__} [{span.start}, {span.end}) {plain}".rstrip())
        pending.extend((child, level + 1) for child in reversed(children(current)))
    return "\n".join(lines)


def _plain(node: Node) -> list[tuple[str, Any]]:
    """The fields that hold words and numbers."""
    fields = ((name, getattr(node, name)) for name in type(node).__match_args__)
    return [(name, value) for name, value in fields if isinstance(value, (str, int, float, bool))]
