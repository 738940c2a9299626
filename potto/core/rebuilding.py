"""Terms made anew from their fields, as they were pickled, packed or sent.

Owns `rebuilt`.
"""

from __future__ import annotations

from typing import Any

from potto.core import kinds


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
