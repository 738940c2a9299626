"""Products that are asked for a value where a factor has none.

Owns `guarded`. People write `1/(2*sqrt(b))*[b > 0]` and mean 0 where b is negative, and so does an integrand. Outside
of integrals a program multiplies by that root, which is not a number: it says `if [b > 0] then 1/(2*sqrt(b)) else 0`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from potto.calculus.algebra.ranges import Box, range_of
from potto.calculus.explanation.brackets import Inequality, conditions, implies
from potto.core.terms import (
    ONE,
    ZERO,
    Branch,
    Integral,
    Prim,
    Term,
    add,
    branch,
    children,
    div,
    mul,
    neg,
    postorder,
    transform,
)
from potto.primitives import PRIMITIVES


def guarded(term: Term, box: Box | None = None, known: tuple[Inequality, ...] = ()) -> Term:
    """The same with choices for those products outside of integrals that have a factor without a value on a stretch
    where one of their brackets is 0; box: the ranges of indices, known: what holds around it. That something is divided
    by 0 at a place is none."""

    def change(_: Term, new: Term) -> Term:
        match new:
            case Branch() if (own := conditions(new)) is not None:
                return _where(own, ONE, box)
            case Prim(op="mul", args=args) if held := _held(args):
                inside = (*known, *held)
                found = [(conditions(arg), arg) for arg in args]
                args = tuple(guarded(arg, box, inside) if own is None else _where(own, ONE, box) for own, arg in found)
                return _product(args, ONE, box, known) or mul(*args)
            case Prim(op="mul", args=args):
                return _product(args, ONE, box, known) or new
            case Prim(op="div", args=(top, below)):
                return _product(_factors(top), below, box, known) or new
            case Prim(op="neg", args=(Branch(orelse=orelse) as inner,)) if orelse is ZERO and conditions(inner) is None:
                return _negated(inner)
            case _:
                return new

    return transform(term, change, below=_around)


def _held(args: tuple[Term, ...]) -> list[Inequality]:
    """The conditions that are factors of a product."""
    return [item for arg in args for item in conditions(arg) or ()]


def _around(node: Term) -> tuple[Term, ...]:
    """What is written anew by itself: not what stands in an integral, nor what a bracket guards."""
    return () if isinstance(node, Prim) and node.op == "mul" and _held(node.args) else _outside(node)


def _outside(node: Term) -> tuple[Term, ...]:
    return () if isinstance(node, Integral) else children(node)


def _factors(term: Term) -> tuple[Term, ...]:
    return term.args if isinstance(term, Prim) and term.op == "mul" else (term,)


def _product(args: tuple[Term, ...], below: Term, box: Box | None, known: tuple[Inequality, ...]) -> Term | None:
    """A product over what it is divided by as a choice, or as a sum of those; None where it may stand as it is."""
    rest = [arg for arg in args if conditions(arg) is None]
    if not any(_gaps(arg, box, known) for arg in (*rest, below)):
        return None
    if held := _held(args):
        return _where(held, div(mul(*rest), below), box)
    for place, arg in enumerate(rest):
        if isinstance(arg, Prim) and arg.op == "add":
            others = (*rest[:place], *rest[place + 1 :])
            parts = [_summand(part, others, below, box, known) for part in arg.args]
            return add(*(part for part in parts if part is not None)) if None not in parts else None
    return None


def _summand(
    part: Term, others: tuple[Term, ...], below: Term, box: Box | None, known: tuple[Inequality, ...]
) -> Term | None:
    """A summand times what its sum is multiplied by, as a choice."""
    if isinstance(part, Prim) and part.op == "neg":
        inner = _summand(part.args[0], others, below, box, known)
        return None if inner is None else _negated(inner)
    factors = _factors(part)
    return _product((*factors, *others), below, box, known) if _held(factors) else None


def _where(known: list[Inequality], term: Term, box: Box | None) -> Term:
    """A term where all conditions hold, else 0; those that are told everywhere are asked first."""
    innermost_first = list(reversed(known))
    for item in sorted(innermost_first, key=lambda item: _gaps(item.surface, box), reverse=True):
        term = branch((item.surface,), item.strict, term, ZERO)
    return term


def _negated(node: Term) -> Term:
    """The negative of what is 0 elsewhere."""
    if isinstance(node, Branch) and node.orelse is ZERO:
        return branch(node.coordinates, node.strict, _negated(node.then), ZERO)
    return neg(node)


def _gaps(term: Term, box: Box | None, known: tuple[Inequality, ...] = ()) -> int:
    """How many parts of a term may have no value on a stretch, as far as its form and what is known show."""
    return sum(
        not (low <= (values := range_of(arg, box)).lo and values.hi <= high)
        and not (low == 0.0 and high == math.inf and any(implies(item, Inequality(arg, False)) for item in known))
        for node in postorder(term, below=_outside)
        if isinstance(node, Prim)
        for arg, (low, high) in _domains(node)
    )


def _domains(node: Prim) -> Iterator[tuple[Term, tuple[float, float]]]:
    """Arguments of a builtin with the stretches in which they must lie."""
    if node.op == "pow":
        exponent = range_of(node.args[1])
        if not (exponent.lo == exponent.hi and exponent.lo.is_integer()):
            yield node.args[0], (0.0, math.inf)
    entry = PRIMITIVES[node.op]
    if math.isfinite(entry.within[0]) or math.isfinite(entry.within[1]):
        yield node.args[entry.orders], entry.within
