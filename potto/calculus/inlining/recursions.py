"""Recursions written out for the values at hand, before derivatives are taken of them.

Owns `recursions_unrolled`. The jumps of a recursion are seen once its calls are carried out as deep as they go: then
the deltas of its derivative are those of a formula.
"""

from __future__ import annotations

from itertools import chain

from potto.calculus.inlining.currying import sizes_of, uncurry
from potto.calculus.inlining.expand import Resolve, known_function
from potto.calculus.inlining.unrolled import unrolled
from potto.calculus.surfaces.finding import Decide
from potto.calculus.surfaces.trace import spine
from potto.core.terms import (
    App,
    Deriv,
    Lam,
    Term,
    app,
    deriv,
    fresh,
    lam,
    postorder,
    proj,
    substitute,
    transform,
    var,
)


def recursions_unrolled(term: Term, resolve: Resolve, decide: Decide) -> Term | None:
    """An equal term in which calls are carried out as deep as plain conditions say, also in functions that are derived;
    None if there are too many.

    resolve: what the names of definitions stand for. decide: what plain conditions come to.
    """
    whole = unrolled(term, lambda head: known_function(head, resolve, None), decide)
    if whole is None:
        return None
    found: dict[Term, Term] = {}
    for call in postorder(whole):
        if isinstance(call, App) and isinstance(spine(call)[0], Deriv):
            opened = _opened(call, resolve, decide)
            if opened is None:
                return None
            found[call] = opened
    return transform(whole, lambda node, new: _with_arguments(found[node], new) if node in found else new)


def _opened(call: App, resolve: Resolve, decide: Decide) -> Term | None:
    """The function that a call of a derivative is of, written out for the values in the duals that it is given; the
    derivative as it is where the function is not known."""
    head, groups = spine(call)
    order, inner = 0, head
    while isinstance(inner, Deriv):
        order, inner = order + 1, inner.function
    function = known_function(inner, resolve, None)
    if function is None:
        return head
    params, body = uncurry(function, sizes_of(groups))
    values = tuple(chain.from_iterable(groups))
    if len(params) != len(values):
        return head
    taken = {*call.free, *params, *(name for node in postorder(body) for name in node.free)}
    here: dict[str, Term] = {}
    names = []
    for param, value in zip(params, values, strict=True):
        name = fresh(param, taken)
        taken.add(name)
        names.append(name)
        here[name] = _primal(value, order)
    renamed = substitute(body, {param: var(name) for param, name in zip(params, names, strict=True)})
    opened = recursions_unrolled(renamed, resolve, lambda plain: decide(substitute(plain, here)))
    if opened is None:
        return None
    made: Term = opened
    rest = list(names)
    for group in reversed(groups):
        made = lam(tuple(rest[len(rest) - len(group) :]), made)
        del rest[len(rest) - len(group) :]
    for _ in range(order):
        made = deriv(made)
    return made


def _primal(value: Term, order: int) -> Term:
    """The value of a dual, or of a dual of duals; functions are given as derivatives of functions."""
    for _ in range(order):
        value = value.function if isinstance(value, Deriv) else value if isinstance(value, Lam) else proj(value, 0)
    return value


def _with_arguments(function: Term, call: Term) -> Term:
    """A call of another function."""
    for group in spine(call)[1] if isinstance(call, App) else ():
        function = app(function, group)
    return function
