"""What a term is a product of, and what it is a sum of.

Owns `factors`, `summands` and `alternatives`. A condition with a maximum or a minimum that holds where several
others do is their product, and so is a conditional without an other case.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial, reduce

from potto.core.terms import (
    ONE,
    ZERO,
    Branch,
    Prim,
    Term,
    add,
    branch,
    div,
    mul,
    neg,
)

Names = frozenset[str]
Scaled = Callable[[Term], Term]


def factors(term: Term) -> Iterable[Term]:
    """The factors; what is divided by stands as one over it, and a condition apart from what it chooses."""
    waiting = [term]
    while waiting:
        item = waiting.pop()
        match item:
            case Prim(op="mul", args=args):
                waiting.extend(reversed(args))
            case Prim(op="neg", args=(inside,)):
                waiting.append(inside)
                yield neg(ONE)
            case Prim(op="div", args=(above, below)) if above is not ONE:
                waiting.append(above)
                yield from (div(ONE, factor) for factor in factors(below))
            case Branch(then=then, orelse=orelse) if orelse is ZERO and then is not ONE:
                waiting += (then, branch(item.coordinates, item.strict, ONE, ZERO))
            case Branch(then=then, orelse=orelse) if then is ZERO and orelse is not ONE:
                waiting += (orelse, branch(item.coordinates, item.strict, ZERO, ONE))
            case Branch(then=then, orelse=orelse) if (
                then is ONE and orelse is ZERO and len(every := _every(item.surface)) > 1
            ):
                waiting += (branch((surface,), item.strict, ONE, ZERO) for surface in every)
            case _:
                yield item


def _every(surface: Term) -> list[Term]:
    """The surfaces all of which must be on the upper side for one with a maximum or a minimum to be: c - max(a, b)."""
    terms = surface.args if isinstance(surface, Prim) and surface.op == "add" else (surface,)
    for place, term in enumerate(terms):
        rest = (*terms[:place], *terms[place + 1 :])
        match term:
            case Prim(op="min", args=args):
                return [add(*rest, arg) for arg in args]
            case Prim(op="neg", args=(Prim(op="max", args=args),)):
                return [add(*rest, neg(arg)) for arg in args]
    return [surface]


def summands(term: Term, names: Names) -> list[Term]:
    """What a term is a sum of, that what has none of some variables is multiplied into."""
    found: list[Term] = []
    waiting: list[tuple[Term, tuple[Scaled, ...]]] = [(term, ())]
    while waiting:
        item, scaled = waiting.pop()
        match item:
            case Prim(op="add", args=args):
                waiting.extend((a, scaled) for a in reversed(args))
            case Prim(op="neg", args=(inside,)):
                waiting.append((inside, (neg, *scaled)))
            case Prim(op="mul", args=args) if sum(not a.free.isdisjoint(names) for a in args) == 1:
                inside = next(a for a in args if not a.free.isdisjoint(names))
                rest = mul(*(a for a in args if a is not inside))
                waiting.append((inside, (partial(mul, rest), *scaled)))
            case Prim(op="div", args=(inside, below)) if below.free.isdisjoint(names):
                waiting.append((inside, (partial(_over, below), *scaled)))
            case _:
                found.append(reduce(lambda part, wrap: wrap(part), scaled, item))
    return found


def alternatives(term: Term) -> list[Term]:
    """What a conditional is a sum of: what it is on either side of its condition, and so on within. Each part vanishes
    where the others do not, so that nothing cancels. Greatests and leasts in conditions are for `by_extremes`."""
    if not isinstance(term, Branch) or {term.then, term.orelse} == {ZERO, ONE}:
        return [term]
    holds = branch(term.coordinates, term.strict, ONE, ZERO)
    fails = branch(term.coordinates, term.strict, ZERO, ONE)
    sides = ((holds, term.then), (fails, term.orelse))
    return [mul(side, part) for side, value in sides if value is not ZERO for part in alternatives(value)]


def _over(below: Term, above: Term) -> Term:
    return div(above, below)
