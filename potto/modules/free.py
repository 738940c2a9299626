"""Names that a piece of syntax uses and does not bind itself.

Owns the scoping rules of the surface language as one walk, `free_references`, in the order of the text and without
recursion. Knows no files. Of types those of records are free: `Real[x]` talks about a bound variable.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from msgspec import Struct

from potto.syntax import nodes
from potto.syntax.nodes import Expr, Item, Node, Statement


class _Bind(Struct, frozen=True):
    names: tuple[str, ...]


class _Unbind(Struct, frozen=True):
    names: tuple[str, ...]


Reference = tuple[str | None, str]
_Step = Node | Statement | _Bind | _Unbind


class References(Struct, frozen=True):
    """What a piece of syntax refers to: `(None, name)` or `(path, name)`, in the order of the text, each once. With
    those that it only calls, all arguments by their places, is nothing else done."""

    every: tuple[Reference, ...] = ()
    only_called: frozenset[Reference] = frozenset()


def free_references(root: Node | Statement, called: set[int] | None = None) -> list[nodes.Name | nodes.Member]:
    """The names and the members of modules that occur free in `root`, one by one, in the order of the text. `called`
    takes the identities of nodes that are called with all arguments by their places."""
    found: list[nodes.Name | nodes.Member] = []
    bound: dict[str, int] = {}
    stack: list[_Step] = [root]
    while stack:
        step: Any = stack.pop()  # `kind` tells what it is, faster than a type checker can follow
        kind = type(step)
        if kind is nodes.Name:
            if not bound.get(step.id):
                found.append(step)
        elif kind is _Bind:
            for name in step.names:
                bound[name] = bound.get(name, 0) + 1
        elif kind is _Unbind:
            for name in step.names:
                bound[name] -= 1
        elif kind is nodes.Member:
            if not bound.get(step.path.partition(".")[0]):
                found.append(step)
        else:
            if kind is nodes.Apply and called is not None and all(each.name is None for each in step.arguments):
                called.add(id(step.function))
            steps = _STEPS.get(kind)
            if steps is not None:
                stack.extend(reversed(steps(step)))
    return found


def references_in(root: Node | Statement) -> References:
    """The free references in `root`."""
    called: set[int] = set()
    found = [(_reference(each), id(each) in called) for each in free_references(root, called)]
    every = tuple(dict.fromkeys([reference for reference, _ in found]))
    otherwise = {reference for reference, is_called in found if not is_called}
    return References(every, frozenset([reference for reference in every if reference not in otherwise]))


def _reference(node: nodes.Name | nodes.Member) -> Reference:
    return (None, node.id) if isinstance(node, nodes.Name) else (node.path, node.name)


def free_names(root: Item | Expr | nodes.Binding) -> frozenset[str]:
    """The names that occur free in `root`. A definition does not bind its own name: recursion shows here."""
    return frozenset(node.id for node in free_references(root) if isinstance(node, nodes.Name))


def free_members(root: Item | Expr | nodes.Binding) -> frozenset[tuple[str, str]]:
    """The members of modules, `(path, name)`, that occur in `root` where no local name hides the module."""
    return frozenset((node.path, node.name) for node in free_references(root) if isinstance(node, nodes.Member))


def _if_steps(node: nodes.If) -> Sequence[_Step]:
    if node.then.span < node.condition.span:
        return (node.then, node.condition, node.orelse)
    return (node.condition, node.then, node.orelse)


def _integral_steps(node: nodes.Integral) -> Sequence[_Step]:
    """Bounds see the variables further out; the body sees all. The first variable is the outermost."""
    steps: list[_Step] = []
    bound: list[str] = []
    for place, bounds in enumerate(node.bounds):
        steps.append(bounds)
        if isinstance(bounds, nodes.MeasureBound):
            name = bounds.variable
        elif place < len(node.variables):
            name = node.variables[place].name
        else:
            continue
        bound.append(name)
        steps.append(_Bind((name,)))
    inner = tuple(variable.name for variable in node.variables)
    return (*steps, *_scoped(inner, (node.body,)), _Unbind(tuple(bound)))


def _ranges(clauses: Sequence[nodes.Clause], rest: Sequence[_Step]) -> Sequence[_Step]:
    """Clauses one after the other, each seeing the variables before it."""
    steps: list[_Step] = []
    for clause in clauses:
        steps += (clause, _Bind((clause.variable.name,)))
    return (*steps, *rest, _Unbind(tuple(clause.variable.name for clause in clauses)))


def _targets(targets: Sequence[nodes.Binder]) -> tuple[str, ...]:
    return tuple(target.name for target in targets)


def _diffeo_steps(node: nodes.DiffeoDefinition) -> Sequence[_Step]:
    inverse: Sequence[_Step] = () if node.inverse is None else (node.inverse,)
    block = _block(node.bindings, (*node.components, *inverse, *node.where))
    return _scoped(_parameters((node.variables, *node.groups)), block)


def _block(bindings: Sequence[nodes.Binding], rest: Sequence[_Step]) -> Sequence[_Step]:
    """Bindings one after the other, each seeing those before it."""
    steps: list[_Step] = []
    bound: list[str] = []
    for binding in bindings:
        names = tuple(target.name for target in binding.targets)
        steps += (binding, _Bind(names))
        bound += names
    return (*steps, *rest, _Unbind(tuple(bound)))


def _statements(statements: Sequence[Statement]) -> Sequence[_Step]:
    steps: list[_Step] = []
    bound: list[str] = []
    for statement in statements:
        steps.append(statement)
        if isinstance(statement, nodes.Binding):
            names = tuple(target.name for target in statement.targets)
            steps.append(_Bind(names))
            bound += names
    return (*steps, _Unbind(tuple(bound)))


def _scoped(names: tuple[str, ...], steps: Sequence[_Step]) -> Sequence[_Step]:
    return (_Bind(names), *steps, _Unbind(names))


def _parameters(groups: Sequence[Sequence[nodes.Parameter]]) -> tuple[str, ...]:
    return tuple(parameter.name for group in groups for parameter in group)


def _annotations(groups: Sequence[Sequence[nodes.Parameter]], result: nodes.TypeExpr | None = None) -> Sequence[_Step]:
    """The types of parameters and of a result, in which records have names."""
    written = [p.annotation for group in groups for p in group if p.annotation is not None]
    return written if result is None else [*written, result]


def _named_type_steps(node: nodes.NamedType) -> Sequence[_Step]:
    """The record that a type is the name of: `Camera`, `scene.Camera`."""
    path, _, name = node.name.rpartition(".")
    return (nodes.Member(node.span, path, node.span, name, node.span) if path else nodes.Name(node.span, name),)


def _values(operands: Sequence[nodes.Operand | nodes.Argument]) -> Sequence[_Step]:
    return [operand.value for operand in operands]


# What to visit in each kind of node, with the names that it binds on the way. By type, since every chunk is walked:
# a `match` costs three times as much. Kinds that are not here have no names that could be free.
_STEPS: dict[type, Callable[[Any], Sequence[_Step]]] = {
    nodes.Unary: lambda node: (node.operand,),
    nodes.Chain: lambda node: (node.first, *_values(node.rest)),
    nodes.Compare: lambda node: (node.first, *_values(node.rest)),
    nodes.Power: lambda node: (node.base, node.exponent),
    nodes.Logic: lambda node: node.operands,
    nodes.Bracket: lambda node: (node.condition,),
    nodes.Paren: lambda node: (node.inner,),
    nodes.ListLiteral: lambda node: node.items,
    nodes.Tuple: lambda node: node.items,
    nodes.InlineDiffeo: lambda node: node.components,
    nodes.If: _if_steps,
    nodes.Apply: lambda node: (node.function, *_values(node.arguments)),
    nodes.Operand: lambda node: (node.value,),
    nodes.Argument: lambda node: (node.value,),
    nodes.Interval: lambda node: (node.lo, node.hi),
    nodes.MeasureBound: lambda node: node.arguments,
    nodes.Lambda: lambda node: (*_annotations(node.groups), *_scoped(_parameters(node.groups), (node.body,))),
    nodes.Range: lambda node: (node.lo, node.hi),
    nodes.Clause: lambda node: (node.over,),
    nodes.Reduction: lambda node: _ranges(node.clauses, (node.body,)),
    nodes.Fold: lambda node: (node.start, *_ranges(node.clauses, _scoped(_targets(node.targets), (node.body,)))),
    nodes.Comprehension: lambda node: _ranges(node.clauses, (node.body,)),
    nodes.Index: lambda node: (node.array, *node.indices),
    nodes.Field: lambda node: (node.value,),
    nodes.With: lambda node: (node.record, *_values(node.arguments)),
    nodes.Let: lambda node: _block(node.bindings, (node.body,)),
    nodes.Integral: _integral_steps,
    nodes.Binding: lambda node: (node.value,),
    nodes.Definition: lambda node: (
        *_annotations(node.groups, node.result),
        *_scoped(_parameters(node.groups), _block(node.bindings, (node.body,))),
    ),
    nodes.RecordDefinition: lambda node: _annotations((node.fields,)),
    nodes.NamedType: _named_type_steps,
    nodes.TupleType: lambda node: node.items,
    nodes.ArrayType: lambda node: (node.item,),
    nodes.FunctionType: lambda node: _annotations((node.parameters,), node.result),
    nodes.DiffeoDefinition: _diffeo_steps,
    nodes.DeclaredInverse: lambda node: _scoped(_parameters((node.parameters,)), node.components),
    nodes.Print: lambda node: node.arguments,
    nodes.ExpressionStatement: lambda node: (node.value,),
    nodes.For: lambda node: (node.iterable, *_scoped((node.variable.name,), _statements(node.body))),
}
