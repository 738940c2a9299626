"""The probability measures of Potto.

Owns nothing itself: importing it registers every entry in `MEASURES`, and what makes measures of them in
`COMPOSITIONS`. See `registry` for what an entry says.
"""

from potto.measures import bounded, discrete, shaped, unbounded  # noqa: F401  (imported for their entries)
from potto.measures.composed import COMPOSITIONS
from potto.measures.registry import MEASURES, Measure, register

__all__ = ["COMPOSITIONS", "MEASURES", "Measure", "register"]
