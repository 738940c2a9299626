"""Integrals in which some variables count through one number only, that has a density of its own.

Owns `Distributed` and `distributed`. In

    integral of w(a, b) u(c, d) h(a + b, c + d) over a, b, c, d

what is left after a and b depends on a + b, which is one number, but after a, b and c on two: a + b and c. With

    p(v) = integral of u(c, d) delta(c + d - v) over c, d

it is an integral of w(a, b) p(v) h(a + b, v) over a, b and v, and so for every number inside of an integrand whose
variables are nowhere else but in factors of their own.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

from msgspec import Struct

from potto.calculus.decomposition.factors import Names, factors
from potto.calculus.differentiation.deltas import without_deltas
from potto.calculus.differentiation.derivative import NotSmooth
from potto.calculus.solving.pivots import NoClosedForm
from potto.core.terms import (
    Delta,
    Integral,
    Prim,
    Term,
    delta,
    integral,
    mul,
    postorder,
    replaced,
    sub,
    var,
    with_integrand,
)
from potto.diagnostics import PottoError

FEWEST = 4  # variables of an integral: of three, one is integrated for each pair of the others in no time
HINTS = 7  # places at which rules look at a density
DENSITY = "@density"  # behind the name of the first variable that a number is made of


class Distributed(Struct, frozen=True):
    """An integral with a number `variable` in the place of some variables, `over`, that it is made of.

    term: it without the density of the number, that is from `variable#low` to `variable#high`. number: what it is of
    the variables. densities: integrals over fewer of the variables, of the number, whose sum is its density.
    """

    term: Integral
    variable: str
    number: Term
    over: Integral
    densities: tuple[Integral, ...]


def ends_of(variable: str) -> tuple[str, str]:
    """The names of the least and the greatest that a number may be."""
    return f"{variable}#low", f"{variable}#high"


def hints_of(variable: str) -> tuple[str, ...]:
    """The names of the places between which a number is as a rule, and beyond which hardly ever."""
    return tuple(f"{variable}#hint{number}" for number in range(HINTS))


@lru_cache(maxsize=1024)
def distributed(term: Integral) -> tuple[Distributed, ...]:
    """The integral with one number in the place of what it is made of, in every way that is known, the smallest first:
    of the terms over the same variables the innermost one that does, a + b of (a + b)^2."""
    names = frozenset(term.variables)
    if len(names) < FEWEST or any(isinstance(node, Delta) for node in postorder(term.body)):
        return ()
    found: dict[Names, Distributed] = {}
    for node in postorder(term.body):
        group = node.free & names
        if group in found or not isinstance(node, Prim) or not 1 < len(group) < len(names):
            continue
        if any(name.endswith(DENSITY) for name in group):
            continue  # its own density is not among the factors
        if (way := _put(term, group, node)) is not None:
            found[group] = way
    return tuple(sorted(found.values(), key=lambda way: len(way.over.variables)))


def _put(term: Integral, group: Names, number: Term) -> Distributed | None:
    """With a number in the place of a group of variables; None where these are elsewhere too, or it has no density."""
    names = frozenset(term.variables)
    rows = list(zip(term.variables, term.bounds, term.hints, strict=True))
    for variable, bounds, hints in rows:
        met = frozenset().union(*(place.free for place in (*bounds, *hints))) & names
        if met - group if variable in group else met & group:
            return None
    every = [(factor, factor.free & names) for factor in factors(term.body)]
    variable = next(name for name in term.variables if name in group) + DENSITY
    own = [factor for factor, met in every if met and met <= group]
    there = replaced(mul(*(factor for factor, met in every if not met or not met <= group)), {number: var(variable)})
    if there.free & group or variable not in there.free:
        return None
    over = _over([row for row in rows if row[0] in group], mul(*own))
    densities = _densities(with_integrand(over, mul(over.body, delta((sub(number, var(variable)),)))))
    if not densities:
        return None
    low, high = ends_of(variable)
    kept = [
        *(row for row in rows if row[0] not in group),
        (variable, (var(low), var(high)), tuple(map(var, hints_of(variable)))),
    ]
    return Distributed(_over(kept, there), variable, number, over, densities)


def _over(rows: Sequence[tuple[str, tuple[Term, Term], tuple[Term, ...]]], body: Term) -> Integral:
    """An integral over these variables, with their bounds and hints."""
    variables, bounds, hints = (tuple(column) for column in zip(*rows, strict=True))
    found = integral(variables, bounds, body, hints)
    assert isinstance(found, Integral)
    return found


def _densities(over: Integral) -> tuple[Integral, ...]:
    """The integrals that one with a delta is the sum of; none where the delta has no closed form."""
    try:
        whole = without_deltas(over)
    except (NoClosedForm, NotSmooth, PottoError):
        return ()
    parts = whole.args if isinstance(whole, Prim) and whole.op == "add" else (whole,)
    found = tuple(part for part in parts if isinstance(part, Integral))
    plain = not any(isinstance(node, Delta) for node in postorder(whole))
    return found if plain and len(found) == len(parts) else ()
