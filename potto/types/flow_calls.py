"""The walk over calls: arguments by plan, builtins, and the special forms `deriv` and `delta`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from potto.modules.builtins import DERIVATIVES, LOOK_UPS, VECTORS
from potto.primitives import PRIMITIVES
from potto.syntax import nodes
from potto.syntax.as_written import without_parentheses
from potto.syntax.printer import print_expression
from potto.types.algebra import flat, jumps_of, merge, still
from potto.types.apply import call
from potto.types.calls import callee_name
from potto.types.context import ArgumentPlan
from potto.types.dualize import dual, resting, slope_value
from potto.types.flow import Walk, walks
from potto.types.flow_arrays import element
from potto.types.rules import lone_delta, nonlinear
from potto.types.scope import BuiltinName
from potto.types.types import Parameter, groups_of
from potto.types.values import (
    HAZY,
    STILL,
    AbstractFunction,
    AbstractScalar,
    Effect,
    ListValue,
    Sink,
    Source,
    Spike,
    Step,
    TupleValue,
    Value,
)


@walks(nodes.Apply)
def _apply(walk: Walk, node: nodes.Apply) -> Value:
    meaning = walk.inference.meanings.get(id(without_parentheses(node.function)))
    name = meaning.name if isinstance(meaning, BuiltinName) else ""
    if name == "delta":
        return _delta(walk, node)
    if name == "load":
        return still(walk.inference.types[id(node)])
    if name in DERIVATIVES and not node.arguments:
        return HAZY
    if name in DERIVATIVES:
        return slope_value(walk.value(node.arguments[0].value), walk.inference.types[id(node)])
    arguments = [_given(walk, argument.value) for argument in node.arguments]
    if name == "deriv":
        return dual(arguments[0]) if len(arguments) == 1 else HAZY
    if name in VECTORS:
        return _of_vectors(name, arguments)
    plan = walk.inference.plans.get(id(node))
    if plan is None:
        return HAZY
    if name in PRIMITIVES:
        return _builtin(walk, node, name, arguments)
    function = walk.value(node.function)
    groups = groups_of(walk.inference.types[id(node.function)])
    return _Calling(walk, node, plan, groups, arguments).result(function)


def _given(walk: Walk, argument: nodes.Expr) -> Value:
    """The value of an argument; with tangents that are 0 where a derivative is given none."""
    value = walk.value(argument)
    return resting(value) if id(argument) in walk.inference.still else value


def _builtin(walk: Walk, node: nodes.Apply, name: str, arguments: Sequence[Value]) -> Value:
    """A builtin of numbers; one that jumps takes what does not vary."""
    sources, jumps = STILL.sources, jumps_of(STILL)
    for argument, value in zip(node.arguments, arguments):
        sources, jumps = merge(sources, flat(value)), jumps | jumps_of(value)
        if isinstance(value, AbstractScalar) and value.spikes:
            walk.report(nonlinear(argument.value, f"take its `{name}`"))
        if PRIMITIVES[name].plain:
            walk.sink("jump", argument.value.span, value, node=name)
    return AbstractScalar(sources, jumps)


def _of_vectors(name: str, arguments: Sequence[Value]) -> Value:
    """A builtin of vectors varies with all that their components vary with, and jumps where these do."""
    if name == "len":
        return STILL
    if name in LOOK_UPS and len(arguments) == 3:
        whole = element(arguments[1]) if name == "interp" else element(element(arguments[0]))
        return _with_sources(whole, _all_of(arguments))
    found = _all_of(arguments)
    if name != "cross":
        return found
    return ListValue(found) if any(isinstance(each, ListValue) for each in arguments) else TupleValue((found,) * 3)


def _all_of(values: Sequence[Value]) -> AbstractScalar:
    found = AbstractScalar(STILL.sources)
    for part in _leaves(values):
        found = AbstractScalar(merge(found.sources, part.sources), found.jumps | part.jumps)
    return found


def _with_sources(value: Value, more: AbstractScalar) -> Value:
    """A number, or each of a tuple, that varies with more."""
    match value:
        case TupleValue(items):
            return TupleValue(tuple([_with_sources(item, more) for item in items]))
        case ListValue(item):
            return ListValue(_with_sources(item, more))
        case _:
            return more


def _leaves(values: Sequence[Value]) -> Iterator[AbstractScalar]:
    for value in values:
        if isinstance(value, TupleValue):
            yield from _leaves(value.items)
        elif isinstance(value, ListValue):
            yield from _leaves((value.item,))
        else:
            yield value if isinstance(value, AbstractScalar) else AbstractScalar(flat(value))


def builtin_value(name: str) -> Value:
    """A builtin as a value: passed to a function, or given another name."""
    if name in ("pi", "inf"):
        return STILL
    if name in ("fst", "snd"):
        parts = [Source("input", "pair"), Source("input", "pair")]
        pair = TupleValue(tuple(AbstractScalar({part: None}, carriers=frozenset((part,))) for part in parts))
        return AbstractFunction((pair,), pair.items[name == "snd"])
    primitive = PRIMITIVES.get(name)
    if primitive is None:
        return HAZY
    inputs = [Source("input", "x") for _ in range(primitive.arity or 2)]
    everything = AbstractScalar(dict.fromkeys(inputs))
    effects = (Effect(Sink("jump", node=name), everything),) if primitive.plain else ()
    return AbstractFunction(tuple(AbstractScalar({source: None}) for source in inputs), everything, effects)


def _delta(walk: Walk, node: nodes.Apply) -> Value:
    """A delta of a diffeomorphism: a spike over all that its first component varies with."""
    values = [walk.value(argument.value) for argument in node.arguments]
    if not values:
        return HAZY
    first = values[0]
    if isinstance(first, TupleValue) and first.items:
        first = first.items[0]
    over = frozenset(source for source in flat(first))
    if not over:
        walk.report(lone_delta(node))
        return HAZY
    key = print_expression(node.arguments[0].value)
    return AbstractScalar(flat(TupleValue(tuple(values))), frozenset(), frozenset((Spike(over, key),)))


class _Calling:
    """One call whose plan is known."""

    def __init__(
        self,
        walk: Walk,
        node: nodes.Apply,
        plan: ArgumentPlan,
        groups: tuple[tuple[Parameter, ...], ...],
        arguments: list[Value],
    ) -> None:
        self.walk, self.node, self.plan, self.groups, self.arguments = walk, node, plan, groups, arguments

    def result(self, function: Value) -> Value:
        """What the call gives; what happens on the way is looked at."""
        value, effects = self._groups(function, 0)
        self.walk.emit(effects, self.node.function.span)
        return value

    def _groups(self, function: Value, number: int) -> tuple[Value, list[Effect]]:
        """Give the groups from `number` on their arguments; one that gets none stays open."""
        if number == len(self.plan.groups):
            return function, []
        slots = self.plan.groups[number]
        if slots is None:
            if not isinstance(function, AbstractFunction) or all(group is None for group in self.plan.groups[number:]):
                return function, []
            inner, effects = self._groups(function.result, number + 1)
            return AbstractFunction(function.inputs, inner, (*function.effects, *effects)), []
        values, notes = self._arguments(slots, number)
        value, effects = call(function, values, notes)
        further, more = self._groups(value, number + 1)
        return further, effects + more

    def _arguments(self, slots: tuple[tuple[int, ...], ...], number: int) -> tuple[list[Value], list[Step | None]]:
        if self.plan.spread and number == 0:
            place = slots[0][0]
            whole = self.arguments[place]
            if isinstance(whole, TupleValue) and len(whole.items) == len(slots):
                return self._noted(list(whole.items), [place] * len(slots), number)
            return self._noted([whole] * len(slots), [place] * len(slots), number)
        values = [
            self.arguments[slot[0]] if len(slot) == 1 else TupleValue(tuple(self.arguments[place] for place in slot))
            for slot in slots
        ]
        return self._noted(values, [slot[0] for slot in slots], number)

    def _noted(self, values: list[Value], places: list[int], number: int) -> tuple[list[Value], list[Step | None]]:
        """With each argument, the step that giving it is."""
        names = [p.name for p in self.groups[number]] if number < len(self.groups) else []
        notes: list[Step | None] = []
        for index, place in enumerate(places):
            value = values[index]
            if isinstance(value, AbstractScalar) and not value.sources:  # no way leads through it
                notes.append(None)
                continue
            name = names[index] if index < len(names) else None
            passed = f"passed as `{name}` here" if name else f"passed to {callee_name(self.node)} here"
            notes.append(Step(self.node.arguments[place].value.span, passed, argument=True))
        return values, notes
