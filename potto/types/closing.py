"""What a finished walk says of a definition's parameters: annotations that must hold, and why which must not vary."""

from __future__ import annotations

from collections.abc import Sequence

from potto.diagnostics import Related
from potto.modules.lookup import DefinitionTarget
from potto.syntax import nodes
from potto.types import kinds
from potto.types.algebra import flat, steps
from potto.types.flow import Walk
from potto.types.interfaces import PLAIN_KINDS, Closing, Decorating, chain_of
from potto.types.reasons import GivenVariable, Reason, Reasons
from potto.types.rules import REASON_TEXT
from potto.types.values import (
    Abstract,
    AbstractFunction,
    AbstractScalar,
    Effect,
    ListValue,
    Port,
    PortTree,
    PortTuple,
    Sink,
    Source,
    TupleValue,
    Value,
)


def declared(walk: Walk, groups: Sequence[Sequence[nodes.Parameter]], value: Value) -> Value:
    """Hold parameters to their annotations: `Real*` must accept what varies, `Real` takes only what does not."""
    if not isinstance(value, AbstractFunction) or not any(p.annotation for group in groups for p in group):
        return value
    closures = chain_of(value)
    effects = [effect for closure in closures for effect in closure.effects]
    checking = _Declared(walk, effects)
    for group, closure in zip(groups, closures):
        for parameter, symbol in zip(group, closure.inputs):
            if parameter.annotation is not None:
                checking.parameter(parameter.name, parameter.annotation, symbol)
    return AbstractFunction(value.inputs, value.result, (*value.effects, *checking.demands))


class _Declared:
    def __init__(self, walk: Walk, effects: Sequence[Effect]) -> None:
        self.walk = walk
        self.demands: list[Effect] = []
        self.sinks: dict[Source, Sink] = {}
        self.given: dict[Port, set[Source]] = {}
        for effect in effects:
            for source in flat(effect.value):
                if isinstance(effect.to, Port):
                    self.given.setdefault(effect.to, set()).add(source)
                elif effect.to.kind in PLAIN_KINDS or source not in self.sinks:
                    self.sinks[source] = effect.to

    def parameter(self, name: str, annotation: nodes.TypeExpr, symbol: Value) -> None:
        match annotation, symbol:
            case nodes.RealType(star=star), AbstractScalar(sources):
                for source in sources:
                    self._number(name, annotation, source, star)
            case nodes.TupleType(items=items), TupleValue(parts):
                for item, part in zip(items, parts):
                    self.parameter(name, item, part)
            case nodes.ArrayType(item=item), ListValue(part):
                for _ in annotation.sizes[1:]:
                    part = part.item if isinstance(part, ListValue) else part
                self.parameter(name, item, part)
            case nodes.FunctionType(parameters=parameters), Abstract(ports):
                for parameter, tree in zip(parameters, ports):
                    if parameter.annotation is not None:
                        self._port(name, parameter.annotation, tree)

    def _number(self, name: str, annotation: nodes.TypeExpr, source: Source, star: bool) -> None:
        sink = self.sinks.get(source)
        if not star and sink is None:
            self.demands.append(Effect(Sink("declared", annotation.span), AbstractScalar({source: None})))
        elif star and sink is not None and sink.kind in PLAIN_KINDS:
            related = (Related(sink.span, REASON_TEXT[sink.kind]),) if sink.origin is None else ()
            self.walk.report(
                kinds.ANNOTATION(
                    annotation.span,
                    f"`{name}` is declared to accept what varies, but it must not vary",
                    label="does not hold",
                    related=related,
                    help="declare it `Real`, or put the condition in brackets",
                )
            )

    def _port(self, name: str, annotation: nodes.TypeExpr, tree: PortTree) -> None:
        match annotation, tree:
            case nodes.RealType(star=False), Port():
                variables = [s for s in self.given.get(tree, ()) if s.kind == "variable"]
                if variables:
                    where = tuple(Related(s.span, f"`{s.name}` is bound here") for s in variables if s.origin is None)
                    self.walk.report(
                        kinds.ANNOTATION(
                            annotation.span,
                            f"`{name}` is declared to take what does not vary, but is given what does",
                            label="does not hold",
                            related=where,
                            help="declare it `Real*`",
                        )
                    )
            case nodes.TupleType(items=items), PortTuple(parts):
                for item, part in zip(items, parts):
                    self._port(name, item, part)


def reasons_of(value: Value, closing: Closing, decorating: Decorating) -> Reasons:
    """Why which inputs must not vary, and what is given to the functions among them."""
    plain: dict[tuple[str, int], Reason] = {}
    given: dict[int, GivenVariable] = {}
    for closure in chain_of(value):
        for effect in closure.effects:
            if isinstance(effect.to, Port):
                _note_given(effect, closing, given)
            elif effect.to.kind in PLAIN_KINDS:
                _note_reasons(effect, effect.to, closing, decorating, plain)
    return Reasons(tuple(plain.values()), tuple(given.values()))


def _note_reasons(
    effect: Effect, sink: Sink, closing: Closing, decorating: Decorating, plain: dict[tuple[str, int], Reason]
) -> None:
    for source, trail in flat(effect.value).items():
        own = closing.sources.get(source)
        if own is None or (sink.kind, own.number) in plain:
            continue
        way = steps(trail)
        further = (sink.origin, sink.number) if isinstance(sink.origin, DefinitionTarget) else None
        span, text = sink.span, REASON_TEXT[sink.kind]
        if further is not None:
            last = next((step for step in reversed(way) if step.argument), None)
            if last is not None:
                span, text = last.span, last.message
        name = decorating.roles.get(source, f"its parameter `{source.name}`")
        plain[sink.kind, own.number] = Reason(sink.kind, own.number, name, span, way, text, further)


def _note_given(effect: Effect, closing: Closing, given: dict[int, GivenVariable]) -> None:
    assert isinstance(effect.to, Port)
    port = closing.ports.get(effect.to)
    if port is None or port.number in given:
        return
    for source in flat(effect.value):
        if source.kind == "variable":
            further = (source.origin, source.number) if isinstance(source.origin, DefinitionTarget) else None
            given[port.number] = GivenVariable(port.number, source.name, source.span, further)
            return
