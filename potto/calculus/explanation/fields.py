"""Parts of records by the names of their fields.

Owns `named_fields`, and `fields_of` for the parameters of a function. Core terms know places only: `camera.focal` is
part 1 of a tuple, and programs can't write it so.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from potto.core.copies import plainly_bound
from potto.core.printer import format_term
from potto.core.terms import (
    ZERO,
    App,
    Deriv,
    Fold,
    Global,
    Index,
    Proj,
    Term,
    Tuple,
    Var,
    app,
    children,
    global_,
    postorder,
    rebuild,
    tuple_,
    var,
)
from potto.query import Database
from potto.types import Type, groups_of, interface
from potto.types.types import UNKNOWN, ArrayOf, Function, TupleOf, resolve, result_of


def fields_of(db: Database, type: Type | None) -> Callable[[Term], Term]:
    """What gives the fields of records their names in a term over the parameters of a function of a type."""
    known = parameter_types(type) if type is not None else {}
    return lambda term: named_fields(db, term, known)


def parameter_types(type: Type) -> dict[str, Type]:
    """The types of a function's parameters, and of their tangents, which have the same form."""
    known = {p.name: p.type for group in groups_of(type) for p in group if p.name}
    return {f"d{name}": found for name, found in known.items()} | known


def named_fields(db: Database, term: Term, parameters: Mapping[str, Type]) -> Term:
    """The same with the fields of records as names: `camera.focal` is a variable of that name."""
    term = plainly_bound(term)
    types: dict[Term, Type | None] = {}
    memo: dict[Term, Term] = {}
    parameters = {**parameters, **_states(db, term, parameters)}
    for node in postorder(term):
        types[node] = found = _type(db, node, types, parameters)
        new = rebuild(node, tuple(memo[c] for c in children(node)))
        if isinstance(node, Proj) and isinstance(new, Proj):
            whole = types[node.term]
            if isinstance(whole, TupleOf) and whole.record is not None and found is not None:
                new = var(f"{format_term(new.term)}.{whole.record.fields[node.index]}")
        memo[node] = _with_records(db, new) if isinstance(new, App) else new
    return memo[term]


def _states(db: Database, term: Term, parameters: Mapping[str, Type]) -> dict[str, Type]:
    """The types of the states of folds, which are those of the first ones."""
    folds = [node for node in postorder(term) if isinstance(node, Fold)]
    known: dict[str, Type] = {}
    for fold in reversed(folds):  # what is outside first
        types: dict[Term, Type | None] = {}
        for node in postorder(fold.start):
            types[node] = _type(db, node, types, {**parameters, **known})
        found = types[fold.start]
        if found is not None:
            known[fold.state] = found
    return known


def _with_records(db: Database, call: App) -> Term:
    """A call of a definition with the records it takes made by their names."""
    head = call.function.function if isinstance(call.function, Deriv) else call.function
    if not isinstance(head, Global):
        return call
    groups = groups_of(interface(db, head.module, head.name).type)
    if not groups or len(groups[0]) != len(call.args):
        return call
    args = [
        _record(arg, resolve(p.type), call.function is not head) for arg, p in zip(call.args, groups[0], strict=True)
    ]
    return app(call.function, tuple(args))


def _record(arg: Term, type: Type, dual: bool) -> Term:
    """A tuple as the record that is wanted; `dual`: the value and the tangent, of a function its derivative alone."""
    if dual and isinstance(type, Function) and isinstance(arg, Tuple) and len(arg.items) == 2:
        return arg.items[1]
    if not isinstance(type, TupleOf) or type.record is None or not isinstance(arg, Tuple):
        return arg
    parts = [isinstance(item, Tuple) or item is ZERO for item in arg.items]
    if dual and len(parts) == 2 and (all(parts) or any(isinstance(node, Deriv) for node in postorder(arg.items[1]))):
        return tuple_(_record(item, type, False) for item in arg.items)
    if len(arg.items) != len(type.items):
        return arg
    return app(global_(type.record.file, type.record.name), arg.items)


def _type(db: Database, node: Term, types: Mapping[Term, Type | None], parameters: Mapping[str, Type]) -> Type | None:
    """The type of a part that can be a record; None for others."""
    match node:
        case Var(name=name):
            found = parameters.get(name)
        case Global(module=module, name=name):
            found = interface(db, module, name).type
        case App(function=Var(name="snd"), args=(App(function=Deriv(function=Global(module=module, name=name))),)):
            found = result_of(interface(db, module, name).type)
        case App(function=Global(module=module, name=name)):
            found = result_of(interface(db, module, name).type)
        case Proj(term=inner, index=place):
            whole = types[inner]
            found = whole.items[place] if isinstance(whole, TupleOf) and place < len(whole.items) else None
        case Fold(start=start):
            found = types[start]
        case Tuple(items=items):
            known = [types[item] for item in items]
            found = TupleOf(tuple([UNKNOWN if one is None else one for one in known])) if any(known) else None
        case Index(array=inner):
            whole = types[inner]
            found = whole.item if isinstance(whole, ArrayOf) else None
        case _:
            return None
    return None if found is None else resolve(found)
