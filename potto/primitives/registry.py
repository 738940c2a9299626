"""The one table of builtins.

Owns `Primitive` and `PRIMITIVES`. An entry says all that there is to say about a builtin; parser, checker, hover,
completion, derivative, kernels, inversion, docs and tests read it. numpy is named, never imported, on this floor.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from potto.core.terms import Term

Terms = tuple[Term, ...]


def _none(*args: Term) -> Terms:
    return ()


@dataclass(frozen=True)
class Primitive:
    """One builtin.

    name: as core terms (and, unless `surface` is False, programs) call it.
    arity: number of arguments; None for any number (add, mul, min, max take two or more).
    numpy: the name of a ufunc: "sqrt" is numpy's, "special.erf" is scipy.special's, "potto.xyz" is one of
        potto.kernels.ufuncs (for `clamp` and the like).
    mpmath: the name of the function in mpmath, or of one in potto.core.reference.
    partials: the partial derivatives as terms over the arguments; None for a builtin that jumps.
    plain: takes plain values only (sign, floor, ceil).
    domain: per argument an interval where it is defined and tests may sample: a promise.
    kinks: terms over the arguments whose zeros are kinks (abs: x; max: a - b).
    edges: terms over the arguments that are 0 at the edge of the domain and where the builtin or its derivative is
        singular (sqrt: x; log: x; asin: 1 - x, 1 + x).
    inverse: for a builtin of one argument, given y: the solutions x of f(x) = y on the principal branch(es), as terms,
        nan where there is none (sqrt: y^2 where y >= 0; abs: y and -y; sin: asin y). None if not invertible so.
    period: for periodic ones, the period of f and further solutions of f(x) = y within one period
        (sin: 2 pi, (pi - asin y,)).
    increasing: +1 strictly increasing on its domain, -1 decreasing, 0 neither.
    doc: one or two sentences for a person.
    example: an expression of Potto that a doc page shows, with its value.
    """

    name: str
    arity: int | None
    numpy: str
    mpmath: str
    doc: str
    partials: Callable[..., Terms] | None = None
    plain: bool = False
    surface: bool = True
    domain: tuple[tuple[float, float], ...] = ()
    kinks: Callable[..., Terms] = field(default=_none)
    edges: Callable[..., Terms] = field(default=_none)
    inverse: Callable[[Term], Terms] | None = None
    period: Callable[[Term], tuple[Term, Terms]] | None = None
    increasing: int = 0
    truth: bool = False
    example: str = ""


PRIMITIVES: dict[str, Primitive] = {}


def register(primitive: Primitive) -> Primitive:
    if primitive.name in PRIMITIVES:
        raise ValueError(f"builtin {primitive.name} is registered twice")
    PRIMITIVES[primitive.name] = primitive
    return primitive
