"""Trees of written types, and the parameters that carry them. `nodes` gives them to everybody else."""

from __future__ import annotations

from typing import Literal

from msgspec import Struct

from potto.source import Span


class Parameter(Struct, frozen=True):
    span: Span
    name: str
    annotation: TypeExpr | None = None


class RealType(Struct, frozen=True):
    """`Real`, `Real*` (accepts what varies) or `Real[x, y]`, `Dist[x]`."""

    span: Span
    head: Literal["Real", "Dist"]
    star: bool
    variables: tuple[str, ...]


class TupleType(Struct, frozen=True):
    span: Span
    items: tuple[TypeExpr, ...]


class Size(Struct, frozen=True):
    """How many elements: a number (`name` None), a name, a name and a number (`n - 1`), `_` for any, "" not written."""

    span: Span
    name: str | None
    offset: int


class ArrayType(Struct, frozen=True):
    """`[3] Real`, `[n, m] Real`; `[T]`, with no size written, is of any."""

    span: Span
    sizes: tuple[Size, ...]
    item: TypeExpr


class NamedType(Struct, frozen=True):
    """A record by its name, or by that of its module and its own (`scene.Camera`)."""

    span: Span
    name: str


class FunctionType(Struct, frozen=True):
    """`(A, name: B) -> C`; parameters in one group."""

    span: Span
    parameters: tuple[Parameter, ...]
    result: TypeExpr


class DiffeoType(Struct, frozen=True):
    """`Diffeo[2]`."""

    span: Span
    dims: int


TypeExpr = RealType | TupleType | ArrayType | NamedType | FunctionType | DiffeoType
