"""What was found for parts of formulas, kept from one formula to the next: after a key most parts are what they were.

Owns `ReadableParts`.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from msgspec import Struct, field

from potto.calculus.explanation.factors import Factors
from potto.core.polynomials import Monomial
from potto.core.terms import Term
from potto.core.walking import Kept

Part = tuple[Term, frozenset[str], frozenset[str], frozenset[str]]
"""A part, the tangents, and which of its names are variables of integration or whole numbers."""
Product = tuple[Fraction, tuple[tuple[Monomial, int], ...], frozenset[str]]  # of powers; and the tangents

_MOST = 8192  # of each kind
_KNOWN: Kept[Part, Term] = Kept(_MOST)
_FACTORS: Kept[Term, Factors] = Kept(_MOST)
_PRODUCTS: Kept[Part, Factors | None] = Kept(_MOST)
_WRITTEN: Kept[Product, Term] = Kept(_MOST)


class ReadableParts(Struct):
    """Of formulas that are written one after the other. known: what was found for a part of one, by all that this
    depends on; factors: of atoms; products: that sums are; written: products of powers; pause: called before each new
    part, may raise what ends it, and what is known by then is known when it is asked again."""

    pause: Callable[[], None] = lambda: None
    known: dict[Part, Term] = field(default_factory=_KNOWN.table)
    factors: dict[Term, Factors] = field(default_factory=_FACTORS.table)
    products: dict[Part, Factors | None] = field(default_factory=_PRODUCTS.table)
    written: dict[Product, Term] = field(default_factory=_WRITTEN.table)
