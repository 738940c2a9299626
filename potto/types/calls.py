"""Calls: which arguments fill which parameters, and what is said when they do not.

Owns `ArgumentPlan`'s making. A function that is known has named groups: keywords bind by name in any group, the others
fill the parameters that are left, in order. A group that gets nothing stays open (partial application); one that gets
something must get all. A group of n also takes one tuple of n, and one parameter that is a tuple takes its n parts. Of
a function that is a parameter only the present group is known, and no names.
"""

from __future__ import annotations

from collections.abc import Sequence

from potto.diagnostics import Diagnostic, Suggestion, shortened
from potto.modules.builtins import DERIVATIVES
from potto.primitives import PRIMITIVES
from potto.reports.near import did_you_mean, instead, near_names
from potto.source import Span
from potto.syntax import nodes
from potto.syntax.as_written import without_parentheses
from potto.syntax.printer import print_expression
from potto.types import kinds
from potto.types.context import ArgumentPlan, Inference, rule
from potto.types.infer import is_known, special
from potto.types.loading import loaded
from potto.types.mismatches import between, comparison, describe, no_field, of_one
from potto.types.motionless import check_tangents, takes_duals
from potto.types.origins import misfit
from potto.types.scope import BuiltinName
from potto.types.slopes import slope
from potto.types.special_forms import delta, deriv
from potto.types.still import makes_dual, stands_still
from potto.types.types import (
    REAL,
    UNKNOWN,
    ArrayOf,
    Diffeo,
    Function,
    Meta,
    Parameter,
    Real,
    RecordName,
    Truth,
    TupleOf,
    Type,
    Unknown,
    function,
    groups_of,
    resolve,
    without_d,
)
from potto.types.unify import unify
from potto.types.vectors import vector_form


@rule(nodes.Apply)
def _apply(inference: Inference, node: nodes.Apply) -> Type:
    form = special(inference, node.function)
    if form is not None:
        inference.meanings[id(without_parentheses(node.function))] = BuiltinName(form)
        of_vectors = vector_form(form)
        if of_vectors is not None:
            return of_vectors(inference, node)
        if form == "load":
            return loaded(inference, node)
        if form in DERIVATIVES:
            return slope(inference, node, form)
        return deriv(inference, node) if form == "deriv" else delta(inference, node)
    callee = resolve(inference.infer(node.function))
    types = [inference.infer(argument.value) for argument in node.arguments]
    _no_comparisons(inference, node, types)
    if isinstance(callee, Meta):
        return _apply_unknown(inference, node, callee, types)
    if isinstance(callee, Unknown):
        return UNKNOWN
    if not isinstance(callee, Function):
        inference.report(_not_a_function(node, callee))
        return UNKNOWN
    variadic = _variadic(inference, node, types)
    if variadic is not None:
        return variadic
    callee = _of_duals(inference, node, callee, types)
    groups = groups_of(callee) if is_known(inference, node.function) else (callee.parameters,)
    filling = _Filling(inference, node, groups, types, callee.result)
    return filling.result(callee) if filling.fill() else UNKNOWN


def _of_duals(inference: Inference, node: nodes.Apply, callee: Function, types: Sequence[Type]) -> Function:
    """A record's definition as what makes its dual, where that is given the duals of fields."""
    made = resolve(callee.result)
    record = _record_of(callee.parameters, made)
    if record is None:
        return callee
    places = [record.fields.index(a.name) if a.name in record.fields else n for n, a in enumerate(node.arguments)]
    if not makes_dual(callee, dict(zip(places, types))):
        return callee
    derived = inference.dual(made, node)
    assert isinstance(derived, TupleOf)
    return Function(tuple([Parameter(*field) for field in zip(record.fields, derived.items)]), derived)


def _no_comparisons(inference: Inference, node: nodes.Apply, types: list[Type]) -> None:
    for place, argument in enumerate(node.arguments):
        if isinstance(resolve(types[place]), Truth):
            inference.report(comparison(argument.value, "an argument is a number, a tuple or a function"))
            types[place] = UNKNOWN


def _apply_unknown(inference: Inference, node: nodes.Apply, callee: Meta, types: list[Type]) -> Type:
    """A parameter is applied: it is a function of such arguments."""
    for argument in node.arguments:
        if argument.name is not None:
            inference.report(_no_names(argument, node))
            return UNKNOWN
    inference.settle_duals()
    known = resolve(callee)
    if isinstance(known, Function):
        filling = _Filling(inference, node, (known.parameters,), types)
        return filling.result(known) if filling.fill() else UNKNOWN
    primal = inference.primal_of(known)
    if isinstance(primal, Meta):  # the derivative of a parameter: a function of numbers
        unify(primal, Function(tuple(Parameter(None, REAL) for _ in types), Meta(primal.level)))
        return _apply_unknown(inference, node, callee, types)
    result = inference.fresh()
    made = Function(tuple(Parameter(None, type) for type in types), result)
    if not unify(known, made):
        message = "a function cannot be applied to itself"
        inference.report(kinds.MISMATCH(
            node.function.span, message, label="its type would contain itself", help="to multiply, write `*`"
        ))  # fmt: skip
        return UNKNOWN
    inference.plans[id(node)] = ArgumentPlan((tuple((place,) for place in range(len(types))),))
    return result


def _variadic(inference: Inference, node: nodes.Apply, types: Sequence[Type]) -> Type | None:
    """`min` and `max` take any number of arguments from two."""
    meaning = inference.meanings.get(id(without_parentheses(node.function)))
    primitive = PRIMITIVES.get(meaning.name) if isinstance(meaning, BuiltinName) else None
    if primitive is None or primitive.arity is not None or len(types) <= 2:
        return None
    for argument, type in zip(node.arguments, types):
        if argument.name is not None:
            inference.report(_no_names(argument, node))
        inference.need_number(type, argument.value, f"an argument of `{primitive.name}`")
    inference.plans[id(node)] = ArgumentPlan((tuple((place,) for place in range(len(types))),))
    return REAL


def _not_a_function(node: nodes.Apply, callee: Type) -> Diagnostic:
    after = node.arguments[0].value if node.arguments else None
    is_number = isinstance(callee, Real)
    help, suggestions = "", tuple[Suggestion, ...]()
    if is_number and after is not None:
        listed = isinstance(without_parentheses(node.function), nodes.Number) and isinstance(after, nodes.Number)
        help = "to multiply, write `*` between the two"
        help = f"{help}; to list them, a comma" if listed else help
    elif isinstance(callee, TupleOf | Diffeo):
        help = "a call binds to what stands before it: write the operator between the two, or a comma"
    elif isinstance(callee, ArrayOf):
        help = "an element of an array is written with brackets: `xs[i]`"
        suggestions = _bracketed(node)
    label = "a number" if is_number else describe(callee)
    message = f"this is {describe(callee)}, not a function, so it cannot be applied"
    return kinds.NOT_A_FUNCTION(node.function.span, message, label=label, help=help, suggestions=suggestions)


def _bracketed(node: nodes.Apply) -> tuple[Suggestion, ...]:
    """A call written as an index: `xs(i)` as `xs[i]`."""
    if not node.arguments or any(argument.name for argument in node.arguments):
        return ()
    inner = node.arguments[0].value.span.cover(node.arguments[-1].value.span)
    whole = Span(node.function.span.end, node.span.end)
    index = nodes.Index(node.span, node.function, tuple(argument.value for argument in node.arguments))
    return (between(whole, inner, "[", "]", f"Write `{shortened(print_expression(index))}`"),)


def _no_names(argument: nodes.Argument, node: nodes.Apply) -> Diagnostic:
    return kinds.UNKNOWN_KEYWORD(
        argument.name_span or argument.span,
        f"{callee_name(node)} has no parameters with names",
        label="no such name",
        help="give the arguments in order, without names",
    )


def callee_name(node: nodes.Apply) -> str:
    """What a call applies, in the middle of a sentence."""
    target = without_parentheses(node.function)
    while isinstance(target, nodes.Apply):
        target = without_parentheses(target.function)
    if isinstance(target, nodes.Name):
        return f"`{target.id}`"
    return f"`{target.path}.{target.name}`" if isinstance(target, nodes.Member) else "this function"


class _Filling:
    """One call being planned: what each parameter gets. made: what a function of a single group gives."""

    def __init__(
        self,
        inference: Inference,
        node: nodes.Apply,
        groups: tuple[tuple[Parameter, ...], ...],
        types: Sequence[Type],
        made: Type = UNKNOWN,
    ) -> None:
        self.inference, self.node, self.groups, self.types = inference, node, groups, types
        self.made = made
        self.parameters = groups[0] if len(groups) == 1 else [parameter for group in groups for parameter in group]
        self.slots: list[tuple[int, ...]] = [()] * len(self.parameters)
        self.positional = [place for place, argument in enumerate(node.arguments) if argument.name is None]
        self.spread = False

    def fill(self) -> bool:
        """Fill the parameters; False if that was reported to be impossible."""
        if len(self.positional) == len(self.node.arguments) == len(self.parameters):
            self.slots = [(place,) for place in self.positional]
            return True
        if not self._keywords():
            return False
        if not self._pack() and not self._positions():
            return False
        return self._complete()

    def _keywords(self) -> bool:
        names = {parameter.name: place for place, parameter in enumerate(self.parameters) if parameter.name}
        numbers = {**without_d(self.parameters), **names}
        fine = True
        for place, argument in enumerate(self.node.arguments):
            if argument.name is None:
                continue
            if argument.name not in numbers:
                self.inference.report(self._unknown_keyword(argument, tuple(names)))
                fine = False
            else:  # the parser has seen to it that none is given twice
                self.slots[numbers[argument.name]] = (place,)
        return fine

    def _unknown_keyword(self, argument: nodes.Argument, names: tuple[str, ...]) -> Diagnostic:
        if not names:
            return _no_names(argument, self.node)
        given = {other.name for other in self.node.arguments}
        record = _record_of(self.parameters, resolve(self.made))
        if record is not None:
            span = argument.name_span or argument.span
            return no_field(self.inference.outside, span, argument.name or "", record, given)
        near = near_names(argument.name or "", [name for name in names if name not in given])
        return kinds.UNKNOWN_KEYWORD(
            argument.name_span or argument.span,
            f"{callee_name(self.node)} has no parameter `{argument.name}`",
            label="no such parameter",
            help=did_you_mean(near) or "it has " + ", ".join(f"`{name}`" for name in names),
            suggestions=instead(argument.name_span or argument.span, near),
        )

    def _pack(self) -> bool:
        """Several arguments for one parameter that is a tuple, or one tuple for a group."""
        first, given = len(self.groups[0]), self.positional
        if len(given) != len(self.node.arguments):
            return False
        if first == 1 and len(self.groups) == 1 and len(given) > 1:
            only = resolve(self.parameters[0].type)
            if isinstance(only, TupleOf) and only.record is None and len(only.items) == len(given):
                self.slots[0] = tuple(given)
                return True
        if first > 1 and len(given) == 1:
            type = resolve(self.types[0])
            tuple_ = isinstance(type, TupleOf) and type.record is None
            dims = len(type.items) if tuple_ else type.dims if isinstance(type, Diffeo) else None  # type: ignore[union-attr]
            if dims == first or isinstance(type, Meta) or (isinstance(type, Diffeo) and dims is None):
                self.slots[:first] = [(given[0],)] * first
                self.spread = True
                return True
        return False

    def _positions(self) -> bool:
        places = [place for place, slot in enumerate(self.slots) if not slot]
        if len(self.positional) > len(places):
            self.inference.report(self._too_many(len(places)))
            return False
        for place, argument in zip(places, self.positional):
            self.slots[place] = (argument,)
        return True

    def _too_many(self, room: int) -> Diagnostic:
        extra = self.node.arguments[self.positional[room]]
        total = len(self.parameters)
        takes = "takes no argument" if total == 0 else f"takes {total} argument{'s' if total > 1 else ''}"
        arguments = self.node.arguments
        return kinds.TOO_MANY(
            extra.span,
            f"{callee_name(self.node)} {takes}, but is given {len(arguments)}",
            label="one too many" if len(self.positional) - room == 1 else "too many from here on",
            help=self._signature(),
        )

    def _complete(self) -> bool:
        """Check that groups are filled whole and in order: those after the last argument stay open."""
        end = max((place + 1 for place, slot in enumerate(self.slots) if slot), default=1)
        start, empty = 0, []
        for group in self.groups:
            if start < end:
                empty += [p for p, slot in zip(group, self.slots[start : start + len(group)]) if not slot]
            start += len(group)
        if empty:
            self.inference.report(self._missing(empty))
        return not empty

    def _missing(self, empty: Sequence[Parameter]) -> Diagnostic:
        names = [f"`{parameter.name}`" for parameter in empty if parameter.name]
        count = len(empty)
        what = f"the argument{'s' if count > 1 else ''} " + " and ".join(names) if names else f"{count} more"
        end = self.node.span.end
        at = self.node.arguments[-1].span if self.node.arguments else self.node.function.span
        if not names:
            what += f" argument{'s' if count > 1 else ''}"
        return kinds.MISSING(
            at if at.end <= end else self.node.span,
            f"{callee_name(self.node)} needs {what}",
            label="not enough",
            help=self._signature() or of_one(self.node),
        )

    def _signature(self) -> str:
        if not any(parameter.name for parameter in self.parameters):
            return ""
        groups = "".join(f"({', '.join(p.name or '_' for p in group)})" for group in self.groups)
        return f"its parameters are {groups}"

    def result(self, callee: Function) -> Type:
        """Check the arguments, note the plan, and give the type of the call."""
        self._check()
        if takes_duals(self.parameters):
            self.inference.later(lambda: check_tangents(self.inference, self.node))
        if len(self.groups) == 1:  # and so it is filled
            self.inference.plans[id(self.node)] = ArgumentPlan((tuple(self.slots),), self.spread)
            return callee.result
        plan: list[tuple[tuple[int, ...], ...] | None] = []
        left: list[tuple[Parameter, ...]] = []
        start = 0
        for group in self.groups:
            slots = tuple(self.slots[start : start + len(group)])
            filled = all(slots)
            plan.append(slots if filled else None)
            if not filled:
                left.append(group)
            start += len(group)
        self.inference.plans[id(self.node)] = ArgumentPlan(tuple(plan), self.spread)
        rest: Type = callee
        for _ in self.groups:
            rest = resolve(rest)
            assert isinstance(rest, Function)
            rest = rest.result
        return function(left, rest)

    def _check(self) -> None:
        if self.spread:
            group = TupleOf(tuple(parameter.type for parameter in self.groups[0]))
            self._give(0, group, None)
            return
        for parameter, slot in zip(self.parameters, self.slots):
            if len(slot) == 1:
                self._give(slot[0], parameter.type, parameter.name)
            elif slot:
                whole = resolve(parameter.type)
                assert isinstance(whole, TupleOf)
                for place, item in zip(slot, whole.items):
                    self._give(place, item, parameter.name)

    def _give(self, place: int, expected: Type, name: str | None) -> None:
        """Check that an argument fits what is expected of it, by the parameter of this name if it has one."""
        if self.types[place] is REAL is expected:  # as it is mostly
            return
        expr = self.node.arguments[place].value
        if not self.spread and stands_still(self.inference, self.node, expr, expected):
            self.inference.still.add(id(expr))
            return
        if not self.inference.fits(self.types[place], expected):
            what = f"`{name}`" if name else "the argument"
            found, what = (self.types[place], expected), f"{what} of {callee_name(self.node)}"
            self.inference.report(misfit(self.inference, self.node, place, self.parameters, self.slots, found, what))


def _record_of(parameters: Sequence[Parameter], made: Type) -> RecordName | None:
    """The record that a function makes of its fields, if that is all it does."""
    record = made.record if isinstance(made, TupleOf) else None
    return record if record is not None and tuple(p.name for p in parameters) == record.fields else None
