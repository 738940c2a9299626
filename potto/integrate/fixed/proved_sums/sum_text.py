"""The sums of `moving_sums` over the nodes of a region as one straight function of Python, for numpy.

Owns `RepeatedSum`, and `SumText`, which is the same for all regions with such integrands, and whose `at_region` is the
function for one of them. The steps are those of `moving_sums.summed`, and what they come to is the same to the last
bit. What that finds out at every call (which numbers move, and what a kernel takes) is known when the text is written:
kernels' lines stand in it, nodes, sides and weights lie ready in the shape in which they are needed, and what is 0 or a
number is left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from types import CodeType
from typing import Any

import numpy as np
from msgspec import Struct

from potto.core.terms import Lam, Term, function_of
from potto.integrate.fixed.lowered.cells import terms_of
from potto.integrate.fixed.moving_sums import SUMMED
from potto.integrate.fixed.straight import StraightIntegral
from potto.integrate.pieces import Evaluator
from potto.integrate.rules.gauss import EPS, gauss
from potto.integrate.rules.proved_orders import Region
from potto.kernels.cells import Array, Ints, pattern
from potto.kernels.flat_lines import Flat, FlatCell, FlatLines
from potto.kernels.making import compiling, making
from potto.kernels.native.operations import NotStraight

# Seconds that the text takes for each term and each of its tangents: 29 to 88 us, of eq. (1) 61. How many times as long
# numpy adds up before it is written, which then takes half as long.
TERM, PAYS = 60e-6, 2
MOST_TEXTS = 64


class SumText(Struct, frozen=True, eq=False):
    """The text for regions with these faces, in their order.

    scope: what it calls by name in all of them. rows: of the frame of each variable. frames: what is known of these:
    part (0: numbers, 1: errors), direction, row, and the number.
    """

    code: CodeType
    scope: Mapping[str, Any]
    faces: tuple[Term, ...]
    frames: tuple[tuple[tuple[int, int, int, float], ...], ...]
    rows: tuple[int, ...]
    k1: int

    @classmethod
    def of(
        cls, plan: StraightIntegral, region: Region, machine: Evaluator, env: Mapping[str, Any],
        before: Sequence[str], after: Sequence[str],
    ) -> SumText:  # fmt: skip
        """The text, with lines before it, and after the numbers n0 ..., their errors e0 ... and their sizes g0 ...

        machine: one that keeps track of rounding. env: parameters that move as they will. Raises NotStraight.
        """
        writer = _Writer(plan, machine, env)
        faces = faces_of(region)
        for i in range(len(plan.variables)):
            writer.variable(i, len(plan.items[i]))
        for number, face in enumerate(faces):
            writer.face(number, function_of(face), len(faces) > 1)
        body = writer.at.asked_for([*writer.sums(), *after])
        lines = [*before, "with errstate(all='ignore'):", *(f"    {line}" for line in body)]
        text = "def at(env):\n    " + "\n    ".join(lines) + "\n"
        rows = tuple(map(len, plan.items))
        return cls(compile(text, "<sums>", "exec"), writer.at.scope, faces, tuple(writer.frames), rows, writer.k1)

    def at_region(self, region: Region, scope: Mapping[str, Any]) -> Callable[[dict[str, Any]], Any]:
        """The function for a region, with what is in `scope` for the lines before and after."""
        made = {**self.scope, **_nodes(self, region), **scope}
        exec(self.code, made)
        return made["at"]  # type: ignore[no-any-return]


class RepeatedSum(Struct):
    """Sums that numpy adds up again and again, and their text from when on that pays; `impossible`: there is none.

    terms: of what is integrated, its bounds and cuts, with their tangents. spent: seconds of the processor so far.
    """

    terms: int
    spent: float = 0.0
    written: SumText | None = None
    impossible: bool = False

    @classmethod
    def of(cls, plan: StraightIntegral, region: Region, machine: Evaluator, env: Mapping[str, Any]) -> RepeatedSum:
        """Of all regions with these integrands, for parameters that move as these do."""
        kinds, faces = tuple([pattern(env[name], machine.directions) for name in plan.names]), faces_of(region)
        key = faces, kinds, machine.directions
        found: RepeatedSum | None = plan.texts.get(key)
        if found is None:
            if len(plan.texts) >= MOST_TEXTS:
                plan.texts.clear()
            terms = sum(terms_of(plan, face) for face in faces) * (1 + machine.directions)
            found = plan.texts[key] = cls(terms)
        return found

    def text(self, write: Callable[[], SumText]) -> SumText | None:
        """The text if it is to be used now. write: what makes it; may raise NotStraight."""
        if self.written is None and not self.impossible and self.spent >= PAYS * TERM * self.terms:
            with making, compiling:
                try:
                    self.written = write()
                except NotStraight:
                    self.impossible = True
        return self.written


def faces_of(region: Region) -> tuple[Term, ...]:
    return tuple(dict.fromkeys(cell.body for cell in region.cells))


@lru_cache(maxsize=64)
def _nodes(text: SumText, region: Region) -> dict[str, Any]:
    """What the text calls by name that is not the same in all regions: nodes, sides and weights."""
    k1, inner = text.k1, [gauss(n) for n in region.inner]
    owner = np.repeat(np.arange(len(region.outer)), region.outer)
    sizes = [owner.size * math.prod(region.inner[:i]) for i in range(len(text.rows))]
    found: dict[str, Any] = {"first": np.zeros(k1, dtype=int), "nodes": sizes[-1]}
    for i, count in enumerate(text.rows):
        at = np.repeat(owner, sizes[max(i - 1, 0)] // owner.size)
        rows = np.array([cell.rows[i] for cell in region.cells])[at]  # (S, 2)
        found |= _variable(text, i, rows, count)
        found |= {f"times{j}_{i + 1}": sizes[i] // sizes[j - 1] for j in range(1, i + 1)}
        along = np.tile(inner[i - 1].nodes, sizes[i - 1]) if i else np.concatenate(
            [gauss(n).nodes for n in region.outer])  # fmt: skip
        found[f"along{i}"] = np.tile(along, (k1, 1))
    weights = np.concatenate([gauss(n).weights for n in region.outer])
    for rule in inner[:-1]:
        weights = weights[..., None] * rule.weights
    found["weights"] = np.tile(weights.reshape(-1), (k1, 1))
    found["shape"] = 3, k1, owner.size, *region.inner
    if inner:
        found["innermost"] = inner[-1].weights
    for number, face in enumerate(text.faces):
        mine = np.array([cell.body is face for cell in region.cells])[owner]
        for depth, size in enumerate(sizes, 1):
            found[f"face{number}_{depth}"] = np.nonzero(np.repeat(mine, size // owner.size))[0]
        found[f"zeros{number}"] = np.zeros(found[f"face{number}_{len(sizes)}"].size)
    return found


def _variable(text: SumText, i: int, rows: Ints, count: int) -> dict[str, Any]:
    """The frame of a variable, (2, 1 + k, rows), of others than the outermost at each of S places, and where in it the
    ends of the stretches are, (2, 2, 1 + k, S), and all other rows, (rows - 2, S). rows: (S, 2)."""
    size = len(rows)
    frame: Array = np.zeros((2, text.k1, count, size) if i else (2, text.k1, count))
    for part, d, row, number in text.frames[i]:
        frame[part, d, row] = number
    parts, directions = np.arange(2)[:, None, None, None], np.arange(text.k1)[:, None]
    ends = (parts * text.k1 + directions) * count + rows.T[:, None, :]
    if not i:
        return {"frame0": frame, "ends0": ends}
    others = np.array([[r for r in range(count) if r not in own] for own in rows.tolist()], dtype=int).T
    at = np.arange(size)
    mask = np.ones((text.k1, size))
    mask[0] = 0.0
    return {f"frame{i}": frame, f"ends{i}": ends * size + at, f"others{i}": others * size + at,
            f"count{i}": size, f"moving{i}": mask}  # fmt: skip


class _Writer:
    """Writes the text. `at`: its lines so far. `env`: parameters and variables."""

    def __init__(self, plan: StraightIntegral, machine: Evaluator, env: Mapping[str, Any]) -> None:
        self.plan, self.machine, self.k1 = plan, machine, 1 + machine.directions
        self.at = FlatLines()
        self.at.scope |= {"errstate": np.errstate, "concatenate": np.concatenate, "empty": np.empty,
                          "count_nonzero": np.count_nonzero}  # fmt: skip
        self.env = {name: self._parameter(name, env[name]) for name in plan.names}
        self.frames: list[tuple[tuple[int, int, int, float], ...]] = []

    def _parameter(self, name: str, cell: Any) -> FlatCell:
        text, none = f"env[{name!r}]", (None,) * (self.k1 - 1)

        def read(kind: str, numbers: Sequence[Any]) -> tuple[Flat | None, ...]:
            return tuple([
                None if x is None
                else self.at.one if kind == "t" and x.__class__ is float and x == 1.0
                else self.at.let(f"{text}.{kind}[{d}]", 0)
                for d, x in enumerate(numbers)
            ])  # fmt: skip

        return FlatCell(self.at.let(f"{text}.v", 0), None, read("t", cell.t) or none, read("et", cell.et) or none)

    def evaluated(self, function: Lam, env: Mapping[str, FlatCell]) -> list[FlatCell]:
        args = [env[name] for name in function.params]
        kernel = self.machine.kernel(function, tuple([_pattern(arg) for arg in args]))
        return self.at.inlined(kernel, args)

    def variable(self, i: int, rows: int) -> None:
        """Bounds and cuts of a variable, its nodes between them, and the product of all lengths so far."""
        frame, write = self.evaluated(self.plan.frames[i], self.env), self.at.lines.append
        self._frame(i, frame)
        write(f"ends, off = block.take(ends{i})")
        write("low, high = ends")
        write("width = high - low")
        if i:
            write(f"if count_nonzero(low[0] < high[0]) < count{i}: return None")
            if rows > 2:
                write(f"places = block.take(others{i})")
                write("if count_nonzero((places > low[0]) & (places < high[0])): return None")
        write(f"off_low, off_high = abs(ends)*{self.constant(EPS)} + off")
        write("off = off_low + off_high")
        times = f".repeat(times{i}_{i + 1}, 1)" if i else ""
        write(f"at{i} = low{times} + width{times}*along{i}")
        write(f"off{i} = off{times}")
        self.env[self.plan.variables[i]] = self._placed(i, frame)
        self._longer(i)

    def constant(self, value: float) -> str:
        return self.at.constant(value).name + "_"

    def _frame(self, i: int, frame: Sequence[FlatCell]) -> None:
        """Put bounds and cuts into a block; the numbers that are known lie in it already."""
        held = []
        self.at.lines.append(f"block = frame{i}.copy()")
        for row, cell in enumerate(frame):
            for part, numbers in enumerate(((cell.v, *cell.t), (cell.e, *cell.et))):
                for d, number in enumerate(numbers):
                    if number is None:
                        continue
                    if number.value is not None:
                        held.append((part, d, row, float(number.value)))
                        continue
                    x = self.at.plain(number)
                    name = self.at.repeated(x.name, x.depth, i) if x.depth else x.name
                    self.at.lines.append(f"block[{part}, {d}, {row}] = {name}")
        self.frames.append(tuple(held))

    def _placed(self, i: int, frame: Sequence[FlatCell]) -> FlatCell:
        """The nodes of a variable, which move with the ends of its stretch."""
        depth, every = i + 1, range(self.k1)
        for kind in ("at", "off"):
            self.at.lines.append(f"{''.join(f'{kind}{i}_{d}, ' for d in every)} = {kind}{i}")
        moves = [d for d in every[1:] if any(cell.t[d - 1] is not None for cell in frame)]
        t = [Flat(f"at{i}_{d}", depth) if d in moves else None for d in every[1:]]
        et = [Flat(f"off{i}_{d}", depth, nonnegative=True) if d in moves else None for d in every[1:]]
        return FlatCell(Flat(f"at{i}_0", depth), Flat(f"off{i}_0", depth, nonnegative=True), tuple(t), tuple(et))

    def _longer(self, i: int) -> None:
        """The product of the lengths so far with that of one more variable, its tangents, and its rounding."""
        write = self.at.lines.append
        if not i:
            write("length, rounded = width, off")
            return
        if i > 1:
            write(f"length, rounded = length.repeat(times{i - 1}_{i}, 1), rounded.repeat(times{i - 1}_{i}, 1)")
        twice = self.constant(2 * EPS)
        if self.k1 == 1:
            write("found = length*width")
            write(f"rounded = rounded*abs(width) + abs(length)*off + abs(found)*{twice}")
        else:  # (f g)' = f' g + f g', with values and tangents one below the other
            write("value, by_width = length.take(first, 0), width.take(first, 0)")
            write(f"moves, strays = width*moving{i}, off*moving{i}")
            write("found = length*by_width + value*moves")
            write("slack = rounded*abs(by_width) + rounded.take(first, 0)*abs(moves)")
            write("slack += abs(length)*off.take(first, 0) + abs(value)*strays")
            write(f"rounded = slack + abs(found)*{twice}")
        write("length = found")

    def face(self, number: int, function: Lam, several: bool) -> None:
        """The integrand at its nodes: numbers, errors and magnitudes, (3 (1 + k), S)."""
        depth = len(self.plan.variables)
        env = {name: self._gathered(number, self.env[name]) if several else self.env[name] for name in function.params}
        (cell,) = self.evaluated(function, env)
        numbers, errors = [*(cell.v, *cell.t)], [*(cell.e, *cell.et)]
        sizes = [None if x is None else self.at.size(x) for x in numbers]
        names = [self._full(number, x, depth) for x in (*numbers, *errors, *sizes)]
        values = f"concatenate(({', '.join(names)}))"
        if several:
            if not number:
                self.at.lines.append("values = empty(shape).reshape(rows, -1)")
            self.at.lines.append(f"values[:, face{number}_{depth}] = {values}.reshape(rows, -1)")
        else:
            self.at.lines.append(f"values = {values}")

    def _gathered(self, number: int, cell: FlatCell) -> FlatCell:
        def part(x: Flat | None) -> Flat | None:
            if x is None or not x.depth:
                return x
            return self.at.let(f"{x.name}.take(face{number}_{x.depth})", x.depth, x.nonnegative)

        value = part(cell.v)
        assert value is not None
        return FlatCell(value, part(cell.e), tuple(map(part, cell.t)), tuple(map(part, cell.et)))

    def _full(self, number: int, x: Flat | None, depth: int) -> str:
        if x is None or x.value == 0.0:
            return f"zeros{number}"
        name = self.at.at(x, depth)
        return name if x.depth else f"zeros{number} + {name}"

    def sums(self) -> list[str]:
        """The lines that add up the integrand times the lengths with their weights."""
        k1 = self.k1
        self.at.scope["rows"] = 3 * k1
        lines = ["values = values.reshape(shape)"]
        if len(self.plan.variables) > 1:
            lines.append("values = values @ innermost")
        lines += [
            "length = length*weights",
            "factors = concatenate((length, abs(length), rounded*weights))",
            f"{''.join(f'p{row}, ' for row in range(3 * k1))} = (values.reshape(rows, -1) @ factors.T).tolist()",
        ]

        def ruled(part: int, by: int, d: int) -> str:  # (f g)' = f' g + f g'
            first, at = f"p{part * k1}", by * k1
            return f"{first}[{at}]" if not d else f"p{part * k1 + d}[{at}] + {first}[{at + d}]"

        for d in range(k1):
            lines += [
                f"n{d} = {ruled(0, 0, d)}",
                f"g{d} = {ruled(2, 1, d)}",
                f"e{d} = ({ruled(1, 1, d)}) + ({ruled(2, 2, d)}) + {SUMMED!r}*g{d}",
            ]
        return lines


def _pattern(cell: FlatCell) -> Any:
    moving = tuple([0 if x is None else 1 if x.value == 1.0 else 2 for x in cell.t])
    return cell.e is not None or any(x is not None for x in cell.et), moving
