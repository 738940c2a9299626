"""`D(f)`, `D(f, c)` and `grad(f, …)`: calls of `deriv(f)` in which the parameters at hand move and all others rest.

A function of plain numbers is made: `D(f)` of an f of two numbers is `\\(x, y) . snd(deriv(f)((x, 1), (y, 0)))`.
Parameters that are functions are given as their derivatives, which carry no tangents.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from potto.core.terms import ONE, Term, Var, app, array, deriv, hole, index, length, proj, tuple_, var
from potto.elaborate.arrays import shaped, standing, zeros
from potto.elaborate.builtins import parameters_of
from potto.elaborate.conditions import choose, compare
from potto.elaborate.context import Elaboration, lambdas
from potto.elaborate.values import BuiltinValue, LocalFunction, Value
from potto.modules.free import free_references
from potto.source import NOWHERE
from potto.syntax import nodes
from potto.syntax.as_written import without_parentheses
from potto.types import infer_expression
from potto.types.types import (
    REAL,
    ArrayOf,
    Function,
    Parameter,
    TupleOf,
    Type,
    groups_of,
    holds_functions,
    resolve,
    result_of,
)

Along = Callable[[Term], Term]
"""The derivative of the answer for a tangent of what is looked at."""


def slope(elaboration: Elaboration, form: str, node: nodes.Apply, function: Value) -> Value:
    """What `D(f, …)` or `grad(f, …)` stands for, where f is `function`."""
    whole = _type_of(elaboration, function)
    groups = groups_of(whole)
    if isinstance(function, Var) and not groups:  # a parameter of which nothing else is known
        groups = ((Parameter(None, REAL),),)
    parameters = [parameter for group in groups for parameter in group]
    written = [argument.value for argument in node.arguments[1:]]
    names = [name.id for name in map(without_parentheses, written) if isinstance(name, nodes.Name)]
    places = [place for name in names for place, parameter in enumerate(parameters) if parameter.name == name]
    if not parameters or len(places) < len(written):
        return hole("there is no such parameter to differentiate by")
    if not written:
        moving = [place for place, p in enumerate(parameters) if not holds_functions(p.type)]
        places = [0] if form == "D" else moving
    return _Slope(elaboration, groups, result_of(whole), elaboration.as_term(function)).by(places)


def _type_of(elaboration: Elaboration, value: Value) -> Type:
    """The type of a value, also of a local function, which is looked at with what its names stand for."""
    match value:
        case BuiltinValue(name=name):
            return Function((Parameter(None, REAL),) * parameters_of(name), REAL)
        case LocalFunction():
            written = _lambda_of(value)
            used = dict.fromkeys(r.id for r in free_references(written) if isinstance(r, nodes.Name))
            known = ((name, value.scope.find(name)) for name in used)
            locals = tuple((name, _type_of(elaboration, found)) for name, found in known if found is not None)
            return infer_expression(elaboration.db, elaboration.file, written, locals).type
        case _:
            return elaboration.shapes.named(value)


def _lambda_of(closure: LocalFunction) -> nodes.Expr:
    """A local function as it is written."""
    annotated = {parameter.name: parameter for parameter in closure.annotated}
    groups = tuple(
        tuple(annotated.get(name) or nodes.Parameter(NOWHERE, name, None) for name in group) for group in closure.groups
    )
    body = nodes.Let(NOWHERE, closure.bindings, closure.body) if closure.bindings else closure.body
    return nodes.Lambda(NOWHERE, groups, body) if groups else body


class _Slope:
    """One function being differentiated."""

    def __init__(
        self, elaboration: Elaboration, groups: Sequence[tuple[Parameter, ...]], result: Type, function: Term
    ) -> None:
        self.elaboration, self.groups, self.result, self.function = elaboration, groups, result, function
        self.names = [self.named(group) for group in groups]
        self.types = [resolve(parameter.type) for group in groups for parameter in group]
        self.variables = [var(name) for group in self.names for name in group]

    def named(self, group: Sequence[Parameter]) -> tuple[str, ...]:
        """Fresh names for a group of parameters, of their types."""
        names = tuple(self.elaboration.fresh(p.name or "x") for p in group)
        self.elaboration.shapes.names.update(zip(names, [resolve(p.type) for p in group], strict=True))
        return names

    def by(self, places: Sequence[int]) -> Term:
        """The function of all derivatives by the parameters at these places, in the shape of the parameters."""
        found = [self.each(self.types[at], self.variables[at], partial(self.along, at)) for at in places]
        return lambdas(self.names, found[0] if len(found) == 1 else tuple_(found))

    def along(self, place: int, tangent: Term) -> Term:
        """The derivative with this tangent of the parameter at a place."""
        pairs = enumerate(zip(self.variables, self.types))
        duals = iter([self.dual(v, type, tangent if number == place else None) for number, (v, type) in pairs])
        made: Term = deriv(self.function)
        for group in self.groups:
            made = app(made, tuple(next(duals) for _ in group))
        return self.tangent(made, self.result)

    def tangent(self, dual: Term, type: Type) -> Term:
        """The tangent of a dual; where there are functions in the value, its parts are duals side by side."""
        type = resolve(type)
        if not holds_functions(type):
            return proj(dual, 1)
        match type:
            case TupleOf(items):
                return shaped(
                    self.elaboration, type, [self.tangent(proj(dual, place), item) for place, item in enumerate(items)]
                )
            case ArrayOf(_, item):
                place = self._place()
                return array(place, length(dual), self.tangent(index(dual, var(place)), item))
            case Function(parameters, result):
                names = self.named(parameters)
                resting = tuple(self.dual(var(n), p.type, None) for n, p in zip(names, parameters, strict=True))
                return lambdas((names,), self.tangent(app(dual, resting), result))
            case _:
                return proj(dual, 1)

    def each(self, type: Type, term: Term, along: Along) -> Term:
        """A derivative for each number of a parameter, or of a part of it."""
        type = resolve(type)
        if isinstance(type, TupleOf):
            parts = [self._item(type, term, place, along) for place in range(len(type.items))]
            return shaped(self.elaboration, type, parts)
        if not isinstance(type, ArrayOf):
            return along(ONE)
        place, item = self._place(), type.item

        def moved(tangent: Term) -> Term:
            other = self._place()
            here = compare("==", var(other), var(place))
            rest = zeros(self.elaboration, index(term, var(other)), item)
            return along(array(other, length(term), choose(here, tangent, rest, False, lambda _, __: None)))

        return array(place, length(term), self.each(item, index(term, var(place)), moved))

    def _item(self, whole: TupleOf, term: Term, place: int, along: Along) -> Term:
        def moved(tangent: Term) -> Term:
            rest = [zeros(self.elaboration, proj(term, number), item) for number, item in enumerate(whole.items)]
            return along(shaped(self.elaboration, whole, [*rest[:place], tangent, *rest[place + 1 :]]))

        return self.each(whole.items[place], proj(term, place), moved)

    def _place(self) -> str:
        place = self.elaboration.fresh("i")
        self.elaboration.numbers.add(place)
        return place

    def dual(self, term: Term, type: Type, tangent: Term | None) -> Term:
        """A parameter with its tangent; None: it rests, as all do in which there are functions."""
        if tangent is None or holds_functions(type):
            return standing(self.elaboration, term, type)
        return tuple_((term, tangent))
