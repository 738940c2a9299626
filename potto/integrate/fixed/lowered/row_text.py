"""The rows of a frame between which cells lie, as LLVM reads it.

Owns `RowText`. A frame may have a dozen rows, each with its tangents and their rounding, and a cell lies between two of
them. Cells between the same rows come one after the other, so that a row that takes much is worked out only for blocks
in which one is asked for.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import compress

from potto.core.terms import Lam, function_of
from potto.integrate.fixed.lowered.formula_text import Env, FormulaText, Symbol
from potto.integrate.fixed.straight import StraightIntegral
from potto.integrate.pieces import Evaluator
from potto.kernels.native.straight import Packed, packed
from potto.kernels.native.vectors import LANES

# From how many operations on a row is worth a branch, and going through memory: about as many as that takes.
WORTH = 48
# Of a cell the value and its rounding, the tangents and theirs.
Parts = list[str | None]


class RowText(FormulaText):
    """Writes rows. rows: per variable the numbers of those between which the cells of a block lie."""

    rows: Sequence[tuple[str, str]]

    def __init__(self, plan: StraightIntegral, machine: Evaluator, lanes: int = LANES) -> None:
        super().__init__(machine, lanes)
        self.plan = plan

    def asked_for(self, i: int, env: Env, machine: Evaluator) -> list[Symbol]:
        """The lower and the upper ends of stretches of variable i."""
        functions = [function_of(item) for item in self.plan.items[i]]
        apart = [self.apart(function, env, machine) for function in functions]
        if not any(apart):
            cells = self.evaluated(self.plan.frames[i], env, machine)
            return [self.chosen(cells, row, range(len(cells))) for row in self.rows[i]]
        long = list(compress(range(len(functions)), apart))
        short = [n for n in range(len(functions)) if n not in long]
        cells = [cell for n in short for cell in self.evaluated(functions[n], env, machine)]
        found = [
            self.parts(self.chosen(cells, row, short) if short else Symbol(self.zero, None, (), ()))
            for row in self.rows[i]
        ]
        for n in long:
            found = self.with_row(n, functions[n], i, env, machine, found)
        return [self.cell(parts) for parts in found]

    def with_row(
        self, n: int, function: Lam, i: int, env: Env, machine: Evaluator, before: list[Parts]
    ) -> list[Parts]:  # fmt: skip
        """What has been found of both ends, or this row where a cell of the block asks for it."""
        at, masks = self.at, [self.at.same(row, n) for row in self.rows[i]]
        there = [part is not None for part in self.parts(*packed(self.kernel(function, env, machine).result))]
        known = [[x or self.zero if x or new else None for x, new in zip(parts, there, strict=True)]
                 for parts in before]  # fmt: skip
        at.begin("1", at.any(at.apply("or", *masks)))
        (cell,) = self.evaluated(function, self.again(function.params, env), machine)
        own = [self.plain(part) or self.zero for part in self.parts(cell)]
        found = [at.apply("select", mask, new, x) for mask, parts in zip(masks, known, strict=True)
                 for new, x in zip(own, parts, strict=True) if x]  # fmt: skip
        values = iter(at.end_or([x for parts in known for x in parts if x], found))
        return [[next(values) if x else None for x in parts] for parts in known]

    def apart(self, function: Lam, env: Env, machine: Evaluator) -> bool:
        """Whether a row is worked out only where it is asked for: not where it is known further out, for all blocks."""
        here = any(self.made_here(part) for name in function.params for part in self.parts(env[name]))
        return here and len(self.kernel(function, env, machine).operations) >= WORTH

    def made_here(self, part: str | None) -> bool:
        """Whether a part is known in the innermost loop, and not further out."""
        return part is not None and self.at.depths.get(part, 0) == self.at.depth

    def again(self, names: Sequence[str], env: Env) -> Env:
        """The numbers that are known in the loop around this one by other names: what is made of them stays here."""
        around, known = self.at.depth - 1, dict[str, str]()

        def part(x: str | None) -> str | None:
            if x is None or self.at.depths.get(x, 0) != around:
                return x
            if x not in known:
                known[x] = self.at.again(x)
            return known[x]

        return {name: self.cell([part(x) for x in self.parts(env[name])]) for name in names}

    def parts(self, cell: Symbol | Packed) -> Parts:
        """The parts of a cell, with those that may be left out where there are none."""
        nothing = (None,) * (self.k1 - 1)
        return [cell.v, cell.e, *(cell.t or nothing), *(cell.et or nothing)]

    def cell(self, parts: Parts) -> Symbol:
        v, e, *rest = parts
        assert v is not None
        return Symbol(v, e, tuple(rest[: self.k1 - 1]), tuple(rest[self.k1 - 1 :]))

    def chosen(self, cells: Sequence[Symbol], row: str, numbers: Sequence[int]) -> Symbol:
        """Of some rows, which have these numbers, the one that is asked for; the first one if it is none of them."""
        masks = [self.at.same(row, number) for number in numbers[1:]]

        def part(parts: Sequence[str | None]) -> str | None:
            if len(set(parts)) == 1:
                return self.plain(parts[0])
            found, *others = (self.plain(x) or self.zero for x in parts)
            for mask, other in zip(masks, others, strict=True):
                found = self.at.apply("select", mask, other, found)
            return found

        return self.cell(list(map(part, zip(*map(self.parts, cells), strict=True))))
