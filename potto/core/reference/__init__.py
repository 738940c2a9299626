"""The oracle: core terms evaluated on mpmath numbers, as slowly and as simply as can be.

Owns `evaluate`. It shares no code with the evaluator that people use: a tree walk, integrals by iterated tanh-sinh
quadrature between the points where the integrand decides differently, derivatives by differences of the value. Only
tests and checks import it; mpmath is an optional dependency.
"""

from potto.core.reference.functions import function
from potto.core.reference.integrals import NotAccurate
from potto.core.reference.sampling import zero_at_all
from potto.core.reference.walk import evaluate

__all__ = [
    "NotAccurate",
    "evaluate",
    "function",
    "zero_at_all",
]
