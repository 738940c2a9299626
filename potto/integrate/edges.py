"""Surfaces that lie on a bound: the derivative there is one-sided.

Owns `report_edges`. A cut counts only strictly inside the bounds, so a jump on a bound gives no boundary term; what
the derivative is on either side of the present parameters follows from the integrand with that surface flipped.
"""

from __future__ import annotations

from contextlib import nullcontext
from typing import TYPE_CHECKING

import numpy as np

from potto.core.printer import format_term
from potto.integrate.cuts import Cuts, Edge, as_array
from potto.integrate.pieces import Evaluator, Sided, Sums, gather, still, take
from potto.integrate.plan import LevelPlan
from potto.kernels.cells import Array, Cell, Ints, Mask, Value

if TYPE_CHECKING:
    from potto.integrate.levels import Iteration


def report_edges(
    parent: Iteration, number: int, level: LevelPlan, cuts: Cuts, env: dict[str, Value], sides: dict[int, Mask],
    sums: Sums, machine: Evaluator,
) -> None:  # fmt: skip
    """Say of surfaces on a bound what the derivative is on either side of the present parameters."""
    for edge in cuts.edges:
        if number and 2 * edge.owner.size < cuts.sign.size:
            continue  # single nodes of the variables further out: of measure zero
        flip, scale = across(parent, number, level, edge, env, sides, machine)
        speed = edge.bound_t - edge.root_t if edge.upper else edge.root_t - edge.bound_t
        surface = level.level.cuts[edge.cut].surface
        singular = ~np.isfinite(flip)[:, None, :] & (speed[None] != 0)
        if singular.any():  # what comes in as the surface leaves the bound, no value here tells
            sums.et[:, :, edge.owner] = np.where(singular, np.inf, sums.et[:, :, edge.owner])
            where = f"{format_term(surface)} = 0 lies on a bound of `{level.variable}`"
            machine.note_unfinished(f"{where}, and beyond it the integrand is not finite")
        # where the surface comes in as the parameters grow, the growing side has the extra stretch
        change = flip[:, None, :] * speed[None]
        matters = np.abs(change) > 1e-12 * (np.abs(sums.t[:, :, edge.owner]) + scale[:, None, :] + 1e-300)
        if not (matters & ~singular).any():
            continue
        inward = speed[None] > 0
        base = sums.t[:, :, edge.owner]
        forward = np.where(inward, base + change, base)
        backward = np.where(inward, base, base + change)
        told = tell(number, Sided(level.variable, surface), backward, forward, machine)
        sums.t[:, :, edge.owner] = base if told is None else told


def tell(number: int, what: Sided, backward: Array, forward: Array, machine: Evaluator) -> Array | None:
    """Note two derivatives that differ, or the one that is wanted, if one is."""
    if machine.side:
        return forward if machine.side > 0 else backward
    if number:
        machine.note_sided(what)
    else:
        machine.note_edge(what, backward, forward)
    return None


def across(
    parent: Iteration, number: int, level: LevelPlan, edge: Edge, env: dict[str, Value],
    sides: dict[int, Mask], machine: Evaluator,
) -> tuple[Array, Array]:  # fmt: skip
    """(F with the edge's surface flipped minus F as it is) at the bound, per component, and its size."""
    group = group_of(level, edge.cut)
    here, inner = around(level, edge.owner, edge.x, not edge.upper, env, sides, machine)
    frozen = machine.with_directions(0)
    with nullcontext() if machine.costs is None else machine.costs.apart():
        actual, _ = parent.inside(number, here, edge.owner.size, inner, frozen)
        flipped, _ = parent.inside(number, here, edge.owner.size, {**inner, group: ~np.asarray(inner[group])}, frozen)
    return flipped - actual, np.abs(actual) + np.abs(flipped)


def group_of(level: LevelPlan, cut: int) -> int:
    """The group whose side a cut of the level decides."""
    return level.decided[[i for i, c in enumerate(level.level.cuts) if c.decides].index(cut)]


def around(
    level: LevelPlan, owner: Ints, x: Array, above: bool, env: dict[str, Value], sides: dict[int, Mask],
    machine: Evaluator,
) -> tuple[dict[str, Value], dict[int, Mask]]:  # fmt: skip
    """The environment of some members at x, and the sides of all surfaces just above or just below it."""
    here = gather({n: still(v) for n, v in env.items()}, owner)
    here[level.variable] = Cell(x)
    step = 1e-7 * (1 + np.abs(x)) * (1 if above else -1)
    beside = {**here, level.variable: Cell(x + step)}
    inner: dict[int, Mask] = {g: take(m, owner) for g, m in sides.items()}
    if level.decided:
        at = {n: beside[n] for n in level.surfaces.params}
        values = machine.with_directions(0).evaluate(level.surfaces, at, None)
        assert isinstance(values, tuple)
        for g, value, turned in zip(level.decided, values, level.turned, strict=True):
            assert isinstance(value, Cell)
            side = as_array(value.v, owner.size) >= 0
            for outer in turned:
                side = side ^ np.logical_not(inner[outer])
            inner[g] = side
    return here, inner
