"""Kinks of builtins, and what jumps, outside of integrals, just at the parameters: both derivatives are told.

Owns `note_kink`. What an answer has is the derivative to one side, as the partial derivatives of the builtin choose it,
or as the condition falls. What a jump changes shows in the whole alone (`sides`).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from potto.core.terms import Branch, Prim, Term, function_of, prim, var
from potto.integrate.events import OneSidedDerivatives, TwoSided
from potto.kernels.cells import Array, Bools, Cell, Number
from potto.kernels.kinks import places
from potto.kernels.tape import Node
from potto.primitives import PRIMITIVES
from potto.runtime.evaluation.machine import Machine

ROUNDING = 1e-12  # what errors are taken for rounding, in the size of the arguments


def note_kink(
    machine: Machine, term: Prim | Branch, kinks: tuple[tuple[Any, Any], ...], args: tuple[Cell, ...]
) -> None:
    """Note the derivatives of a builtin to both sides where one of its kinks is at 0, to rounding; and that there is a
    jump where one is."""
    near = [np.abs(u) <= np.minimum(e, ROUNDING * sum(np.abs(arg.v) for arg in args)) for u, e in kinks]
    number = next((i for i, there in enumerate(near) if np.any(there)), None)
    if number is None or machine.frozen:
        return
    if machine.taping:
        here = np.any(near, axis=0)
        nodes: list[Any] = [arg.t[0] for arg in args if arg.t]
        machine.record.taped += [(node, here) for node in nodes if isinstance(node, Node)]
    if isinstance(term, Branch) or PRIMITIVES[term.op].steps(*term.args):
        surface = term.surface if isinstance(term, Branch) else places(term)[number]
        return _note_jump(machine, surface, np.any(near, axis=0), args)
    cause = TwoSided("", places(term)[number], kink=True)
    if machine.record.again(cause):
        return
    (backward, before), (forward, beyond) = (_on_side(machine, term, args, side) for side in (-1, 1))
    differ = np.any(near, axis=0) & (backward != forward) & ~(np.isnan(backward) & np.isnan(forward))
    if differ.any():
        sides = (np.where(differ.any(axis=0), side, np.nan) for side in (backward, forward, before, beyond))
        machine.record.meet(OneSidedDerivatives(cause, *sides))


def _note_jump(machine: Machine, surface: Term, near: Bools, args: tuple[Cell, ...]) -> None:
    """Note where what is at a jump moves: derivatives that nobody knows by the jump alone."""
    tapes = machine.taping and any(arg.t[0] is not None for arg in args)
    rows = [
        _apart([x for arg in args if (x := arg.t[d]) is not None], machine.taping) for d in range(machine.directions)
    ]
    # The numbers may be the same for all that is asked at once, and move in as many ways, as for a Hessian.
    near = np.broadcast_to(near, np.broadcast_shapes(near.shape, *(np.shape(x) for row in rows for x in row)))
    moves = np.array([near & (tapes | np.any([np.broadcast_to(x != 0, near.shape) for x in row], axis=0))
                      if row else np.zeros_like(near) for row in rows])  # fmt: skip
    cause = TwoSided("", surface)
    if moves.any() and not machine.record.again(cause):
        unknown = np.where(moves, np.nan, 0.0)
        machine.record.meet(OneSidedDerivatives(cause, unknown, unknown, unknown, unknown))


def _apart(tangents: list[Number], taping: bool) -> list[Number]:
    """How what is at a jump moves: two numbers that are compared, and move alike, stay as they are to one another."""
    return [tangents[0] - tangents[1]] if len(tangents) == 2 and not taping else tangents


def _on_side(machine: Machine, term: Prim, args: tuple[Cell, ...], side: int) -> tuple[Array, Array]:
    """The tangents of a builtin on one side of its kinks and their errors, (directions, ...): by each argument that
    moves where tangents are written on a tape."""
    moving = [i for i, arg in enumerate(args) if arg.t and arg.t[0] is not None] if machine.taping else []
    directions = len(moving) if machine.taping else machine.directions
    if machine.taping:
        units = [tuple(1.0 if i == j else None for j in moving) for i in range(len(args))]
        args = tuple(Cell(arg.v, arg.e, row) for arg, row in zip(args, units, strict=True))
    names = [f"#{i:04}" for i in range(len(args))]
    beside = machine.changed(side=side, root=False, taping=False, directions=directions)
    value = beside.run(function_of(prim(term.op, *map(var, names))), list(args), None)
    assert isinstance(value, Cell)
    shape = np.broadcast_shapes(*(np.shape(x) for x in (value.v, *value.t, *value.et) if x is not None))
    found = [[np.broadcast_to(0.0 if x is None else x, shape) for x in part] for part in (value.t, value.et)]
    return np.array(found[0]), np.array(found[1] or np.zeros((directions, *shape)))
