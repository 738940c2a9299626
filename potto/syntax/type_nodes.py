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
class Size:
    """How many elements: a number (`name` None), a name, a name and a number (`n - 1`), `_` for any, "" not written."""

    span: Span
    name: str | None
    offset: int


@value
class ArrayType:
    """`[3] Real`, `[n, m] Real`; `[T]`, with no size written, is of any."""

    span: Span
    sizes: tuple[Size, ...]
    item: TypeExpr


@value
class NamedType:
    """A record by its name, or by that of its module and its own (`scene.Camera`)."""

    span: Span
    name: str


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


TypeExpr = RealType | TupleType | ArrayType | NamedType | FunctionType | DiffeoType


quick(Parameter, RealType, TupleType, Size, ArrayType, NamedType, FunctionType, DiffeoType)
