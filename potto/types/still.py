"""Tuples and records without tangents where a derivative takes them with some: they stand still, as a number does, and
the functions in them are derived.

Owns `lacks_tangents`, `makes_dual` and `is_dual`, which types and elaboration both ask, and `stands_still`, whether a
call may leave them out. A pair of numbers could be a number with its tangent: what is expected decides. So the
derivative has to be one of a definition, whose type is known; and a term has to show what an argument is, since
elaboration sees nothing else.
"""

from __future__ import annotations

from collections.abc import Mapping

from potto.syntax import nodes
from potto.syntax.as_written import without_parentheses
from potto.types.context import Inference
from potto.types.mismatches import needs_deriv
from potto.types.motionless import head_of
from potto.types.scope import BuiltinName, InterfaceName, Local, Meaning
from potto.types.types import (
    REAL,
    UNKNOWN,
    ArrayOf,
    Dist,
    Function,
    Meta,
    Parameter,
    Real,
    TupleOf,
    Type,
    holds_functions,
    resolve,
)
from potto.types.unify import is_named_alike, unify


def lacks_tangents(actual: Type, expected: Type) -> bool:
    """Whether a tuple or a record is given for itself and its tangents, or an array that holds functions for theirs.
    What is not known of it may be anything: `\\x . x` is a function of numbers as well as of duals.
    """
    values = _values_like(actual, expected)
    return values is not None and _alike(actual, values, guess=True) and not _alike(actual, expected, guess=True)


def _values_like(actual: Type, expected: Type) -> Type | None:
    """What is expected together with its tangents; None for what is not told from it: numbers, arrays of numbers, and
    functions by themselves. Where there are functions in it its dual has no record's name, and that of what is given is
    taken."""
    wanted, given = resolve(expected), resolve(actual)
    if not holds_functions(wanted):
        return values_of(wanted)
    return _primal(wanted, given) if isinstance(wanted, TupleOf | ArrayOf) else None


def _primal(dual: Type, like: Type) -> Type | None:
    """The type that has this one as its dual, with the records' names of another one."""
    dual, like = resolve(dual), resolve(like)
    if not holds_functions(dual):
        if not isinstance(dual, TupleOf) or len(dual.items) != 2 or not _alike(*dual.items):
            return None
        return REAL if isinstance(resolve(dual.items[0]), Real | Dist) else dual.items[0]
    match dual:
        case TupleOf(items):
            if not isinstance(like, TupleOf) or len(like.items) != len(items):
                return None
            parts = [_primal(item, other) for item, other in zip(items, like.items)]
            found = tuple([part for part in parts if part is not None])
            return TupleOf(found, record=like.record) if len(found) == len(parts) else None
        case ArrayOf(size, item):
            part = _primal(item, like.item) if isinstance(like, ArrayOf) else None
            return None if part is None else ArrayOf(size, part)
        case Function(parameters, result):
            if not isinstance(like, Function) or len(like.parameters) != len(parameters):
                return None
            taken = [_primal(p.type, q.type) for p, q in zip(parameters, like.parameters)]
            given, made = tuple([Parameter(None, t) for t in taken if t is not None]), _primal(result, like.result)
            return None if made is None or len(given) < len(taken) else Function(given, made)
        case _:
            return None


def makes_dual(record: Function, given: Mapping[int, Type]) -> bool:
    """Whether the definition of a record is given the derivative of a function where it holds one: it makes the dual
    then, of the duals of all fields. given: what its fields are given, by their places."""
    made = resolve(record.result)
    if not isinstance(made, TupleOf) or made.record is None or made.record.dual or not holds_functions(made):
        return False
    return any(needs_deriv(made.items[place], type) for place, type in given.items() if place < len(made.items))


def is_dual(expected: Type) -> bool:
    """Whether a number with its tangent is expected."""
    wanted = resolve(expected)
    return (
        isinstance(wanted, TupleOf)
        and len(wanted.items) == 2
        and all(isinstance(resolve(t), Real) for t in wanted.items)
    )


def values_of(expected: Type) -> TupleOf | None:
    """The tuple or record that is expected together with its tangents; None for anything else."""
    wanted = resolve(expected)
    if not isinstance(wanted, TupleOf) or len(wanted.items) != 2:
        return None
    values, tangents = map(resolve, wanted.items)
    return values if isinstance(values, TupleOf) and _alike(values, tangents) else None


def _alike(a: Type, b: Type, guess: bool = False) -> bool:
    """Whether two types are known, and made of numbers in the same way, whatever their sizes. guess: what is not known
    of the first may be anything."""
    a, b = resolve(a), resolve(b)
    match a:
        case Meta():
            return guess
        case Real() | Dist():
            return isinstance(b, Real | Dist)
        case TupleOf(items):
            if not isinstance(b, TupleOf) or not is_named_alike(a, b) or len(items) != len(b.items):
                return False
            return all(_alike(item, other, guess) for item, other in zip(items, b.items))
        case ArrayOf(item=item):
            return isinstance(b, ArrayOf) and _alike(item, b.item, guess)
        case Function(parameters, result):
            if not isinstance(b, Function) or len(parameters) != len(b.parameters):
                return False
            fits = (_alike(p.type, q.type, guess) for p, q in zip(parameters, b.parameters))
            return all(fits) and _alike(result, b.result, guess)
        case _:
            return False


def stands_still(inference: Inference, call: nodes.Apply, argument: nodes.Expr, expected: Type) -> bool:
    """Whether an argument of a derivative is given without tangents, and that can be seen wherever it is looked at."""
    found = inference.types[id(argument)]
    if not lacks_tangents(found, expected):
        return False
    known = _evident(inference, argument) and _of_a_definition(inference, head_of(inference, call))
    values = _values_like(found, expected)
    return known and values is not None and unify(found, values)


def _of_a_definition(inference: Inference, head: nodes.Expr) -> bool:
    """Whether a function is `deriv(f)` or another name of it, where f is a definition."""
    head = without_parentheses(head)
    if isinstance(head, nodes.Apply):
        inner = without_parentheses(head.arguments[0].value) if len(head.arguments) == 1 else head
        meaning = _meaning(inference, head.function)
        derives = isinstance(meaning, BuiltinName) and meaning.name == "deriv"
        return derives and isinstance(_meaning(inference, inner), InterfaceName)
    meaning = _meaning(inference, head)
    if isinstance(meaning, Local):
        return meaning.kind == "local" and meaning.value is not None and _of_a_definition(inference, meaning.value)
    return isinstance(meaning, InterfaceName) and meaning.interface.derivative


def _meaning(inference: Inference, expr: nodes.Expr) -> Meaning | None:
    return inference.meanings.get(id(without_parentheses(expr)))


def _is_bound(inference: Inference, local: Local) -> bool:
    """Whether a local name stands for the whole of an expression that shows what it is made of."""
    if local.kind != "local" or local.value is None:
        return False
    whole = inference.types.get(id(local.value), UNKNOWN)
    return _alike(whole, local.type) and _evident(inference, local.value)


def _evident(inference: Inference, expr: nodes.Expr) -> bool:
    """Whether the term of an expression shows what it is made of: the types of lambdas' parameters and of what loops go
    through are known to inference alone."""
    expr = without_parentheses(expr)
    if isinstance(resolve(inference.types.get(id(expr), UNKNOWN)), Real | Dist):
        return True
    match expr:
        case nodes.Tuple(items=items) | nodes.ListLiteral(items=items):
            return all(_evident(inference, item) for item in items)
        case nodes.Name():
            meaning = _meaning(inference, expr)
            if isinstance(meaning, Local):
                return id(meaning) in inference.heads or _is_bound(inference, meaning)
            return isinstance(meaning, InterfaceName | BuiltinName)
        case nodes.Member():
            owner = inference.owners.get(id(expr), _meaning(inference, expr))
            return isinstance(owner, InterfaceName) or (isinstance(owner, Local) and id(owner) in inference.heads)
        case nodes.Apply(function=function):
            return isinstance(_meaning(inference, function), InterfaceName)
        case nodes.Field(value=inner) | nodes.With(record=inner) | nodes.Index(array=inner):
            return _evident(inference, inner)
        case _:
            return False
