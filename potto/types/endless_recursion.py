"""Recursion that nothing ends: a definition that always needs itself again.

A call of a definition that is being defined must stand in a branch of a plain conditional. A bracket does not end a
recursion: both of its branches are looked at, to know how it jumps.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from potto.diagnostics import Diagnostic, Related
from potto.modules.graph import components
from potto.modules.lookup import DefinitionTarget
from potto.syntax import nodes
from potto.syntax.nodes import Node
from potto.syntax.walk import children
from potto.types import kinds
from potto.types.context import Inference
from potto.types.scope import RecursiveName

Mention = nodes.Name | nodes.Member
Found = Mapping[DefinitionTarget, tuple[Diagnostic, ...]]


def endless(items: Mapping[DefinitionTarget, Node], inferences: Mapping[DefinitionTarget, Inference]) -> Found:
    """The messages, per definition, about recursion outside of any plain condition."""
    needs: dict[DefinitionTarget, dict[DefinitionTarget, Mention]] = {}
    for target, item in items.items():
        for reference, needed in _unguarded(item, inferences[target]):
            needs.setdefault(target, {}).setdefault(needed, reference)
    found: dict[DefinitionTarget, tuple[Diagnostic, ...]] = {}
    for group in components(needs, lambda target: needs.get(target, {})):
        for target in group:
            inside = [needed for needed in needs.get(target, {}) if needed in group]
            if inside and (len(group) > 1 or target in inside):
                found[target] = (_message(target, needs[target][inside[0]], inside[0], items[target]),)
    return found


def _unguarded(item: Node, inference: Inference) -> Iterator[tuple[Mention, DefinitionTarget]]:
    """The references to definitions of the group outside of the branches of plain conditionals."""
    stack: list[Node] = [item]
    while stack:
        node = stack.pop()
        if isinstance(node, nodes.If) and inference.conditions.get(id(node)) == "plain":
            stack.append(node.condition)
            continue
        if isinstance(node, nodes.Name | nodes.Member):
            meaning = inference.meanings.get(id(node))
            if isinstance(meaning, RecursiveName):
                yield node, meaning.target
        stack.extend(reversed(children(node)))


def _message(target: DefinitionTarget, reference: Mention, needed: DefinitionTarget, item: Node) -> Diagnostic:
    what = "itself" if needed == target else f"`{needed.name}`, which needs it,"
    function = not isinstance(item, nodes.Definition) or bool(item.groups)
    help = (
        "end it by a condition on a parameter: `if n > 0 then … else …`"
        if function
        else "a value cannot be defined by itself: make it a function, `def f(n) …`"
    )
    name_span = item.name_span if isinstance(item, nodes.Definition | nodes.DiffeoDefinition) else reference.span
    return kinds.ENDLESS(
        reference.span,
        f"`{target.name}` always needs {what} again: no plain condition ends the recursion",
        label="needed in every case",
        related=(Related(name_span, f"`{target.name}` is defined here"),),
        help=help,
    )
