"""The types of records: what their definitions make, the names of their types, and records with other fields.

A record is a tuple whose type has the name of its definition. Its definition is a function of its fields.
"""

from __future__ import annotations

from potto.diagnostics import Diagnostic
from potto.modules.lookup import DefinitionTarget
from potto.modules.lookup import resolve as resolve_name
from potto.modules.texts import definition
from potto.reports.near import did_you_mean, instead, near_names
from potto.syntax import nodes
from potto.syntax.habits import ARRAY_TYPE, ARRAYS
from potto.syntax.kinds import BAD_TYPE
from potto.types import kinds
from potto.types.context import Inference, NamedPart, rule
from potto.types.mismatches import describe, no_field
from potto.types.scope import InterfaceName, Meaning, RecursiveName, names_at_top
from potto.types.types import UNKNOWN, Meta, RecordName, TupleOf, Type, Unknown, resolve, result_of
from potto.types.unify import open_type

_NUMBERS = ("float", "double", "real", "number", "int", "f64", "f32", "scalar", "ℝ")


def labelled(item: nodes.Definition, file: str, body: Type) -> Type:
    """The type of what the definition of a record makes; of any other definition, its body's."""
    found = resolve(body)
    if not isinstance(item.result, nodes.NamedType) or item.result.name != item.name or not isinstance(found, TupleOf):
        return body
    fields = tuple(parameter.name for group in item.groups for parameter in group)
    return TupleOf(found.items, record=RecordName(file, item.name, fields))


def named_type(inference: Inference, annotation: nodes.NamedType, known: str) -> Type:
    """The record that the name of a type means."""
    path, _, name = annotation.name.rpartition(".")
    meaning = inference.outside.find(path or None, name)
    if isinstance(meaning, InterfaceName) and meaning.interface.broken:
        return UNKNOWN
    if isinstance(meaning, InterfaceName):
        found = result_of(meaning.interface.type)
        if isinstance(found, TupleOf) and found.record is not None and found.record.name == meaning.target.name:
            return open_type(found, inference.level)
    if isinstance(meaning, RecursiveName) and _is_record(inference, meaning.target):
        inference.report(_within_itself(inference, annotation, meaning.target))
    else:
        inference.report(_no_type(inference, annotation, meaning, known))
    return UNKNOWN


def _is_record(inference: Inference, target: DefinitionTarget) -> bool:
    """Whether a definition makes a record, which is called as it is."""
    item = definition(inference.outside.db, target.file, target.name)
    result = item.result if isinstance(item, nodes.Definition) else None
    return isinstance(result, nodes.NamedType) and result.name == target.name


def _within_itself(inference: Inference, annotation: nodes.NamedType, target: DefinitionTarget) -> Diagnostic:
    message = f"a record cannot contain itself: `{target.name}` is a field of `{target.name}`"
    if len(inference.members) > 1:
        names = ", ".join(f"`{member.name}`" for member in sorted(inference.members, key=lambda member: member.name))
        message = f"records cannot contain each other: {names}"
    help = "keep them in an array, and let a number say which one is meant"
    return kinds.WITHIN_ITSELF(annotation.span, message, label="would have no end", help=help)


def _no_type(inference: Inference, annotation: nodes.NamedType, meaning: Meaning | None, known: str) -> Diagnostic:
    name = annotation.name
    message, label, near = f"there is no type `{name}`", "not known", tuple[str, ...]()
    if meaning is not None:
        message, label = f"`{name}` is not a record, so it is not a type", "not a type"
    else:
        near = ("Real",) if name.lower() in _NUMBERS else _near(inference, name)
    leaf = name.rpartition(".")[2]
    if name in ARRAYS:
        return BAD_TYPE(annotation.span, message, label=label, help=ARRAY_TYPE)
    help = did_you_mean(near) or f"types are {known}, and records: `record {leaf}(x: Real)`"
    return BAD_TYPE(annotation.span, message, label=label, help=help, suggestions=instead(annotation.span, near))


def _near(inference: Inference, name: str) -> tuple[str, ...]:
    """The records of the file that a name may have been meant to be."""
    db, file = inference.outside.db, inference.outside.file
    found = near_names(name, names_at_top(db, file), 8)
    records: list[str] = []
    for near in found:
        target = resolve_name(db, file, near)
        if isinstance(target, DefinitionTarget) and _is_record(inference, target):
            records.append(near)
    return tuple(records[:2])


@rule(nodes.With)
def _with(inference: Inference, node: nodes.With) -> Type:
    type = inference.infer(node.record)
    found = resolve(type)
    record = found.record if isinstance(found, TupleOf) else None
    places: list[int] = []
    named = {argument.name for argument in node.arguments}
    for argument in node.arguments:
        given = inference.infer(argument.value)
        if record is None or not isinstance(found, TupleOf):
            continue
        if argument.name not in record.fields:
            name, span = argument.name or "", argument.name_span or argument.span
            inference.report(no_field(inference.outside, span, name, record, named))
            continue
        place = record.fields.index(argument.name)
        inference.expect(given, found.items[place], argument.value, f"the field `{argument.name}`")
        places.append(place)
        inference.parts.append(NamedPart(argument.name_span or argument.span, argument.name, found, found.items[place]))
    inference.fields[id(node)] = places
    if record is None and not isinstance(found, Unknown):
        inference.report(_no_record(node, found))
        return UNKNOWN
    return type if len(places) == len(node.arguments) else UNKNOWN


def _no_record(node: nodes.With, found: Type) -> Diagnostic:
    unclear = isinstance(found, Meta)
    message = "it is not known which record this is" if unclear else f"this is {describe(found)}, not a record"
    help = "say in the head what it is: `(c: Camera)`" if unclear else "only a record has fields that `with` changes"
    return kinds.NO_RECORD(node.record.span, message, label="before `with`", help=help)
