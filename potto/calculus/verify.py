"""An author's inverse, verified.

Owns `verify`: by symbols where they decide (inverse after map, or map after inverse, is the identity), else at sample
points, and then it says so.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from potto.calculus.isolate import Guard
from potto.calculus.normal import equal
from potto.calculus.sampling import points, sample_value
from potto.core.terms import Term, substitute, var

_POINTS = 4000
_ENOUGH = 200
# An inverse that a person wrote in doubles, through functions of moderate slope: seven digits tell right from wrong.
_TOLERANCE = 1e-7

Box = Mapping[str, tuple[float, float]]


@dataclass(frozen=True, slots=True)
class Verified:
    """The inverse holds: `proven` by symbols, else at `tested` points."""

    proven: bool
    tested: int = 0


@dataclass(frozen=True, slots=True)
class Refuted:
    """A point that does not come back: variables and parameters there, and what comes back."""

    point: Mapping[str, float]
    back: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class Untested:
    """No point was found at which map and inverse are both defined."""


def verify(
    coordinates: Sequence[Term],
    variables: Sequence[str],
    values: Sequence[str],
    inverse: Sequence[Term],
    where: Sequence[Guard] = (),
    box: Box | None = None,
) -> Verified | Refuted | Untested:
    """Whether `inverse`, over `values`, gives back the variables; only where `where` holds."""
    forth = dict(zip(values, coordinates, strict=True))
    round_trip = [substitute(i, forth) for i in inverse]
    refuted = _sampled(coordinates, round_trip, variables, where, box or {})
    if isinstance(refuted, Refuted):
        return refuted
    if all(equal(r, var(v)) for r, v in zip(round_trip, variables, strict=True)):
        return Verified(True)
    return refuted


def _sampled(
    coordinates: Sequence[Term], round_trip: Sequence[Term], variables: Sequence[str], where: Sequence[Guard], box: Box
) -> Verified | Refuted | Untested:
    names = sorted({n for t in round_trip for n in t.free} | {n for g in where for n in g.surface.free} | {*variables})
    tested = 0
    for point in points(names, box, _POINTS):
        if not all(_holds(guard, point) for guard in where):
            continue
        back = [sample_value(t, point) for t in round_trip]
        if any(not math.isfinite(b) for b in back):
            if all(math.isfinite(sample_value(c, point)) for c in coordinates):
                return Refuted(point, dict(zip(variables, back, strict=True)))  # the map reaches what has no inverse
            continue
        tested += 1
        far = [abs(b - point[v]) > _TOLERANCE * (1 + abs(point[v])) for b, v in zip(back, variables, strict=True)]
        if any(far):
            return Refuted(point, dict(zip(variables, back, strict=True)))
        if tested >= _ENOUGH:
            break
    return Verified(False, tested) if tested else Untested()


def _holds(guard: Guard, point: Mapping[str, float]) -> bool:
    value = sample_value(guard.surface, point)
    return value > 0 if guard.strict else value >= 0
