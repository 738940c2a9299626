"""What depends on what: a walk over an expression whose types are known.

Owns `Walk`: it evaluates expressions to abstract values and notes what must not vary. A place that must not vary and is
reached by a variable of integration breaks a rule (worded in `rules`); reached by an input of the function around it,
it becomes a demand on that input, an effect of calling the function. Functions are walked once, where they are written.
Rules by node are here and in `flow_calls` and `flow_binders`, registered by `walks`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, TypeVar

from potto.diagnostics import Diagnostic
from potto.modules.lookup import DefinitionTarget
from potto.source import Span
from potto.syntax import nodes
from potto.types.context import Inference
from potto.types.infer import strip
from potto.types.interface import localized
from potto.types.rules import Violation, equality, nonlinear, product_of_deltas, violation
from potto.types.scope import Builtin, Global, Local, Member
from potto.types.types import Truth, Unknown, resolve
from potto.types.values import (
    HAZY,
    NONE,
    STILL,
    Choice,
    Closure,
    Effect,
    ListValue,
    Port,
    Scalar,
    Sink,
    SinkKind,
    Source,
    Sources,
    Spike,
    Step,
    Surface,
    TupleValue,
    Value,
    flat,
    inputs_of,
    join,
    joined,
    jumps_of,
    merge,
    noted,
    ports_in,
    spikes_of,
    symbolic,
    taint,
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


@dataclass
class Frame:
    """A function (or definition) being walked: what is its own, and what happens when it is called."""

    inputs: set[Source] = field(default_factory=set)
    ports: set[Port] = field(default_factory=set)
    effects: list[Effect] = field(default_factory=list)
    noted: set[tuple[object, Source]] = field(default_factory=set)


@dataclass(frozen=True, slots=True)
class Surfaces:
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
            frame.effects.append(Effect(sink, Scalar(demanded)))

    @contextmanager
    def frame(self, inputs: Sequence[Value]) -> Iterator[Frame]:
        """The walk inside a function. What does not concern its own inputs happens outside as well."""
        inner = Frame(set(inputs_of(inputs)), set(ports_in(inputs)))
        self.frames.append(inner)
        yield inner
        self.frames.pop()
        kept: list[Effect] = []
        for effect in inner.effects:
            own, outer = _split(effect, inner)
            if own is not None:
                kept.append(own)
            if outer is not None:
                self.emit((outer,), Span(0, 0))
        inner.effects = kept

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
        with self.frame(inputs) as frame:
            result = self.function(groups[1:], body)
        return Closure(inputs, result, tuple(frame.effects))

    def bindings(self, block: Sequence[nodes.Binding]) -> None:
        for binding in block:
            value = self.value(binding.value)
            if len(binding.targets) == 1:
                self._bind(binding.targets[0], value)
                continue
            parts = value.items if isinstance(value, TupleValue) and len(value.items) == len(binding.targets) else None
            for place, target in enumerate(binding.targets):
                self._bind(target, parts[place] if parts else Scalar(flat(value)))

    def _bind(self, target: nodes.Binder, value: Value) -> None:
        local = self.inference.binders[id(target)]
        self.places[id(target)] = value
        if isinstance(value, Scalar | TupleValue):
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
    if not isinstance(effect.value, Scalar):
        return effect, None
    outer = {source: trail for source, trail in sources.items() if source not in frame.inputs}
    mine = Scalar(own, effect.value.jumps, effect.value.spikes, effect.value.carriers & frame.inputs)
    return Effect(effect.to, mine), Effect(effect.to, Scalar(outer)) if outer else None


# Rules by node


@walks(nodes.Number)
def _number(walk: Walk, node: nodes.Number) -> Value:
    return STILL


@walks(nodes.ErrorExpr)
def _error(walk: Walk, node: nodes.ErrorExpr) -> Value:
    return HAZY


@walks(nodes.Paren)
def _paren(walk: Walk, node: nodes.Paren) -> Value:
    return walk.value(strip(node))


@walks(nodes.Name, nodes.Member)
def _name(walk: Walk, node: nodes.Name | nodes.Member) -> Value:
    meaning = walk.inference.meanings.get(id(node))
    match meaning:
        case Local():
            value = walk.locals.get(meaning, HAZY)
            walk.places[id(node)] = value
            return value
        case Global(target, interface):
            return HAZY if interface.broken else walk.known(target, interface.flow)
        case Member(target):
            return walk.known(target, walk.members[target])
        case Builtin(name):
            from potto.types.flow_calls import builtin_value

            return builtin_value(name)
        case _:
            return HAZY


@walks(nodes.Unary)
def _unary(walk: Walk, node: nodes.Unary) -> Value:
    return _scalar(walk.value(node.operand))


def _scalar(value: Value) -> Scalar:
    return value if isinstance(value, Scalar) else Scalar(flat(value))


@walks(nodes.Chain)
def _chain(walk: Walk, node: nodes.Chain) -> Value:
    first = _scalar(walk.value(node.first))
    sources, jumps, spikes = first.sources, first.jumps, first.spikes
    for operand in node.rest:
        value = _scalar(walk.value(operand.value))
        sources = merge(sources, value.sources)
        jumps = jumps | value.jumps if value.jumps else jumps
        if value.spikes:
            if operand.op == "/":
                walk.report(nonlinear(operand.value, "divide by it"))
            elif operand.op == "*" and _same_delta(spikes, value.spikes):
                walk.report(product_of_deltas(operand.value))
            spikes = spikes | value.spikes
    return Scalar(sources, jumps, spikes)


def _same_delta(a: frozenset[Spike], b: frozenset[Spike]) -> bool:
    keys = {spike.key for spike in a if spike.key}
    return any(spike.key in keys for spike in b)


@walks(nodes.Power)
def _power(walk: Walk, node: nodes.Power) -> Value:
    base, exponent = _scalar(walk.value(node.base)), _scalar(walk.value(node.exponent))
    if base.spikes:
        walk.report(product_of_deltas(node.base))
    elif exponent.spikes:
        walk.report(nonlinear(node.exponent, "raise to it"))
    return Scalar(merge(base.sources, exponent.sources), base.jumps | exponent.jumps)


@walks(nodes.Compare)
def _compare(walk: Walk, node: nodes.Compare) -> Value:
    """A truth value: its surfaces are those of its comparisons one by one, its `spikes` the equalities."""
    left = _scalar(walk.value(node.first))
    sources, surfaces, equalities = left.sources, set[Surface](), set[Spike]()
    if left.spikes:
        walk.report(nonlinear(node.first, "compare it"))
    for operand in node.rest:
        right = _scalar(walk.value(operand.value))
        if right.spikes:
            walk.report(nonlinear(operand.value, "compare it"))
        both = merge(left.sources, right.sources)
        surface = frozenset(both)
        surfaces |= {surface} if surface else set()
        surfaces |= left.jumps | right.jumps
        if operand.op in ("==", "!="):
            equalities.add(Spike(surface, operand.op))
        sources, left = merge(sources, right.sources), right
    return Scalar(sources, frozenset(surfaces), frozenset(equalities))


@walks(nodes.Logic)
def _logic(walk: Walk, node: nodes.Logic) -> Value:
    return joined(_scalar(walk.value(operand)) for operand in node.operands)


@walks(nodes.Bracket)
def _bracket(walk: Walk, node: nodes.Bracket) -> Value:
    return bracket(walk, node.span, _scalar(walk.value(node.condition)))


def bracket(walk: Walk, span: Span, truth: Scalar) -> Scalar:
    """The number that a truth value in brackets is."""
    for spike in truth.spikes:
        walk.sink("equality", span, Scalar({s: truth.sources.get(s) for s in spike.over}), node=spike.key)
    _met(walk, span, truth.jumps)
    return Scalar(truth.sources, truth.jumps)


def _met(walk: Walk, span: Span, surfaces: Iterable[Surface]) -> None:
    walk.surfaces.extend(Surfaces(span, surface) for surface in surfaces)


@walks(nodes.If)
def _if(walk: Walk, node: nodes.If) -> Value:
    if walk.inference.conditions.get(id(node)) == "plain":
        condition = plain_condition(walk, node.condition)
    else:
        condition = _jumping_condition(walk, node)
    both = join(walk.value(node.then), walk.value(node.orelse))
    return taint(both, condition.sources, condition.jumps)


def _jumping_condition(walk: Walk, node: nodes.If) -> Scalar:
    value = walk.value(node.condition)
    if walk.inference.conditions.get(id(node)) == "bracket":
        return _scalar(value)
    first = _scalar(value.items[0] if isinstance(value, TupleValue) and value.items else value)
    surface = frozenset(first.sources)
    if surface:
        _met(walk, node.condition.span, (surface,))
    return Scalar(flat(value), frozenset((surface,)) if surface else frozenset())


def plain_condition(walk: Walk, expr: nodes.Expr) -> Scalar:
    """The value of a plain condition, each of whose parts must not vary."""
    expr = strip(expr)
    match expr:
        case nodes.Logic(operands=operands):
            return _scalar(joined(plain_condition(walk, operand) for operand in operands))
        case nodes.Unary(op="not", operand=operand):
            return plain_condition(walk, operand)
        case nodes.Bracket():
            return _scalar(walk.value(expr))
        case _:
            value = _scalar(walk.value(expr))
            walk.sink("condition", expr.span, value, node=expr)
            return Scalar(value.sources)  # what is plain makes no surface


@walks(nodes.InlineDiffeo)
def _inline(walk: Walk, node: nodes.InlineDiffeo) -> Value:
    return TupleValue(tuple(_scalar(walk.value(component)) for component in node.components))


@walks(nodes.Tuple)
def _tuple(walk: Walk, node: nodes.Tuple) -> Value:
    items = tuple(walk.value(item) for item in node.items)
    return HAZY if isinstance(walk.inference.types.get(id(node)), Unknown) else TupleValue(items)  # too large


@walks(nodes.ListLiteral)
def _list(walk: Walk, node: nodes.ListLiteral) -> Value:
    if id(node) in walk.inference.brackets:
        return bracket(walk, node.span, _scalar(walk.value(node.items[0])))
    return ListValue(joined([walk.value(item) for item in node.items]))


@walks(nodes.Lambda)
def _lambda(walk: Walk, node: nodes.Lambda) -> Value:
    return walk.function(node.groups, lambda: walk.value(node.body))


@walks(nodes.Let)
def _let(walk: Walk, node: nodes.Let) -> Value:
    walk.bindings(node.bindings)
    return walk.value(node.body)


def is_truth(walk: Walk, expr: nodes.Expr) -> bool:
    found = walk.inference.types.get(id(expr))
    return found is not None and isinstance(resolve(found), Truth)


__all__ = ["NONE", "WALKS", "Choice", "Walk", "bracket", "equality", "jumps_of", "spikes_of", "walks"]
