"""The derivative of abstract values: a pair, value and tangent, for each number; for a tuple, values and tangents.

The tangent of a result varies with all that the result varies with and with the tangents of that; where the result
jumps, its tangent has deltas. What must be plain is the values alone: a tangent decides nothing.
"""

from __future__ import annotations

from typing import TypeGuard

from potto.types.algebra import flat, inputs_of, merge, ports_in, symbolic
from potto.types.apply import call
from potto.types.types import ArrayOf, Parameter, TupleOf, Type, groups_of, resolve, result_of
from potto.types.values import (
    HAZY,
    STILL,
    Abstract,
    AbstractFunction,
    AbstractScalar,
    Choice,
    Effect,
    ListValue,
    NoPort,
    Port,
    PortFunction,
    PortTree,
    PortTuple,
    Sink,
    Source,
    Sources,
    Spike,
    TupleValue,
    Value,
)


def dual(value: Value) -> Value:
    """What `deriv` makes of a function."""
    match value:
        case AbstractFunction():
            return _Dual({}, {}).closure(value)
        case Abstract():
            return _dual_of_input(value)
        case Choice(options):
            return Choice(tuple(dual(option) for option in options))
        case _:
            return value


def resting(value: Value) -> Value:
    """The dual of what is given without tangents: they are 0, and functions are derived."""
    if not _holds_functions(value):
        return TupleValue((value, STILL))
    match value:
        case TupleValue(items):
            return TupleValue(tuple(map(resting, items)))
        case ListValue(item):
            return ListValue(resting(item))
        case _:
            return dual(value)


def slope_value(value: Value, type: Type) -> Value:
    """What `D` and `grad` make of a function: the tangent of its answer, in the shape of the result of `type`."""
    groups = groups_of(type)
    return _slope_group(dual(value), groups, result_of(type)) if groups else HAZY


def _slope_group(function: Value, groups: tuple[tuple[Parameter, ...], ...], result: Type) -> Value:
    if not groups:
        tangent = function.items[1] if isinstance(function, TupleValue) and len(function.items) == 2 else function
        return _shaped(tangent, result) if isinstance(tangent, AbstractScalar) else tangent
    inputs = tuple(map(_symbol, groups[0]))
    answer, effects = call(function, tuple(map(_doubled, inputs)))
    return AbstractFunction(inputs, _slope_group(answer, groups[1:], result), tuple(effects))


def _symbol(parameter: Parameter) -> Value:
    name = parameter.name or "x"
    return symbolic(parameter.type, lambda: Source("input", name), lambda: Port(name))


def _shaped(value: AbstractScalar, type: Type) -> Value:
    """The same for every number of a type."""
    match resolve(type):
        case TupleOf(items):
            return TupleValue(tuple([_shaped(value, item) for item in items]))
        case ArrayOf(_, item):
            return ListValue(_shaped(value, item))
        case _:
            return value


def _transposed(duals: tuple[Value, ...]) -> Value:
    """The dual of a tuple from those of its items: the tuple of values, then the tuple of tangents."""
    pairs = [dual.items for dual in duals if _is_transposed(dual)]
    if len(pairs) != len(duals):
        return TupleValue(duals)
    return TupleValue((TupleValue(tuple(p[0] for p in pairs)), TupleValue(tuple(p[1] for p in pairs))))


def _transposed_ports(duals: tuple[PortTree, ...]) -> PortTree:
    pairs = [d.items for d in duals if isinstance(d, PortTuple) and len(d.items) == 2 and not _has_functions(d)]
    if len(pairs) != len(duals):
        return PortTuple(duals)
    return PortTuple((PortTuple(tuple(p[0] for p in pairs)), PortTuple(tuple(p[1] for p in pairs))))


def _columns(dual: Value) -> Value:
    """The dual of an array from that of its elements: the array of values, then the array of tangents."""
    return TupleValue(tuple(map(ListValue, dual.items))) if _is_transposed(dual) else ListValue(dual)


def _is_transposed(dual: Value) -> TypeGuard[TupleValue]:
    """Whether a dual is a value and its tangent; one with functions in it has its parts side by side."""
    return isinstance(dual, TupleValue) and len(dual.items) == 2 and not _holds_functions(dual)


def _holds_functions(value: Value) -> bool:
    match value:
        case TupleValue(items):
            return any(map(_holds_functions, items))
        case ListValue(item):
            return _holds_functions(item)
        case _:
            return not isinstance(value, AbstractScalar)


def _has_functions(tree: PortTree) -> bool:
    return any(map(_has_functions, tree.items)) if isinstance(tree, PortTuple) else isinstance(tree, PortFunction)


class _Dual:
    """One function being derived: the tangents of its inputs and the ports for tangents."""

    def __init__(self, tangents: dict[Source, Source], ports: dict[Port, Port]) -> None:
        self.tangents, self.ports = tangents, ports

    def closure(self, value: AbstractFunction) -> AbstractFunction:
        for source in inputs_of(value.inputs):
            self.tangents[source] = Source("input", "d" + source.name, source.span)
        for port in ports_in(value.inputs):
            self.ports[port] = Port("d" + port.name)
        inputs = tuple(map(self.input, value.inputs))
        result = self.closure(value.result) if isinstance(value.result, AbstractFunction) else self.result(value.result)
        return AbstractFunction(inputs, result, tuple(e for effect in value.effects for e in self.effect(effect)))

    def input(self, symbol: Value) -> Value:
        match symbol:
            case AbstractScalar(sources):
                tangents: Sources = {self.tangents[source]: None for source in sources}
                return TupleValue((AbstractScalar(sources), AbstractScalar(tangents)))
            case TupleValue(items):
                return _transposed(tuple(map(self.input, items)))
            case ListValue(item):
                return _columns(self.input(item))
            case Abstract(ports, result, taint):
                return Abstract(tuple(map(self.port, ports)), self.input(result), taint)
            case _:
                return symbol

    def port(self, tree: PortTree) -> PortTree:
        match tree:
            case Port():
                return PortTuple((tree, self.ports[tree]))
            case PortTuple(items):
                return _transposed_ports(tuple(map(self.port, items)))
            case PortFunction(inputs, result):
                return PortFunction(tuple(map(self.input, inputs)), self.port(result))
            case NoPort():
                return tree

    def result(self, value: Value) -> Value:
        match value:
            case AbstractScalar():
                return TupleValue((value, self.tangent(value)))
            case TupleValue(items):
                return _transposed(tuple(map(self.result, items)))
            case ListValue(item):
                return _columns(self.result(item))
            case AbstractFunction():
                return self.closure(value)
            case Abstract():
                return _dual_of_input(value)
            case Choice(options):
                return Choice(tuple(map(self.result, options)))

    def tangent(self, value: AbstractScalar) -> AbstractScalar:
        own = {self.tangents[source]: trail for source, trail in value.sources.items() if source in self.tangents}
        spikes = value.spikes | {Spike(surface, "") for surface in value.jumps}
        return AbstractScalar(merge(value.sources, own), frozenset(), spikes)

    def effect(self, effect: Effect) -> list[Effect]:
        """What is passed to a function among the inputs now has a tangent; what must be plain has none."""
        value = effect.value
        if isinstance(effect.to, Sink):
            own = {self.tangents[source]: None for source in flat(value) if source in self.tangents}
            return [effect, Effect(Sink("integral"), AbstractScalar(own))] if own else [effect]  # D Real = (Real, Real)
        if effect.to not in self.ports:
            return [effect]
        tangent = self.tangent(value) if isinstance(value, AbstractScalar) else value
        return [effect, Effect(self.ports[effect.to], tangent)]


def _dual_of_input(value: Abstract) -> Abstract:
    """The derivative of a function that is an input itself: it is given duals, and the values go to its ports."""
    return Abstract(tuple(map(_values_only, value.ports)), _doubled(value.result), value.taint)


def _values_only(tree: PortTree) -> PortTree:
    match tree:
        case Port():
            return PortTuple((tree, NoPort()))
        case PortTuple(items):
            return _transposed_ports(tuple(map(_values_only, items)))
        case PortFunction(inputs, result):
            return PortFunction(tuple(map(_doubled, inputs)), _values_only(result))
        case NoPort():
            return tree


def _doubled(value: Value) -> Value:
    match value:
        case AbstractScalar(sources):
            return TupleValue((value, AbstractScalar(sources)))
        case TupleValue(items):
            return _transposed(tuple(map(_doubled, items)))
        case ListValue(item):
            return _columns(_doubled(item))
        case Abstract():
            return _dual_of_input(value)
        case _:
            return value
