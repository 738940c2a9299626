"""The one table of probability measures.

Owns `Measure` and `MEASURES`. `integral (x ~ normal(m, s)) body d(x)` is the integral of density * body over the
support. An entry is all that there is to say about a measure; elaboration, checker, sampling, docs and tests read it.
"""

from __future__ import annotations

from collections.abc import Callable

from msgspec import Struct, field

from potto.core.terms import Term

Terms = tuple[Term, ...]
Condition = tuple[Term, str]  # a truth-valued term over the parameters, and what to say where it does not hold


def _none(*parameters: Term) -> Terms:
    return ()


class Measure(Struct, frozen=True):
    """One measure. All callables take terms: the parameters, for some after the variable.

    name: as programs call it.
    parameters: their names, in order.
    support: the interval outside of which the density is 0; it gives the bounds of the integral, so that no mask is
        needed and moving ends are moving bounds.
    density: over the variable and the parameters, inside of the support; it integrates to 1.
    hints: points between which the density is smooth and not too steep; the integrator cuts there, nothing else
        depends on them. In ascending order.
    discrete: whether it is one of whole numbers: the support is the first and the last of them, the density the chance
        of each, and an expectation a sum.
    reach: of a discrete measure with infinite support, from a number of it (before the parameters) how far a sum that
        begins there goes at least: what lies beyond has less than 1e-20 of the chance of what lies between, and falls
        faster than any geometric series.
    cdf: the integral of the density up to x; None if it is not a formula of builtins.
    quantile: the inverse of the cdf; None if it is not a formula of builtins.
    mean, variance: None where they do not exist.
    valid: conditions that the parameters must meet.
    domain: per parameter an interval in which tests may sample it; they discard what is not valid.
    """

    name: str
    parameters: tuple[str, ...]
    support: Callable[..., tuple[Term, Term]]
    density: Callable[..., Term]
    mean: Callable[..., Term] | None
    variance: Callable[..., Term] | None
    valid: Callable[..., tuple[Condition, ...]]
    domain: tuple[tuple[float, float], ...]
    doc: str
    example: str
    hints: Callable[..., Terms] = field(default=_none)
    discrete: bool = False
    reach: Callable[..., Term] | None = None
    cdf: Callable[..., Term] | None = None
    quantile: Callable[..., Term] | None = None

    def counted(self, *parameters: Term) -> tuple[Term, Term]:
        """Of a discrete measure, the first and the last number that a sum goes over."""
        first, last = self.support(*parameters)
        return first, last if self.reach is None else self.reach(first, *parameters)


MEASURES: dict[str, Measure] = {}


def register(measure: Measure) -> Measure:
    if measure.name in MEASURES:
        raise ValueError(f"measure {measure.name} is registered twice")
    MEASURES[measure.name] = measure
    return measure
