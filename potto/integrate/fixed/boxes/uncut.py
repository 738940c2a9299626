"""Members of a batch that nothing cuts, integrated.

Owns `uncut`. Such a box needs no cuts and has no boundary terms: what is integrated over it is the integrand on those
sides on which it lies (`sides`), by a product rule: by numpy (`tensor_product`), or by machine code (`lowered.boxes`),
which finds out about the sides on its way, or is told them where that takes more than arithmetic. What is not shown to
be smooth and accurate here is left to the ways that cut.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext

import numpy as np

from potto.calculus.differentiation.loops import vanishes
from potto.core.terms import Term, function_of, tuple_
from potto.integrate.columns import distinct
from potto.integrate.fixed.boxes.sides import UNCLEAR, Box, Sides, sides_of
from potto.integrate.fixed.boxes.tensor_product import ORDERS, BoxIntegrand, integrated
from potto.integrate.fixed.lowered.box_text import Look
from potto.integrate.fixed.lowered.boxes import LoweredBoxes, Passed
from potto.integrate.fixed.lowered.cells import places_of
from potto.integrate.pieces import Evaluator, Sums, Uncut, gather
from potto.kernels.cells import Cell, Ints, Value

# On how many surfaces sides may depend, and how many integrands there may be, for machine code that decides by itself.
MOST_SIDES, MOST_FACES = 4, 4


def uncut(box: Box, machine: Evaluator, env: dict[str, Value], batch: int) -> Uncut | None:
    """What can be integrated of a batch; None if that is nothing."""
    able = machine.backend != "numpy" and all(isinstance(env.get(name), Cell) for name in box.names)
    ways = _deciding(box, machine, env) if able else ()
    passed = _passed(ways, machine, env, batch)
    if passed is not None:
        return _with_left(box, passed, machine, env, batch)
    with _rented(ways):
        return _by_faces(box, machine, env, batch, able and not ways)


# Face by face


def _by_faces(
    box: Box, machine: Evaluator, env: dict[str, Value], batch: int, able: bool
) -> Uncut | None:  # fmt: skip
    """The same by sides that numpy finds; able: whether machine code may integrate."""
    sides = sides_of(box, machine, env, batch)
    if sides is None:
        return None
    sums: Sums | None = None
    done = np.zeros(batch, dtype=bool)
    for code in distinct(sides.codes).tolist():
        if code == UNCLEAR:
            continue
        face, there = box.face(code), sides.codes == code
        if vanishes(face.term):
            done |= there
            continue
        index = np.flatnonzero(there)
        for where, found in _of_face(box, face, sides, machine, env, index, able):
            if sums is None:
                sums = Sums.zeros(found.v.shape[0], machine.directions, batch)
            done[where] = True
            sums.put(where, found)
    if not done.any():
        return None
    return Uncut(Sums.zeros(1, machine.directions, batch) if sums is None else sums, np.nonzero(~done)[0])


def _of_face(
    box: Box, face: BoxIntegrand, sides: Sides, machine: Evaluator, env: dict[str, Value], index: Ints, able: bool
) -> Iterator[tuple[Ints, Sums]]:  # fmt: skip
    """The integrals over those boxes with one integrand that a rule does for."""
    ways = _told(box, face, machine, env) if able else ()
    passed = _passed(ways, machine, gather(env, index), index.size) if ways else None
    if passed is not None:
        done = np.delete(np.arange(index.size), passed.left)
        yield index[done], passed.sums.pick(done)
        index = index[passed.left]
        ways = ()
    if index.size:
        with _rented(ways):
            yield from list(integrated(face, machine, env, index, sides.bounds))


# By machine code


def _deciding(box: Box, machine: Evaluator, env: dict[str, Value]) -> tuple[LoweredBoxes, ...]:
    """The functions that decide about sides by themselves; none where there is too much to be told apart, or more than
    arithmetic to be enclosed."""
    if len(box.places) > MOST_SIDES:
        return ()
    faces: dict[Term, list[int]] = {}
    for code in range(1 << len(box.places)):
        term = box.face(code).term
        if not vanishes(term):
            faces.setdefault(term, []).append(code)
    if len(faces) > MOST_FACES:
        return ()
    lit = tuple((term, tuple(codes)) for term, codes in faces.items())
    look = Look(box.plan, box.bounds, box.corners, box.surfaces[box.flat :], box.places, lit)
    return _ways(box, machine, env, look, [box.face(codes[0]) for codes in faces.values()])


def _told(box: Box, face: BoxIntegrand, machine: Evaluator, env: dict[str, Value]) -> tuple[LoweredBoxes, ...]:
    """The functions for one integrand, which are told where it is one."""
    look = Look(box.plan, box.bounds, function_of(tuple_(())), (), (), ((face.term, ()),), True)
    return _ways(box, machine, env, look, [face])


def _ways(
    box: Box, machine: Evaluator, env: dict[str, Value], look: Look, faces: Sequence[BoxIntegrand]
) -> tuple[LoweredBoxes, ...]:  # fmt: skip
    """The functions that go for it, with few nodes and with more; none where that is impossible."""
    places = places_of(box.names, env)
    key = look, machine.directions, places
    ways: tuple[LoweredBoxes, ...] | None = box.plan.lowered.get(key)
    if ways is None:
        nodes = list(zip(*(face.exact for face in faces), strict=True)) or [(1,)] * len(box.variables)
        exact = tuple(None not in own for own in nodes)
        orders = dict.fromkeys(tuple(max(n or order for n in own) for own in nodes) for order in ORDERS)
        ways = box.plan.lowered[key] = tuple(LoweredBoxes(look, places, order, exact) for order in orders)
    return () if ways[0].promotion.impossible else ways


def _passed(ways: Sequence[LoweredBoxes], machine: Evaluator, env: dict[str, Value], batch: int) -> Passed | None:
    """What functions make of a batch: the next one of those for whom the rule before had too few nodes."""
    passed: Passed | None = None
    for way in ways:
        function = way.function(machine)
        if function is None:
            break
        if passed is None:
            passed = way.run(function, machine, env, batch)
        else:
            index = passed.left
            again = way.run(function, machine, gather(env, index), index.size)
            passed.sums.put(index, again.sums)
            passed.left, passed.precise = index[again.left], passed.precise and again.precise
        if not passed.left.size:
            break
    return passed


def _with_left(
    box: Box, passed: Passed, machine: Evaluator, env: dict[str, Value], batch: int
) -> Uncut | None:  # fmt: skip
    """What functions have made of a batch, and what numpy makes of what they left."""
    sums, left, precise = passed.sums, passed.left, passed.precise
    if left.size:
        found = _by_faces(box, machine, gather(env, left), left.size, False)
        if found is not None:
            sums, precise = sums.with_members(left, found.sums), False
            left = left[found.rest]
    rest = np.sort(np.concatenate((passed.crossed, left)))
    return Uncut(sums, rest, precise) if rest.size < batch else None


def _rented(ways: Sequence[LoweredBoxes]) -> AbstractContextManager[None]:
    """Where the time is counted that numpy takes for what a function could do."""
    return ways[0].promotion.by_numpy() if ways else nullcontext()
