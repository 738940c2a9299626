"""What can be drawn: functions of numbers with values for their parameters. Owns `scenes`.

A scene is a function of which two numbers can be the axes of a picture, or one that of a curve; all other parameters
are for the viewer to set. They start as a live expression of the file calls the function, if one does.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from potto.ide.places import all_chunks
from potto.ide.symbols import owner
from potto.modules import DefinitionTarget, names
from potto.modules import resolve as meaning
from potto.query import Database
from potto.source import Span
from potto.syntax import live_expressions, nodes, parse_expression
from potto.syntax.walk import walk
from potto.types import Diffeo, Function, Real, TupleOf, Type, Var, format_type, groups_of, interface, result_of
from potto.types.types import resolve

_PAIRS = (("x", "y"), ("u", "v"), ("i", "j"))


@dataclass(frozen=True, slots=True)
class SceneParameter:
    """A parameter. `size`: how many numbers it has, 0 for a function; `fits`: definitions that it could be given."""

    name: str
    kind: Literal["number", "tuple", "function"]
    type: str
    size: int
    value: tuple[float, ...] = ()
    fits: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Scene:
    """A function that can be drawn: `components` numbers at each place, over the parameters in `axes` to begin with."""

    name: str
    span: Span
    parameters: tuple[SceneParameter, ...]
    components: int
    axes: tuple[str, ...]


def scenes(db: Database, file: str) -> tuple[Scene, ...]:
    """The functions of a file that can be drawn, in order."""
    found: list[Scene] = []
    for chunk in all_chunks(db, file):
        item, name = chunk.parsed(db).item, owner(db, chunk)
        if name is None or not isinstance(item, nodes.Definition | nodes.DiffeoDefinition):
            continue
        scene = _scene(db, file, name, chunk.absolute(item.name_span))
        if scene is not None:
            found.append(scene)
    return tuple(found)


def _scene(db: Database, file: str, name: str, span: Span) -> Scene | None:
    type = interface(db, file, name).type
    components = _numbers(result_of(type))
    groups = groups_of(type)
    if not components or not groups:
        return None
    given = _given(db, file, name)
    made: list[SceneParameter] = []
    for parameter in (parameter for group in groups for parameter in group):
        kind, size = _kind(parameter.type)
        if kind is None or parameter.name is None:
            return None
        value = given.get(parameter.name, given.get(len(made), ()))
        fits = _fits(db, file, name, parameter.type) if kind == "function" else ()
        text = format_type(parameter.type)
        made.append(SceneParameter(parameter.name, kind, text, size, value if len(value) == size else (), fits))
    numbers = [parameter.name for parameter in made if parameter.kind == "number"]
    return Scene(name, span, tuple(made), components, _axes(numbers)) if numbers else None


def _kind(type: Type) -> tuple[Literal["number", "tuple", "function"] | None, int]:
    type = resolve(type)
    if isinstance(type, Function | Diffeo):
        return "function", 0
    size = 1 if isinstance(type, Var) else _numbers(type)  # any value will do where nothing is asked of it
    return ("number" if size == 1 and not isinstance(type, TupleOf) else "tuple" if size else None), size


def _numbers(type: Type) -> int:
    """How many numbers a value has: 0 if it is neither a number nor a flat tuple of them."""
    type = resolve(type)
    if isinstance(type, Real):
        return 1
    if isinstance(type, TupleOf) and all(isinstance(resolve(item), Real) for item in type.items):
        return len(type.items)
    return 0


def _axes(numbers: list[str]) -> tuple[str, ...]:
    """Two parameters named like coordinates, or the only two, span a picture; else the first spans a curve."""
    for first, second in itertools.pairwise(numbers):
        for one, other in _PAIRS:
            if first.endswith(one) and second == first[: -len(one)] + other:
                return first, second
    return tuple(numbers) if len(numbers) == 2 else tuple(numbers[:1])


def _fits(db: Database, file: str, name: str, type: Type) -> tuple[str, ...]:
    """The names of a file that take as many arguments, and give as many numbers, as a function that is asked for."""
    wanted = [len(group) for group in groups_of(type)]
    found: list[str] = []
    for other in names(db, file):
        target = meaning(db, file, other)
        if other != name and isinstance(target, DefinitionTarget):
            has = interface(db, target.file, target.name).type
            like = [len(group) for group in groups_of(has)] == wanted
            if wanted and like and _numbers(result_of(has)) == (_numbers(result_of(type)) or 1):
                found.append(other)
    return tuple(found)


def _given(db: Database, file: str, name: str) -> dict[str | int, tuple[float, ...]]:
    """The numbers that live expressions give to a function, by name and by place; the first call counts."""
    for chunk in all_chunks(db, file):
        if "#>" not in chunk.text:
            continue
        for live in live_expressions(chunk.text):
            for node in walk(parse_expression(live.text).expr):
                if isinstance(node, nodes.Apply) and (called := _called(node.function)) is not None:
                    of, dual = called
                    if of == name:
                        return dict(_arguments(node.arguments, dual))
    return {}


def _called(head: nodes.Expr) -> tuple[str, bool] | None:
    """The function that is called, and whether it is its derivative."""
    match head:
        case nodes.Paren(_, inner):
            return _called(inner)
        case nodes.Name(_, name):
            return name, False
        case nodes.Apply(_, nodes.Name(_, "deriv"), (argument,), _):
            found = _called(argument.value)
            return None if found is None else (found[0], True)
    return None


def _arguments(given: tuple[nodes.Argument, ...], dual: bool) -> Iterator[tuple[str | int, tuple[float, ...]]]:
    for place, argument in enumerate(given):
        value = _constant(argument.value)
        if dual and isinstance(argument.value, nodes.Tuple):
            value = value[:1]
        key = place if argument.name is None else argument.name[1:] if dual else argument.name
        yield key, value


def _constant(expr: nodes.Expr) -> tuple[float, ...]:
    """The numbers that are written out, or none."""
    match expr:
        case nodes.Number(_, _, value):
            return (value,)
        case nodes.Unary(_, "-", operand):
            return tuple(-value for value in _constant(operand))
        case nodes.Paren(_, inner):
            return _constant(inner)
        case nodes.Tuple(_, items):
            parts = [_constant(item) for item in items]
            return tuple(part[0] for part in parts) if all(len(part) == 1 for part in parts) else ()
    return ()
