"""The product rule for cells of one shape (`alike`) as one function of machine code, for any number of nodes.

Owns `Lowered`. The function goes through the members eight at a time. In loops over the nodes of the variables, from
the outermost to the innermost, it works out bounds, cuts, nodes and the integrand, and adds up Legendre coefficients
on the way back: what `alike.Rule` does to whole arrays, one after the other, is done here to eight numbers that stay in
registers. A formula is worked out in the outermost loop in which all that it needs is known.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from potto.core.terms import Lam, Term, function_of
from potto.integrate.fixed.a_priori import Path, Straight
from potto.integrate.fixed.edges import EDGE
from potto.integrate.pieces import Evaluator
from potto.integrate.rules.gauss import EPS
from potto.kernels.cells import Array, Cell, Ints, Value
from potto.kernels.native import objects
from potto.kernels.native.points import address
from potto.kernels.native.straight import NotStraight, Packed, Part, needed, packed
from potto.kernels.native.straight import Straight as Lines
from potto.kernels.native.vectors import LANES, Vectors

NAME = "rule"
ONE = "1.0"
PER_AXIS = 9  # numbers of the frame: how many nodes and coefficients, where tables are


@dataclass(frozen=True, slots=True)
class Symbol:
    """A cell whose parts are names of vectors; None where a part is 0, ONE where a tangent is 1."""

    v: str
    e: str | None
    t: tuple[str | None, ...]
    et: tuple[str | None, ...]

    def pattern(self) -> Any:
        moving = tuple(0 if x is None else 1 if x == ONE else 2 for x in self.t)
        return self.e is not None or any(x is not None for x in self.et), moving

    def part(self, part: Part) -> str | None:
        if part.kind in ("v", "e"):
            return self.v if part.kind == "v" else self.e
        return (self.t if part.kind == "t" else self.et)[part.direction]


@dataclass(frozen=True)
class Axis:
    """What the function is told of a variable's nodes. speeds: of the map that crowds them; few: those at which
    rounding is followed. transform: (n, rows), to coefficients, or to the sum alone."""

    nodes: Array
    speeds: Array
    weights: Array
    transform: Array
    few: Array
    few_speeds: Array

    def frame(self) -> list[int]:
        tables = (self.nodes, self.speeds, self.weights, self.transform, self.few, self.few_speeds)
        return [len(self.nodes), self.transform.shape[1], len(self.few), *map(address, tables)]


@dataclass(frozen=True)
class Raw:
    """What nodes amount to, per member: number, most, off (1 + k, M); coefficients per variable (1 + k, M, rows);
    clear: whether no cut comes between; peaks: the largest value at the ends of stretches, and at nodes."""

    number: Array
    most: Array
    off: Array
    clear: Array
    corners: Array
    largest: Array
    coefficients: list[Array]


class Lowered:
    """The rule for one path between cuts and one integrand, for parameters with these parts. Raises NotStraight."""

    def __init__(
        self, plan: Straight, path: Path, face: Term, edges: tuple[Term, ...], machine: Evaluator, env: Mapping[str, Value]
    ) -> None:  # fmt: skip
        self.uniform, self.arrays = [], []
        for name in plan.names:
            for part, value in _parts(env[name]):
                (self.arrays if isinstance(value, np.ndarray) else self.uniform).append((name, part))
        self.directions = machine.directions
        text = _Writer(plan, path, face, edges, machine).text(env, self.uniform, self.arrays)
        self.function = objects.loaded(objects.compiled(text), NAME)

    def run(self, env: Mapping[str, Value], members: Ints, axes: Sequence[Axis]) -> Raw:
        """The sums over the cells of some members."""
        k1, count = 1 + self.directions, members.size
        blocks = -(-count // LANES)
        index = np.concatenate((members, np.repeat(members[-1:], blocks * LANES - count)))
        taken = [_part(env[name], part)[index] for name, part in self.arrays]
        constants = np.array([_part(env[name], part) for name, part in self.uniform], dtype=float)
        rows = [3 * k1 + 3, *(axis.transform.shape[1] * k1 for axis in axes)]
        out = np.empty((blocks, sum(rows), LANES))
        frame = [blocks, sum(rows), address(out), *(x for axis in axes for x in axis.frame()), *map(address, taken)]
        table = np.array(frame, dtype=np.int64)
        self.function.call(address(table), address(constants))
        whole = out.transpose(1, 0, 2).reshape(sum(rows), -1)[:, :count]
        number, most, off, rest = np.split(whole[: rows[0]], [k1, 2 * k1, 3 * k1])
        parts = np.split(whole[rows[0] :], np.cumsum(rows[1:])[:-1])
        found = [part.reshape(-1, k1, count).transpose(1, 2, 0) for part in parts]
        return Raw(number, most, off, rest[0], rest[1], rest[2], found)


def _parts(value: Value) -> list[tuple[Part, Any]]:
    assert isinstance(value, Cell)
    found = [(Part((), "v"), value.v), (Part((), "e"), value.e)]
    found += [(Part((), kind, d), x) for kind, row in (("t", value.t), ("et", value.et)) for d, x in enumerate(row)]
    return [(part, x) for part, x in found if x is not None]


def _part(value: Value, part: Part) -> Any:
    found = getattr(value, part.kind)
    return found if part.kind in ("v", "e") else found[part.direction]


Dual = list[str | None]
Env = dict[str, Symbol]


class _Writer:
    """Writes the function. Lists of 1 + k names have a value first, then its tangents."""

    def __init__(
        self, plan: Straight, path: Path, face: Term, edges: tuple[Term, ...], machine: Evaluator
    ) -> None:
        self.plan, self.path, self.machine = plan, path, machine
        self.face, self.edges = function_of(face), [function_of(edge) for edge in edges]
        self.at = Vectors()
        self.k1 = 1 + machine.directions
        self.zero, self.one = self.at.number(0.0), self.at.number(1.0)

    def text(self, env: Mapping[str, Value], uniform: Sequence[Any], arrays: Sequence[Any]) -> str:
        at, k1, count = self.at, self.k1, len(self.plan.variables)
        blocks, total, out = (at.address("%frame", i) for i in range(3))
        self.tables = [[at.address("%frame", 3 + PER_AXIS * i + j, "i64" if j < 3 else "ptr")
                        for j in range(PER_AXIS)] for i in range(count)]  # fmt: skip
        self.sums = [at.room(at.whole("mul", table[1], k1)) for table in self.tables]
        self.added = [at.room(at.whole("mul", table[1], k1)) for table in self.tables]
        clear, corners, largest = at.room(1), at.room(1), at.room(1)
        self.clear = clear
        start = 3 + PER_AXIS * count
        sources = [at.address("%frame", start + i, "ptr") for i in range(len(arrays))]
        known = {place: at.constant("%constants", i) for i, place in enumerate(uniform)}
        block = at.begin(blocks)
        first = at.whole("mul", block, LANES)
        for place, source in zip(arrays, sources, strict=True):
            known[place] = at.load(at.at(source, first, "double"))
        here = {name: self.parameter(name, env[name], known) for name in self.plan.names}
        at.store(self.one, clear)
        at.store(self.zero, corners)
        at.store(self.zero, largest)
        for i, table in enumerate(self.tables):
            self.fill(self.added[i], table[1])
        number = self.every(0, here, [self.one, *[None] * (k1 - 1)], largest)
        bounds = [(at.room(1), at.room(1)) for _ in self.edges]
        for least, most in bounds:
            at.store(at.number(np.inf), least)
            at.store(self.zero, most)
        sizes, off = self.few(0, here, bounds)
        for least, most in bounds:
            self.only(at.apply("gt", at.load(least), at.apply("mul", at.number(EDGE), at.load(most))))
        self.ends(0, {name: _still(symbol) for name, symbol in here.items()}, corners)
        place = at.once(f"inttoptr i64 {out} to ptr", out)
        base = at.whole("mul", block, total)
        row = 0
        for value in (*number, *sizes, *off, at.load(clear), at.load(corners), at.load(largest)):
            at.store(value or self.zero, at.at(place, at.whole("add", base, row)))
            row += 1
        behind = at.whole("add", base, row)
        for added, table in zip(self.added, self.tables, strict=True):
            size = at.whole("mul", table[1], k1)
            i = at.begin(size)
            at.store(at.load(at.at(added, i)), at.at(place, at.whole("add", behind, i)))
            at.end()
            behind = at.whole("add", behind, size)
        at.end()
        return at.module(NAME, "ptr %frame, ptr %constants")

    def parameter(self, name: str, value: Value, known: Mapping[Any, str]) -> Symbol:
        assert isinstance(value, Cell)

        def part(kind: str, direction: int, number: Any) -> str | None:
            if kind == "t" and isinstance(number, float) and number == 1.0:
                return ONE
            return None if number is None else known[name, Part((), kind, direction)]

        v = part("v", 0, value.v)
        assert v is not None
        t = tuple(part("t", d, x) for d, x in enumerate(value.t))
        return Symbol(v, part("e", 0, value.e), t, tuple(part("et", d, x) for d, x in enumerate(value.et)))

    # The three ways through the nodes

    def every(self, i: int, env: Env, volume: Dual, largest: str) -> Dual:
        """The integral over variable i and those further in. volume: of a node of those further out, with weights."""
        at, k1 = self.at, self.k1
        n, rows, _, nodes, speeds, weights, transform, _, _ = self.tables[i]
        low, width, _ = self.stretch(i, env, self.machine)
        volume = self.product(volume, width)
        self.fill(self.sums[i], rows)
        j = at.begin(n)
        speed, weight = at.constant(speeds, j), at.constant(weights, j)
        inner = {**env, self.plan.variables[i]: self.node(low, width, at.constant(nodes, j))}
        if i + 1 == len(self.plan.variables):
            (cell,) = self.evaluated(self.face, inner, self.machine)
            value: Dual = [cell.v, *map(self.plain, cell.t)]
            self.raise_to(largest, self.finite(at.apply("abs", cell.v)))
        else:
            share = at.apply("mul", weight, speed)
            value = self.every(i + 1, inner, [self.times(x, share) for x in volume], largest)
        value = [self.times(x, speed) for x in value]
        row = at.begin(rows)
        factor = at.constant(transform, at.whole("add", at.whole("mul", j, rows), row))
        for c, x in enumerate(value):
            if x is not None:
                place = at.at(self.sums[i], at.whole("add", at.whole("mul", row, k1), c))
                at.store(at.apply("add", at.load(place), at.apply("mul", factor, x)), place)
        at.end()
        at.end()
        moving = [c for c in range(k1) if value[c] is not None]
        self.coefficients(i, volume, moving)
        number = [at.load(at.at(self.sums[i], c)) if c in moving else None for c in range(k1)]
        return self.product(number, width)

    def coefficients(self, i: int, volume: Dual, moving: Sequence[int]) -> None:
        """Add the sizes of the coefficients along variable i, times the volume of the node further out."""
        at, k1 = self.at, self.k1
        sizes = [None if x is None else at.apply("abs", x) for x in volume]
        row = at.begin(self.tables[i][1])
        base = at.whole("mul", row, k1)
        found = {c: at.apply("abs", at.load(at.at(self.sums[i], at.whole("add", base, c)))) for c in moving}
        for c in range(k1):
            terms = [self.times(found.get(c), sizes[0])]
            if c:
                terms.append(self.times(found.get(0), sizes[c]))
            total = self.total(*terms)
            if total is not None:
                place = at.at(self.added[i], at.whole("add", base, c))
                at.store(at.apply("add", at.load(place), total), place)
        at.end()

    def few(self, i: int, env: Env, bounds: Sequence[tuple[str, str]]) -> tuple[Dual, Dual]:
        """The most that is added up from variable i on, and what rounding puts it off, by nodes at which that is
        followed. bounds: of the edges of builtins."""
        at, k1 = self.at, self.k1
        _, _, n, _, _, _, _, nodes, speeds = self.tables[i]
        low, width, lost = self.stretch(i, env, self.machine.tracking())
        slots = [(at.room(1), at.room(1)) for _ in range(k1)]
        for place in (place for pair in slots for place in pair):
            at.store(self.zero, place)
        j = at.begin(n)
        here = {**env, self.plan.variables[i]: self.node(low, width, at.constant(nodes, j), lost)}
        if i + 1 == len(self.plan.variables):
            (cell,) = self.evaluated(self.face, here, self.machine.tracking())
            most = [self.size(cell.v), *(self.size(self.plain(x)) for x in cell.t)]
            off: Dual = [cell.e, *(cell.et or [None] * (k1 - 1))]
            self.at_edges(here, bounds)
        else:
            most, off = self.few(i + 1, here, bounds)
        speed = at.constant(speeds, j)
        for (size, error), x, y in zip(slots, most, off, strict=True):
            for place, part in ((size, x), (error, y)):
                if part is not None:
                    self.raise_to(place, at.apply("mul", part, speed))
        at.end()
        most, off = ([at.load(pair[which]) for pair in slots] for which in (0, 1))
        sizes = [self.size(x) for x in width]
        errors = map(self.total, self.product(off, sizes), self.product(most, lost))
        return self.product(most, sizes), list(errors)

    def at_edges(self, env: Env, bounds: Sequence[tuple[str, str]]) -> None:
        here = {name: _still(symbol) for name, symbol in env.items()}
        for edge, (least, most) in zip(self.edges, bounds, strict=True):
            (cell,) = self.evaluated(edge, here, self.machine.with_directions(0))
            size = self.at.apply("abs", cell.v)
            self.at.store(self.at.apply("min", self.at.load(least), size), least)
            self.raise_to(most, size)

    def ends(self, i: int, env: Env, largest: str) -> None:
        """The largest value at the corners of cells."""
        at, machine = self.at, self.machine.with_directions(0)
        low, width, _ = self.stretch(i, env, machine, False)
        j = at.begin("2")
        node = at.spread(at.once(f"uitofp i64 {j} to double", j))
        here = {**env, self.plan.variables[i]: self.node(low, width, node)}
        if i + 1 == len(self.plan.variables):
            (cell,) = self.evaluated(self.face, here, machine)
            self.raise_to(largest, self.finite(at.apply("abs", cell.v)))
        else:
            self.ends(i + 1, here, largest)
        at.end()

    # Stretches and nodes

    def stretch(self, i: int, env: Env, machine: Evaluator, checked: bool = True) -> tuple[Dual, Dual, Dual]:
        """The lower end, the length, and how far off both are; where another cut comes between, that is noted."""
        at, k1 = self.at, 1 + machine.directions
        cells = self.evaluated(self.plan.frames[i], env, machine)
        low, high = (cells[row] for row in self.path[i])
        lower: Dual = [low.v, *map(self.plain, low.t)]
        upper: Dual = [high.v, *map(self.plain, high.t)]
        width = [self.total(x, None if y is None else at.apply("neg", y)) for x, y in zip(upper, lower, strict=True)]
        if i and checked:
            self.only(at.apply("gt", high.v, low.v))
            for row, cell in enumerate(cells):
                if row not in self.path[i]:
                    between = at.apply("and", at.apply("gt", cell.v, low.v), at.apply("lt", cell.v, high.v))
                    self.only(at.apply("not", between))
        errors = ([low.e, *low.et], [high.e, *high.et])
        lost = []
        for c in range(k1):
            ends = self.total(self.size(lower[c]), self.size(upper[c]))
            lost.append(self.total(self.times(ends, at.number(EPS)), *(row[c] for row in errors if len(row) > c)))
        return lower, width, lost

    def node(self, low: Dual, width: Dual, u: str, lost: Dual | None = None) -> Symbol:
        """A node, which moves with the ends of its stretch."""
        at = [self.total(x, self.times(w, u)) for x, w in zip(low, width, strict=True)]
        errors = tuple((lost or [None] * len(at))[1:])
        assert at[0] is not None
        return Symbol(at[0], lost[0] if lost else None, tuple(at[1:]), tuple(
            None if moves is None else error for moves, error in zip(at[1:], errors, strict=True)
        ))  # fmt: skip

    def evaluated(self, function: Lam, env: Env, machine: Evaluator) -> list[Symbol]:
        """The numbers of a function to a number or a tuple of them."""
        args = [env[name] for name in function.params]
        kernel = machine.kernel(function, tuple(arg.pattern() for arg in args))
        if not kernel.plain or "rt." in kernel.text:
            raise NotStraight(kernel.text)
        lines = Lines.of(kernel)
        known = {}
        for name, part in lines.parts.items():
            known[name] = self.plain(args[part.path[0]].part(part)) or self.zero
        cells = list(packed(lines.result))
        wanted = {name for cell in cells for name in cell.parts()}
        found = self.at.run(needed(lines.operations(), wanted), known)
        return [self.symbol(cell, found) for cell in cells]

    def symbol(self, cell: Packed, found: Mapping[str, str]) -> Symbol:
        def part(name: str | None) -> str | None:
            return None if name is None else found.get(name) or self.at.number(float(name))

        value = part(cell.v)
        assert value is not None
        return Symbol(value, part(cell.e), tuple(map(part, cell.t)), tuple(map(part, cell.et)))

    # Arithmetic of what may be 0

    def plain(self, x: str | None) -> str | None:
        return self.one if x == ONE else x

    def size(self, x: str | None) -> str | None:
        return None if x is None else self.at.apply("abs", x)

    def times(self, x: str | None, y: str | None) -> str | None:
        return None if x is None or y is None else self.at.apply("mul", x, y)

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

    # Memory

    def fill(self, memory: str, rows: str) -> None:
        i = self.at.begin(self.at.whole("mul", rows, self.k1))
        self.at.store(self.zero, self.at.at(memory, i))
        self.at.end()

    def raise_to(self, place: str, value: str) -> None:
        self.at.store(self.at.apply("max", self.at.load(place), value), place)

    def finite(self, size: str) -> str:
        return self.at.apply("select", self.at.apply("lt", size, self.at.number(np.inf)), size, self.zero)

    def only(self, mask: str) -> None:
        """Members for which the mask doesn't hold are not clear."""
        self.at.store(self.at.apply("select", mask, self.at.load(self.clear), self.zero), self.clear)


def _still(symbol: Symbol) -> Symbol:
    return Symbol(symbol.v, None, (), ())
