"""What callers see of a function: its groups of parameters, also where it is a definition of another file.

Owns `signature`, a projection of a definition's interface that stands still when a body edit changes no parameter,
`unnamed`, which stands still when they are renamed as well, and `groups_of_term`, the same for any core term: partial
applications lack the groups that are given, derivatives have a `d` in front of each name.
"""

from __future__ import annotations

from msgspec import Struct
from msgspec.structs import replace

from potto.core.terms import App, Deriv, Global, Lam, Term, stem
from potto.elaborate.values import Groups, Slot
from potto.modules.texts import definition
from potto.query import Database, query
from potto.syntax import nodes
from potto.types import interface
from potto.types.types import Diffeo, TupleOf, Type, dual_name, groups_of, resolve, result_of

_FUNCTIONS = frozenset({Lam, Global, App, Deriv})  # terms that can be functions


class CoreSignature(Struct, frozen=True):
    """The parameters of a definition, group by group; `dims` is the size of its result if that is a tuple. `record`: it
    is that of a record, which puts its arguments together. `derivative`: that of nothing but a derivative."""

    groups: Groups
    dims: int | None = None
    record: bool = False
    derivative: bool = False


@query(travels=True)
def signature(db: Database, file: str, name: str) -> CoreSignature | None:
    """The signature of a definition, through aliases, imports, `deriv` and partial application; None if there is none.

    A value that is not a function has no groups.
    """
    item = definition(db, file, name)
    if item is None:
        return None
    found = interface(db, file, name)
    type = found.type
    groups = tuple(tuple(Slot(p.name, _dims(p.type)) for p in group) for group in groups_of(type))
    made = result_of(type)
    record = made.record if isinstance(made, TupleOf) else None
    named = record is not None and (record.file, record.name) == (file, name)
    return CoreSignature(groups or _written(item), _dims(made), named, found.derivative)


@query(travels=True, cuts=True)
def unnamed(db: Database, file: str, name: str) -> CoreSignature | None:
    """The signature without names: all that matters to a call without keywords."""
    found = signature(db, file, name)
    if found is None:
        return None
    return replace(found, groups=tuple(tuple(Slot(None, slot.dims) for slot in group) for group in found.groups))


def _dims(type: Type) -> int | None:
    found = resolve(type)
    if isinstance(found, TupleOf):
        return len(found.items)
    return found.dims if isinstance(found, Diffeo) else None


def _written(item: nodes.Definition | nodes.DiffeoDefinition) -> Groups:
    """The parameters as they are written, for a definition whose type could not be found."""
    groups = item.groups if isinstance(item, nodes.Definition) else (item.variables, *item.groups)
    return tuple(tuple(Slot(parameter.name) for parameter in group) for group in groups)


def groups_of_term(db: Database, term: Term, named: bool = True) -> Groups:
    """The parameters that a term takes, as far as they are known; empty for anything else. named: with the names that
    they have in definitions."""
    if type(term) not in _FUNCTIONS:  # as most
        return ()
    match term:
        case Lam(params=params, body=body):
            return (tuple(Slot(stem(name)) for name in params), *groups_of_term(db, body, named))
        case Global(module=file, name=name):
            found = signature(db, file, name) if named else unnamed(db, file, name)
            return () if found is None else found.groups
        case App(function=function):
            return groups_of_term(db, function, named)[1:]
        case Deriv(function=function):
            return tuple(
                tuple(Slot(None if slot.name is None else dual_name(slot.name)) for slot in group)
                for group in groups_of_term(db, function, named)
            )
        case _:
            return ()


def dims_of_term(db: Database, term: Term) -> int | None:
    """The size of the tuple that a term stands for, if it is a call of a definition that gives one."""
    head, calls = term, 0
    while isinstance(head, App):
        head, calls = head.function, calls + 1
    if not isinstance(head, Global):
        return None
    found = unnamed(db, head.module, head.name)
    return found.dims if found is not None and len(found.groups) <= calls else None
