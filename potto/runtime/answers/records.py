"""Which parts of an answer are records, as its type says.

Owns `named` and `named_answer`, which give them the names of their fields.
"""

from __future__ import annotations

from typing import Any

from msgspec.structs import replace

from potto.runtime.answers.estimate import Estimate
from potto.runtime.answers.named import Named
from potto.types.types import ArrayOf, TupleOf, Type


def named_answer(estimate: Estimate, type: Type) -> Estimate:
    """An answer of a type, with what is a record in it by its names; a dual is one of a pair."""
    if not has_records(type):
        return estimate
    value = tangent = type
    if estimate.tangent is not None and isinstance(type, TupleOf) and type.dual:
        value, tangent = type.items
    return replace(estimate, value=named(estimate.value, value), tangent=named(estimate.tangent, tangent))


def named(value: Any, type: Type) -> Any:
    """A value of a type, with what is a record in it by its names; also one whose records are dicts."""
    if not has_records(type):
        return value
    if isinstance(value, dict) and isinstance(type, TupleOf) and type.record is not None:
        value = tuple([value[field] for field in type.record.fields])
    if isinstance(type, TupleOf) and isinstance(value, tuple) and len(value) == len(type.items):
        parts = [named(part, item) for part, item in zip(value, type.items, strict=True)]
        return tuple(parts) if type.record is None else Named(_called(type.record.name), type.record.fields, parts)
    if isinstance(type, ArrayOf) and isinstance(value, list):
        return [named(item, type.item) for item in value]
    return value


def has_records(type: Type) -> bool:
    """Whether what is of a type is a record, or has some in it."""
    match type:
        case TupleOf(items=items, record=record):
            return record is not None or any(map(has_records, items))
        case ArrayOf(item=item):
            return has_records(item)
        case _:
            return False


def _called(name: str) -> str:
    """What a program calls a record; the columns of a file have no name that it could write."""
    return name if name.isidentifier() else ""
