"""The nodes of product rules along each variable, and what comes of cells at them.

Owns `Axis`, `axis` and `Raw`, which the ways to work out a rule (`nodes`, `lowered`) share.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from msgspec import Struct

from potto.integrate.columns import distinct
from potto.integrate.rules.gauss import gauss
from potto.kernels.cells import Array, Bools

MEAN = (0,)  # the coefficient that is enough where a rule is exact
ENDS = 2  # of a stretch, behind those nodes at which rounding is followed


class Axis(Struct, frozen=True, eq=False):
    """Nodes of a variable on [0, 1]; what machine code is told of them is found by the axis itself (`lowered.cells`).

    nodes: known to 2 half places of 1. speeds: how fast they run, as they crowd at turning points, where roots are.
    transform: (n, rows) from numbers at the nodes to the Legendre coefficients that are asked for, the first of which
    is the mean. few, few_speeds: those nodes at which rounding is followed, then both ends.
    """

    nodes: Array
    speeds: Array
    weights: Array
    transform: Array
    few: Array
    few_speeds: Array


@lru_cache(maxsize=512)
def axis(order: int, asked: tuple[int, ...], turning: tuple[bool, bool], several: bool) -> Axis:
    """The nodes of a Gauss rule. asked: the numbers of coefficients. turning: whether an end of the stretch is like a
    square root. several: rounding is followed at few nodes."""
    rule = gauss(order)
    u = rule.nodes
    match turning:
        case (True, True):
            nodes, speeds = np.sin(0.5 * math.pi * u) ** 2, 0.5 * math.pi * np.sin(math.pi * u)
        case (True, False):
            nodes, speeds = u * u, 2 * u
        case (False, True):
            nodes, speeds = u * (2 - u), 2 * (1 - u)
        case _:
            nodes, speeds = u, np.ones_like(u)
    picked = distinct([0, order // 2, order - 1]) if several else np.arange(order)
    transform = np.ascontiguousarray(rule.transform[:, asked])
    few, few_speeds = np.append(nodes[picked], (0.0, 1.0)), np.append(speeds[picked], _at_ends(turning))
    return Axis(nodes, speeds, rule.weights, transform, few, few_speeds)


def _at_ends(turning: tuple[bool, bool]) -> Sequence[float]:
    """How fast nodes run at both ends: not at all at turning points, twice as fast opposite of one."""
    low, high = turning
    return 0.0 if low else 1.0 + high, 0.0 if high else 1.0 + low


class Raw(Struct, frozen=True):
    """Sums over the nodes of cells, for each of M members.

    number: (1 + k, M), the integrals. coefficients: per variable (1 + k, M, rows), the sizes of the coefficients asked
    for along it, integrated over the others. most, off: (1 + k, M), what is added up, and what rounding puts it off, by
    the nodes at which that is followed. clear: (M,) whether no cut comes between, and nothing near by is singular.
    corners, largest: (M,) the largest value at the ends of stretches, and at nodes. Of a rule that is known to do
    nothing is told: no coefficients, and None for these.
    """

    number: Array
    coefficients: list[Array]
    most: Array
    off: Array
    clear: Bools
    corners: Array | None = None
    largest: Array | None = None
