"""Hover of local names: parameters, names of a block, variables of integration, indices, loops."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from msgspec.structs import replace

from potto.ide.hover.derivatives import code, condition_infos, fence
from potto.ide.names.places import ChunkAt, owner
from potto.ide.names.symbols import LocalSymbol, parameters
from potto.query import Database
from potto.source import Span
from potto.syntax import live_expressions, nodes, parse_expression, walk
from potto.syntax.live import Live
from potto.types import (
    ArrayOf,
    Real,
    Type,
    Unknown,
    derivative_type,
    expression_names,
    format_type,
    groups_of,
    infer_expression,
    interface,
    typed_names,
)
from potto.types.analysis import Typed

LONG_VALUE = 120
TITLES = {
    "parameter": "parameter",
    "local": "local name",
    "variable": "variable of integration",
    "index": "index",
    "loop": "loop variable",
    "size": "size",
}


def local_markdown(db: Database, symbol: LocalSymbol) -> str:
    """What there is to say about a local name."""
    chunk, binder = symbol.chunk, symbol.binder
    name = owner(db, chunk)
    if chunk.sketch(db).record:
        return _field(db, symbol)
    type = local_type(db, symbol)
    shown = type
    for _ in symbol.prefix:
        shown = derivative_type(shown)
    lines = [f"{symbol.prefix}{binder.name} : {format_type(shown)}"]
    derived = derivative_type(shown)
    if binder.kind in ("parameter", "local") and not isinstance(derived, Unknown):
        lines.append(f"d{symbol.prefix}{binder.name} : {format_type(derived)}")
    what = TITLES[binder.kind]
    if name is not None:
        what += f" {'in' if binder.kind == 'index' else 'of'} {code(name)}"
    parts = [fence("\n".join(lines)), what]
    match binder.kind:
        case "variable":
            parts += _variable(db, chunk, binder.span, binder.name, name)
        case "parameter" if name is not None and live_at(chunk, binder.span.start) is None:
            parts += _parameter(db, chunk, name, binder.name)
        case "local" | "loop" | "index":
            parts += _value(db, chunk, binder.span, type)
    return "\n\n".join(parts)


def _field(db: Database, symbol: LocalSymbol) -> str:
    """A field of a record, as it is declared."""
    chunk, binder = symbol.chunk, symbol.binder
    item = chunk.parsed(db).item
    fields = item.fields if isinstance(item, nodes.RecordDefinition) else ()
    declared = next((f for f in fields if f.span.start == binder.span.start), None)
    shown = binder.name if declared is None else " ".join(chunk.text[declared.span.start : declared.span.end].split())
    return f"{fence(shown.replace(':', ' :', 1))}\n\nfield of {code(chunk.sketch(db).name or '')}"


def local_type(db: Database, symbol: LocalSymbol) -> Type:
    """The type of a local name where it is bound; for a parameter, the type that it accepts."""
    chunk, binder = symbol.chunk, symbol.binder
    if binder.kind == "size":
        return Real()
    name = owner(db, chunk)
    inside = live_at(chunk, binder.span.start)
    if name is None or inside is not None:
        return _typed_at(_names_of(db, chunk, inside), binder.span.start)
    if binder.kind == "parameter" and any(p.span.start == binder.span.start for p in _written(db, chunk.file, name)):
        public = {p.name: p.type for group in groups_of(interface(db, chunk.file, name).type) for p in group}
        if binder.name in public:
            return public[binder.name]
    return _typed_at(typed_names(db, chunk.file, name), binder.span.start)


def _written(db: Database, file: str, name: str) -> tuple[nodes.Parameter, ...]:
    return tuple(parameter for group in parameters(db, file, name) for parameter in group)


def _typed_at(names: Iterable[Typed], start: int) -> Type:
    return next((typed.type for typed in names if typed.span.start == start), Unknown())


def live_at(chunk: ChunkAt, place: int) -> Live | None:
    """The live expression of a chunk that a place in it is in."""
    if "#>" not in chunk.text:
        return None
    found = (live for live in live_expressions(chunk.text) if live.text_span.start <= place <= live.text_span.end)
    return next(found, None)


def _names_of(db: Database, chunk: ChunkAt, live: Live | None) -> Iterator[Typed]:
    """The names that a live expression or the statement of a chunk binds."""
    if live is not None:
        for typed in expression_names(db, chunk.file, parse_expression(live.text).expr):
            yield replace(typed, span=typed.span.shift(live.text_span.start))
        return
    item = chunk.parsed(db).item
    if isinstance(item, nodes.For | nodes.Print | nodes.ExpressionStatement):
        yield from _statement_names(db, chunk.file, item, ())


def _statement_names(
    db: Database, file: str, item: nodes.Statement, loops: tuple[tuple[str, Type], ...]
) -> Iterator[Typed]:
    match item:
        case nodes.For(variable=variable, iterable=iterable, body=body):
            yield from expression_names(db, file, iterable, loops)
            found = infer_expression(db, file, iterable, loops).type
            type = found.item if isinstance(found, ArrayOf) else Unknown()
            yield Typed(variable.span, variable.name, type)
            for inner in body:
                yield from _statement_names(db, file, inner, (*loops, (variable.name, type)))
        case nodes.Print(arguments=arguments):
            for argument in arguments:
                yield from expression_names(db, file, argument, loops)
        case nodes.ExpressionStatement(value=value):
            yield from expression_names(db, file, value, loops)
        case _:
            pass


def bound_by(db: Database, chunk: ChunkAt, span: Span) -> tuple[nodes.Node, str] | None:
    """The node that binds the name at a place (an integral, a sum, a binding, a loop), and the text that it is of."""
    live = live_at(chunk, span.start)
    root: nodes.Node | None = chunk.parsed(db).item if live is None else parse_expression(live.text).expr
    text = chunk.text if live is None else live.text
    span = span if live is None else span.shift(-live.text_span.start)
    for node in () if root is None else walk(root):
        match node:
            case nodes.Integral(variables=variables) if any(v.span == span for v in variables):
                return node, text
            case nodes.Clause(variable=variable) | nodes.For(variable=variable) if variable.span == span:
                return node, text
            case nodes.Binding(targets=targets) if any(t.span == span for t in targets):
                return node, text
    return None


def _variable(db: Database, chunk: ChunkAt, span: Span, variable: str, name: str | None) -> list[str]:
    node, text = bound_by(db, chunk, span) or (None, "")
    parts: list[str] = []
    if isinstance(node, nodes.Integral):
        place = [v.name for v in node.variables].index(variable)
        if place < len(node.bounds):
            parts.append(_domain(text, node.bounds[place], variable))
    if name is None or live_at(chunk, span.start) is not None:
        return parts
    typed = typed_names(db, chunk.file, name)
    varying = dict.fromkeys(
        code(t.name) for t in typed if isinstance(t.type, Real) and variable in t.type.variables and t.name != variable
    )
    inner = [code(name) for name in _bounded(node, variable)]
    if inner:
        varying[f"the bounds of {', '.join(inner)}"] = None
    if varying:
        parts.append("varies with it: " + ", ".join(varying))
    surfaces = {i.equation: i.moved_by for i in condition_infos(db, chunk.file, name) if variable in i.variables}
    for where, by in surfaces.items():
        moved = f", moved by {', '.join(code(m) for m in by)}" if by else ""
        parts.append(f"- surface {code(where)}{moved}")
    return parts


def _bounded(node: nodes.Node | None, variable: str) -> Iterator[str]:
    """The inner variables whose bounds mention a variable of integration."""
    if isinstance(node, nodes.Integral):
        for inner, bounds in zip(node.variables, node.bounds):
            if any(isinstance(part, nodes.Name) and part.id == variable for part in walk(bounds)):
                yield inner.name


def written(text: str, expr: nodes.Expr) -> str:
    """An expression as it is written, on one line."""
    return " ".join(text[expr.span.start : expr.span.end].split())


def _domain(text: str, bounds: nodes.Interval | nodes.MeasureBound, variable: str) -> str:
    if isinstance(bounds, nodes.Interval):
        return f"from {code(written(text, bounds.lo))} to {code(written(text, bounds.hi))}"
    return f"distributed as {code(f'{variable} ~ {text[bounds.measure_span.start : bounds.span.end]}')}"


def _parameter(db: Database, chunk: ChunkAt, name: str, parameter: str) -> list[str]:
    found = interface(db, chunk.file, name)
    parts: list[str] = []
    if parameter in found.plain:
        asked = any(p.name == parameter and p.annotation is not None for p in _written(db, chunk.file, name))
        why = "its annotation says so" if asked else "it decides a plain condition, or jumps"
        parts.append(f"must not vary: {why}")
    if parameter in found.varies:
        parts.append(f"the result of {code(name)} varies with it")
    moved = dict.fromkeys(i.equation for i in condition_infos(db, chunk.file, name) if parameter in i.moved_by)
    parts += [f"- moves the surface {code(where)}" for where in moved]
    return parts


def _value(db: Database, chunk: ChunkAt, span: Span, type: Type) -> list[str]:
    node, source = bound_by(db, chunk, span) or (None, "")
    parts: list[str] = []
    match node:
        case nodes.Binding():
            parts += _bound_to(node, source, span)
        case nodes.Clause(over=nodes.Range(lo=lo, hi=hi)):
            parts.append(f"from {code(written(source, lo))} to {code(written(source, hi))}")
        case nodes.Clause(over=over) if len(text := written(source, over)) <= LONG_VALUE:  # type: ignore[arg-type]
            parts.append(f"in {code(text)}")
        case nodes.For(iterable=iterable) if len(text := written(source, iterable)) <= LONG_VALUE:
            parts.append(f"in {code(text)}")
        case _:
            pass
    if isinstance(type, Real) and type.variables:
        parts.append("varies with " + ", ".join(code(v) for v in type.variables))
    return parts


def _bound_to(binding: nodes.Binding, source: str, span: Span) -> Iterator[str]:
    """What a name is bound to; for one of several names in parentheses, its part."""
    value: nodes.Expr = binding.value
    which = ""
    if len(binding.targets) > 1:
        number = next((n for n, t in enumerate(binding.targets) if t.span == span), 0)
        if isinstance(value, nodes.Tuple) and len(value.items) == len(binding.targets):
            value = value.items[number]
        else:
            which = f"part {number + 1} of "
    text = written(source, value)
    if len(text) <= LONG_VALUE:
        yield f"is {which}{code(text)}"


__all__ = ["bound_by", "local_markdown", "local_type"]
