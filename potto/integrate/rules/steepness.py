"""By how much exponents change: an exponential may have a layer at an end of a range that no node sees.

Owns `exponents_in`, `change` and STEEPEST. What an exponent changes by at the most is read off an enclosure of it, so
that an integrand needs no program for its exponents unless one of them is steep.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from potto.calculus.solving.enclosable import enclosable
from potto.core.terms import Prim, Term, postorder
from potto.integrate.rules.intervals import Interval, enclosure
from potto.primitives import PRIMITIVES

# By how much an exponent may change over a range whose nodes see what it is the exponent of: twelve nodes don't resolve
# more than half of that, and as long as it is not a few times more than this they see it.
STEEPEST = 64.0


@lru_cache(maxsize=1024)
def exponents_in(term: Term) -> tuple[Term, ...]:
    """The exponents in an integrand that vary, as far as they can be enclosed; not those in integrals within it."""
    found = (
        exponent
        for node in postorder(term)
        if isinstance(node, Prim)
        for exponent in PRIMITIVES[node.op].exponents(*node.args)
        if exponent.free and exponent.free <= term.free and enclosable(exponent)
    )
    return tuple(dict.fromkeys(found))


def change(exponents: Sequence[Term], box: Mapping[str, Interval]) -> Any:
    """By how much at most the one that changes most does, for variables in a box, whose ends may be arrays."""
    known = tuple(exponent for exponent in exponents if exponent.free <= box.keys())
    with np.errstate(invalid="ignore"):
        changes = [high - low for low, high in enclosure(known, box)]
    most: Any = 0.0
    for each in changes:
        most = np.fmax(most, each)
    return most
