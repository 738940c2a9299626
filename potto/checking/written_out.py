"""A function of a program as one term over its parameters. Owns `written_out` and `carried_out`."""

from __future__ import annotations

from potto.calculus.inlining.expand import expanded
from potto.calculus.surfaces.branch_cuts import opened
from potto.core.terms import Deriv, Global, Lam, Term
from potto.elaborate import core, elaborate_expression
from potto.query import Database
from potto.syntax import nodes


def written_out(db: Database, file: str, expr: nodes.Expr) -> tuple[list[str], Term]:
    """The parameters of a function, of a derivative those of what it is one of, and its body with calls carried out."""
    return carried_out(db, elaborate_expression(db, file, expr).term)


def carried_out(db: Database, term: Term) -> tuple[list[str], Term]:
    """The same of a term."""
    while isinstance(term, Deriv | Global):
        term = term.function if isinstance(term, Deriv) else core(db, term.module, term.name).term
    whole = opened(expanded(term, lambda g: core(db, g.module, g.name).term))
    params: list[str] = []
    while isinstance(whole, Lam):
        params += whole.params
        whole = whole.body
    return params, whole
