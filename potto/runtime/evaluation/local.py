"""Derivatives by what something depends on itself: fewer directions inside of it, and the chain rule outside.

Owns `locally` and `taped`. An integral costs a part of its value more for every direction that it carries. So it is
given as few as there are numbers that move in its environment, or directions in which these move: a triangle of a mesh
carries the twelve of its own, whatever else moves. Then all triangles have one kernel and one plan as well.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from potto.kernels.cells import Cell, Env, Number, Value, all_cells, map_cells, pad
from potto.kernels.sweeps import pushed
from potto.kernels.tape import Node, every_leaf, leaves, linear
from potto.runtime.evaluation.machine import Machine

Run = Callable[[Machine, Env], Value]


def locally(machine: Machine, env: Env, run: Run) -> Value:
    """What `run` gives for a machine and an environment, in as few directions as there have to be."""
    if not machine.root or machine.side or (machine.directions < 2 and not machine.taping):
        return run(machine, env)
    moving = _moving(env)
    if machine.taping:
        return _off_the_tape(machine, env, moving, run)
    k = machine.directions
    along = sorted({d for cell in moving for d, t in enumerate(cell.t) if t is not None})
    found: Value | None = None
    if len(moving) < len(along):
        found = _by_each(machine, env, moving, run)
        if found is not None:
            return map_cells(found, lambda cell: _chained(cell, moving, k))
    elif len(along) < k:
        chosen = {id(c): (tuple(c.t[d] for d in along), tuple(c.et[d] for d in along)) for c in moving}
        found = _quietly(machine.with_directions(len(along)), _with_tangents(env, chosen, len(along)), run)
        if found is not None:
            return map_cells(found, lambda cell: _spread(cell, along, k))
    return run(machine, env)


def _off_the_tape(machine: Machine, env: Env, moving: Sequence[Cell], run: Run) -> Value:
    """The same, as nodes of the tape: by the numbers of the environment, or by what they are made of where that is
    less, or where what is met is to be told of the directions that were asked for: once, where these are the same."""
    moving = [cell for cell in moving if isinstance(cell.t[0], Node)]  # others have a tangent that is 0
    nodes: list[Any] = [cell.t[0] for cell in moving]
    if not nodes:
        return pad(run(machine.with_directions(0), _with_tangents(env, {}, 0)), 1)
    few = leaves(nodes)
    if few != frozenset(nodes) and (few is None or len(few) >= len(nodes)):
        found = _by_each(machine, env, moving, run)
        if found is not None:
            return map_cells(found, lambda cell: taped(cell, nodes))
    order = sorted(every_leaf(nodes) if few is None else few, key=lambda node: node.number)
    pushes = [tuple(zip(*row, strict=True)) for row in pushed(nodes, order)]
    tangents = {id(cell): (row[0], row[1]) for cell, row in zip(moving, pushes, strict=True)}
    met = machine.record.met, len(machine.record.edges)
    value = run(machine.with_directions(len(order)), _with_tangents(env, tangents, len(order)))
    here = machine.record.sided(*met)
    machine.record.taped += [(node, here) for node in order if np.any(here)]
    return map_cells(value, lambda cell: taped(cell, order))


def _by_each(machine: Machine, env: Env, moving: Sequence[Cell], run: Run) -> Value | None:
    """The value with its derivatives by each number that moves."""
    m = len(moving)
    units = {id(cell): ((None,) * i + (1.0,) + (None,) * (m - i - 1), (None,) * m) for i, cell in enumerate(moving)}
    return _quietly(machine.with_directions(m), _with_tangents(env, units, m), run)


def taped(cell: Cell, nodes: Sequence[Node]) -> Cell:
    """The number with its tangents, by these nodes, as one of the tape."""
    edges = [edge for edge in zip(cell.t, nodes, cell.et, strict=bool(cell.t)) if edge[0] is not None]
    return Cell(cell.v, cell.e, (linear(*edges) if edges else None,))


def _spread(cell: Cell, along: Sequence[int], k: int) -> Cell:
    """The number with its tangents in the directions that these are of so many."""
    t: list[Number | None] = [None] * k
    et: list[Number | None] = [None] * k
    for d, slope, error in zip(along, cell.t, cell.et, strict=bool(cell.t)):
        t[d], et[d] = slope, error
    return Cell(cell.v, cell.e, tuple(t), tuple(et))


def _chained(cell: Cell, moving: Sequence[Cell], k: int) -> Cell:
    """The number with derivatives by others that move as one that moves with them."""
    t: list[Number | None] = []
    et: list[Number | None] = []
    slopes: list[Any] = [slope for slope in zip(cell.t, cell.et, moving, strict=bool(cell.t)) if slope[0] is not None]
    for d in range(k):
        steps = [(slope, off, x.t[d], x.et[d]) for slope, off, x in slopes]
        terms = [slope * tangent for slope, _, tangent, _ in steps if tangent is not None]
        bounds = [abs(slope) * error for slope, _, _, error in steps if error is not None]
        bounds += [off * abs(tangent) for _, off, tangent, _ in steps if off is not None and tangent is not None]
        t.append(sum(terms) if terms else None)
        et.append(sum(bounds) if bounds else None)
    return Cell(cell.v, cell.e, tuple(t), tuple(et))


def _moving(env: Env) -> list[Cell]:
    """The numbers that move, each once."""
    cells = {id(cell): cell for value in env.values() for cell in all_cells(value)}
    return [cell for cell in cells.values() if any(t is not None for t in cell.t)]


def _with_tangents(env: Env, tangents: dict[int, tuple[Any, Any]], directions: int) -> Env:
    """The environment in which these numbers, by identity, have these tangents and errors of them, the others none."""
    none = (None,) * directions

    def change(cell: Cell) -> Cell:
        return Cell(cell.v, cell.e, *tangents.get(id(cell), (none, none)))

    return {name: map_cells(value, change) for name, value in env.items()}


def _quietly(machine: Machine, env: Env, run: Run) -> Value | None:
    """What `run` gives, unless it has something to say of directions, which are not those that were asked for, or there
    is no derivative in one of them."""
    record, apart = machine.record, machine.apart()
    kept = dict(record.shortfalls), list(record.edges), record.allowed
    value = run(apart, env)
    if len(record.edges) == len(kept[1]) and all(map(_smooth, all_cells(value))):
        for event, members in apart.events:
            machine.note(event, members)
        return value
    record.shortfalls, record.edges, record.allowed = kept
    return None


def _smooth(cell: Cell) -> bool:
    """Whether all derivatives are numbers, where the value is one."""
    known = np.isfinite(cell.v)
    return all(t is None or bool(np.all(np.isfinite(t) | ~known)) for t in cell.t)
