"""The syntax tree: immutable nodes that say what was written and where.

Spans are relative to the start of the chunk. Nothing here knows types or meaning. Owns the items of
a file; expressions are in `expr_nodes`, written types in `type_nodes`.
"""

from __future__ import annotations

from msgspec import Struct

from potto.source import Span
from potto.syntax.expr_nodes import Apply as Apply
from potto.syntax.expr_nodes import Argument as Argument
from potto.syntax.expr_nodes import Binder as Binder
from potto.syntax.expr_nodes import Binding as Binding
from potto.syntax.expr_nodes import Bracket as Bracket
from potto.syntax.expr_nodes import Chain as Chain
from potto.syntax.expr_nodes import Clause as Clause
from potto.syntax.expr_nodes import Compare as Compare
from potto.syntax.expr_nodes import Comprehension as Comprehension
from potto.syntax.expr_nodes import ErrorExpr as ErrorExpr
from potto.syntax.expr_nodes import Expr as Expr
from potto.syntax.expr_nodes import Field as Field
from potto.syntax.expr_nodes import Fold as Fold
from potto.syntax.expr_nodes import If as If
from potto.syntax.expr_nodes import Index as Index
from potto.syntax.expr_nodes import InlineDiffeo as InlineDiffeo
from potto.syntax.expr_nodes import Integral as Integral
from potto.syntax.expr_nodes import Interval as Interval
from potto.syntax.expr_nodes import Lambda as Lambda
from potto.syntax.expr_nodes import Let as Let
from potto.syntax.expr_nodes import ListLiteral as ListLiteral
from potto.syntax.expr_nodes import Logic as Logic
from potto.syntax.expr_nodes import MeasureBound as MeasureBound
from potto.syntax.expr_nodes import Member as Member
from potto.syntax.expr_nodes import Name as Name
from potto.syntax.expr_nodes import Number as Number
from potto.syntax.expr_nodes import Operand as Operand
from potto.syntax.expr_nodes import Paren as Paren
from potto.syntax.expr_nodes import Power as Power
from potto.syntax.expr_nodes import Range as Range
from potto.syntax.expr_nodes import Reduction as Reduction
from potto.syntax.expr_nodes import Text as Text
from potto.syntax.expr_nodes import Tuple as Tuple
from potto.syntax.expr_nodes import Unary as Unary
from potto.syntax.expr_nodes import With as With
from potto.syntax.type_nodes import ArrayType as ArrayType
from potto.syntax.type_nodes import DiffeoType as DiffeoType
from potto.syntax.type_nodes import FunctionType as FunctionType
from potto.syntax.type_nodes import NamedType as NamedType
from potto.syntax.type_nodes import Parameter as Parameter
from potto.syntax.type_nodes import RealType as RealType
from potto.syntax.type_nodes import Size as Size
from potto.syntax.type_nodes import TupleType as TupleType
from potto.syntax.type_nodes import TypeExpr as TypeExpr

# Top-level items: one per chunk


class ImportedName(Struct, frozen=True):
    span: Span
    name: str
    name_span: Span
    alias: str | None
    alias_span: Span | None


class FromImport(Struct, frozen=True):
    """`from pkg.m import a, b as c`."""

    span: Span
    module: str
    module_span: Span
    names: tuple[ImportedName, ...]


class Import(Struct, frozen=True):
    """`import pkg.m` or `import pkg.m as k`."""

    span: Span
    module: str
    module_span: Span
    alias: str | None
    alias_span: Span | None


class Definition(Struct, frozen=True):
    """`def f(a, b)(c) body` (groups not empty) or `name = e` (groups empty).

    `bindings` are the lines before a def's last line; `result` is an annotation `-> T`.
    """

    span: Span
    name: str
    name_span: Span
    groups: tuple[tuple[Parameter, ...], ...]
    result: TypeExpr | None
    bindings: tuple[Binding, ...]
    body: Expr
    keyword: bool


class RecordDefinition(Struct, frozen=True):
    """`record Camera(eye: (Real, Real, Real), focal: Real)`: every field has a type."""

    span: Span
    name: str
    name_span: Span
    fields: tuple[Parameter, ...]


class DeclaredInverse(Struct, frozen=True):
    """`inverse (u, v) . (x, y)`: the author's inverse of a diffeomorphism."""

    span: Span
    parameters: tuple[Parameter, ...]
    components: tuple[Expr, ...]


class DiffeoDefinition(Struct, frozen=True):
    """`diffeo name(x, y; c) = (u, v)` in a .po, or `name = \\(x, y) . \\c . (u, v)` in a .diffeo file.

    `variables` are the variables of integration, `groups` the further groups of parameters as they are called
    (for the `;` form: one group per call is `(x, y)` then `(c, …)`), `components` the result, `where` conditions
    that select a branch (a box or a sign).
    """

    span: Span
    name: str
    name_span: Span
    variables: tuple[Parameter, ...]
    groups: tuple[tuple[Parameter, ...], ...]
    bindings: tuple[Binding, ...]
    components: tuple[Expr, ...]
    inverse: DeclaredInverse | None
    where: tuple[Expr, ...]
    keyword: bool


class Print(Struct, frozen=True):
    span: Span
    arguments: tuple[Expr, ...]


class For(Struct, frozen=True):
    """`for v in list: statements`."""

    span: Span
    variable: Binder
    iterable: Expr
    body: tuple[Statement, ...]


class ExpressionStatement(Struct, frozen=True):
    span: Span
    value: Expr


class BrokenItem(Struct, frozen=True):
    """A chunk whose head could not be read. `name` is the best guess at what it was to define."""

    span: Span
    name: str | None


Statement = Print | For | ExpressionStatement | Binding
Item = (
    FromImport
    | Import
    | Definition
    | DiffeoDefinition
    | RecordDefinition
    | Print
    | For
    | ExpressionStatement
    | BrokenItem
)
Part = (
    Binding
    | Binder
    | Argument
    | Parameter
    | Size
    | Operand
    | Range
    | Clause
    | Interval
    | MeasureBound
    | DeclaredInverse
    | ImportedName
)
Node = Expr | TypeExpr | Item | Part
