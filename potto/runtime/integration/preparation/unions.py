"""Integrals over unions of which parts lie apart for all members: as sums.

Owns `in_parts`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from potto.calculus.surfaces.case_split import by_extremes
from potto.core.terms import Integral, Term
from potto.integrate.decomposition.disjoint import Box, Union, union
from potto.kernels.cells import Cell, Value
from potto.kernels.making import making
from potto.runtime.evaluation.machine import Machine
from potto.runtime.evaluation.reach import Reach, kept


def in_parts(machine: Machine, term: Integral, env: Mapping[str, Value]) -> Term:
    """An equal sum for these parameters, or the same integral: also where costs are told of its conditions as they are
    written, and where samples are drawn, of which the whole needs no more than a part."""
    if not machine.root or machine.settings.sampled or machine.costs is not None:
        return term
    with making:
        found = _union(term, machine.linker.reach)
    if found is None:
        return term
    box: Box = {name: _ends(value) for name, value in env.items() if isinstance(value, Cell)}
    whole = found.at(box)
    return term if whole is found.term else whole


@kept
def _union(term: Integral, reach: Reach) -> Union | None:
    return union(by_extremes(term))


def _ends(cell: Cell) -> tuple[float, float]:
    """Between which numbers those of all members lie, with their errors."""
    off: Any = 0.0 if cell.e is None else cell.e
    return float(np.min(cell.v - off)), float(np.max(cell.v + off))
