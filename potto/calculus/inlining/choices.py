"""Functions that are chosen: read from arrays and tuples, or by a plain condition.

Owns `calls_of_items`, `at_place` and `jumps_as_function`.
"""

from __future__ import annotations

from potto.calculus.inlining.expand import Resolve, expanded, named
from potto.core.terms import (
    App,
    Branch,
    Global,
    If,
    Index,
    Lam,
    ListOf,
    Proj,
    Term,
    Tuple,
    app,
    array,
    const,
    fresh,
    if_,
    index,
    list_of,
    postorder,
    prim,
    proj,
    transform,
    var,
)


def calls_of_items(term: Term, resolve: Resolve) -> Term:
    """With all calls carried out, those of functions in arrays and tuples chosen by the place."""
    if not any(isinstance(node, App) for node in postorder(term)):
        return term

    def change(_: Term, new: Term) -> Term:
        return _pushed(new.function, new.args, resolve) if isinstance(new, App) else new

    return expanded(transform(term, change), resolve)


def _pushed(function: Term, args: tuple[Term, ...], resolve: Resolve) -> Term:
    """A call of a choice as the choice between calls."""
    match function:
        case If(condition=condition, then=then, orelse=orelse):
            return if_(condition, _pushed(then, args, resolve), _pushed(orelse, args, resolve))
        case Index(array=whole, index=place):
            known = named(whole, resolve) if isinstance(whole, Global) else whole
            if isinstance(known, ListOf) and known.items:
                return at_place(tuple(app(item, args) for item in known.items), place)
        case Proj(term=whole, index=number):
            known = named(whole, resolve) if isinstance(whole, Global) else whole
            if isinstance(known, Tuple):
                return app(known.items[number], args)
            if isinstance(known, Index) and isinstance(known.array, ListOf):
                parts = list_of(proj(item, number) for item in known.array.items)
                return _pushed(index(parts, known.index), args, resolve)
    return app(function, args)


def at_place(items: tuple[Term, ...], place: Term) -> Term:
    """The item at a place that is known at run time."""
    slot = fresh("i", place.free)
    place = index(array(slot, const(len(items)), var(slot)), place)
    found = items[-1]
    for number, item in reversed(list(enumerate(items[:-1]))):
        found = if_(prim("eq", place, const(number)), item, found)
    return found


def jumps_as_function(term: Term, resolve: Resolve) -> bool:
    """Whether a term is a function, or a choice between some, with a condition in what it does."""
    function = whole = expanded(term, resolve)
    while isinstance(function, If | Index):
        if isinstance(function, If):
            function = function.then
        elif isinstance(function.array, ListOf) and function.array.items:
            function = function.array.items[0]
        else:
            return False
    return isinstance(function, Lam) and any(isinstance(node, Branch) for node in postorder(whole))
