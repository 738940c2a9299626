"""The text of a product rule of which it is known beforehand that its nodes are enough, as LLVM reads it.

Owns `MeanText`. Where a proof says what a rule leaves out, or the integrand is a polynomial, no Legendre coefficients
are asked for but the means: what the nodes amount to is added up in registers, in half the time of `rule_text`.
"""

from __future__ import annotations

from collections.abc import Sequence

from potto.integrate.fixed.lowered.formula_text import Dual, Env, ParameterPlace
from potto.integrate.fixed.lowered.rule_text import RuleText


class MeanText(RuleText):
    """Writes the function, which is told the same as that with coefficients.

    Of rows of results the last says whether a cell is clear.
    """

    beside = 1

    def text(self, places: Sequence[ParameterPlace]) -> str:
        self.begin()
        here = self.cells(places)
        number = self.mean(0, here)
        sizes, off = self.rounded(here)
        for row, value in enumerate([*number, *sizes, *off, self.at.load(self.clear)]):
            self.at.store(value or self.zero, self.place(row))
        return self.end()

    def mean(self, i: int, env: Env) -> Dual:
        """The integral over variable i and those further in. No end of a stretch is like a square root here, so that
        nodes run as they are."""
        at = self.at
        n, _, _, nodes, _, _, transform, _, _ = self.tables[i]
        low, width, *_ = self.stretch(i, env, self.machine)
        j, sums = at.adding(n, self.k1)
        inner = {**env, self.plan.variables[i]: self.node(low, width, at.constant(nodes, j))}
        if i + 1 == len(self.plan.variables):
            (cell,) = self.evaluated(self.face, inner, self.machine)
            values: Dual = [cell.v, *map(self.plain, cell.t)]
        else:
            values = self.mean(i + 1, inner)
        weight = at.constant(transform, j)
        after = [None if x is None else at.apply("muladd", weight, x, y) for x, y in zip(values, sums, strict=True)]
        at.end(*after)
        return self.product(after, width)
