"""Formulas as mathematics is set: in Unicode for terminals and hovers, as MathML for pages.

Owns `unicode` and `mathml`. They take an expression as Potto writes it and display that very expression:
nothing is simplified or reordered. What does not parse is shown as it is.
"""

from potto.syntax.typesetting.broken_lines import broken
from potto.syntax.typesetting.in_mathml import mathml
from potto.syntax.typesetting.in_unicode import unicode

__all__ = ["broken", "mathml", "unicode"]
