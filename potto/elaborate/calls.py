"""Calls: which argument goes where, and what can be carried out at once.

Owns `apply`. Keywords bind by name, in any place of any group; the other arguments fill the parameters that are left,
in order. A group of several parameters also takes one tuple, and a single parameter several arguments as a tuple. A
function that is known as a lambda is applied on the spot.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from potto.core import terms as core
from potto.core.terms import Lam, Term, Tuple
from potto.elaborate.signatures import Signature, of_term
from potto.primitives import PRIMITIVES
from potto.syntax import nodes
from potto.syntax.nodes import Expr

if TYPE_CHECKING:
    from potto.elaborate.expressions import Elaborator

Env = Mapping[str, Term]
NoteBranch = Callable[[Term, Term], None]
PROJECTIONS = {"fst": 0, "snd": 1}


def apply(e: Elaborator, expr: nodes.Apply, env: Env) -> Term:
    """One group of arguments given to a function."""
    head = _unwrapped(expr.function)
    if isinstance(head, nodes.Name) and e.is_free(head.id, env):
        special = _builtin(e, head.id, expr, env)
        if special is not None:
            return special
    function = e.expr(expr.function, env)
    positional = [e.expr(a.value, env) for a in expr.arguments if a.name is None]
    keywords = {a.name: e.expr(a.value, env) for a in expr.arguments if a.name is not None}
    known = of_term(e.db, function)
    if isinstance(function, core.Hole):
        return function
    if known is None:
        if keywords:
            return core.hole("arguments by name need a function whose parameters are known")
        return e.note(core.app(function, tuple(positional)), expr.span)
    filled = fill(known, positional, keywords)
    if filled is None:
        return core.hole("the arguments of this call do not fit the function's parameters")
    result = function
    for group in filled:
        result = _given(e, result, group, expr)
    return result


def _unwrapped(expr: Expr) -> Expr:
    while isinstance(expr, nodes.Paren):
        expr = expr.inner
    return expr


def _given(e: Elaborator, function: Term, group: tuple[Term, ...], expr: nodes.Apply) -> Term:
    if isinstance(function, Lam) and len(function.params) == len(group):
        return core.substitute(function.body, dict(zip(function.params, group, strict=True)))
    return e.note(core.app(function, group), expr.span)


def _builtin(e: Elaborator, name: str, expr: nodes.Apply, env: Env) -> Term | None:
    """A builtin, `fst`, `snd`, `deriv` or `delta` applied; None for any other name."""
    if name not in PROJECTIONS and name not in ("deriv", "delta") and not (
        name in PRIMITIVES and PRIMITIVES[name].surface
    ):
        return None
    args = [e.expr(a.value, env) for a in expr.arguments]
    if any(a.name is not None for a in expr.arguments):
        return core.hole(f"the arguments of `{name}` have no names")
    if name == "deriv":
        return core.deriv(args[0]) if len(args) == 1 else core.hole("`deriv` takes one function")
    if name == "delta":
        coordinates = args[0].items if len(args) == 1 and isinstance(args[0], Tuple) else tuple(args)
        if len(coordinates) == 1 and isinstance(coordinates[0], core.App):
            coordinates = (core.proj(coordinates[0], 0),) if _gives_tuple(e, coordinates[0]) else coordinates
        return e.note(core.delta(tuple(coordinates)), expr.span)
    if name in PROJECTIONS:
        pair = args[0] if len(args) == 1 else core.tuple_(args)
        return core.proj(pair, PROJECTIONS[name])
    entry = PRIMITIVES[name]
    if len(args) == 1 and isinstance(args[0], Tuple) and entry.arity != 1:
        args = list(args[0].items)
    if (entry.arity is not None and len(args) != entry.arity) or (entry.arity is None and len(args) < 2):
        return core.hole(f"`{name}` is given {len(args)} argument(s)")
    return core.apply(name, *args)


def _gives_tuple(e: Elaborator, term: Term) -> bool:
    """Whether a call leads to a diffeomorphism, whose result is a tuple: its definition says so."""
    from potto.modules import definition

    while isinstance(term, core.App):
        term = term.function
    if isinstance(term, core.Global):
        item = definition(e.db, term.module, term.name)
        if isinstance(item, nodes.DiffeoDefinition):
            return True
        return isinstance(item, nodes.Definition) and _body_is_tuple(item.body)
    return False


def _body_is_tuple(body: Expr) -> bool:
    while isinstance(body, (nodes.Lambda, nodes.Paren)):
        body = body.body if isinstance(body, nodes.Lambda) else body.inner
    return isinstance(body, (nodes.Tuple, nodes.InlineDiffeo))


def fill(
    groups: Signature, positional: list[Term], keywords: Mapping[str, Term]
) -> tuple[tuple[Term, ...], ...] | None:
    """The arguments of one call by groups of parameters; whole groups only. None where they do not fit."""
    if not groups:
        return None
    first = groups[0]
    if not keywords and len(positional) == 1 and len(first) > 1:
        whole = positional[0]
        items = whole.items if isinstance(whole, Tuple) else tuple(core.proj(whole, i) for i in range(len(first)))
        return (items,) if len(items) == len(first) else None
    if not keywords and len(first) == 1 and len(positional) > 1 and len(groups) == 1:
        return ((core.tuple_(positional),),)
    slots: list[list[Term | None]] = [[None] * len(group) for group in groups]
    for name, value in keywords.items():
        place = next(((g, i) for g, group in enumerate(groups) for i, n in enumerate(group) if n == name), None)
        if place is None or slots[place[0]][place[1]] is not None:
            return None
        slots[place[0]][place[1]] = value
    rest = iter(positional)
    for group in slots:
        for i, value in enumerate(group):
            if value is None:
                group[i] = next(rest, None)
    if next(rest, None) is not None:
        return None
    filled: list[tuple[Term, ...]] = []
    for group in slots:
        given = [v for v in group if v is not None]
        if len(given) == len(group):
            filled.append(tuple(given))
        elif given:
            return None
        else:
            break
    return tuple(filled) if filled and sum(map(len, filled)) == len(positional) + len(keywords) else None
