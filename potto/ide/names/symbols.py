"""What a name in the text means: a local name, a definition of some file, a module, a builtin.

Owns `symbol_at` and `meaning_of`. Names that a chunk binds itself come from `index`, all others from `potto.modules`.
"""

from __future__ import annotations

from msgspec import Struct

from potto.ide.names.index import BoundName, Occurrence, call_head
from potto.ide.names.parts import part_at, split
from potto.ide.names.places import ChunkAt, chunk_at
from potto.measures import COMPOSITIONS, MEASURES
from potto.modules import (
    DefinitionTarget,
    ModuleTarget,
    chunk_start,
    chunk_text,
    definition,
    find_module,
    is_diffeo,
    resolve,
    resolve_member,
    resolve_module,
)
from potto.modules.builtins import is_builtin
from potto.query import Database
from potto.source import Span
from potto.syntax import nodes
from potto.types import TupleOf, Type

MOST_ALIASES = 20


class LocalSymbol(Struct, frozen=True):
    """A name that the chunk at `start` of a file binds; `number` counts its binders, `prefix` are the `d`s in front of
    the name where a call of a derivative names a parameter."""

    chunk: ChunkAt
    number: int
    binder: BoundName
    prefix: str = ""


class DefinitionSymbol(Struct, frozen=True):
    """A definition. `known`: there is one."""

    file: str
    name: str


class ModuleSymbol(Struct, frozen=True):
    """A module."""

    file: str
    dotted: str


class BuiltinSymbol(Struct, frozen=True):
    """A builtin, a constant or a special form."""

    name: str


class MeasureSymbol(Struct, frozen=True):
    """A measure."""

    name: str


class PartSymbol(Struct, frozen=True):
    """A part without a definition: a column of a table, the `x` of a tuple. `whole` is the type it is a part of."""

    name: str
    whole: Type
    type: Type

    @property
    def data(self) -> str | None:
        """The file that it is a column of."""
        record = self.whole.record if isinstance(self.whole, TupleOf) else None
        return record.file if record is not None and "." in record.name else None

    @property
    def path(self) -> str:
        """Its name within the file; of a column of a record within that, with the names on the way to it."""
        record = self.whole.record if isinstance(self.whole, TupleOf) else None
        file = "" if self.data is None else self.data.replace("\\", "/").rpartition("/")[2]
        within = "" if record is None else record.name.removeprefix(file).removeprefix(".")
        return f"{within}.{self.name}" if within else self.name


Symbol = LocalSymbol | DefinitionSymbol | ModuleSymbol | BuiltinSymbol | MeasureSymbol | PartSymbol


class FoundName(Struct, frozen=True):
    """A name at a place (absolute), and what it means; None if nothing."""

    span: Span
    occurrence: Occurrence
    chunk: ChunkAt
    symbol: Symbol | None


def symbol_at(db: Database, file: str, offset: int) -> FoundName | None:
    """The name that an offset touches and its meaning."""
    chunk = chunk_at(db, file, offset)
    if chunk is None:
        return None
    whole = chunk.index(db).at(offset - chunk.start)
    if whole is None:
        return None
    pieces = split(db, chunk.file, whole)
    occurrence = next((o for o in pieces if offset - chunk.start <= o.span.end), whole)
    return FoundName(chunk.absolute(occurrence.span), occurrence, chunk, meaning_of(db, chunk, occurrence))


def definition_at(db: Database, file: str, offset: int) -> tuple[str, str] | None:
    """The definition that is named at an offset: its file and its name."""
    found = symbol_at(db, file, offset)
    symbol = None if found is None else found.symbol
    return (symbol.file, symbol.name) if isinstance(symbol, DefinitionSymbol) else None


def meaning_of(db: Database, chunk: ChunkAt, occurrence: Occurrence) -> Symbol | None:
    """What an occurrence means."""
    file, name = chunk.file, occurrence.name
    if occurrence.binder >= 0:
        return LocalSymbol(chunk, occurrence.binder, chunk.index(db).binders[occurrence.binder])
    match occurrence.role:
        case "define":
            return DefinitionSymbol(file, name)
        case "module":
            found = find_module(db, file, name)
            return None if found is None else ModuleSymbol(found, name)
        case "path":
            found = resolve_module(db, file, name)
            return outer(db, file, name) if found is None else ModuleSymbol(found, name)
        case "member":
            target = resolve_member(db, file, occurrence.path, name)
            return part(db, chunk, occurrence) if target is None else DefinitionSymbol(target.file, target.name)
        case "field":
            return part(db, chunk, occurrence)
        case "keyword":
            return None if occurrence.callee is None else keyword_symbol(db, chunk, occurrence.callee, name)
        case "measure":
            return MeasureSymbol(name) if name in MEASURES or name in COMPOSITIONS else None
        case "import":
            return imported(db, file, occurrence.path, name)
        case _:
            return outer(db, file, name)


def part(db: Database, chunk: ChunkAt, occurrence: Occurrence) -> Symbol | None:
    """What the name of a part means. The field of a record is a parameter of the record's definition."""
    found = part_at(db, chunk, occurrence.span)
    if found is None:
        return None
    record = found.whole.record if isinstance(found.whole, TupleOf) else None
    field = None if record is None else parameter_symbol(db, record.file, record.name, occurrence.name)
    return PartSymbol(found.name, found.whole, found.type) if field is None else field


def outer(db: Database, file: str, name: str) -> Symbol | None:
    """What a name means at the top of a file."""
    target = resolve(db, file, name)
    if isinstance(target, DefinitionTarget):
        return DefinitionSymbol(target.file, target.name)
    if isinstance(target, ModuleTarget):
        return ModuleSymbol(target.file, target.dotted)
    return BuiltinSymbol(name) if is_builtin(name) else None


def imported(db: Database, file: str, module: str, name: str) -> Symbol | None:
    """What `from module import name` brings."""
    where = find_module(db, file, module)
    target = None if where is None else resolve(db, where, name)
    if isinstance(target, DefinitionTarget):
        return DefinitionSymbol(target.file, target.name)
    inner = find_module(db, file, f"{module}.{name}")
    return None if inner is None else ModuleSymbol(inner, f"{module}.{name}")


# Calls


class Callee(Struct, frozen=True):
    """The definition that a call is of, how many groups of arguments were given before, and how often it was
    differentiated."""

    file: str
    name: str
    given: int
    derived: int


def callee(db: Database, file: str, expr: nodes.Expr) -> Callee | None:
    """The definition that an expression calls, through partial calls, `deriv` and other names for it. The expression's
    names are those at the top of the file: the caller sees to local ones."""
    given = derived = 0
    for _ in range(MOST_ALIASES):
        function, groups, times = call_head(expr)
        given, derived = given + groups, derived + times
        target: object = None
        if isinstance(function, nodes.Name):
            target = resolve(db, file, function.id)
        elif isinstance(function, nodes.Member):
            target = resolve_member(db, file, function.path, function.name)
        if not isinstance(target, DefinitionTarget):
            return None
        item = definition(db, target.file, target.name)
        if (
            not isinstance(item, nodes.Definition)
            or item.groups
            or item.bindings
            or isinstance(item.body, nodes.Lambda)
        ):
            return Callee(target.file, target.name, given, derived)
        expr, file = item.body, target.file
    return None


def parameters(db: Database, file: str, name: str) -> tuple[tuple[nodes.Parameter, ...], ...]:
    """The groups of parameters that a definition writes, also those of a lambda that it is."""
    item = definition(db, file, name)
    if isinstance(item, nodes.DiffeoDefinition):
        return (item.variables, *item.groups)
    if item is None:
        return ()
    groups, body = list(item.groups), item.body
    while isinstance(body, nodes.Lambda):
        groups += body.groups
        body = body.body
    return tuple(groups)


def keyword_symbol(db: Database, chunk: ChunkAt, function: nodes.Expr, name: str) -> LocalSymbol | None:
    """The parameter that a keyword argument fills."""
    called = callee(db, chunk.file, function)
    if called is None:
        return None
    prefix = "d" * called.derived
    if not name.startswith(prefix):
        return None
    return parameter_symbol(db, called.file, called.name, name[len(prefix) :], prefix)


def parameter_symbol(db: Database, file: str, name: str, parameter: str, prefix: str = "") -> LocalSymbol | None:
    """A parameter of a definition as a local name of it."""
    written = next((p for group in parameters(db, file, name) for p in group if p.name == parameter), None)
    target = home(db, file, name)
    if written is None or target is None:
        return None
    for number, binder in enumerate(target.index(db).binders):
        if binder.kind == "parameter" and binder.span.start == written.span.start:
            return LocalSymbol(target, number, binder, prefix)
    return None


def home(db: Database, file: str, name: str) -> ChunkAt | None:
    """The chunk of a definition."""
    text = chunk_text(db, file, name)
    return None if text is None else ChunkAt(file, chunk_start(db, file, name), text, is_diffeo(file))


def placeless(db: Database, file: str, name: str) -> ChunkAt | None:
    """The chunk of a definition as if it stood at the beginning of its file: queries must not read places."""
    text = chunk_text(db, file, name)
    return None if text is None else ChunkAt(file, 0, text, is_diffeo(file))
