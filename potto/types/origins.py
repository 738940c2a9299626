"""Where a value that does not fit comes from, as places beside what is said of it."""

from __future__ import annotations

from collections.abc import Sequence

from msgspec.structs import replace

from potto.diagnostics import Diagnostic, Related
from potto.modules.texts import definition
from potto.syntax import nodes
from potto.syntax.as_written import without_parentheses
from potto.types.context import Inference
from potto.types.format import format_type
from potto.types.mismatches import BY_PARTS, differs_in_size, mismatch, sized_by
from potto.types.scope import InterfaceName, Local
from potto.types.still import lacks_tangents
from potto.types.types import Parameter, Type, holds_functions


def defined(inference: Inference, array: nodes.Expr, what: str) -> tuple[Related, ...]:
    """Where the name of an array, or of what it is a part of, gets its meaning. what: is said of a whole one."""
    array = without_parentheses(array)
    while isinstance(array, nodes.Field | nodes.Index):
        array = without_parentheses(array.value if isinstance(array, nodes.Field) else array.array)
        what = "is defined here"
    if isinstance(array, nodes.Member):
        meaning, what = inference.owners.get(id(array)) or inference.meanings.get(id(array)), "is defined here"
    else:
        meaning = inference.meanings.get(id(array))
    if isinstance(meaning, Local):
        return (Related(meaning.span, f"`{meaning.name}` {what}"),)
    if not isinstance(meaning, InterfaceName):
        return ()
    file, name = meaning.target.file, meaning.target.name
    item = definition(inference.outside.db, file, name)
    if not isinstance(item, nodes.Definition):
        return ()
    return (Related(item.name_span, f"`{name}` {what}", file, name),)


def sides(inference: Inference, *operands: tuple[nodes.Expr, Type]) -> tuple[Related, ...]:
    """For each of several values that should be alike, where it gets its type: its definition, or it itself."""
    found: list[Related] = []
    for expr, type in operands:
        shown = format_type(type)
        found += defined(inference, expr, f"is `{shown}`") or (Related(expr.span, f"`{shown}`"),)
    return tuple(dict.fromkeys(found))


def misfit(
    inference: Inference, call: nodes.Apply, place: int, parameters: Sequence[Parameter],
    slots: Sequence[Sequence[int]], types: tuple[Type, Type], what: str,
) -> Diagnostic:  # fmt: skip
    """What is said of an argument of another type than is expected. slots: the arguments of each parameter."""
    actual, expected = types
    expr = call.arguments[place].value
    others = [(p.type, slot[0]) for p, slot in zip(parameters, slots) if len(slot) == 1 and slot[0] != place]
    related = sized_by(expected, [(type, call.arguments[at].value) for type, at in others])
    if differs_in_size(actual, expected):
        which = next(at for at, slot in enumerate(slots) if place in slot)
        related = related or _declared(inference, call.function, which, parameters[which].name)
        related += defined(inference, expr, "is defined here")
    said = mismatch(actual, expected, expr, what, related)
    if not lacks_tangents(actual, expected):
        return said
    help = BY_PARTS if holds_functions(expected) else "give its tangents as well: `(value, tangents)`"
    return replace(said, help=help)


def _declared(inference: Inference, function: nodes.Expr, place: int, name: str | None) -> tuple[Related, ...]:
    """Where a parameter of a definition is declared, by its place: `name` may be a sign for a name."""
    meaning = inference.meanings.get(id(without_parentheses(function)))
    if not isinstance(meaning, InterfaceName) or name is None:
        return ()
    file, owner = meaning.target.file, meaning.target.name
    item = definition(inference.outside.db, file, owner)
    groups = item.groups if isinstance(item, nodes.Definition) else ()
    spans = [each.span for group in groups for each in group]
    spans += [each.span for each in item.fields] if isinstance(item, nodes.RecordDefinition) else []
    return tuple(Related(span, f"`{name}` is declared here", file, owner) for span in spans[place : place + 1])
