"""Trees of written types, and the parameters that carry them. `nodes` gives them to everybody else."""

from __future__ import annotations

from typing import Literal

from potto.quick import quick, value
from potto.source import Span


@value
class Parameter:
    span: Span
    name: str
    annotation: TypeExpr | None = None


@value
class RealType:
    """`Real`, `Real*` (accepts what varies) or `Real[x, y]`, `Dist[x]`."""

    span: Span
    head: Literal["Real", "Dist"]
    star: bool
    variables: tuple[str, ...]


@value
class TupleType:
    span: Span
    items: tuple[TypeExpr, ...]


@value
class ListType:
    span: Span
    item: TypeExpr


@value
class FunctionType:
    """`(A, name: B) -> C`; parameters in one group."""

    span: Span
    parameters: tuple[Parameter, ...]
    result: TypeExpr


@value
class DiffeoType:
    """`Diffeo[2]`."""

    span: Span
    dims: int


TypeExpr = RealType | TupleType | ListType | FunctionType | DiffeoType


quick(Parameter, RealType, TupleType, ListType, FunctionType, DiffeoType)
