"""Members of a batch that nothing cuts, integrated.

Owns `uncut`. Such a box needs no cuts and has no boundary terms: what is integrated over it is the integrand on those
sides on which it lies (`boxes`), by a product rule: by numpy (`tensor_product`), or by machine code (`lowered_boxes`),
which finds out about the sides on its way, or is told them where that takes more than arithmetic. What is not shown to
be smooth and accurate here is left to the ways that cut.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext

import numpy as np

from potto.core.terms import Const, Term, Tuple, children
from potto.integrate.columns import distinct
from potto.integrate.fixed.box_text import CROSSED, DARK, DONE, Look
from potto.integrate.fixed.boxes import UNCLEAR, Box, Sides, sides_of
from potto.integrate.fixed.lowered import places_of
from potto.integrate.fixed.lowered_boxes import LoweredBoxes, Passed
from potto.integrate.fixed.tensor_product import ORDERS, integrated
from potto.integrate.pieces import Evaluator, Sums, gather
from potto.kernels.cells import Array, Cell, Ints, Value

# On how many surfaces sides may depend, and how many integrands there may be, for machine code that decides by itself.
MOST_SIDES, MOST_FACES = 4, 4


def uncut(box: Box, machine: Evaluator, env: dict[str, Value], batch: int) -> tuple[Sums, Ints] | None:
    """The sums of a batch, and the members that were not integrated here, whose sums are 0; None if none were."""
    able = machine.backend != "numpy" and all(map(_exact, map(env.get, box.names)))
    ways = _ways(box, machine, env, _looking(box)) if able else ()
    passed = _passed(ways, machine, env, batch, ())
    if passed is not None:
        return _with_left(box, passed, machine, env, batch)
    with _rented(ways):
        sides = sides_of(box, machine, env, batch)
        if sides is None:
            return None
        if able and not ways:
            look, column = _told(box, sides.codes)
            ways = _ways(box, machine, env, look)
            passed = _passed(ways, machine, env, batch, (column,))
            if passed is not None:
                return _with_left(box, passed, machine, env, batch)
            with _rented(ways):
                return _by_numpy(box, sides, machine, env, batch)
        return _by_numpy(box, sides, machine, env, batch)


def dark(face: Term) -> bool:
    """Whether an integrand is 0."""
    return all(map(dark, children(face))) if isinstance(face, Tuple) else isinstance(face, Const) and face.value == 0


# By numpy


def _by_numpy(
    box: Box, sides: Sides, machine: Evaluator, env: dict[str, Value], batch: int
) -> tuple[Sums, Ints] | None:  # fmt: skip
    sums: Sums | None = None
    done = np.zeros(batch, dtype=bool)
    for code in distinct(sides.codes).tolist():
        if code == UNCLEAR:
            continue
        face, index = box.face(code), np.nonzero(sides.codes == code)[0]
        if dark(face.term):
            done[index] = True
            continue
        for where, found in integrated(face, machine, env, index, sides.low, sides.high):
            if sums is None:
                sums = Sums.zeros(found.v.shape[0], machine.directions, batch)
            done[where] = True
            sums.put(where, found)
    if not done.any():
        return None
    return Sums.zeros(1, machine.directions, batch) if sums is None else sums, np.nonzero(~done)[0]


# By machine code


def _exact(value: Value | None) -> bool:
    """Whether a value is a number without an error."""
    return isinstance(value, Cell) and value.e is None and not any(x is not None for x in value.et)


def _looking(box: Box) -> Look | None:
    """What a function looks for that decides about sides by itself; None where there is too much to be told apart."""
    known: dict[str, Look | None] = box.plan.lowered
    if "look" not in known:
        codes = range(1 << len(box.places)) if len(box.places) <= MOST_SIDES else ()
        known["look"] = _look(box, codes, False) if codes else None
    return known["look"]


def _look(box: Box, codes: Sequence[int], told: bool) -> Look | None:
    faces: dict[Term, list[int]] = {}
    for code in codes:
        term = box.face(code).term
        if not dark(term):
            faces.setdefault(term, []).append(code)
    if len(faces) > MOST_FACES:
        return None
    flat, curved = box.corners, box.surfaces[box.flat :]
    lit = tuple((term, tuple(those)) for term, those in faces.items())
    return Look(box.plan, box.bounds, flat, curved, box.places, lit, told)


def _told(box: Box, codes: Ints) -> tuple[Look | None, Array]:
    """What a function looks for that is told the sides, and the column that tells them."""
    column = np.full(codes.size, float(CROSSED))
    clear = [code for code in distinct(codes).tolist() if code != UNCLEAR]
    look = _look(box, clear, True)
    if look is not None:
        column[codes != UNCLEAR] = DARK
        for number, (_, those) in enumerate(look.faces):
            column[np.isin(codes, those)] = DONE + number
    return look, column


def _ways(box: Box, machine: Evaluator, env: dict[str, Value], look: Look | None) -> tuple[LoweredBoxes, ...]:
    """The functions that go for it, with few nodes and with more; none where that is impossible."""
    if look is None:
        return ()
    places = places_of(box.names, env)
    key = look, machine.directions, places
    ways: tuple[LoweredBoxes, ...] | None = box.plan.lowered.get(key)
    if ways is None:
        nodes = list(zip(*(box.face(codes[0]).exact for _, codes in look.faces), strict=True))
        exact = tuple(None not in own for own in nodes or [(1,)] * len(box.variables))
        orders = dict.fromkeys(
            tuple(max(n or order for n in own) for own in nodes) or (1,) * len(box.variables) for order in ORDERS
        )
        ways = box.plan.lowered[key] = tuple(LoweredBoxes(look, places, order, exact) for order in orders)
    return () if ways[0].promotion.impossible else ways


def _passed(
    ways: Sequence[LoweredBoxes], machine: Evaluator, env: dict[str, Value], batch: int, sides: Sequence[Array]
) -> Passed | None:  # fmt: skip
    """What functions make of a batch: the next one of those for whom the rule before had too few nodes."""
    passed: Passed | None = None
    for way in ways:
        function = way.function(machine)
        if function is None:
            break
        if passed is None:
            passed = way.run(function, machine, env, batch, sides)
        else:
            index = passed.left
            again = way.run(function, machine, gather(env, index), index.size, [column[index] for column in sides])
            passed.sums.put(index, again.sums)
            passed.state[index] = again.state
        if not passed.left.size:
            break
    return passed


def _with_left(
    box: Box, passed: Passed, machine: Evaluator, env: dict[str, Value], batch: int
) -> tuple[Sums, Ints] | None:  # fmt: skip
    """What functions have made of a batch, and what numpy makes of what they left."""
    sums, done, left = passed.sums, passed.done, passed.left
    if left.size:
        here = gather(env, left)
        sides = sides_of(box, machine, here, left.size)
        found = None if sides is None else _by_numpy(box, sides, machine, here, left.size)
        if found is not None:
            sums = sums.with_members(left, found[0])
            done[left] = True
            done[left[found[1]]] = False
    return (sums, np.nonzero(~done)[0]) if done.any() else None


def _rented(ways: Sequence[LoweredBoxes]) -> AbstractContextManager[None]:
    """Where the time is counted that numpy takes for what a function could do."""
    return ways[0].promotion.by_numpy() if ways else nullcontext()
