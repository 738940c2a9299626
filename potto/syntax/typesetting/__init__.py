"""Formulas as mathematics is set: in Unicode for terminals and hovers, as MathML for pages, as LaTeX for notebooks.

Owns `unicode`, `mathml` and `latex`. They take an expression as Potto writes it and display that very expression:
nothing is simplified or reordered. What does not parse is shown as it is.
"""

from potto.syntax.typesetting.broken_lines import broken
from potto.syntax.typesetting.in_latex import latex, latex_integral
from potto.syntax.typesetting.in_mathml import mathml
from potto.syntax.typesetting.in_unicode import unicode

__all__ = ["broken", "latex", "latex_integral", "mathml", "unicode"]
