"""Integrals in which some variables count through one number only, that has a density of its own.

Owns `Distributed` and `distributed`. In

    integral of w(a, b) u(c, d) h(a + b, c + d) over a, b, c, d

what is left after a and b depends on a + b, which is one number, but after a, b and c on two: a + b and c. With

    p(v) = integral of u(c, d) delta(c + d - v) over c, d

it is an integral of w(a, b) p(v) h(a + b, v) over a, b and v, and so for every number inside of an integrand whose
variables are nowhere else but in factors of their own. Such a number may be part of another one, as in a tree of sums
and extremes: p stands for a function of which no formula is known.
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
    ONE,
    ZERO,
    App,
    Branch,
    Delta,
    Integral,
    Prim,
    Term,
    Var,
    add,
    app,
    branch,
    delta,
    integral,
    mul,
    postorder,
    replaced,
    sub,
    transform,
    var,
    with_integrand,
)
from potto.diagnostics import PottoError
from potto.primitives import PRIMITIVES

FEWEST = 4  # variables of an integral: of three, one is integrated for each pair of the others in no time
HINTS = 7  # places at which rules look at a density
DENSITY = "@density"  # behind the name of the first variable that a number is made of
UNKNOWN = "#density"  # behind the name of a number, of the function that its density is


class Distributed(Struct, frozen=True):
    """An integral with a number `variable` in the place of some variables, `over`, that it is made of.

    term: it, over the number from `variable#low` to `variable#high` with its density as a factor. number: what it is of
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


def density_at(term: Term) -> tuple[str, Term] | None:
    """Whose density a term is, and where; None of any other term."""
    match term:
        case App(function=Var(name=name), args=(place,)) if name.endswith(UNKNOWN):
            return name.removesuffix(UNKNOWN), place
    return None


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
    itself = app(var(variable + UNKNOWN), (var(variable),))
    there = replaced(mul(*(factor for factor, met in every if not met or not met <= group)), {number: var(variable)})
    if there.free & group or variable not in there.free:
        return None
    over = _over([row for row in rows if row[0] in group], mul(*own))
    densities = _densities(over, number, var(variable))
    if not densities:
        return None
    low, high = ends_of(variable)
    kept = [
        *(row for row in rows if row[0] not in group),
        (variable, (var(low), var(high)), tuple(map(var, hints_of(variable)))),
    ]
    return Distributed(_over(kept, mul(itself, there)), variable, number, over, densities)


def _over(rows: Sequence[tuple[str, tuple[Term, Term], tuple[Term, ...]]], body: Term) -> Integral:
    """An integral over these variables, with their bounds and hints."""
    variables, bounds, hints = (tuple(column) for column in zip(*rows, strict=True))
    found = integral(variables, bounds, body, hints)
    assert isinstance(found, Integral)
    return found


def _densities(over: Integral, number: Term, value: Term) -> tuple[Integral, ...]:
    """The integrals that the density of a number at a value is the sum of; none where it can't be solved for."""
    try:
        whole = without_deltas(with_integrand(over, mul(over.body, _where(number, value))))
    except (NoClosedForm, NotSmooth, PottoError):
        return ()
    parts = whole.args if isinstance(whole, Prim) and whole.op == "add" else (whole,)
    found = tuple(_upwards(part) for part in parts if isinstance(part, Integral))
    plain = not any(isinstance(node, Delta) for node in postorder(whole))
    return found if plain and len(found) == len(parts) else ()


def _where(number: Term, value: Term) -> Term:
    """A delta of a number at a value; of what is the greatest or the least, one of each that it may be, where it is."""
    if not (chosen := extremes(number)):
        return delta((sub(number, value),))
    bent = chosen[0]
    margin, *cases = PRIMITIVES[bent.op].cases(*bent.args)  # type: ignore[misc]
    yes, no = (_where(replaced(number, {bent: case}), value) for case in cases)
    return add(mul(branch((margin,), False, ONE, ZERO), yes), mul(branch((margin,), False, ZERO, ONE), no))


def extremes(term: Term) -> list[Prim]:
    """The parts of a term that are what the greater is of two, or the less, or chosen in another such way."""
    return [node for node in postorder(term) if isinstance(node, Prim) and node.free and PRIMITIVES[node.op].cases]


def _upwards(term: Integral) -> Integral:
    """An integral where numbers run from the least that they may be to the greatest, so that no case asks."""

    def change(_: Term, new: Term) -> Term:
        match new:
            case Branch(coordinates=(surface, *_), then=then) if surface in ordered:
                return then
        return new

    names = {name.removesuffix(UNKNOWN) for name in term.body.free if name.endswith(UNKNOWN)}
    ordered = {sub(var(high), var(low)) for low, high in map(ends_of, names)}
    return with_integrand(term, transform(term.body, change))
