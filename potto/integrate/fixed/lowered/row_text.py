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
        known: list[Symbol | Packed] = [*cells]
        for n in long:
            known += packed(self.kernel(functions[n], env, machine).result)
        there = [any(part is not None for part in parts) for parts in zip(*map(self.parts, known), strict=True)]
        rooms = [[self.at.room(1) if any_of_it else None for any_of_it in there] for _ in self.rows[i]]
        for own, row in zip(rooms, self.rows[i], strict=True):
            self.put(own, self.chosen(cells, row, short) if short else Symbol(self.zero, None, (), ()))
        noted = self.noted([functions[n] for n in long], env)
        for n in long:
            self.worked_out(n, functions[n], rooms, i, env, noted, machine)
        return [self.taken(own) for own in rooms]

    def apart(self, function: Lam, env: Env, machine: Evaluator) -> bool:
        """Whether a row is worked out only where it is asked for: not where it is known further out, for all blocks."""
        here = any(self.made_here(part) for name in function.params for part in self.parts(env[name]))
        return here and len(self.kernel(function, env, machine).operations) >= WORTH

    def made_here(self, part: str | None) -> bool:
        """Whether a part is known in the innermost loop, and not further out."""
        return part is not None and self.at.depths.get(part, 0) == self.at.depth

    def noted(self, functions: Sequence[Lam], env: Env) -> dict[str, str]:
        """Where the parts are put that functions read: what is made of what is read in a block stays in that block."""
        names = dict.fromkeys(name for function in functions for name in function.params)
        parts = dict.fromkeys(part for name in names for part in self.parts(env[name]) if self.made_here(part))
        noted = {part: self.at.room(1) for part in parts if part is not None}
        for part, room in noted.items():
            self.at.store(part, room)
        return noted

    def worked_out(
        self, n: int, function: Lam, rooms: Sequence[Sequence[str | None]], i: int, env: Env, noted: dict[str, str],
        machine: Evaluator,
    ) -> None:  # fmt: skip
        """Put a row for those cells of the block that ask for it, if there are any."""
        at, masks = self.at, [self.at.same(row, n) for row in self.rows[i]]
        at.begin("1", at.any(at.apply("or", *masks)))
        known: dict[str, str] = {}

        def read(part: str | None) -> str | None:
            if part is None or part not in noted:
                return part
            if part not in known:
                known[part] = at.load(noted[part])
            return known[part]

        def again(symbol: Symbol) -> Symbol:
            return Symbol(*map(read, (symbol.v, symbol.e)), *(tuple(map(read, x)) for x in (symbol.t, symbol.et)))  # type: ignore[arg-type]

        (cell,) = self.evaluated(function, {name: again(env[name]) for name in function.params}, machine)
        for own, mask in zip(rooms, masks, strict=True):
            self.put(own, cell, mask)
        at.end()

    def put(self, rooms: Sequence[str | None], cell: Symbol, mask: str | None = None) -> None:
        """Put the parts of a cell, for the members of a mask."""
        at = self.at
        for room, part in zip(rooms, self.parts(cell), strict=True):
            if room is not None:
                value = self.plain(part) or self.zero
                at.store(at.apply("select", mask, value, at.load(room)) if mask else value, room)

    def taken(self, rooms: Sequence[str | None]) -> Symbol:
        """The cell whose parts were put there."""
        v, e, *rest = (None if room is None else self.at.load(room) for room in rooms)
        assert v is not None
        return Symbol(v, e, tuple(rest[: len(rest) // 2]), tuple(rest[len(rest) // 2 :]))

    def parts(self, cell: Symbol | Packed) -> list[str | None]:
        """The parts of a cell, with those that may be left out where there are none."""
        nothing = (None,) * (self.k1 - 1)
        return [cell.v, cell.e, *(cell.t or nothing), *(cell.et or nothing)]

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

        v, e, *rest = map(part, zip(*map(self.parts, cells), strict=True))
        assert v is not None
        return Symbol(v, e, tuple(rest[: len(rest) // 2]), tuple(rest[len(rest) // 2 :]))
