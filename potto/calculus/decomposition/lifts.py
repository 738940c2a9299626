"""Which places in space lie over the shadows that an integral over variables further in is not smooth at.

Owns `Lift`, `crossed`, `turned` and `told`. `strata` tells which surfaces make a shadow; here are the places on them,
by formulas in what is further out, so that numbers can tell whether anything is bounded there. Of the n^2/2 edges of n
surfaces a body has few, and the shadows of all others leave nothing (`integrate/decomposition/lifted_rows`).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from msgspec import Struct
from msgspec.structs import replace

from potto.calculus.algebra.polynomial_in import in_powers
from potto.calculus.decomposition.critical import Within
from potto.calculus.decomposition.strata import Stratum
from potto.core.terms import HALF, Const, Term, div, mul, neg

MOST = 16  # places over one shadow; of more it is as if none were known


class Lift(Struct, frozen=True):
    """The surfaces that a place lies on, and where it is along variables further in, innermost first, each by those
    further out; along others it may be anywhere. bounds: the surfaces among them that are bounds of variables."""

    surfaces: frozenset[Term]
    at: tuple[tuple[str, Term], ...] = ()
    bounds: frozenset[Term] = frozenset()

    def on(self, bound: Term, variable: str, place: Term) -> Lift:
        """What of it lies on a bound of a variable."""
        return Lift(self.surfaces | {bound}, (*self.at, (variable, place)), self.bounds | {bound})


def told(lifts: Iterable[Lift]) -> tuple[Lift, ...]:
    """Those of one shadow, each once; none where they are many."""
    found = tuple(dict.fromkeys(lifts))
    return found if len(found) <= MOST else ()


def turned(lifts: Sequence[Lift], surface: Term, variable: str) -> tuple[Lift, ...]:
    """The places over which the two roots of a surface merge; none where more may happen to them."""
    powers = in_powers(surface, variable, 2)
    if powers is None or len(powers) != 3 or not isinstance(powers[0], Const) or powers[0].value == 0:
        return ()
    middle = neg(mul(HALF, div(powers[1], powers[0])))
    return tuple(replace(lift, at=(*lift.at, (variable, middle))) for lift in lifts)


def crossed(
    first: Sequence[Lift], second: Sequence[Lift], strata: Sequence[Stratum] | None, chain: Sequence[Within], root: Term
) -> tuple[Lift, ...]:  # fmt: skip
    """The places over which two cuts meet at a root of one of them. strata: in which they meet, if that is known.
    chain: the variables that were integrated over, innermost first, the last of which they cut."""
    allowed = None if strata is None else {stratum.surfaces for stratum in strata}
    found = []
    for one in first:
        for other in second:
            both = one.surfaces | other.surfaces
            if allowed is None or both in allowed:
                at = {**dict(other.at), **dict(one.at), chain[-1].variable: root}
                names = (within.variable for within in chain)
                places = tuple((name, at[name]) for name in names if name in at)
                found.append(Lift(both, places, one.bounds | other.bounds))
    return told(found)
