"""What others read of a definition: its type and its flow, and nothing that a body edit moves.

Owns `Interface` and its closing: sources, ports and sinks are replaced by interned ones with numbers, ways are dropped,
so that an edit which changes neither type nor dependence gives an equal interface. Why a parameter must be plain is a
question of its own (`queries.plain_reasons`), asked only when a message is built.
"""

from __future__ import annotations

import copyreg
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache, lru_cache
from operator import attrgetter
from typing import Any, Literal

from msgspec.structs import replace

from potto.core.packing import found_by
from potto.modules.lookup import DefinitionTarget
from potto.types.algebra import flat, inputs_of, inputs_of_ports, join, ports_in
from potto.types.types import (
    REAL,
    UNKNOWN,
    ArrayOf,
    Dist,
    Function,
    Parameter,
    Real,
    TupleOf,
    Type,
    groups_of,
    result_of,
    with_items,
)
from potto.types.values import (
    HAZE,
    HAZY,
    NONE,
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
    SinkKind,
    Source,
    Spike,
    Surface,
    TupleValue,
    Value,
)

STARRED = Real(star=True)
_number = attrgetter("number")
PLAIN_KINDS: tuple[SinkKind, ...] = ("condition", "jump", "sum", "count", "index", "equality", "declared")


@dataclass(frozen=True, slots=True)
class Interface:
    """A definition as others see it.

    `plain`: the names of the parameters that must not vary. `varies`: those that the result varies with. `flow` is for
    the checker: what goes where. `diffeo`: declared a diffeomorphism. `broken`: the text could not be read; the type is
    the best guess, and fits everything where the definition is used. `derivative`: nothing but the derivative of a
    function.
    """

    name: str
    type: Type
    flow: Value = field(default=HAZY, hash=False, repr=False)
    plain: tuple[str, ...] = ()
    varies: tuple[str, ...] = ()
    diffeo: bool = False
    broken: bool = False
    derivative: bool = False

    @property
    def groups(self) -> tuple[tuple[str | None, ...], ...]:
        """The names of the parameters, group by group; None where they have no names."""
        return tuple(tuple(parameter.name for parameter in group) for group in groups_of(self.type))

    @property
    def result(self) -> Type:
        """What the definition gives when it has all its arguments; of a value, its type."""
        return result_of(self.type)


def unknown_interface(name: str) -> Interface:
    """The interface of what is broken beyond reading: fits everywhere."""
    return Interface(name, UNKNOWN, broken=True)


@cache
def _source(number: int) -> Source:
    return Source("input", f"#{number}", number=number)


@cache
def _port(number: int) -> Port:
    return Port(f"#{number}", number=number)


@cache
def _sink(kind: SinkKind, number: int) -> Sink:
    return Sink(kind, number=number)


@lru_cache(maxsize=16384)
def _closed(
    sources: tuple[Source, ...],
    jumps: frozenset[Surface] = frozenset(),
    spikes: frozenset[Spike] = frozenset(),
    carriers: frozenset[Source] = frozenset(),
) -> AbstractScalar:
    """A number in an interface. Most interfaces have the same few, so that each is there once."""
    return AbstractScalar(dict.fromkeys(sources) or NONE, jumps, spikes, carriers)


@cache
def _demand(kind: SinkKind, number: int) -> Effect:
    """An interface's input goes where nothing may vary."""
    return Effect(_sink(kind, number), _closed((_source(number),)))


VARYING = Source("variable", "", number=-2)
_NAMED = {"HAZE": HAZE, "VARYING": VARYING}


def _symbol(kind: Literal["named", "source", "port", "sink"], *made_of: Any) -> Any:
    """The only copy of an interface's symbol in this process, found by what `_told` says of it."""
    find: dict[str, Callable[..., Any]] = {"named": _NAMED.__getitem__, "source": _source, "port": _port, "sink": _sink}
    return find[kind](*made_of)


def _told(symbol: Any) -> tuple[Any, ...]:
    """How a symbol is pickled. Those of interfaces are told by their numbers, for they are compared by identity."""
    for name, named in _NAMED.items():
        if symbol is named:
            return _symbol, ("named", name)
    if isinstance(symbol, Sink):
        if symbol is _sink(symbol.kind, symbol.number):
            return _symbol, ("sink", symbol.kind, symbol.number)
        return Sink, (symbol.kind, symbol.span, symbol.number, symbol.origin, symbol.node)
    if isinstance(symbol, Source):
        if symbol is _source(symbol.number):
            return _symbol, ("source", symbol.number)
        return Source, (symbol.kind, symbol.name, symbol.span, symbol.number, symbol.origin)
    assert isinstance(symbol, Port)
    if symbol is _port(symbol.number):
        return _symbol, ("port", symbol.number)
    return Port, (symbol.name, symbol.number, symbol.origin)


found_by(_symbol)
for _kind in (Source, Port, Sink):
    copyreg.pickle(_kind, _told)


def chain_of(value: Value) -> list[AbstractFunction]:
    """The groups of a function that is known."""
    found: list[AbstractFunction] = []
    while isinstance(value, AbstractFunction):
        found.append(value)
        value = value.result
    return found


class Closing:
    """Numbers the inputs and ports of a flow, and rewrites it with the interned ones."""

    def __init__(self, value: Value) -> None:
        inputs = [symbol for closure in chain_of(value) for symbol in closure.inputs]
        self.sources: dict[Source, Source] = {s: _source(n) for n, s in enumerate(inputs_of(inputs))}
        self.ports: dict[Port, Port] = {p: _port(n) for n, p in enumerate(ports_in(inputs))}
        self._trees: dict[int, tuple[PortTree, ...]] = {}

    def value(self, value: Value) -> Value:
        if isinstance(value, AbstractScalar):
            return self._scalar(value)
        match value:
            case AbstractFunction(inputs, result, effects):
                for source in inputs_of(inputs):  # a function inside a choice or a list has numbers of its own
                    self.sources.setdefault(source, _source(len(self.sources)))
                return AbstractFunction(tuple(map(self.value, inputs)), self.value(result), self._effects(effects))
            case TupleValue(items):
                return TupleValue(tuple(map(self.value, items)))
            case ListValue(item):
                return ListValue(self.value(item))
            case Abstract(ports, result, taint):
                trees = tuple(map(self._tree, ports))
                trees = self._trees.setdefault(id(ports), trees)  # the identity of ports is that of the function
                known = {self.sources[source]: None for source in taint if source in self.sources}
                return Abstract(trees, self.value(result), known)
            case Choice(options):
                return Choice(tuple(map(self.value, options)))

    def _scalar(self, value: AbstractScalar, variables: bool = False) -> AbstractScalar:
        known = self.sources
        sources = [known[source] for source in value.sources if source in known]
        if len(sources) > 1:
            sources = sorted(set(sources), key=_number)
        if variables and any(source.kind == "variable" for source in value.sources):
            sources.append(VARYING)
        if not value.jumps and not value.spikes and not value.carriers:
            return _closed(tuple(sources))
        jumps = frozenset(filter(None, map(self._surface, value.jumps)))
        spikes = frozenset(Spike(self._surface(spike.over), "") for spike in value.spikes)
        carriers = frozenset(known[s] for s in value.carriers if s in known)
        return _closed(tuple(sources), jumps, spikes, carriers)

    def _surface(self, surface: Surface) -> Surface:
        return frozenset(self.sources[source] for source in surface if source in self.sources)

    def _effects(self, effects: Sequence[Effect]) -> tuple[Effect, ...]:
        """One effect for each kind of sink and source, and one for each port, in the order of numbers."""
        sinks: dict[tuple[SinkKind, int], Effect] = {}
        ports: dict[int, Effect] = {}
        for effect in effects:
            if isinstance(effect.to, Sink):
                for source in flat(effect.value):
                    own = self.sources.get(source)
                    if own is not None:
                        key = (effect.to.kind, own.number)
                        sinks[key] = _demand(*key)
            else:
                port = self.ports.get(effect.to)
                if port is not None:
                    value = self._payload(effect.value)
                    before = ports.get(port.number)
                    ports[port.number] = Effect(port, value if before is None else _both(before.value, value))
        return (*(sinks[key] for key in sorted(sinks)), *(ports[number] for number in sorted(ports)))

    def _payload(self, value: Value) -> Value:
        return self._scalar(value, variables=True) if isinstance(value, AbstractScalar) else self.value(value)

    def _tree(self, tree: PortTree) -> PortTree:
        match tree:
            case Port():
                return self.ports.get(tree, tree)
            case PortTuple(items):
                return PortTuple(tuple(map(self._tree, items)))
            case PortFunction(inputs, result):
                return PortFunction(tuple(map(self.value, inputs)), self._tree(result))
            case NoPort():
                return tree


def _both(a: Value, b: Value) -> Value:
    both = join(a, b)
    if isinstance(both, AbstractScalar):
        return replace(both, sources=dict(sorted(both.sources.items(), key=lambda item: item[0].number)))
    return both


# Another definition's flow, in the one that uses it


def localized(value: Value, target: DefinitionTarget) -> Value:
    """An interface's flow with its sinks and its variables of integration marked as those of `target`."""
    match value:
        case AbstractFunction(inputs, result, effects):
            moved = tuple(_localized_effect(effect, target) for effect in effects)
            return AbstractFunction(inputs, localized(result, target), moved)
        case Choice(options):
            return Choice(tuple(localized(option, target) for option in options))
        case ListValue(item):
            return ListValue(localized(item, target))
        case _:
            return value


def _localized_effect(effect: Effect, target: DefinitionTarget) -> Effect:
    if isinstance(effect.to, Sink):
        if effect.to.origin is not None:
            return effect
        return Effect(Sink(effect.to.kind, number=effect.to.number, origin=target), effect.value)
    value = effect.value
    if isinstance(value, AbstractScalar) and VARYING in value.sources:
        theirs = Source("variable", "", number=effect.to.number, origin=target)
        sources = {theirs if source is VARYING else source: trail for source, trail in value.sources.items()}
        return Effect(effect.to, replace(value, sources=sources))
    return effect


# The type as it is printed


class Decorating:
    """Puts into a type what the flow says of variation: `Real*`, `Dist`, where a result jumps."""

    def __init__(self, value: Value) -> None:
        closures = chain_of(value)
        effects = [effect for closure in closures for effect in closure.effects]
        self.settled = {s for e in effects if isinstance(e.to, Sink) for s in flat(e.value)}
        self.plain = {s for e in effects if isinstance(e.to, Sink) and e.to.kind in PLAIN_KINDS for s in flat(e.value)}
        self.given: dict[Port, set[Source]] = {}
        for effect in effects:
            if isinstance(effect.to, Port):
                self.given.setdefault(effect.to, set()).update(flat(effect.value))
        self.inputs = set(inputs_of([symbol for closure in closures for symbol in closure.inputs]))
        self.names: dict[Source, str] = {}
        self.roles: dict[Source, str] = {}

    def type(self, type: Type, value: Value) -> Type:
        if isinstance(value, AbstractScalar):
            return self._result(value) if isinstance(type, Real) else type
        if isinstance(type, Function) and isinstance(value, Choice):
            value = value.options[0]
        match type, value:
            case Function(group, result), AbstractFunction(inputs, answer):
                regrouped = inputs if len(inputs) == len(group) else ()
                for parameter, symbol in zip(group, regrouped):
                    self._name(parameter.name or "_", symbol)
                parameters = self._parameters(group, regrouped)
                return Function(parameters, self.type(result, answer))
            case Function(), Abstract():
                return self._input(type, value, self.settled)
            case ArrayOf(size, item), ListValue(inner):
                return ArrayOf(size, self.type(item, inner))
            case TupleOf(items), TupleValue(parts) if len(items) == len(parts):
                return with_items(type, tuple(map(self.type, items, parts)))
            case _:
                return type

    def _name(self, name: str, symbol: Value) -> None:
        """Note which parameter an input belongs to, and what of it the input is."""
        for source in inputs_of((symbol,)):
            self.names[source] = name
            self.roles[source] = f"its parameter `{name}`"
        if isinstance(symbol, Abstract):
            for source in inputs_of((symbol,)):
                self.roles[source] = f"what its parameter `{name}` gives"
            for tree in symbol.ports:
                for source in inputs_of_ports(tree):
                    self.roles[source] = f"what its parameter `{name}` passes on"

    def _parameters(self, group: tuple[Parameter, ...], inputs: Sequence[Value]) -> tuple[Parameter, ...]:
        if not inputs:
            return group
        return tuple(Parameter(p.name, self._input(p.type, s, self.settled)) for p, s in zip(group, inputs))

    def _result(self, value: AbstractScalar) -> Type:
        if value.spikes:
            return Dist(self._over(spike.over for spike in value.spikes))
        return Real(jumps=self._over(value.jumps)) if value.jumps else REAL

    def _over(self, surfaces: object) -> tuple[str, ...]:
        assert hasattr(surfaces, "__iter__")
        found = {source for surface in surfaces for source in surface}
        order = {source: place for place, source in enumerate(self.names)}
        known = sorted((source for source in found if source in order), key=order.__getitem__)
        return tuple(dict.fromkeys(self.names[source] for source in known if source not in self.plain))

    def _input(self, type: Type, value: Value, still: set[Source] | None) -> Type:
        """The type of an input. `still`: the sources at which it is `Real`; None where no star is printed."""
        if isinstance(type, Real) and isinstance(value, AbstractScalar):
            return REAL if still is None or not still.isdisjoint(value.sources) else STARRED
        match type, value:
            case TupleOf(items), TupleValue(parts) if len(items) == len(parts):
                return with_items(type, tuple(self._input(item, part, still) for item, part in zip(items, parts)))
            case ArrayOf(size, item), ListValue(part):
                return ArrayOf(size, self._input(item, part, still))
            case Function(group, result), Abstract(ports, answer) if len(group) == len(ports):
                parameters = (Parameter(None, self._given(p.type, tree)) for p, tree in zip(group, ports))
                return Function(tuple(parameters), self._input(result, answer, None))
            case Function(group, result), _:
                return Function(tuple(Parameter(None, p.type) for p in group), result)
            case _:
                return type

    def _given(self, type: Type, tree: PortTree) -> Type:
        match type, tree:
            case Real(), Port():
                return Real(star=any(self._varies(source) for source in self.given.get(tree, ())))
            case TupleOf(items), PortTuple(parts) if len(items) == len(parts):
                return with_items(type, tuple(self._given(item, part) for item, part in zip(items, parts)))
            case Function(group, result), PortFunction(inputs) if len(group) == len(inputs):
                parameters = (Parameter(None, self._input(p.type, s, self.plain)) for p, s in zip(group, inputs))
                return Function(tuple(parameters), result)
            case _:
                return type

    def _varies(self, source: Source) -> bool:
        return source.kind == "variable" or (source in self.inputs and source not in self.settled)
