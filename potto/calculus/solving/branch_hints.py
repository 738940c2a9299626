"""What the author's `where` says of a diffeomorphism's branch.

Owns `guards_of`, its conditions as surfaces, and `box_of`, the bounds of variables among them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from potto.calculus.algebra.affine import affine
from potto.calculus.solving.isolate import Guard
from potto.core.terms import ONE, ZERO, Const, Prim, Term, const, if_, sub


def guards_of(truth: Term) -> list[Guard]:
    """A condition of `where`, as surfaces that are positive where it holds."""
    match truth:
        case Prim(op="and", args=args):
            return [guard for arg in args for guard in guards_of(arg)]
        case Prim(op="lt" | "le" as op, args=(a, b)):
            return [Guard(sub(b, a), op == "lt")]
        case _:
            return [Guard(sub(if_(truth, ONE, ZERO), const(0.5)))]


def box_of(where: Iterable[Guard], variables: Sequence[str]) -> dict[str, tuple[float, float]]:
    """Bounds of single variables, where `where` says them as constants."""
    box: dict[str, tuple[float, float]] = {}
    for guard in where:
        for name in guard.surface.free & frozenset(variables):
            found = affine(guard.surface, (name,))
            if found is None or not isinstance(found.rest, Const) or not isinstance(found.coefficients[0], Const):
                continue
            slope, bound = found.coefficients[0].value, -found.rest.value / found.coefficients[0].value
            lo, hi = box.get(name, (float("-inf"), float("inf")))
            box[name] = (max(lo, bound), hi) if slope > 0 else (lo, min(hi, bound))
    return box
