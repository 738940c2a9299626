"""Calling abstract values: substitution of what is given for symbolic inputs.

A call gives a result and effects, and reports nothing: `flow` looks at the effects. Nothing here iterates to a fixed
point. What a function that is passed in gives is bound first, as far as it varies with more than its arguments (those
are accounted for at each call, see `values`); then what is passed to it is collected from the effects on its ports and
played through it, which shows what it demands.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from potto.types.algebra import flat, inputs_of, join, joined, jumps_of, merge, noted, ports_in, taint, then
from potto.types.values import (
    NONE,
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
    Source,
    Sources,
    Spike,
    Step,
    Surface,
    TupleValue,
    Value,
)


@dataclass(eq=False, repr=False)
class Substitution:
    """What stands for which symbolic input. `functions`: what is given for an input that is a function; `effects`: of
    the function that is called."""

    values: dict[Source, Value] = field(default_factory=dict)
    functions: list[tuple[Value, Abstract, Step | None]] = field(default_factory=list)
    ports: set[Port] = field(default_factory=set)
    abstracts: dict[int, Value] = field(default_factory=dict)
    effects: Sequence[Effect] = ()


def call(function: Value, arguments: Sequence[Value], notes: Sequence[Step | None] = ()) -> tuple[Value, list[Effect]]:
    """What a function gives for one group of arguments, and what happens on the way."""
    match function:
        case AbstractFunction(inputs, result, effects):
            binding = Substitution(effects=effects)
            given = _regroup(len(inputs), arguments)
            places: Sequence[int] = range(min(len(inputs), len(given)))
            if Abstract in map(type, inputs):  # functions last: where they jump hangs on what they are given
                places = sorted(places, key=lambda place: isinstance(inputs[place], Abstract))
            for place in places:
                bind(inputs[place], given[place], binding, notes[place] if place < len(notes) else None)
            return substitute(result, binding), played(effects, binding)
        case Abstract():
            return _call_abstract(function, _regroup(len(function.ports), arguments))
        case Choice(options):
            answers = [call(option, arguments, notes) for option in options]
            return joined(value for value, _ in answers), [effect for _, effects in answers for effect in effects]
        case _:
            return _all_of([function, *arguments]), []


def _regroup(count: int, arguments: Sequence[Value]) -> Sequence[Value]:
    """One tuple for a group of several, or several for one tuple."""
    if len(arguments) == count:
        return arguments
    if len(arguments) == 1:
        only = arguments[0]
        if isinstance(only, TupleValue) and len(only.items) == count:
            return only.items
        return [AbstractScalar(flat(only))] * count
    return [TupleValue(tuple(arguments))] if count == 1 else [_all_of(arguments)] * count


def _all_of(values: Iterable[Value]) -> AbstractScalar:
    found: Sources = NONE
    for value in values:
        found = merge(found, flat(value))
    return AbstractScalar(found)


def _call_abstract(function: Abstract, arguments: Sequence[Value]) -> tuple[Value, list[Effect]]:
    hub, jumps = function.taint, frozenset[Surface]()
    for argument in arguments:
        hub, jumps = merge(hub, flat(argument)), jumps | jumps_of(argument)
    effects: list[Effect] = []
    for tree, argument in zip(function.ports, arguments):
        hub = merge(hub, _give(tree, argument, hub, effects))
    return taint(function.result, hub, jumps), effects


def _give(tree: PortTree, value: Value, hub: Sources, effects: list[Effect]) -> Sources:
    """Note what an unknown function is given; gives what it learns by calling a function it is given."""
    match tree:
        case Port():
            effects.append(Effect(tree, value))
        case PortTuple(items):
            parts = value.items if isinstance(value, TupleValue) and len(value.items) == len(items) else None
            for place, item in enumerate(items):
                hub = merge(hub, _give(item, parts[place] if parts else AbstractScalar(flat(value)), hub, effects))
        case PortFunction(inputs, result):
            answer, further = call(value, [taint(symbol, hub) for symbol in inputs])
            effects += further
            return merge(merge(hub, flat(answer)), _give(result, answer, hub, effects))
        case NoPort():
            pass
    return hub


# Substitution


def bind(symbol: Value, actual: Value, binding: Substitution, note: Step | None = None) -> None:
    """Let `actual` stand for a symbolic input. A number may stand for a pair (a dual)."""
    if note is not None and not isinstance(symbol, Abstract):
        actual = noted(actual, note)
    if isinstance(symbol, AbstractScalar):
        for source in symbol.sources:
            before = binding.values.get(source)
            binding.values[source] = actual if before is None else join(before, actual)
        return
    match symbol:
        case TupleValue(items):
            parts = actual.items if isinstance(actual, TupleValue) and len(actual.items) == len(items) else None
            for place, item in enumerate(items):
                bind(item, parts[place] if parts else AbstractScalar(flat(actual)), binding)
        case ListValue(item):
            bind(item, actual.item if isinstance(actual, ListValue) else AbstractScalar(flat(actual)), binding)
        case Abstract():
            for option in actual.options if isinstance(actual, Choice) else (actual,):
                binding.functions.append((option, symbol, note))
                _bind_function(symbol, option, binding, note)
            binding.ports.update(ports_in((symbol,)))
        case _:
            pass


def _bind_function(symbol: Abstract, actual: Value, binding: Substitution, note: Step | None) -> None:
    """Bind what a function gives whatever its arguments, and what it passes to functions among its arguments."""
    if symbol.ports:
        before = binding.abstracts.get(id(symbol.ports))
        binding.abstracts[id(symbol.ports)] = actual if before is None else join(before, actual)
    answer: Value
    match actual:
        case AbstractFunction(inputs, result, effects):
            if _jumps(result):
                result = _across(result, dict(_arriving(symbol.ports, inputs, binding)))
            blank = Substitution(dict.fromkeys(inputs_of(inputs), STILL))
            answer = substitute(result, blank)
            passed = _received([*effects, *_later_effects(result)], blank)
            for tree, own in zip(symbol.ports, inputs):
                if isinstance(tree, PortFunction) and isinstance(own, Abstract):
                    for source, port in zip(tree.inputs, own.ports):
                        bind(source, _arrived(port, passed), binding)
        case Abstract(ports, result, tainted):
            answer = taint(result, tainted)
            for tree, other in zip(symbol.ports, ports):
                if isinstance(tree, PortFunction) and isinstance(other, PortFunction):
                    for source, passed_on in zip(tree.inputs, other.inputs):
                        bind(source, passed_on, binding)
        case _:
            answer = AbstractScalar(flat(actual))
    if isinstance(symbol.result, Abstract):
        _bind_function(symbol.result, answer, binding, note)
    else:
        bind(symbol.result, answer, binding, note)


def _arriving(
    ports: Sequence[PortTree], inputs: Sequence[Value], binding: Substitution
) -> Iterable[tuple[Source, Surface | None]]:
    """What the inputs of a function that is passed vary with where the callee calls it; None for one that is given
    nothing but what the callee integrates over."""
    for tree, own in zip(ports, inputs):
        if isinstance(tree, PortTuple) and isinstance(own, TupleValue):
            yield from _arriving(tree.items, own.items, binding)
        elif isinstance(tree, Port) and isinstance(own, AbstractScalar):
            values = [effect.value for effect in binding.effects if effect.to is tree]
            bound = {source for value in values for source in flat(value) if source.kind == "variable"}
            found = {source for value in values for source in flat(substitute(value, binding))} - bound
            for source in own.sources:
                yield source, None if bound and not found else frozenset(found)


def _jumps(value: Value) -> bool:
    while isinstance(value, AbstractFunction):
        value = value.result
    if isinstance(value, TupleValue):
        return any(map(_jumps, value.items))
    return isinstance(value, AbstractScalar) and bool(value.jumps or value.spikes)


def _across(value: Value, where: Mapping[Source, Surface | None]) -> Value:
    """A value with its surfaces and deltas as the callee has them: gone where it integrates over them."""
    if isinstance(value, AbstractScalar):
        if not (value.jumps or value.spikes):
            return value
        jumps = {moved for surface in value.jumps if (moved := _moved(surface, where))}
        over = {(moved, spike.key) for spike in value.spikes if (moved := _moved(spike.over, where))}
        spikes = frozenset(Spike(moved, key) for moved, key in over)
        return AbstractScalar(value.sources, frozenset(jumps), spikes, value.carriers)
    match value:
        case TupleValue(items):
            return TupleValue(tuple(_across(item, where) for item in items))
        case AbstractFunction(inputs, result, effects):
            return AbstractFunction(inputs, _across(result, where), effects)
        case _:
            return value


def _moved(surface: Surface, where: Mapping[Source, Surface | None]) -> Surface:
    """A surface across what arrives; empty if it is integrated over."""
    found: set[Source] = set()
    for source in surface:
        arrived = where.get(source, frozenset((source,)))
        if arrived is None:
            return frozenset()
        found |= arrived
    return frozenset(found)


def _later_effects(result: Value) -> list[Effect]:
    found: list[Effect] = []
    while isinstance(result, AbstractFunction):
        found += result.effects
        result = result.result
    return found


# Substituting


def substitute(value: Value, binding: Substitution) -> Value:
    """A value with what is bound put in."""
    values = binding.values
    if isinstance(value, AbstractScalar):
        if values.keys().isdisjoint(value.sources):
            return value
        return _substitute_scalar(value, values)
    match value:
        case TupleValue(items):
            return TupleValue(tuple(substitute(item, binding) for item in items))
        case ListValue(item):
            return ListValue(substitute(item, binding))
        case AbstractFunction(inputs, result, effects):
            inner = _not_hidden(binding, inputs)
            return AbstractFunction(inputs, substitute(result, inner), tuple(played(effects, inner)))
        case Abstract(ports, result, tainted):
            known = binding.abstracts.get(id(ports))
            if known is not None:
                return taint(known, _substitute_sources(tainted, values))
            return Abstract(ports, substitute(result, binding), _substitute_sources(tainted, values))
        case Choice(options):
            return joined(substitute(option, binding) for option in options)


def _not_hidden(binding: Substitution, inputs: tuple[Value, ...]) -> Substitution:
    """The binding inside a function, whose own inputs hide those outside (interfaces share their symbols)."""
    own = [source for source in inputs_of(inputs) if source in binding.values]
    if not own:
        return binding
    values = {source: value for source, value in binding.values.items() if source not in own}
    return Substitution(values, binding.functions, binding.ports, binding.abstracts)


def _substitute_sources(sources: Sources, values: dict[Source, Value]) -> Sources:
    if values.keys().isdisjoint(sources):
        return sources
    found: dict[Source, object] = {}
    for source, trail in sources.items():
        actual = values.get(source)
        if actual is None:
            found.setdefault(source, trail)
        else:
            for further, way in flat(actual).items():
                found.setdefault(further, then(way, trail))
    return found  # type: ignore[return-value]


def _substitute_scalar(value: AbstractScalar, values: dict[Source, Value]) -> Value:
    jumps, spikes = value.jumps, value.spikes
    if jumps:
        jumps = frozenset(_surfaces(jumps, values))
    if spikes:
        spikes = frozenset(Spike(_surface(spike.over, values), "") for spike in spikes)
    for source in value.sources:
        actual = values.get(source)
        if isinstance(actual, AbstractScalar):
            jumps, spikes = jumps | actual.jumps, spikes | actual.spikes
    if not value.carriers:
        return AbstractScalar(_substitute_sources(value.sources, values), jumps, spikes)
    carried = [values[source] for source in value.carriers if source in values]
    plain = {s: trail for s, trail in value.sources.items() if s not in value.carriers or s not in values}
    carriers = frozenset(source for source in value.carriers if source not in values)
    base = AbstractScalar(_substitute_sources(plain, values), jumps, spikes, carriers)
    if not carried:
        return base
    whole = joined(carried)
    return join(whole, base) if carriers else taint(whole, base.sources, base.jumps)


def _surfaces(surfaces: Iterable[Surface], values: dict[Source, Value]) -> Iterable[Surface]:
    for surface in surfaces:
        found = _surface(surface, values)
        if found:
            yield found


def _surface(surface: Surface, values: dict[Source, Value]) -> Surface:
    found: set[Source] = set()
    for source in surface:
        actual = values.get(source)
        found.update((source,) if actual is None else flat(actual))
    return frozenset(found)


# Effects


def played(effects: Iterable[Effect], binding: Substitution) -> list[Effect]:
    """Effects with what is bound put in; what reaches a function that is bound is played through it."""
    found: list[Effect] = []
    received: dict[Port, Value] = {}
    for effect in effects:
        value = substitute(effect.value, binding)
        if isinstance(effect.to, Port) and effect.to in binding.ports:
            before = received.get(effect.to)
            received[effect.to] = value if before is None else join(before, value)
        elif flat(value) or not isinstance(value, AbstractScalar):
            found.append(Effect(effect.to, value))
    if received:
        for actual, symbol, note in binding.functions:
            if any(port in received for port in ports_in((symbol,))):
                found += _replayed(actual, symbol, received, note)
    return found


def _replayed(actual: Value, symbol: Abstract, received: dict[Port, Value], note: Step | None) -> list[Effect]:
    result, effects = call(actual, [_arrived(tree, received) for tree in symbol.ports])
    if note is not None:
        effects = [Effect(effect.to, noted(effect.value, note)) for effect in effects]
    if isinstance(symbol.result, Abstract):
        effects += _replayed(result, symbol.result, received, note)
    return effects


def _received(effects: Iterable[Effect], binding: Substitution) -> dict[Port, Value]:
    received: dict[Port, Value] = {}
    for effect in effects:
        if isinstance(effect.to, Port):
            value = substitute(effect.value, binding)
            before = received.get(effect.to)
            received[effect.to] = value if before is None else join(before, value)
    return received


def _arrived(tree: PortTree, received: dict[Port, Value]) -> Value:
    """What arrived at ports, as the argument that it makes."""
    match tree:
        case Port():
            return received.get(tree, STILL)
        case PortTuple(items):
            return TupleValue(tuple(_arrived(item, received) for item in items))
        case PortFunction(inputs, result):
            return AbstractFunction(inputs, _arrived(result, received))
        case NoPort():
            return STILL
