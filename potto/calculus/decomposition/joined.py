"""Integrals of integrals as one integral over all of their variables.

Owns `joined`. `integral A (integral B f d(y)) d(x)` means the integral of f over the region that both bounds describe.
As one integral its variables can change places, a surface may be cut along any of them, and nothing is lost to the
accuracy of an inner result: nested, a ball that touches its box has an inner integral that behaves like a square root.

An inner integral that does not vary with the variables around it stays: it is one number, found once.
"""

from __future__ import annotations

from potto.calculus.decomposition.guards import is_guard
from potto.calculus.inlining.currying import arguments_of, sizes_of, uncurry
from potto.calculus.inlining.expand import Resolve
from potto.calculus.surfaces.trace import spine
from potto.core.binders import apart
from potto.core.terms import (
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

MOST_CALLS = 20  # calls behind calls that are looked into


def joined(term: Integral, resolve: Resolve) -> Integral:
    """An equal integral, or the same one where nothing can be joined. `resolve` gives the terms of definitions."""
    changed = False
    while True:
        inner = _inner(term.body, frozenset(term.variables), resolve, MOST_CALLS)
        if inner is None:
            return apart(term) if changed else term  # type: ignore[return-value]
        term, changed = _one(term, inner), True


def _one(outer: Integral, inner: Integral) -> Integral:
    inner = bound_apart(inner, outer.free.union(outer.variables))
    return integral(
        outer.variables + inner.variables, outer.bounds + inner.bounds, inner.body, outer.hints + inner.hints
    )


def _inner(body: Term, around: frozenset[str], resolve: Resolve, calls: int) -> Integral | None:
    """The body as an integral that varies with the variables around it, and whose bounds do not jump with them."""
    match body:
        case Integral():
            jumps = any(isinstance(n, Branch | App) for pair in body.bounds for b in pair for n in postorder(b))
            return body if body.free & around and not jumps else None
        case Prim(op="neg", args=(arg,)):
            inner = _inner(arg, around, resolve, calls)
            return None if inner is None else _over(inner, apply("neg", inner.body))
        case Prim(op="div", args=(above, below)) if not _heavy(below):
            inner = _inner(above, around, resolve, calls)
            return None if inner is None else _with(inner, body, 0)
        case Prim(op="mul"):
            return _among_factors(body, around, resolve, calls)
        case If() if is_guard(body) and body.condition.free.isdisjoint(around):
            inner = _inner(body.then, around, resolve, calls)
            if inner is None:
                return None
            inner = bound_apart(inner, body.condition.free)
            return _over(inner, if_(body.condition, inner.body, body.orelse))
        case App():
            made = _called(body, resolve) if calls else None
            return None if made is None else _inner(made, around, resolve, calls - 1)
        case _:
            return None


def _among_factors(body: Prim, around: frozenset[str], resolve: Resolve, calls: int) -> Integral | None:
    """Of a product the only factor that is an integral, with the others inside of it."""
    heavy = [at for at, factor in enumerate(body.args) if _heavy(factor) or isinstance(factor, App)]
    found = [(at, inner) for at in heavy if (inner := _inner(body.args[at], around, resolve, calls)) is not None]
    others = [at for at in heavy if all(at != place for place, _ in found)]
    if len(found) != 1 or any(_heavy(body.args[at]) for at in others):
        return None
    at, inner = found[0]
    return _with(inner, body, at)


def _with(inner: Integral, body: Prim, at: int) -> Integral:
    """The integral with what the body does to it done to its integrand."""
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
    for _ in range(MOST_CALLS):
        if not isinstance(head, Global):
            break
        found = resolve(head)
        if found is None:
            return None
        head = found
    if not isinstance(head, Lam):
        return None
    params, body = uncurry(head, sizes_of(groups))
    args = arguments_of(head, groups)
    if len(args) != len(params) or isinstance(body, Deriv) or (isinstance(body, If) and not is_guard(body)):
        return None
    return substitute(body, dict(zip(params, args, strict=True)))
