"""What panels ask of the integral that they are part of.

Owns `Iterated`, and `siblings`.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from potto.integrate.panels.magnitude import Extent
from potto.integrate.pieces import Evaluator, Sums
from potto.integrate.plan import Plan
from potto.kernels.cells import Array, Ints, Mask, Value


class Iterated(Protocol):
    """One plan being evaluated by one machine. order: the number of nodes per piece to start with.

    tracked: whether the integrand brings its rounding along at every node. degrees: by variable that of what is
    integrated over it, if it is a polynomial. peaked: the variables at ends of whose segments the integrand has peaks.
    """

    @property
    def plan(self) -> Plan: ...
    @property
    def machine(self) -> Evaluator: ...
    @property
    def order(self) -> int: ...
    @property
    def tracked(self) -> bool: ...
    @property
    def peaked(self) -> set[int]: ...
    @property
    def degrees(self) -> tuple[int | None, ...]: ...
    @property
    def extent(self) -> Extent | None: ...
    @property
    def reads(self) -> frozenset[str]: ...
    def across(self, face: Any) -> Iterated: ...
    def body(self, env: dict[str, Value], sides: dict[int, Mask], machine: Evaluator) -> Value: ...
    def run(
        self, number: int, env: dict[str, Value], batch: int, sides: dict[int, Mask], machine: Evaluator,
        root: Ints | None = None, slack: Array | None = None, looks: bool = False,
    ) -> Sums: ...  # fmt: skip
    def inside(
        self, number: int, env: dict[str, Value], batch: int, sides: dict[int, Mask], machine: Evaluator,
        root: Ints | None = None,
    ) -> tuple[Array, Array]: ...  # fmt: skip


def siblings(scale: Array, root: Ints | None) -> Array:
    """The largest magnitude among the members that are added up further out: what their accuracy is measured by."""
    if root is None:
        return np.full(scale.shape, scale.max()) if scale.size else scale
    most = np.zeros(int(root.max()) + 1 if root.size else 0)
    np.maximum.at(most, root, scale)
    return most[root]
