"""The steps of a fold as linear maps around the states that were met, for all steps at once.

Owns `steps_at_once`, `States` and `along`. The state of n steps is a batch of n members: the step's kernel gives its
derivatives by the state and what it rounds off, and `steps` adds up what that does to the end. On a tape the end is a
sum over the steps of what each takes from elsewhere, times what the steps after it make of that: the cost is that of
the steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import Any

import numpy as np
from msgspec import Struct

from potto.core.terms import Fold, Lam
from potto.integrate.pieces import resting
from potto.kernels.cells import Array, Cell, Env, Rows, Value, all_cells, batch_shape, pad, pattern
from potto.kernels.tape import Node, linear
from potto.kernels.whole import UNIT_ROUNDOFF, looked_through
from potto.runtime.evaluation.folds.steps import carried, spread
from potto.runtime.evaluation.machine import Machine

MOST_NUMBERS = 24  # of a state
MOST_WORK = 1 << 22  # numbers of states, cubed, times steps: matrices are multiplied

Shape = tuple[int, ...]


def steps_at_once(machine: Machine, term: Fold, start: Value, env: Env) -> int:
    """How many steps can be looked at all at once, with few numbers, which no integral is in; 0 if none can."""
    kinds = _sizes(start)
    if kinds is None or machine.linker.inexact(term.body) or any(map(_closed, env.values())):
        return 0
    d, members = sum(kinds), int(np.prod(batch_shape((start, *env.values()))))
    return MOST_WORK // (d**3 * members) if 0 < d <= MOST_NUMBERS and members else 0


def _closed(value: Value) -> bool:
    """Whether a value may integrate when it is called."""
    if isinstance(value, Cell | Rows):
        return False
    if isinstance(value, tuple | list):
        return any(map(_closed, value))
    return bool(getattr(value, "inexact", True))


def _sizes(value: Value) -> list[int] | None:
    """How many numbers each cell of a state has; None for what is not a state of numbers."""
    if isinstance(value, Cell):
        return [1]
    if isinstance(value, tuple):
        parts = [_sizes(item) for item in value]
        return None if any(part is None for part in parts) else [n for part in parts if part for n in part]
    if isinstance(value, Rows):
        inner = _sizes(value.item)
        return None if inner is None else [n * value.size for n in inner]
    return None


def _form(value: Value) -> Any:
    """What states have in common."""
    if isinstance(value, Cell):
        return 0
    if isinstance(value, tuple):
        return tuple(map(_form, value))
    return (value.size, _form(value.item)) if isinstance(value, Rows) else None


class States(Struct, frozen=True):
    """The states that were met. met: each number of them as each step began, (*inner, steps, *batch), where `inner` are
    the axes of places in arrays around it. last: the state after the last step."""

    met: list[Array]
    last: Value
    shape: Shape

    @classmethod
    def told(cls, states: Sequence[Value], start: Value, env: Env) -> States | None:
        """Of all states, one by one; None where they are not of one kind."""
        if any(_form(state) != _form(start) for state in (states[1], states[-1])):
            return None
        shape = batch_shape((states[-1], start, *env.values()))
        cells = [[state] if isinstance(state, Cell) else all_cells(state) for state in states[:-1]]
        inner = enumerate(_inner(start, ()))
        return cls([_along([row[c].v for row in cells], own, shape) for c, own in inner], states[-1], shape)

    @classmethod
    def counted(cls, numbers: Sequence[Array], start: Value, env: Env) -> States:
        """Of numbers at the beginning and after each step, (1 + steps, *batch), of a state without arrays."""
        shape = batch_shape((start, *env.values()))
        wide = [x.reshape(len(x), *(1,) * (len(shape) + 1 - x.ndim), *x.shape[1:]) for x in numbers]
        met = [np.broadcast_to(x, (len(x), *shape)) for x in wide]
        last = iter([Cell(x[-1] if shape else float(x[-1])) for x in met])
        return cls([x[:-1] for x in met], _with_cells(start, last), shape)


def along(machine: Machine, term: Fold, body: Lam, places: range, states: States, start: Value, env: Env) -> Value:
    """The last state with all that it carries."""
    if not (machine.rounding or machine.directions):
        return states.last
    return _Steps(machine, term, body, places, states, start, env).ended()


class _Steps:
    """The steps of one fold. inner: of each cell of the state, the axes of places in arrays around it."""

    def __init__(
        self, machine: Machine, term: Fold, body: Lam, places: range, states: States, start: Value, env: Env
    ) -> None:
        self.machine, self.term, self.body, self.start, self.env = machine, term, body, start, env
        self.shape, self.met, self.last = states.shape, states.met, states.last
        self.inner = _inner(start, ())
        self.count = len(places)
        wide = (self.count, *(1,) * len(self.shape))
        self.place = np.arange(places.start, places.stop, dtype=float).reshape(wide)
        self.d = sum(int(np.prod(inner)) for inner in self.inner)

    def ended(self) -> Value:
        machine, k = self.machine, 0 if self.machine.taping else self.machine.directions
        met = machine.record.met
        begun = self.rows(all_cells(self.start), "e")[0]
        values = self.linearized(None)
        bounds = spread(values.by_state, values.off, begun)
        if not machine.directions:
            return self.made(bounds[-1], [], [])
        slopes = self.linearized(bounds[:-1])
        if machine.taping:
            return self.taped(bounds[-1], values, slopes, met)
        first = np.stack([self.rows(all_cells(self.start), "t", d)[0] for d in range(k)], axis=-1)
        begun = np.stack([self.rows(all_cells(self.start), "et", d)[0] for d in range(k)], axis=-1)
        t = carried(values.by_state, values.by_rest, first)
        size = np.abs(t[:-1])
        rounding = (self.d + 4) * UNIT_ROUNDOFF
        local = slopes.off_by_state @ size + slopes.off_by_rest
        local += rounding * (np.abs(values.by_state) @ size + np.abs(values.by_rest))
        off = spread(values.by_state[..., None, :, :], np.moveaxis(local, -1, -2), np.moveaxis(begun, -1, -2))
        moves = values.moves or [False] * k
        moves = [m or any(cell.t[d] is not None for cell in all_cells(pad(self.start, k))) for d, m in enumerate(moves)]
        ends = [t[-1][..., d] if moves[d] else None for d in range(k)]
        return self.made(bounds[-1], ends, [off[-1][..., d, :] if moves[d] else None for d in range(k)])

    def linearized(self, off: Array | None) -> _Linear:
        """The derivatives of all steps by the state and along the directions that are carried, and how far off they
        are, where states are off by so much."""
        k = 0 if self.machine.taping else self.machine.directions
        total = k + self.d
        record = self.machine.record
        if not k and record.second:  # no derivative is asked for: surfaces that are met say nothing
            record = copy(record)
            record.second = False
        machine = self.machine.changed(directions=total, taping=False, rounding=True, record=record)
        here = {name: pad(value, total) for name, value in self.rest().items()}
        here[self.term.variable] = Cell(self.place, None, (None,) * total)
        here[self.term.state] = self.state(off, k, total)
        with looked_through():
            value = _called(machine, self.body, here)
        self.machine.record.met = max(self.machine.record.met, record.met)
        cells = all_cells(value)
        local = self.rows(cells, "e", many=True)[0]
        t = [self.rows(cells, "t", d, many=True) for d in range(total)]
        et = [self.rows(cells, "et", d, many=True)[0] for d in range(total)]
        slopes, errors = np.stack([x for x, _ in t], axis=-1), np.stack(et, axis=-1)
        return _Linear(slopes[..., k:], slopes[..., :k], local, errors[..., k:], errors[..., :k],
                       [there for _, there in t[:k]])  # fmt: skip

    def rest(self) -> Env:
        if not self.machine.taping:
            return self.env
        return {name: resting(value) for name, value in self.env.items()}

    def state(self, off: Array | None, k: int, total: int) -> Value:
        """The states of all steps, each of their numbers moving in a direction of its own."""
        cells, at = [], 0
        for inner, met in zip(self.inner, self.met, strict=True):
            size = int(np.prod(inner))
            t: list[Any] = [None] * total
            for place in range(size):
                t[k + at + place] = np.eye(size)[place].reshape(inner) if inner else 1.0
            e = None if off is None else self.shaped(off[..., at : at + size], inner)
            cells.append(Cell(met, e, tuple(t)))
            at += size
        return _with_cells(self.start, iter(cells))

    def shaped(self, numbers: Array, inner: Shape) -> Array:
        """Numbers (..., size) as (*inner, ...)."""
        return np.moveaxis(numbers, -1, 0).reshape((*inner, *numbers.shape[:-1]))

    def rows(self, cells: Sequence[Cell], side: str, d: int | None = None, many: bool = False) -> tuple[Array, bool]:
        """One part of all numbers of a state as (steps, *batch, d), and whether some have it."""
        batch = (self.count, *self.shape) if many else self.shape
        found, there = [], False
        for inner, cell in zip(self.inner, cells, strict=True):
            part = getattr(cell, side)
            if d is not None:
                part = part[d] if part else None
            there = there or part is not None
            full = _wide(0.0 if part is None else part, inner, batch)
            found.append(np.moveaxis(full.reshape((-1, *batch)), 0, -1))
        return np.concatenate(found, axis=-1), there

    def made(self, e: Array, t: Sequence[Any], et: Sequence[Any]) -> Value:
        """The last state with these errors and tangents."""
        cells, at = [], 0
        for inner, cell in zip(self.inner, all_cells(self.last), strict=True):
            size = int(np.prod(inner))

            def part(x: Any, at: int = at, size: int = size, inner: Shape = inner) -> Any:
                found = None if x is None else self.shaped(x[..., at : at + size], inner)
                return float(found) if found is not None and not found.ndim else found

            cells.append(Cell(cell.v, part(e), tuple(map(part, t)), tuple(map(part, et))))
            at += size
        return _with_cells(self.last, iter(cells))

    # On a tape

    def taped(self, e: Array, values: _Linear, slopes: _Linear, met: int) -> Value:
        """The last state, as what the steps took from elsewhere times what the steps after them made of it. met: how
        often something with two derivatives was met before them: what states move with may be any of all that."""
        here = {name: pad(value, 1) for name, value in self.env.items()}
        here[self.term.variable] = Cell(self.place, None, (None,))
        here[self.term.state] = _with_cells(self.start, iter([Cell(met, None, (None,)) for met in self.met]))
        taken = _called(self.machine.changed(rounding=False), self.body, here)
        back = np.swapaxes(values.by_state, -1, -2)[::-1]
        whole = np.swapaxes(carried(back, None, np.eye(self.d))[::-1], -1, -2)  # of each step, the ends by its start
        sizes = np.abs(whole[1:]) @ slopes.off_by_state
        sizes += (self.d + 4) * UNIT_ROUNDOFF * (np.abs(whole[1:]) @ np.abs(values.by_state))
        zero = np.zeros((*self.shape, self.d, self.d))
        off = spread(back[..., None, :, :], sizes[::-1], zero)[::-1]
        nodes = self._numbers(taken, self.count), self._numbers(self.start, None)
        if self.machine.record.met > met:
            self.machine.record.taped += [(x, True) for own in nodes for x in own if isinstance(x, Node)]
        ends = []
        for c in range(self.d):
            edges = [(whole[1:, ..., c, i], node, off[1:, ..., c, i]) for i, node in enumerate(nodes[0])]
            through = linear(*edges)
            first = [(_plain(whole[0, ..., c, i]), node, _plain(off[0, ..., c, i])) for i, node in enumerate(nodes[1])]
            if isinstance(through, Node):
                first.append((1.0, np.add.reduce(np.broadcast_to(through, (self.count, *self.shape)), axis=0), None))
            ends.append(linear(*first))
        return self._with_nodes(self.made(e, [], []), ends)

    def _numbers(self, value: Value, count: int | None) -> list[Any]:
        """The nodes of all numbers of a state, which may be in arrays."""
        batch = self.shape if count is None else (count, *self.shape)
        found: list[Any] = []
        for inner, cell in zip(self.inner, all_cells(value), strict=True):
            node = cell.t[0] if cell.t else None
            if not isinstance(node, Node):
                found += [None] * int(np.prod(inner))
            elif not inner:
                found.append(node)
            else:
                wide = _wide(node, inner, batch)
                found += [wide[place] for place in np.ndindex(*inner)]
        return found

    def _with_nodes(self, value: Value, nodes: Sequence[Any]) -> Value:
        cells, at = [], 0
        for inner, cell in zip(self.inner, all_cells(value), strict=True):
            size = int(np.prod(inner))
            own = list(nodes[at : at + size])
            node: Any = own[0] if not inner else None
            if inner and any(isinstance(x, Node) for x in own):
                node = np.reshape(np.stack([np.broadcast_to(x, self.shape) for x in own]), (*inner, *self.shape))
            own_node: Any = node if isinstance(node, Node) else None
            cells.append(Cell(cell.v, cell.e, (own_node,)))
            at += size
        return _with_cells(value, iter(cells))


class _Linear:
    """What steps are to first order: matrices (steps, *batch, d, d or directions), and how far off.

    off: what each step's values are off by themselves. moves: in which directions something moves but the state.
    """

    def __init__(
        self, by_state: Array, by_rest: Array, off: Array, off_by_state: Array, off_by_rest: Array, moves: list[bool]
    ) -> None:
        self.by_state, self.by_rest, self.off = by_state, by_rest, off
        self.off_by_state, self.off_by_rest, self.moves = off_by_state, off_by_rest, moves


def _along(numbers: Sequence[Any], inner: Shape, shape: Shape) -> Array:
    """What a number was in all steps: (*inner, steps, *batch)."""
    if not (inner or shape):
        return np.array(numbers, dtype=float)
    return np.stack([_wide(x, inner, shape) for x in numbers], axis=len(inner))


def _called(machine: Machine, body: Lam, here: Env) -> Value:
    """The value of a step's kernel by numpy, whatever the backend: steps are few, and their rounding is looked at."""
    args = [here[name] for name in body.params]
    return machine.kernel(body, tuple([pattern(a, machine.directions) for a in args])).run(machine, None, *args)


def _plain(x: Any) -> Any:
    return float(x) if not np.ndim(x) else x


def _inner(value: Value, around: Shape) -> list[Shape]:
    if isinstance(value, tuple):
        return [inner for item in value for inner in _inner(item, around)]
    return _inner(value.item, (*around, value.size)) if isinstance(value, Rows) else [around]


def _with_cells(value: Value, cells: Any) -> Value:
    """The same kind of value of other cells."""
    if isinstance(value, tuple):
        return tuple([_with_cells(item, cells) for item in value])
    return Rows(_with_cells(value.item, cells), value.size) if isinstance(value, Rows) else next(cells)


def _wide(part: Any, inner: Shape, batch: Shape) -> Any:
    """A part with places in front and a batch behind, of which some axes may be missing."""
    ndim = np.ndim(part)
    if ndim > len(inner) and ndim < len(inner) + len(batch):
        own = np.shape(part)[len(inner) :]
        part = np.reshape(part, (*np.shape(part)[: len(inner)], *(1,) * (len(batch) - len(own)), *own))
    elif ndim == len(inner) and ndim:
        part = np.reshape(part, (*np.shape(part), *(1,) * len(batch)))
    return np.broadcast_to(part, (*inner, *batch))
