"""Lines along one variable, and where a surface meets them while the variables around it are known by their labels.

Owns `Line` and `line`. Bounds further in may change along the line; there the surface is written in labels.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from msgspec import Struct

from potto.calculus.decomposition.surface_cuts import cut_along
from potto.calculus.decomposition.sweep import Level
from potto.core.simplify import simplify
from potto.core.terms import Integral, Term, add, mul, neg, sub, substitute, var
from potto.integrate.levels import LevelPlan, level_plan
from potto.kernels.cells import Array


class Line(Struct, frozen=True):
    """A surface along one variable, with the labels of the others given.

    follows: the variables further in whose bounds change along the line; in the surface they are written by their
    labels. None of `plan` if the surface does not vary along the line.
    """

    follows: frozenset[int]
    plan: LevelPlan | None


# Of a pair of bounds the one that is infinite: (which of the two, its sign); None if both are finite or both infinite.
End = tuple[int, float] | None


@lru_cache(maxsize=4096)
def line(term: Integral, surface: Term, pivot: int, last: int, ends: tuple[End, ...]) -> Line:
    """The line along variable number `pivot`, for a surface whose innermost variable is number `last`."""
    follows: list[int] = []
    moving = {term.variables[pivot]}
    for number in range(pivot + 1, last + 1):
        if any(b.free & moving for b in term.bounds[number]):
            moving.add(term.variables[number])
            follows.append(number)
    for number in reversed(follows):
        name = term.variables[number]
        surface = substitute(surface, {name: _by_label(*term.bounds[number], ends[number], var(label_name(name)))})
    if follows:
        surface = simplify(surface)
    name = term.variables[pivot]
    if name not in surface.free:
        return Line(frozenset(follows), None)
    level = Level(name, *term.bounds[pivot], (), (cut_along(surface, name),))
    return Line(frozenset(follows), level_plan(level, (), ()))


@lru_cache(maxsize=4096)
def leaving(term: Integral, surface: Term, pivot: int, last: int) -> LevelPlan:
    """Variable number `last` with cuts where the section along the pivot enters or leaves the pivot's bounds."""
    name = term.variables[last]
    ends = (substitute(surface, {term.variables[pivot]: bound}) for bound in term.bounds[pivot])
    cuts = tuple(cut_along(end, name) for end in map(simplify, ends) if name in end.free)
    return level_plan(Level(name, *term.bounds[last], (), cuts), (), ())


def _by_label(lo: Term, hi: Term, end: End, label: Term) -> Term:
    """The variable by its label; where a bound is infinite, by how far it is from the other (`offset`)."""
    if end is None:
        return add(lo, mul(sub(hi, lo), label))
    which, sign = end
    return add((hi, lo)[which], label if sign > 0 else neg(label))


def label_name(variable: str) -> str:
    return f"{variable}@label"


def offset(end: End, u: Array) -> Array:
    """What a label says of a variable whose bounds are not known yet: the label, or how far from the finite bound."""
    if end is None:
        return u
    with np.errstate(divide="ignore"):
        return u / (1 - u) if end[1] > 0 else (1 - u) / u
