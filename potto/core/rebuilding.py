"""Terms made anew from their fields, as they were pickled, packed or sent.

Owns `rebuilt`. To pickle terms, this must have been imported: `terms` does.
"""

from __future__ import annotations

import copyreg
from typing import Any

from potto.core import term_kinds
from potto.core.consing import Base, own_fields


def rebuilt(cls: type, fields: tuple[Any, ...]) -> Any:
    """The term of this kind with these fields."""
    return _MADE_BY[cls](*fields)


def _prim_from(op: str, args: tuple[term_kinds.Term, ...]) -> term_kinds.Prim:
    return term_kinds.prim(op, *args)


_MADE_BY: dict[type, Any] = {
    term_kinds.Const: term_kinds.const,
    term_kinds.Var: term_kinds.var,
    term_kinds.Prim: _prim_from,
    term_kinds.If: term_kinds.if_,
    term_kinds.Branch: term_kinds.branch,
    term_kinds.Tuple: term_kinds.tuple_,
    term_kinds.Proj: term_kinds.proj,
    term_kinds.ListOf: term_kinds.list_of,
    term_kinds.Array: term_kinds.array,
    term_kinds.Index: term_kinds.index,
    term_kinds.Length: term_kinds.length,
    term_kinds.Data: term_kinds.data,
    term_kinds.Lam: term_kinds.lam,
    term_kinds.App: term_kinds.app,
    term_kinds.Global: term_kinds.global_,
    term_kinds.Integral: term_kinds.integral,
    term_kinds.Delta: term_kinds.delta,
    term_kinds.Sum: term_kinds.sum_,
    term_kinds.Fold: term_kinds.fold,
    term_kinds.Deriv: term_kinds.deriv,
    term_kinds.Hole: term_kinds.hole,
}


def _reduced(term: Base) -> tuple[Any, ...]:
    """How to make a term again, as `copyreg` wants it."""
    return rebuilt, (type(term), tuple(getattr(term, name) for name in own_fields(type(term))))


for kind in _MADE_BY:
    copyreg.pickle(kind, _reduced)
