"""Conditions on angles that are found by inverse functions. Owns `angle_bounds`."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

from potto.core.polynomials import Exact, Monomial
from potto.core.terms import ONE, PI, Prim, Term, add, const, neg, sub

_HALF = Fraction(1, 2)
_RANGES = {  # multiples of pi, and 1 where the angle rises with its sine, -1 where it falls with its cosine
    "asin": (-_HALF, _HALF, 1),
    "acos": (Fraction(0), Fraction(1), -1),
    "atan": (-_HALF, _HALF, 1),
}


def angle_bounds(form: Mapping[Monomial, Exact], strict: bool) -> list[tuple[Term, bool]] | None:
    """The surfaces that have to be above 0, strictly or not, where an inverse function beside multiples of pi is:
    1 + u > 0 for pi - acos(u) > 0. None for other forms, and where only a number could say it."""
    angles = [m for m in form if len(m) == 1 and isinstance(m[0][0], Prim) and m[0][0].op in _RANGES and m[0][1] == 1]
    if len(angles) != 1 or any(m not in (angles[0], ((PI, 1),)) for m in form):
        return None
    angle = angles[0][0][0]
    assert isinstance(angle, Prim)
    low, high, rises = _RANGES[angle.op]
    (u,) = angle.args
    at = -Fraction(form.get(((PI, 1),), 0)) / Fraction(form[angles[0]])
    above = form[angles[0]] > 0  # the angle is above `at`, else below it
    over_minus_one, under_one = add(u, ONE), sub(ONE, u)
    if angle.op == "atan" and low < at < high:
        return [(u if above else neg(u), strict)] if at == 0 else None
    if angle.op == "atan":  # which is at neither end
        return [] if above == (at <= low) else [(const(-1.0), True)]
    if (at > high if above else at < low) or (strict and at == (high if above else low)):
        return [(const(-1.0), True)]
    if at < low or at > high or (not strict and at == (low if above else high)):
        return [(over_minus_one, False), (under_one, False)]
    if at != (low if above else high):
        return None
    at_minus_one = above == (rises > 0)  # where the angle is the one that it must not be
    return [(over_minus_one, at_minus_one), (under_one, not at_minus_one)]
