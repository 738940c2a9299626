"""An author's inverse, verified.

Owns `guards_of` and `box_of`, what the author's `where` says of a branch, and `verify`: by symbols where they decide
(inverse after map is the identity), else at sample points, and then it says so. Doubles sort out at many points what is
plainly wrong, or not defined; at a few of them numbers of fifty digits find what is wrong by less. Those are loaded
only for an inverse that symbols do not decide.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction

from msgspec import Struct

from potto.calculus.algebra.affine import affine
from potto.calculus.algebra.point_values import points, sample_value
from potto.calculus.algebra.ranges import Box
from potto.calculus.algebra.rational_form import equal
from potto.calculus.solving.isolate import Guard
from potto.core.terms import ONE, ZERO, Const, Prim, Term, const, if_, postorder, prim, sub, substitute, transform, var

_POINTS = 4000
_ENOUGH = 200
_TOLERANCE = 1e-7  # of doubles, through functions of any slope
_DIGITS = 50
_EXACT_POINTS = 12
_EXACT = 1e-20
# A number in the text with this many digits or more stands for one that it is not, such as sqrt(2).
_ROUNDED_DIGITS = 13
_ROUNDED = 1e-12


class Verified(Struct, frozen=True):
    """The inverse holds: `proven` by symbols, else at `tested` points."""

    proven: bool
    tested: int = 0


class Refuted(Struct, frozen=True):
    """A point that does not come back: variables and parameters there, what comes back, and by how much it is off."""

    point: Mapping[str, float]
    back: Mapping[str, float]
    off: float = math.inf


class Untested(Struct, frozen=True):
    """No point was found at which map and inverse are both defined."""


class _Passed(Struct, frozen=True):
    """Points at which doubles found nothing wrong."""

    points: tuple[Mapping[str, float], ...]


Outcome = Verified | Refuted | Untested


def verify(
    coordinates: Sequence[Term],
    variables: Sequence[str],
    values: Sequence[str],
    inverse: Sequence[Term],
    where: Sequence[Guard] = (),
    box: Box | None = None,
) -> Outcome:
    """Whether `inverse`, over `values`, gives back the variables; only where `where` holds."""
    forth = dict(zip(values, coordinates, strict=True))
    round_trip = [substitute(i, forth) for i in inverse]
    refuted = _sampled(coordinates, round_trip, variables, where, box or {})
    if isinstance(refuted, Refuted):
        return refuted
    if all(equal(r, var(v)) for r, v in zip(round_trip, variables, strict=True)):
        return Verified(True)
    return _closely(round_trip, variables, refuted)


def _sampled(
    coordinates: Sequence[Term], round_trip: Sequence[Term], variables: Sequence[str], where: Sequence[Guard], box: Box
) -> _Passed | Refuted | Untested:
    names = sorted({n for t in round_trip for n in t.free} | {n for g in where for n in g.surface.free} | {*variables})
    tested: list[Mapping[str, float]] = []
    for point in points(names, box, _POINTS):
        if not all(_holds(guard, point) for guard in where):
            continue
        back = [sample_value(t, point) for t in round_trip]
        if any(not math.isfinite(b) for b in back):
            if all(math.isfinite(sample_value(c, point)) for c in coordinates):
                return Refuted(point, dict(zip(variables, back, strict=True)))  # the map reaches what has no inverse
            continue
        tested.append(point)
        far = [abs(b - point[v]) > _TOLERANCE * (1 + abs(point[v])) for b, v in zip(back, variables, strict=True)]
        if any(far):
            return Refuted(point, dict(zip(variables, back, strict=True)))
        if len(tested) >= _ENOUGH:
            break
    return _Passed(tuple(tested)) if tested else Untested()


def _closely(round_trip: Sequence[Term], variables: Sequence[str], passed: _Passed | Untested) -> Outcome:
    """At some of the points again, in fifty digits."""
    if isinstance(passed, Untested):
        return passed
    from potto.core.reference import NotAccurate, evaluate

    exact = [_as_written(term) for term in round_trip]
    tolerance = _ROUNDED if any(_is_rounded(term) for term in round_trip) else _EXACT
    for point in passed.points[:_EXACT_POINTS]:
        for term, name in zip(exact, variables, strict=True):
            try:
                back = evaluate(term, point, digits=_DIGITS)
                off = float(abs(back - point[name]))
            except (ArithmeticError, ValueError, TypeError, NotAccurate):
                continue
            if off > tolerance * (1 + abs(point[name])):
                values = [sample_value(t, point) for t in round_trip]
                return Refuted(point, dict(zip(variables, values, strict=True)), off)
    return Verified(False, len(passed.points))


def _as_written(term: Term) -> Term:
    """The term with the decimals of its text as what they say: 0.1 is a tenth, and not the double beside it."""

    def change(node: Term, new: Term) -> Term:
        if isinstance(node, Const) and node.name is None and math.isfinite(node.value) and not node.value.is_integer():
            tenth = Fraction(repr(node.value))
            if max(abs(tenth.numerator), tenth.denominator) < 2**53:  # both are doubles
                return prim("div", const(float(tenth.numerator)), const(float(tenth.denominator)))
        return new

    return transform(term, change)


def _is_rounded(term: Term) -> bool:
    numbers = (node.value for node in postorder(term) if isinstance(node, Const) and node.name is None)
    return any(len(repr(abs(n)).partition("e")[0].replace(".", "").strip("0")) >= _ROUNDED_DIGITS for n in numbers)


def _holds(guard: Guard, point: Mapping[str, float]) -> bool:
    value = sample_value(guard.surface, point)
    return value > 0 if guard.strict else value >= 0


# What the author says of a branch


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
