"""What depends on what: a walk over an expression whose types are known.

Owns `Walk`: it evaluates expressions to abstract values and notes what must not vary. A place that must not vary and is
reached by a variable of integration breaks a rule (worded in `rules`); reached by an input of the function around it,
it becomes a demand on that input, an effect of calling the function. Functions are walked once, where they are written.
Rules by node are here and in `flow_calls` and `flow_binders`, registered by `walks`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

from msgspec import Struct

from potto.diagnostics import Diagnostic
from potto.modules.lookup import DefinitionTarget
from potto.source import Span
from potto.syntax import nodes
from potto.types.algebra import (
    flat,
    inputs_of,
    noted,
    ports_in,
    symbolic,
)
from potto.types.context import Inference
from potto.types.interfaces import localized
from potto.types.rules import Violation, violation
from potto.types.scope import Local
from potto.types.values import (
    AbstractFunction,
    AbstractScalar,
    Effect,
    Port,
    Sink,
    SinkKind,
    Source,
    Sources,
    Step,
    TupleValue,
    Value,
)

WALKS: dict[type, Callable[[Walk, Any], Value]] = {}
F = TypeVar("F", bound=Callable[..., Value])


def walks(*node_types: type) -> Callable[[F], F]:
    """Register the rule that evaluates nodes of these types."""

    def register(function: F) -> F:
        for node_type in node_types:
            WALKS[node_type] = function
        return function

    return register


@dataclass(eq=False, repr=False)
class Frame:
    """A function (or definition) being walked: what is its own, and what happens when it is called."""

    inputs: set[Source] = field(default_factory=set)
    ports: set[Port] = field(default_factory=set)
    effects: list[Effect] = field(default_factory=list)
    noted: set[tuple[object, Source]] = field(default_factory=set)


class Surfaces(Struct, frozen=True):
    """A diffeomorphic condition that was met: for the lints on what moves it."""

    span: Span
    sources: frozenset[Source]


class Walk:
    """Evaluates the expressions of one definition (or statement) to abstract values."""

    def __init__(self, inference: Inference, members: dict[DefinitionTarget, Value]) -> None:
        self.inference, self.members = inference, members
        self.locals: dict[Local, Value] = {}
        self.frames = [Frame()]
        self.diagnostics: list[Diagnostic] = []
        self.places: dict[int, Value] = {}
        self.surfaces: list[Surfaces] = []
        self._globals: dict[DefinitionTarget, Value] = {}
        self._reported: set[tuple[str, Span]] = set()

    def value(self, expr: nodes.Expr) -> Value:
        """The abstract value of an expression."""
        return WALKS[expr.__class__](self, expr)

    # What happens

    def report(self, diagnostic: Diagnostic) -> None:
        """Report, once a place."""
        if (diagnostic.code, diagnostic.span) not in self._reported:
            self._reported.add((diagnostic.code, diagnostic.span))
            self.diagnostics.append(diagnostic)

    def sink(self, kind: SinkKind, span: Span, value: Value, node: object = None) -> None:
        """Note that `value` goes where nothing may vary."""
        if flat(value):
            self.emit((Effect(Sink(kind, span, node=node), value),), span)

    def emit(self, effects: Iterable[Effect], span: Span) -> None:
        """Look at what happens: variables of integration break rules, inputs become demands of the function here."""
        for effect in effects:
            if isinstance(effect.to, Sink):
                self._demand(effect.to, flat(effect.value), span)
            else:
                self.frames[-1].effects.append(effect)

    def _demand(self, sink: Sink, sources: Sources, span: Span) -> None:
        frame = self.frames[-1]
        broken: dict[Source, Any] = {}
        demanded: dict[Source, Any] = {}
        key: object = sink if sink.kind != "integral" else sink.kind
        for source, trail in sources.items():
            if source.kind == "variable":
                broken[source] = trail
            elif source.kind == "input" and (key, source) not in frame.noted:
                frame.noted.add((key, source))
                demanded[source] = trail
        if broken and sink.kind != "integral":
            self.report(violation(self.inference, Violation(sink, broken, span)))
        if demanded:
            frame.effects.append(Effect(sink, AbstractScalar(demanded)))

    def _leave(self, frame: Frame) -> tuple[Effect, ...]:
        """The walk inside a function has ended: its effects. What concerns inputs further out happens there as well."""
        self.frames.pop()
        kept: list[Effect] = []
        for effect in frame.effects:
            own, outer = _split(effect, frame)
            if own is not None:
                kept.append(own)
            if outer is not None:
                self.emit((outer,), Span(0, 0))
        return tuple(kept)

    # Functions

    def inputs(self, group: Sequence[nodes.Parameter]) -> tuple[Value, ...]:
        """Symbolic inputs for the parameters of a group, which stand for them from here on."""
        found = []
        for parameter in group:
            local = self.inference.binders[id(parameter)]

            def source(local: Local = local) -> Source:
                return Source("input", local.name, local.span)

            def port(local: Local = local) -> Port:
                return Port(local.name)

            symbol = symbolic(local.type, source, port)
            self.locals[local] = symbol
            found.append(symbol)
        return tuple(found)

    def function(self, groups: Sequence[Sequence[nodes.Parameter]], body: Callable[[], Value]) -> Value:
        """The value of a function of these groups."""
        if not groups:
            return body()
        inputs = self.inputs(groups[0])
        frame = Frame(set(inputs_of(inputs)), set(ports_in(inputs)))
        self.frames.append(frame)
        result = self.function(groups[1:], body)
        return AbstractFunction(inputs, result, self._leave(frame))

    def bindings(self, block: Sequence[nodes.Binding]) -> None:
        for binding in block:
            value = self.value(binding.value)
            if len(binding.targets) == 1:
                self._bind(binding.targets[0], value)
                continue
            parts = value.items if isinstance(value, TupleValue) and len(value.items) == len(binding.targets) else None
            for place, target in enumerate(binding.targets):
                self._bind(target, parts[place] if parts else AbstractScalar(flat(value)))

    def _bind(self, target: nodes.Binder, value: Value) -> None:
        local = self.inference.binders[id(target)]
        self.places[id(target)] = value
        if isinstance(value, AbstractScalar | TupleValue):
            value = noted(value, Step(target.span, f"`{target.name}` is defined here"))
        self.locals[local] = value

    def known(self, target: DefinitionTarget, flow: Value) -> Value:
        """Another definition's flow, as it is used here."""
        found = self._globals.get(target)
        if found is None:
            found = self._globals[target] = localized(flow, target)
        return found


def _split(effect: Effect, frame: Frame) -> tuple[Effect | None, Effect | None]:
    """The part of an effect that waits for a function's inputs, and the part that does not."""
    if isinstance(effect.to, Port) and effect.to in frame.ports:
        return effect, None
    sources = flat(effect.value)
    own = {source: trail for source, trail in sources.items() if source in frame.inputs}
    if not own:
        return None, effect
    if not isinstance(effect.value, AbstractScalar):
        return effect, None
    outer = {source: trail for source, trail in sources.items() if source not in frame.inputs}
    mine = AbstractScalar(own, effect.value.jumps, effect.value.spikes, effect.value.carriers & frame.inputs)
    return Effect(effect.to, mine), Effect(effect.to, AbstractScalar(outer)) if outer else None
