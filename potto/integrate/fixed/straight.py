"""An integral between known cuts as a short program: bounds and cuts, the nodes between them, the integrand, sums.

Owns `StraightIntegral` and `straight`: the terms of an integral all of whose cuts are closed forms, and whose integrand
is one analytic formula on every cell between them. How many nodes do is proved in `a_priori` for one set of parameters,
and told by coefficients in `alike` for many.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from potto.core.terms import (
    Branch,
    Const,
    Integral,
    Lam,
    Term,
    children,
    function_of,
    postorder,
    rebuild,
    substitute,
    tuple_,
    var,
)
from potto.integrate.fixed.root_choices import choices_of, chosen, smooth
from potto.integrate.fixed.steps.stays import PRICE, Stay
from potto.integrate.fixed.steps.step_integral import StepIntegral, step_integral
from potto.integrate.levels import LevelPlan
from potto.integrate.rules.complex_enclosures import enclosable, known_to_discs
from potto.kernels.cells import Cell, Ints, Value

MOST_VARIABLES, MOST_CUTS, MOST_TERMS = 3, 13, 600
# Up to how many cuts cells are looked at one by one (`proved_sums`): with four a call at the same numbers takes 85 us
# so and 137 by step functions, with twelve 160 and 155; where numbers change 1.1 ms and 0.14, and 5 and 0.16.
FEW_CUTS = 4
MOST_CHOICES = 4  # each of which may double the number of plans, where step functions do not do without
AT_REST = "'rest"  # behind the name of a parameter: the number that it is
# Enough for the number of a row in a frame: two bounds, then cuts.
ROW_BITS = (MOST_CUTS + 1).bit_length()
RowNumbers = NDArray[np.integer[Any]]  # numbers of rows of frames
# How many times its rounding a surface must be away from 0, and cuts from each other.
CLEAR = 64.0


class StraightIntegral(Struct, frozen=True, dict=True, eq=False):
    """The terms of an integral for this way: frames per variable (bounds, then cuts), the integrand without calls.

    jumps: per variable the surfaces that it crosses, with the rows of the frame that are their places. turning: the
    rows where something is like a square root. shared: per variable the bounds that are cuts as well. surfaces: what
    the integrand's branches depend on, as one function to a tuple. names: parameters. regions: what was proved of the
    rules for cells in a region, None where nothing could be. settled: what is known where the cells are the same all
    over; None where they are not. texts: of sums that numpy adds up again and again. choices: what decides by the
    parameters alone which formulas cuts have, 1 or 0 each, as for a quadratic's roots; such a plan is of no use before
    they are `decided`. held: how they were. plans: theirs. steps: the same by step functions, if it has that form.
    stay: how long its parameters have stayed near each other; None where step functions do for any of them, or nothing
    else does.
    """

    variables: tuple[str, ...]
    frames: tuple[Lam, ...]
    jumps: tuple[tuple[tuple[Term, tuple[int, ...]], ...], ...]
    turning: tuple[frozenset[int], ...]
    shared: tuple[frozenset[int], ...]
    body: Term
    surfaces: Lam
    names: tuple[str, ...]
    faces: dict[tuple[bool, ...], Term] = {}
    regions: dict[Any, object] = {}
    lowered: dict[Any, Any] = {}
    alone: dict[Any, Any] = {}
    settled: dict[Any, Any] = {}
    texts: dict[Any, Any] = {}
    choices: Lam | None = None
    held: tuple[tuple[Term, bool], ...] = ()
    plans: dict[Any, StraightIntegral] = {}
    steps: StepIntegral | None = None
    stay: Stay | None = None

    @cached_property
    def items(self) -> tuple[tuple[Term, ...], ...]:
        return tuple(children(frame.body) for frame in self.frames)

    def face(self, sides: tuple[bool, ...]) -> Term:
        """The integrand on one side of each of these surfaces."""
        found = self.faces.get(sides)
        if found is None:
            side = dict(zip(children(self.surfaces.body), sides, strict=True))
            found = self.faces[sides] = on_sides(self.body, side)
        return found

    def going_on(self, i: int) -> list[int]:
        """The rows of variable i's frame at which nothing jumps, those first that turn.

        One may be another one of them once more, as is the fold of a disc whose sections leave a pixel just there.
        Between the two is nothing, to first order, and as what is further in goes on across them, less than rounding;
        where it jumps, however little lies between counts. The one that turns is the cut, as ends of stretches by it
        are like square roots.
        """
        jumping = {row for _, rows in self.jumps[i] for row in rows}
        rows = [row for row in range(2, len(self.items[i])) if row not in jumping]
        return sorted(rows, key=lambda row: row not in self.turning[i])

    def decided(self, sides: tuple[bool, ...]) -> StraightIntegral:
        """The plan with the formulas that cuts have where choices fall like this."""
        assert self.choices is not None
        found = self.plans.get(sides)
        if found is None:
            held = tuple(zip(children(self.choices.body), sides, strict=True))
            found = self.plans[sides] = _with_choices(self, held)
        return found

    def resting(self, surfaces: frozenset[Term]) -> StraightIntegral | None:
        """The plan with cuts that stay where they are, of surfaces whose motion counts elsewhere; None where cuts of
        others, or bounds, have the same formula, or where formulas are yet to be chosen. It asks for more parameters
        (`with_resting`)."""
        if not surfaces:
            return self
        if self.choices is not None or self.steps is not None:
            return None
        found = self.plans.get(surfaces)
        if found is None:
            rows = []
            for level, shared in zip(self.jumps, self.shared, strict=True):
                own = {row for surface, those in level if surface in surfaces for row in those}
                if own & shared.union(row for surface, those in level if surface not in surfaces for row in those):
                    return None
                rows.append(own)
            found = self.plans[surfaces] = _at_rest(self, rows) if any(rows) else self
        return found

    def with_resting(self, env: Mapping[str, Value]) -> dict[str, Value]:
        """An environment with the parameters as they are without their motion, those that `resting` cuts ask for."""
        asked = ((name, env.get(name.removesuffix(AT_REST))) for name in self.names if name not in env)
        return {**env, **{name: Cell(cell.v, cell.e) for name, cell in asked if isinstance(cell, Cell)}}


def straight(term: Integral, body: Term, levels: Sequence[LevelPlan]) -> StraightIntegral | None:
    """The terms for this way; None if a cut has no closed form, or the integrand no formula that can be bounded.

    body: the integrand with calls carried out.
    """
    if len(levels) > MOST_VARIABLES or any(_not_plain(level) for level in levels):
        return None
    most, nodes = max(len(level.rows) for level in levels), postorder(body)
    steps = step_integral(term, body) if most > FEW_CUTS else None
    few = len(nodes) <= MOST_TERMS and most <= MOST_CUTS  # so that cells may be looked at one by one
    if steps is None and not few:
        return None
    surfaces = tuple(dict.fromkeys(node.surface for node in nodes if isinstance(node, Branch)))
    cuts = [cut for level in levels for cut in children(level.frame.body)]
    choices = choices_of(cuts, (term, body), term.variables)
    analytic = all(map(enclosable, surfaces)) and smooth(cuts, choices) and _enclosable_sides(body, nodes)
    if not analytic or (steps is None and len(choices) > MOST_CHOICES):
        return None
    places, frames = zip(*(_distinct(level.frame) for level in levels), strict=True)
    free = body.free.union(*(frame.body.free for frame in frames)) - set(term.variables)
    jumps = tuple(_jumps(level, place) for level, place in zip(levels, places, strict=True))
    turning = tuple(
        frozenset(place[row] for row, (_, turns) in enumerate(level.rows, 2) if turns)
        for level, place in zip(levels, places, strict=True)
    )
    shared = tuple(frozenset(place[row] for row in place if row > 1) & {0, 1} for place in places)
    names = tuple(sorted(free))
    stay = (
        None if steps is None or not few or steps.degree is not None else Stay(names, PRICE * most, _reach(frames[0]))
    )
    return StraightIntegral(
        term.variables, frames, jumps, turning, shared, body, function_of(tuple_(surfaces)), names,
        choices=function_of(tuple_(choices)) if choices else None, steps=steps, stay=stay,
    )  # fmt: skip


def _reach(frame: Lam) -> float:
    """The length of what a variable runs over, if that is a number, else 0."""
    low, high, *_ = children(frame.body)
    return high.value - low.value if isinstance(low, Const) and isinstance(high, Const) else 0.0


def _jumps(level: LevelPlan, place: Mapping[int, int]) -> tuple[tuple[Term, tuple[int, ...]], ...]:
    """The surfaces at which the integrand jumps, with the rows of their cuts."""
    rows: dict[int, set[int]] = {}
    for row, (number, _) in enumerate(level.rows, 2):
        rows.setdefault(number, set()).add(place[row])
    return tuple((cut.surface, tuple(rows.get(number, ()))) for number, cut in enumerate(level.level.cuts) if cut.jumps)


def _with_choices(plan: StraightIntegral, held: tuple[tuple[Term, bool], ...]) -> StraightIntegral:
    """The plan where choices fall like this; formulas that are the same then are one cut."""
    places, frames = zip(*(_distinct(function_of(chosen(tuple_(items), dict(held)))) for items in plan.items),
                         strict=True)  # fmt: skip
    jumps = tuple(
        tuple((surface, tuple({place[row]: None for row in rows})) for surface, rows in level)
        for level, place in zip(plan.jumps, places, strict=True)
    )
    turning = tuple(frozenset(place[row] for row in rows) for rows, place in zip(plan.turning, places, strict=True))
    both = (frozenset(place[row] for row in place if row > 1) & {0, 1} for place in places)
    shared = tuple(own | more for own, more in zip(plan.shared, both, strict=True))
    free = plan.body.free.union(*(frame.body.free for frame in frames)) - set(plan.variables)
    names = tuple(sorted(free))
    return StraightIntegral(
        plan.variables, frames, jumps, turning, shared, plan.body, plan.surfaces, names, held=held, steps=plan.steps
    )


def _at_rest(plan: StraightIntegral, rows: Sequence[set[int]]) -> StraightIntegral:
    """The plan with some rows of each variable's frame as formulas of numbers that do not move."""
    twins: dict[str, Term] = {name: var(name + AT_REST) for name in plan.names}
    frames = tuple(
        function_of(tuple_([substitute(item, twins) if row in own else item for row, item in enumerate(items)]))
        for items, own in zip(plan.items, rows, strict=True)
    )
    free = plan.body.free.union(*(frame.body.free for frame in frames)) - set(plan.variables)
    return StraightIntegral(
        plan.variables, frames, plan.jumps, plan.turning, plan.shared, plan.body, plan.surfaces, tuple(sorted(free))
    )


def rows_between(between: Ints, variables: int) -> RowNumbers:
    """The rows of the frames between which cells lie, (variables, 2, N), by numbers with a digit of ROW_BITS for each,
    the first one in front."""
    rows = np.empty((2 * variables, between.size), dtype=np.uint8)
    for n, row in enumerate(rows):
        row[:] = between >> row_shift(n, variables) & (1 << ROW_BITS) - 1
    return rows.reshape(variables, 2, -1)


def between_rows(rows: Iterable[tuple[int, int]]) -> int:
    """The number that tells these rows, the lower and the upper end of each variable."""
    number = 0
    for row in itertools.chain.from_iterable(rows):
        number = number << ROW_BITS | row
    return number


def in_rows(between: Ints, variables: int) -> Ints:
    """Places of such numbers in their order, so that cells between the same rows are neighbours."""
    few = 2 * variables * ROW_BITS <= np.iinfo(np.uint16).bits  # these are sorted in one pass
    return np.argsort(between.astype(np.uint16) if few else between, kind="stable")


def row_shift(place: int, variables: int) -> int:
    """How many bits come behind the digit of such a number at this place, counted from the first one."""
    return ROW_BITS * (2 * variables - 1 - place)


def _distinct(frame: Lam) -> tuple[dict[int, int], Lam]:
    """A frame with each formula once: where a line meets a bound in a corner, a cut is that bound for all parameters.
    With the new place of each row."""
    items = children(frame.body)
    kept = {item: place for place, item in enumerate(dict.fromkeys(items))}
    if len(kept) == len(items) or items[0] is items[1]:
        return {row: row for row in range(len(items))}, frame
    return {row: kept[item] for row, item in enumerate(items)}, function_of(tuple_(kept))


def _not_plain(level: LevelPlan) -> bool:
    return bool(level.found or level.corners or any(level.turned))


def _enclosable_sides(body: Term, nodes: Iterable[Term]) -> bool:
    """Whether everything is enclosable that the integrand is on any of its sides. nodes: all of its parts, also those
    of surfaces, of which that is not asked."""

    def below(node: Term) -> Sequence[Term]:
        return (node.then, node.orelse) if isinstance(node, Branch) else children(node)

    if all(isinstance(node, Branch) or known_to_discs(node) for node in nodes):
        return True
    return all(isinstance(node, Branch) or known_to_discs(node) for node in postorder(body, below=below))


def on_sides(body: Term, sides: Mapping[Term, bool]) -> Term:
    memo: dict[Term, Term] = {}
    for node in postorder(body):
        if isinstance(node, Branch):
            side = sides.get(node.surface)
            if side is not None:
                memo[node] = memo[node.then if side else node.orelse]
                continue
        memo[node] = rebuild(node, tuple(memo[c] for c in children(node)))
    return memo[body]
