"""The questions about types, memoized: interfaces, diagnostics, expressions and statements.

What a definition needs is fetched before it is analysed, so that no inference runs inside another one. Its analysis is
one query; `interface` is the part of it that stands still when an edit does not change it: whoever uses a definition
reads that only. `plain_reasons` and `typed_names` are asked of few definitions, by messages and editors; for those it
is analysed once more.
"""

from __future__ import annotations

from collections.abc import Container, Sequence

from msgspec import Struct

from potto.diagnostics import Diagnostic
from potto.modules.free import Reference, references_in
from potto.modules.graph import refer, references, strongly_connected
from potto.modules.lookup import DefinitionTarget, ModuleTarget, resolve_member
from potto.modules.texts import chunk_references, chunk_text, definition, is_diffeo, parsed
from potto.query import Database, query
from potto.syntax import nodes
from potto.types import motionless
from potto.types.algebra import symbolic
from potto.types.analysis import DefinitionAnalysis, Typed, analyse, local_type, parts, typed
from potto.types.context import Inference, NamedPart, ensure_stack
from potto.types.flow import Walk
from potto.types.flow_binders import walk_statement
from potto.types.hidden_names import with_names, without_names
from potto.types.integrals import statement as infer_statement
from potto.types.interfaces import Interface, unknown_interface
from potto.types.lints import lints
from potto.types.reasons import Reasons
from potto.types.scope import InterfaceName, Local, Meaning, ModuleName, Outside, RecursiveName
from potto.types.types import Type
from potto.types.unify import bare, open_type
from potto.types.values import Port, Source, Value


class Inferred(Struct, frozen=True):
    """The type of an expression (or of none), and what is wrong with it. Spans are the expression's."""

    type: Type
    diagnostics: tuple[Diagnostic, ...]


@query(travels=True)
def interface(db: Database, file: str, name: str) -> Interface:
    """What others may know of a definition: its type, and what flows where. Broken ones have one too."""
    found = _analysis(db, file, name)
    return unknown_interface(name) if found is None else found.interface


@query(travels=True, cuts=True)
def called(db: Database, file: str, name: str) -> Interface:
    """The interface of a definition for whoever only calls it, by place: with signs for the names of parameters."""
    return without_names(interface(db, file, name), DefinitionTarget(file, name))


@query(travels=True, cuts=True)
def shape(db: Database, file: str, name: str) -> Type:
    """The type of a definition as far as it decides what calls are made of: without the names of its parameters, and
    without what varies with what. Most edits of a definition leave it as it is."""
    return bare(interface(db, file, name).type)


def check_definition(db: Database, file: str, name: str) -> tuple[Diagnostic, ...]:
    """What is wrong with a definition. Spans are relative to its chunk."""
    found = _analysis(db, file, name)
    if found is None or not found.diagnostics:
        return ()
    told = with_names(found.diagnostics, lambda target: sum(interface(db, target.file, target.name).groups, ()))
    if told is None:  # a name was cut off
        known = db.entry(_details, (_group(db, file, name),), DefinitionTarget(file, name))
        told = () if known is None else known.diagnostics
    return told


@query
def plain_reasons(db: Database, file: str, name: str) -> Reasons:
    """Why which parameters of a definition must not vary: places in it, for messages about its callers."""
    found = db.entry(_details, (_group(db, file, name),), DefinitionTarget(file, name))
    return Reasons() if found is None else found.reasons


@query
def typed_names(db: Database, file: str, name: str) -> tuple[Typed, ...]:
    """The names that a definition binds, with their types there: `Real[x]` inside an integral over x."""
    found = db.entry(_details, (_group(db, file, name),), DefinitionTarget(file, name))
    return () if found is None else found.names


@query
def typed_parts(db: Database, file: str, name: str) -> tuple[NamedPart, ...]:
    """The names of parts that a definition writes, `u.x` and `c with x = 1`, and what they are parts of."""
    found = db.entry(_details, (_group(db, file, name),), DefinitionTarget(file, name))
    return () if found is None else found.parts


def _analysis(db: Database, file: str, name: str) -> DefinitionAnalysis | None:
    """The analysis of a definition. One that stands alone is read whole: that is verified in one step less."""
    group, target = _group(db, file, name), DefinitionTarget(file, name)
    return _analyses(db, group).get(target) if len(group) == 1 else db.entry(_analyses, (group,), target)


def _group(db: Database, file: str, name: str) -> tuple[DefinitionTarget, ...]:
    return strongly_connected(db, file, name)


def _nothing(db: Database, group: tuple[DefinitionTarget, ...]) -> dict[DefinitionTarget, DefinitionAnalysis]:
    """In a cycle that the graph of definitions does not show there is nothing to be known."""
    return {}


@query(cycle=_nothing)
def _analyses(db: Database, group: tuple[DefinitionTarget, ...]) -> dict[DefinitionTarget, DefinitionAnalysis]:
    """The analyses of definitions that need each other."""
    return _analysed(db, group, details=False)


@query(cycle=_nothing, keep=256)
def _details(db: Database, group: tuple[DefinitionTarget, ...]) -> dict[DefinitionTarget, DefinitionAnalysis]:
    """The same with all that is asked only where somebody looks: kept for few, and made anew for others."""
    return _analysed(db, group, details=True)


def _analysed(
    db: Database, group: tuple[DefinitionTarget, ...], details: bool
) -> dict[DefinitionTarget, DefinitionAnalysis]:
    items = {}
    for target in group:
        item = definition(db, target.file, target.name)
        if item is not None:
            items[target] = item
    outsides = {}
    for target in items:
        used, only_called = references(db, *target), () if details else _only_called(db, target)
        outsides[target] = _outside(db, target.file, used, items, only_called)
    broken = frozenset(target for target in items if _broken(db, target.file, target.name))
    return analyse(items, outsides, broken, details)


def _broken(db: Database, file: str, name: str) -> bool:
    """Whether the parser could read a definition only by guessing."""
    text = chunk_text(db, file, name)
    found = () if text is None else parsed(db, text, is_diffeo(file)).diagnostics
    return any(diagnostic.severity == "error" for diagnostic in found)


def _only_called(db: Database, target: DefinitionTarget) -> Container[Reference]:
    """What a definition does nothing with but call it, all arguments by their places."""
    text = chunk_text(db, target.file, target.name)
    return () if text is None else chunk_references(db, text, is_diffeo(target.file)).only_called


def _outside(
    db: Database, file: str, used: Sequence[Reference], group: Container[DefinitionTarget] = (),
    only_called: Container[Reference] = (),
) -> Outside:  # fmt: skip
    """What a file provides under the names that are used. What is only called needs no names of parameters."""
    known: dict[Reference, Meaning] = {}
    for path, name in used:
        target = refer(db, file, path, name)
        if path is not None and target is not None and resolve_member(db, file, path, name) is None:
            name, path = path.partition(".")[0], None  # a field of a definition
        if isinstance(target, ModuleTarget):
            known[path, name] = ModuleName(name)
        elif target is not None and target in group:
            known[path, name] = RecursiveName(target)
        elif target is not None:
            of = called if (path, name) in only_called else interface
            known[path, name] = InterfaceName(target, of(db, target.file, target.name))
    return Outside(db, file, lambda target: plain_reasons(db, target.file, target.name), known)


@query(keep=1024)
def check_statement(db: Database, file: str, statement: nodes.Statement) -> tuple[Diagnostic, ...]:
    """What is wrong with a statement of a script. Spans are the statement's."""
    ensure_stack()
    inference = Inference(_outside(db, file, references_in(statement).every), {})
    infer_statement(inference, statement)
    inference.finish()
    walk = Walk(inference, {})
    walk_statement(walk, statement)
    found = [*inference.diagnostics, *walk.diagnostics, *lints(inference, walk, statement)]
    return tuple(sorted(found, key=lambda diagnostic: (diagnostic.span, diagnostic.code)))


@query(keep=1024)
def statement_parts(db: Database, file: str, statement: nodes.Statement) -> tuple[NamedPart, ...]:
    """The names of parts in a statement of a script, or in an expression by itself."""
    ensure_stack()
    inference = Inference(_outside(db, file, references_in(statement).every), {})
    infer_statement(inference, statement)
    inference.finish()
    return parts(inference)


@query(keep=1024)
def infer_expression(db: Database, file: str, expr: nodes.Expr, locals: tuple[tuple[str, Type], ...] = ()) -> Inferred:
    """The type of an expression in a file's scope. `locals`: further names that have a type, innermost last."""
    return _inferred(db, file, expr, locals)[0]


@query(keep=1024)
def is_derivative(db: Database, file: str, expr: nodes.Expr) -> bool:
    """Whether an expression in a file's scope is the derivative of a function, so that it moves with its arguments
    alone."""
    ensure_stack()
    inference = Inference(_outside(db, file, references_in(expr).every), {})
    inference.infer(expr)
    return motionless.is_derivative(inference, expr)


def expression_names(
    db: Database, file: str, expr: nodes.Expr, locals: tuple[tuple[str, Type], ...] = ()
) -> tuple[Typed, ...]:
    """The names that an expression binds, with their types there."""
    return _inferred(db, file, expr, locals)[1]


def _inferred(
    db: Database, file: str, expr: nodes.Expr, locals: tuple[tuple[str, Type], ...]
) -> tuple[Inferred, tuple[Typed, ...]]:
    ensure_stack()
    inference = Inference(_outside(db, file, references_in(expr).every), {})
    given: dict[Local, Value] = {}
    for name, type in locals:
        opened = open_type(type, inference.level)
        local = Local(name, expr.span, "loop", opened, used=True)
        inference.scope.bind(local)
        given[local] = symbolic(opened, lambda: Source("other", "?"), lambda: Port("?"))
    type = inference.infer(expr)
    inference.finish()
    walk = Walk(inference, {})
    walk.locals.update(given)
    value = walk.value(expr)
    found = (*inference.diagnostics, *walk.diagnostics)
    answer = Inferred(local_type(type, value), tuple(sorted(found, key=lambda d: (d.span, d.code))))
    return answer, typed(inference, walk)
