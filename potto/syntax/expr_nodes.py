"""Trees of expressions, and the parts that they are made of. `nodes` gives them to everybody else.

Chains of `+ -` and of `* /` are flat, so that a sum of thousands of terms is no deeper than one of two.
"""

from __future__ import annotations

from typing import Literal

from msgspec import Struct

from potto.source import Span
from potto.syntax.type_nodes import Parameter


class Number(Struct, frozen=True):
    span: Span
    text: str
    value: float


class Name(Struct, frozen=True):
    span: Span
    id: str


class Member(Struct, frozen=True):
    """`module.name`, written without blanks; `path` is the dotted module (`pkg.m`), `path_span` its place."""

    span: Span
    path: str
    path_span: Span
    name: str
    name_span: Span


class Unary(Struct, frozen=True):
    span: Span
    op: Literal["-", "+", "not"]
    operand: Expr


class Operand(Struct, frozen=True):
    """One further operand of a chain, with the operator in front of it."""

    op: str
    op_span: Span
    value: Expr


class Chain(Struct, frozen=True):
    """`a + b - c` or `a * b / c`: left-associative operators of one precedence (`rest` is never empty)."""

    span: Span
    first: Expr
    rest: tuple[Operand, ...]


class Power(Struct, frozen=True):
    span: Span
    base: Expr
    exponent: Expr


class Compare(Struct, frozen=True):
    """`a <= x < b`: a chained comparison (`rest` is never empty; ops: < <= > >= == !=)."""

    span: Span
    first: Expr
    rest: tuple[Operand, ...]


class Logic(Struct, frozen=True):
    """`p and q and r` or `p or q`, flat."""

    span: Span
    op: Literal["and", "or"]
    operands: tuple[Expr, ...]


class Bracket(Struct, frozen=True):
    """The Iverson bracket `[p]`: 1 where p holds, else 0. p is a Compare, a Logic or a `not`."""

    span: Span
    condition: Expr


class ListLiteral(Struct, frozen=True):
    span: Span
    items: tuple[Expr, ...]


class Tuple(Struct, frozen=True):
    """`(a, b)`, two items or more."""

    span: Span
    items: tuple[Expr, ...]


class Paren(Struct, frozen=True):
    """`(e)`: kept so that the formatter prints what was written."""

    span: Span
    inner: Expr


class If(Struct, frozen=True):
    """`if p then a else b` or `p ? a : b`."""

    span: Span
    condition: Expr
    then: Expr
    orelse: Expr
    style: Literal["if", "?:"]


class Lambda(Struct, frozen=True):
    """`\\(x, y) . \\c . e` is two Lambdas; `\\(x, y) . c . e` is one with two groups. Each group is one call."""

    span: Span
    groups: tuple[tuple[Parameter, ...], ...]
    body: Expr


class Argument(Struct, frozen=True):
    span: Span
    name: str | None
    name_span: Span | None
    value: Expr


class Apply(Struct, frozen=True):
    """One group of arguments given to a function: `f(a, b)`, `f (a, b)`, `f x`. `f x y` is two Applys."""

    span: Span
    function: Expr
    arguments: tuple[Argument, ...]
    parenthesized: bool


class Interval(Struct, frozen=True):
    """`[lo, hi]` as the bounds of one variable of integration."""

    span: Span
    lo: Expr
    hi: Expr


class MeasureBound(Struct, frozen=True):
    """`x ~ normal(m, s)` among the bounds of an integral.

    arguments: those of measures that a measure is made of among them, in the order of the text; `shape` says where they
    stand, as `truncated(normal(_, _), _, _)`, and `inner` which measures there are inside.
    """

    span: Span
    variable: str
    variable_span: Span
    measure: str
    measure_span: Span
    arguments: tuple[Expr, ...]
    shape: str
    inner: tuple[tuple[str, Span], ...]


class Binder(Struct, frozen=True):
    """A variable where it is bound, here after `d`."""

    span: Span
    name: str


class Integral(Struct, frozen=True):
    """`integral (bounds) body d(variables)`: the first variable is the outermost."""

    span: Span
    bounds: tuple[Interval | MeasureBound, ...]
    body: Expr
    variables: tuple[Binder, ...]


class Range(Struct, frozen=True):
    """`lo..hi`, both included: what an index goes through."""

    span: Span
    lo: Expr
    hi: Expr


class Clause(Struct, frozen=True):
    """`i in lo..hi` or `p in points`: what a reduction, a comprehension or a fold goes through."""

    span: Span
    variable: Binder
    over: Range | Expr


class Reduction(Struct, frozen=True):
    """`sum i in lo..hi (body)`, and `product`, `min`, `max`; of several clauses a later one may use those before."""

    span: Span
    op: Literal["sum", "product", "min", "max"]
    clauses: tuple[Clause, ...]
    body: Expr


class Fold(Struct, frozen=True):
    """`fold s = start for i in lo..hi (body)`: the state after every step; `(a, b) = …` for a tuple's parts."""

    span: Span
    targets: tuple[Binder, ...]
    start: Expr
    clauses: tuple[Clause, ...]
    body: Expr


class Comprehension(Struct, frozen=True):
    """`[body for i in 0..n-1, j in 0..m-1]`: an array with a dimension for each clause."""

    span: Span
    body: Expr
    clauses: tuple[Clause, ...]


class Index(Struct, frozen=True):
    """`xs[i]`, `xs[i, j]`: the element at these places, counted from 0."""

    span: Span
    array: Expr
    indices: tuple[Expr, ...]


class Field(Struct, frozen=True):
    """`c.focal` of a record, `u.x` or `u.1` of a tuple; written without a blank before the dot."""

    span: Span
    value: Expr
    name: str
    name_span: Span


class With(Struct, frozen=True):
    """`c with focal = 2`, `c with (focal = 2, eye = e)`: the record with other values of some fields."""

    span: Span
    record: Expr
    arguments: tuple[Argument, ...]


class Text(Struct, frozen=True):
    """The name of a file between quotes, as `load` takes it."""

    span: Span
    text: str


class Binding(Struct, frozen=True):
    """`name = e` or `(a, b) = e`; in a definition's block or in a `let`."""

    span: Span
    targets: tuple[Binder, ...]
    value: Expr


class Let(Struct, frozen=True):
    """`let a = e; (b, c) = f in body`."""

    span: Span
    bindings: tuple[Binding, ...]
    body: Expr


class InlineDiffeo(Struct, frozen=True):
    """`diffeo(e, f)`: the condition holds where the first component is >= 0."""

    span: Span
    components: tuple[Expr, ...]


class ErrorExpr(Struct, frozen=True):
    """A place where the text could not be read as an expression. A diagnostic has said why."""

    span: Span
    text: str


Expr = (
    Number
    | Name
    | Member
    | Unary
    | Chain
    | Power
    | Compare
    | Logic
    | Bracket
    | ListLiteral
    | Tuple
    | Paren
    | If
    | Lambda
    | Apply
    | Integral
    | Reduction
    | Fold
    | Comprehension
    | Index
    | Field
    | With
    | Text
    | Let
    | InlineDiffeo
    | ErrorExpr
)
