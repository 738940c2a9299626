"""Hover of local names: parameters, names of a block, variables of integration, indices, loops."""

from __future__ import annotations

from potto.ide.explaining import code, condition_infos, fence
from potto.ide.places import ChunkAt
from potto.ide.symbols import LocalSymbol, owner
from potto.query import Database
from potto.source import Span
from potto.syntax import nodes, walk
from potto.types import (
    ListOf,
    Real,
    Type,
    Unknown,
    derivative_type,
    format_type,
    infer_expression,
    interface,
    typed_names,
)

LONG_VALUE = 120
TITLES = {
    "parameter": "parameter",
    "local": "local name",
    "variable": "variable of integration",
    "index": "index of a sum",
    "loop": "loop variable",
}


def local_markdown(db: Database, symbol: LocalSymbol, file: str) -> str:
    """What there is to say about a local name."""
    chunk, binder = symbol.chunk, symbol.binder
    name = owner(db, chunk)
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
        what += f" of {code(name)}"
    parts = [fence("\n".join(lines)), what]
    match binder.kind:
        case "variable":
            parts += _variable(db, chunk, binder.span, binder.name, name)
        case "parameter" if name is not None:
            parts += _parameter(db, chunk, name, binder.name)
        case "local" | "loop" | "index":
            parts += _value(db, chunk, binder.span, type)
    return "\n\n".join(parts)


def local_type(db: Database, symbol: LocalSymbol) -> Type:
    """The type of a local name where it is bound."""
    name = owner(db, symbol.chunk)
    if name is not None:
        for typed in typed_names(db, symbol.chunk.file, name):
            if typed.span.start == symbol.binder.span.start:
                return typed.type
    return _statement_type(db, symbol)


def _statement_type(db: Database, symbol: LocalSymbol) -> Type:
    """In a statement: the type of an item of the list, or of what a name was bound to."""
    item = symbol.chunk.parsed(db).item
    if item is None:
        return Unknown()
    for node in walk(item):
        if isinstance(node, nodes.For) and node.variable.span == symbol.binder.span:
            found = infer_expression(db, symbol.chunk.file, node.iterable).type
            return found.item if isinstance(found, ListOf) else Unknown()
        if isinstance(node, nodes.Integral | nodes.Sum) and symbol.binder.kind in ("variable", "index"):
            return Real(variables=(symbol.binder.name,) if symbol.binder.kind == "variable" else ())
    return Unknown()


def bound_by(db: Database, chunk: ChunkAt, span: Span) -> nodes.Node | None:
    """The node that binds the name at a place: an integral, a sum, a binding, a loop, a lambda."""
    item = chunk.parsed(db).item
    for node in () if item is None else walk(item):
        match node:
            case nodes.Integral(variables=variables) if any(v.span == span for v in variables):
                return node
            case nodes.Sum(variable=variable) | nodes.For(variable=variable) if variable.span == span:
                return node
            case nodes.Binding(targets=targets) if any(t.span == span for t in targets):
                return node
    return None


def _variable(db: Database, chunk: ChunkAt, span: Span, variable: str, name: str | None) -> list[str]:
    node = bound_by(db, chunk, span)
    parts: list[str] = []
    if isinstance(node, nodes.Integral):
        place = [v.span for v in node.variables].index(span)
        if place < len(node.bounds):
            parts.append(_domain(chunk, node.bounds[place], variable))
    if name is None:
        return parts
    typed = typed_names(db, chunk.file, name)
    varying = dict.fromkeys(
        t.name for t in typed if isinstance(t.type, Real) and variable in t.type.variables and t.name != variable
    )
    if varying:
        parts.append("varies with it: " + ", ".join(code(v) for v in varying))
    surfaces = [info for info in condition_infos(db, chunk.file, name) if variable in info.variables]
    for info in surfaces:
        moved = f", moved by {', '.join(code(m) for m in info.moved_by)}" if info.moved_by else ""
        parts.append(f"- surface {code(info.coordinates[0] + ' = 0')}{moved}")
    return parts


def written(chunk: ChunkAt, expr: nodes.Expr) -> str:
    """An expression as it is written, on one line."""
    return " ".join(chunk.text[expr.span.start : expr.span.end].split())


def _domain(chunk: ChunkAt, bounds: nodes.Interval | nodes.MeasureBound, variable: str) -> str:
    if isinstance(bounds, nodes.Interval):
        return f"from {code(written(chunk, bounds.lo))} to {code(written(chunk, bounds.hi))}"
    arguments = ", ".join(written(chunk, a) for a in bounds.arguments)
    return f"distributed as {code(f'{variable} ~ {bounds.measure}({arguments})')}"


def _parameter(db: Database, chunk: ChunkAt, name: str, parameter: str) -> list[str]:
    found = interface(db, chunk.file, name)
    parts: list[str] = []
    if parameter in found.plain:
        parts.append("must not vary: it decides a plain condition, or jumps")
    if parameter in found.varies:
        parts.append(f"the result of {code(name)} varies with it")
    moved = [i for i in condition_infos(db, chunk.file, name) if parameter in i.moved_by]
    parts += [f"- moves the surface {code(i.coordinates[0] + ' = 0')}" for i in moved]
    return parts


def _value(db: Database, chunk: ChunkAt, span: Span, type: Type) -> list[str]:
    node = bound_by(db, chunk, span)
    parts: list[str] = []
    match node:
        case nodes.Binding(value=value) if len(text := written(chunk, value)) <= LONG_VALUE:
            parts.append(f"is {code(text)}")
        case nodes.Sum(lo=lo, hi=hi):
            parts.append(f"from {code(written(chunk, lo))} to {code(written(chunk, hi))}")
        case nodes.For(iterable=iterable) if len(text := written(chunk, iterable)) <= LONG_VALUE:
            parts.append(f"in {code(text)}")
        case _:
            pass
    if isinstance(type, Real) and type.variables:
        parts.append("varies with " + ", ".join(code(v) for v in type.variables))
    return parts


__all__ = ["bound_by", "local_markdown", "local_type"]
