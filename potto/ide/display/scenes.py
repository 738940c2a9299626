"""What can be drawn: functions of numbers with values for their parameters. Owns `scenes`.

A function can be drawn of which two numbers can be the axes of a picture, or one that of a curve; all other parameters
are for the viewer to set. They start as a live expression of the file calls the function, if one does.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from typing import Literal

from msgspec import Struct
from msgspec.structs import replace

from potto.ide.names.function_arguments import fits, numbers, of_numbers
from potto.ide.names.live_expressions import piece_lives, wrong_with
from potto.ide.names.places import PieceAt, pieces_of
from potto.modules.texts import pieces
from potto.query import Database, query
from potto.source import NOWHERE, Span
from potto.syntax import nodes, parse_expression
from potto.syntax.walk import walk
from potto.types import Diffeo, Function, TupleOf, Type, format_type, groups_of, interface, result_of
from potto.types.types import resolve

MOST_CALLS = 100  # of a function that are looked at, and the last one
_PAIRS = (("x", "y"), ("u", "v"), ("i", "j"))


class GivenValue(Struct, frozen=True):
    """What a call gives to a parameter: the numbers, if they are written out, and its text."""

    value: tuple[float, ...] = ()
    text: str = ""


Arguments = tuple[tuple[str | int, GivenValue], ...]


class SceneParameter(Struct, frozen=True):
    """A parameter. `size`: how many numbers it has, 0 for a function; `reach`: the least and the largest number that
    live expressions give it, if they give it several; `fits`: texts of functions that it could be given, the one to
    begin with first; `text`: what a live expression gives it, as it is written; `fields`: of a record their names."""

    name: str
    kind: Literal["number", "tuple", "function"]
    type: str
    size: int
    value: tuple[float, ...] = ()
    fits: tuple[str, ...] = ()
    reach: tuple[float, float] | None = None
    text: str = ""
    fields: tuple[str, ...] = ()


class Scene(Struct, frozen=True):
    """A function of numbers: `components` numbers at each place, over the parameters in `axes` to begin with. One whose
    parameters are tuples has no axes."""

    name: str
    span: Span
    parameters: tuple[SceneParameter, ...]
    components: int
    axes: tuple[str, ...]


def scenes(db: Database, file: str, drawable: bool = True) -> tuple[Scene, ...]:
    """The functions of a file that can be drawn, in order; or all functions of numbers."""
    return tuple(
        [
            replace(drawn, span=drawn.span.shift(at.start))
            for at in pieces_of(db, file)
            for drawn in piece_scenes(db, file, at.text, at.hidden)
            if drawn.axes or not drawable
        ]
    )


@query(keep=1024)
def piece_scenes(db: Database, file: str, text: str, hidden: tuple[str, ...]) -> tuple[Scene, ...]:
    """Those of a piece of a file, relative to it."""
    found: list[Scene] = []
    for chunk, name in PieceAt(file, 0, text, hidden).chunks(db):
        drawn = None if name is None else scene(db, file, name)
        if drawn is not None:
            found.append(replace(drawn, span=chunk.absolute(chunk.sketch(db).name_span)))
    return tuple(found)


@query
def scene(db: Database, file: str, name: str) -> Scene | None:
    """A function as it can be drawn, at no place: an edit of another definition leaves it as it is."""
    type = of_numbers(interface(db, file, name).type)
    components = numbers(result_of(type))
    groups = groups_of(type)
    if not components or not groups:
        return None
    calls = [dict(arguments) for arguments in db.entry(_given, (file,), name) or ()]
    made: list[SceneParameter] = []
    for parameter in (parameter for group in groups for parameter in group):
        kind, size = _kind(parameter.type)
        if kind is None or parameter.name is None:
            return None
        places = parameter.name, len(made)
        everywhere = [next((call[place] for place in places if place in call), GivenValue()) for call in calls]
        written = everywhere[0] if everywhere else GivenValue()
        value = written.value if len(written.value) == size else ()
        usable = fits(db, file, name, parameter.type) if kind == "function" else ()
        if kind == "function" and written.text and not wrong_with(db, file, written.text):
            usable = tuple(dict.fromkeys((written.text, *usable)))
        made.append(
            SceneParameter(
                parameter.name,
                kind,
                format_type(parameter.type),
                size,
                value,
                usable,
                reach(everywhere),
                written.text,
                _fields(parameter.type),
            )
        )
    if all(parameter.kind == "function" for parameter in made):
        return None
    axes = _axes([parameter.name for parameter in made if parameter.kind == "number"])
    return Scene(name, NOWHERE, tuple(made), components, axes)


def reach(given: list[GivenValue]) -> tuple[float, float] | None:
    """The least and the largest of the single numbers that calls give, if they differ."""
    found = [one.value[0] for one in given if len(one.value) == 1]
    return (min(found), max(found)) if found and min(found) < max(found) else None


def _kind(type: Type) -> tuple[Literal["number", "tuple", "function"] | None, int]:
    type = resolve(type)
    if isinstance(type, Function | Diffeo):
        return "function", 0
    size = numbers(type)
    return ("number" if size == 1 and not isinstance(type, TupleOf) else "tuple" if size else None), size


def _fields(type: Type) -> tuple[str, ...]:
    type = resolve(type)
    return type.record.fields if isinstance(type, TupleOf) and type.record is not None else ()


def _axes(numbers: list[str]) -> tuple[str, ...]:
    """Two parameters named like coordinates, or the only two, span a picture; else the first spans a curve."""
    for first, second in itertools.pairwise(numbers):
        for one, other in _PAIRS:
            if first.endswith(one) and second == first[: -len(one)] + other:
                return first, second
    return tuple(numbers) if len(numbers) == 2 else tuple(numbers[:1])


@query
def _given(db: Database, file: str) -> Mapping[str, tuple[Arguments, ...]]:
    """What live expressions give to each function, by name and by place, call by call. A table, to be read by entry."""
    table: dict[str, tuple[Arguments, ...]] = {}
    for text in pieces(db, file):
        for live in piece_lives(db, text):
            for called, arguments in _calls(db, live.text):
                table[called] = (*table.get(called, ())[:MOST_CALLS], arguments)
    return table


@query(keep=8192)
def _calls(db: Database, text: str) -> tuple[tuple[str, Arguments], ...]:
    """The functions that an expression calls by name, with what it gives to them."""
    calls = (node for node in walk(parse_expression(text).expr) if isinstance(node, nodes.Apply))
    named = ((_called(node.function), node) for node in calls)
    return tuple(
        (called[0], tuple(_arguments(node.arguments, called[1], text))) for called, node in named if called is not None
    )


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


def _arguments(given: tuple[nodes.Argument, ...], dual: bool, text: str) -> Iterator[tuple[str | int, GivenValue]]:
    for place, argument in enumerate(given):
        written, value = argument.value, _constant(argument.value)
        if dual and isinstance(written, nodes.Tuple):
            value = value[:1]
        match written:
            case nodes.Apply(_, nodes.Name(_, "deriv"), (derived,), _) if dual:
                written = derived.value
        key = place if argument.name is None else argument.name[1:] if dual else argument.name
        yield key, GivenValue(value, text[written.span.start : written.span.end])


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
