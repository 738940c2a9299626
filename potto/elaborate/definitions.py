"""The questions to elaboration: core terms of definitions, expressions, statements, and the parts of diffeomorphisms.

A definition's term is closed but for references to other definitions (`Global`), so that it depends on their names and
signatures only.
"""

from __future__ import annotations

from collections.abc import Iterable

from msgspec import Struct

from potto.core.terms import App, Global, Term, hole, tuple_, var
from potto.elaborate import arrays, binders, calls, expressions  # noqa: F401  (imported for their rules)
from potto.elaborate.context import Elaboration, lambdas
from potto.elaborate.values import EMPTY, LocalFunction, LocalNames, annotated
from potto.modules.texts import definition
from potto.query import Database, query
from potto.source import Span
from potto.syntax import nodes
from potto.types import shape
from potto.types.context import ensure_stack
from potto.types.types import Type, groups_of

Locals = Iterable[str | tuple[str, Term]]
Names = tuple[str, ...]


class Elaborated(Struct, frozen=True):
    """A core term, and where its branches, plain conditionals, deltas, calls and integrals were written.

    Spans are relative to the chunk. What is wrong is a `Hole` in the term: the checkers say it.
    """

    term: Term
    origins: tuple[tuple[Term, Span], ...] = ()


class InverseCore(Struct, frozen=True):
    """The author's inverse: the variables as terms over names for the components (and the map's parameters)."""

    values: Names
    components: tuple[Term, ...]


class DiffeoCore(Struct, frozen=True):
    """A diffeomorphism's parts over the names of its parameters.

    `where` are truth-valued terms that select a branch.
    """

    variables: Names
    groups: tuple[Names, ...]
    components: tuple[Term, ...]
    inverse: InverseCore | None
    where: tuple[Term, ...]


@query
def core(db: Database, file: str, name: str) -> Elaborated:
    """The core term of a definition, closed but for the definitions that it uses (`Global`)."""
    ensure_stack()
    item = definition(db, file, name)
    if item is None:
        return Elaborated(hole(f"`{name}` could not be read"))
    elaboration = Elaboration(db, file)
    if isinstance(item, nodes.DiffeoDefinition):
        parts = _diffeo(elaboration, item)
        return _finished(elaboration, lambdas((parts.variables, *parts.groups), tuple_(parts.components)))
    groups = tuple(tuple(parameter.name for parameter in group) for group in item.groups)
    if groups:
        closure = LocalFunction(groups, item.bindings, item.body, EMPTY, annotated(item.groups))
        types = [[p.type for p in group] for group in groups_of(shape(db, file, name))]
        return _finished(elaboration, elaboration.function(closure, types))
    value = elaboration.term(item.body, elaboration.block(item.bindings, EMPTY))
    return _finished(elaboration, elaboration.whole(value) if _is_call(value) else value)


def _is_call(term: Term) -> bool:
    """Whether a term is a call of a definition, not of its derivative."""
    head = term
    while isinstance(head, App):
        head = head.function
    return head is not term and isinstance(head, Global)


@query
def core_term(db: Database, file: str, name: str) -> Term:
    """The core term alone: stands still when an edit moves places only."""
    return core(db, file, name).term


@query
def diffeo_core(db: Database, file: str, name: str) -> DiffeoCore | None:
    """The parts of a diffeomorphism's definition; None for any other."""
    ensure_stack()
    item = definition(db, file, name)
    return _diffeo(Elaboration(db, file), item) if isinstance(item, nodes.DiffeoDefinition) else None


def elaborate_expression(
    db: Database, file: str, expr: nodes.Expr, locals: Locals = (), types: tuple[tuple[str, Type], ...] = ()
) -> Elaborated:
    """The core term of an expression with a file's names in scope.

    `locals` are further names: one alone stays a free variable, `(name, term)` stands for the term.
    `types` are those of free variables that stand for more than a number.
    """
    ensure_stack()
    with db.evaluating():
        elaboration, scope = _opened(db, file, locals)
        elaboration.shapes.names.update(types)
        return _finished(elaboration, elaboration.term(expr, scope))


def _opened(db: Database, file: str, locals: Locals) -> tuple[Elaboration, LocalNames]:
    pairs = [(given, var(given)) if isinstance(given, str) else given for given in locals]
    taken = {name for _, term in pairs for name in term.free}
    return Elaboration(db, file, taken), EMPTY.bind(dict(pairs))


def _finished(elaboration: Elaboration, term: Term) -> Elaborated:
    if not elaboration.shapes.meets_records:
        return Elaborated(term, tuple(elaboration.origins.items()))
    made: dict[Term, Term] = {}
    found = elaboration.shapes.erased(term, made)
    origins = {made.get(part, part): place for part, place in elaboration.origins.items()}
    return Elaborated(found, tuple(origins.items()))


def _diffeo(elaboration: Elaboration, item: nodes.DiffeoDefinition) -> DiffeoCore:
    variables, scope = elaboration.bind((parameter.name for parameter in item.variables), EMPTY)
    groups = []
    for group in item.groups:
        names, scope = elaboration.bind((parameter.name for parameter in group), scope)
        groups.append(names)
    scope = elaboration.block(item.bindings, scope)
    components = elaboration.terms(item.components, scope)
    inverse = None
    if item.inverse is not None:
        values, inner = elaboration.bind((parameter.name for parameter in item.inverse.parameters), scope)
        inverse = InverseCore(values, elaboration.terms(item.inverse.components, inner))
    return DiffeoCore(variables, tuple(groups), components, inverse, elaboration.terms(item.where, scope))


# Statements of scripts


class ShowCore(Struct, frozen=True):
    """`print(e, …)` or a bare expression: the terms of what is shown."""

    values: tuple[Elaborated, ...]


class BindCore(Struct, frozen=True):
    """`a = e` or `(a, b) = e`: the names and the whole of what is bound."""

    names: Names
    value: Elaborated


class ForCore(Struct, frozen=True):
    """`for v in list`: the list; the body is elaborated once for each item, with `(variable, item)` as a local."""

    variable: str
    iterable: Elaborated
    body: tuple[nodes.Statement, ...]


StatementCore = ShowCore | BindCore | ForCore


def elaborate_statement(db: Database, file: str, statement: nodes.Statement, locals: Locals = ()) -> StatementCore:
    """The core terms of a script's statement."""
    given = tuple(locals)
    match statement:
        case nodes.Print(arguments=arguments):
            return ShowCore(tuple(elaborate_expression(db, file, e, given) for e in arguments))
        case nodes.ExpressionStatement(value=value):
            return ShowCore((elaborate_expression(db, file, value, given),))
        case nodes.Binding(targets=targets, value=value):
            return BindCore(tuple(t.name for t in targets), elaborate_expression(db, file, value, given))
        case nodes.For(variable=variable, iterable=iterable, body=body):
            return ForCore(variable.name, elaborate_expression(db, file, iterable, given), body)
