"""Integrals of integrals as one integral over all of their variables.

Owns `joined`. `integral A (integral B f d(y)) d(x)` means the integral of f over the region that both bounds describe.
As one integral its variables can change places, a surface may be cut along any of them, and nothing is lost to the
accuracy of an inner result: nested, a ball that touches its box has an inner integral that behaves like a square root.

An inner integral that does not vary with the variables around it stays: it is one number, found once.
"""

from __future__ import annotations

from potto.calculus.decomposition.guards import is_guard
from potto.calculus.inlining.currying import arguments_of, sizes_of, uncurry
from potto.calculus.inlining.expand import Resolve, Step, driven, named
from potto.calculus.surfaces.trace import spine
from potto.core.binders import apart
from potto.core.terms import (
    ZERO,
    App,
    Branch,
    Deriv,
    Global,
    If,
    Integral,
    Lam,
    Prim,
    Term,
    apply,
    bound_apart,
    if_,
    integral,
    postorder,
    substitute,
)

NONE = ZERO  # what is no integral that could be joined


def joined(term: Integral, resolve: Resolve) -> Integral:
    """An equal integral, or the same one where nothing can be joined. `resolve` gives the terms of definitions."""
    changed = False
    while True:
        inner = driven(_inner(term.body, frozenset(term.variables), resolve, frozenset()))
        if not isinstance(inner, Integral):
            return apart(term) if changed else term  # type: ignore[return-value]
        term, changed = _one(term, inner), True


def _one(outer: Integral, inner: Integral) -> Integral:
    inner = bound_apart(inner, outer.free.union(outer.variables))
    return integral(
        outer.variables + inner.variables, outer.bounds + inner.bounds, inner.body, outer.hints + inner.hints
    )


def _inner(body: Term, around: frozenset[str], resolve: Resolve, within: frozenset[Term]) -> Step:
    """The body as an integral that varies with the variables around it, and whose bounds do not jump with them; else
    NONE. within: the definitions that are being looked into, none of which is within itself."""
    match body:
        case Integral():
            jumps = any(isinstance(n, Branch | App) for pair in body.bounds for b in pair for n in postorder(b))
            return body if body.free & around and not jumps else NONE
        case Prim(op="neg", args=(arg,)):
            return _with((yield _inner(arg, around, resolve, within)), body, 0)
        case Prim(op="div", args=(above, below)) if not _heavy(below):
            return _with((yield _inner(above, around, resolve, within)), body, 0)
        case Prim(op="mul"):
            return (yield _among_factors(body, around, resolve, within))
        case If() if is_guard(body) and body.condition.free.isdisjoint(around):
            inner = yield _inner(body.then, around, resolve, within)
            if not isinstance(inner, Integral):
                return NONE
            inner = bound_apart(inner, body.condition.free)
            return _over(inner, if_(body.condition, inner.body, body.orelse))
        case App():
            head, _ = spine(body)
            made = None if head in within else _called(body, resolve)
            if made is None:
                return NONE
            return (yield _inner(made, around, resolve, within | {head} if isinstance(head, Global) else within))
        case _:
            return NONE


def _among_factors(body: Prim, around: frozenset[str], resolve: Resolve, within: frozenset[Term]) -> Step:
    """Of a product the only factor that is an integral, with the others inside of it."""
    heavy = [at for at, factor in enumerate(body.args) if _heavy(factor) or isinstance(factor, App)]
    found = list[tuple[int, Term]]()
    for at in heavy:
        inner = yield _inner(body.args[at], around, resolve, within)
        if isinstance(inner, Integral):
            found.append((at, inner))
    others = [at for at in heavy if all(at != place for place, _ in found)]
    if len(found) != 1 or any(_heavy(body.args[at]) for at in others):
        return NONE
    at, inner = found[0]
    return _with(inner, body, at)


def _with(inner: Term, body: Prim, at: int) -> Term:
    """The integral with what the body does to it done to its integrand."""
    if not isinstance(inner, Integral):
        return NONE
    inner = bound_apart(inner, body.free)
    args = list(body.args)
    args[at] = inner.body
    return _over(inner, apply(body.op, *args))


def _heavy(term: Term) -> bool:
    return any(isinstance(node, Integral) for node in postorder(term))


def _over(term: Integral, body: Term) -> Integral:
    return integral(term.variables, term.bounds, body, term.hints)


def _called(call: App, resolve: Resolve) -> Term | None:
    """What a call of a definition gives, if that may be an integral."""
    head, groups = spine(call)
    if isinstance(head, Global):
        head = named(head, resolve) or head
    if not isinstance(head, Lam):
        return None
    params, body = uncurry(head, sizes_of(groups))
    args = arguments_of(head, groups)
    if len(args) != len(params) or isinstance(body, Deriv) or (isinstance(body, If) and not is_guard(body)):
        return None
    return substitute(body, dict(zip(params, args, strict=True)))
