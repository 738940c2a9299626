"""The type of each kind of expression: names, arithmetic, conditions, functions, local names.

Types only: which variables a value depends on is the business of `flow`, which walks the same tree once the types are
known. Calls are in `calls`, binders of numbers (integrals, sums) in `integrals`.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

from potto.diagnostics import Diagnostic, Related
from potto.modules.builtins import DERIVATIVES, SPECIALS
from potto.primitives import PRIMITIVES
from potto.syntax import nodes
from potto.syntax.as_written import without_parentheses
from potto.types import kinds
from potto.types.annotations import written_type
from potto.types.context import Inference, rule
from potto.types.mismatches import comparison, describe, mismatch
from potto.types.scope import (
    BuiltinName,
    InterfaceName,
    Local,
    Meaning,
    ModuleName,
    RecursiveName,
    undefined,
    undefined_member,
)
from potto.types.types import (
    REAL,
    UNKNOWN,
    ArrayOf,
    Count,
    Function,
    Meta,
    Parameter,
    Real,
    Truth,
    TupleOf,
    Type,
    resolve,
)
from potto.types.unify import MAX_LEAVES, free_metas, instantiate, leaves, open_type, unify
from potto.types.vectors import combined, fields, vector_form


@rule(nodes.Number)
def _number(inference: Inference, node: nodes.Number) -> Type:
    return REAL


@rule(nodes.ErrorExpr)
def _error(inference: Inference, node: nodes.ErrorExpr) -> Type:
    return UNKNOWN


@rule(nodes.Paren)
def _paren(inference: Inference, node: nodes.Paren) -> Type:
    return inference.infer(without_parentheses(node))


# Names


@rule(nodes.Name)
def _name(inference: Inference, node: nodes.Name) -> Type:
    meaning = inference.scope.names.get(node.id) or inference.outside.find(None, node.id)
    if meaning is None:
        inference.say(undefined(inference.outside, inference.scope, node))
        return UNKNOWN
    inference.meanings[id(node)] = meaning
    return _meant(inference, node, meaning)


@rule(nodes.Member)
def _member(inference: Inference, node: nodes.Member) -> Type:
    head = node.path.partition(".")[0]
    local = inference.scope.find(head)
    meaning = inference.outside.find(node.path, node.name) if local is None else None
    if meaning is None:
        whole = local or inference.outside.find(None, head)
        type = REAL if whole is None or isinstance(whole, ModuleName) else resolve(_meant(inference, node, whole))
        if whole is not None and not isinstance(type, Meta | Real):  # what is unknown is told where it is bound
            inference.owners[id(node)] = whole
            return fields(inference, type, node)
        inference.say(undefined_member(inference.outside, inference.scope, node))
        return UNKNOWN
    inference.meanings[id(node)] = meaning
    return _meant(inference, node, meaning)


def _meant(inference: Inference, node: nodes.Name | nodes.Member, meaning: Meaning) -> Type:
    if isinstance(meaning, Local):
        meaning.used = True
        known = meaning.type = resolve(meaning.type)
        return instantiate(known, meaning.generic, inference.level) if meaning.generic else known
    if isinstance(meaning, BuiltinName):
        return _builtin(inference, node, meaning.name)
    match meaning:
        case InterfaceName(_, interface):
            return UNKNOWN if interface.broken else open_type(interface.type, inference.level)
        case RecursiveName(target):
            return inference.members[target]
        case ModuleName(name):
            message = f"`{name}` is a module, not a value"
            inference.report(kinds.MISMATCH(node.span, message, label="a module", help=f"write `{name}.something`"))
            return UNKNOWN


def _builtin(inference: Inference, node: nodes.Name | nodes.Member, name: str) -> Type:
    if name in ("pi", "inf"):
        return REAL
    if name in ("fst", "snd"):
        pair = (inference.fresh(), inference.fresh())
        return Function((Parameter(None, TupleOf(pair)),), pair[name == "snd"])
    if name in SPECIALS:
        what = _APPLIED[name]
        inference.report(
            kinds.SPECIAL(
                node.span,
                f"`{name}` is not a function that can be passed on: it is applied to {what}",
                label="not applied",
                help=f"apply it here: `{name}(…)`",
            )
        )
        return UNKNOWN
    if vector_form(name) is not None:
        message = f"`{name}` is not a function that can be passed on: it takes vectors of any size"
        help = f"apply it here: `{name}(…)`, or pass on `\\u . {name}(u)`"
        inference.report(kinds.SPECIAL(node.span, message, label="not applied", help=help))
        return UNKNOWN
    return _of_numbers(PRIMITIVES[name].arity or 2)


_APPLIED = {
    "deriv": "a function, `deriv(f)`",
    "D": "a function, `D(f)(0.3)`, and the name of a parameter, `D(f, c)`",
    "grad": "a function, `grad(f)(0.3, 2)`, and names of parameters, `grad(f, a, b)`",
    "delta": "a diffeomorphism's result, `delta(x - t)`",
    "load": 'the name of a file, `load("heights.csv")`',
}


@cache
def _of_numbers(count: int) -> Function:
    """A number, made of as many numbers as are given."""
    return Function((Parameter(None, REAL),) * count, REAL)


# Arithmetic


@rule(nodes.Chain)
def _chain(inference: Inference, node: nodes.Chain) -> Type:
    found = inference.infer(node.first)
    for operand in node.rest:
        right = inference.infer(operand.value)
        if found is not REAL or right is not REAL:  # as they mostly are
            found = combined(inference, found, operand, right, node)
    return found


@rule(nodes.Power)
def _power(inference: Inference, node: nodes.Power) -> Type:
    inference.number(node.base, "the left of `^`")
    inference.number(node.exponent, "the right of `^`")
    return REAL


# Composites


@rule(nodes.Tuple)
def _tuple(inference: Inference, node: nodes.Tuple) -> Type:
    items = tuple(inference.infer(item) for item in node.items)
    if sum(leaves(item) for item in items) > MAX_LEAVES:
        message = f"this tuple is made of more than {MAX_LEAVES} numbers"
        inference.report(kinds.TOO_LARGE(node.span, message, label="too large", help="use an integral or a sum"))
        return UNKNOWN
    for item, type in zip(node.items, items):
        if isinstance(resolve(type), Truth):
            inference.report(comparison(item, "a tuple holds numbers or functions"))
    return TupleOf(items)


@rule(nodes.ListLiteral)
def _list(inference: Inference, node: nodes.ListLiteral) -> Type:
    types = [inference.infer(item) for item in node.items]
    if len(types) == 1 and isinstance(resolve(types[0]), Truth):
        inference.brackets.add(id(node))  # `[p]` with a local name p for a comparison
        return REAL
    item: Type = inference.fresh()
    for expr, type in zip(node.items, types):
        if isinstance(resolve(type), Truth):
            inference.report(comparison(expr, "an array holds numbers, tuples or functions"))
        elif not unify(item, type):
            inference.report(mismatch(
                type, item, expr, "all elements of an array must be of one type: this one",
                (Related(node.items[0].span, "as the first one is"),),
            ))  # fmt: skip
    return ArrayOf(Count(len(types)), item)


def value_only(inference: Inference, type: Type, expr: nodes.Expr, what: str) -> None:
    """Check, now or when the type is known, that this is neither a function nor a comparison."""
    if isinstance(resolve(type), Truth):
        inference.report(comparison(expr, what))
    elif not isinstance(resolve(type), Real):
        inference.later(lambda: _no_function(inference, type, expr, what))


def _no_function(inference: Inference, type: Type, expr: nodes.Expr, what: str) -> None:
    if isinstance(resolve(type), Function):
        inference.report(escape(expr, f"{what}, not functions"))


def escape(expr: nodes.Expr, message: str) -> Diagnostic:
    """A function stands where it cannot."""
    return kinds.ESCAPES(
        expr.span,
        message,
        label="this is a function",
        help="apply it to arguments here; functions are passed as arguments and made by currying, `\\x . \\y . …`",
    )


# Functions and local names


@rule(nodes.Lambda)
def _lambda(inference: Inference, node: nodes.Lambda) -> Type:
    with inference.scope.inside(), inference.at_times():
        groups = [inference.bind_group(group, lambda a: written_type(inference, a), True) for group in node.groups]
        result = returned(inference, inference.infer(node.body), node.body)
    for group in reversed(groups):
        result = Function(tuple(Parameter(local.name, local.type) for local in group), result)
    return result


def returned(inference: Inference, result: Type, body: nodes.Expr) -> Type:
    """What a function gives: no comparison, and a function only by currying."""
    if isinstance(resolve(result), Truth):
        inference.report(comparison(body, "a function gives a number"))
        return UNKNOWN
    if not isinstance(resolve(result), Real):
        inference.later(lambda: _returned_late(inference, result, body))
    return result


def _returned_late(inference: Inference, result: Type, body: nodes.Expr) -> None:
    if isinstance(resolve(result), Function) and not _curries(inference, body):
        inference.report(escape(body, "a function cannot be the result of a function"))


def _curries(inference: Inference, body: nodes.Expr) -> bool:
    """Whether a function as a result is only one more group of parameters."""
    body = without_parentheses(body)
    while isinstance(body, nodes.Let):
        body = without_parentheses(body.body)
    match body:
        case nodes.Name():
            meaning = inference.meanings.get(id(body))
            return not (isinstance(meaning, Local) and meaning.kind != "local")
        case nodes.If(then=then, orelse=orelse):
            return _curries(inference, then) and _curries(inference, orelse)
        case _:
            return True


@rule(nodes.Let)
def _let(inference: Inference, node: nodes.Let) -> Type:
    with inference.scope.inside():
        bindings(inference, node.bindings)
        return inference.infer(node.body)


def bindings(inference: Inference, block: Sequence[nodes.Binding]) -> None:
    """Bring the names of a block into scope, one after the other."""
    for binding in block:
        inference.level += 1
        with inference.at_times():  # where the name is used
            type = inference.infer(binding.value)
        inference.level -= 1
        if len(binding.targets) == 1:
            _bind_one(inference, binding, type)
        else:
            _bind_parts(inference, binding, type)


def _bind_one(inference: Inference, binding: nodes.Binding, type: Type) -> None:
    target, found = binding.targets[0], resolve(type)
    generic = free_metas(found, inference.level) if isinstance(found, Function) else ()
    if not generic:
        unify_levels(found, inference.level)
    known = isinstance(found, Function) and is_known(inference, binding.value)
    local = Local(target.name, target.span, "local", found, generic, known, binding.value)
    inference.bind(target, local)


def unify_levels(type: Type, level: int) -> None:
    """What a binding found out is not to be generalised by another one further in."""
    for meta in free_metas(type, level):
        meta.level = level


def _bind_parts(inference: Inference, binding: nodes.Binding, type: Type) -> None:
    parts = tuple(inference.fresh() for _ in binding.targets)
    if not unify(type, TupleOf(parts)):
        found = resolve(type)
        count = len(found.items) if isinstance(found, TupleOf) else None
        message = f"{len(parts)} names are bound here, but this is {describe(found)}"
        help = "" if count is None else f"bind {count} names"
        inference.report(kinds.MISMATCH(binding.value.span, message, label=describe(found), help=help))
    for target, part in zip(binding.targets, parts):
        inference.bind(target, Local(target.name, target.span, "local", part))


def is_known(inference: Inference, expr: nodes.Expr) -> bool:
    """Whether it is known which function this is, so that its parameters have names."""
    while True:
        if isinstance(expr, nodes.Name) or isinstance(expr, nodes.Member):  # noqa: SIM101  (faster than a union)
            meaning = inference.meanings.get(id(expr))
            return meaning.known if isinstance(meaning, Local) else meaning is not None
        match expr:
            case nodes.Paren(inner=expr) | nodes.Let(body=expr):
                continue
            case nodes.Apply(function=function):
                expr = deriv_argument(inference, expr) or function
            case _:
                return isinstance(expr, nodes.Lambda)


def special(inference: Inference, expr: nodes.Expr) -> str | None:
    """`deriv`, `delta` or a builtin of vectors if that is what a function's name means here."""
    expr = without_parentheses(expr)
    if not isinstance(expr, nodes.Name) or inference.scope.find(expr.id):
        return None
    if expr.id not in SPECIALS and vector_form(expr.id) is None:
        return None
    return expr.id if isinstance(inference.outside.find(None, expr.id), BuiltinName) else None


def deriv_argument(inference: Inference, node: nodes.Apply) -> nodes.Expr | None:
    """The function that is derived, if this is `deriv(f)`, `D(f, …)` or `grad(f, …)`."""
    form = special(inference, node.function)
    if form in DERIVATIVES and node.arguments:
        return node.arguments[0].value
    return node.arguments[0].value if form == "deriv" and len(node.arguments) == 1 else None
