"""Kernels written into a longer text, line by line, over arrays that all have one axis.

Owns `FlatLines`, `FlatCell` and `Flat`. Arrays of one depth have one length; what is further out is repeated before it
meets what is further in, as numpy takes a third of the time where nothing broadcasts. What is rewritten keeps every
bit: numbers are worked out beforehand, |a b| is |a| b where b is not negative, signs go outside, and nothing is worked
out twice.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Mapping, Sequence
from functools import reduce
from typing import Any

import numpy as np
from msgspec import Struct

from potto.kernels.native.operations import ARITHMETIC, NotStraight, number_of
from potto.kernels.native.straight import ArgumentPart, Packed, packed, statements_of
from potto.kernels.whole import UNIT_ROUNDOFF
from potto.kernels.written import Kernel

SIGNS = {"add": "+", "sub": "-", "mul": "*", "div": "/"}
RELATIONS = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}
# Of a number here: a parameter, which stands in quotes, may be called the same.
NAME = re.compile(r"(?<![\w.'\"])x\d+(?![\w'\"])")
NONNEGATIVE = frozenset(("f_sqrt", "f_exp", "f_cosh"))


class Flat(Struct, frozen=True):
    """A number, or an array of some depth (0: the same at all points): its name, and what is known of it.

    nonnegative: whether it is known to be. value: of a constant. factors: of a product. opposite: what it is minus of,
    as long as nobody has asked for the number itself.
    """

    name: str
    depth: int = 0
    nonnegative: bool = False
    value: Any = None
    factors: tuple[Flat, Flat] | None = None
    opposite: Flat | None = None


class FlatCell(Struct, frozen=True):
    """A cell in parts; None where a part is 0."""

    v: Flat
    e: Flat | None
    t: tuple[Flat | None, ...]
    et: tuple[Flat | None, ...]

    def part(self, part: ArgumentPart) -> Flat | None:
        if part.kind in ("v", "e"):
            return self.v if part.kind == "v" else self.e
        return (self.t if part.kind == "t" else self.et)[part.direction]


class FlatLines:
    """Lines of Python, and what they call by name in `scope`. The lengths by which arrays are repeated are named there
    by who uses the text: `times1_2` from depth 1 to depth 2."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.scope: dict[str, Any] = {"array": np.array}
        self.known: dict[tuple[str, ...], Flat] = {}
        self.zero, self.one = self.constant(0.0), self.constant(1.0)

    # Names

    def constant(self, value: Any) -> Flat:
        """A number that is known when the text is written."""
        key = "constant", type(value).__name__, repr(value)
        if key not in self.known:
            name = f"k{len(self.known)}"
            self.scope[name], self.scope[f"{name}_"] = value, np.array(value)
            self.known[key] = Flat(name, nonnegative=bool(value >= 0), value=value)
        return self.known[key]

    def let(self, expression: str, depth: int, nonnegative: bool = False) -> Flat:
        """A name for an expression, the one that it has where it is met again."""
        key = "let", expression
        if key not in self.known:
            name = f"x{len(self.known)}"
            self.lines.append(f"{name} = {expression}")
            self.known[key] = Flat(name, depth, nonnegative)
        return self.known[key]

    def plain(self, x: Flat) -> Flat:
        """The same with a name of its own."""
        return x if x.opposite is None else self.let(f"-{x.opposite.name}", x.depth)

    def at(self, x: Flat, depth: int) -> str:
        """The name under which a number meets arrays of this depth."""
        x = self.plain(x)
        if not x.depth:
            return f"{x.name}_" if x.value is not None else self.let(f"array({x.name})", 0).name
        return self.repeated(x.name, x.depth, depth)

    def repeated(self, name: str, depth: int, to: int) -> str:
        return name if depth == to else self.let(f"{name}.repeat(times{depth}_{to})", to).name

    def asked_for(self, ending: Sequence[str]) -> list[str]:
        """The lines with these behind them, without what nobody reads; what is not read again is let go."""
        kept: list[str] = []
        asked = set(NAME.findall(" ".join(ending)))
        for line in reversed(self.lines):
            name, _, expression = line.partition(" = ")
            own = NAME.fullmatch(name) is not None
            if own and name not in asked:
                continue
            read = dict.fromkeys(NAME.findall(expression if own else line))
            last = [other for other in read if other not in asked]
            kept.append(f"{line}; del {', '.join(last)}" if last and not line.startswith("if ") else line)
            asked.update(read)
        return [*reversed(kept), *ending]

    # Arithmetic

    def binary(self, code: str, a: Flat, b: Flat) -> Flat:
        depth = max(a.depth, b.depth)
        if a.value is not None and b.value is not None and code != "div":
            return self.constant({"add": a.value + b.value, "sub": a.value - b.value, "mul": a.value * b.value}[code])
        match code:
            case "add" if b.opposite is not None:
                return self.binary("sub", a, b.opposite)
            case "add" if a.opposite is not None:
                return self.binary("sub", b, a.opposite)
            case "sub" if b.opposite is not None:
                return self.binary("add", a, b.opposite)
            case "mul" | "div" if a.opposite is not None:
                return self.negative(self.binary(code, a.opposite, b))
            case "mul" | "div" if b.opposite is not None:
                return self.negative(self.binary(code, a, b.opposite))
            case "mul" if a.value == 1.0 or b.value == 1.0:
                return b if a.value == 1.0 else a
        a, b = self.plain(a), self.plain(b)
        if code in ("add", "mul") and b.name < a.name:
            a, b = b, a
        nonnegative = a.nonnegative and b.nonnegative and code != "sub"
        x, y = (part.name if not depth else self.at(part, depth) for part in (a, b))
        if code == "div" and not depth:
            return self.called("f_divide", (a, b), np.divide)
        found = self.let(f"{x} {SIGNS[code]} {y}", depth, nonnegative or (code == "mul" and a.name == b.name))
        return Flat(found.name, depth, found.nonnegative, factors=(a, b)) if code == "mul" else found

    def negative(self, x: Flat) -> Flat:
        if x.opposite is not None:
            return x.opposite
        return self.constant(-x.value) if x.value is not None else Flat("", x.depth, opposite=x)

    def size(self, x: Flat) -> Flat:
        """Its absolute value."""
        if x.opposite is not None:
            return self.size(x.opposite)
        if x.nonnegative:
            return x
        if x.value is not None:
            return self.constant(abs(x.value))
        if x.factors is not None and any(factor.nonnegative for factor in x.factors):
            return self.binary("mul", *map(self.size, x.factors))
        return self.let(f"abs({x.name})", x.depth, True)

    def total(self, terms: Sequence[Flat]) -> Flat:
        return reduce(lambda a, b: self.binary("add", a, b), terms)

    def called(self, name: str, args: Sequence[Flat], function: Callable[..., Any]) -> Flat:
        """What a function of the kernel says."""
        if all(arg.value is not None for arg in args):
            return self.constant(function(*[arg.value for arg in args]))
        depth = max(arg.depth for arg in args)
        self.scope[name] = function
        names = [self.at(arg, depth) if arg.depth else self.plain(arg).name for arg in args]
        return self.let(f"{name}({', '.join(names)})", depth, name in NONNEGATIVE)

    # What operations round off: of arrays as `whole` says it of batches, by the same steps

    def rounded(self, value: Flat) -> Flat:
        return self.binary("mul", self.constant(UNIT_ROUNDOFF), self.size(value))

    def rounded_sum(self, value: Flat, first: Flat, *rest: Flat) -> Flat:
        """Where a sum is not finite, its error is not a number here: the general way says what it is."""
        off, total = self.rounded(value), first
        for arg in rest[:-1]:
            longer = self.binary("add", total, arg)
            part = self.binary("sub", longer, total)
            there = self.binary("sub", total, self.binary("sub", longer, part))
            lost = self.size(self.binary("add", there, self.binary("sub", arg, part)))
            off, total = self.binary("add", off, lost), longer
        return off

    def rounded_slopes(self, factors: Sequence[Flat]) -> Flat:
        pairs = list(zip(factors[::2], factors[1::2], strict=True))
        sizes = [self.size(b if a.value in (1.0, -1.0) else self.binary("mul", a, b)) for a, b in pairs]
        return self.binary("mul", self.constant(max(len(pairs), 2) * UNIT_ROUNDOFF), self.total(sizes))

    # Kernels

    def inlined(self, kernel: Kernel, args: Sequence[FlatCell]) -> list[FlatCell]:
        """The cells that a plain kernel makes of these. Raises NotStraight."""
        if not kernel.plain:
            raise NotStraight(kernel.text)
        statements, parts, result = statements_of(kernel.text)
        names = {name: args[part.path[0]].part(part) or self.zero for name, part in parts.items()}
        for statement in statements:
            match statement:
                case ast.Assign(targets=[ast.Name(id=name)], value=value):
                    names[name] = self.put(value, names, kernel.run.__globals__)
                case _:
                    raise NotStraight(ast.unparse(statement))
        return [self.cell(cell, names) for cell in packed(result)]

    def cell(self, cell: Packed, names: Mapping[str, Flat]) -> FlatCell:
        def part(name: str | None) -> Flat | None:
            return None if name is None else names.get(name) or self.constant(float(name))

        value = part(cell.v)
        assert value is not None
        et = cell.et or (None,) * len(cell.t)
        return FlatCell(value, part(cell.e), tuple(map(part, cell.t)), tuple(map(part, et)))

    def put(self, node: ast.expr, names: Mapping[str, Flat], functions: Mapping[str, Any]) -> Flat:
        """The value of an expression."""
        number = number_of(node)
        if number in ("True", "False"):
            raise NotStraight(number)
        if number is not None:
            return self.constant(float(number))
        match node:
            case ast.Name(id=name) if name in names:
                return names[name]
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return self.negative(self.put(operand, names, functions))
            case ast.BinOp(left=left, op=op, right=right) if type(op) in ARITHMETIC:
                return self.binary(
                    ARITHMETIC[type(op)], self.put(left, names, functions), self.put(right, names, functions)
                )
            case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in RELATIONS:
                return self.compared(type(op), self.put(left, names, functions), self.put(right, names, functions))
            case ast.Call(func=ast.Name(id=function), args=args):
                return self.call(function, [self.put(arg, names, functions) for arg in args], functions)
        raise NotStraight(ast.unparse(node))

    def compared(self, relation: type[ast.cmpop], a: Flat, b: Flat) -> Flat:
        depth = max(a.depth, b.depth)
        x, y = (self.at(part, depth) if depth else self.plain(part).name for part in (a, b))
        return self.let(f"{x} {RELATIONS[relation]} {y}", depth)

    def call(self, function: str, args: Sequence[Flat], functions: Mapping[str, Any]) -> Flat:
        if function == "abs":
            return self.size(args[0])
        if function.startswith("f_whole_") and args[0].depth:
            if function == "f_whole_slopes":
                return self.rounded_slopes(args[1:])
            return self.rounded_sum(*args) if function == "f_whole_add" else self.rounded(args[0])
        if function == "f_divide" and max(arg.depth for arg in args):
            return self.binary("div", *args)
        if not function.startswith("f_"):
            raise NotStraight(function)
        return self.called(function, args, functions[function])
