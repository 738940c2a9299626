"""Terms made anew from their fields, as they were pickled, packed or sent.

Owns `rebuilt`.
"""

from __future__ import annotations

from typing import Any

from potto.core.kinds import (
    App,
    Array,
    Branch,
    Const,
    Data,
    Delta,
    Deriv,
    Fold,
    Global,
    Hole,
    If,
    Index,
    Integral,
    Lam,
    Length,
    ListOf,
    Prim,
    Proj,
    Sum,
    Term,
    Tuple,
    Var,
    app,
    array,
    branch,
    const,
    data,
    delta,
    deriv,
    fold,
    global_,
    hole,
    if_,
    index,
    integral,
    lam,
    length,
    list_of,
    prim,
    proj,
    sum_,
    tuple_,
    var,
)


def rebuilt(cls: type, fields: tuple[Any, ...]) -> Any:
    """The term of this kind with these fields."""
    return _MADE_BY[cls](*fields)


def _prim_from(op: str, args: tuple[Term, ...]) -> Prim:
    return prim(op, *args)


_MADE_BY: dict[type, Any] = {
    Const: const,
    Var: var,
    Prim: _prim_from,
    If: if_,
    Branch: branch,
    Tuple: tuple_,
    Proj: proj,
    ListOf: list_of,
    Array: array,
    Index: index,
    Length: length,
    Data: data,
    Lam: lam,
    App: app,
    Global: global_,
    Integral: integral,
    Delta: delta,
    Sum: sum_,
    Fold: fold,
    Deriv: deriv,
    Hole: hole,
}
