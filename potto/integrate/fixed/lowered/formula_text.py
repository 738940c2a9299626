"""Formulas of the parameters of many members, as LLVM reads them: some members at a time.

Owns `FormulaText`, on which the texts of product rules, of boxes and of topologies are built, and `ParameterPlace` and
`Symbol`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from msgspec import Struct

from potto.core.terms import Lam, Term
from potto.integrate.pieces import Evaluator
from potto.integrate.rules.steepness import STEEPEST, exponents_in
from potto.integrate.rules.written_intervals import Names, WrittenInterval
from potto.kernels.native.operations import NotStraight
from potto.kernels.native.straight import ArgumentPart, FlatKernel, Packed, packed
from potto.kernels.native.vectors import LANES, Vectors

ONE = "1.0"


class ParameterPlace(Struct, frozen=True):
    """A part of a parameter, and what is there: an "array", a "number" for all members, or ONE."""

    name: str
    part: ArgumentPart
    kind: str


class Symbol(Struct, frozen=True):
    """A cell whose parts are names of vectors; None where a part is 0, ONE where a tangent is 1."""

    v: str
    e: str | None
    t: tuple[str | None, ...]
    et: tuple[str | None, ...]

    def pattern(self) -> Any:
        moving = tuple(0 if x is None else 1 if x == ONE else 2 for x in self.t)
        return self.e is not None or any(x is not None for x in self.et), moving

    def part(self, part: ArgumentPart) -> str | None:
        if part.kind in ("v", "e"):
            return self.v if part.kind == "v" else self.e
        return (self.t if part.kind == "t" else self.et)[part.direction]


Dual = list[str | None]
Env = dict[str, Symbol]


class FormulaText:
    """Writes loops over members, and in them the numbers of functions. reserved: of the constants, how many come before
    parameters."""

    reserved = 0

    def __init__(self, machine: Evaluator, lanes: int = LANES) -> None:
        self.machine, self.at = machine, Vectors(lanes)
        self.k1 = 1 + machine.directions
        self.zero, self.one = self.at.number(0.0), self.at.number(1.0)
        self.kernels: dict[str, FlatKernel] = {}

    # Members

    def block(self) -> None:
        """Begin the loop over the members, some at a time; the last ones are done twice."""
        at = self.at
        self.count = at.address("%frame", 0)
        last = at.whole("sub", self.count, at.lanes)
        blocks = at.whole("udiv", at.whole("add", self.count, at.lanes - 1), at.lanes)
        self.number = at.whole("mul", at.begin(blocks), at.lanes)
        self.first = at.once(f"call i64 @llvm.umin.i64(i64 {self.number}, i64 {last})", self.number)

    def parameters(
        self, places: Sequence[ParameterPlace], start: int, more: int = 0, members: str | None = None
    ) -> tuple[Env, list[str]]:
        """The parameters of the members of a block, and so many columns more. start: where the frame tells columns.
        members: whose parameters are asked for, where they are not those of the block."""
        at, known = self.at, dict[tuple[str, ArgumentPart], str]()
        slots = iter(range(start, start + len(places) + more))
        numbers = iter(range(self.reserved, self.reserved + len(places)))

        def column(members: str | None) -> str:
            place = at.address("%frame", next(slots), "ptr")
            return at.gather(place, members) if members else at.load(at.at(place, self.first, "double"))

        for place in places:
            match place.kind:
                case "array":
                    found = column(members)
                case "number":
                    found = at.constant("%constants", next(numbers))
                case _:
                    found = ONE
            known[place.name, place.part] = found

        def parts(name: str, kind: str) -> tuple[str | None, ...]:
            return tuple(known.get((name, ArgumentPart((), kind, d))) for d in range(self.k1 - 1))

        names = dict.fromkeys(place.name for place in places)
        return {
            name: Symbol(
                known[name, ArgumentPart((), "v")],
                known.get((name, ArgumentPart((), "e"))),
                parts(name, "t"),
                parts(name, "et"),
            )
            for name in names
        }, [column(None) for _ in range(more)]

    # Formulas

    def evaluated(self, function: Lam, env: Env, machine: Evaluator) -> list[Symbol]:
        """The numbers of a function to a number or a tuple of them."""
        args, flat = [env[name] for name in function.params], self.kernel(function, env, machine)
        known = {name: self.plain(args[part.path[0]].part(part)) or self.zero for name, part in flat.parts.items()}
        found = self.at.run(flat.operations, known)
        return [self.symbol(cell, found) for cell in packed(flat.result)]

    def kernel(self, function: Lam, env: Env, machine: Evaluator) -> FlatKernel:
        """The operations that lead to these numbers."""
        kernel = machine.kernel(function, tuple(env[name].pattern() for name in function.params))
        if not kernel.plain:
            raise NotStraight(kernel.text)
        found = self.kernels.get(kernel.text)
        if found is None:
            found = self.kernels[kernel.text] = FlatKernel.of(kernel)
        return found

    def symbol(self, cell: Packed, found: Mapping[str, str]) -> Symbol:
        def part(name: str | None) -> str | None:
            return None if name is None else found.get(name) or self.at.number(float(name))

        value = part(cell.v)
        assert value is not None
        return Symbol(value, part(cell.e), tuple(map(part, cell.t)), tuple(map(part, cell.et)))

    # Enclosures

    def range(self, symbol: Symbol) -> Names:
        """What a number can be."""
        if symbol.e is None:
            return Names(symbol.v, symbol.v)
        return Names(self.at.apply("sub", symbol.v, symbol.e), self.at.apply("add", symbol.v, symbol.e))

    def even(self, face: Term, env: Mapping[str, Symbol], spans: Mapping[str, Names]) -> list[str]:
        """Masks that together tell where no exponent in an integrand changes by more than nodes see, as
        `steepness.change` tells it by numpy; spans: where variables are. Where bounds overflow that is not known."""
        exponents, masks = exponents_in(face), []
        box = {name: self.range(env[name]) for name in frozenset().union(*(x.free for x in exponents)) - spans.keys()}
        for found in WrittenInterval(self.at).walk(exponents, {**box, **spans}, {}):
            change = self.at.apply("sub", found.high, found.low)
            masks.append(self.at.apply("le", change, self.at.number(STEEPEST)))
        return masks

    # Arithmetic of what may be 0

    def plain(self, x: str | None) -> str | None:
        return self.one if x == ONE else x

    def size(self, x: str | None) -> str | None:
        return None if x is None else self.at.apply("abs", x)

    def times(self, x: str | None, y: str | None) -> str | None:
        return None if x is None or y is None else self.at.apply("mul", x, y)

    def greater(self, x: str, y: str) -> str:
        """The greater one; of a number and what is none, the number."""
        at = self.at
        return at.apply("select", at.apply("gt", x, y), x, at.apply("select", at.apply("eq", y, y), y, x))

    def total(self, *terms: str | None) -> str | None:
        result = None
        for term in terms:
            if term is not None:
                result = term if result is None else self.at.apply("add", result, term)
        return result

    def product(self, f: Dual, g: Dual) -> Dual:
        """(f g)' = f' g + f g'."""
        moved = [self.total(self.times(x, g[0]), self.times(f[0], y)) for x, y in zip(f[1:], g[1:], strict=True)]
        return [self.times(f[0], g[0]), *moved]

    def spread(self, whole: str) -> str:
        """A whole number as a number, at all places."""
        return self.at.spread(self.at.once(f"uitofp i64 {whole} to double", whole))

    # Memory

    def fill(self, memory: str, rows: str, each: int) -> None:
        i = self.at.begin(self.at.whole("mul", rows, each))
        self.at.store(self.zero, self.at.at(memory, i))
        self.at.end()

    def owners(self) -> str:
        """The numbers of the members of a block."""
        lanes = ", ".join(f"double {float(lane)}" for lane in range(self.at.lanes))
        return self.at.apply("add", self.spread(self.first), f"<{lanes}>")

    def append(self, there: str, numbers: Sequence[str], places: Sequence[str], counted: str) -> None:
        """Put whole numbers of the members of a mask behind those that are there already. places: where each list
        begins. counted: where it is told how long they are."""
        at = self.at
        at.begin("1", at.any(there))
        found = at.let(f"load i64, ptr {counted}")
        for place, number in zip(places, numbers, strict=True):  # the next ones take the place of those not in the mask
            whole = at.once(f"fptosi {at.doubles} {number} to {at.whole_numbers}", number)
            at.store_wholes(at.those(whole, there), at.at(place, found, "i64"))
        at.line(f"store i64 {at.whole('add', found, at.many(there))}, ptr {counted}")
        at.end()

    def raise_to(self, place: str, value: str) -> None:
        self.at.store(self.at.apply("max", self.at.load(place), value), place)


def still(symbol: Symbol) -> Symbol:
    """A cell without tangents."""
    return Symbol(symbol.v, None, (), ())
