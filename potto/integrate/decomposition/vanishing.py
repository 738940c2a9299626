"""Where an integrand is exactly zero, told from the sides of its surfaces alone.

Owns `vanishing_of`, which makes the test, `vanishes`, which asks it, and `held`, the sides that it asks for.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from potto.calculus.inlining.currying import arguments_of, sizes_of, uncurry
from potto.calculus.surfaces.finding import Resolve
from potto.calculus.surfaces.trace import layout, spine
from potto.core.terms import App, Branch, Const, If, Lam, ListOf, Prim, Proj, Term, Tuple, postorder, var
from potto.kernels.cells import Mask
from potto.primitives import EXACT

Numbers = Mapping[tuple[int, ...], tuple[Any, int]]  # groups, and orientations, by the paths of their branches


def vanishing_of(body: Term, numbers: Numbers, part: Term | None = None, resolve: Resolve = lambda head: None) -> Any:
    """A test on sides: True, False, or ("and" | "or", tests), or (group, orientation, then, orelse).

    part: what is tested, a part of the body that the paths of `numbers` are those of; all of it if None. resolve: gives
    the functions that are looked into where they are called.
    """
    return _tests(body, numbers, {}, resolve)[body if part is None else part]


def _tests(body: Term, numbers: Numbers, given: Mapping[Term, Any], resolve: Resolve) -> dict[Term, Any]:
    """The tests of all parts of a body. given: those of its parameters."""
    index = layout(body).index
    memo = dict(given)
    for node in postorder(body):
        if node not in given:
            site = index.get((node, 0)) if isinstance(node, App) else None
            memo[node] = (_zero(node, memo, index, numbers) if site is None or not isinstance(node, App)
                          else _called(node, memo, site, numbers, resolve))  # fmt: skip
    return memo


def _called(call: App, memo: dict[Term, Any], site: int, numbers: Numbers, resolve: Resolve) -> Any:
    """The test of what a function gives, in which some of its branches are told from sides."""
    inner = {path[1:]: place for path, place in numbers.items() if path[:1] == (site,) and path[1:]}
    head, groups = spine(call)
    function = resolve(head) if inner else None
    if not isinstance(function, Lam):
        return False
    params, body = uncurry(function, sizes_of(groups))
    args = arguments_of(function, groups)
    if len(args) != len(params):
        return False
    given: dict[Term, Any] = {var(name): memo.get(arg, False) for name, arg in zip(params, args, strict=True)}
    return _tests(body, inner, given, resolve)[body]


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


def held(test: Any) -> dict[Any, int]:
    """The groups of which one side has to hold, 1 or -1, where an integrand does not vanish."""
    if isinstance(test, bool):
        return {}
    if test[0] == "or":
        return {group: side for part in test[1:] for group, side in held(part).items()}
    if test[0] == "and":
        first, *rest = map(held, test[1:])
        return {group: side for group, side in first.items() if all(other.get(group) == side for other in rest)}
    _, group, orientation, then, orelse = test
    if then is True:
        return {**held(orelse), group: -orientation}
    return {**held(then), group: orientation} if orelse is True else {}
