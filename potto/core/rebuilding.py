"""Terms made anew from their fields, as they were pickled, packed or sent.

Owns `rebuilt`. To pickle terms, this must have been imported: `terms` does.
"""

from __future__ import annotations

import copyreg
from typing import Any

from potto.core import kinds
from potto.core.consing import Base, own_fields


def rebuilt(cls: type, fields: tuple[Any, ...]) -> Any:
    """The term of this kind with these fields."""
    return _MADE_BY[cls](*fields)


def _prim_from(op: str, args: tuple[kinds.Term, ...]) -> kinds.Prim:
    return kinds.prim(op, *args)


_MADE_BY: dict[type, Any] = {
    kinds.Const: kinds.const,
    kinds.Var: kinds.var,
    kinds.Prim: _prim_from,
    kinds.If: kinds.if_,
    kinds.Branch: kinds.branch,
    kinds.Tuple: kinds.tuple_,
    kinds.Proj: kinds.proj,
    kinds.ListOf: kinds.list_of,
    kinds.Array: kinds.array,
    kinds.Index: kinds.index,
    kinds.Length: kinds.length,
    kinds.Data: kinds.data,
    kinds.Lam: kinds.lam,
    kinds.App: kinds.app,
    kinds.Global: kinds.global_,
    kinds.Integral: kinds.integral,
    kinds.Delta: kinds.delta,
    kinds.Sum: kinds.sum_,
    kinds.Fold: kinds.fold,
    kinds.Deriv: kinds.deriv,
    kinds.Hole: kinds.hole,
}


def _reduced(term: Base) -> tuple[Any, ...]:
    """How to make a term again, as `copyreg` wants it."""
    return rebuilt, (type(term), tuple(getattr(term, name) for name in own_fields(type(term))))


for kind in _MADE_BY:
    copyreg.pickle(kind, _reduced)
