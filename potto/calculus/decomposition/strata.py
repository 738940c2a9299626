"""Where in space the cuts of a variable come from: strata, on which some surfaces are 0 and may be turning.

Owns `Stratum`, `own`, `known` and `met`. What is integrated over variables further in is smooth in one further out but
where that is critical on a stratum: on a face, an edge where two surfaces meet, or at a vertex (Thom's isotopy lemma;
Goresky and MacPherson, Stratified Morse Theory, 1988). The shadows of two edges that pass each other in space cross all
the same, and silhouettes touch those of edges: nothing happens there.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from msgspec import Struct

from potto.calculus.algebra.degree import quadric
from potto.core.terms import Term

MOST = 16  # strata of one cut; of more it is as if nothing were known of them


class Stratum(Struct, frozen=True):
    """Where all surfaces are 0. folded: the variables along which they turn there."""

    surfaces: frozenset[Term]
    folded: frozenset[str] = frozenset()

    def turning(self, variable: str) -> Stratum:
        """Where that of it is which turns along a variable."""
        return Stratum(self.surfaces, self.folded | {variable})

    def on(self, surface: Term) -> Stratum:
        """What of it lies on another surface."""
        return Stratum(self.surfaces | {surface}, self.folded)

    def meets(self, other: Stratum, inner: frozenset[str]) -> bool:
        """Whether both have places in common but by accident, not just shadows. inner: all variables but those in which
        the shadows lie."""
        both = frozenset().union(*(surface.free for surface in other.surfaces))
        own = frozenset().union(*(surface.free for surface in self.surfaces))
        if self.folded or other.folded:
            return self.folded.isdisjoint(both) and other.folded.isdisjoint(own)
        return len(self.surfaces | other.surfaces) <= 1 + len((own | both) & inner)


def own(surface: Term) -> tuple[Stratum, ...]:
    """A surface itself."""
    return (Stratum(frozenset((surface,))),)


def known(strata: Sequence[Stratum], names: frozenset[str]) -> bool:
    """Whether it can be told which others strata meet: they are some, of surfaces of degree 2 in the variables of
    integration."""
    return bool(strata) and all(quadric(s, names) for stratum in strata for s in stratum.surfaces)


def met(
    first: Iterable[Stratum], second: Iterable[Stratum], inner: frozenset[str], names: frozenset[str]
) -> tuple[Stratum, ...] | None:  # fmt: skip
    """The strata in which those of two cuts meet; None where that can't be told, of unknown ones (none), and where a
    surface may have edges of its own. names: the variables of integration."""
    one, other = tuple(first), tuple(second)
    if not (known(one, names) and known(other, names)):
        return None
    found = dict.fromkeys(
        Stratum(a.surfaces | b.surfaces, a.folded | b.folded) for a in one for b in other if a.meets(b, inner)
    )
    return tuple(found)
