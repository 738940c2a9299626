"""Everything about one definition, or about several that need each other: types, then dependence, then the interface.

Owns `DefinitionAnalysis`. Pure functions of trees and of what the definitions around provide (`Outside`); the queries
are in `queries`. Recursive definitions have one type each while they are inferred; their flows start from nothing and
are walked again until they stand still (they only grow, and there are finitely many).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Set

from msgspec import Struct
from msgspec.structs import replace

from potto.diagnostics import Diagnostic, Related
from potto.modules.lookup import DefinitionTarget
from potto.source import Span
from potto.syntax import nodes
from potto.types import (  # noqa: F401  (imported for their rules)
    arrays,
    calls,
    conditions,
    flow_arrays,
    flow_binders,
    flow_calls,
    flow_rules,
    indices,
    integrals,
)
from potto.types.algebra import fitted, flat, symbolic
from potto.types.annotations import written_type
from potto.types.closing import declared, reasons_of
from potto.types.context import Inference, NamedPart, ensure_stack
from potto.types.endless_recursion import endless
from potto.types.flow import Walk
from potto.types.infer import bindings, returned
from potto.types.interfaces import Closing, Decorating, Interface, chain_of
from potto.types.lints import lints
from potto.types.mismatches import mismatch
from potto.types.motionless import is_derivative
from potto.types.reasons import NO_REASONS, Reasons
from potto.types.records import labelled
from potto.types.scope import Outside
from potto.types.types import UNKNOWN, Diffeo, Dist, Function, Meta, Parameter, Real, Type, Unknown, groups_of, resolve
from potto.types.unify import close_type, unify
from potto.types.values import STILL, AbstractFunction, AbstractScalar, Port, Source, TupleValue, Value

MAX_ROUNDS = 20

Written = nodes.Definition | nodes.DiffeoDefinition


class Typed(Struct, frozen=True):
    """A name where it is bound or used inside a definition, with its type there."""

    span: Span
    name: str
    type: Type


class DefinitionAnalysis(Struct, frozen=True):
    """What is known about one definition. Its parts are read through queries, which stand still when they do."""

    interface: Interface
    diagnostics: tuple[Diagnostic, ...]
    reasons: Reasons = NO_REASONS
    names: tuple[Typed, ...] = ()
    parts: tuple[NamedPart, ...] = ()


def analyse(
    items: Mapping[DefinitionTarget, Written],
    outsides: Mapping[DefinitionTarget, Outside],
    broken: Set[DefinitionTarget] = frozenset(),
    details: bool = True,
) -> dict[DefinitionTarget, DefinitionAnalysis]:
    """Analyse definitions that need each other (mostly one). Of what is `broken` the parser has spoken already.

    `details`: also what is only asked of definitions that somebody looks at, their reasons and names.
    """
    ensure_stack()
    skeletons = {target: _skeleton(item) for target, item in items.items()}
    inferences = {}
    for target, item in items.items():
        inference = inferences[target] = Inference(outsides[target], skeletons)
        _infer(inference, item, skeletons[target])
    for inference in inferences.values():
        inference.finish()
    recursive = len(items) > 1 or any(inference.recursive() for inference in inferences.values())
    flows: dict[DefinitionTarget, Value] = {target: _nothing(skeletons[target]) for target in items if recursive}
    for _ in range(MAX_ROUNDS):
        walked = {target: _walk(inferences[target], item, flows) for target, item in items.items()}
        if not recursive:
            break
        walked = {target: (walk, fitted(value, skeletons[target])) for target, (walk, value) in walked.items()}
        closed = {target: Closing(value).value(value) for target, (_, value) in walked.items()}
        if closed == flows:
            break
        flows = closed
    unended = endless(items, inferences) if recursive else {}
    found = {}
    for target, item in items.items():
        walk, value = walked[target]
        typed = found[target] = _conclude(target, item, inferences[target], walk, value, skeletons[target], details)
        if target in broken:
            found[target] = replace(typed, interface=dataclasses.replace(typed.interface, broken=True), diagnostics=())
        elif target in unended:
            found[target] = replace(typed, diagnostics=_sorted((*typed.diagnostics, *unended[target])))
    return found


def _sorted(found: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    return tuple(sorted(found, key=lambda diagnostic: (diagnostic.span, diagnostic.code)))


def _skeleton(item: Written) -> Type:
    """The type of a definition before anything is known, with the names of its parameters."""
    groups = (item.variables, *item.groups) if isinstance(item, nodes.DiffeoDefinition) else item.groups
    result: Type = Meta(1)
    for group in reversed(groups):
        result = Function(tuple(Parameter(parameter.name, Meta(1)) for parameter in group), result)
    return result


def _nothing(type: Type) -> Value:
    """The flow of which nothing is known yet: varies with nothing, demands nothing."""
    value: Value = STILL
    for group in reversed(groups_of(type)):
        inputs = tuple(symbolic(p.type, lambda: Source("input", ""), lambda: Port("")) for p in group)
        value = AbstractFunction(inputs, value)
    return Closing(value).value(value)


def _infer(inference: Inference, item: Written, skeleton: Type) -> None:
    groups = (item.variables, *item.groups) if isinstance(item, nodes.DiffeoDefinition) else item.groups
    for group, expected in zip(groups, groups_of(skeleton)):
        found = inference.bind_group(group, lambda a: written_type(inference, a))
        inference.heads.update(map(id, found))
        for local, parameter in zip(found, expected):
            unify(local.type, parameter.type)
    bindings(inference, item.bindings)
    result = skeleton
    for _ in groups:
        result = resolve(result)
        assert isinstance(result, Function)
        result = result.result
    result = resolve(result)
    if isinstance(item, nodes.DiffeoDefinition):
        _infer_diffeo(inference, item, result)
    else:
        _infer_body(inference, item, result)


def _infer_body(inference: Inference, item: nodes.Definition, result: Type) -> None:
    body = inference.infer(item.body)
    returned(inference, body, item.body)
    made = labelled(item, inference.outside.file, body)
    if made is not body:
        body = made
    elif item.result is not None:
        written = written_type(inference, item.result)
        if not unify(body, written):
            inference.report(mismatch(
                body, written, item.body, f"the result of `{item.name}`", (Related(item.result.span, "declared here"),)
            ))  # fmt: skip
    if isinstance(resolve(body), Unknown) and isinstance(result, Meta):
        result.found = UNKNOWN  # else it would be taken to hold for all types
    elif not unify(result, body):
        inference.report(mismatch(body, result, item.body, f"the result of `{item.name}`, as it is used in it,"))


def _infer_diffeo(inference: Inference, item: nodes.DiffeoDefinition, result: Type) -> None:
    for variable in item.variables:
        local = inference.binders[id(variable)]
        inference.need_number(local.type, nodes.Name(variable.span, variable.name), "a variable of a diffeomorphism")
    for component in item.components:
        inference.number(component, "a coordinate of a diffeomorphism")
    unify(result, Diffeo(len(item.components)))
    for condition in item.where:
        inference.infer(condition)
    if item.inverse is not None:
        with inference.scope.inside():
            for variable in item.variables:
                inference.scope.unbind(variable.name)
            inference.bind_group(item.inverse.parameters, lambda a: written_type(inference, a))
            for component in item.inverse.components:
                inference.number(component, "a coordinate of an inverse")


def _walk(inference: Inference, item: Written, flows: dict[DefinitionTarget, Value]) -> tuple[Walk, Value]:
    walk = Walk(inference, flows)

    def body() -> Value:
        walk.bindings(item.bindings)
        if isinstance(item, nodes.Definition):
            return walk.value(item.body)
        for condition in item.where:
            walk.value(condition)
        components = TupleValue(tuple(AbstractScalar(flat(walk.value(component))) for component in item.components))
        if item.inverse is not None:
            walk.inputs(item.inverse.parameters)
            for component in item.inverse.components:
                walk.value(component)
        return components

    groups = (item.variables, *item.groups) if isinstance(item, nodes.DiffeoDefinition) else item.groups
    return walk, declared(walk, groups, walk.function(groups, body))


def _conclude(
    target: DefinitionTarget,
    item: Written,
    inference: Inference,
    walk: Walk,
    value: Value,
    skeleton: Type,
    details: bool,
) -> DefinitionAnalysis:
    closing = Closing(value)
    decorating = Decorating(value)
    type = decorating.type(close_type(skeleton), value)
    interface = Interface(
        target.name,
        type,
        closing.value(value),
        plain=_named(decorating.plain, decorating),
        varies=_named(_varying(value), decorating),
        diffeo=isinstance(item, nodes.DiffeoDefinition),
        derivative=isinstance(item, nodes.Definition) and not item.groups and is_derivative(inference, item.body),
    )
    found = _sorted((*inference.diagnostics, *walk.diagnostics, *lints(inference, walk, item)))
    if not details:
        return DefinitionAnalysis(interface, found)
    names, reasons = typed(inference, walk), reasons_of(value, closing, decorating)
    return DefinitionAnalysis(interface, found, reasons, names, parts(inference))


def _named(sources: object, decorating: Decorating) -> tuple[str, ...]:
    assert isinstance(sources, set)
    return tuple(dict.fromkeys(name for source, name in decorating.names.items() if source in sources))


def _varying(value: Value) -> set[object]:
    """The inputs that the final result varies with."""
    chain = chain_of(value)
    return set(flat(chain[-1].result)) if chain else set()


def typed(inference: Inference, walk: Walk) -> tuple[Typed, ...]:
    """The names that are bound in a definition, with the types they have there."""
    return tuple(
        Typed(local.span, local.name, local_type(local.type, walk.locals.get(local))) for local in inference.locals
    )


def parts(inference: Inference) -> tuple[NamedPart, ...]:
    """The names of parts that a definition writes, with the types of what they are of."""
    return tuple(NamedPart(p.span, p.name, close_type(p.whole), close_type(p.type)) for p in inference.parts)


def local_type(type: Type, value: Value | None) -> Type:
    """A type inside a definition: a number says which variables of integration it varies with."""
    type = resolve(type)
    if isinstance(type, Real) and isinstance(value, AbstractScalar):
        varying = sorted((s for s in value.sources if s.kind == "variable"), key=lambda source: source.span)
        names = tuple(dict.fromkeys(source.name for source in varying))
        return Dist(names) if value.spikes else Real(variables=names)
    if isinstance(value, AbstractFunction):
        return Decorating(value).type(close_type(type), value)
    return close_type(type)
