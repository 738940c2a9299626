"""Definitions to terms, as queries.

Owns `core`, `diffeo_core` and `elaborate_expression`. A definition's term is closed but for references to other
definitions (`Global`), so that it depends on their names and signatures only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from potto.core import terms
from potto.core.terms import Term
from potto.diagnostics import Diagnostic
from potto.elaborate.expressions import Elaborator, abstracted
from potto.modules import definition
from potto.query import Database, query
from potto.source import Span
from potto.syntax import nodes


@dataclass(frozen=True, slots=True)
class Elaborated:
    """A term, and where its branches, deltas, calls, plain conditionals and integrals were written.

    Spans are relative to the definition's chunk. `diagnostics` is for what only elaboration can find.
    """

    term: Term
    origins: tuple[tuple[Term, Span], ...]
    diagnostics: tuple[Diagnostic, ...] = ()


@dataclass(frozen=True, slots=True)
class DiffeoCore:
    """A diffeomorphism's parts over the names of its parameters.

    inverse: (parameters, components) of the author's inverse. where: conditions as truth values.
    """

    variables: tuple[str, ...]
    groups: tuple[tuple[str, ...], ...]
    components: tuple[Term, ...]
    inverse: tuple[tuple[str, ...], tuple[Term, ...]] | None
    where: tuple[Term, ...]


@query
def core(db: Database, file: str, name: str) -> Elaborated:
    """The core term of a definition."""
    item = definition(db, file, name)
    if item is None:
        return Elaborated(terms.hole(f"`{name}` is not defined"), ())
    elaborator = Elaborator(db, file)
    if isinstance(item, nodes.DiffeoDefinition):
        parts = _diffeo(elaborator, item)
        term = abstracted([parts.variables, *parts.groups], terms.tuple_(parts.components))
    else:
        term = _definition(elaborator, item)
    return Elaborated(term, tuple(elaborator.origins.items()))


@query
def diffeo_core(db: Database, file: str, name: str) -> DiffeoCore | None:
    """The parts of a diffeomorphism's definition; None for any other definition."""
    item = definition(db, file, name)
    return _diffeo(Elaborator(db, file), item) if isinstance(item, nodes.DiffeoDefinition) else None


def elaborate_expression(
    db: Database, file: str, expr: nodes.Expr, locals: Sequence[str] = ()
) -> Elaborated:
    """The term of an expression with a file's names in scope; `locals` stay free variables of it."""
    elaborator = Elaborator(db, file, locals)
    term = elaborator.expr(expr, {name: terms.var(name) for name in locals})
    return Elaborated(term, tuple(elaborator.origins.items()))


def _definition(elaborator: Elaborator, item: nodes.Definition) -> Term:
    env: dict[str, Term] = {}
    groups = []
    for group in item.groups:
        names = tuple(elaborator.bind(p.name) for p in group)
        env.update((p.name, terms.var(n)) for p, n in zip(group, names, strict=True))
        groups.append(names)
    return abstracted(groups, elaborator.expr(item.body, elaborator.bindings(item.bindings, env)))


def _diffeo(elaborator: Elaborator, item: nodes.DiffeoDefinition) -> DiffeoCore:
    env: dict[str, Term] = {}
    groups = []
    for group in (item.variables, *item.groups):
        names = tuple(elaborator.bind(p.name) for p in group)
        env.update((p.name, terms.var(n)) for p, n in zip(group, names, strict=True))
        groups.append(names)
    inner = elaborator.bindings(item.bindings, env)
    components = tuple(elaborator.expr(c, inner) for c in item.components)
    inverse = None
    if item.inverse is not None:
        names = tuple(elaborator.bind(p.name) for p in item.inverse.parameters)
        over = {**inner, **{p.name: terms.var(n) for p, n in zip(item.inverse.parameters, names, strict=True)}}
        inverse = (names, tuple(elaborator.expr(c, over) for c in item.inverse.components))
    where = tuple(elaborator.truth(w, inner) for w in item.where)
    return DiffeoCore(groups[0], tuple(g for g in groups[1:] if g), components, inverse, where)
