"""The points at which definitions are looked at: calls in live expressions and statements, and the slopes there.

Owns `CallPoint`, `points` and `point_of`. These are only texts; whoever evaluates makes numbers of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from msgspec import Struct

from potto.ide.names.descriptions import kind_of
from potto.ide.names.function_arguments import fits, numbers
from potto.ide.names.symbols import callee
from potto.modules import is_diffeo, names, parsed
from potto.modules.texts import groups_of_pieces, piece
from potto.query import Database, query
from potto.syntax import children, live_expressions, nodes, parse_expression
from potto.syntax.as_written import without_parentheses
from potto.types import Function, Parameter, Real, TupleOf, Type, TypeVariable, groups_of, interface, result_of
from potto.types.types import resolve

MOST = 3  # points of one definition
USUAL = "0.5"  # where nothing is said


class CallPoint(Struct, frozen=True):
    """A call with all its arguments. `slopes`: for each parameter, an expression whose tangent is the derivative by it.
    `chosen`: nobody wrote this call, it is an example."""

    text: str
    slopes: tuple[tuple[str, str], ...] = ()
    chosen: bool = False


OfTargets = tuple[tuple[tuple[str, str], CallPoint], ...]  # points, each with the definition that it is one of


@query
def points(db: Database, file: str, name: str) -> tuple[CallPoint, ...]:
    """The points of a definition in its own file; for a constant, its name. If there are none, we choose one."""
    kind = kind_of(db, file, name)
    if kind != "function":
        return (CallPoint(name),) if kind == "constant" else ()
    return db.entry(_written, (file,), (file, name)) or _chosen(db, file, name)


def looked_at(db: Database, file: str) -> tuple[tuple[str, str], ...]:
    """The definitions that the expressions of a file look at."""
    return tuple(_written(db, file))


@query
def _written(db: Database, file: str) -> Mapping[tuple[str, str], tuple[CallPoint, ...]]:
    """The points in a file's expressions, under the definitions that they are of."""
    found: dict[tuple[str, str], dict[str, CallPoint]] = {}
    for group in _points_by_group(db, file):
        for target, point in group:
            those = found.setdefault(target, {})
            if len(those) < MOST:
                those.setdefault(point.text, point)
    return {target: tuple(those.values()) for target, those in found.items()}


@query(cuts=True)
def _points_by_group(db: Database, file: str) -> tuple[OfTargets, ...]:
    """All of them. Most edits change nothing here."""
    return tuple([_group_points(db, file, group) for group in groups_of_pieces(db, file)])


@query(keep=512)
def _group_points(db: Database, file: str, group: tuple[str, ...]) -> OfTargets:
    """Those of some pieces of the file: in live expressions and in statements."""
    diffeo = is_diffeo(file)
    chunks = (chunk for text in group for chunk in piece(db, text, diffeo).chunks)
    looking = (look for chunk in chunks for look in _looking(db, chunk.text, diffeo))
    return tuple([found for look in looking for found in points_in(db, file, look)])


@query(keep=8192)
def _looking(db: Database, text: str, diffeo: bool) -> tuple[str, ...]:
    """The expressions of a chunk that look at definitions: its live expressions, and what a statement shows."""
    found = [live.text for live in live_expressions(text)] if "#>" in text else []
    shown: tuple[nodes.Expr, ...] = ()
    if not text.startswith("def "):
        match parsed(db, text, diffeo).item:
            case nodes.Print(arguments=arguments):
                shown = arguments
            case nodes.ExpressionStatement(value=value):
                shown = (value,)
            case _:
                pass
    return (*found, *(text[expr.span.start : expr.span.end] for expr in shown))


@query(keep=8192)
def points_in(db: Database, file: str, text: str) -> tuple[tuple[tuple[str, str], CallPoint], ...]:
    """The points in an expression in the scope of a file, each with its definition."""
    made = (_point(db, file, text, call) for call in _calls(parse_expression(text).expr))
    return tuple(found for found in made if found is not None)


_THROUGH = nodes.Reduction | nodes.Fold | nodes.Comprehension


def _calls(node: nodes.Node) -> Iterator[nodes.Apply]:
    """The calls in a tree, outer ones first, except within anything that binds names."""
    if isinstance(node, nodes.Lambda | nodes.Let | nodes.Integral | _THROUGH):
        return
    if isinstance(node, nodes.Apply):
        yield node
    for child in children(node):
        yield from _calls(child)


def point_of(db: Database, file: str, text: str) -> CallPoint | None:
    """A call in a file's scope as a point; None if it is not a call of a definition with all its arguments."""
    tree = without_parentheses(parse_expression(text).expr)
    made = _point(db, file, text, tree) if isinstance(tree, nodes.Apply) else None
    return None if made is None else made[1]


def _chosen(db: Database, file: str, name: str) -> tuple[CallPoint, ...]:
    groups = groups_of(interface(db, file, name).type)
    usual = [[_usual(db, file, name, parameter.type) for parameter in group] for group in groups]
    written = "".join(f"({', '.join(text or '' for text in group)})" for group in usual)
    if not all(all(group) for group in usual) or name not in names(db, file):
        return ()
    point = point_of(db, file, name + written)
    return () if point is None else (CallPoint(point.text, point.slopes, chosen=True),)


def _usual(db: Database, file: str, name: str, type: Type) -> str | None:
    """The argument for a parameter without a known value: a number, a tuple of numbers, or a function that fits."""
    if _is_number(type):
        return USUAL
    if isinstance(resolve(type), Function):
        said = not isinstance(resolve(result_of(type)), TypeVariable)  # whether it is known what it gives
        return next(iter(fits(db, file, name, type, elsewhere=False)), None) if said else None
    size = numbers(type)
    return f"({', '.join([USUAL] * size)})" if size else None


def _is_number(type: Type) -> bool:
    return isinstance(resolve(type), Real | TypeVariable)


# One call


def _point(db: Database, file: str, text: str, call: nodes.Apply) -> tuple[tuple[str, str], CallPoint] | None:
    """A call, or a call of a derivative, as a point of its definition."""
    head, groups = _chain(call)
    called = callee(db, file, head)
    if called is None or called.given or called.derived > 1:
        return None
    type = interface(db, called.file, called.name).type
    wanted = groups_of(type)
    function = _function_text(head, text, called.name if called.file == file else None, called.derived)
    if function is None or len(groups) != len(wanted):
        return None
    given = [_placed(p, group, text, called.derived) for p, group in zip(wanted, groups)]
    whole = [group for group in given if group is not None]
    if len(whole) != len(given):
        return None
    value = function + "".join(f"({', '.join(group)})" for group in whole)
    slopes = tuple(_slopes(function, wanted, whole)) if _has_numbers(result_of(type)) else ()
    return (called.file, called.name), CallPoint(value, slopes)


def _chain(call: nodes.Expr) -> tuple[nodes.Expr, list[tuple[nodes.Argument, ...]]]:
    """The function of a chain of calls, and what it is given group by group."""
    groups: list[tuple[nodes.Argument, ...]] = []
    while True:
        if isinstance(call, nodes.Paren):
            call = call.inner
        elif isinstance(call, nodes.Apply) and not _is_deriv(call):
            groups.insert(0, call.arguments)
            call = call.function
        else:
            return call, groups


def _is_deriv(node: nodes.Apply) -> bool:
    return isinstance(node.function, nodes.Name) and node.function.id == "deriv" and len(node.arguments) == 1


def _function_text(head: nodes.Expr, text: str, name: str | None, derived: int) -> str | None:
    """The text of the function, where `head` may be its derivative."""
    if not derived:
        return text[head.span.start : head.span.end]
    if isinstance(head, nodes.Apply):
        span = head.arguments[0].value.span
        return text[span.start : span.end]
    return name  # another name for its derivative


def _placed(
    parameters: tuple[Parameter, ...], group: tuple[nodes.Argument, ...], text: str, derived: int
) -> list[str] | None:
    """The texts of arguments, without tangents, in the order of the parameters; None if they do not fill them."""
    texts: dict[str | None, str] = {}
    rest: list[str] = []
    for argument in group:
        value = _primal(argument.value) if derived else argument.value
        if value is None:
            return None
        shown = text[value.span.start : value.span.end]
        if argument.name is None:
            rest.append(shown)
        else:
            texts[argument.name[derived:]] = shown
    free = [parameter.name for parameter in parameters if parameter.name is None or parameter.name not in texts]
    if len(free) != len(rest) or len(texts) + len(rest) != len(parameters):
        return None
    left = iter(rest)
    return [texts[p.name] if p.name in texts else next(left) for p in parameters]


def _primal(value: nodes.Expr) -> nodes.Expr | None:
    """The value of a dual that is written out; None if it is not."""
    match value:
        case nodes.Paren(inner=inner):
            return _primal(inner)
        case nodes.Tuple(items=(first, _)):
            return first
        case nodes.Number() | nodes.Unary() | nodes.Chain() | nodes.Power():
            return value
        case nodes.Name(id=("pi" | "inf")):
            return value
        case nodes.Apply(arguments=(argument,)) if _is_deriv(value):
            return argument.value
        case _:
            return None


def _has_numbers(type: Type) -> bool:
    type = resolve(type)
    return isinstance(type, Real | TypeVariable) or (isinstance(type, TupleOf) and all(map(_has_numbers, type.items)))


def _slopes(
    function: str, wanted: tuple[tuple[Parameter, ...], ...], given: list[list[str]]
) -> Iterator[tuple[str, str]]:
    """For each parameter that is a number, the call with duals in which only this one moves."""
    for moving in (parameter for parameters in wanted for parameter in parameters):
        if moving.name is None or not _is_number(moving.type):
            continue
        written = ""
        for parameters, texts in zip(wanted, given):
            written += f"({', '.join(_dual(text, p, p is moving) for text, p in zip(texts, parameters))})"
        yield moving.name, f"deriv({function}){written}"


def _dual(text: str, parameter: Parameter, moves: bool) -> str:
    if isinstance(resolve(parameter.type), Function):
        return f"deriv({text})"
    size = numbers(parameter.type)
    if size > 1:  # a tuple with its tangent, which does not move
        return f"({text}, ({', '.join(['0'] * size)}))"
    return f"({text}, 1)" if moves else text
