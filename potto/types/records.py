"""The types of records: what their definitions make, the names of their types, and records with other fields.

A record is a tuple whose type has the name of its definition. Its definition is a function of its fields.
"""

from __future__ import annotations

from potto.diagnostics import Diagnostic
from potto.syntax import nodes
from potto.syntax.kinds import BAD_TYPE
from potto.types import kinds
from potto.types.context import Inference, Part, rule
from potto.types.mismatches import describe, no_field
from potto.types.scope import Global
from potto.types.types import UNKNOWN, Meta, RecordName, TupleOf, Type, Unknown, resolve, result_of
from potto.types.unify import open_type


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
    if isinstance(meaning, Global) and meaning.interface.broken:
        return UNKNOWN
    if isinstance(meaning, Global):
        found = result_of(meaning.interface.type)
        if isinstance(found, TupleOf) and found.record is not None and found.record.name == meaning.target.name:
            return open_type(found, inference.level)
    message, label = f"there is no type `{annotation.name}`", "not known"
    help = f"types are {known}, and records: `record {name}(x: Real)`"
    if meaning is not None:
        message, label = f"`{annotation.name}` is no record, so it is no type", "not a type"
    inference.report(BAD_TYPE(annotation.span, message, label=label, help=help))
    return UNKNOWN


@rule(nodes.With)
def _with(inference: Inference, node: nodes.With) -> Type:
    type = inference.infer(node.record)
    found = resolve(type)
    record = found.record if isinstance(found, TupleOf) else None
    places: list[int] = []
    for argument in node.arguments:
        given = inference.infer(argument.value)
        if record is None or not isinstance(found, TupleOf):
            continue
        if argument.name not in record.fields:
            name, span = argument.name or "", argument.name_span or argument.span
            inference.report(no_field(span, name, record, f"of `{record.name}`"))
            continue
        place = record.fields.index(argument.name)
        inference.expect(given, found.items[place], argument.value, f"the field `{argument.name}`")
        places.append(place)
        inference.parts.append(Part(argument.name_span or argument.span, argument.name, found, found.items[place]))
    inference.fields[id(node)] = places
    if record is None and not isinstance(found, Unknown):
        inference.report(_no_record(node, found))
        return UNKNOWN
    return type if len(places) == len(node.arguments) else UNKNOWN


def _no_record(node: nodes.With, found: Type) -> Diagnostic:
    unclear = isinstance(found, Meta)
    message = "it is not known which record this is" if unclear else f"this is {describe(found)}, not a record"
    help = "say in the head what it is: `(c: Camera)`" if unclear else "only a record has fields that `with` changes"
    return kinds.NO_FIELD(node.record.span, message, label="before `with`", help=help)
