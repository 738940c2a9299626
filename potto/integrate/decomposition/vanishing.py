"""Where an integrand is exactly zero, told from the sides of its surfaces alone.

Owns `vanishing_of`, which makes the test, and `vanishes`, which asks it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from potto.calculus.surfaces.trace import layout
from potto.core.terms import Branch, Const, If, ListOf, Prim, Proj, Term, Tuple, postorder
from potto.kernels.cells import Mask
from potto.primitives import EXACT


def vanishing_of(body: Term, numbers: Mapping[tuple[int, ...], tuple[int, int]], part: Term | None = None) -> Any:
    """A test on sides: True, False, or ("and" | "or", tests), or (group, orientation, then, orelse).

    part: what is tested, a part of the body that the paths of `numbers` are those of; all of it if None.
    """
    index = layout(body).index
    memo: dict[Term, Any] = {}
    for node in postorder(body):
        memo[node] = _zero(node, memo, index, numbers)
    return memo[body if part is None else part]


def _zero(node: Term, memo: dict[Term, Any], index: Mapping[tuple[Term, int], int], numbers: Any) -> Any:
    match node:
        case Const():
            return node.value == 0
        case Prim(op="mul"):
            return _join("or", [memo[a] for a in node.args], True)
        case Prim(op="add"):
            return _join("and", [memo[a] for a in node.args], False)
        case Prim(op="div"):
            return memo[node.args[0]]
        case Prim(op=op, args=(inner,)) if EXACT.get((op, 0.0)) == 0:
            return memo[inner]
        case Branch():
            place = numbers.get((index.get((node, 2), -1),))
            then, orelse = memo[node.then], memo[node.orelse]
            if place is None or (then is False and orelse is False):
                return _join("and", [then, orelse], False)
            return ("side", *place, then, orelse)
        case If():
            return _join("and", [memo[node.then], memo[node.orelse]], False)
        case Tuple() | ListOf():
            return _join("and", [memo[a] for a in node.items], False)
        case Proj():
            return memo[node.term]
        case _:
            return False


def _join(how: str, tests: list[Any], decisive: bool) -> Any:
    """`decisive` is the value of one test that settles the whole."""
    if any(t is decisive for t in tests):
        return decisive
    rest = tuple(t for t in tests if t is not (not decisive))
    if not rest:
        return not decisive
    return rest[0] if len(rest) == 1 else (how, *rest)


def vanishes(test: Any, sides: Mapping[int, Mask]) -> Any:
    """Evaluate a vanishing test on sides: False, True or a mask."""
    if isinstance(test, bool):
        return test
    if test[0] == "side":
        _, group, orientation, then, orelse = test
        mask = sides.get(group)
        a, b = vanishes(then, sides), vanishes(orelse, sides)
        if mask is None:
            return a & b
        if orientation < 0:
            a, b = b, a
        return (mask & a) | (np.logical_not(mask) & b)
    result = vanishes(test[1], sides)
    for inner in test[2:]:
        result = result | vanishes(inner, sides) if test[0] == "or" else result & vanishes(inner, sides)
    return result
