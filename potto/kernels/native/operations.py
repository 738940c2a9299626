"""Statements of kernels as operations on numbers and masks.

Owns `Operation`, `flattened`, `number_of` and `NotStraight`.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Sequence
from functools import reduce

from msgspec import Struct

from potto.kernels.whole import UNIT_ROUNDOFF

ARITHMETIC: dict[type, str] = {ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul"}
RELATIONS: dict[type, str] = {ast.Lt: "lt", ast.LtE: "le", ast.Gt: "gt", ast.GtE: "ge", ast.Eq: "eq", ast.NotEq: "ne"}
# Functions of numbers by what kernels call them; those of the C library are among them.
FUNCTIONS = {
    "divide": "div", "sqrt": "sqrt", "minimum": "min", "maximum": "max", "floor": "floor", "ceil": "ceil",
    "logical_and": "and", "logical_or": "or", "logical_not": "not", "support_select": "select", "abs": "abs",
    "exp": "exp", "log": "log", "log1p": "log1p", "expm1": "expm1", "sinh": "sinh", "cosh": "cosh", "tanh": "tanh",
    "arcsinh": "asinh", "arccosh": "acosh", "arctanh": "atanh", "sin": "sin", "cos": "cos", "tan": "tan",
    "arcsin": "asin", "arccos": "acos", "arctan": "atan", "arctan2": "atan2", "hypot": "hypot", "power": "pow",
    "special_erf": "erf",
}  # fmt: skip
COMPARED = (*RELATIONS.values(), "and", "or", "not", "nan")
CONSTANTS = ("inf", "nan", "True", "False")
ZERO, HALF_ULP = repr(0.0), repr(UNIT_ROUNDOFF)


class NotStraight(Exception):
    """A kernel does something that has no form as operations on numbers."""


class Operation(Struct, frozen=True):
    """`name` = `code` of arguments, which are names or numbers as text."""

    name: str
    code: str
    args: tuple[str, ...]

    @property
    def is_mask(self) -> bool:
        return self.code in COMPARED

    @property
    def masks(self) -> tuple[str, ...]:
        """Of its arguments, those that are masks."""
        return self.args if self.code in ("and", "or", "not") else self.args[:1] if self.code == "select" else ()


def number_of(node: ast.expr) -> str | None:
    """The text of a number, if a node is one."""
    match node:
        case ast.Constant(value=bool() as value):
            return str(value)
        case ast.Constant(value=float() | int() as value):
            return repr(float(value))
        case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=float() | int() as value)):
            return repr(-float(value))
        case ast.Call(func=ast.Name(id="float"), args=[ast.Constant(value=value)]):
            return repr(float(str(value)))
    return None


def flattened(statements: Iterable[ast.stmt]) -> list[Operation]:
    """All that statements work out. Raises NotStraight."""
    flat = _Operations()
    for node in statements:
        flat.statement(node)
    return flat.made


class _Operations:
    """Statements as operations, each with a name of its own."""

    def __init__(self) -> None:
        self.made: list[Operation] = []

    def statement(self, node: ast.stmt) -> None:
        match node:
            case ast.Assign(value=ast.Constant(value=None) | ast.IfExp(test=ast.Name(id="trace"))):
                pass  # a mask that may be forced: this one is not
            case ast.Assign(targets=[ast.Name(id=name)], value=value):
                self.put(value, name)
            case ast.If(body=[ast.Assign(targets=[ast.Tuple(elts=[ast.Name(id=mask), ast.Name(id=spoiled)])],
                                         value=ast.Call(args=[surface, ast.Constant(value=strict)]))]):  # fmt: skip
                place = self.put(surface)
                self.made.append(Operation(mask, "gt" if strict else "ge", (place, ZERO)))
                bad = self.new("nan", (place,))
                self.made.append(Operation(spoiled, "select", (bad, "nan", ZERO)))
            case _:
                raise NotStraight(ast.unparse(node))

    def new(self, code: str, args: tuple[str, ...], name: str = "") -> str:
        name = name or f"n{len(self.made)}"
        self.made.append(Operation(name, code, args))
        return name

    def put(self, node: ast.expr, name: str = "") -> str:
        """The operations of an expression; the name of its value."""
        number = number_of(node)
        if number is not None:
            return self.new("is", (number,), name) if name else number
        match node:
            case ast.Name(id=own):
                return self.new("is", (own,), name) if name else own
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return self.new("neg", (self.put(operand),), name)
            case ast.BinOp(left=left, op=op, right=right) if type(op) in ARITHMETIC:
                return self.new(ARITHMETIC[type(op)], (self.put(left), self.put(right)), name)
            case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in RELATIONS:
                return self.new(RELATIONS[type(op)], (self.put(left), self.put(right)), name)
            case ast.IfExp(test=ast.Compare(left=ast.Name(id=spoiled)), body=body):  # v if nothing is spoiled
                value = self.put(body)
                return self.new("add", (value, spoiled), name)
            case ast.Call(func=ast.Name(id=function), args=args):
                return self.call(function.removeprefix("f_"), tuple(map(self.put, args)), name)
        raise NotStraight(ast.unparse(node))

    def call(self, function: str, args: tuple[str, ...], name: str) -> str:
        if function.startswith("whole_"):
            if function == "whole_add":
                return self.rounded_sum(*args, name=name)
            if function == "whole_slopes":
                return self.rounded_slopes(args[1::2], args[2::2], name)
            return self.share(HALF_ULP, args[0], name)
        if function == "potto_clamp":
            return self.new("min", (self.new("max", args[:2]), args[2]), name)
        if function == "support_by_error":
            return self.new("select", (self.new("ne", (args[1], ZERO)), args[0], ZERO), name)
        if function == "sign":
            negative = self.new("select", (self.new("lt", (args[0], ZERO)), "-1.0", args[0]))
            return self.new("select", (self.new("gt", (args[0], ZERO)), "1.0", negative), name)
        if function not in FUNCTIONS:
            raise NotStraight(function)
        return self.new(FUNCTIONS[function], args, name)

    def share(self, part: str, value: str, name: str = "") -> str:
        return self.new("mul", (part, self.new("abs", (value,))), name)

    def rounded_slopes(self, slopes: Sequence[str], tangents: Sequence[str], name: str) -> str:
        """What `whole.slopes` says of a batch: a share of the sizes of all summands, as they may cancel."""
        sizes = [
            self.new("abs", (tangent if slope in ("1.0", "-1.0") else self.new("mul", (slope, tangent)),))
            for slope, tangent in zip(slopes, tangents, strict=True)
        ]
        total = reduce(lambda total, size: self.new("add", (total, size)), sizes)
        return self.new("mul", (repr(max(len(sizes), 2) * UNIT_ROUNDOFF), total), name)

    def rounded_sum(self, value: str, first: str, *rest: str, name: str) -> str:
        """What `whole.add` says of a batch."""
        if len(rest) == 1:
            return self.share(HALF_ULP, value, name)
        off, total = self.share(HALF_ULP, value), first
        least = off
        for arg in rest[:-1]:
            longer = self.new("add", (total, arg))
            part = self.new("sub", (longer, total))
            here = self.new("sub", (arg, part))
            there = self.new("sub", (total, self.new("sub", (longer, part))))
            off = self.new("add", (off, self.new("abs", (self.new("add", (there, here)),))))
            total = longer
        return self.new("select", (self.new("lt", (off, "inf")), off, least), name)
