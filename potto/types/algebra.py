"""The algebra of abstract values: joining, tainting, integrating, and symbolic inputs.

Owns the plain functions over `Value`; what a call does is in `apply`, the derivative in `dualize`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from potto.types.types import ArrayOf, Diffeo, Function, TupleOf, Type, resolve
from potto.types.types import Dist as DistType
from potto.types.types import Real as RealType
from potto.types.types import Truth as TruthType
from potto.types.values import (
    NONE,
    STILL,
    Abstract,
    AbstractFunction,
    AbstractScalar,
    Choice,
    Effect,
    Joined,
    ListValue,
    NoPort,
    Port,
    PortFunction,
    PortTree,
    PortTuple,
    Source,
    Sources,
    Step,
    Surface,
    Trail,
    TupleValue,
    Value,
)


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


def fitted(value: Value, type: Type) -> Value:
    """A value in the shape of a type, with nothing in it that is deeper than the type.

    For recursion: the flow of a definition in terms of itself then grows in what it varies with only, which is finite.
    """
    type = resolve(type)
    match type, value:
        case Function(group, result), AbstractFunction(inputs, answer, effects) if len(group) == len(inputs):
            simple = (Effect(effect.to, _simple(effect.value)) for effect in effects)
            return AbstractFunction(inputs, fitted(answer, result), tuple(simple))
        case TupleOf(items), TupleValue(parts) if len(items) == len(parts):
            return TupleValue(tuple(map(fitted, parts, items)))
        case ArrayOf(_, item), ListValue(inner):
            return ListValue(fitted(inner, item))
        case Diffeo(), TupleValue(parts):
            return TupleValue(tuple(map(_simple, parts)))
        case _:
            return _simple(value)


def _simple(value: Value) -> Value:
    return value if isinstance(value, AbstractScalar) else AbstractScalar(flat(value))


def noted(value: Value, step: Step) -> Value:
    """A value whose dependences have gone one step further."""
    return _each(value, lambda s: {source: then(trail, step) for source, trail in s.items()})


def taint(value: Value, sources: Sources, jumps: frozenset[Surface] = frozenset()) -> Value:
    """A value that also varies with `sources` and jumps across `jumps`."""
    if not sources and not jumps:
        return value
    if isinstance(value, AbstractScalar):
        return AbstractScalar(merge(value.sources, sources), value.jumps | jumps, value.spikes, value.carriers)
    match value:
        case TupleValue(items):
            return TupleValue(tuple(taint(item, sources, jumps) for item in items))
        case ListValue(item):
            return ListValue(taint(item, sources, jumps))
        case AbstractFunction(inputs, result, effects):
            return AbstractFunction(inputs, taint(result, sources, jumps), effects)
        case Abstract(ports, result, tainted):
            return Abstract(ports, result, merge(tainted, sources))
        case Choice(options):
            return Choice(tuple(taint(option, sources, jumps) for option in options))


def _each(value: Value, change: Callable[[Sources], Sources]) -> Value:
    if isinstance(value, AbstractScalar):
        if not value.sources:
            return value
        return AbstractScalar(change(value.sources), value.jumps, value.spikes, value.carriers)
    match value:
        case TupleValue(items):
            return TupleValue(tuple(_each(item, change) for item in items))
        case ListValue(item):
            return ListValue(_each(item, change))
        case AbstractFunction(inputs, result, effects):
            return AbstractFunction(inputs, _each(result, change), effects)
        case Abstract(ports, result, tainted):
            return Abstract(ports, _each(result, change), change(tainted))
        case Choice(options):
            return Choice(tuple(_each(option, change) for option in options))


def without(value: Value, variables: frozenset[Source]) -> Value:
    """A value after integration over `variables`: they are gone, and so are the surfaces and deltas across them."""
    if isinstance(value, AbstractScalar):
        if not value.sources:
            return value
        left = {source: trail for source, trail in value.sources.items() if source not in variables}
        jumps, spikes = value.jumps, value.spikes
        if jumps:
            jumps = frozenset(surface for surface in jumps if not surface & variables)
        if spikes:
            spikes = frozenset(spike for spike in spikes if not spike.over & variables)
        return AbstractScalar(left, jumps, spikes, value.carriers)
    match value:
        case TupleValue(items):
            return TupleValue(tuple(without(item, variables) for item in items))
        case ListValue(item):
            return ListValue(without(item, variables))
        case _:
            return _each(value, lambda s: {source: trail for source, trail in s.items() if source not in variables})


def flat(value: Value) -> Sources:
    """All that a value varies with; of a function, whatever it is called with."""
    if isinstance(value, AbstractScalar):  # nearly always, and a `match` takes five times as long to see it
        return value.sources
    match value:
        case TupleValue(items) | Choice(items):
            found: Sources = NONE
            for item in items:
                found = merge(found, flat(item))
            return found
        case ListValue(item):
            return flat(item)
        case AbstractFunction(inputs, result):
            own = set(inputs_of(inputs))
            return {source: trail for source, trail in flat(result).items() if source not in own}
        case Abstract(_, result, tainted):
            return merge(flat(result), tainted)


def jumps_of(value: Value) -> frozenset[Surface]:
    return value.jumps if isinstance(value, AbstractScalar) else frozenset()


def join(a: Value, b: Value) -> Value:
    """Either of two values."""
    if a is b:
        return a
    if isinstance(a, AbstractScalar) and isinstance(b, AbstractScalar):
        sources = merge(a.sources, b.sources)
        return AbstractScalar(sources, a.jumps | b.jumps, a.spikes | b.spikes, a.carriers | b.carriers)
    match a, b:
        case TupleValue(), TupleValue() if len(a.items) == len(b.items):
            return TupleValue(tuple(join(x, y) for x, y in zip(a.items, b.items)))
        case ListValue(), ListValue():
            return ListValue(join(a.item, b.item))
        case AbstractScalar(), TupleValue() | ListValue():
            return taint(b, a.sources, a.jumps)
        case TupleValue() | ListValue(), AbstractScalar():
            return taint(a, b.sources, b.jumps)
        case (AbstractFunction() | Abstract() | Choice(), _) | (_, AbstractFunction() | Abstract() | Choice()):
            return Choice((*_options(a), *_options(b)))
        case _:
            return AbstractScalar(merge(flat(a), flat(b)))


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
    if isinstance(type, RealType):
        return AbstractScalar({source(): None})
    match type:
        case DistType() | TruthType():
            return AbstractScalar({source(): None})
        case TupleOf(items):
            return TupleValue(tuple(symbolic(item, source, port) for item in items))
        case ArrayOf(_, item):
            return ListValue(symbolic(item, source, port))
        case Diffeo(dims) if dims is not None:
            return TupleValue(tuple(AbstractScalar({source(): None}) for _ in range(dims)))
        case Function(group, result):
            ports = tuple(ports_of(p.type, source, port) for p in group)
            return Abstract(ports, symbolic(result, source, port))
        case _:
            own = source()
            return AbstractScalar({own: None}, carriers=frozenset((own,)))


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
        if isinstance(value, AbstractScalar):
            found += value.sources
            continue
        match value:
            case TupleValue(items) | Choice(items):
                found += inputs_of(items)
            case ListValue(item):
                found += inputs_of((item,))
            case Abstract(ports, result):
                for port in ports:
                    found += inputs_of_ports(port)
                found += inputs_of((result,))
            case AbstractFunction():
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
        if isinstance(value, AbstractScalar):
            continue
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


def still(type: Type) -> Value:
    """The value of what varies with nothing, in the shape of its type."""
    found = resolve(type)
    if isinstance(found, TupleOf):
        return TupleValue(tuple(map(still, found.items)))
    return ListValue(still(found.item)) if isinstance(found, ArrayOf) else STILL
