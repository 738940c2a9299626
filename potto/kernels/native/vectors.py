"""LLVM text for operations on some numbers at a time, eight unless there are never so many.

Owns `Vectors`. Numbers are `<8 x double>`, masks `<8 x i1>`. No operation of a kernel is marked as one that may be
reordered, fused or done by reciprocals: what it gives is what numpy gives, bit by bit; functions of the C library are
called for one number after the other. Where a rule's products are added up, which numpy does in an order of its own,
"muladd" rounds once.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping, Sequence

from potto.kernels.native.operations import NotStraight, Operation

LANES = 8
ARITHMETIC = {"add": "fadd", "sub": "fsub", "mul": "fmul", "div": "fdiv"}
RELATIONS = {"lt": "olt", "le": "ole", "gt": "ogt", "ge": "oge", "eq": "oeq", "ne": "une"}
INTRINSICS = {"sqrt": 1, "floor": 1, "ceil": 1, "abs": 1, "min": 2, "max": 2, "muladd": 3}
_NAMES = {"abs": "fabs", "min": "minimum", "max": "maximum", "muladd": "fmuladd"}
EITHER_ZERO = "min", "max"  # of 0 and -0 give one of them, as numpy's: in three instructions instead of seven
LIBRARY = {
    "exp": 1, "log": 1, "log1p": 1, "expm1": 1, "sinh": 1, "cosh": 1, "tanh": 1, "asinh": 1, "acosh": 1, "atanh": 1,
    "sin": 1, "cos": 1, "tan": 1, "asin": 1, "acos": 1, "atan": 1, "erf": 1, "atan2": 2, "hypot": 2, "pow": 2,
}  # fmt: skip


def bits(value: float) -> str:
    """A double as LLVM reads it to the last bit."""
    return f"0x{struct.unpack('<Q', struct.pack('<d', value))[0]:016X}"


class Vectors:
    """Lines of a function, in loops inside of each other. lanes: how many numbers it does at a time.

    What is asked for twice is done once, and in the outermost loop in which all that it takes is known.
    """

    def __init__(self, lanes: int = LANES) -> None:
        self.lanes = lanes
        self.doubles, self.whole_numbers, self.masks = (f"<{lanes} x {kind}>" for kind in ("double", "i64", "i1"))
        self.bodies: list[list[str]] = [[]]
        self.known: list[dict[str, str]] = [{}]
        self.depths: dict[str, int] = {}
        self.loops: list[tuple[str, str, str]] = []
        self.used: dict[str, int] = {}
        self.count = 0

    @property
    def depth(self) -> int:
        return len(self.bodies) - 1

    def name(self) -> str:
        self.count += 1
        return f"%n{self.count}"

    def line(self, text: str) -> None:
        """A line that stays where it is."""
        self.bodies[-1].append("  " + text)

    def let(self, text: str) -> str:
        """A name for what a line gives that stays where it is."""
        name = self.name()
        self.line(f"{name} = {text}")
        self.depths[name] = self.depth
        return name

    def once(self, text: str, *args: str) -> str:
        """A name for what an operation gives that depends on nothing but these."""
        depth = max((self.depths.get(arg, 0) for arg in args), default=0)
        found = self.known[depth].get(text)
        if found is None:
            found = self.known[depth][text] = self.name()
            self.bodies[depth].append(f"  {found} = {text}")
            self.depths[found] = depth
        return found

    def begin(self, count: str, only: str = "true") -> str:
        """Begin a loop of so many rounds, at least one, or none where `only`, an i1, is false; the round's number."""
        self.count += 1
        stem = str(self.count)
        self.bodies.append([])
        self.known.append({})
        self.loops.append((stem, count, only))
        self.depths[f"%j{stem}"] = self.depth
        return f"%j{stem}"

    def adding(self, count: str, sums: int) -> tuple[str, list[str]]:
        """Begin a loop, of at least one round, that adds up so many vectors in registers: the round's number, and what
        they are before it."""
        j = self.begin(count)
        names = [f"%c{j[2:]}.{i}" for i in range(sums)]
        self.depths.update(dict.fromkeys(names, self.depth))
        return j, names

    def again(self, value: str) -> str:
        """A number by another name: what is made of it is made here, and not further out."""
        return self.let(f"bitcast {self.doubles} {value} to {self.doubles}")

    def end_or(self, before: Sequence[str], found: Sequence[str]) -> list[str]:
        """End a loop of at most one round: what was found in it, or what was there before it."""
        stem = self.loops[-1][0]
        self.end()
        kind = self.doubles
        return [self.let(f"phi {kind} [{old}, %before{stem}], [{new}, %last{stem}]")
                for old, new in zip(before, found, strict=True)]  # fmt: skip

    def end(self, *sums: str | None) -> None:
        """End the innermost loop. sums: what those that it adds up are after a round, and so behind it; None for one
        that is not used."""
        stem, count, only = self.loops.pop()
        body = self.bodies.pop()
        self.known.pop()
        used = [(i, name) for i, name in enumerate(sums) if name is not None]
        for _, name in used:
            self.depths[name] = self.depth
        self.bodies[-1] += [
            f"  br label %before{stem}", f"before{stem}:",
            f"  br label %loop{stem}" if only == "true" else f"  br i1 {only}, label %loop{stem}, label %after{stem}",
            f"loop{stem}:",
            f"  %j{stem} = phi i64 [0, %before{stem}], [%next{stem}, %last{stem}]",
            *(f"  %c{stem}.{i} = phi {self.doubles} [zeroinitializer, %before{stem}], [{name}, %last{stem}]"
              for i, name in used),
            *body, f"  br label %last{stem}", f"last{stem}:", f"  %next{stem} = add i64 %j{stem}, 1",
            f"  %more{stem} = icmp ult i64 %next{stem}, {count}",
            f"  br i1 %more{stem}, label %loop{stem}, label %after{stem}", f"after{stem}:",
        ]  # fmt: skip

    # Memory and whole numbers

    def whole(self, code: str, a: str | int, b: str | int) -> str:
        """An operation (add, mul, ...) on whole numbers."""
        return self.once(f"{code} i64 {a}, {b}", *(x for x in (a, b) if isinstance(x, str)))

    def any(self, mask: str) -> str:
        """Whether a mask holds anywhere, as an i1."""
        return self.once(f"call i1 @llvm.vector.reduce.or.v{self.lanes}i1({self.masks} {mask})", mask)

    def room(self, count: str | int) -> str:
        """Memory for so many vectors."""
        name = self.name()
        self.bodies[0].append(f"  {name} = alloca {self.doubles}, i64 {count}, align 64")
        return name

    def at(self, memory: str, index: str | int, kind: str = "") -> str:
        """The place of an item, by default a vector."""
        return self.once(f"getelementptr {kind or self.doubles}, ptr {memory}, i64 {index}", memory,
                         *([index] if isinstance(index, str) else []))  # fmt: skip

    def load(self, place: str) -> str:
        return self.let(f"load {self.doubles}, ptr {place}, align 8")

    def wholes(self, place: str) -> str:
        """Whole numbers, read as such."""
        return self.let(f"load {self.whole_numbers}, ptr {place}, align 8")

    def digit(self, numbers: str, shift: int, bits: int) -> str:
        """So many bits of whole numbers, those from a place on."""
        shifted = self.once(f"lshr {self.whole_numbers} {numbers}, splat (i64 {shift})", numbers)
        return self.once(f"and {self.whole_numbers} {shifted}, splat (i64 {(1 << bits) - 1})", shifted)

    def same(self, numbers: str, number: int) -> str:
        """A mask of the whole numbers that are this one."""
        return self.once(f"icmp eq {self.whole_numbers} {numbers}, splat (i64 {number})", numbers)

    def those(self, numbers: str, mask: str) -> str:
        """The whole numbers of a mask in front, in order."""
        kind = self.whole_numbers
        return self.once(f"call {kind} {self.compress}({kind} {numbers}, {self.masks} {mask}, {kind} poison)",
                         numbers, mask)  # fmt: skip

    @property
    def compress(self) -> str:
        return f"@llvm.experimental.vector.compress.v{self.lanes}i64"

    def many(self, mask: str) -> str:
        """For how many a mask holds."""
        bits = f"i{self.lanes}"
        one = self.once(f"bitcast {self.masks} {mask} to {bits}", mask)
        return self.once(f"zext {bits} {self.once(f'call {bits} @llvm.ctpop.{bits}({bits} {one})', one)} to i64", one)

    def store_wholes(self, value: str, place: str) -> None:
        self.line(f"store {self.whole_numbers} {value}, ptr {place}, align 8")

    def gather(self, memory: str, index: str) -> str:
        """Numbers from these places of memory."""
        return self.let(f"call {self.doubles} @gather(ptr {memory}, {self.whole_numbers} {index})")

    def store(self, value: str, place: str) -> None:
        self.line(f"store {self.doubles} {value}, ptr {place}, align 8")

    def constant(self, memory: str, index: str | int) -> str:
        """A number of a table that never changes, at all places."""
        place = self.at(memory, index, "double")
        return self.spread(self.once(f"load double, ptr {place}", place))

    def address(self, memory: str, index: int, kind: str = "i64") -> str:
        """A whole number (or a ptr) of a table that never changes."""
        place = self.at(memory, index, "i64")
        return self.once(f"load {kind}, ptr {place}", place)

    def number(self, value: float) -> str:
        return f"splat (double {bits(value)})"

    def spread(self, scalar: str) -> str:
        """A double at all places."""
        one = self.once(f"insertelement {self.doubles} poison, double {scalar}, i32 0", scalar)
        return self.once(
            f"shufflevector {self.doubles} {one}, {self.doubles} poison, <{self.lanes} x i32> zeroinitializer", one
        )

    def apply(self, code: str, *args: str) -> str:
        """An operation on numbers (masks for and, or, not; a mask first for select)."""
        return self.once(self.operation(code, args), *args)

    def operation(self, code: str, args: Sequence[str]) -> str:
        if code in ARITHMETIC:
            return f"{ARITHMETIC[code]} {self.doubles} {args[0]}, {args[1]}"
        if code in RELATIONS:
            return f"fcmp {RELATIONS[code]} {self.doubles} {args[0]}, {args[1]}"
        if code == "neg":
            return f"fneg {self.doubles} {args[0]}"
        if code == "nan":
            return f"fcmp uno {self.doubles} {args[0]}, {args[0]}"
        if code == "select":
            return f"select {self.masks} {args[0]}, {self.doubles} {args[1]}, {self.doubles} {args[2]}"
        if code in ("and", "or"):
            return f"{code} {self.masks} {args[0]}, {args[1]}"
        if code == "not":
            return f"xor {self.masks} {args[0]}, splat (i1 true)"
        given = ", ".join(f"{self.doubles} {arg}" for arg in args)
        if code in INTRINSICS:
            flags = "nsz " if code in EITHER_ZERO else ""
            return f"call {flags}{self.doubles} @llvm.{_NAMES.get(code, code)}.v{self.lanes}f64({given})"
        if code in LIBRARY:
            self.used[code] = LIBRARY[code]
            return f"call {self.doubles} @each_{code}({given})"
        raise NotStraight(code)

    def run(self, operations: Iterable[Operation], known: Mapping[str, str]) -> dict[str, str]:
        """The operations, given the values of the names that they read; the values of all names."""
        values = dict(known)

        def value(arg: str) -> str:
            if arg in values:
                return values[arg]
            if arg in ("True", "False"):
                return f"splat (i1 {arg.lower()})"
            return self.number(float(arg))

        for operation in operations:
            args = tuple(map(value, operation.args))
            values[operation.name] = args[0] if operation.code == "is" else self.apply(operation.code, *args)
        return values


def intrinsics(text: str, at: Vectors) -> str:
    """Declarations of the intrinsics that a text calls."""
    wanted = []
    for code, arity in INTRINSICS.items():
        name = f"@llvm.{_NAMES.get(code, code)}.v{at.lanes}f64"
        if name + "(" in text:
            wanted.append(f"declare {at.doubles} {name}({', '.join([at.doubles] * arity)})")
    others = {
        "@llvm.umin.i64": ("i64", "i64, i64"), f"@llvm.vector.reduce.or.v{at.lanes}i1": ("i1", at.masks),
        f"@llvm.ctpop.i{at.lanes}": (f"i{at.lanes}", f"i{at.lanes}"),
        at.compress: (at.whole_numbers, f"{at.whole_numbers}, {at.masks}, {at.whole_numbers}"),
    }  # fmt: skip
    for name, (result, parameters) in others.items():
        if name + "(" in text:
            wanted.append(f"declare {result} {name}({parameters})")
    return "\n".join(wanted)
