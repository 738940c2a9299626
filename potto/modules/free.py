"""Names that a piece of syntax uses and does not bind itself.

Owns the scoping rules of the surface language as one walk, `free_references`, in the order of the text and without
recursion. Knows no files. Types have no names that could be free: `Real[x]` talks about a bound variable.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from potto.syntax import nodes
from potto.syntax.nodes import Expr, Item, Node, Statement


@dataclass(frozen=True, slots=True)
class _Bind:
    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Unbind:
    names: tuple[str, ...]


_Step = Node | Statement | _Bind | _Unbind


def free_references(root: Node | Statement) -> Iterator[nodes.Name | nodes.Member]:
    """The names and the members of modules that occur free in `root`, one by one, in the order of the text."""
    bound: dict[str, int] = {}
    stack: list[_Step] = [root]
    while stack:
        step = stack.pop()
        match step:
            case nodes.Name(id=name):
                if not bound.get(name):
                    yield step
            case nodes.Member(path=path):
                if not bound.get(path.partition(".")[0]):
                    yield step
            case _Bind(names):
                for name in names:
                    bound[name] = bound.get(name, 0) + 1
            case _Unbind(names):
                for name in names:
                    bound[name] -= 1
            case _:
                stack.extend(reversed(_steps(step)))


def free_names(root: Item | Expr | nodes.Binding) -> frozenset[str]:
    """The names that occur free in `root`. A definition does not bind its own name: recursion shows here."""
    return frozenset(node.id for node in free_references(root) if isinstance(node, nodes.Name))


def free_members(root: Item | Expr | nodes.Binding) -> frozenset[tuple[str, str]]:
    """The members of modules, `(path, name)`, that occur in `root` where no local name hides the module."""
    return frozenset((node.path, node.name) for node in free_references(root) if isinstance(node, nodes.Member))


def _steps(node: Node | Statement) -> Sequence[_Step]:
    """What to visit in a node, with the names that it binds on the way."""
    match node:
        case nodes.Unary(operand=part) | nodes.Bracket(condition=part) | nodes.Paren(inner=part):
            return (part,)
        case nodes.Chain(first=first, rest=rest) | nodes.Compare(first=first, rest=rest):
            return (first, *(operand.value for operand in rest))
        case nodes.Power(base=base, exponent=exponent):
            return (base, exponent)
        case nodes.Logic(operands=parts) | nodes.ListLiteral(items=parts) | nodes.Tuple(items=parts):
            return parts
        case nodes.InlineDiffeo(components=parts) | nodes.Print(arguments=parts):
            return parts
        case nodes.If(condition=condition, then=then, orelse=orelse):
            return (then, condition, orelse) if then.span < condition.span else (condition, then, orelse)
        case nodes.Apply(function=function, arguments=arguments):
            return (function, *(argument.value for argument in arguments))
        case nodes.Operand(value=part) | nodes.Argument(value=part) | nodes.ExpressionStatement(value=part):
            return (part,)
        case nodes.Interval(lo=lo, hi=hi):
            return (lo, hi)
        case nodes.MeasureBound(arguments=parts):
            return parts
        case nodes.Binding(value=part):
            return (part,)
        case _:
            return _binder_steps(node)


def _binder_steps(node: Node | Statement) -> Sequence[_Step]:
    match node:
        case nodes.Lambda(groups=groups, body=body):
            return _scoped(_parameters(groups), (body,))
        case nodes.Sum(variable=variable, lo=lo, hi=hi, body=body):
            return (lo, hi, *_scoped((variable.name,), (body,)))
        case nodes.Let(bindings=bindings, body=body):
            return _block(bindings, (body,))
        case nodes.Integral():
            return _integral_steps(node)
        case nodes.For(variable=variable, iterable=iterable, body=statements):
            return (iterable, *_scoped((variable.name,), _statements(statements)))
        case nodes.Definition(groups=groups, bindings=bindings, body=body):
            return _scoped(_parameters(groups), _block(bindings, (body,)))
        case nodes.DiffeoDefinition():
            return _diffeo_steps(node)
        case nodes.Inverse(parameters=parameters, components=components):
            return _scoped(_parameters((parameters,)), components)
        case _:  # numbers, errors, types, binders, parameters, imports: no names that could be free
            return ()


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
