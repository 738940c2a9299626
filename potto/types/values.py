"""What a value depends on: abstract values with the shape of a type and, at each number, where it comes from.

Owns `Value` and its algebra. A `Source` is a variable of integration or an input of a function. A `Closure` is a
function that is known: symbolic inputs, its result in terms of them, and effects: what it demands of them (`Sink`) and
what it passes to the functions among them (`Port`). An `Abstract` is a function that is an input itself: it has ports
for what it is given and a symbolic result. It is assumed that what an unknown function gives varies with all that it is
given; so every call is judged by itself, and a function can be judged without its callers.

An interface is a `Closure` whose sources are interned by number, so that equal interfaces are equal values.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Literal

from potto.source import Span
from potto.types.types import Diffeo, Function, ListOf, TupleOf, Type, resolve
from potto.types.types import Dist as DistType
from potto.types.types import Real as RealType
from potto.types.types import Truth as TruthType

SourceKind = Literal["variable", "input", "other"]  # other: the index of a sum, or what is wrong
SinkKind = Literal["condition", "jump", "sum", "equality", "declared", "integral", "delta"]


NOWHERE = Span(0, 0)


@dataclass(eq=False, slots=True)
class Source:
    """Where variation comes from. `number` is set for those of an interface; `origin` for another definition's."""

    kind: SourceKind
    name: str
    span: Span = NOWHERE
    number: int = -1
    origin: object = None

    def __repr__(self) -> str:
        return f"<{self.kind} {self.name}>"


@dataclass(frozen=True, slots=True)
class Step:
    """One step on the way of a dependence: a place and what happens there."""

    span: Span
    message: str
    argument: bool = False


@dataclass(frozen=True, slots=True)
class Joined:
    """A way made of two ways."""

    first: Trail
    second: Trail


Trail = Step | Joined | None
Sources = Mapping[Source, Trail]
Surface = frozenset[Source]


@dataclass(frozen=True, slots=True)
class Spike:
    """A delta: what its surface varies with, and a key that is the same for the same surface."""

    over: Surface
    key: str


@dataclass(frozen=True, slots=True)
class Scalar:
    """A number, a truth value or anything whose inside is not known.

    `carriers`: sources of unknown type that it may be itself (the rest only decides which). `jumps`: the surfaces
    across which it jumps; of a truth value, those of its comparisons. `spikes`: its deltas; of a truth value, its
    equalities.
    """

    sources: Sources
    jumps: frozenset[Surface] = frozenset()
    spikes: frozenset[Spike] = frozenset()
    carriers: frozenset[Source] = frozenset()


@dataclass(frozen=True, slots=True)
class TupleValue:
    items: tuple[Value, ...]


@dataclass(frozen=True, slots=True)
class ListValue:
    item: Value


@dataclass(eq=False, slots=True)
class Port:
    """A place where an unknown function is given something."""

    name: str
    number: int = -1
    origin: object = None


@dataclass(frozen=True, slots=True)
class PortTuple:
    items: tuple[PortTree, ...]


@dataclass(frozen=True, slots=True)
class PortFunction:
    """A function is given: `inputs` is what it will be called with, `result` gets what it gives."""

    inputs: tuple[Value, ...]
    result: PortTree


@dataclass(frozen=True, slots=True)
class NoPort:
    """What is given here is not looked at (a tangent)."""


PortTree = Port | PortTuple | PortFunction | NoPort


@dataclass(eq=False, slots=True)
class Sink:
    """A place that must not vary. `origin` tells the definition of a place elsewhere, `number` its input there."""

    kind: SinkKind
    span: Span = NOWHERE
    number: int = -1
    origin: object = None
    node: object = None


@dataclass(frozen=True, slots=True)
class Effect:
    """`value` goes to `to` when the function is called."""

    to: Sink | Port
    value: Value


@dataclass(frozen=True, slots=True)
class Closure:
    inputs: tuple[Value, ...]
    result: Value
    effects: tuple[Effect, ...] = ()


@dataclass(frozen=True, slots=True)
class Abstract:
    """A function that is an input. `taint`: what it was given in earlier groups."""

    ports: tuple[PortTree, ...]
    result: Value
    taint: Sources = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Choice:
    """One of several functions (the items of a list)."""

    options: tuple[Value, ...]


Value = Scalar | TupleValue | ListValue | Closure | Abstract | Choice

NONE: Sources = {}
STILL = Scalar(NONE)
HAZY = Scalar({Source("other", "?"): None})  # what is wrong: varies with it knows what, and breaks no rule


def merge(a: Sources, b: Sources) -> Sources:
    """Both; the way that was found first stays."""
    if not b or a is b:
        return a
    if not a:
        return b
    if b.keys() <= a.keys():
        return a
    return {**b, **a}


def then(first: Trail, second: Trail) -> Trail:
    if first is None:
        return second
    return first if second is None else Joined(first, second)


def steps(trail: Trail) -> tuple[Step, ...]:
    """The steps of a way, in order."""
    found: list[Step] = []
    stack: list[Trail] = [trail]
    while stack:
        part = stack.pop()
        if isinstance(part, Joined):
            stack += (part.second, part.first)
        elif part is not None and part not in found[-1:]:
            found.append(part)
    return tuple(found)


def larger(value: Value, limit: int) -> bool:
    """Whether a value has more than `limit` parts; counted no further than that."""
    stack: list[Value] = [value]
    while stack and limit >= 0:
        limit -= 1
        part = stack.pop()
        match part:
            case TupleValue(items):
                stack.extend(items)
            case ListValue(item):
                stack.append(item)
            case Closure(inputs, result):
                stack.extend((*inputs, result))
            case _:
                pass
    return limit < 0


def noted(value: Value, step: Step) -> Value:
    """A value whose dependences have gone one step further."""
    return _each(value, lambda s: {source: then(trail, step) for source, trail in s.items()})


def taint(value: Value, sources: Sources, jumps: frozenset[Surface] = frozenset()) -> Value:
    """A value that also varies with `sources` and jumps across `jumps`."""
    if not sources and not jumps:
        return value
    match value:
        case Scalar():
            return Scalar(merge(value.sources, sources), value.jumps | jumps, value.spikes, value.carriers)
        case TupleValue(items):
            return TupleValue(tuple(taint(item, sources, jumps) for item in items))
        case ListValue(item):
            return ListValue(taint(item, sources, jumps))
        case Closure(inputs, result, effects):
            return Closure(inputs, taint(result, sources, jumps), effects)
        case Abstract(ports, result, tainted):
            return Abstract(ports, result, merge(tainted, sources))
        case Choice(options):
            return Choice(tuple(taint(option, sources, jumps) for option in options))


def _each(value: Value, change: Callable[[Sources], Sources]) -> Value:
    match value:
        case Scalar():
            if not value.sources:
                return value
            return Scalar(change(value.sources), value.jumps, value.spikes, value.carriers)
        case TupleValue(items):
            return TupleValue(tuple(_each(item, change) for item in items))
        case ListValue(item):
            return ListValue(_each(item, change))
        case Closure(inputs, result, effects):
            return Closure(inputs, _each(result, change), effects)
        case Abstract(ports, result, tainted):
            return Abstract(ports, _each(result, change), change(tainted))
        case Choice(options):
            return Choice(tuple(_each(option, change) for option in options))


def without(value: Value, variables: frozenset[Source]) -> Value:
    """A value after integration over `variables`: they are gone, and so are the surfaces and deltas across them."""
    match value:
        case Scalar(sources, jumps, spikes, carriers):
            if not sources:
                return value
            left = {source: trail for source, trail in sources.items() if source not in variables}
            return Scalar(
                left,
                frozenset(surface for surface in jumps if not surface & variables),
                frozenset(spike for spike in spikes if not spike.over & variables),
                carriers,
            )
        case TupleValue(items):
            return TupleValue(tuple(without(item, variables) for item in items))
        case ListValue(item):
            return ListValue(without(item, variables))
        case _:
            return _each(value, lambda s: {source: trail for source, trail in s.items() if source not in variables})


def flat(value: Value) -> Sources:
    """All that a value varies with; of a function, whatever it is called with."""
    match value:
        case Scalar(sources):
            return sources
        case TupleValue(items) | Choice(items):
            found: Sources = NONE
            for item in items:
                found = merge(found, flat(item))
            return found
        case ListValue(item):
            return flat(item)
        case Closure(inputs, result):
            own = set(inputs_of(inputs))
            return {source: trail for source, trail in flat(result).items() if source not in own}
        case Abstract(_, result, tainted):
            return merge(flat(result), tainted)


def spikes_of(value: Value) -> frozenset[Spike]:
    return value.spikes if isinstance(value, Scalar) else frozenset()


def jumps_of(value: Value) -> frozenset[Surface]:
    return value.jumps if isinstance(value, Scalar) else frozenset()


def join(a: Value, b: Value) -> Value:
    """Either of two values."""
    if a is b:
        return a
    match a, b:
        case Scalar(), Scalar():
            sources = merge(a.sources, b.sources)
            return Scalar(sources, a.jumps | b.jumps, a.spikes | b.spikes, a.carriers | b.carriers)
        case TupleValue(), TupleValue() if len(a.items) == len(b.items):
            return TupleValue(tuple(join(x, y) for x, y in zip(a.items, b.items)))
        case ListValue(), ListValue():
            return ListValue(join(a.item, b.item))
        case Scalar(), TupleValue() | ListValue():
            return taint(b, a.sources, a.jumps)
        case TupleValue() | ListValue(), Scalar():
            return taint(a, b.sources, b.jumps)
        case (Closure() | Abstract() | Choice(), _) | (_, Closure() | Abstract() | Choice()):
            return Choice((*_options(a), *_options(b)))
        case _:
            return Scalar(merge(flat(a), flat(b)))


def _options(value: Value) -> tuple[Value, ...]:
    return value.options if isinstance(value, Choice) else (value,)


def joined(values: Iterable[Value]) -> Value:
    found: Value = STILL
    for value in values:
        found = value if found is STILL else join(found, value)
    return found


# Symbolic inputs


def symbolic(type: Type, source: Callable[[], Source], port: Callable[[], Port]) -> Value:
    """The input of a type, with a source of its own at each number, and ports where it is a function."""
    type = resolve(type)
    match type:
        case RealType() | DistType() | TruthType():
            return Scalar({source(): None})
        case TupleOf(items):
            return TupleValue(tuple(symbolic(item, source, port) for item in items))
        case ListOf(item):
            return ListValue(symbolic(item, source, port))
        case Diffeo(dims) if dims is not None:
            return TupleValue(tuple(Scalar({source(): None}) for _ in range(dims)))
        case Function(group, result):
            ports = tuple(ports_of(p.type, source, port) for p in group)
            return Abstract(ports, symbolic(result, source, port))
        case _:
            own = source()
            return Scalar({own: None}, carriers=frozenset((own,)))


def ports_of(type: Type, source: Callable[[], Source], port: Callable[[], Port]) -> PortTree:
    """The ports for an argument of a type."""
    type = resolve(type)
    match type:
        case TupleOf(items):
            return PortTuple(tuple(ports_of(item, source, port) for item in items))
        case Function(group, result):
            inputs = tuple(symbolic(p.type, source, port) for p in group)
            return PortFunction(inputs, ports_of(result, source, port))
        case _:
            return port()


def inputs_of(values: Iterable[Value]) -> list[Source]:
    """The sources of symbolic inputs, in order."""
    found: list[Source] = []
    for value in values:
        match value:
            case Scalar(sources):
                found += sources
            case TupleValue(items) | Choice(items):
                found += inputs_of(items)
            case ListValue(item):
                found += inputs_of((item,))
            case Abstract(ports, result):
                for port in ports:
                    found += inputs_of_ports(port)
                found += inputs_of((result,))
            case Closure():
                pass
    return found


def inputs_of_ports(tree: PortTree) -> list[Source]:
    """What a function that is given here will be called with."""
    match tree:
        case PortTuple(items):
            return [source for item in items for source in inputs_of_ports(item)]
        case PortFunction(inputs, result):
            return [*inputs_of(inputs), *inputs_of_ports(result)]
        case _:
            return []


def ports_in(values: Iterable[Value]) -> list[Port]:
    """The ports of symbolic inputs, in order."""
    found: list[Port] = []
    for value in values:
        match value:
            case TupleValue(items) | Choice(items):
                found += ports_in(items)
            case ListValue(item):
                found += ports_in((item,))
            case Abstract(ports, result):
                for port in ports:
                    found += _ports_in_tree(port)
                found += ports_in((result,))
            case _:
                pass
    return found


def _ports_in_tree(tree: PortTree) -> list[Port]:
    match tree:
        case Port():
            return [tree]
        case PortTuple(items):
            return [port for item in items for port in _ports_in_tree(item)]
        case PortFunction(inputs, result):
            return [*ports_in(inputs), *_ports_in_tree(result)]
        case NoPort():
            return []
