"""Products, least and largest of many: folds whose steps do not look at the state, all at once.

Owns `reduced`. Where several numbers are the least or the greatest, to each side another one goes on to be it: the
answer has the derivative to one side, and outside of integrals both are told, as of `min` and `max` of two.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from msgspec import Struct

from potto.core.terms import Fold, Prim, Term, Var, const, lam, mul
from potto.core.walking import substitute
from potto.integrate.events import OneSidedDerivatives, TwoSided
from potto.kernels.cells import Array, Cell, Env, Number, Value, batch_shape
from potto.kernels.tape import Node, Untaped, linear
from potto.kernels.whole import LARGEST, UNIT_ROUNDOFF, looked_through
from potto.primitives import PRIMITIVES
from potto.runtime.evaluation.derivatives.kinks import ROUNDING
from potto.runtime.evaluation.machine import Machine

MOST_POINTS = 1 << 24


def reduced(machine: Machine, term: Fold, places: range, start: Value, env: Env) -> Value | None:
    """The product, the least or the largest of all; None for a fold that is none of these, or no number."""
    step = _step(term)
    if step is None or not isinstance(start, Cell):
        return None
    op, element = step
    shape = batch_shape((start, *env.values()))
    if len(places) * int(np.prod(shape)) > MOST_POINTS:
        return None
    body = lam(tuple(sorted(element.free | {term.variable})), element)
    index = np.arange(places.start, places.stop, dtype=float).reshape(-1, *(1,) * len(shape))
    here = {**env, term.variable: Cell(index, None, (None,) * machine.directions)}
    with looked_through():
        value = machine.run(body, [here[name] for name in body.params], None)
    if not isinstance(value, Cell):
        return None
    count = (len(places), *shape)
    numbers = np.concatenate([_row(start.v, (1, *shape)), _row(value.v, count)])
    found = _made(machine, op, numbers, _REDUCTIONS[op](numbers), start, value)
    ties = None if op == "mul" else _ties(machine, op, numbers, start, value, found)
    if ties is None:
        return found
    if machine.root and not machine.side and not machine.frozen and ties.differ.any():
        terms = [substitute(element, {term.variable: const(places[at - 1])}) if at else term.start for at in ties.two]
        _note(machine, ties, TwoSided("", PRIMITIVES[op].kinks(*terms)[0], kink=True))
    return ties.on_side(found, machine.side) if machine.side else found


def _step(term: Fold) -> tuple[str, Term] | None:
    """The operation and what it takes in besides the state, of a step `op(state, …)`."""
    body = term.body
    if not isinstance(body, Prim) or body.op not in _REDUCTIONS:
        return None
    others = [arg for arg in body.args if not (isinstance(arg, Var) and arg.name == term.state)]
    if len(others) != len(body.args) - 1 or any(term.state in arg.free for arg in others):
        return None
    if body.op != "mul":
        ordered = isinstance(body.args[0], Var) and body.args[0].name == term.state
        return (body.op, others[0]) if len(others) == 1 and ordered else None
    return body.op, mul(*others)


def _row(x: Any, shape: tuple[int, ...]) -> Any:
    return np.broadcast_to(np.asarray(x, dtype=float), shape)


def _of_others(numbers: Array) -> Array:
    """For each factor the product of the others; nothing is divided by what may be 0."""
    one = np.ones((1, *numbers.shape[1:]))
    before: Array = np.cumprod(np.concatenate([one, numbers[:-1]]), axis=0)
    after = np.cumprod(np.concatenate([one, numbers[:0:-1]]), axis=0)[::-1]
    found: Array = before * after
    return found


def _taken(numbers: Array, at: Any) -> Array:
    """1 for the number that is taken, 0 for the others."""
    places = np.arange(len(numbers), dtype=float).reshape(-1, *(1,) * (numbers.ndim - 1))
    return np.where(places == at, 1.0, 0.0)


class _Ties(Struct, frozen=True):
    """Numbers that are the least or the greatest together: which, where there are several, and for each direction all
    tangents, those to both sides and how far off these may be."""

    near: Any
    several: Any
    slopes: Array
    backward: Array
    before: Array
    forward: Array
    beyond: Array

    @property
    def differ(self) -> Array:
        """Where, in which direction, it matters which of them goes on."""
        found: Array = self.several & (self.backward != self.forward)
        return found

    @property
    def two(self) -> list[int]:
        """Two that go different ways, for the first member for which it matters."""
        d, *member = np.argwhere(self.differ)[0]
        equal = np.flatnonzero(self.near[:, *member])
        slopes = self.slopes[d][equal, *member]
        return sorted((int(equal[slopes.argmin()]), int(equal[slopes.argmax()])))

    def on_side(self, found: Cell, side: int) -> Cell:
        """The number with its tangents to one side."""
        chosen, off = (self.backward, self.before) if side < 0 else (self.forward, self.beyond)
        t, et = list(found.t), list(found.et)
        for d, (tangent, error) in enumerate(zip(found.t, found.et, strict=True)):
            if tangent is not None:
                t[d] = _plain(np.where(self.several, chosen[d], tangent))
                et[d] = _plain(np.where(self.several, off[d], 0.0 if error is None else error))
        return Cell(found.v, found.e, tuple(t), tuple(et))


def _ties(machine: Machine, op: str, numbers: Array, start: Cell, value: Cell, found: Cell) -> _Ties | None:
    """Where several numbers are it, to rounding, of which some move. Raises Untaped: sides are those of directions."""
    if all(x is None for x in (*start.t, *value.t)):
        return None
    off = _both(start.e, value.e, numbers) + (0.0 if found.e is None else found.e)
    near = np.abs(numbers - found.v) <= np.minimum(off, ROUNDING * (np.abs(numbers) + np.abs(found.v)))
    several = near.sum(axis=0) > 1
    if not several.any():
        return None
    if machine.taping:
        raise Untaped
    each = range(machine.directions)
    slopes = np.array([_both(_at(start.t, d), _at(value.t, d), numbers) for d in each])
    wrong = np.array([_both(_at(start.et, d), _at(value.et, d), numbers) for d in each])
    least = _bounded(lambda x: np.where(near, x, np.inf).min(axis=1), slopes, wrong)
    most = _bounded(lambda x: np.where(near, x, -np.inf).max(axis=1), slopes, wrong)
    return _Ties(near, several, slopes, *least, *most) if op == "max" else _Ties(near, several, slopes, *most, *least)


def _bounded(extreme: Callable[[Array], Array], numbers: Array, wrong: Array) -> tuple[Array, Array]:
    """The least or the greatest of numbers, and how far off it may be as they are."""
    found = extreme(numbers)
    return found, np.maximum(extreme(numbers + wrong) - found, found - extreme(numbers - wrong))


def _at(parts: tuple[Number | None, ...], direction: int) -> Any:
    return parts[direction] if parts else None


def _note(machine: Machine, ties: _Ties, cause: TwoSided) -> None:
    """Tell both derivatives."""
    if machine.record.again(cause):
        return
    where = ties.differ.any(axis=0)
    sides = (np.where(where, side, np.nan) for side in (ties.backward, ties.forward, ties.before, ties.beyond))
    machine.record.meet(OneSidedDerivatives(cause, *sides))


_REDUCTIONS: dict[str, Callable[[Array], Array]] = {
    "mul": _of_others,
    "min": lambda numbers: _taken(numbers, np.argmin(numbers, axis=0)),
    "max": lambda numbers: _taken(numbers, np.argmax(numbers, axis=0)),
}


def _made(machine: Machine, op: str, numbers: Array, slopes: Array, start: Cell, value: Cell) -> Cell:
    whole = np.prod(numbers, axis=0) if op == "mul" else getattr(np, op)(numbers, axis=0)
    sizes, count = np.abs(slopes), len(numbers)
    e = _total(sizes, start.e, value.e, numbers)
    relative: Number = 0.0
    if op == "mul":
        integral = np.all(np.rint(numbers) == numbers, axis=0)
        relative = np.where(integral & (sizes <= LARGEST), 0.0, 2 * count * UNIT_ROUNDOFF)
        exact = integral & (np.abs(whole) <= LARGEST) | (whole == 0)
        e = e + np.where(exact, 0.0, count * UNIT_ROUNDOFF * np.abs(whole))
    if machine.taping:
        return Cell(_plain(whole), _plain(e), (_tape(slopes, relative * sizes, start, value),))
    t: list[Any] = []
    et: list[Any] = []
    for d in range(machine.directions):
        first = start.t[d] if start.t else None
        rest = value.t[d] if value.t else None
        if first is None and rest is None:
            t.append(None)
            et.append(None)
            continue
        t.append(_plain(_total(slopes, first, rest, numbers)))
        off = _total(sizes, start.et[d] if start.et else None, value.et[d] if value.et else None, numbers)
        off = off + _total(relative * sizes, _abs(first), _abs(rest), numbers)
        et.append(_plain(off + _bent(op, numbers, start, value, first, rest)))
    return Cell(_plain(whole), _plain(e), tuple(t), tuple(et))


def _bent(op: str, numbers: Array, start: Cell, value: Cell, first: Any, rest: Any) -> Any:
    """How far off tangents of a product are since its factors are: d|a b| for each two of them."""
    e = _both(start.e, value.e, numbers)
    if op != "mul" or not np.any(e):
        return 0.0
    size, tangent = np.abs(numbers), np.abs(_both(first, rest, numbers))
    # Products with e of one and the tangent of another in place of them: the coefficient of ab in ∏(x + a e + b t).
    plain, with_e, with_t, both = (np.ones(numbers.shape[1:]) * x for x in (1.0, 0.0, 0.0, 0.0))
    for x, a, b in zip(size, e, tangent, strict=True):
        both = both * x + with_e * b + with_t * a
        with_e, with_t, plain = with_e * x + plain * a, with_t * x + plain * b, plain * x
    return both


def _abs(x: Any) -> Any:
    return None if x is None else np.abs(x)


def _both(first: Any, rest: Any, numbers: Array) -> Array:
    """A part of the start and of all elements, 0 where it is missing."""
    one = _row(0.0 if first is None else first, (1, *numbers.shape[1:]))
    return np.concatenate([one, _row(0.0 if rest is None else rest, (len(numbers) - 1, *numbers.shape[1:]))])


def _total(slopes: Array, first: Any, rest: Any, numbers: Array) -> Any:
    if first is None and rest is None:
        return np.zeros(numbers.shape[1:])
    part = _both(first, rest, numbers)
    return np.where((part == 0) | (slopes == 0), 0.0, slopes * part).sum(axis=0)


def _tape(slopes: Array, off: Array, start: Cell, value: Cell) -> Any:
    rest = linear((slopes[1:], value.t[0] if value.t else None, off[1:]))
    if isinstance(rest, Node):
        rest = np.add.reduce(np.broadcast_to(rest, slopes[1:].shape), axis=0)
    found = linear((_plain(slopes[0]), start.t[0] if start.t else None, _plain(off[0])), (1.0, rest, None))
    return found if isinstance(found, Node) else None


def _plain(x: Number) -> Number:
    return x if np.ndim(x) else float(x)
