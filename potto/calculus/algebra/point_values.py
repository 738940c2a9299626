"""Values of terms at points, in plain Python numbers: for checks that symbols cannot decide.

Owns `sample_value` and the points. Nothing here integrates or runs a program: a term is evaluated as it stands, and
whatever is not a number there is nan.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator, Mapping, Sequence

from potto.calculus.algebra.floats import FLOATS
from potto.core.terms import Term, Var, children, postorder_by


def sample_value(term: Term, point: Mapping[str, float], known: dict[Term, float] | None = None) -> float:
    """The value of a number-valued term at a point; nan where it is not defined or cannot be told.

    known: the values there of terms that were met before.
    """
    values = {} if known is None else known
    for node in postorder_by(term, lambda node: () if node in values else children(node)):
        if node not in values:
            values[node] = point.get(node.name, math.nan) if isinstance(node, Var) else FLOATS.node(node, {}, values)
    return values[term]


def points(
    names: Sequence[str], box: Mapping[str, tuple[float, float]], count: int, seed: int = 1
) -> Iterator[dict[str, float]]:
    """Random points, the same ones each time; a variable without bounds between -3 and 3."""
    source = random.Random(seed)
    for _ in range(count):
        yield {n: source.uniform(*_finite(box.get(n, (-3.0, 3.0)))) for n in names}


def _finite(bounds: tuple[float, float]) -> tuple[float, float]:
    lo, hi = min(bounds), max(bounds)
    if math.isinf(lo) and math.isinf(hi):
        return -3.0, 3.0
    return (hi - 6.0 if math.isinf(lo) else lo), (lo + 6.0 if math.isinf(hi) else hi)
