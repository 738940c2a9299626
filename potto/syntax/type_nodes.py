"""Trees of written types, and the parameters that carry them. `nodes` gives them to everybody else."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from potto.quick import quick
from potto.source import Span


@dataclass(frozen=True, slots=True)
class Parameter:
    span: Span
    name: str
    annotation: TypeExpr | None = None


@dataclass(frozen=True, slots=True)
class RealType:
    """`Real`, `Real*` (accepts what varies) or `Real[x, y]`, `Dist[x]`."""

    span: Span
    head: Literal["Real", "Dist"]
    star: bool
    variables: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class TupleType:
    span: Span
    items: tuple[TypeExpr, ...]


@dataclass(frozen=True, slots=True)
class ListType:
    span: Span
    item: TypeExpr


@dataclass(frozen=True, slots=True)
class FunctionType:
    """`(A, name: B) -> C`; parameters in one group."""

    span: Span
    parameters: tuple[Parameter, ...]
    result: TypeExpr


@dataclass(frozen=True, slots=True)
class DiffeoType:
    """`Diffeo[2]`."""

    span: Span
    dims: int


TypeExpr = RealType | TupleType | ListType | FunctionType | DiffeoType


quick(Parameter, RealType, TupleType, ListType, FunctionType, DiffeoType)
