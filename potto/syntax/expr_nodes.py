"""Trees of expressions, and the parts that they are made of. `nodes` gives them to everybody else.

Chains of `+ -` and of `* /` are flat, so that a sum of thousands of terms is no deeper than one of two.
"""

from __future__ import annotations

from typing import Literal

from potto.quick import quick, value
from potto.source import Span
from potto.syntax.type_nodes import Parameter


@value
class Number:
    span: Span
    text: str
    value: float


@value
class Name:
    span: Span
    id: str


@value
class Member:
    """`module.name`, written without blanks; `path` is the dotted module (`pkg.m`), `path_span` its place."""

    span: Span
    path: str
    path_span: Span
    name: str
    name_span: Span


@value
class Unary:
    span: Span
    op: Literal["-", "+", "not"]
    operand: Expr


@value
class Operand:
    """One further operand of a chain, with the operator in front of it."""

    op: str
    op_span: Span
    value: Expr


@value
class Chain:
    """`a + b - c` or `a * b / c`: left-associative operators of one precedence (`rest` is never empty)."""

    span: Span
    first: Expr
    rest: tuple[Operand, ...]


@value
class Power:
    span: Span
    base: Expr
    exponent: Expr


@value
class Compare:
    """`a <= x < b`: a chained comparison (`rest` is never empty; ops: < <= > >= == !=)."""

    span: Span
    first: Expr
    rest: tuple[Operand, ...]


@value
class Logic:
    """`p and q and r` or `p or q`, flat."""

    span: Span
    op: Literal["and", "or"]
    operands: tuple[Expr, ...]


@value
class Bracket:
    """The Iverson bracket `[p]`: 1 where p holds, else 0. p is a Compare, a Logic or a `not`."""

    span: Span
    condition: Expr


@value
class ListLiteral:
    span: Span
    items: tuple[Expr, ...]


@value
class Tuple:
    """`(a, b)`, two items or more."""

    span: Span
    items: tuple[Expr, ...]


@value
class Paren:
    """`(e)`: kept so that the formatter prints what was written."""

    span: Span
    inner: Expr


@value
class If:
    """`if p then a else b` or `p ? a : b`."""

    span: Span
    condition: Expr
    then: Expr
    orelse: Expr
    style: Literal["if", "?:"]


@value
class Lambda:
    """`\\(x, y) . \\c . e` is two Lambdas; `\\(x, y) . c . e` is one with two groups. Each group is one call."""

    span: Span
    groups: tuple[tuple[Parameter, ...], ...]
    body: Expr


@value
class Argument:
    span: Span
    name: str | None
    name_span: Span | None
    value: Expr


@value
class Apply:
    """One group of arguments given to a function: `f(a, b)`, `f (a, b)`, `f x`. `f x y` is two Applys."""

    span: Span
    function: Expr
    arguments: tuple[Argument, ...]
    parenthesized: bool


@value
class Interval:
    """`[lo, hi]` as the bounds of one variable of integration."""

    span: Span
    lo: Expr
    hi: Expr


@value
class MeasureBound:
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


@value
class Binder:
    """A variable where it is bound, here after `d`."""

    span: Span
    name: str


@value
class Integral:
    """`integral (bounds) body d(variables)`: the first variable is the outermost."""

    span: Span
    bounds: tuple[Interval | MeasureBound, ...]
    body: Expr
    variables: tuple[Binder, ...]


@value
class Range:
    """`lo..hi`, both included: what an index goes through."""

    span: Span
    lo: Expr
    hi: Expr


@value
class Clause:
    """`i in lo..hi` or `p in points`: what a reduction, a comprehension or a fold goes through."""

    span: Span
    variable: Binder
    over: Range | Expr


@value
class Reduction:
    """`sum i in lo..hi (body)`, and `product`, `min`, `max`; of several clauses a later one may use those before."""

    span: Span
    op: Literal["sum", "product", "min", "max"]
    clauses: tuple[Clause, ...]
    body: Expr


@value
class Fold:
    """`fold s = start for i in lo..hi (body)`: the state after every step; `(a, b) = …` for a tuple's parts."""

    span: Span
    targets: tuple[Binder, ...]
    start: Expr
    clauses: tuple[Clause, ...]
    body: Expr


@value
class Comprehension:
    """`[body for i in 0..n-1, j in 0..m-1]`: an array with a dimension for each clause."""

    span: Span
    body: Expr
    clauses: tuple[Clause, ...]


@value
class Index:
    """`xs[i]`, `xs[i, j]`: the element at these places, counted from 0."""

    span: Span
    array: Expr
    indices: tuple[Expr, ...]


@value
class Field:
    """`c.focal` of a record, `u.x` or `u.1` of a tuple; written without a blank before the dot."""

    span: Span
    value: Expr
    name: str
    name_span: Span


@value
class With:
    """`c with focal = 2`, `c with (focal = 2, eye = e)`: the record with other values of some fields."""

    span: Span
    record: Expr
    arguments: tuple[Argument, ...]


@value
class Text:
    """The name of a file between quotes, as `load` takes it."""

    span: Span
    text: str


@value
class Binding:
    """`name = e` or `(a, b) = e`; in a definition's block or in a `let`."""

    span: Span
    targets: tuple[Binder, ...]
    value: Expr


@value
class Let:
    """`let a = e; (b, c) = f in body`."""

    span: Span
    bindings: tuple[Binding, ...]
    body: Expr


@value
class InlineDiffeo:
    """`diffeo(e, f)`: the condition holds where the first component is >= 0."""

    span: Span
    components: tuple[Expr, ...]


@value
class ErrorExpr:
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

quick(*(kind for kind in globals().values() if isinstance(kind, type) and kind.__module__ == __name__))
