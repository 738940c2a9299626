"""Where an integrand is exactly zero, told from the sides of its surfaces alone.

Owns `Vanishing`, the test, `vanishing_of`, which makes it, `zero_on`, which asks it, and `held`, the sides that it asks
for; and `zero_with`, of which parts that is made.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct

from potto.calculus.inlining.currying import arguments_of, sizes_of, uncurry
from potto.calculus.surfaces.finding import Resolve
from potto.calculus.surfaces.trace import layout, spine
from potto.core.terms import App, Branch, Const, If, Lam, ListOf, Prim, Proj, Term, Tuple, postorder, var
from potto.kernels.cells import Mask
from potto.primitives import EXACT

Numbers = Mapping[tuple[int, ...], tuple[Any, int]]  # groups, and orientations, by the paths of their branches
NEVER, ALWAYS = 0, 1  # numbers of tests that need no sides


class SideTest(Struct, frozen=True):
    """A test by the side of a group: the one above it, and the one below, by their numbers."""

    group: Any
    orientation: int
    then: int
    orelse: int


class AllOrAny(Struct, frozen=True):
    """Whether all of some tests hold, or any of them does."""

    every: bool
    parts: tuple[int, ...]


class Vanishing(Struct, frozen=True):
    """A test on sides. rows: what it is made of, each once, from the parts to the whole, with numbers in this order
    behind NEVER and ALWAYS. whole: its own number. In a union of n regions 2^n ways lead through n rows."""

    rows: tuple[SideTest | AllOrAny, ...] = ()
    whole: int = NEVER


class _Rows:
    """Rows, as they are made."""

    def __init__(self) -> None:
        self.numbers: dict[SideTest | AllOrAny, int] = {}

    def number(self, row: SideTest | AllOrAny) -> int:
        return self.numbers.setdefault(row, 1 + ALWAYS + len(self.numbers))

    def joined(self, every: bool, parts: Sequence[int]) -> int:
        decisive, other = (NEVER, ALWAYS) if every else (ALWAYS, NEVER)
        if decisive in parts:
            return decisive
        rest = tuple(part for part in parts if part != other)
        if not rest:
            return other
        return rest[0] if len(rest) == 1 else self.number(AllOrAny(every, rest))

    def test(self, whole: int) -> Vanishing:
        """The test of this number, with the rows that it is made of."""
        rows = list(self.numbers)
        asked = {whole}
        for number in range(len(rows) + ALWAYS, ALWAYS, -1):
            if number in asked:
                asked.update(_parts(rows[number - 1 - ALWAYS]))
        kept = sorted(asked - {NEVER, ALWAYS})
        place = {NEVER: NEVER, ALWAYS: ALWAYS} | {number: n for n, number in enumerate(kept, 1 + ALWAYS)}
        return Vanishing(tuple(_renumbered(rows[number - 1 - ALWAYS], place) for number in kept), place[whole])


def _parts(row: SideTest | AllOrAny) -> tuple[int, ...]:
    return row.parts if isinstance(row, AllOrAny) else (row.then, row.orelse)


def _renumbered(row: SideTest | AllOrAny, place: Mapping[int, int]) -> SideTest | AllOrAny:
    if isinstance(row, AllOrAny):
        return AllOrAny(row.every, tuple(place[part] for part in row.parts))
    return SideTest(row.group, row.orientation, place[row.then], place[row.orelse])


def vanishing_of(
    body: Term, numbers: Numbers, part: Term | None = None, resolve: Resolve = lambda head: None
) -> Vanishing:
    """The test of whether an integrand is 0.

    part: what is tested, a part of the body that the paths of `numbers` are those of; all of it if None. resolve: gives
    the functions that are looked into where they are called.
    """
    rows = _Rows()
    return rows.test(_tests(rows, body, numbers, {}, resolve)[body if part is None else part])


def _tests(rows: _Rows, body: Term, numbers: Numbers, given: Mapping[Term, int], resolve: Resolve) -> dict[Term, int]:
    """The tests of all parts of a body. given: those of its parameters."""
    index = layout(body).index
    memo = dict(given)
    for node in postorder(body):
        if node not in given:
            site = index.get((node, 0)) if isinstance(node, App) else None
            memo[node] = (_zero(rows, node, memo, index, numbers) if site is None or not isinstance(node, App)
                          else _called(rows, node, memo, site, numbers, resolve))  # fmt: skip
    return memo


def _called(rows: _Rows, call: App, memo: dict[Term, int], site: int, numbers: Numbers, resolve: Resolve) -> int:
    """The test of what a function gives, in which some of its branches are told from sides."""
    inner = {path[1:]: place for path, place in numbers.items() if path[:1] == (site,) and path[1:]}
    head, groups = spine(call)
    function = resolve(head) if inner else None
    if not isinstance(function, Lam):
        return NEVER
    params, body = uncurry(function, sizes_of(groups))
    args = arguments_of(function, groups)
    if len(args) != len(params):
        return NEVER
    given: dict[Term, int] = {var(name): memo.get(arg, NEVER) for name, arg in zip(params, args, strict=True)}
    return _tests(rows, body, inner, given, resolve)[body]


def _zero(
    rows: _Rows, node: Term, memo: dict[Term, int], index: Mapping[tuple[Term, int], int], numbers: Numbers
) -> int:
    place = numbers.get((index.get((node, 2), -1),)) if isinstance(node, Branch) else None
    if isinstance(node, Branch) and place is not None:
        then, orelse = memo[node.then], memo[node.orelse]
        return NEVER if then == orelse == NEVER else rows.number(SideTest(*place, then, orelse))
    every, parts = zero_with(node)
    return rows.joined(every, [memo[part] for part in parts])


def zero_with(node: Term) -> tuple[bool, tuple[Term, ...]]:
    """The parts with which a term is 0: whether every one of them has to be, and which they are. None have to be of
    what is 0 itself; any of none is, of what is not known to be."""
    match node:
        case Const(value=0.0):
            return True, ()
        case Prim(op="mul", args=args):
            return False, args
        case Prim(op="add", args=args):
            return True, args
        case Prim(op="div", args=(above, _)):
            return True, (above,)
        case Prim(op=op, args=(inner,)) if EXACT.get((op, 0.0)) == 0:
            return True, (inner,)
        case Branch() | If():
            return True, (node.then, node.orelse)
        case Tuple() | ListOf():
            return True, node.items
        case Proj():
            return True, (node.term,)
        case _:
            return False, ()


def zero_on(test: Vanishing, sides: Mapping[int, Mask]) -> Mask:
    """Evaluate a vanishing test on sides: False, True or a mask."""
    found: list[Mask] = [False, True]
    for row in test.rows:
        if isinstance(row, AllOrAny):
            first, *rest = row.parts
            value = found[first]
            for part in rest:
                value = value & found[part] if row.every else value | found[part]
        else:
            value = _on_side(sides.get(row.group), row.orientation, found[row.then], found[row.orelse])
        found.append(value)
    return found[test.whole]


def _on_side(above: Mask | None, orientation: int, then: Mask, orelse: Mask) -> Mask:
    if above is None:
        return then & orelse
    if orientation < 0:
        then, orelse = orelse, then
    return (above & then) | (np.logical_not(above) & orelse)


def held(test: Vanishing) -> dict[Any, int]:
    """The groups of which one side has to hold, 1 or -1, where an integrand does not vanish."""
    found: list[dict[Any, int]] = [{}, {}]
    for row in test.rows:
        if isinstance(row, SideTest):
            if row.then == ALWAYS:
                own = {**found[row.orelse], row.group: -row.orientation}
            else:
                own = {**found[row.then], row.group: row.orientation} if row.orelse == ALWAYS else {}
        elif row.every:
            first, *rest = [found[part] for part in row.parts]
            own = {group: side for group, side in first.items() if all(other.get(group) == side for other in rest)}
        else:
            own = {group: side for part in row.parts for group, side in found[part].items()}
        found.append(own)
    return found[test.whole]
