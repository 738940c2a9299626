"""Kernels' texts as straight lines of operations, and which of these don't depend on the point.

Owns `statements_of`, `FlatKernel`, all operations of a kernel, and `StraightKernel`, for which it is told what varies.
The text of a plain kernel (`writing`) is its intermediate form: arguments are taken apart, numbers are computed one
line after the other, cells are put together. What depends only on arguments that are the same at every point is
computed once, by the lines as they are; the rest are operations on numbers and masks.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

from msgspec import Struct

from potto.kernels.native.operations import CONSTANTS, NotStraight, Operation, flattened, number_of
from potto.kernels.written import Kernel

SIDE = "side"


class ArgumentPart(Struct, frozen=True):
    """A part of an argument: which one (and which item of it, where it is a tuple), and "v", "e", "t" or "et" of it.

    Or, as "side", the mask that a trace has for a site, which is the path.
    """

    path: tuple[int, ...]
    kind: str
    direction: int = 0

    @property
    def text(self) -> str:
        """How it is read from the arguments of a kernel, and the sides that are forced; 0 where there is none."""
        at = self.path[0]
        if self.kind == SIDE:
            return f"sides[{at}]"
        part = f"args[{at}].{self.kind}{f'[{self.direction}]' if self.kind in ('t', 'et') else ''}"
        return part if self.kind == "v" else f"0.0 if {part} is None else {part}"


class Packed(Struct, frozen=True):
    """A cell that a kernel makes: the names of its parts, numbers as text; None for what is not there."""

    v: str
    e: str | None
    t: tuple[str | None, ...]
    et: tuple[str | None, ...]

    def parts(self) -> Iterator[str]:
        yield from (part for part in (self.v, self.e, *self.t, *self.et) if part is not None)


Result = Packed | tuple[Any, ...]


class KernelLine(Struct, frozen=True):
    """A statement of a kernel: the names it sets, those it reads, and itself."""

    sets: tuple[str, ...]
    reads: frozenset[str]
    node: ast.stmt


class StraightKernel(Struct, frozen=True):
    """A kernel as lines. parts: of arguments, by the names that the lines have for them."""

    kernel: Kernel
    parts: dict[str, ArgumentPart]
    lines: tuple[KernelLine, ...]
    result: Result

    @classmethod
    def of(cls, kernel: Kernel, forced: Iterable[int] = ()) -> StraightKernel:
        """The lines of a plain kernel, whose trace forces the sides of these sites. Raises NotStraight."""
        statements, parts, result = statements_of(kernel.text, frozenset(forced))
        calls = _Calls()
        lines = tuple(_line(line) for node in statements for line in calls.before(node))
        return cls(kernel, parts, lines, result)

    def constant(self, uniform: Iterable[str]) -> frozenset[str]:
        """Of all names, those that are the same at every point if these parts are."""
        known = set(uniform)
        for line in self.lines:
            if line.reads - {"rt"} <= known:
                known.update(line.sets)
            else:
                known.difference_update(line.sets)
        return frozenset(known)

    def function(
        self, constant: frozenset[str], wanted: Iterable[str], parameters: str, ending: Sequence[str],
        scope: Mapping[str, Any],
    ) -> Callable[..., Any]:  # fmt: skip
        """A function of these parameters, among them `rt`, the `sides` of a trace and `args`: the lines that depend on
        nothing but what is in `constant`, then those of `ending`, which read the names that are wanted."""
        names = constant.union(wanted)
        read = [f"{name} = {part.text}" for name, part in self.parts.items() if name in names]
        module = ast.parse("\n    ".join((f"def function({parameters}):", *read, *ending)))
        body: list[ast.stmt] = module.body[0].body  # type: ignore[attr-defined]
        body[len(read) : len(read)] = [line.node for line in self.lines if set(line.sets) <= constant]
        made = {**self.kernel.run.__globals__, **scope, "trace": None}
        exec(compile(ast.fix_missing_locations(module), "<around>", "exec"), made)
        return made["function"]  # type: ignore[no-any-return]

    def operations(self, constant: frozenset[str]) -> list[Operation]:
        """What is left to be done at each point. Raises NotStraight."""
        return flattened(line.node for line in self.lines if not set(line.sets) <= constant)


class FlatKernel(Struct, frozen=True):
    """All operations of a kernel that lead to its result, and the parts of arguments as in `StraightKernel`."""

    parts: dict[str, ArgumentPart]
    operations: list[Operation]
    result: Result

    @classmethod
    def of(cls, kernel: Kernel) -> FlatKernel:
        """The operations of a plain kernel. Raises NotStraight."""
        statements, parts, result = statements_of(kernel.text)
        wanted = {name for cell in packed(result) for name in cell.parts()}
        return cls(parts, needed(flattened(statements), wanted), result)


def needed(operations: Sequence[Operation], wanted: Iterable[str]) -> list[Operation]:
    """Those operations that lead to what is wanted."""
    names, kept = set(wanted), []
    for operation in reversed(operations):
        if operation.name in names:
            names.update(operation.args)
            kept.append(operation)
    return kept[::-1]


def read(operations: Iterable[Operation], result: Iterable[str]) -> tuple[str, ...]:
    """The names that operations and a result need of what is not among the operations, in the order of their use."""
    operations = list(operations)
    made = {operation.name for operation in operations}
    asked = [arg for operation in operations for arg in operation.args]
    names = dict.fromkeys((*asked, *result))
    return tuple(name for name in names if name.isidentifier() and name not in made and name not in CONSTANTS)


def packed(result: Result) -> Iterator[Packed]:
    """All cells of a result."""
    if isinstance(result, Packed):
        yield result
    else:
        for item in result:
            yield from packed(item)


# Statements


def statements_of(
    text: str, forced: frozenset[int] = frozenset()
) -> tuple[list[ast.stmt], dict[str, ArgumentPart], Result]:
    """The statements of a plain kernel that work something out, the parts of arguments, and what is given back."""
    definition = ast.parse(text).body[0]
    assert isinstance(definition, ast.FunctionDef)
    paths: dict[str, tuple[int, ...]] = {arg.arg: (i,) for i, arg in enumerate(definition.args.args[2:])}
    parts: dict[str, ArgumentPart] = {}
    statements = [node for node in definition.body[:-1]
                  if not (_taken_apart(node, paths, parts) or _forced(node, forced, parts))]  # fmt: skip
    last = definition.body[-1]
    assert isinstance(last, ast.Return) and last.value is not None
    return statements, parts, _result(last.value)


def _taken_apart(node: ast.stmt, paths: dict[str, tuple[int, ...]], parts: dict[str, ArgumentPart]) -> bool:
    """Whether a statement takes an argument apart: items of a tuple become paths, parts of cells are noted."""
    if not isinstance(node, ast.Assign):
        return False
    target, value = node.targets[0], node.value
    if isinstance(target, ast.Tuple) and isinstance(value, ast.Name) and value.id in paths:
        for i, item in enumerate(target.elts):
            assert isinstance(item, ast.Name)
            paths[item.id] = (*paths[value.id], i)
        return True
    if isinstance(value, ast.IfExp) and isinstance(value.body, ast.Attribute | ast.Subscript):
        value = value.body  # a part that may not be there
    direction = 0
    if isinstance(value, ast.Subscript) and isinstance(value.slice, ast.Constant):
        direction, value = int(str(value.slice.value)), value.value
    if not isinstance(value, ast.Attribute) or not isinstance(value.value, ast.Name) or value.value.id not in paths:
        return False
    assert isinstance(target, ast.Name)
    parts[target.id] = ArgumentPart(paths[value.value.id], value.attr, direction)
    return True


def _forced(node: ast.stmt, forced: frozenset[int], parts: dict[str, ArgumentPart]) -> bool:
    """Whether a statement looks for a side that the trace has: that is noted as a part; or works out how it falls."""
    match node:
        case ast.Assign(
            targets=[ast.Name(id=mask)],
            value=ast.IfExp(test=ast.Name(id="trace"), body=ast.Call(args=[ast.Constant(value=int() as at)])),
        ) if at in forced:
            parts[mask] = ArgumentPart((at,), SIDE)
            return True
        case ast.If(test=ast.Compare(left=ast.Name(id=mask), ops=[ast.Is()])):
            return mask in parts
    return False


class _Calls(ast.NodeTransformer):
    """Gives calls inside of expressions lines of their own: what one says of numbers may differ from what it says of
    arrays, so that those with nothing but numbers that are the same everywhere must be told apart."""

    def __init__(self) -> None:
        self.made: list[ast.stmt] = []
        self.count = 0

    def before(self, node: ast.stmt) -> list[ast.stmt]:
        """The statement, and before it the calls in it."""
        self.made = []
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Call):
            node.value.args = [self.visit(arg) for arg in node.value.args]
        elif isinstance(node, ast.Assign):
            node.value = self.visit(node.value)
        return [*self.made, node]

    def visit_Call(self, node: ast.Call) -> ast.expr:
        self.generic_visit(node)
        if not (isinstance(node.func, ast.Name) and node.func.id.startswith("f_")):
            return node
        self.count += 1
        name = f"h{self.count}"
        self.made.append(ast.Assign([ast.Name(name, ast.Store())], node))
        return ast.Name(name, ast.Load())


def _line(node: ast.stmt) -> KernelLine:
    names = [inner for inner in ast.walk(node) if isinstance(inner, ast.Name)]
    sets = tuple(dict.fromkeys(name.id for name in names if isinstance(name.ctx, ast.Store)))
    skipped = {*sets, "trace", "abs", "float", "None"}
    return KernelLine(sets, frozenset(n.id for n in names if n.id not in skipped and not n.id.startswith("f_")), node)


def _result(node: ast.expr) -> Result:
    if isinstance(node, ast.Tuple):
        return tuple(map(_result, node.elts))
    if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Cell"):
        raise NotStraight(ast.unparse(node))
    v, e, *rest = node.args
    t, et = (tuple(map(_named, part.elts)) if isinstance(part, ast.Tuple) else () for part in (*rest, None, None)[:2])
    value = _named(v)
    assert value is not None
    return Packed(value, _named(e), t, et)


def _named(node: ast.expr) -> str | None:
    """A name, or a number as text; None for None."""
    if isinstance(node, ast.Constant) and node.value is None:
        return None
    if isinstance(node, ast.Name):
        return node.id
    number = number_of(node)
    if number is None:
        raise NotStraight(ast.unparse(node))
    return number
