"""Conditions on abs, min, max and clamp as conditions on what is inside of them.

Owns `cased`, `by_extremes`, `unnested`, `by_choices` and `resolved`. The surface of `[max(x, y) < t]` runs along x and
along y, so that no variable of integration cuts all of it; those of `[x < t]*[y < t]` do, which is the same. Where a
condition does not rise or fall with what is the greatest or the least, a condition that has no jump of its own chooses
between cases. Conditions that cancel go with it, as those of cases do: [max(x, 2*x) - 2*x < t] where 2*x is the
greater.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

from potto.calculus.algebra.ranges import positive
from potto.calculus.solving.solve import shared_factors
from potto.calculus.surfaces.cancelled import without_cancelled
from potto.calculus.surfaces.comparisons import by_brackets, by_signs, of_arguments
from potto.calculus.surfaces.nested_brackets import has_nested
from potto.core.simplify import normalized_surface
from potto.core.terms import (
    Branch,
    Delta,
    If,
    Index,
    Integral,
    Prim,
    Term,
    bound_names,
    branch,
    children,
    delta,
    if_,
    mul,
    neg,
    postorder,
    replaced,
    transform,
    with_integrand,
)
from potto.primitives import PRIMITIVES

_FLAT = ("max", "min", "clamp")
_EXTREME = frozenset(op for op, entry in PRIMITIVES.items() if op in ("max", "min") or entry.extremes)
MOST = 8  # cases that one condition is taken apart into
MOST_TOGETHER = 36  # conditions that one on several greatests and leasts is: of n of two each there would be 2^n


def cased(term: Integral) -> Integral:
    """An equal integral, or the same one where there is nothing to take apart."""
    names = frozenset(term.variables)
    return _changed(term, lambda node: _settled(node, names, MOST) if _changes(node, names) else node)


def by_extremes(term: Integral) -> Integral:
    """The same with a condition on a greatest or a least as one on each of them; on abs where that is an `and`."""
    names = frozenset(term.variables)
    return _changed(term, lambda node: _settled(node, names, MOST))


def _changed(term: Integral, change: Callable[[Branch], Term]) -> Integral:
    if not any(isinstance(node, Branch) for node in postorder(term.body)):
        return term

    def changed(_: Term, new: Term) -> Term:
        return change(new) if isinstance(new, Branch) and _bent(new) else new

    def plain(_: Term, new: Term) -> Term:
        if isinstance(new, Branch):
            new = by_signs(of_arguments(new), frozenset(term.variables))
        return without_cancelled(new, term.variables) if isinstance(new, Branch) else by_brackets(new)

    return with_integrand(term, transform(transform(term.body, changed), plain))


def resolved(term: Term) -> Term:
    """A term whose integrals are taken apart like that, with no bracket inside of a condition, and along the factors of
    their conditions, too.

    [x*y > 0] is [y > 0] where x > 0, and [y < 0] where it is not: a formula for its roots in y says nothing of x = 0.
    """
    return transform(
        by_choices(term), lambda _, new: _by_factors(cased(unnested(new))) if isinstance(new, Integral) else new
    )


def by_choices(term: Term) -> Term:
    """A term with its conditions, and its deltas, whose place a plain conditional chooses as choices between such: each
    has roots of its own, and where two conditions meet depends on which of them there are."""
    return transform(term, lambda _, new: _chosen(new) if isinstance(new, Branch | Delta) else new)


def _chosen(node: Branch | Delta) -> Term:
    choice = next((part for part in postorder(*node.coordinates, below=_values) if isinstance(part, If)), None)
    if choice is None:
        return node

    def side(then: bool) -> Term:
        same = (part for c in node.coordinates for part in postorder(c) if isinstance(part, If))
        taken: dict[Term, Term] = {
            part: part.then if then else part.orelse for part in same if part.condition is choice.condition
        }
        coordinates = tuple(replaced(c, taken) for c in node.coordinates)
        if isinstance(node, Delta):
            return by_choices(delta(coordinates))
        return by_choices(branch(coordinates, node.strict, node.then, node.orelse))

    return if_(choice.condition, side(True), side(False))


def unnested(term: Integral) -> Integral:
    """The integral with no bracket inside of a condition, whatever its parameters are; the same one if that takes too
    many cases."""
    if not has_nested(term.body):
        return term
    from potto.calculus.surfaces.lifted import closed_value, lifted

    found = lifted(term, closed_value)
    return term if found is None else found.term


def _by_factors(term: Integral) -> Integral:
    return with_integrand(
        term, transform(term.body, lambda _, new: _split(new, MOST) if isinstance(new, Branch) else new)
    )


def _split(node: Term, most: int) -> Term:
    """A condition on a product as one on a factor that varies with less, and on the rest."""
    assert isinstance(node, Branch)
    whole = node.surface
    if not isinstance(whole, Prim) or whole.op not in ("mul", "div") or most < 2:
        return node
    apart = next((f for f in whole.args if f.free and f.free != whole.free), None)
    if apart is None:
        return node
    at = whole.args.index(apart)
    others = tuple(f for place, f in enumerate(whole.args) if place != at)
    rest = mul(*others)
    if not rest.free:
        return node
    up = _split(branch((rest,), node.strict, node.then, node.orelse), most // 2)
    down = _split(branch((neg(rest),), node.strict, node.then, node.orelse), most // 2)
    none = node.orelse if node.strict else node.then  # a parameter may be 0 over the whole domain
    return branch((apart,), True, up, branch((neg(apart),), True, down, none))


def _bent(node: Branch) -> bool:
    """Whether a condition is on abs, min, max or clamp of something."""
    return bool(_bends(node.surface))


def _settled(node: Term, names: frozenset[str], most: int) -> Term:
    """A condition on a greatest or a least as one on each of them; one in which it can't be is split by cases if these
    vary with less."""
    if not isinstance(node, Branch) or len(node.coordinates) != 1:
        return node
    (surface,) = node.coordinates
    chosen = _outermost(surface)
    if len(chosen) == 1 or _together(surface, chosen):
        part = chosen[0]
        written = PRIMITIVES[part.op].extremes
        extreme = part if written is None else written(*part.args)
        rises = _direction(surface, part) if part.op in _EXTREME else 0
        if rises and isinstance(extreme, Prim) and extreme.op in ("max", "min"):
            every = (extreme.op == "max") == (rises < 0)
            # abs(u) > t stays one surface: that it folds at t = 0 tells its one-sided derivatives exactly.
            if every or written is None or not all(arg.free for arg in extreme.args):
                return _one_by_one(node, part, extreme.args, every, names, most)
    return _apart(node, most) if _changes(node, names) else node


def _together(surface: Term, chosen: Sequence[Prim]) -> bool:
    """Whether a condition on several greatests and leasts holds where all of few conditions on their arguments do, or
    where one of them does."""
    if not chosen or not all(part.op in ("max", "min") for part in chosen):
        return False
    rises = [_direction(surface, part) for part in chosen]
    every = {(part.op == "max") == (sign < 0) for part, sign in zip(chosen, rises, strict=True)}
    return all(rises) and len(every) == 1 and math.prod(len(part.args) for part in chosen) <= MOST_TOGETHER


def _one_by_one(node: Branch, part: Term, args: Sequence[Term], every: bool, names: frozenset[str], most: int) -> Term:
    """A condition with each of some terms in the place of a part: all of them hold, or one.

    most: cases of each, as these conditions add up, where cases multiply.
    """
    found = node.then if every else node.orelse
    for arg in reversed(args):
        yes, no = (found, node.orelse) if every else (node.then, found)
        found = _settled(branch((replaced(node.surface, {part: arg}),), node.strict, yes, no), names, most)
    return found


def _outermost(surface: Term) -> list[Prim]:
    """The builtins of a surface that choose and vary, those not inside of others."""

    def chooses(node: Term) -> bool:
        return isinstance(node, Prim) and PRIMITIVES[node.op].cases is not None and bool(node.free)

    order = postorder(surface, below=lambda node: () if bound_names(node) or chooses(node) else children(node))
    return [node for node in order if isinstance(node, Prim) and chooses(node)]


def _direction(surface: Term, part: Term) -> int:
    """+1 where a surface rises with a part of it, -1 where it falls, as sums, products and quotients show; 0 where it
    is not known."""
    above, sign = surface, 1
    while above is not part:
        if not isinstance(above, Prim):
            return 0
        inside = [n for n, arg in enumerate(above.args) if any(node is part for node in _outside(arg))]
        if len(inside) != 1 or above.op not in ("add", "neg", "mul", "div"):
            return 0
        (place,) = inside
        others = [arg for n, arg in enumerate(above.args) if n != place]
        if above.op in ("mul", "div"):
            if (above.op == "div" and place) or not all(positive(arg) or positive(neg(arg)) for arg in others):
                return 0
            sign *= -1 if sum(positive(neg(arg)) for arg in others) % 2 else 1
        sign *= -1 if above.op == "neg" else 1
        above = above.args[place]
    return sign


def _changes(node: Branch, names: frozenset[str]) -> bool:
    """Whether one of the cases of a condition varies with less than the condition, or not at all, or a factor of one
    does: |y|*t - y*x is y*(t - x) where y > 0, which has another place in x than where it is not. Or with fewer of
    some variables: |x + y| - |x - y| is 2y, -2y, 2x or -2x."""
    parts = _bends(node.surface)
    flat = [part for part in parts if part.op in _FLAT and part.free]
    return (
        any(arg.free != part.free for part in flat for arg in part.args)
        or any(
            factor.free and factor.free != case.free
            for part in parts
            for value in PRIMITIVES[part.op].cases(*part.args)[1:]  # type: ignore[misc]
            if isinstance(case := replaced(node.surface, {part: value}), Prim) and case.op == "add"
            for factor in shared_factors(case)
        )
        or (len(parts) > 1 and any(_free_of(case) & names != node.surface.free & names for case in _cases(node)))
    )


def _cases(node: Branch) -> Iterator[Term]:
    """The surfaces without bends that a condition comes to on the sides of all of them; none if they are too many."""
    waiting = [(node.surface, MOST)]
    found: list[Term] = []
    while waiting:
        surface, most = waiting.pop()
        bends = _bends(surface)
        if not bends:
            found.append(surface)
        elif most < 2:
            return
        else:
            values = PRIMITIVES[bends[0].op].cases(*bends[0].args)[1:]  # type: ignore[misc]
            waiting += [(replaced(surface, {bends[0]: value}), most // 2) for value in values]
    yield from found


def _free_of(surface: Term) -> frozenset[str]:
    """What a surface varies with once what cancels is gone."""
    return normalized_surface(surface)[0].free


def _bends(surface: Term) -> list[Prim]:
    return [part for part in _outside(surface) if isinstance(part, Prim) and PRIMITIVES[part.op].cases]


def _apart(node: Term, most: int) -> Term:
    assert isinstance(node, Branch)
    bent = next(iter(_bends(node.surface)), None)
    if bent is None or most < 2:
        return node
    margin, first, second = PRIMITIVES[bent.op].cases(*bent.args)  # type: ignore[misc]
    cases = []
    for value in (first, second):
        coordinates = tuple(replaced(c, {bent: value}) for c in node.coordinates)
        cases.append(_apart(branch(coordinates, node.strict, node.then, node.orelse), most // 2))
    return branch((margin,), False, cases[0], cases[1])


def _values(node: Term) -> Sequence[Term]:
    """The parts of a term that numbers come from: which element of an array is meant is no choice between surfaces."""
    if bound_names(node):
        return ()
    return (node.array,) if isinstance(node, Index) else children(node)


def _outside(surface: Term) -> list[Term]:
    """The parts of a surface that are not inside an integral or a sum of it, whose variables mean nothing outside."""
    return postorder(surface, below=lambda node: () if bound_names(node) else children(node))
