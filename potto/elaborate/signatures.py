"""The names by which a function's arguments can be given, group by group.

Owns `signature`, which reads a definition's syntax only: parameters of a `def` or a lambda, of a diffeomorphism,
through other names for functions, partial applications and `deriv` (which puts a `d` in front of every name).
"""

from __future__ import annotations

from potto.core.terms import App, Deriv, Global, Lam, Term
from potto.modules import DefinitionTarget, definition, resolve, resolve_member
from potto.query import Database, query
from potto.syntax import nodes

Signature = tuple[tuple[str, ...], ...]


def _unknown(db: Database, file: str, name: str) -> Signature | None:
    return None


@query(cycle=_unknown)
def signature(db: Database, file: str, name: str) -> Signature | None:
    """The groups of parameter names of a definition; None for one that is no function, or not known to be one."""
    item = definition(db, file, name)
    match item:
        case None:
            return None
        case nodes.DiffeoDefinition():
            return tuple(_names(g) for g in (item.variables, *item.groups) if g)
        case nodes.Definition():
            own = tuple(map(_names, item.groups))
            local = {p for group in own for p in group} | {t.name for b in item.bindings for t in b.targets}
            rest = _of_expression(db, file, item.body, frozenset(local))
            return (*own, *(rest or ())) or None


def _names(group: tuple[nodes.Parameter, ...]) -> tuple[str, ...]:
    return tuple(p.name for p in group)


def dual(groups: Signature) -> Signature:
    return tuple(tuple("d" + name for name in group) for group in groups)


def _of_expression(db: Database, file: str, expr: nodes.Expr, local: frozenset[str]) -> Signature | None:
    match expr:
        case nodes.Paren(inner=inner):
            return _of_expression(db, file, inner, local)
        case nodes.Lambda(groups=groups, body=body):
            own = tuple(map(_names, groups))
            inside = local | {n for g in own for n in g}
            return (*own, *(_of_expression(db, file, body, inside) or ()))
        case nodes.Name(id=name) if name not in local:
            return _of_target(db, resolve(db, file, name))
        case nodes.Member(path=path, name=name) if path.partition(".")[0] not in local:
            return _of_target(db, resolve_member(db, file, path, name))
        case nodes.Apply(function=nodes.Name(id="deriv"), arguments=(argument,)) if "deriv" not in local:
            inner_groups = _of_expression(db, file, argument.value, local)
            return None if inner_groups is None else dual(inner_groups)
        case nodes.Apply(function=function):
            applied = _of_expression(db, file, function, local)
            return applied[1:] or None if applied else None
        case _:
            return None


def _of_target(db: Database, target: object) -> Signature | None:
    return signature(db, target.file, target.name) if isinstance(target, DefinitionTarget) else None


def of_term(db: Database, term: Term) -> Signature | None:
    """The signature of a function as a term; the names of its own binders are those that were written."""
    match term:
        case Lam():
            own = tuple(p.partition("'")[0] for p in term.params)
            return (own, *(of_term(db, term.body) or ()))
        case Global():
            return signature(db, term.module, term.name)
        case Deriv():
            inner = of_term(db, term.function)
            return None if inner is None else dual(inner)
        case App():
            groups = of_term(db, term.function)
            return groups[1:] or None if groups else None
        case _:
            return None
