"""Which terms interval arithmetic can evaluate: their zeros can be searched for with certainty.

Owns `enclosable` and `searchable`. The rules are those of the entries, which `integrate/rules/intervals`
does to batches.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

from potto.calculus.algebra.degree import value_parts
from potto.calculus.algebra.ranges import ARITHMETIC, RANGES
from potto.calculus.differentiation.derivative import NotSmooth, partial
from potto.core.simplify import simplify
from potto.core.terms import (
    Array,
    Branch,
    Const,
    Data,
    Fold,
    Global,
    If,
    Index,
    Length,
    ListOf,
    Prim,
    Proj,
    Sum,
    Term,
    Told,
    Tuple,
    Var,
)

_WRITTEN_OUT = Sum | Fold | Array | Index | Length | ListOf | Tuple | Data


def enclosable(term: Term, jumps: bool = False) -> bool:
    """Whether a term can be enclosed: arithmetic and builtins, sums of such, and brackets if it may jump.

    Sums, folds and arrays are written out before any number is asked for (`unrolled`), and what plain conditionals
    decide is decided.
    """
    return _smooth(term) or (jumps and _jumping(term))


def _can_be(node: Term, jumps: bool) -> bool:
    """Whether a term can be enclosed where its parts can."""
    return (
        isinstance(node, Const | Var | If | _WRITTEN_OUT)
        or (isinstance(node, Proj) and isinstance(node.term, Proj | Var | Index | Fold))
        or (isinstance(node, Prim) and (node.op in ARITHMETIC or RANGES.knows(node.op)))
        or (jumps and isinstance(node, Branch))
    )


def _parts(node: Term) -> Sequence[Term]:
    """What is asked for an enclosure; an array that has a definition of its own is read beside the integral."""
    match node:
        case Index(array=array, index=place) if _defined(array):
            return (place,)
        case Length(array=array) if _defined(array):
            return ()
        case _:
            return value_parts(node)


_smooth = Told[bool](lambda node, parts: all(parts) and _can_be(node, False), _parts)
_jumping = Told[bool](lambda node, parts: all(parts) and _can_be(node, True), _parts)


def _defined(array: Term) -> bool:
    """Whether an array is a definition, or a part of one, as a column of a table is."""
    while isinstance(array, Proj):
        array = array.term
    return isinstance(array, Global)


@lru_cache(maxsize=4096)
def slope_of(surface: Term, variable: str) -> Term | None:
    """The surface's derivative along the variable if both can be enclosed."""
    if not enclosable(surface, jumps=True):
        return None
    try:
        slope = simplify(partial(surface, variable))
    except NotSmooth:
        return None
    return slope if enclosable(slope, jumps=True) else None


def searchable(surface: Term, variable: str) -> bool:
    """Whether the zeros of a surface along a variable can be searched for so that none is missed."""
    return enclosable(surface) and slope_of(surface, variable) is not None
